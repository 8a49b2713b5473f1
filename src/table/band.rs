//! Band limit, along one axis, of the power spectrum from which the nodes of an ensemble's table are computed (symbols:
//! `mod.rs`, and `lattice.rs` for an axis).
//!
//! An ensemble's spectrum is the mean over all positions of the coherence window. Its computation has three steps, each
//! one Fourier transform (`spectrum.rs`): from the phase screen to its power spectrum, from this to the autocorrelation
//! over *lags* (shifts of the screen), and from the autocorrelation times that of the window to the nodes of the table.
//!
//! A scan with fine pixels has power far beyond the frequencies of any pair of directions
//! ([`super::FREQUENCY_MAX_PER_UM`]). The window spreads power over a few node spacings, so most of the power beyond
//! does not reach the nodes. The power spectrum is therefore cut at a margin beyond those frequencies, and the
//! autocorrelation needs fewer and larger pixels. The cut is smooth, since a sharp one would lengthen the
//! autocorrelation.

use super::FREQUENCY_MAX_PER_UM;
use super::lattice::LatticeAxis;
use sunbeam_fourier::next_fast_len;

/// Margin above [`FREQUENCY_MAX_PER_UM`] within which power is kept entirely, in node spacings per tap: it is
/// `KEPT_MARGIN·taps/period_um` in cycles/µm. Taps are the nodes that one look-up reads, which are `1/period_um` apart.
/// They span about the width to which the window spreads power. With this margin and [`TRANSITION`], the table's error
/// is that of the interpolation alone, for tolerances from 1e-2 to 1e-6. Larger values keep more pixels; smaller ones
/// weaken the highest frequencies.
const KEPT_MARGIN: f64 = 3.0;
/// Width of the transition from kept to cut frequencies, in node spacings per tap. Larger values keep more pixels;
/// smaller ones make the cut sharper and so the autocorrelation longer.
const TRANSITION: f64 = 12.0;
/// Margin from [`FREQUENCY_MAX_PER_UM`] to the end of the spectrum, in node spacings per tap.
pub(super) const BAND_MARGIN: f64 = KEPT_MARGIN + TRANSITION;

/// Weights of the kept frequencies along one axis.
pub(super) struct Band {
    /// Factor on the power in each kept bin, in FFT order: from frequency 0 upwards, then the negative frequencies.
    /// Kept bins have the same frequencies as before the cut; the highest are left out. Their number is that of the
    /// pixels of the band-limited autocorrelation.
    pub weights: Vec<f64>,
}

impl Band {
    /// Number of pixels, at most `lags`, of an autocorrelation whose spectrum is cut at `edge_per_um` (cycles/µm).
    /// `lattice.rs` plans the size of pixels with this number. Before the cut the autocorrelation has `lags` pixels of
    /// the size `pixel_um`, one for each shift of the relief.
    pub(super) fn planned_pixels(lags: usize, pixel_um: f64, edge_per_um: f64) -> usize {
        // More than two pixels per period of the edge frequency. The conversion to an integer saturates.
        next_fast_len(((2.0 * edge_per_um * lags as f64 * pixel_um).ceil() as usize).saturating_add(1)).min(lags)
    }

    /// Number of pixels of the band-limited autocorrelation, whose length is `length_um` and whose pixels have the
    /// size of those of the planned axis. It differs from `axis.pixels`, which span the period of the table's lattice.
    pub(super) fn kept_pixels(axis: &LatticeAxis, length_um: f64) -> usize {
        (length_um * axis.pixels as f64 / axis.period_um).round() as usize
    }

    /// Band of an axis that was planned for an autocorrelation of `lags` pixels of `pixel_um`. The transition is an
    /// error function that ends within about `tolerance` of 1 and 0.
    pub(super) fn new(axis: &LatticeAxis, lags: usize, pixel_um: f64, tolerance: f64) -> Self {
        let length_um = lags as f64 * pixel_um;
        let kept = Self::kept_pixels(axis, length_um);
        if kept >= lags {
            return Self { weights: vec![1.0; lags] };
        }
        // Ends of the transition in cycles/µm; `high` is half the sampling rate of the kept pixels. It exceeds `low`:
        // the pixels were planned for frequencies up to FREQUENCY_MAX_PER_UM and the whole BAND_MARGIN.
        let low = FREQUENCY_MAX_PER_UM + KEPT_MARGIN * axis.taps as f64 / axis.period_um;
        let high = 0.5 * kept as f64 / length_um;
        // The argument of erfc runs from −steepness at `low` to steepness at `high`; erfc(√ln(1/ε)) < ε, the tolerance.
        let steepness = (1.0 / tolerance).ln().sqrt();
        // In FFT order, bins i and kept − i have opposite frequencies.
        let weight = |bin: usize| {
            let frequency = bin.min(kept - bin) as f64 / length_um;
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
