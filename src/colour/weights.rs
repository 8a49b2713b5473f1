//! Weights that turn samples of a reflectance on a uniform grid of wavelengths into linear sRGB.

use super::{OBSERVER_RANGE_NM, cie_xyz, d65, xyz_to_linear_srgb};
use thiserror::Error;

/// Reason that a wavelength grid was refused.
#[derive(Debug, Error, PartialEq)]
pub enum ColourError {
    /// First wavelength or step not finite and positive.
    #[error(
        "the wavelength grid starts at {first_nm} nm with a step of {step_nm} nm; both must be finite and positive"
    )]
    Grid {
        /// The refused first wavelength.
        first_nm: f64,
        /// The refused step.
        step_nm: f64,
    },
    /// A step of [`SpectralToRgb::visible`] that divides the visible range too finely.
    #[error("a step of {step_nm} nm makes {count} wavelengths, more than {COUNT_MAX}")]
    TooFine {
        /// The refused step.
        step_nm: f64,
        /// The number of wavelengths.
        count: usize,
    },
    /// A grid of too few visible wavelengths: white, the sum of all weights, lacks a channel.
    #[error(
        "the {count} wavelengths from {first_nm} nm in steps of {step_nm} nm cannot make white; cover 380 to \
         780 nm in steps of at most 100 nm"
    )]
    NoWhite {
        /// The refused first wavelength.
        first_nm: f64,
        /// The refused step.
        step_nm: f64,
        /// The refused number of samples.
        count: usize,
    },
}

/// Smallest accepted sum of a channel's weights before scaling, as a fraction of the largest channel's sum. On a grid
/// that covers the visible range the sums are about equal. Smaller values would accept grids whose colours are far off;
/// larger ones would refuse coarse grids of passable colours.
const WHITE_MIN: f64 = 0.05;
/// Largest number of wavelengths of [`SpectralToRgb::visible`]. It bounds the memory: so many weights take 24 MiB.
const COUNT_MAX: usize = 1 << 20;

/// Weights that turn samples of a reflectance `f(λ_i)`, lit by D65 and seen by the CIE 1931 2° observer, into linear
/// sRGB: `rgb = Σ_i f(λ_i) · weights[i]`.
///
/// The weights are scaled per channel so that `f ≡ 1` is (1, 1, 1) to rounding. On 380 to 780 nm in steps of 5 nm the
/// scaling changes no channel by more than 0.2 %.
///
/// ```
/// use sunbeam::colour::SpectralToRgb;
///
/// let weights = SpectralToRgb::visible(5.0)?;
/// let [red, green, blue] = weights.rgb_of(|nm| if nm > 600.0 { 0.9 } else { 0.1 });
/// assert!(red > 0.4 && green < 0.4 && blue < 0.2);
/// # Ok::<(), sunbeam::colour::ColourError>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct SpectralToRgb {
    /// First wavelength.
    first_nm: f64,
    /// Step between wavelengths.
    step_nm: f64,
    /// `[i][channel]` at the wavelength `first_nm + i·step_nm`.
    weights: Vec<[f64; 3]>,
}

impl SpectralToRgb {
    /// Weights for `count` wavelengths `first_nm + i·step_nm`.
    ///
    /// # Errors
    /// [`ColourError::Grid`] when a number is not finite and positive; [`ColourError::NoWhite`] when the samples are
    /// too few or too far from the visible range.
    pub fn new(first_nm: f64, step_nm: f64, count: usize) -> Result<Self, ColourError> {
        let positive = |value: f64| value.is_finite() && value > 0.0;
        if !positive(first_nm) || !positive(step_nm) {
            return Err(ColourError::Grid { first_nm, step_nm });
        }
        let mut weights: Vec<[f64; 3]> = (0..count)
            .map(|i| {
                let nm = first_nm + i as f64 * step_nm;
                xyz_to_linear_srgb(cie_xyz(nm).map(|value| value * d65(nm)))
            })
            .collect();
        let mut white = [0.0; 3];
        for weight in &weights {
            for (total, value) in white.iter_mut().zip(weight) {
                *total += value;
            }
        }
        let largest = white[0].max(white[1]).max(white[2]);
        // Refuses an empty grid, too, whose sums are 0.
        if !white.iter().all(|&total| total > WHITE_MIN * largest) {
            return Err(ColourError::NoWhite { first_nm, step_nm, count });
        }
        for weight in &mut weights {
            for (value, total) in weight.iter_mut().zip(white) {
                *value /= total;
            }
        }
        Ok(Self { first_nm, step_nm, weights })
    }

    /// Weights for [`OBSERVER_RANGE_NM`] in steps of `step_nm`. The default and M. Single's thesis of 2014 use
    /// 5 nm. Smaller steps resolve narrower peaks of a reflectance.
    ///
    /// # Errors
    /// The errors of [`SpectralToRgb::new`]; [`ColourError::TooFine`] for more than 2²⁰ wavelengths.
    pub fn visible(step_nm: f64) -> Result<Self, ColourError> {
        let (first_nm, last_nm) = OBSERVER_RANGE_NM;
        // The factor keeps the last wavelength where the quotient is rounded down. The cast saturates for tiny steps.
        let steps = ((last_nm - first_nm) / step_nm * (1.0 + f64::EPSILON)).floor() as usize;
        // Steps that are not positive are left to `new` to refuse.
        let count = if step_nm > 0.0 { steps.saturating_add(1) } else { 0 };
        if count > COUNT_MAX {
            return Err(ColourError::TooFine { step_nm, count });
        }
        Self::new(first_nm, step_nm, count)
    }

    /// The wavelengths in nm, in the order of the samples.
    pub fn wavelengths_nm(&self) -> impl ExactSizeIterator<Item = f64> + '_ {
        (0..self.weights.len()).map(|i| self.first_nm + i as f64 * self.step_nm)
    }

    /// Step between wavelengths in nm.
    pub fn step_nm(&self) -> f64 {
        self.step_nm
    }

    /// One weight `[red, green, blue]` per wavelength; they sum to (1, 1, 1). Components can be negative.
    pub fn weights(&self) -> &[[f64; 3]] {
        &self.weights
    }

    /// The weights as a density per nm, at a wavelength in nm: linear between the samples, and falling to zero one step
    /// beyond the outermost. Its integral is (1, 1, 1), since each sample's triangle has the area of its weight.
    pub fn density(&self, wavelength_nm: f64) -> [f64; 3] {
        let position = (wavelength_nm - self.first_nm) / self.step_nm;
        let below = position.floor();
        // Weights at a whole position; zeros outside the grid.
        let at = |i: f64| if i >= 0.0 { self.weights.get(i as usize).copied() } else { None }.unwrap_or_default();
        let (low, high) = (at(below), at(below + 1.0));
        std::array::from_fn(|c| (low[c] + (position - below) * (high[c] - low[c])) / self.step_nm)
    }

    /// Linear sRGB of samples at [`SpectralToRgb::wavelengths_nm`]. Missing samples count as 0; surplus samples are
    /// ignored.
    pub fn rgb(&self, samples: &[f64]) -> [f64; 3] {
        self.weighted_sum(samples.iter().copied())
    }

    /// [`SpectralToRgb::rgb`] of a function of the wavelength in nm.
    pub fn rgb_of(&self, function: impl FnMut(f64) -> f64) -> [f64; 3] {
        self.weighted_sum(self.wavelengths_nm().map(function))
    }

    /// Sum of samples times the weights at their wavelengths.
    fn weighted_sum(&self, samples: impl Iterator<Item = f64>) -> [f64; 3] {
        let mut rgb = [0.0; 3];
        for (sample, weight) in samples.zip(&self.weights) {
            for (total, value) in rgb.iter_mut().zip(weight) {
                *total += sample * value;
            }
        }
        rgb
    }
}

impl Default for SpectralToRgb {
    /// 81 wavelengths from 380 to 780 nm in steps of 5 nm.
    fn default() -> Self {
        // A step of 5 nm is never refused. The empty grid only replaces a panic.
        Self::visible(5.0).unwrap_or(Self { first_nm: OBSERVER_RANGE_NM.0, step_nm: 5.0, weights: Vec::new() })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::colour::{ciede2000, linear_srgb_to_lab};

    #[test]
    fn unit_reflectance_is_white() {
        for step in [1.0, 5.0, 10.0, 20.0] {
            let white = SpectralToRgb::visible(step).unwrap().rgb_of(|_| 1.0);
            for channel in white {
                assert!((channel - 1.0).abs() < 1e-14, "step {step}: {white:?}");
            }
        }
        assert_eq!(SpectralToRgb::default().wavelengths_nm().len(), 81);
        assert_eq!(SpectralToRgb::default().wavelengths_nm().last(), Some(780.0));
    }

    #[test]
    fn scaling_to_white_changes_little() {
        // The unscaled sums over steps of 5 nm, divided by Y, are white to the promised 0.2 %.
        let mut xyz = [0.0; 3];
        for nm in SpectralToRgb::default().wavelengths_nm() {
            for (total, value) in xyz.iter_mut().zip(cie_xyz(nm)) {
                *total += value * d65(nm);
            }
        }
        for channel in xyz_to_linear_srgb(xyz.map(|value| value / xyz[1])) {
            assert!((channel - 1.0).abs() < 2e-3, "{channel}");
        }
    }

    #[test]
    fn a_step_of_5_nm_agrees_with_1_nm_on_smooth_spectra() {
        let (coarse, fine) = (SpectralToRgb::default(), SpectralToRgb::visible(1.0).unwrap());
        for centre in [430.0, 500.0, 550.0, 610.0, 680.0] {
            let lobe = |nm: f64| (-((nm - centre) / 40.0_f64).powi(2)).exp();
            let difference = ciede2000(linear_srgb_to_lab(coarse.rgb_of(lobe)), linear_srgb_to_lab(fine.rgb_of(lobe)));
            // A fifth of a just noticeable difference.
            assert!(difference < 0.2, "lobe at {centre} nm: {difference}");
        }
    }

    #[test]
    fn bands_have_the_hue_of_their_wavelengths() {
        let weights = SpectralToRgb::default();
        let band = |low: f64, high: f64| weights.rgb_of(|nm| f64::from(u8::from(low <= nm && nm <= high)));
        let (blue, green, red) = (band(430.0, 470.0), band(520.0, 560.0), band(600.0, 680.0));
        assert!(blue[2] > blue[0].max(blue[1]));
        assert!(green[1] > green[0].max(green[2]));
        assert!(red[0] > red[1].max(red[2]));
    }

    #[test]
    fn samples_and_function_agree() {
        let weights = SpectralToRgb::default();
        let samples: Vec<f64> = weights.wavelengths_nm().map(|nm| nm / 780.0).collect();
        assert_eq!(weights.rgb(&samples), weights.rgb_of(|nm| nm / 780.0));
    }

    #[test]
    fn bad_grids_are_refused() {
        assert!(matches!(SpectralToRgb::new(380.0, 0.0, 3), Err(ColourError::Grid { .. })));
        assert!(matches!(SpectralToRgb::new(f64::NAN, 5.0, 3), Err(ColourError::Grid { .. })));
        for step in [1e-9, f64::MIN_POSITIVE] {
            assert!(matches!(SpectralToRgb::visible(step), Err(ColourError::TooFine { .. })));
        }
        assert!(matches!(SpectralToRgb::new(900.0, 5.0, 81), Err(ColourError::NoWhite { .. })));
        assert!(matches!(SpectralToRgb::visible(300.0), Err(ColourError::NoWhite { .. })));
        assert!(matches!(SpectralToRgb::visible(f64::NAN), Err(ColourError::Grid { .. })));
    }
}
