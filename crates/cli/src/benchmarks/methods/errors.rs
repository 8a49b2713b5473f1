//! Errors of a candidate (candidate.rs) against the reference spectra (`Truth`), over all pairs of directions.
//!
//! Spectra and colours are those of f_r in 1/sr without the Fresnel factor. The reference's S/λ² is multiplied by the
//! obliquity and shadowing factor O·M (docs/model.md#the-reflectance). For ΔE₂₀₀₀, colours are exposed and clipped as
//! on a screen, with one exposure for each direction of incidence.

use super::candidate::Candidate;
use crate::benchmarks::{BenchError, DirectionPair, INCIDENT_DEG, Truth};
use rayon::prelude::*;
use serde::Serialize;
use sunbeam::colour::{SpectralToRgb, ciede2000, linear_srgb_to_lab, linear_srgb_to_xyz};
use sunbeam::scattering::{Options, Pair};
use sunbeam::table::Model;

/// Step between the wavelengths at which spectra are compared, in nm.
const SPECTRAL_STEP_NM: f64 = 5.0;
/// Fraction of the brightest direction below which a direction counts as dark. Chosen: grating orders fall off by many
/// powers of ten, so the exposure hardly depends on it.
const DARK: f64 = 1e-4;
/// Fraction of the lit directions that the exposure clips. Chosen: orders are bright, and not all of them white.
const CLIPPED: f64 = 0.1;
/// ΔE₂₀₀₀ that counts for a colour with a NaN: the difference of white and black.
const DELTA_E_OF_NAN: f64 = 100.0;

/// Errors over all directions.
///
/// A relative error is the root of the summed squared deviations over the summed squared reference, so bright
/// directions count most. For ΔE₂₀₀₀, colours are exposed for each direction of incidence so that a tenth of the lit
/// directions clips.
#[derive(Clone, Copy, Debug, Serialize)]
pub(crate) struct Errors {
    /// Relative error of `f_r` at every 5 nm; `None` from methods without spectra.
    pub(crate) spectral_rmse: Option<f64>,
    /// Relative error of the CIE XYZ of `f_r`.
    pub(crate) xyz_rmse: f64,
    /// Relative error of the linear sRGB of `f_r`.
    pub(crate) rgb_rmse: f64,
    /// Mean ΔE₂₀₀₀.
    pub(crate) delta_e_mean: f64,
    /// The smallest ΔE₂₀₀₀ that 99 % of the directions do not exceed.
    pub(crate) delta_e_p99: f64,
}

/// The reference spectra and colours at all directions.
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
    /// Exposure for each direction of incidence: the factor on colours before they are clipped.
    exposures: Vec<f64>,
}

impl<'a> References<'a> {
    /// The references at the directions for which `truth` was computed.
    pub(super) fn new(truth: &Truth, pairs: &'a [DirectionPair], options: &Options) -> Result<Self, BenchError> {
        let factor = |p: &DirectionPair| Pair::new(p.wi, p.wo).map_or(0.0, |pair| options.angular_factor(&pair));
        let factors: Vec<f64> = pairs.iter().map(factor).collect();
        let sum = SpectralToRgb::visible(truth.step_nm())?;
        let stride = (SPECTRAL_STEP_NM / truth.step_nm()).round() as usize;
        let reference = |model: Model| {
            let scaled =
                |i: usize| -> Vec<f64> { truth.spectrum(model, i).iter().map(|value| value * factors[i]).collect() };
            let rgb: Vec<[f64; 3]> = (0..pairs.len()).map(|i| sum.rgb(&scaled(i))).collect();
            let spectra = (0..pairs.len()).map(|i| scaled(i).into_iter().step_by(stride).collect()).collect();
            let exposures = (0..INCIDENT_DEG.len())
                .map(|incident| {
                    let incident = pairs.iter().zip(&rgb).filter(|(pair, _)| pair.incident == incident);
                    exposure(incident.map(|(_, rgb)| rgb.iter().fold(0.0f64, |a, b| a.max(*b))).collect())
                })
                .collect();
            Reference { spectra, rgb, exposures }
        };
        let (patch, ensemble) = (reference(Model::Patch), reference(Model::Ensemble));
        Ok(Self { pairs, factors, patch, ensemble })
    }

    /// The errors of a candidate against the reference of its own model.
    pub(super) fn errors(&self, candidate: &Candidate) -> Errors {
        let reference = if candidate.model == Model::Patch { &self.patch } else { &self.ensemble };
        let found: Vec<[f64; 3]> = (self.pairs, &self.factors)
            .into_par_iter()
            .with_min_len(8)
            .map(|(pair, factor)| candidate.rgb(pair, *factor))
            .collect();
        let xyz = |rgb: &[[f64; 3]]| rgb.iter().map(|rgb| linear_srgb_to_xyz(*rgb)).collect::<Vec<_>>();
        let mut delta_e: Vec<f64> = (0..found.len())
            .map(|i| {
                let exposure = reference.exposures[self.pairs[i].incident];
                let lab = |rgb: [f64; 3]| linear_srgb_to_lab(rgb.map(|v| (v * exposure).clamp(0.0, 1.0)));
                let difference = ciede2000(lab(reference.rgb[i]), lab(found[i]));
                if difference.is_finite() { difference } else { DELTA_E_OF_NAN }
            })
            .collect();
        delta_e.sort_by(f64::total_cmp);
        Errors {
            spectral_rmse: self.spectral_rmse(candidate, reference),
            xyz_rmse: relative_rmse(xyz(&found).as_flattened(), xyz(&reference.rgb).as_flattened()),
            rgb_rmse: relative_rmse(found.as_flattened(), reference.rgb.as_flattened()),
            delta_e_mean: delta_e.iter().sum::<f64>() / delta_e.len() as f64,
            delta_e_p99: delta_e[(0.99 * (delta_e.len() - 1) as f64).ceil() as usize],
        }
    }

    /// Relative error of the spectra over all pairs; `None` for methods without spectra.
    fn spectral_rmse(&self, candidate: &Candidate, reference: &Reference) -> Option<f64> {
        let squares = (self.pairs, &self.factors, &reference.spectra).into_par_iter().with_min_len(8).map(
            |(pair, factor, truth)| {
                let mut sums = (0.0, 0.0);
                for (i, truth) in truth.iter().enumerate() {
                    let found = candidate.spectral(pair, *factor, 380.0 + i as f64 * SPECTRAL_STEP_NM)?;
                    sums = (sums.0 + (found - truth).powi(2), sums.1 + truth * truth);
                }
                Some(sums)
            },
        );
        let (deviation, total) = squares.try_reduce(|| (0.0, 0.0), |a, b| Some((a.0 + b.0, a.1 + b.1)))?;
        Some((deviation / total).sqrt())
    }
}

/// The root of the summed squared deviations over the summed squares of the truth.
fn relative_rmse(found: &[f64], truth: &[f64]) -> f64 {
    let deviation: f64 = found.iter().zip(truth).map(|(a, b)| (a - b).powi(2)).sum();
    (deviation / truth.iter().map(|b| b * b).sum::<f64>()).sqrt()
}

/// The factor at which [`CLIPPED`] of the lit values exceed 1; 1 where no value is lit.
fn exposure(values: Vec<f64>) -> f64 {
    let peak = values.iter().fold(0.0f64, |a, b| a.max(*b));
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
        assert_eq!(exposure(values), 1.0 / 91.0);
        assert_eq!(exposure(vec![0.0; 3]), 1.0);
    }

    #[test]
    fn a_constant_factor_has_its_excess_as_relative_error() {
        assert!((relative_rmse(&[1.1, 2.2], &[1.0, 2.0]) - 0.1).abs() < 1e-12);
    }
}
