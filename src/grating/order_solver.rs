//! Interface of a grating's tables to the solver of its orders.

use super::GratingError;
use super::jones_shape::JonesShape;

/// A solver of one grating at any incidence and wavelength (symbols: `mod.rs`). Tests replace it by closed forms.
pub(super) trait OrderSolver: Sync {
    /// Unpolarised efficiencies between all orders that propagate at `t` and the Bloch phase `b`.
    ///
    /// Returns one matrix for each wavelength in nm, with the elements `[incident · orders + outgoing]`. Both are order
    /// numbers, and `orders` is how many orders propagate. A wavelength above `d/t` has an imaginary wave number along
    /// the grooves; the result is then the analytic continuation from shorter wavelengths, which interpolation needs.
    ///
    /// # Errors
    /// A point (t, b) that cannot be solved accurately enough.
    fn efficiencies(&self, t: f64, b: f64, wavelengths_nm: &[f64]) -> Result<Vec<Vec<f64>>, GratingError>;

    /// Sides of the relief, 1 or 2. With two, channels take the place of orders ([`EfficiencyLayout`]).
    ///
    /// [`EfficiencyLayout`]: super::EfficiencyLayout
    fn sides(&self) -> usize {
        1
    }
}

/// A solver that also gives polarisation.
pub(super) trait ShapeSolver: OrderSolver {
    /// Shapes of the Jones matrices between all orders, arranged like [`OrderSolver::efficiencies`].
    ///
    /// # Errors
    /// A point that cannot be solved accurately enough.
    fn shapes(&self, t: f64, b: f64, wavelengths_nm: &[f64]) -> Result<Vec<Vec<JonesShape>>, GratingError>;
}
