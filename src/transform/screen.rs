//! Order amplitudes by FFT.
//!
//! Symbols (docs/model.md#the-phase-screen): h the height in µm, H half the range of h, κ the phase rate in rad/µm, and
//! j = (jx, jy) an order of the tile of nx × ny pixels (ix, iy). The amplitude of order j is
//!
//! `c_j(κ) = 1/(nx·ny) Σ exp(iκh(ix, iy)) exp(2πi (jx·ix/nx + jy·iy/ny))`.

use super::{Direction, Fft2};
use crate::height_field::HeightField;
use crate::numeric::math::sines_and_cosines;
use rayon::prelude::*;
use sunbeam_fourier::num_complex::Complex64;

/// Pixels that a thread takes at a time. Chosen: much work compared with the cost of handing it out.
pub(super) const CHUNK: usize = 4096;
/// Lanes of [`sines_and_cosines`].
const LANES: usize = 4;

/// Order amplitudes `c_j(κ)` of one tile for every order j, by FFT in double precision.
///
/// Heights are measured from the middle of their range, so that an offset of the tile costs no digits. The shift
/// multiplies all `c_j` of one κ by a common phase factor, which no reflectance depends on.
pub struct OrderTransform {
    /// Heights from the middle of their range, in µm, row-major.
    centred_um: Vec<f64>,
    /// Pixels along x.
    nx: usize,
    /// Pixels along y.
    ny: usize,
    /// H in µm.
    half_range_um: f64,
    /// The transform of the tile.
    fft: Fft2<f64>,
}

impl OrderTransform {
    /// Plans the transform of `field`.
    pub fn new(field: &HeightField) -> Self {
        let (nx, ny) = field.size();
        let (centred_um, half_range_um) = centred_heights(field);
        Self { centred_um, nx, ny, half_range_um, fft: Fft2::new(nx, ny, Direction::Positive) }
    }

    /// Pixels along x and y.
    pub fn size(&self) -> (usize, usize) {
        (self.nx, self.ny)
    }

    /// Half the range of heights, H, in µm.
    pub fn half_range_um(&self) -> f64 {
        self.half_range_um
    }

    /// The phase screen `exp(iκh)`, row-major; `kappa` in rad/µm.
    pub fn screen(&self, kappa: f64) -> Vec<Complex64> {
        let mut screen = vec![Complex64::ZERO; self.centred_um.len()];
        screen.par_chunks_mut(CHUNK).zip(self.centred_um.par_chunks(CHUNK)).for_each(|(screen, heights)| {
            for (screen, heights) in screen.chunks_mut(LANES).zip(heights.chunks(LANES)) {
                // The last group may have fewer heights than lanes.
                let phase = |i: usize| heights.get(i).map_or(0.0, |h| kappa * h);
                let found = sines_and_cosines(std::array::from_fn(phase));
                screen.iter_mut().zip(found).for_each(|(screen, (sin, cos))| *screen = Complex64::new(cos, sin));
            }
        });
        screen
    }

    /// All `c_j(κ)`: row-major `[jy][jx]` in FFT order; `kappa` in rad/µm. `Σ|c_j|² = 1`.
    pub fn amplitudes(&self, kappa: f64) -> Vec<Complex64> {
        let mut bins = self.screen(kappa);
        self.fft.process(&mut bins, &mut Vec::new());
        let scale = 1.0 / bins.len() as f64;
        bins.par_iter_mut().with_min_len(CHUNK).for_each(|c| *c *= scale);
        bins
    }
}

/// Heights from the middle of their range (row-major), and half the range H; both in µm.
pub(super) fn centred_heights(field: &HeightField) -> (Vec<f64>, f64) {
    let (low, high) = field.range_um();
    let mid = low + 0.5 * (high - low);
    (field.heights_um().iter().map(|h| h - mid).collect(), 0.5 * (high - low))
}
