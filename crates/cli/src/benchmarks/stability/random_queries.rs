//! Random queries of random surfaces: every answer must be finite and non-negative.
//!
//! A query is a pair of directions (wi to the light, wo to the viewer) and a wavelength, with three random numbers for
//! a sample. Each surface answers with a sample, and with the reflectance and the sampling density for (wi, wo) and for
//! (wo, wi), whose reflectances must be equal (reciprocity). Every [`METHODS_STRIDE`]-th query is also given to the
//! published methods (flss, nmm, pq, stam; docs/realtime.md). For surfaces that conserve energy, albedos (reflected
//! fractions of the light from one direction) are integrated and compared with 1. Seeds are fixed, so every run draws
//! the same queries.
//!
//! κ = 2π·(cosθi + cosθo)/λ is the phase rate of a pair of directions, and H half the range of a relief's heights.

use super::relief::{rough, sinusoid, step, uniform_direction};
use crate::arguments::direction_from_degrees;
use crate::benchmarks::BenchError;
use crate::reflector::single;
use rayon::prelude::*;
use serde::Serialize;
use std::f64::consts::PI;
use sunbeam::height_field::random::Random;
use sunbeam::height_field::{HeightField, HeightFieldError};
use sunbeam::lobe::Surface;
use sunbeam::methods::{self, Method, MethodKind, MethodOptions};
use sunbeam::scattering::{Obliquity, Options, Vec3};
use sunbeam::table::{Model, Tiling, WAVELENGTH_MAX_NM, WAVELENGTH_MIN_NM};

/// Largest number of queries of one surface. They take about as long as building it; more would mean fewer surfaces in
/// the same time.
const QUERIES_PER_SURFACE: u64 = 25_000;
/// Smallest number of surfaces, so that short runs see several kinds of relief.
const SURFACES_MIN: u64 = 4;
/// Step between the queries that the published methods answer as well. These methods take much longer, so smaller steps
/// would leave time for fewer surfaces.
const METHODS_STRIDE: u64 = 50;
/// Number of albedos that are integrated for each surface that conserves energy. Larger values find rarer excesses over
/// 1, but an albedo takes as long as many queries.
const ALBEDOS: usize = 110;
/// Amount by which an albedo may exceed 1, besides the tolerance of its surface's table: the excess that is accepted
/// between the nodes of the albedo's table (docs/tables.md, "Energy").
const ALBEDO_SLACK: f64 = 1e-2;
/// Reflectance in 1/sr below which reciprocity is not checked. Rounding dominates smaller ones.
const RECIPROCITY_FLOOR: f64 = 1e-12;
/// Largest κH of a random relief at the shortest wavelength of the tables, both directions along the normal. The sweep
/// over depth (`deep.rs`) ends at this value, too.
const KAPPA_H_MAX: f64 = 200.0;
/// Smallest range of heights of a random relief in µm, optically flat.
const HEIGHT_MIN_UM: f64 = 1e-3;
/// Largest range of heights of a shallow relief in µm. The published methods accept shallow reliefs most often.
const SHALLOW_UM: f64 = 0.5;
/// Offset of the heights of some reliefs in µm. A constant offset must not change any answer.
const OFFSET_UM: f64 = 1000.0;

/// Counts and extremes over all queries. Some keys of the JSON say "asked" for queries.
#[derive(Clone, Copy, Debug, Default, Serialize)]
pub struct RandomQueries {
    /// Queries: for each, a sample is drawn, and reflectance and density are evaluated for (wi, wo) and (wo, wi).
    #[serde(rename = "asked")]
    pub queries: u64,
    /// Queries that the published methods answered as well.
    #[serde(rename = "asked_of_methods")]
    pub method_queries: u64,
    /// Surfaces that were built.
    pub surfaces: u64,
    /// Random surfaces whose tables would be too large or take too long to build. Others took their place.
    pub refused: u64,
    /// Answers that are NaN or infinite.
    pub not_finite: u64,
    /// Answers that are negative. Colours of the published methods do not count, since out-of-gamut colours have
    /// negative channels.
    pub negative: u64,
    /// Sampling densities of 0. None should be, since all directions are above the horizon.
    pub without_density: u64,
    /// Largest difference of the reflectance when the directions are exchanged, relative to the larger value.
    pub reciprocity: f64,
    /// Samples above the horizon.
    pub samples: u64,
    /// Surfaces of the ensemble model (the mean over all positions of the coherence window) with energy conservation. A
    /// patch, a single position, may be brighter than the ensemble, so its albedo is not limited.
    pub scaled_surfaces: u64,
    /// Albedos integrated on these surfaces.
    pub albedos: u64,
    /// Largest of these albedos.
    pub albedo: f64,
    /// Number of these albedos above 1 by more than the sum of `ALBEDO_SLACK` and their surface's tolerance.
    pub albedos_above: u64,
    /// Largest lower bound of the mean albedo of one of these surfaces. The bound is the mean weight of its samples
    /// less four standard errors, so that noise alone hardly ever lifts it above 1.
    pub mean_weight: f64,
    /// Largest excess of an albedo over 1 + `ALBEDO_SLACK`, in units of its surface's tolerance; 0 without an excess.
    pub albedo_excess: f64,
}

impl RandomQueries {
    /// The sum of each count and the maximum of each extreme.
    fn merged(self, other: Self) -> Self {
        Self {
            queries: self.queries + other.queries,
            method_queries: self.method_queries + other.method_queries,
            surfaces: self.surfaces + other.surfaces,
            refused: self.refused + other.refused,
            not_finite: self.not_finite + other.not_finite,
            negative: self.negative + other.negative,
            without_density: self.without_density + other.without_density,
            reciprocity: self.reciprocity.max(other.reciprocity),
            samples: self.samples + other.samples,
            scaled_surfaces: self.scaled_surfaces + other.scaled_surfaces,
            albedos: self.albedos + other.albedos,
            albedo: self.albedo.max(other.albedo),
            albedos_above: self.albedos_above + other.albedos_above,
            mean_weight: self.mean_weight.max(other.mean_weight),
            albedo_excess: self.albedo_excess.max(other.albedo_excess),
        }
    }

    /// Counts the answer if it is negative, NaN or infinite.
    fn check(&mut self, value: f64) {
        self.not_finite += u64::from(!value.is_finite());
        self.negative += u64::from(value < 0.0);
    }
}

/// Evaluates `count` random queries, distributed evenly over random surfaces.
///
/// # Errors
/// A published method that refuses a surface for another reason than its size or depth.
pub fn random_queries(count: u64) -> Result<RandomQueries, BenchError> {
    let surfaces = count.div_ceil(QUERIES_PER_SURFACE).max(SURFACES_MIN);
    // Number of queries of the i-th surface; over all surfaces the numbers add up to `count`.
    let queries_of = |i: u64| (i + 1) * count / surfaces - i * count / surfaces;
    (0..surfaces)
        .into_par_iter()
        .map(|i| query_surface(i, queries_of(i)))
        .try_reduce(RandomQueries::default, |a, b| Ok(a.merged(b)))
}

/// A relief with the options of its surface.
struct SurfaceInput {
    field: HeightField,
    options: Options,
}

/// A random relief with random options. The relief is rough, a step, a sinusoid, rough and at most [`SHALLOW_UM`] deep,
/// or a plane.
///
/// Ranges of lengths are wider than users need. Their logarithms are uniform, so that every power of ten is equally
/// frequent.
fn random_input(random: &mut Random) -> Result<SurfaceInput, HeightFieldError> {
    let mut log_uniform = |low: f64, high: f64| (random.between(low.ln(), high.ln())).exp();
    // Along the normal κ = 4π/λ, and H is half the height.
    let height_max_um = 2.0 * KAPPA_H_MAX * (WAVELENGTH_MIN_NM * 1e-3) / (4.0 * PI);
    let height_um = log_uniform(HEIGHT_MIN_UM, height_max_um);
    let (coherence_length_um, tolerance) = (log_uniform(1.0, 1e4), log_uniform(1e-4, 1e-2));
    let pixel_um = (log_uniform(0.05, 0.6), log_uniform(0.05, 0.6));
    // 1 to 24 pixels along each axis.
    let mut side = || 1 + (random.unit() * 24.0) as usize;
    let pixels = (side(), side());
    let field = match (random.unit() * 5.0) as u32 {
        0 => rough(random, pixels, pixel_um, height_um)?,
        1 => step(pixels, pixel_um, height_um)?,
        // At least 17 columns, and a period of 1 to 12 µm.
        2 => sinusoid(16 + pixels.0, 20.0 * pixel_um.0, height_um)?,
        3 => rough(random, pixels, pixel_um, height_um.min(SHALLOW_UM))?,
        _ => rough(random, pixels, pixel_um, 0.0)?,
    };
    let offset_um = if random.unit() < 0.2 { OFFSET_UM } else { 0.0 };
    let field = HeightField::new(field.heights_um() + offset_um, field.dx_um(), field.dy_um())?;
    let mut coin = || random.unit() < 0.5;
    // The relief alone is tested, without a material, a cover, textures of sizes and transmission. Without a cover
    // `reach` is 1: light may leave in all directions. A `build_limit` of 1 keeps the usual limits of memory and time.
    let options = Options {
        coherence_length_um,
        model: if coin() { Model::Ensemble } else { Model::Patch },
        tiling: if coin() { Tiling::Periodic } else { Tiling::Aperiodic },
        obliquity: if coin() { Obliquity::Stam } else { Obliquity::Unit },
        index: None,
        conserve_energy: coin(),
        shadowing: coin(),
        reach: 1.0,
        sizes: None,
        body: None,
        tolerance,
        build_limit: 1.0,
    };
    Ok(SurfaceInput { field, options })
}

/// Builds a random surface and evaluates `count` queries of it. `index` determines the random numbers.
fn query_surface(index: u64, count: u64) -> Result<RandomQueries, BenchError> {
    // An arbitrary seed, different for each surface.
    let mut random = Random::new(1000 + index);
    let mut found = RandomQueries { surfaces: 1, queries: count, ..RandomQueries::default() };
    let (input, surface) = loop {
        let input = random_input(&mut random)?;
        match Surface::new(&input.field, &input.options) {
            Ok(surface) => break (input, surface),
            // The options are within their ranges, so only the size or the time of the build was refused.
            Err(_) => found.refused += 1,
        }
    };
    let methods = published_methods(&input)?;
    // Sums of the samples' weights and of their squares. A sample below the horizon adds 0.
    let (mut weights, mut squared_weights) = (0.0, 0.0);
    for i in 0..count {
        let nm = wavelength(&mut random);
        let wi = incident(&mut random);
        let sample = surface.sample(wi, &[nm], [random.unit(), random.unit(), random.unit()]);
        if let Some(sample) = &sample {
            found.check(sample.weight);
            found.check(sample.pdf);
            weights += sample.weight;
            squared_weights += sample.weight * sample.weight;
            found.samples += 1;
        }
        let wo = outgoing(&mut random, wi, sample.map(|sample| sample.wo));
        let (there, back) = (surface.eval_pdf(wi, wo, nm), surface.eval_pdf(wo, wi, nm));
        [there.f, back.f, there.pdf, back.pdf].into_iter().for_each(|value| found.check(value));
        found.without_density += u64::from(there.pdf == 0.0) + u64::from(back.pdf == 0.0);
        let larger = there.f.max(back.f);
        if larger > RECIPROCITY_FLOOR {
            found.reciprocity = found.reciprocity.max((there.f - back.f).abs() / larger);
        }
        if i % METHODS_STRIDE == 0 {
            found.method_queries += 1;
            query_methods(&methods, [wi, wo], nm, &mut found);
        }
    }
    let Options { conserve_energy, model, tolerance, .. } = input.options;
    if conserve_energy && model == Model::Ensemble {
        found.scaled_surfaces = 1;
        // A short run may leave a surface without queries.
        let n = count.max(1) as f64;
        let mean = weights / n;
        let variance = (squared_weights / n - mean * mean).max(0.0);
        found.mean_weight = mean - 4.0 * (variance / n).sqrt();
        check_albedos(&surface, tolerance, &mut random, &mut found);
    }
    Ok(found)
}

/// Checks the answers of the published methods to one query, a pair of directions `[wi, wo]` and a wavelength.
fn query_methods(methods: &[Box<dyn Method>], directions: [Vec3; 2], nm: f64, found: &mut RandomQueries) {
    let [wi, wo] = directions.map(single);
    for method in methods {
        // Out-of-gamut colours have negative channels, which are no errors.
        found.not_finite += method.answer_rgb(wi, wo).iter().filter(|value| !value.is_finite()).count() as u64;
        method.answer_spectral(wi, wo, nm as f32).into_iter().for_each(|value| found.check(value.into()));
    }
}

/// Integrates and checks [`ALBEDOS`] albedos of a surface that conserves energy. `tolerance` is that of its tables.
fn check_albedos(surface: &Surface, tolerance: f64, random: &mut Random, found: &mut RandomQueries) {
    for _ in 0..ALBEDOS {
        let (wi, nm) = (incident(random), wavelength(random));
        if let Some(albedo) = surface.albedo(wi, nm) {
            found.albedos += 1;
            found.check(albedo);
            found.albedo = found.albedo.max(albedo);
            let excess = (albedo - 1.0 - ALBEDO_SLACK) / tolerance;
            found.albedos_above += u64::from(excess > 1.0);
            found.albedo_excess = found.albedo_excess.max(excess);
        }
    }
}

/// The published methods for the relief, without those that refuse it because it is too deep or too wide.
fn published_methods(input: &SurfaceInput) -> Result<Vec<Box<dyn Method>>, BenchError> {
    let patch =
        Options { model: Model::Patch, tiling: Tiling::Periodic, conserve_energy: false, ..input.options.clone() };
    // Coarse steps between wavelengths save time. With a given period, stam accepts reliefs without one.
    let method_options = MethodOptions { lambda_step_nm: 20.0, period_um: Some(1.0), ..MethodOptions::default() };
    // The colour table is the only method that is not published, and the only one for more than patches.
    let kinds = MethodKind::ALL.into_iter().filter(|kind| kind.is_patch_only());
    kinds
        .filter_map(|kind| match methods::build(kind, &input.field, &patch, &method_options) {
            Ok(method) => Some(Ok(method)),
            Err(methods::MethodError::TooManyTerms { .. } | methods::MethodError::TooWide { .. }) => None,
            Err(source) => Some(Err(BenchError::Method { candidate: kind.to_string(), source })),
        })
        .collect()
}

/// A random wavelength of the tables' range in nm. Each end has a probability of 2 %.
fn wavelength(random: &mut Random) -> f64 {
    match random.unit() {
        u if u < 0.02 => WAVELENGTH_MIN_NM,
        u if u < 0.04 => WAVELENGTH_MAX_NM,
        _ => random.between(WAVELENGTH_MIN_NM, WAVELENGTH_MAX_NM),
    }
}

/// A random incident direction. A quarter lie 0.01° to 1° above the horizon, the others are uniform over the
/// hemisphere.
fn incident(random: &mut Random) -> Vec3 {
    if random.unit() < 0.25 {
        direction_from_degrees(random.between(89.0, 89.99), random.between(-180.0, 180.0))
    } else {
        uniform_direction(random)
    }
}

/// A random outgoing direction. Half of the calls return the direction `sampled` for `wi`, or a uniform one where it is
/// `None`. An eighth each return the mirror direction of `wi`, `wi` itself, a direction near the horizon, and a uniform
/// one.
fn outgoing(random: &mut Random, wi: Vec3, sampled: Option<Vec3>) -> Vec3 {
    match (random.unit() * 8.0) as u32 {
        0 => [-wi[0], -wi[1], wi[2]],
        1 => wi,
        2 => direction_from_degrees(random.between(89.9, 89.99), random.between(-180.0, 180.0)),
        3 => uniform_direction(random),
        _ => sampled.unwrap_or_else(|| uniform_direction(random)),
    }
}
