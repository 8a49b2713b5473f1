//! Presets `flat`, `blazed`, `sinusoidal` and `lamellar` by closed forms. Heights and lengths are in µm.
//!
//! The tile of a grating, the part that repeats, is one row of [`PIXELS`] pixels over one period along x. The height
//! does not depend on y, so the pixel size along y is free. It is the period, which makes the tile square.

use super::preset::PIXELS;
use super::{HeightField, HeightFieldError};
use ndarray::Array2;
use std::f64::consts::TAU;

/// One pixel of 1 × 1 µm at height 0.
pub(super) fn flat() -> Result<HeightField, HeightFieldError> {
    HeightField::new(Array2::zeros((1, 1)), 1.0, 1.0)
}

/// A grating sampled at pixel centres. `profile` gets x/period, in (0, 1), and returns height/`height_um`, in [0, 1].
fn grating(period_um: f64, height_um: f64, profile: impl Fn(f64) -> f64) -> Result<HeightField, HeightFieldError> {
    let height = |ix: usize| height_um * profile((ix as f64 + 0.5) / PIXELS as f64);
    let heights = Array2::from_shape_fn((1, PIXELS), |(_, ix)| height(ix));
    HeightField::new(heights, period_um / PIXELS as f64, period_um)
}

/// A sawtooth that rises along +x from 0 to `height_um` and drops at the end of the period. The samples stop half a
/// pixel short of both ends.
pub(super) fn blazed(period_um: f64, height_um: f64) -> Result<HeightField, HeightFieldError> {
    grating(period_um, height_um, |fraction| fraction)
}

/// `height_um/2 · (1 + sin(2πx/period_um))`. The sine is that of the crate `libm`, which is equal on every machine.
pub(super) fn sinusoidal(period_um: f64, height_um: f64) -> Result<HeightField, HeightFieldError> {
    grating(period_um, height_um, |fraction| 0.5 * (1.0 + libm::sin(TAU * fraction)))
}

/// `height_um` over the first half of the period, 0 over the second. The halves are equal, since [`PIXELS`] is even.
pub(super) fn lamellar(period_um: f64, height_um: f64) -> Result<HeightField, HeightFieldError> {
    grating(period_um, height_um, |fraction| if fraction < 0.5 { 1.0 } else { 0.0 })
}
