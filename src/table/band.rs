//! The part of a power spectrum that nodes are made of.
//!
//! Nodes of the ensemble are transforms of a windowed autocorrelation, which is itself the transform of a power spectrum. A scan
//! with fine pixels has powers far beyond any frequency that two directions can ask for. They count for nothing but their
//! neighbours, as far as the window spreads them. So the spectrum is cut a margin beyond what is asked for, and the
//! autocorrelation then needs few pixels. It is cut smoothly, so that the autocorrelation stays as short as it was.

use super::lattice::LatticeAxis;
use sunbeam_fourier::next_fast_len;

/// How far beyond what is asked for the spectrum goes, in taps of the joining, which are about as wide as what the window
/// spreads; and how far beyond that it falls. With these the error stays that of the joining, from a tolerance of 1e-2 to 1e-6.
const KEPT_MARGIN: f64 = 3.0;
const FALL_MARGIN: f64 = 12.0;
/// Both together.
pub(super) const BAND_MARGIN: f64 = KEPT_MARGIN + FALL_MARGIN;

/// What is kept of the frequencies along one axis.
pub(super) struct Band {
    /// What each bin is multiplied by, FFT order; as many bins as the autocorrelation has pixels.
    pub weights: Vec<f64>,
}

impl Band {
    /// Pixels that an autocorrelation over `lags` pixels of `pixel_um` has when its spectrum ends at `edge` cycles/µm; at most `lags`.
    pub fn pixels(lags: usize, pixel_um: f64, edge: f64) -> usize {
        // Beyond any number of pixels the conversion saturates.
        next_fast_len(((2.0 * edge * lags as f64 * pixel_um).ceil() as usize).saturating_add(1)).min(lags)
    }

    /// Pixels of the autocorrelation over `length_um` for an axis that was planned for it.
    pub fn kept(axis: &LatticeAxis, length_um: f64) -> usize {
        (length_um * axis.pixels as f64 / axis.period_um).round() as usize
    }

    /// The band of an axis that was planned for `lags` pixels of `pixel_um`, frequencies up to `frequency_max` and `tolerance`.
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
    fn all_that_is_asked_for_is_kept_and_the_end_is_reached_smoothly() {
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
    fn coarse_pixels_are_kept_as_they_are() {
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
