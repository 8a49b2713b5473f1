//! Conversions and messages that the arguments of several commands share.

use std::fmt::Display;
use std::ops::RangeInclusive;
use sunbeam::scattering::Vec3;

/// Wavelengths in nm over which colours are integrated, the range of the library's standard illuminant D65.
pub(crate) const VISIBLE_NM: RangeInclusive<f64> = 380.0..=780.0;

/// The unit vector at an angle with the normal and an azimuth from +x towards +y, both in degrees.
pub(crate) fn direction_from_degrees(theta_deg: f64, phi_deg: f64) -> Vec3 {
    let ((sin, cos), (sin_phi, cos_phi)) = (theta_deg.to_radians().sin_cos(), phi_deg.to_radians().sin_cos());
    [sin * cos_phi, sin * sin_phi, cos]
}

/// The message for the argument `--name` with a value outside the accepted ones.
pub(crate) fn out_of_range(name: &str, found: impl Display, accepted: &str) -> String {
    format!("parameter {name:?} is {found}, but must be {accepted}")
}
