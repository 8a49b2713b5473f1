//! Grazing incidence, up to 89.99°: errors of the tables against the direct sum, reciprocity and albedo.
//!
//! wi and wo are the directions to light and viewer, λ the wavelength. S is the power spectral density of the relief in
//! µm², from which the reflectance f_r in 1/sr follows. Reciprocity compares f_r(wi, wo) with f_r(wo, wi). An albedo is
//! the reflected fraction of the light from one direction.

use super::relief::{rough_of_primes, sinusoid, uniform_direction};
use super::{largest, percentile_99, table_error};
use crate::arguments::direction_from_degrees;
use crate::benchmarks::BenchError;
use serde::Serialize;
use sunbeam::height_field::random::Random;
use sunbeam::height_field::{HeightField, Preset};
use sunbeam::lobe::{Exact, Surface};
use sunbeam::scattering::{Options, Vec3};
use sunbeam::table::{WAVELENGTH_MAX_NM, WAVELENGTH_MIN_NM};

/// Angles of incidence in degrees, denser towards the horizon, where the obliquity factor and the albedos change fast.
pub const GRAZING_DEG: [f64; 12] = [0.0, 30.0, 60.0, 75.0, 80.0, 85.0, 88.0, 89.0, 89.5, 89.9, 89.97, 89.99];

/// Wavelengths in nm of the special queries ([`queries_at`]): both ends of the tables' range, and one in between.
const WAVELENGTHS_NM: [f64; 3] = [WAVELENGTH_MIN_NM, 550.0, WAVELENGTH_MAX_NM];
/// Azimuths in degrees of the special queries: across, oblique to and along the grooves, from either side.
const PHIS_DEG: [f64; 4] = [0.0, 35.0, 90.0, 180.0];
/// Angle with the normal in degrees of outgoing directions near the horizon.
const HORIZON_DEG: f64 = 89.99;
/// Largest number of albedos at one angle of incidence. Each is an integral over the hemisphere and takes long.
const ALBEDOS_MAX: usize = 60;
/// Step between the queries for which albedos are integrated. The 72 special queries come first, six for each direction
/// of incidence and wavelength. So 24 albedos are at those 12, each twice, and the others at random directions.
const ALBEDO_STRIDE: usize = 3;

/// The normal of the surface.
const NORMAL: Vec3 = [0.0, 0.0, 1.0];

/// A pair of directions with a wavelength.
struct Query {
    wi: Vec3,
    wo: Vec3,
    nm: f64,
}

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

/// Statistics at one angle of incidence, over azimuths, wavelengths and outgoing directions.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct GrazingPoint {
    /// Angle of incidence in degrees.
    pub theta_deg: f64,
    /// 99th percentile of the error of S against the direct sum, relative to `error_scale` (mod.rs), to which the
    /// tables' tolerance refers.
    pub error_p99: f64,
    /// Largest error of S, on the same scale.
    pub error_largest: f64,
    /// Largest difference of `f_r` when the directions are exchanged, relative to the larger value.
    pub reciprocity: f64,
    /// Largest albedo.
    pub albedo: f64,
    /// Largest albedo without energy conservation, which divides by albedos above 1.
    pub albedo_unscaled: f64,
    /// Largest weight `f_r·cosθo/pdf` of a sample.
    pub weight: f64,
    /// Number of reflectances and sampling densities that are negative, NaN or infinite.
    pub broken: u64,
}

/// Sweeps a blazed grating, a steep sinusoid and a rough relief, with at least `directions` queries at each angle.
///
/// # Errors
/// Tables that cannot be built.
pub fn grazing(directions: usize) -> Result<Vec<GrazingSurface>, BenchError> {
    [
        // The default period, 2.5 µm, and height, 0.25 µm.
        ("blazed", Preset::Blazed.build(None, None)?),
        // 256 columns, a period of 1.25 µm, and a height of 0.3 µm.
        ("steep sinusoid", sinusoid(256, 1.25, 0.3)?),
        // A height of 0.4 µm.
        ("rough relief", rough_of_primes(0.4)?),
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
    // Only S of the direct sum is compared, so it needs no table of albedos.
    let exact = Exact::new(field, &options, None);
    // An arbitrary fixed seed.
    let mut random = Random::new(10);
    let points = GRAZING_DEG
        .map(|theta_deg| measure(theta_deg, [&surface, &unscaled], &exact, directions, &mut random))
        .to_vec();
    Ok(GrazingSurface { name, tolerance: options.tolerance, points })
}

/// The point at one angle of incidence, from at least `directions` queries. `unscaled` is the surface without energy
/// conservation.
fn measure(
    theta_deg: f64,
    [surface, unscaled]: [&Surface; 2],
    exact: &Exact,
    directions: usize,
    random: &mut Random,
) -> GrazingPoint {
    let queries = queries_at(theta_deg, surface, directions, random);
    let mut errors: Vec<f64> =
        queries.iter().map(|query| table_error(surface, exact, query.wi, query.wo, query.nm)).collect();
    let (mut broken, mut differences, mut weights) = (0, Vec::new(), Vec::new());
    for &Query { wi, wo, nm } in &queries {
        let (there, back) = (surface.eval_pdf(wi, wo, nm), surface.eval_pdf(wo, wi, nm));
        let is_valid = |value: f64| value.is_finite() && value >= 0.0;
        broken += [there.f, back.f, there.pdf, back.pdf].into_iter().filter(|value| !is_valid(*value)).count() as u64;
        let larger = there.f.max(back.f);
        differences.push(if larger > 0.0 { (there.f - back.f).abs() / larger } else { 0.0 });
        let sample = surface.sample(wi, &[nm], [random.unit(), random.unit(), random.unit()]);
        weights.extend(sample.map(|sample| sample.weight));
    }
    let albedo = |surface: &Surface| {
        let chosen = queries.iter().step_by(ALBEDO_STRIDE).take(ALBEDOS_MAX);
        // Surfaces of the default model, the ensemble, always have an albedo.
        largest(chosen.filter_map(|query| surface.albedo(query.wi, query.nm)))
    };
    GrazingPoint {
        theta_deg,
        error_p99: percentile_99(&mut errors),
        error_largest: largest(errors),
        reciprocity: largest(differences),
        albedo: albedo(surface),
        albedo_unscaled: albedo(unscaled),
        weight: largest(weights),
        broken,
    }
}

/// At least `count` queries at one angle of incidence.
///
/// The special queries come first. For each of [`WAVELENGTHS_NM`] and [`PHIS_DEG`] they have six outgoing directions:
/// the mirror direction, the incident direction, the incident direction turned by 90° about the normal, the normal, and
/// two near the horizon.
///
/// The other queries have random azimuths and wavelengths. Their outgoing directions are alternately uniform over the
/// hemisphere and drawn by the sampler. The normal replaces a sample below the horizon.
fn queries_at(theta_deg: f64, surface: &Surface, count: usize, random: &mut Random) -> Vec<Query> {
    let mut queries = Vec::new();
    for nm in WAVELENGTHS_NM {
        for phi_deg in PHIS_DEG {
            let wi = direction_from_degrees(theta_deg, phi_deg);
            let outgoing = [
                direction_from_degrees(theta_deg, phi_deg + 180.0),
                wi,
                direction_from_degrees(theta_deg, phi_deg + 90.0),
                NORMAL,
                direction_from_degrees(HORIZON_DEG, phi_deg + 170.0),
                direction_from_degrees(HORIZON_DEG, phi_deg),
            ];
            queries.extend(outgoing.map(|wo| Query { wi, wo, nm }));
        }
    }
    while queries.len() < count {
        let wi = direction_from_degrees(theta_deg, random.between(-180.0, 180.0));
        let nm = random.between(WAVELENGTH_MIN_NM, WAVELENGTH_MAX_NM);
        // A direction is sampled for every query, although half of the queries ignore it: the published figures have
        // this random sequence.
        let sampled = surface.sample_direction(wi, &[nm], [random.unit(), random.unit(), random.unit()]);
        let is_uniform = queries.len().is_multiple_of(2);
        let wo = if is_uniform { uniform_direction(random) } else { sampled.unwrap_or(NORMAL) };
        queries.push(Query { wi, wo, nm });
    }
    queries
}
