//! Band limit of the power spectrum from which an ensemble's nodes are computed, along one axis.
//!
//! Nodes of the ensemble are the transform of the autocorrelation times the window. The autocorrelation is itself the
//! transform of a power spectrum. A scan with fine pixels has powers far beyond the frequencies that any pair of
//! directions asks for ([`super::FREQUENCY_MAX_PER_UM`]). They reach the nodes only as far as the window spreads them.
//! So the spectrum is cut a margin beyond those frequencies, and the autocorrelation needs fewer pixels. The cut is
//! smooth, since a sharp one would lengthen the autocorrelation.

use super::FREQUENCY_MAX_PER_UM;
use super::lattice::LatticeAxis;
use sunbeam_fourier::next_fast_len;

/// Margin above [`FREQUENCY_MAX_PER_UM`] within which powers are kept, in node spacings per tap of the interpolation
/// kernel. The kernel is about as wide as the window spreads powers. With both margins the table's error stays that of
/// the interpolation, for tolerances from 1e-2 to 1e-6.
const KEPT_MARGIN: f64 = 3.0;
/// Width of the transition from kept to cut, in the same unit.
const TRANSITION: f64 = 12.0;
/// Margin from [`FREQUENCY_MAX_PER_UM`] to the end of the spectrum, in the same unit.
pub(super) const BAND_MARGIN: f64 = KEPT_MARGIN + TRANSITION;

/// Weights of the kept frequencies along one axis.
pub(super) struct Band {
    /// Factor on each bin, FFT order; one bin per pixel of the autocorrelation.
    pub weights: Vec<f64>,
}

impl Band {
    /// Pixels of an autocorrelation over `lags` pixels of `pixel_um` whose spectrum ends at `edge` cycles/µm; at most
    /// `lags`.
    pub(super) fn pixels(lags: usize, pixel_um: f64, edge: f64) -> usize {
        // The conversion saturates for any number of pixels.
        next_fast_len(((2.0 * edge * lags as f64 * pixel_um).ceil() as usize).saturating_add(1)).min(lags)
    }

    /// Pixels of the autocorrelation over `length_um` for a planned axis.
    pub(super) fn kept(axis: &LatticeAxis, length_um: f64) -> usize {
        (length_um * axis.pixels as f64 / axis.period_um).round() as usize
    }

    /// The band of an axis that was planned for `lags` pixels of `pixel_um`. The transition is an error function that
    /// ends within about `tolerance` of 1 and 0.
    pub(super) fn new(axis: &LatticeAxis, lags: usize, pixel_um: f64, tolerance: f64) -> Self {
        let length_um = lags as f64 * pixel_um;
        let kept = Self::kept(axis, length_um);
        if kept >= lags {
            return Self { weights: vec![1.0; lags] };
        }
        let low = FREQUENCY_MAX_PER_UM + KEPT_MARGIN * axis.taps as f64 / axis.period_um;
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
    use super::super::lattice::plan_lattice;
    use super::super::{CoherenceWindow, Model, Tiling};
    use super::*;

    const TOLERANCE: f64 = 1e-4;

    fn axis(pixels: usize, pixel_um: f64) -> LatticeAxis {
        let (size, pixel_um) = ((pixels, pixels), (pixel_um, pixel_um));
        let window = CoherenceWindow::from_sigma_um(16.0);
        plan_lattice(size, pixel_um, Model::Ensemble, Tiling::Aperiodic, window, TOLERANCE).x
    }

    #[test]
    fn weights_fall_smoothly_from_one_to_zero() {
        let (axis, lags) = (axis(512, 0.025), 1024);
        let weights = Band::new(&axis, lags, 0.025, TOLERANCE).weights;
        assert!(weights.len() < lags / 2, "{}", weights.len());
        let half = weights.len() / 2;
        for (bin, &weight) in weights[..=half].iter().enumerate() {
            let frequency = bin as f64 / (0.025 * lags as f64);
            assert!(frequency > FREQUENCY_MAX_PER_UM || weight > 1.0 - TOLERANCE, "{frequency}: {weight}");
            assert!(bin == 0 || (0.0..0.1).contains(&(weights[bin - 1] - weight)), "{frequency}: {weight}");
            assert_eq!(weight, weights[(weights.len() - bin) % weights.len()]);
        }
        assert!(weights[half] < TOLERANCE, "{}", weights[half]);
    }

    #[test]
    fn coarse_pixels_are_all_kept() {
        let axis = axis(100, 0.065);
        assert!((axis.period_um / axis.pixels as f64 - 0.065).abs() < 1e-12);
        assert_eq!(Band::new(&axis, 200, 0.065, TOLERANCE).weights, [1.0; 200]);
    }

    #[test]
    fn finer_pixels_do_not_enlarge_the_lattice() {
        let (fine, finer) = (axis(512, 0.025), axis(2048, 0.00625));
        assert_eq!((fine.pixels, fine.reach), (finer.pixels, finer.reach));
    }
}
