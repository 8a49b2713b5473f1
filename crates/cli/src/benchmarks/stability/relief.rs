//! Reliefs and random directions for the sweeps.
//!
//! Parameters: `(nx, ny)` are the numbers of pixels along x and y, each at least 1, and `(dx_um, dy_um)` the edges of a
//! pixel in µm. Arrays of heights are `[row along y][column along x]`.

use crate::arguments::direction_from_degrees;
use ndarray::Array2;
use std::f64::consts::TAU;
use sunbeam::height_field::random::Random;
use sunbeam::height_field::{HeightField, HeightFieldError};
use sunbeam::scattering::Vec3;

/// The rough relief of the sweeps over depth and angle of incidence: 17 × 13 pixels of 0.11 × 0.23 µm, with heights
/// from 0 to `height_um`.
///
/// The numbers of pixels are different primes, so that no Fourier transform splits into shorter ones. The pixels are
/// not square, so that an exchange of x and y would show.
pub(super) fn rough_of_primes(height_um: f64) -> Result<HeightField, HeightFieldError> {
    // The seed is arbitrary.
    rough(&mut Random::new(7), (17, 13), (0.11, 0.23), height_um)
}

/// A rough relief: independent heights, uniform between 0 and `height_um`. Both limits occur; a single pixel has the
/// height `height_um`.
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

/// One period of a sinusoid along x, `½·height·(1 + sin(2πx/period))`: a square tile of `nx` columns and a single row.
pub(super) fn sinusoid(nx: usize, period_um: f64, height_um: f64) -> Result<HeightField, HeightFieldError> {
    let height = |(_, ix): (usize, usize)| 0.5 * height_um * (1.0 + (TAU * ix as f64 / nx as f64).sin());
    HeightField::new(Array2::from_shape_fn((1, nx), height), period_um / nx as f64, period_um)
}

/// A ridge along y of the height `height_um`, which covers the first third of the tile's width along x.
pub(super) fn step(
    (nx, ny): (usize, usize),
    (dx_um, dy_um): (f64, f64),
    height_um: f64,
) -> Result<HeightField, HeightFieldError> {
    let height = |(_, ix): (usize, usize)| if 3 * ix < nx { height_um } else { 0.0 };
    HeightField::new(Array2::from_shape_fn((ny, nx), height), dx_um, dy_um)
}

/// A random direction, uniform in solid angle over the upper hemisphere.
pub(super) fn uniform_direction(random: &mut Random) -> Vec3 {
    // Equal ranges of cosθ have equal solid angles, so cosθ is uniform in (0, 1].
    let cos_theta = 1.0 - random.unit();
    direction_from_degrees(cos_theta.acos().to_degrees(), random.between(-180.0, 180.0))
}
