//! Direct sum for the amplitude of a diffraction order of a tile of nx × ny pixels with the heights h(ix, iy) in µm:
//!
//! `c_j(κ) = 1/(nx·ny) Σ exp(iκh(ix, iy))·exp(+2πi(jx·ix/nx + jy·iy/ny))` for the order j = (jx, jy) and the phase rate
//! κ in rad per µm of height, with the sum over all pixels (docs/model.md#the-phase-screen).

use crate::height_field::HeightField;
use std::f64::consts::TAU;
use sunbeam_fourier::num_complex::Complex64;

/// Amplitude `c_j(κ)` of the order `(jx, jy)` at `kappa` (rad/µm), summed over the pixels of the tile in double
/// precision. It is the reference for all faster methods.
///
/// Heights are those of `field`. Faster methods measure them from the middle of their range, which changes the phase.
pub fn naive_order_amplitude(field: &HeightField, kappa: f64, jx: i64, jy: i64) -> Complex64 {
    let (nx, ny) = field.size();
    // Fraction of a turn of `j·i/n`, without rounding of large products.
    let turns = |j: i64, i: usize, n: usize| (j * i as i64).rem_euclid(n as i64) as f64 / n as f64;
    let mut sum = Complex64::new(0.0, 0.0);
    for ((iy, ix), &height_um) in field.heights_um().indexed_iter() {
        sum += Complex64::cis(kappa * height_um + TAU * (turns(jx, ix, nx) + turns(jy, iy, ny)));
    }
    sum / (nx * ny) as f64
}
