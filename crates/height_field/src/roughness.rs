//! Areal roughness parameters of ISO 25178-2.

use super::HeightField;
use serde::Serialize;

/// Parameters of a relief about its mean height, over the whole field, without the filters of the standard.
///
/// ```
/// use sunbeam_height_field::Preset;
///
/// let found = Preset::Lamellar.build(None, Some(0.2))?.roughness();
/// // Two equal levels 0.2 µm apart.
/// assert!((found.sa_um - 0.1).abs() < 1e-12 && (found.sq_um - 0.1).abs() < 1e-12);
/// assert!((found.sku.unwrap() - 1.0).abs() < 1e-9);
/// # Ok::<(), sunbeam_height_field::HeightFieldError>(())
/// ```
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Roughness {
    /// Sa: arithmetic mean of the absolute height, in µm.
    pub sa_um: f64,
    /// Sq: root mean square height, in µm.
    pub sq_um: f64,
    /// Ssk: skewness of the heights, positive for peaks on a plain; `None` for a flat field.
    pub ssk: Option<f64>,
    /// Sku: kurtosis, 3 for a normal distribution of heights; `None` for a flat field.
    pub sku: Option<f64>,
    /// Sz: highest minus lowest height, in µm.
    pub sz_um: f64,
    /// Sdq: root mean square gradient (dimensionless), from differences of neighbouring pixels inside the field.
    pub sdq: f64,
}

impl HeightField {
    /// Areal parameters of the field, without levelling.
    pub fn roughness(&self) -> Roughness {
        let mean = self.mean_um();
        let count = self.heights_um.len() as f64;
        // Mean of a function of the height above the mean.
        let mean_of = |f: &dyn Fn(f64) -> f64| self.heights_um.iter().map(|h| f(h - mean)).sum::<f64>() / count;
        let sq_um = mean_of(&|h| h * h).sqrt();
        let range = self.peak_to_valley_um();
        // A flat field has neither skewness nor kurtosis.
        let moment = |power: i32| (range > 0.0).then(|| mean_of(&|h| (h / sq_um).powi(power)));
        let (sx, sy) = self.rms_slope();
        Roughness { sa_um: mean_of(&f64::abs), sq_um, ssk: moment(3), sku: moment(4), sz_um: range, sdq: sx.hypot(sy) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use ndarray::Array2;
    use std::f64::consts::{PI, TAU};

    #[test]
    fn sinusoid_matches_closed_forms() {
        let (n, amplitude) = (4096, 0.3);
        let heights = Array2::from_shape_fn((1, n), |(_, ix)| 5.0 + amplitude * (TAU * ix as f64 / n as f64).sin());
        let found = HeightField::new(heights, 0.001, 1.0).unwrap().roughness();
        // Sums over whole periods are exact but for Sa, whose kinks cost 1/n².
        assert!((found.sa_um - amplitude * 2.0 / PI).abs() < 1e-6, "{found:?}");
        assert!((found.sq_um - amplitude / 2f64.sqrt()).abs() < 1e-12, "{found:?}");
        assert!(found.ssk.unwrap().abs() < 1e-12 && (found.sku.unwrap() - 1.5).abs() < 1e-12, "{found:?}");
        assert!((found.sz_um - 2.0 * amplitude).abs() < 1e-12);
        let slope = TAU * amplitude / (0.001 * n as f64) / 2f64.sqrt();
        // The step from the last pixel to the first, 1/n of all, is left out.
        assert!((found.sdq / slope - 1.0).abs() < 1e-3, "{found:?}");
    }

    #[test]
    fn flat_fields_have_no_skewness_or_kurtosis() {
        let found = HeightField::new(Array2::from_elem((3, 3), 0.1), 1.0, 1.0).unwrap().roughness();
        assert_eq!((found.ssk, found.sku, found.sz_um, found.sdq), (None, None, 0.0, 0.0));
    }
}
