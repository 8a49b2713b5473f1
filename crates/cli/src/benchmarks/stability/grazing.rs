//! Incidence up to 89.99°: the tables against the oracle, reciprocity and energy.

use super::relief::{anywhere, direction, rough, sinusoid};
use super::{largest, percentile_99, table_error};
use crate::benchmarks::BenchError;
use serde::Serialize;
use sunbeam::height_field::random::Random;
use sunbeam::height_field::{HeightField, Preset};
use sunbeam::lobe::{Exact, Surface};
use sunbeam::scattering::{Options, Vec3};

/// Angles of incidence in degrees.
pub const GRAZING_DEG: [f64; 12] = [0.0, 30.0, 60.0, 75.0, 80.0, 85.0, 88.0, 89.0, 89.5, 89.9, 89.97, 89.99];

/// Wavelengths in nm: both ends of the tables' range, and the middle.
const WAVELENGTHS_NM: [f64; 3] = [360.0, 550.0, 830.0];

/// The sweep on one surface.
#[derive(Clone, Debug, Serialize)]
pub struct GrazingSurface {
    pub name: &'static str,
    /// Tolerance of its tables.
    pub tolerance: f64,
    pub points: Vec<GrazingPoint>,
}

/// What was found at one angle of incidence, over several azimuths, all of [`WAVELENGTHS_NM`], and outgoing directions that
/// mirror, return, cross, follow the horizon and the sampler, or lie anywhere.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct GrazingPoint {
    pub theta_deg: f64,
    /// Error of S against the oracle, relative to the largest of its value, the mean over κ and the density floor.
    pub error_p99: f64,
    pub error_largest: f64,
    /// Largest relative difference of `f_r` under exchange of the directions.
    pub reciprocity: f64,
    /// Largest albedo.
    pub albedo: f64,
    /// The same where energy is not conserved.
    pub albedo_unscaled: f64,
    /// Largest weight of a sample.
    pub weight: f64,
    /// Values of reflectance and density that were not finite or negative.
    pub broken: u64,
}

/// The sweep over a blazed grating, a steep sinusoid and a rough relief.
///
/// # Errors
/// Tables that were not made.
pub fn grazing(directions: usize) -> Result<Vec<GrazingSurface>, BenchError> {
    let rough = rough(&mut Random::new(7), (17, 13), (0.11, 0.23), 0.4)?;
    [
        ("blazed", Preset::Blazed.build(None, None)?),
        ("steep sinusoid", sinusoid(256, 1.25, 0.3)?),
        ("rough relief", rough),
    ]
    .into_iter()
    .map(|(name, field)| sweep(name, &field, directions))
    .collect()
}

fn sweep(name: &'static str, field: &HeightField, directions: usize) -> Result<GrazingSurface, BenchError> {
    let options = Options::default();
    let surface = Surface::new(field, &options)?;
    let unscaled = Surface::new(field, &Options { conserve_energy: false, ..options.clone() })?;
    let exact = Exact::new(field, &options, surface.albedo_table().cloned());
    let mut random = Random::new(10);
    let points = GRAZING_DEG.iter().map(|theta| at(*theta, [&surface, &unscaled], &exact, directions, &mut random));
    Ok(GrazingSurface { name, tolerance: options.tolerance, points: points.collect() })
}

fn at(
    theta_deg: f64,
    [surface, unscaled]: [&Surface; 2],
    exact: &Exact,
    directions: usize,
    random: &mut Random,
) -> GrazingPoint {
    let mut asked: Vec<(Vec3, Vec3, f64)> = Vec::new();
    for nm in WAVELENGTHS_NM {
        for phi in [0.0, 35.0, 90.0, 180.0] {
            let wi = direction(theta_deg, phi);
            let others = [direction(theta_deg, phi + 180.0), wi, direction(theta_deg, phi + 90.0), [0.0, 0.0, 1.0]];
            let level = [direction(89.99, phi + 170.0), direction(89.99, phi)];
            asked.extend(others.into_iter().chain(level).map(|wo| (wi, wo, nm)));
        }
    }
    while asked.len() < directions {
        let (wi, nm) = (direction(theta_deg, random.between(-180.0, 180.0)), random.between(360.0, 830.0));
        let u = [random.unit(), random.unit(), random.unit()];
        let sampled = surface.sample_direction(wi, &[nm], u);
        let wo = if asked.len().is_multiple_of(2) { anywhere(random) } else { sampled.unwrap_or([0.0, 0.0, 1.0]) };
        asked.push((wi, wo, nm));
    }
    let mut errors: Vec<f64> = asked.iter().map(|(wi, wo, nm)| table_error(surface, exact, *wi, *wo, *nm)).collect();
    let (mut broken, mut reciprocity, mut weights) = (0, Vec::new(), Vec::new());
    for (wi, wo, nm) in &asked {
        let (there, back) = (surface.eval_pdf(*wi, *wo, *nm), surface.eval_pdf(*wo, *wi, *nm));
        let fine = |value: f64| value.is_finite() && value >= 0.0;
        broken += [there.f, back.f, there.pdf, back.pdf].into_iter().filter(|value| !fine(*value)).count() as u64;
        let most = there.f.max(back.f);
        reciprocity.push(if most > 0.0 { (there.f - back.f).abs() / most } else { 0.0 });
        let sample = surface.sample(*wi, &[*nm], [random.unit(), random.unit(), random.unit()]);
        weights.extend(sample.map(|sample| sample.weight));
    }
    let albedo = |surface: &Surface| {
        let few = asked.iter().step_by(3).take(60);
        largest(few.filter_map(|(wi, _, nm)| surface.albedo(*wi, *nm)))
    };
    GrazingPoint {
        theta_deg,
        error_p99: percentile_99(&mut errors),
        error_largest: largest(errors),
        reciprocity: largest(reciprocity),
        albedo: albedo(surface),
        albedo_unscaled: albedo(unscaled),
        weight: largest(weights),
        broken,
    }
}
