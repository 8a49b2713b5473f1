//! The figures of a comparison: numbers that measure the differences of two pictures.
//!
//! RMSE and relative MSE compare radiance. PSNR, CIEDE2000 (a difference of two colours; 1 is just noticeable) and FLIP
//! compare the pictures as shown on a screen, exposed and clipped to [0, 1] (display.rs).

use super::{DisplayPair, Picture};
use serde::Serialize;
use sunbeam::colour::{ciede2000, linear_srgb_to_lab, srgb_encode};

/// ε of the relative error as a fraction of the reference's mean absolute value. With smaller values dark pixels of the
/// reference would dominate the mean; with larger ones they would hardly count.
const RELATIVE_EPSILON: f64 = 0.01;

/// Differences of a picture `b` from its reference `a`, over the compared pixels.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub(crate) struct Figures {
    /// Root mean square of `b − a` over pixels and channels, in units of the pictures' radiance.
    pub(crate) rmse: f64,
    /// Mean of `(b − a)²/(a² + ε²)` over pixels and channels; ε is [`RELATIVE_EPSILON`] times the mean of `|a|`, so the
    /// figure does not depend on the unit of radiance. `None`, since infinite, if `a` is black and `b` is not.
    pub(crate) relative_mse: Option<f64>,
    /// Peak signal-to-noise ratio of the sRGB-encoded pictures as shown, with the peak 1, in dB. `None` for pictures
    /// that are equal as shown, whose ratio is infinite.
    pub(crate) psnr_db: Option<f64>,
    /// CIEDE2000 of the pictures as shown; the white point is (1, 1, 1).
    pub(crate) delta_e_2000: DeltaE,
    /// FLIP of the pictures as shown, after these are rounded to 8 bits in sRGB.
    pub(crate) flip: Flip,
}

/// CIEDE2000 over the compared pixels.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub(crate) struct DeltaE {
    /// The mean.
    pub(crate) mean: f64,
    /// The smallest value that half of the pixels do not exceed.
    pub(crate) median: f64,
    /// The smallest value that 99 % of the pixels do not exceed.
    pub(crate) p99: f64,
}

/// FLIP over the compared pixels, each in [0, 1].
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub(crate) struct Flip {
    /// The mean, which is the figure that its authors recommend.
    pub(crate) mean: f64,
    /// The smallest value that 99 % of the pixels do not exceed.
    pub(crate) p99: f64,
}

impl Figures {
    /// The figures over the pixels with the indices `chosen`, at least one.
    ///
    /// `shown` has both pictures as shown on a screen, and `flip_map` is FLIP's error of each of their pixels. All have
    /// the same size.
    pub(super) fn new(a: &Picture, b: &Picture, chosen: &[usize], shown: &DisplayPair, flip_map: &[f32]) -> Self {
        // Pairs of both pictures' values, for every channel of the chosen pixels.
        let channels = || {
            let pixels = chosen.iter().map(|&i| (a.pixels()[i], b.pixels()[i]));
            pixels.flat_map(|(a, b)| (0..3).map(move |c| (f64::from(a[c]), f64::from(b[c]))))
        };
        let channel_count = 3.0 * chosen.len() as f64;
        let per_channel = |sum: f64| sum / channel_count;
        let epsilon = RELATIVE_EPSILON * per_channel(channels().map(|(a, _)| a.abs()).sum());
        let squared_difference = |(a, b): (f64, f64)| (b - a) * (b - a);
        let mse: f64 = per_channel(channels().map(squared_difference).sum());
        let relative = |(a, b): (f64, f64)| squared_difference((a, b)) / (a * a + epsilon * epsilon);
        // Two black pictures would give 0/0. A black reference of a picture that is not black gives infinity or NaN.
        let relative_mse = if mse == 0.0 { 0.0 } else { per_channel(channels().map(relative).sum()) };

        let [shown_a, shown_b] = shown.linear();
        let encoded = chosen.iter().map(|&i| (srgb_encode(shown_a[i]), srgb_encode(shown_b[i])));
        let encoded_channels = encoded.flat_map(|(a, b)| (0..3).map(move |c| (a[c], b[c])));
        let encoded_mse = per_channel(encoded_channels.map(squared_difference).sum());
        let lab = |i: usize| (linear_srgb_to_lab(shown_a[i]), linear_srgb_to_lab(shown_b[i]));
        let mut delta_e: Vec<f64> = chosen.iter().map(|&i| lab(i)).map(|(a, b)| ciede2000(a, b)).collect();
        let mut flip: Vec<f64> = chosen.iter().map(|&i| f64::from(flip_map[i])).collect();
        Self {
            rmse: mse.sqrt(),
            relative_mse: relative_mse.is_finite().then_some(relative_mse),
            psnr_db: (encoded_mse > 0.0).then(|| -10.0 * encoded_mse.log10()),
            delta_e_2000: DeltaE {
                mean: mean_of(&delta_e),
                median: quantile(&mut delta_e, 0.5),
                p99: quantile(&mut delta_e, 0.99),
            },
            flip: Flip { mean: mean_of(&flip), p99: quantile(&mut flip, 0.99) },
        }
    }
}

/// The mean of at least one value.
fn mean_of(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

/// The smallest value that a `fraction` of the values does not exceed. Requires at least one value, and a `fraction` in
/// (0, 1]. Reorders the values.
fn quantile(values: &mut [f64], fraction: f64) -> f64 {
    // Index of the quantile among the sorted values, from 0.
    let rank = (fraction * values.len() as f64).ceil() as usize - 1;
    *values.select_nth_unstable_by(rank, f64::total_cmp).1
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_are_smallest_values_that_a_fraction_does_not_exceed() {
        let mut hundred: Vec<f64> = (1..=100).rev().map(f64::from).collect();
        assert_eq!((mean_of(&hundred), quantile(&mut hundred, 0.5), quantile(&mut hundred, 0.99)), (50.5, 50.0, 99.0));
        let mut twice: Vec<f64> = (1..=200).map(f64::from).collect();
        assert_eq!(quantile(&mut twice, 0.99), 198.0);
        assert_eq!((quantile(&mut [7.0], 0.5), quantile(&mut [7.0], 0.99)), (7.0, 7.0));
    }
}
