//! Amplitudes of diffraction orders by FFT.
//!
//! - h(ix, iy): height in µm of pixel (ix, iy), from the middle of the range of heights. H: half that range. The tile
//!   has nx × ny pixels.
//! - κ: phase rate in rad per µm of height. The *phase screen* is `exp(iκh)`.
//! - `c_j(κ) = 1/(nx·ny) Σ exp(iκh(ix, iy))·exp(+2πi(jx·ix/nx + jy·iy/ny))`: amplitude of the order j = (jx, jy), with
//!   the sum over all pixels (docs/model.md#the-phase-screen).

use super::{Direction, Fft2};
use crate::height_field::HeightField;
use crate::numeric::math::sines_and_cosines;
use rayon::prelude::*;
use sunbeam_fourier::num_complex::Complex64;

/// Number of pixels that a thread takes at a time. Smaller chunks spend more time on scheduling; larger ones leave
/// threads without work at the end.
pub(super) const CHUNK: usize = 4096;
/// Number of angles in a call of [`sines_and_cosines`], which computes them side by side.
const ANGLES: usize = 4;

/// Order amplitudes `c_j(κ)` of one tile for every order j, by FFT in double precision.
///
/// Heights are measured from the middle of their range, so that an offset of all heights costs no precision. The shift
/// multiplies all `c_j` of one κ by a common phase factor, on which no reflectance depends.
pub struct OrderTransform {
    /// Heights from the middle of their range, in µm, row-major.
    centred_um: Vec<f64>,
    /// Number of pixels along x.
    nx: usize,
    /// Number of pixels along y.
    ny: usize,
    /// H in µm.
    half_range_um: f64,
    /// Transform over the pixels of the tile.
    fft: Fft2<f64>,
}

impl OrderTransform {
    /// Plans the transform of `field`.
    pub fn new(field: &HeightField) -> Self {
        let (nx, ny) = field.size();
        let (centred_um, half_range_um) = centred_heights(field);
        Self { centred_um, nx, ny, half_range_um, fft: Fft2::new(nx, ny, Direction::Positive) }
    }

    /// Numbers of pixels along x and y.
    pub fn size(&self) -> (usize, usize) {
        (self.nx, self.ny)
    }

    /// Half the range of heights, H, in µm.
    pub fn half_range_um(&self) -> f64 {
        self.half_range_um
    }

    /// Phase screen `exp(iκh)` of the centred heights at `kappa` in rad/µm, `[iy][ix]`.
    pub fn screen(&self, kappa: f64) -> Vec<Complex64> {
        let mut screen = vec![Complex64::ZERO; self.centred_um.len()];
        screen.par_chunks_mut(CHUNK).zip(self.centred_um.par_chunks(CHUNK)).for_each(|(screen, heights)| {
            for (pixels, heights) in screen.chunks_mut(ANGLES).zip(heights.chunks(ANGLES)) {
                // The last group may have fewer heights.
                let phase = |i: usize| heights.get(i).map_or(0.0, |h| kappa * h);
                let found = sines_and_cosines(std::array::from_fn(phase));
                pixels.iter_mut().zip(found).for_each(|(pixel, (sin, cos))| *pixel = Complex64::new(cos, sin));
            }
        });
        screen
    }

    /// All `c_j(κ)` of the centred heights at `kappa` in rad/µm, `[jy][jx]` in FFT order: from order 0 upwards, then
    /// the negative orders. `Σ|c_j|² = 1`.
    pub fn amplitudes(&self, kappa: f64) -> Vec<Complex64> {
        let mut bins = self.screen(kappa);
        self.fft.process(&mut bins, &mut Vec::new());
        let scale = 1.0 / bins.len() as f64;
        bins.par_iter_mut().with_min_len(CHUNK).for_each(|c| *c *= scale);
        bins
    }
}

/// Heights from the middle of their range, `[iy][ix]`, and half the range H; both in µm.
pub(super) fn centred_heights(field: &HeightField) -> (Vec<f64>, f64) {
    let (low, high) = field.range_um();
    let middle = low + 0.5 * (high - low);
    (field.heights_um().iter().map(|h| h - middle).collect(), 0.5 * (high - low))
}
