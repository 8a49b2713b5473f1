use super::candidates::Candidate;
use crate::benchmarks::{BenchError, DirectionPair, INCIDENT_DEG, Truth};
use rayon::prelude::*;
use serde::Serialize;
use sunbeam::colour::{SpectralToRgb, ciede2000, linear_srgb_to_lab, linear_srgb_to_xyz};
use sunbeam::scattering::{Options, Pair};
use sunbeam::table::Model;

/// Step of the wavelengths at which spectra are compared, in nm.
const SPECTRAL_STEP_NM: f64 = 5.0;
/// What is darker than this share of the brightest direction does not count as lit when the exposure is chosen.
const LIT: f64 = 1e-4;
/// Share of the lit directions that the exposure clips.
const CLIPPED: f64 = 0.1;
/// ΔE₂₀₀₀ of a colour that is not a number: that of white against black.
const NO_COLOUR: f64 = 100.0;

/// Errors over all directions. Relative ones are the root of the summed squares of the deviation over that of the truth, so
/// that bright directions count most; a ΔE₂₀₀₀ is taken as seen, exposed for each direction of incidence so that a tenth of
/// the directions that are lit at all clips.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Errors {
    /// Of `f_r` at every 5 nm; `None` where there are only colours.
    pub spectral_rmse: Option<f64>,
    /// Of XYZ.
    pub xyz_rmse: f64,
    /// Of linear sRGB.
    pub rgb_rmse: f64,
    pub delta_e_mean: f64,
    /// The smallest ΔE₂₀₀₀ that 99 of 100 directions do not exceed.
    pub delta_e_p99: f64,
}

/// What candidates are compared with.
pub(super) struct References<'a> {
    pairs: &'a [DirectionPair],
    /// `O·M` of each pair.
    factors: Vec<f64>,
    patch: Reference,
    ensemble: Reference,
}

struct Reference {
    /// `f_r` of each pair at every [`SPECTRAL_STEP_NM`].
    spectra: Vec<Vec<f64>>,
    rgb: Vec<[f64; 3]>,
    /// Of each direction of incidence.
    exposures: Vec<f64>,
}

impl<'a> References<'a> {
    pub fn new(truth: &Truth, pairs: &'a [DirectionPair], options: &Options) -> Result<Self, BenchError> {
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
                    let of = pairs.iter().zip(&rgb).filter(|(pair, _)| pair.incident == incident);
                    exposure(of.map(|(_, rgb)| rgb.iter().fold(0.0f64, |a, b| a.max(*b))).collect())
                })
                .collect();
            Reference { spectra, rgb, exposures }
        };
        let (patch, ensemble) = (reference(Model::Patch), reference(Model::Ensemble));
        Ok(Self { pairs, factors, patch, ensemble })
    }

    pub fn errors(&self, candidate: &Candidate) -> Errors {
        let reference = if candidate.model == Model::Patch { &self.patch } else { &self.ensemble };
        let found: Vec<[f64; 3]> = (self.pairs, &self.factors)
            .into_par_iter()
            .with_min_len(8)
            .map(|(pair, factor)| candidate.rgb(pair, *factor))
            .collect();
        let xyz = |rgb: &[[f64; 3]]| rgb.iter().map(|rgb| linear_srgb_to_xyz(*rgb)).collect::<Vec<_>>();
        let mut seen: Vec<f64> = (0..found.len())
            .map(|i| {
                let exposure = reference.exposures[self.pairs[i].incident];
                let lab = |rgb: [f64; 3]| linear_srgb_to_lab(rgb.map(|v| (v * exposure).clamp(0.0, 1.0)));
                let difference = ciede2000(lab(reference.rgb[i]), lab(found[i]));
                if difference.is_finite() { difference } else { NO_COLOUR }
            })
            .collect();
        seen.sort_by(f64::total_cmp);
        Errors {
            spectral_rmse: self.spectral_rmse(candidate, reference),
            xyz_rmse: relative_rmse(xyz(&found).as_flattened(), xyz(&reference.rgb).as_flattened()),
            rgb_rmse: relative_rmse(found.as_flattened(), reference.rgb.as_flattened()),
            delta_e_mean: seen.iter().sum::<f64>() / seen.len() as f64,
            delta_e_p99: seen[(0.99 * (seen.len() - 1) as f64).ceil() as usize],
        }
    }

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
        let (off, all) = squares.try_reduce(|| (0.0, 0.0), |a, b| Some((a.0 + b.0, a.1 + b.1)))?;
        Some((off / all).sqrt())
    }
}

fn relative_rmse(found: &[f64], truth: &[f64]) -> f64 {
    let off: f64 = found.iter().zip(truth).map(|(a, b)| (a - b).powi(2)).sum();
    (off / truth.iter().map(|b| b * b).sum::<f64>()).sqrt()
}

/// The factor at which [`CLIPPED`] of the lit values exceed 1.
fn exposure(values: Vec<f64>) -> f64 {
    let peak = values.iter().fold(0.0f64, |a, b| a.max(*b));
    let mut lit: Vec<f64> = values.into_iter().filter(|v| *v > LIT * peak).collect();
    lit.sort_by(f64::total_cmp);
    lit.get(((1.0 - CLIPPED) * lit.len() as f64) as usize).map_or(1.0, |value| 1.0 / value)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_tenth_of_what_is_lit_clips() {
        let values: Vec<f64> = (1..=100).map(f64::from).chain([0.0; 50]).collect();
        assert_eq!(exposure(values), 1.0 / 91.0);
        assert_eq!(exposure(vec![0.0; 3]), 1.0);
    }

    #[test]
    fn a_factor_is_its_relative_error() {
        assert!((relative_rmse(&[1.1, 2.2], &[1.0, 2.0]) - 0.1).abs() < 1e-12);
    }
}
