//! Traits of the solvers behind a grating's tables (symbols: `mod.rs`).

use super::GratingError;
use super::jones_shape::JonesShape;

/// A solver of one grating at any incidence and wavelength. Tests replace it by closed forms.
///
/// An incidence is given by t and b. `t = (d/λ)·√(1 − y²)`, with the period d and the direction cosine y along the
/// grooves, bounds the wave numbers along x of orders that propagate in air. b is the Bloch phase, the fractional part
/// of these wave numbers. Both are in units of 2π/d.
pub(super) trait OrderSolver: Sync {
    /// Unpolarised efficiencies between all orders that propagate at `t` and the Bloch phase `b`.
    ///
    /// Returns one matrix for each wavelength in nm, with the elements `[incident · orders + outgoing]`. Both are order
    /// numbers, from 0 by ascending m, and `orders` is the number of orders that propagate. A wavelength above `d/t`
    /// has an imaginary wave number along the grooves; the result is then the analytic continuation from shorter
    /// wavelengths, which interpolation needs. It may be negative.
    ///
    /// # Errors
    /// A point (t, b) that cannot be solved accurately enough.
    fn efficiencies(&self, t: f64, b: f64, wavelengths_nm: &[f64]) -> Result<Vec<Vec<f64>>, GratingError>;

    /// Number of sides of the relief on which light arrives and leaves, 1 or 2. With two sides, channels take the place
    /// of orders in the matrices: all orders above, then all below ([`EfficiencyLayout`]).
    ///
    /// [`EfficiencyLayout`]: super::EfficiencyLayout
    fn sides(&self) -> usize {
        1
    }
}

/// A solver that also gives polarisation.
pub(super) trait ShapeSolver: OrderSolver {
    /// Shapes of the Jones matrices between all orders, arranged like [`OrderSolver::efficiencies`]. A shape is a
    /// matrix of unit power.
    ///
    /// # Errors
    /// A point that cannot be solved accurately enough.
    fn shapes(&self, t: f64, b: f64, wavelengths_nm: &[f64]) -> Result<Vec<Vec<JonesShape>>, GratingError>;
}
