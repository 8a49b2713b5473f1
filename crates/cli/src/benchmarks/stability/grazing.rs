//! Grazing incidence, up to 89.99°: errors of the tables against the direct sum, reciprocity and albedo.
//!
//! S is the power spectral density in µm². Reciprocity compares f_r(wi, wo) with f_r(wo, wi). A query is a pair of
//! directions with a wavelength in nm.

use super::relief::{rough, sinusoid, uniform_direction};
use super::{largest, percentile_99, table_error};
use crate::arguments::direction_from_degrees;
use crate::benchmarks::BenchError;
use serde::Serialize;
use sunbeam::height_field::random::Random;
use sunbeam::height_field::{HeightField, Preset};
use sunbeam::lobe::{Exact, Surface};
use sunbeam::scattering::{Options, Vec3};

/// Angles of incidence in degrees; chosen denser towards 90°.
pub const GRAZING_DEG: [f64; 12] = [0.0, 30.0, 60.0, 75.0, 80.0, 85.0, 88.0, 89.0, 89.5, 89.9, 89.97, 89.99];

/// Wavelengths in nm: both ends of the tables' range, and its middle.
const WAVELENGTHS_NM: [f64; 3] = [360.0, 550.0, 830.0];

/// The normal of the surface.
const NORMAL: Vec3 = [0.0, 0.0, 1.0];

/// The sweep on one surface.
#[derive(Clone, Debug, Serialize)]
pub struct GrazingSurface {
    /// Name of the surface.
    pub name: &'static str,
    /// Tolerance of its tables.
    pub tolerance: f64,
    /// One point for each of [`GRAZING_DEG`].
    pub points: Vec<GrazingPoint>,
}

/// Extremes at one angle of incidence, over azimuths, wavelengths and outgoing directions.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct GrazingPoint {
    /// Angle of incidence in degrees.
    pub theta_deg: f64,
    /// 99th percentile of the error of S against the direct sum, relative to the scale of the tables' tolerance.
    pub error_p99: f64,
    /// Largest error of S.
    pub error_largest: f64,
    /// Largest relative difference of `f_r` when the directions are exchanged.
    pub reciprocity: f64,
    /// Largest albedo.
    pub albedo: f64,
    /// Largest albedo without energy conservation.
    pub albedo_unscaled: f64,
    /// Largest weight of a sample.
    pub weight: f64,
    /// Number of reflectances and densities that are negative, NaN or infinite.
    pub broken: u64,
}

/// Sweeps a blazed grating, a steep sinusoid and a rough relief, with `directions` queries at each angle.
///
/// # Errors
/// Tables that cannot be built.
pub fn grazing(directions: usize) -> Result<Vec<GrazingSurface>, BenchError> {
    // 17 × 13 pixels of 0.11 × 0.23 µm, and heights up to 0.4 µm.
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

/// The sweep over all angles of incidence on one surface, with the default options.
fn sweep(name: &'static str, field: &HeightField, directions: usize) -> Result<GrazingSurface, BenchError> {
    let options = Options::default();
    let surface = Surface::new(field, &options)?;
    let unscaled = Surface::new(field, &Options { conserve_energy: false, ..options.clone() })?;
    let exact = Exact::new(field, &options, surface.albedo_table().cloned());
    let mut random = Random::new(10);
    let points =
        GRAZING_DEG.iter().map(|theta| measure(*theta, [&surface, &unscaled], &exact, directions, &mut random));
    Ok(GrazingSurface { name, tolerance: options.tolerance, points: points.collect() })
}

/// The point at one angle of incidence; `unscaled` is the surface without energy conservation.
fn measure(
    theta_deg: f64,
    [surface, unscaled]: [&Surface; 2],
    exact: &Exact,
    directions: usize,
    random: &mut Random,
) -> GrazingPoint {
    let queries = queries(theta_deg, surface, directions, random);
    let mut errors: Vec<f64> = queries.iter().map(|(wi, wo, nm)| table_error(surface, exact, *wi, *wo, *nm)).collect();
    let (mut broken, mut reciprocity, mut weights) = (0, Vec::new(), Vec::new());
    for (wi, wo, nm) in &queries {
        let (there, back) = (surface.eval_pdf(*wi, *wo, *nm), surface.eval_pdf(*wo, *wi, *nm));
        let is_valid = |value: f64| value.is_finite() && value >= 0.0;
        broken += [there.f, back.f, there.pdf, back.pdf].into_iter().filter(|value| !is_valid(*value)).count() as u64;
        let most = there.f.max(back.f);
        reciprocity.push(if most > 0.0 { (there.f - back.f).abs() / most } else { 0.0 });
        let sample = surface.sample(*wi, &[*nm], [random.unit(), random.unit(), random.unit()]);
        weights.extend(sample.map(|sample| sample.weight));
    }
    let albedo = |surface: &Surface| {
        // An albedo is an integral over the hemisphere and takes long. Every third query, at most 60, is enough.
        let some = queries.iter().step_by(3).take(60);
        largest(some.filter_map(|(wi, _, nm)| surface.albedo(*wi, *nm)))
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

/// At least `count` triples of incident direction, outgoing direction and wavelength in nm.
///
/// First come special outgoing directions for each of four azimuths: the mirror direction, the incident direction, the
/// direction turned by 90° about the normal, the normal, and two directions near the horizon. The others are uniform or
/// sampled, in turn.
fn queries(theta_deg: f64, surface: &Surface, count: usize, random: &mut Random) -> Vec<(Vec3, Vec3, f64)> {
    let mut queries = Vec::new();
    for nm in WAVELENGTHS_NM {
        for phi in [0.0, 35.0, 90.0, 180.0] {
            let wi = direction_from_degrees(theta_deg, phi);
            let others = [
                direction_from_degrees(theta_deg, phi + 180.0),
                wi,
                direction_from_degrees(theta_deg, phi + 90.0),
                NORMAL,
            ];
            let at_horizon = [direction_from_degrees(89.99, phi + 170.0), direction_from_degrees(89.99, phi)];
            queries.extend(others.into_iter().chain(at_horizon).map(|wo| (wi, wo, nm)));
        }
    }
    while queries.len() < count {
        let (wi, nm) = (direction_from_degrees(theta_deg, random.between(-180.0, 180.0)), random.between(360.0, 830.0));
        let u = [random.unit(), random.unit(), random.unit()];
        let sampled = surface.sample_direction(wi, &[nm], u);
        let is_uniform = queries.len().is_multiple_of(2);
        queries.push((wi, if is_uniform { uniform_direction(random) } else { sampled.unwrap_or(NORMAL) }, nm));
    }
    queries
}
