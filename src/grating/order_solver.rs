//! The solver of a grating's orders, as tables call it.

use super::GratingError;

/// Efficiencies of all orders at any incidence and wavelength (symbols: `mod.rs`).
pub(super) trait OrderSolver: Sync {
    /// Unpolarised efficiencies between all orders that propagate at `t` and the Bloch phase `b`.
    ///
    /// Returns one matrix for each wavelength in nm, `[incident · orders + outgoing]`. Orders are counted from the one
    /// with the least x component. A wavelength above `d/t` has an imaginary wave number along the grooves: the result
    /// is then the analytic continuation from shorter wavelengths, which interpolation needs.
    ///
    /// # Errors
    /// A point that cannot be solved accurately enough.
    fn efficiencies(&self, t: f64, b: f64, wavelengths_nm: &[f64]) -> Result<Vec<Vec<f64>>, GratingError>;
}
