//! Statistics of the weight `f_r·cosθo/pdf` of importance sampling.
//!
//! `f_r` is the reflectance and `pdf` the density of the sampled direction, both in 1/sr; θo is the angle of that
//! direction with the normal. A perfect sampler has a constant weight. The relative standard deviation of the weight
//! determines the noise of a path tracer.

use crate::arguments::direction_from_degrees;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;
use rayon::prelude::*;
use serde::Serialize;
use sunbeam::lobe::Surface;

/// Incident polar angles in degrees, from normal to grazing incidence.
pub const THETAS_DEG: [f64; 7] = [0.0, 15.0, 30.0, 45.0, 60.0, 75.0, 85.0];
/// Incident azimuths in degrees: across, oblique to and along the grooves of a grating, which run along y.
pub const PHIS_DEG: [f64; 3] = [0.0, 25.0, 90.0];
/// Wavelengths in nm: blue, green and red.
pub const WAVELENGTHS_NM: [f64; 3] = [450.0, 530.0, 650.0];

/// Statistics of the weight at one direction of incidence and one wavelength. `f_r` is that of [`Surface::eval`], which
/// has a Fresnel factor only for bodies that transmit.
///
/// A sample below the horizon is lost and has the weight 0. Ratios to the mean are 0 if the mean is 0.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct SamplerRow {
    /// Incident polar angle in degrees.
    pub theta_deg: f64,
    /// Incident azimuth in degrees.
    pub phi_deg: f64,
    /// Wavelength in nm.
    pub wavelength_nm: f64,
    /// Mean weight, an estimate of the albedo.
    pub mean: f64,
    /// Standard deviation over the mean.
    pub relative_std: f64,
    /// 99.9th percentile over the mean.
    pub p999_to_mean: f64,
    /// Largest weight over the mean.
    pub max_to_mean: f64,
    /// Fraction of the samples that are lost.
    pub lost: f64,
}

/// Statistics of `samples` weights for each combination of [`THETAS_DEG`], [`PHIS_DEG`] and [`WAVELENGTHS_NM`]. The
/// wavelength varies fastest.
pub fn weight_statistics(surface: &Surface, samples: usize) -> Vec<SamplerRow> {
    let mut incidences = Vec::new();
    for theta_deg in THETAS_DEG {
        for phi_deg in PHIS_DEG {
            incidences.extend(WAVELENGTHS_NM.map(|nm| (theta_deg, phi_deg, nm)));
        }
    }
    incidences
        .par_iter()
        .map(|&(theta_deg, phi_deg, nm)| weight_statistics_at(surface, theta_deg, phi_deg, nm, samples))
        .collect()
}

/// Statistics of `samples` weights at one incidence and wavelength; 0 samples count as 1.
///
/// Every call draws the same random numbers, so that results repeat.
pub fn weight_statistics_at(
    surface: &Surface,
    theta_deg: f64,
    phi_deg: f64,
    wavelength_nm: f64,
    samples: usize,
) -> SamplerRow {
    // An arbitrary fixed seed.
    let mut random = Pcg64::seed_from_u64(31);
    let wi = direction_from_degrees(theta_deg, phi_deg);
    let samples = samples.max(1);
    let mut lost = 0;
    let mut weights: Vec<f64> = (0..samples)
        .map(|_| {
            let sample = surface.sample(wi, &[wavelength_nm], random.random());
            lost += usize::from(sample.is_none());
            sample.map_or(0.0, |sample| sample.weight)
        })
        .collect();
    weights.sort_by(f64::total_cmp);
    let count = samples as f64;
    let mean = weights.iter().sum::<f64>() / count;
    let variance = weights.iter().map(|w| (w - mean).powi(2)).sum::<f64>() / count;
    let relative = |value: f64| if mean > 0.0 { value / mean } else { 0.0 };
    SamplerRow {
        theta_deg,
        phi_deg,
        wavelength_nm,
        mean,
        relative_std: relative(variance.sqrt()),
        p999_to_mean: relative(weights[(0.999 * count) as usize]),
        max_to_mean: relative(weights[samples - 1]),
        lost: lost as f64 / count,
    }
}
