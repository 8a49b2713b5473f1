//! Traits of the solvers behind a grating's tables (symbols: `mod.rs`).

use super::GratingError;
use super::jones_shape::JonesShape;

/// A solver of one grating at any incidence and wavelength. Tests implement it by closed forms.
///
/// An incidence is given by two numbers in units of 2π/d, with the period d. The Bloch phase b is the component of a
/// wave vector along x, the direction in the surface across the grooves. It is that of order 0, and order m has
/// `b + m`. The bound t is the largest component along x of a wave in air: `t = (d/λ)·√(1 − y²)` with the direction
/// cosine y along the grooves. So order m propagates in air where `|b + m| < t`. Adding an integer to b only renumbers
/// the orders.
pub(super) trait OrderSolver: Sync {
    /// Efficiencies (fractions of unpolarised power) between all orders that propagate at `t` and the Bloch phase `b`.
    ///
    /// Returns one matrix for each wavelength in nm, with the efficiency from order number `incident` to order number
    /// `outgoing` at `[incident · orders + outgoing]`. Order numbers count from 0 by ascending m, and `orders` is the
    /// number of orders that propagate.
    ///
    /// Wavelengths may exceed `d/t`, although y² is then negative and no light has them: look-ups interpolate between
    /// such a wavelength and the next shorter one. Efficiencies there are the analytic continuation in y², and may be
    /// negative.
    ///
    /// # Errors
    /// A point (t, b) that cannot be solved accurately enough.
    fn efficiencies(&self, t: f64, b: f64, wavelengths_nm: &[f64]) -> Result<Vec<Vec<f64>>, GratingError>;

    /// Number of sides of the relief on which light arrives and leaves: 1 if the grating only reflects, 2 if it also
    /// transmits to air below it, as a film does. With two sides, the orders that propagate in air exist on both. The
    /// matrices then have channels in place of orders: all orders above, then the same orders below
    /// ([`EfficiencyLayout`]).
    ///
    /// [`EfficiencyLayout`]: super::EfficiencyLayout
    fn sides(&self) -> usize {
        1
    }
}

/// A solver that also gives polarisation.
pub(super) trait ShapeSolver: OrderSolver {
    /// Jones matrices between all orders, scaled to power 1 ([`JonesShape`]) and arranged like
    /// [`OrderSolver::efficiencies`].
    ///
    /// # Errors
    /// A point that cannot be solved accurately enough.
    fn shapes(&self, t: f64, b: f64, wavelengths_nm: &[f64]) -> Result<Vec<Vec<JonesShape>>, GratingError>;
}
