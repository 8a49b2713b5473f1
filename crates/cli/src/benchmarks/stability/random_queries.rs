//! Random queries of random surfaces: every answer must be finite and non-negative.
//!
//! A query is a pair of directions and a wavelength, with three random numbers for a sample. Each surface answers with
//! the reflectance, the sampling density and a sample, for the directions in both orders (reciprocity). Every
//! [`METHODS_STRIDE`]-th query is also given to the published methods. For surfaces that conserve energy, albedos are
//! integrated and compared with 1. Seeds are fixed, so runs repeat.

use super::relief::{rough, sinusoid, step, uniform_direction};
use crate::arguments::direction_from_degrees;
use crate::benchmarks::BenchError;
use rayon::prelude::*;
use serde::Serialize;
use sunbeam::height_field::random::Random;
use sunbeam::height_field::{HeightField, HeightFieldError};
use sunbeam::lobe::Surface;
use sunbeam::methods::{self, Method, MethodKind, MethodOptions};
use sunbeam::scattering::{Obliquity, Options, Vec3};
use sunbeam::table::{Model, Tiling};

/// Number of queries of one surface. Chosen: they take about as long as building the surface.
const QUERIES_PER_SURFACE: u64 = 25_000;
/// Smallest number of surfaces. Chosen, so that short runs see several kinds of relief.
const SURFACES_MIN: u64 = 4;
/// Step between the queries that the published methods answer as well. Chosen: these methods take much longer.
const METHODS_STRIDE: u64 = 50;
/// Number of albedos that are integrated for each surface. Chosen for the time that they take.
const ALBEDOS: usize = 110;
/// Amount by which an albedo may exceed 1, besides the tolerance of its surface's table.
///
/// It is the excess that the energy limiter accepts between the nodes of its table (docs/tables.md, "Energy").
const ALBEDO_SLACK: f64 = 1e-2;
/// Reflectance in 1/sr below which reciprocity is not checked: smaller ones drown in the rounding of the tables.
const RECIPROCITY_FLOOR: f64 = 1e-12;

/// Counts and extremes over all queries.
#[derive(Clone, Copy, Debug, Default, Serialize)]
pub struct RandomQueries {
    /// Queries, each of reflectance, density and a sample, with the directions in both orders.
    #[serde(rename = "asked")]
    pub queries: u64,
    /// Queries that the published methods answered as well.
    #[serde(rename = "asked_of_methods")]
    pub method_queries: u64,
    /// Surfaces that were built.
    pub surfaces: u64,
    /// Random surfaces that were refused because their tables would be too large.
    pub refused: u64,
    /// Answers that are NaN or infinite.
    pub not_finite: u64,
    /// Negative reflectances, densities and weights.
    pub negative: u64,
    /// Sampling densities of 0 above the horizon.
    pub without_density: u64,
    /// Largest relative difference of the reflectance when the directions are exchanged.
    pub reciprocity: f64,
    /// Samples above the horizon.
    pub samples: u64,
    /// Surfaces of the ensemble model with energy conservation.
    pub scaled_surfaces: u64,
    /// Albedos integrated on these surfaces.
    pub albedos: u64,
    /// Largest of these albedos.
    pub albedo: f64,
    /// Number of these albedos above 1 by more than their surface's tolerance and 0.001.
    pub albedos_above: u64,
    /// Largest mean weight of a surface's samples, less four standard errors. The mean weight estimates the mean
    /// albedo.
    pub mean_weight: f64,
    /// Largest excess of an albedo over 1.001, in units of its surface's tolerance.
    pub albedo_excess: f64,
}

impl RandomQueries {
    /// Sums of the counts and maxima of the extremes.
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

    /// Counts an answer that is negative, NaN or infinite.
    fn check(&mut self, value: f64) {
        self.not_finite += u64::from(!value.is_finite());
        self.negative += u64::from(value < 0.0);
    }
}

/// Evaluates `count` random queries, about [`QUERIES_PER_SURFACE`] of each random surface.
///
/// # Errors
/// A published method that refuses a surface for another reason than its size or depth.
pub fn random_queries(count: u64) -> Result<RandomQueries, BenchError> {
    let surfaces = count.div_ceil(QUERIES_PER_SURFACE).max(SURFACES_MIN);
    let part = |i: u64| (i + 1) * count / surfaces - i * count / surfaces;
    (0..surfaces)
        .into_par_iter()
        .map(|i| query_surface(i, part(i)))
        .try_reduce(RandomQueries::default, |a, b| Ok(a.merged(b)))
}

/// The relief and the options of a random surface.
struct RandomSurface {
    field: HeightField,
    options: Options,
}

/// A random surface: a rough relief, a step, a sinusoid, a shallow rough relief or a plane, with random options.
fn random_surface(random: &mut Random) -> Result<RandomSurface, HeightFieldError> {
    let mut log_uniform = |low: f64, high: f64| (random.between(low.ln(), high.ln())).exp();
    // κH up to 200 at the tables' shortest wavelength.
    let height_um = log_uniform(1e-3, 400.0 * 0.36 / (4.0 * std::f64::consts::PI));
    let (coherence_length_um, tolerance) = (log_uniform(1.0, 1e4), log_uniform(1e-4, 1e-2));
    let pixel = (log_uniform(0.05, 0.6), log_uniform(0.05, 0.6));
    let mut size = || 1 + (random.unit() * 24.0) as usize;
    let pixels = (size(), size());
    let field = match (random.unit() * 5.0) as u32 {
        0 => rough(random, pixels, pixel, height_um)?,
        1 => step(pixels, pixel, height_um)?,
        2 => sinusoid(16 + pixels.0, 20.0 * pixel.0, height_um)?,
        3 => rough(random, pixels, pixel, height_um.min(0.5))?,
        _ => rough(random, pixels, pixel, 0.0)?,
    };
    // A constant offset of the heights must not change any answer.
    let offset = if random.unit() < 0.2 { 1000.0 } else { 0.0 };
    let field = HeightField::new(field.heights_um() + offset, field.dx_um(), field.dy_um())?;
    let mut coin = || random.unit() < 0.5;
    let options = Options {
        coherence_length_um,
        model: if coin() { Model::Ensemble } else { Model::Patch },
        tiling: if coin() { Tiling::Periodic } else { Tiling::Aperiodic },
        obliquity: if coin() { Obliquity::Stam } else { Obliquity::Unit },
        index: None,
        conserve_energy: coin(),
        shadowing: coin(),
        tolerance,
        build_limit: 1.0,
    };
    Ok(RandomSurface { field, options })
}

/// Builds the random surface with the index `index` and evaluates `count` queries of it.
fn query_surface(index: u64, count: u64) -> Result<RandomQueries, BenchError> {
    let mut random = Random::new(1000 + index);
    let mut found = RandomQueries { surfaces: 1, queries: count, ..RandomQueries::default() };
    let (described, surface) = loop {
        let described = random_surface(&mut random)?;
        match Surface::new(&described.field, &described.options) {
            Ok(surface) => break (described, surface),
            Err(_) => found.refused += 1,
        }
    };
    let methods = published_methods(&described)?;
    let (mut sum, mut squares) = (0.0, 0.0);
    for i in 0..count {
        let nm = wavelength(&mut random);
        let wi = incident(&mut random);
        let sample = surface.sample(wi, &[nm], [random.unit(), random.unit(), random.unit()]);
        if let Some(sample) = &sample {
            found.check(sample.weight);
            found.check(sample.pdf);
            sum += sample.weight;
            squares += sample.weight * sample.weight;
            found.samples += 1;
        }
        let wo = outgoing(&mut random, wi, sample.map(|sample| sample.wo));
        let (there, back) = (surface.eval_pdf(wi, wo, nm), surface.eval_pdf(wo, wi, nm));
        [there.f, back.f, there.pdf, back.pdf].into_iter().for_each(|value| found.check(value));
        found.without_density += u64::from(there.pdf == 0.0) + u64::from(back.pdf == 0.0);
        let most = there.f.max(back.f);
        if most > RECIPROCITY_FLOOR {
            found.reciprocity = found.reciprocity.max((there.f - back.f).abs() / most);
        }
        if i % METHODS_STRIDE == 0 {
            found.method_queries += 1;
            query_methods(&methods, [wi, wo], nm, &mut found);
        }
    }
    // Energy is conserved for the mean over window positions only: a single patch may be brighter.
    let Options { conserve_energy, model, tolerance, .. } = described.options;
    if conserve_energy && model == Model::Ensemble {
        found.scaled_surfaces = 1;
        let n = count.max(1) as f64;
        let mean = sum / n;
        found.mean_weight = mean - 4.0 * ((squares / n - mean * mean).max(0.0) / n).sqrt();
        check_albedos(&surface, tolerance, &mut random, &mut found);
    }
    Ok(found)
}

/// Checks the answers of the published methods to one query.
fn query_methods(methods: &[Box<dyn Method>], directions: [Vec3; 2], nm: f64, found: &mut RandomQueries) {
    let [wi, wo] = directions.map(|w| w.map(|c| c as f32));
    for method in methods {
        // Out-of-gamut colours have negative components.
        found.not_finite += method.answer_rgb(wi, wo).iter().filter(|value| !value.is_finite()).count() as u64;
        method.answer_spectral(wi, wo, nm as f32).into_iter().for_each(|value| found.check(value.into()));
    }
}

/// Checks albedos of a surface that conserves energy.
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
fn published_methods(described: &RandomSurface) -> Result<Vec<Box<dyn Method>>, BenchError> {
    let patch =
        Options { model: Model::Patch, tiling: Tiling::Periodic, conserve_energy: false, ..described.options.clone() };
    let method_options = MethodOptions { lambda_step_nm: 20.0, period_um: Some(1.0), ..MethodOptions::default() };
    let kinds = MethodKind::ALL.into_iter().filter(|kind| kind.is_patch_only());
    kinds
        .filter_map(|kind| match methods::build(kind, &described.field, &patch, &method_options) {
            Ok(method) => Some(Ok(method)),
            Err(methods::MethodError::TooManyTerms { .. } | methods::MethodError::TooWide { .. }) => None,
            Err(source) => Some(Err(BenchError::Method { candidate: kind.to_string(), source })),
        })
        .collect()
}

/// A random wavelength of the tables' range, 360 to 830 nm; each end has a probability of 2 %.
fn wavelength(random: &mut Random) -> f64 {
    match random.unit() {
        u if u < 0.02 => 360.0,
        u if u < 0.04 => 830.0,
        _ => random.between(360.0, 830.0),
    }
}

/// A random incident direction; a quarter of them lie 0.01° to 1° above the horizon.
fn incident(random: &mut Random) -> Vec3 {
    if random.unit() < 0.25 {
        direction_from_degrees(random.between(89.0, 89.99), random.between(-180.0, 180.0))
    } else {
        uniform_direction(random)
    }
}

/// A random outgoing direction. Half are the sample of `wi`; the others are its mirror direction, `wi` itself, near the
/// horizon, or uniform, an eighth each.
fn outgoing(random: &mut Random, wi: Vec3, sampled: Option<Vec3>) -> Vec3 {
    match (random.unit() * 8.0) as u32 {
        0 => [-wi[0], -wi[1], wi[2]],
        1 => wi,
        2 => direction_from_degrees(random.between(89.9, 89.99), random.between(-180.0, 180.0)),
        3 => uniform_direction(random),
        _ => sampled.unwrap_or_else(|| uniform_direction(random)),
    }
}
