//! Errors of a candidate, a method with its parameters, against the reference spectra (`Truth`), over all pairs of
//! directions.
//!
//! Spectra and colours are those of the reflectance f_r in 1/sr without the Fresnel factor. The reference spectra are
//! S/λ² in 1/sr, with the power spectrum S of the relief and the wavelength λ. They are multiplied by the obliquity and
//! shadowing factor O·M of each pair (docs/model.md#the-reflectance).
//!
//! A ΔE₂₀₀₀ is the difference of two colours by CIEDE2000; 1 is just noticeable. For it, both colours are multiplied by
//! an exposure and clipped, as on a screen. The reference has one exposure for each direction of incidence.

use super::candidate::Candidate;
use crate::arguments::VISIBLE_NM;
use crate::benchmarks::{BenchError, DirectionPair, INCIDENT_DEG, Truth, percentile_99};
use rayon::prelude::*;
use serde::Serialize;
use sunbeam::colour::{SpectralToRgb, ciede2000, linear_srgb_to_lab, linear_srgb_to_xyz};
use sunbeam::scattering::{Options, Pair};
use sunbeam::table::Model;

/// Step between the wavelengths at which spectra are compared, in nm: a whole multiple of the reference's step, as each
/// [`Effort`](super::Effort) has it.
const SPECTRAL_STEP_NM: f64 = 5.0;
/// Largest channel of a direction's colour, relative to that of the brightest direction, up to which the direction
/// counts as dark. The exposure hardly depends on this limit: beside an order colours fall off by many powers of ten.
const DARK: f64 = 1e-4;
/// Fraction of the lit directions that the exposure clips. With larger values most orders would be white, with smaller
/// ones most would be dark.
const CLIPPED: f64 = 0.1;
/// ΔE₂₀₀₀ assigned to a colour with a NaN: the difference of white and black.
const DELTA_E_OF_NAN: f64 = 100.0;
/// Smallest number of pairs that a thread evaluates at once. Smaller tasks cost more to schedule; larger ones keep
/// fewer threads busy.
const PAIRS_PER_TASK: usize = 8;

/// Errors over all pairs of directions.
///
/// A relative error is `√(Σ(found − reference)² / Σ reference²)`, in which bright directions count most.
#[derive(Clone, Copy, Debug, Serialize)]
pub(crate) struct Errors {
    /// Relative error of `f_r` at every 5 nm from 380 to 780 nm; `None` from methods without spectra.
    pub(crate) spectral_rmse: Option<f64>,
    /// Relative error of the CIE XYZ of `f_r`.
    pub(crate) xyz_rmse: f64,
    /// Relative error of the linear sRGB of `f_r`.
    pub(crate) rgb_rmse: f64,
    /// Mean ΔE₂₀₀₀.
    pub(crate) delta_e_mean: f64,
    /// 99th percentile of ΔE₂₀₀₀.
    pub(crate) delta_e_p99: f64,
}

/// The reference spectra and colours of both models ([`Model`]) at all pairs of directions, at least one.
pub(super) struct References<'a> {
    pairs: &'a [DirectionPair],
    /// Obliquity and shadowing factor `O·M` of each pair.
    factors: Vec<f64>,
    patch: Reference,
    ensemble: Reference,
}

/// The reference of one model.
struct Reference {
    /// `f_r` in 1/sr, `[pair][wavelength]` in steps of [`SPECTRAL_STEP_NM`].
    spectra: Vec<Vec<f64>>,
    /// Linear sRGB of `f_r` of each pair.
    rgb: Vec<[f64; 3]>,
    /// Factor on colours before they are clipped, for each direction of [`INCIDENT_DEG`].
    exposures: Vec<f64>,
}

impl Reference {
    /// The reference of a model at the pairs, whose obliquity and shadowing factors are `factors`. `to_rgb` is for the
    /// wavelengths of `truth`.
    fn new(truth: &Truth, model: Model, pairs: &[DirectionPair], factors: &[f64], to_rgb: &SpectralToRgb) -> Self {
        let stride = (SPECTRAL_STEP_NM / truth.step_nm()).round() as usize;
        let f_r = |i: usize| -> Vec<f64> { truth.spectrum(model, i).iter().map(|value| value * factors[i]).collect() };
        let rgb: Vec<[f64; 3]> = (0..pairs.len()).map(|i| to_rgb.rgb(&f_r(i))).collect();
        let spectra = (0..pairs.len()).map(|i| f_r(i).into_iter().step_by(stride).collect()).collect();
        let largest_channel = |rgb: &[f64; 3]| rgb.iter().fold(0.0f64, |largest, value| largest.max(*value));
        let exposures = (0..INCIDENT_DEG.len())
            .map(|incident_index| {
                let of_incidence = pairs.iter().zip(&rgb).filter(|(pair, _)| pair.incident_index == incident_index);
                clipping_exposure(of_incidence.map(|(_, rgb)| largest_channel(rgb)).collect())
            })
            .collect();
        Self { spectra, rgb, exposures }
    }
}

impl<'a> References<'a> {
    /// The references at the pairs for which `truth` was computed, in the order of its spectra.
    ///
    /// # Errors
    /// A step between wavelengths for which colours have no weights.
    pub(super) fn new(truth: &Truth, pairs: &'a [DirectionPair], options: &Options) -> Result<Self, BenchError> {
        // The factor is 0 for directions that do not lie above the surface.
        let factor = |p: &DirectionPair| Pair::new(p.wi, p.wo).map_or(0.0, |pair| options.angular_factor(&pair));
        let factors: Vec<f64> = pairs.iter().map(factor).collect();
        let to_rgb = SpectralToRgb::visible(truth.step_nm())?;
        let reference = |model| Reference::new(truth, model, pairs, &factors, &to_rgb);
        let (patch, ensemble) = (reference(Model::Patch), reference(Model::Ensemble));
        Ok(Self { pairs, factors, patch, ensemble })
    }

    /// The errors of a candidate against the reference of its own model.
    pub(super) fn errors(&self, candidate: &Candidate) -> Errors {
        let reference = if candidate.model == Model::Patch { &self.patch } else { &self.ensemble };
        let found_rgb: Vec<[f64; 3]> = (self.pairs, &self.factors)
            .into_par_iter()
            .with_min_len(PAIRS_PER_TASK)
            .map(|(pair, factor)| candidate.rgb(pair, *factor))
            .collect();
        let xyz = |rgb: &[[f64; 3]]| rgb.iter().map(|rgb| linear_srgb_to_xyz(*rgb)).collect::<Vec<_>>();
        let mut delta_e: Vec<f64> = (0..found_rgb.len())
            .map(|i| {
                let exposure = reference.exposures[self.pairs[i].incident_index];
                let lab = |rgb: [f64; 3]| linear_srgb_to_lab(rgb.map(|v| (v * exposure).clamp(0.0, 1.0)));
                let difference = ciede2000(lab(reference.rgb[i]), lab(found_rgb[i]));
                if difference.is_finite() { difference } else { DELTA_E_OF_NAN }
            })
            .collect();
        let delta_e_p99 = percentile_99(&mut delta_e);
        Errors {
            spectral_rmse: self.spectral_rmse(candidate, reference),
            xyz_rmse: relative_rmse(xyz(&found_rgb).as_flattened(), xyz(&reference.rgb).as_flattened()),
            rgb_rmse: relative_rmse(found_rgb.as_flattened(), reference.rgb.as_flattened()),
            delta_e_mean: delta_e.iter().sum::<f64>() / delta_e.len() as f64,
            delta_e_p99,
        }
    }

    /// Relative error of the spectra over all pairs; `None` for methods without spectra.
    fn spectral_rmse(&self, candidate: &Candidate, reference: &Reference) -> Option<f64> {
        // Sums of the squared deviations and of the squared reference for each pair.
        let squares = (self.pairs, &self.factors, &reference.spectra).into_par_iter().with_min_len(PAIRS_PER_TASK).map(
            |(pair, factor, spectrum)| {
                let (mut deviation, mut total) = (0.0f64, 0.0f64);
                for (i, expected) in spectrum.iter().enumerate() {
                    let nm = VISIBLE_NM.start() + i as f64 * SPECTRAL_STEP_NM;
                    deviation += (candidate.spectral(pair, *factor, nm)? - expected).powi(2);
                    total += expected * expected;
                }
                Some((deviation, total))
            },
        );
        let (deviation, total) = squares.try_reduce(|| (0.0, 0.0), |a, b| Some((a.0 + b.0, a.1 + b.1)))?;
        Some((deviation / total).sqrt())
    }
}

/// `√(Σ(found − reference)² / Σ reference²)`.
fn relative_rmse(found: &[f64], reference: &[f64]) -> f64 {
    let deviation: f64 = found.iter().zip(reference).map(|(a, b)| (a - b).powi(2)).sum();
    (deviation / reference.iter().map(|b| b * b).sum::<f64>()).sqrt()
}

/// The factor that takes the quantile 1 − [`CLIPPED`] of the lit values to 1, so that larger values clip. It is 1 where
/// no value is lit.
fn clipping_exposure(values: Vec<f64>) -> f64 {
    let peak = values.iter().fold(0.0f64, |peak, value| peak.max(*value));
    let mut lit: Vec<f64> = values.into_iter().filter(|v| *v > DARK * peak).collect();
    lit.sort_by(f64::total_cmp);
    lit.get(((1.0 - CLIPPED) * lit.len() as f64) as usize).map_or(1.0, |value| 1.0 / value)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_tenth_of_the_lit_values_clips() {
        let values: Vec<f64> = (1..=100).map(f64::from).chain([0.0; 50]).collect();
        assert_eq!(clipping_exposure(values), 1.0 / 91.0);
        assert_eq!(clipping_exposure(vec![0.0; 3]), 1.0);
    }

    #[test]
    fn a_constant_factor_has_its_excess_as_relative_error() {
        assert!((relative_rmse(&[1.1, 2.2], &[1.0, 2.0]) - 0.1).abs() < 1e-12);
    }
}
