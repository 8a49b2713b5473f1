//! Interface between the solver and the tables: efficiencies of all orders at one incidence.

use super::GratingError;

/// A source of efficiencies: the solver, or a closed form in tests.
pub(super) trait Orders: Sync {
    /// Unpolarised efficiencies between all orders that propagate at the coordinates `t` and `b` of `place.rs`, one
    /// matrix per wavelength in nm: `[incident · orders + outgoing]`. Each order is taken as the incident wave once.
    /// Orders are counted from the one that leaves furthest towards −x.
    ///
    /// For wavelengths above `period/t`, where ky is imaginary, the analytic continuation of shorter wavelengths.
    ///
    /// # Errors
    /// An incidence whose solution does not conserve power well enough.
    fn efficiencies(&self, t: f64, b: f64, wavelengths_nm: &[f64]) -> Result<Vec<Vec<f64>>, GratingError>;
}
