//! Conversions and messages that the arguments of several commands share.

use std::fmt::Display;
use std::ops::RangeInclusive;
use sunbeam::scattering::Vec3;

/// Wavelengths in nm over which colours are integrated: the range of the library's table of the illuminant D65.
pub(crate) const VISIBLE_NM: RangeInclusive<f64> = 380.0..=780.0;
/// Shortest wavelength of [`VISIBLE_NM`] in µm, at which phases are largest.
pub(crate) const SHORTEST_VISIBLE_UM: f64 = *VISIBLE_NM.start() * 1e-3;

/// Unit vector `(sinθ cosφ, sinθ sinφ, cosθ)`: θ is the angle with the normal +z, φ the azimuth from +x towards +y.
pub(crate) fn direction_from_degrees(theta_deg: f64, phi_deg: f64) -> Vec3 {
    let (sin_theta, cos_theta) = theta_deg.to_radians().sin_cos();
    let (sin_phi, cos_phi) = phi_deg.to_radians().sin_cos();
    [sin_theta * cos_phi, sin_theta * sin_phi, cos_theta]
}

/// Error message for the argument `--name` whose value is not accepted. `accepted` follows "must be".
pub(crate) fn out_of_range(name: &str, found: impl Display, accepted: &str) -> String {
    format!("parameter {name:?} is {found}, but must be {accepted}")
}
