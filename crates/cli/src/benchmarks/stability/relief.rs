//! Reliefs for the sweeps.

use ndarray::Array2;
use std::f64::consts::TAU;
use sunbeam::height_field::random::Random;
use sunbeam::height_field::{HeightField, HeightFieldError};
use sunbeam::scattering::Vec3;

/// A rough relief whose heights lie evenly between 0 and `height_um` and reach both.
pub(super) fn rough(
    random: &mut Random,
    (nx, ny): (usize, usize),
    (dx_um, dy_um): (f64, f64),
    height_um: f64,
) -> Result<HeightField, HeightFieldError> {
    let mut heights = Array2::from_shape_simple_fn((ny, nx), || height_um * random.unit());
    heights[[0, 0]] = 0.0;
    heights[[ny - 1, nx - 1]] = height_um;
    HeightField::new(heights, dx_um, dy_um)
}

/// `½·height·(1 + sin(2πx/L))` along x.
pub(super) fn sinusoid(nx: usize, period_um: f64, height_um: f64) -> Result<HeightField, HeightFieldError> {
    let height = |(_, ix): (usize, usize)| 0.5 * height_um * (1.0 + (TAU * ix as f64 / nx as f64).sin());
    HeightField::new(Array2::from_shape_fn((1, nx), height), period_um / nx as f64, period_um)
}

/// A step edge across x, a third of the tile wide.
pub(super) fn step(
    (nx, ny): (usize, usize),
    (dx_um, dy_um): (f64, f64),
    height_um: f64,
) -> Result<HeightField, HeightFieldError> {
    let height = |(_, ix): (usize, usize)| if 3 * ix < nx { height_um } else { 0.0 };
    HeightField::new(Array2::from_shape_fn((ny, nx), height), dx_um, dy_um)
}

/// The direction at `theta` from the normal and `phi` from the tangent, in degrees.
pub(super) fn direction(theta: f64, phi: f64) -> Vec3 {
    let ((st, ct), (sp, cp)) = (theta.to_radians().sin_cos(), phi.to_radians().sin_cos());
    [st * cp, st * sp, ct]
}

/// Uniform over the upper hemisphere.
pub(super) fn anywhere(random: &mut Random) -> Vec3 {
    let theta = (1.0 - random.unit()).acos().to_degrees();
    direction(theta, random.between(-180.0, 180.0))
}
