use super::{Direction, Fft2};
use crate::height_field::HeightField;
use crate::numeric::math::sines_and_cosines;
use rayon::prelude::*;
use sunbeam_fourier::num_complex::Complex64;

/// Transforms the phase screen of one tile at any κ: `c_j(κ)` for every order `j`, by FFT in double precision.
///
/// Heights are taken about the middle of their range, which turns all `c_j` of one κ by a common phase and leaves
/// every reflectance as it is; a tile that lies 1 mm up loses no digits.
pub struct OrderTransform {
    /// Heights about the middle of their range, in µm, row-major.
    centred_um: Vec<f64>,
    nx: usize,
    ny: usize,
    half_range_um: f64,
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

    /// The phase screen `exp(iκh)` itself, row-major, `kappa` in rad/µm.
    pub fn screen(&self, kappa: f64) -> Vec<Complex64> {
        let mut screen = vec![Complex64::ZERO; self.centred_um.len()];
        screen.par_chunks_mut(4096).zip(self.centred_um.par_chunks(4096)).for_each(|(screen, heights)| {
            for (screen, heights) in screen.chunks_mut(4).zip(heights.chunks(4)) {
                let phase = |i: usize| heights.get(i).map_or(0.0, |h| kappa * h);
                let found = sines_and_cosines(std::array::from_fn(phase));
                screen.iter_mut().zip(found).for_each(|(screen, (sin, cos))| *screen = Complex64::new(cos, sin));
            }
        });
        screen
    }

    /// Every `c_j(κ)`, bins in FFT order, row-major `[jy][jx]`; `kappa` in rad/µm. `Σ|c_j|² = 1`.
    pub fn amplitudes(&self, kappa: f64) -> Vec<Complex64> {
        let mut bins = self.screen(kappa);
        self.fft.process(&mut bins, &mut Vec::new());
        let scale = 1.0 / bins.len() as f64;
        bins.par_iter_mut().with_min_len(4096).for_each(|c| *c *= scale);
        bins
    }
}

/// Heights about the middle of their range, row-major in µm, and the half range H.
pub(super) fn centred_heights(field: &HeightField) -> (Vec<f64>, f64) {
    let (low, high) = field.range_um();
    let mid = low + 0.5 * (high - low);
    (field.heights_um().iter().map(|h| h - mid).collect(), 0.5 * (high - low))
}
