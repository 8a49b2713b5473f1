//! Traits of the solvers behind a grating's tables (symbols: `mod.rs`).

use super::GratingError;
use super::jones_shape::JonesShape;

/// A solver of one grating at any incidence and wavelength. Tests implement it by closed forms.
///
/// An incidence is given by the lengths t and b of parts of its wave vector, in units of 2π/d with the period d. t is
/// the part in air across the grooves: `t = (d/λ)·√(1 − y²)` with the direction cosine y along the grooves. b is the
/// component along x, the direction in the surface across the grooves. Order m has the wave number `b + m` along x, and
/// propagates in air where `|b + m| < t`. The Bloch phase b matters only up to an integer, so it may be the wave number
/// of any order.
pub(super) trait OrderSolver: Sync {
    /// Efficiencies (fractions of unpolarised power) between all orders that propagate at `t` and the Bloch phase `b`.
    ///
    /// Returns one matrix for each wavelength in nm, with the efficiency from order number `incident` to order number
    /// `outgoing` at `[incident · orders + outgoing]`. Order numbers count from 0 by ascending m, and `orders` is the
    /// number of orders that propagate. Tables have all wavelengths at every t. No light has a wavelength above `d/t`,
    /// where y² would be negative. The efficiencies there are the analytic continuation from shorter wavelengths,
    /// which interpolation needs, and may be negative.
    ///
    /// # Errors
    /// A point (t, b) that cannot be solved accurately enough.
    fn efficiencies(&self, t: f64, b: f64, wavelengths_nm: &[f64]) -> Result<Vec<Vec<f64>>, GratingError>;

    /// Number of sides of the relief on which light arrives and leaves: 1 if the grating only reflects, 2 if it also
    /// transmits. With two sides, the matrices have channels in place of orders, twice as many: all orders above, then
    /// all orders below ([`EfficiencyLayout`]).
    ///
    /// [`EfficiencyLayout`]: super::EfficiencyLayout
    fn sides(&self) -> usize {
        1
    }
}

/// A solver that also gives polarisation.
pub(super) trait ShapeSolver: OrderSolver {
    /// Normalised Jones matrices between all orders ([`JonesShape`]), arranged like [`OrderSolver::efficiencies`].
    ///
    /// # Errors
    /// A point that cannot be solved accurately enough.
    fn shapes(&self, t: f64, b: f64, wavelengths_nm: &[f64]) -> Result<Vec<Vec<JonesShape>>, GratingError>;
}
