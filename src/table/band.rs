//! Band of a power spectrum that an autocorrelation is computed from.
//!
//! Nodes of the ensemble are transforms of a windowed autocorrelation, itself the transform of a power spectrum. A scan
//! of fine pixels has power far beyond the largest frequency of a look-up. There it only matters to frequencies as near
//! as the window spreads it. So the spectrum is cut a margin beyond the largest frequency, and the autocorrelation
//! needs fewer pixels. The cut is smooth, so that it does not lengthen the autocorrelation.
//!
//! - `f_max`: largest frequency of a look-up in cycles/µm. `1/P`: spacing of the lattice's nodes (lattice.rs).
//! - Weights of the bins: 1 up to `low = f_max + 3·taps/P`, then `½·erfc` down to about the tolerance at `high`.
//! - `high = f_max + 15·taps/P` at least: the Nyquist frequency of the pixels that the autocorrelation keeps.

use super::lattice::LatticeAxis;
use sunbeam_fourier::next_fast_len;

/// Distance from the largest frequency to where the weights begin to fall, in widths `taps/P` of the interpolation
/// kernel. The window spreads power over about one such width. Chosen, with [`FALL_MARGIN`], so that the table's error
/// is that of the interpolation at tolerances from 1e-2 to 1e-6.
const KEPT_MARGIN: f64 = 3.0;
/// Width of the fall in widths `taps/P`; a steeper fall would lengthen the autocorrelation.
const FALL_MARGIN: f64 = 12.0;
/// Distance from the largest frequency to the end of the band, in widths `taps/P`.
pub(super) const BAND_MARGIN: f64 = KEPT_MARGIN + FALL_MARGIN;

/// Weights of a power spectrum's bins along one axis.
pub(super) struct Band {
    /// Weight of each bin in [0, 1], FFT order; one bin for each pixel of the autocorrelation.
    pub weights: Vec<f64>,
}

impl Band {
    /// Pixels of an autocorrelation over the length `lags · pixel_um`, when its spectrum ends at `edge` cycles/µm. At
    /// most `lags`.
    pub fn pixels(lags: usize, pixel_um: f64, edge: f64) -> usize {
        // The conversion saturates for lengths beyond any number of pixels.
        next_fast_len(((2.0 * edge * lags as f64 * pixel_um).ceil() as usize).saturating_add(1)).min(lags)
    }

    /// Pixels of the autocorrelation over `length_um`, from an axis that was planned with [`Band::pixels`].
    pub fn kept(axis: &LatticeAxis, length_um: f64) -> usize {
        (length_um * axis.pixels as f64 / axis.period_um).round() as usize
    }

    /// Band of an axis that was planned for `lags` pixels of `pixel_um`, frequencies up to `frequency_max` in
    /// cycles/µm, and a relative error `tolerance`.
    pub fn new(axis: &LatticeAxis, lags: usize, pixel_um: f64, frequency_max: f64, tolerance: f64) -> Self {
        let length_um = lags as f64 * pixel_um;
        let kept = Self::kept(axis, length_um);
        if kept >= lags {
            return Self { weights: vec![1.0; lags] };
        }
        let low = frequency_max + KEPT_MARGIN * axis.taps as f64 / axis.period_um;
        let high = 0.5 * kept as f64 / length_um;
        let steepness = (1.0 / tolerance).ln().sqrt();
        let weight = |i: usize| {
            let frequency = i.min(kept - i) as f64 / length_um;
            0.5 * libm::erfc(steepness * (2.0 * frequency - low - high) / (high - low))
        };
        Self { weights: (0..kept).map(weight).collect() }
    }
}

#[cfg(test)]
mod tests {
    use super::super::spectrum::{Model, Tiling, plan_lattice};
    use super::*;

    const FREQUENCY_MAX: f64 = 5.5;
    const TOLERANCE: f64 = 1e-4;

    fn axis(pixels: usize, pixel_um: f64) -> LatticeAxis {
        let (size, pixel_um) = ((pixels, pixels), (pixel_um, pixel_um));
        plan_lattice(size, pixel_um, Model::Ensemble, Tiling::Aperiodic, 16.0, FREQUENCY_MAX, TOLERANCE).x
    }

    #[test]
    fn weights_are_one_up_to_the_largest_frequency_and_fall_smoothly() {
        let (axis, lags) = (axis(512, 0.025), 1024);
        let weights = Band::new(&axis, lags, 0.025, FREQUENCY_MAX, TOLERANCE).weights;
        assert!(weights.len() < lags / 2, "{}", weights.len());
        let half = weights.len() / 2;
        for (bin, &weight) in weights[..=half].iter().enumerate() {
            let frequency = bin as f64 / (0.025 * lags as f64);
            assert!(frequency > FREQUENCY_MAX || weight > 1.0 - TOLERANCE, "{frequency}: {weight}");
            assert!(bin == 0 || (0.0..0.1).contains(&(weights[bin - 1] - weight)), "{frequency}: {weight}");
            assert_eq!(weight, weights[(weights.len() - bin) % weights.len()]);
        }
        assert!(weights[half] < TOLERANCE, "{}", weights[half]);
    }

    #[test]
    fn coarse_pixels_keep_the_whole_spectrum() {
        let axis = axis(100, 0.065);
        assert!((axis.period_um / axis.pixels as f64 - 0.065).abs() < 1e-12);
        assert_eq!(Band::new(&axis, 200, 0.065, FREQUENCY_MAX, TOLERANCE).weights, [1.0; 200]);
    }

    #[test]
    fn finer_pixels_of_the_same_scan_make_no_larger_lattice() {
        let (fine, finer) = (axis(512, 0.025), axis(2048, 0.00625));
        assert_eq!((fine.pixels, fine.reach), (finer.pixels, finer.reach));
    }
}
