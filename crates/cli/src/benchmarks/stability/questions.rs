//! Random surfaces, directions and wavelengths: nothing may come out but finite numbers that are not negative.

use super::relief::{anywhere, direction, rough, sinusoid, step};
use crate::benchmarks::BenchError;
use rayon::prelude::*;
use serde::Serialize;
use sunbeam::height_field::random::Random;
use sunbeam::height_field::{HeightField, HeightFieldError};
use sunbeam::lobe::Surface;
use sunbeam::methods::{self, Method, MethodKind, MethodOptions};
use sunbeam::scattering::{Obliquity, Options, Vec3};
use sunbeam::table::{Model, Tiling};

/// Questions put to one surface: building one costs about as much.
const QUESTIONS_EACH: u64 = 25_000;
/// Fewest surfaces.
const SURFACES_MIN: u64 = 4;
/// Every so many questions one goes to the methods of single precision too, which take much longer.
const METHODS_EVERY: u64 = 50;
/// Directions and wavelengths of each surface at which the albedo is integrated.
const ALBEDOS: usize = 110;
/// What an albedo may exceed one by besides the tolerance of its surface's table: what lies between
/// the albedo table's nodes, and the 0.0005 of the mean of 1/cosθo that its quadrature may miss in narrow lobes.
const ALBEDO_SLACK: f64 = 1e-3;
/// Reflectances below this are lost in the rounding of single-precision records when reciprocity is judged.
const RECIPROCITY_FLOOR: f64 = 1e-12;

/// Counts and extremes over all questions.
#[derive(Clone, Copy, Debug, Default, Serialize)]
pub struct Questions {
    /// Questions of reflectance, density and a sample, each with both orders of the directions.
    pub asked: u64,
    /// Of these, put to the published methods as well.
    pub asked_of_methods: u64,
    pub surfaces: u64,
    /// Surfaces drawn whose tables would have been too large.
    pub refused: u64,
    /// Numbers that came out as NaN or infinity.
    pub not_finite: u64,
    /// Reflectances, densities and weights below zero.
    pub negative: u64,
    /// Densities of zero above the horizon.
    pub without_density: u64,
    /// Largest relative difference of the reflectance under exchange of the directions.
    pub reciprocity: f64,
    /// Samples drawn, and ensembles whose energy is scaled.
    pub samples: u64,
    pub scaled_surfaces: u64,
    /// Albedos integrated over the hemisphere, and the largest, on surfaces whose energy is scaled.
    pub albedos: u64,
    pub albedo: f64,
    /// Those of them above 1 by more than their surface's tolerance and 0.001.
    pub albedos_above: u64,
    /// Largest over those surfaces of the mean weight of samples, that is the mean albedo over questions, less four
    /// standard errors.
    pub mean_weight: f64,
    /// Largest excess of an albedo over 1.001 as a share of its surface's tolerance.
    pub albedo_excess: f64,
}

impl Questions {
    fn merged(self, other: Self) -> Self {
        Self {
            asked: self.asked + other.asked,
            asked_of_methods: self.asked_of_methods + other.asked_of_methods,
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

    /// Counts what is wrong with a number that must not be negative.
    fn see(&mut self, value: f64) {
        self.not_finite += u64::from(!value.is_finite());
        self.negative += u64::from(value < 0.0);
    }
}

/// Puts `count` questions to as many surfaces as they are worth.
///
/// # Errors
/// A method that refuses a surface for another reason than its size or depth.
pub fn questions(count: u64) -> Result<Questions, BenchError> {
    let surfaces = count.div_ceil(QUESTIONS_EACH).max(SURFACES_MIN);
    let share = |i: u64| (i + 1) * count / surfaces - i * count / surfaces;
    (0..surfaces)
        .into_par_iter()
        .map(|i| one_surface(i, share(i)))
        .try_reduce(Questions::default, |a, b| Ok(a.merged(b)))
}

/// A surface that is drawn at random.
struct Drawn {
    field: HeightField,
    options: Options,
}

fn drawn(random: &mut Random) -> Result<Drawn, HeightFieldError> {
    let mut log = |low: f64, high: f64| (random.between(low.ln(), high.ln())).exp();
    // κH up to 200 at the tables' shortest wavelength.
    let height_um = log(1e-3, 400.0 * 0.36 / (4.0 * std::f64::consts::PI));
    let (coherence_length_um, tolerance) = (log(1.0, 1e4), log(1e-4, 1e-2));
    let pixel = (log(0.05, 0.6), log(0.05, 0.6));
    let mut size = || 1 + (random.unit() * 24.0) as usize;
    let pixels = (size(), size());
    let field = match (random.unit() * 5.0) as u32 {
        0 => rough(random, pixels, pixel, height_um)?,
        1 => step(pixels, pixel, height_um)?,
        2 => sinusoid(16 + pixels.0, 20.0 * pixel.0, height_um)?,
        3 => rough(random, pixels, pixel, height_um.min(0.5))?,
        _ => rough(random, pixels, pixel, 0.0)?,
    };
    // Only differences of height matter.
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
    Ok(Drawn { field, options })
}

fn one_surface(number: u64, count: u64) -> Result<Questions, BenchError> {
    let mut random = Random::new(1000 + number);
    let mut found = Questions { surfaces: 1, ..Questions::default() };
    let (drawn, surface) = loop {
        let drawn = drawn(&mut random)?;
        match Surface::new(&drawn.field, &drawn.options) {
            Ok(surface) => break (drawn, surface),
            Err(_) => found.refused += 1,
        }
    };
    let methods = methods_of(&drawn)?;
    let (mut sum, mut squares) = (0.0, 0.0);
    for i in 0..count {
        let nm = wavelength(&mut random);
        let wi = incident(&mut random);
        let sample = surface.sample(wi, &[nm], [random.unit(), random.unit(), random.unit()]);
        if let Some(sample) = &sample {
            found.see(sample.weight);
            found.see(sample.pdf);
            sum += sample.weight;
            squares += sample.weight * sample.weight;
            found.samples += 1;
        }
        let wo = outgoing(&mut random, wi, sample.map(|sample| sample.wo));
        let (there, back) = (surface.eval_pdf(wi, wo, nm), surface.eval_pdf(wo, wi, nm));
        [there.f, back.f, there.pdf, back.pdf].into_iter().for_each(|value| found.see(value));
        found.without_density += u64::from(there.pdf == 0.0) + u64::from(back.pdf == 0.0);
        let most = there.f.max(back.f);
        if most > RECIPROCITY_FLOOR {
            found.reciprocity = found.reciprocity.max((there.f - back.f).abs() / most);
        }
        if i % METHODS_EVERY == 0 {
            found.asked_of_methods += 1;
            let [wi, wo] = [wi, wo].map(|w| w.map(|c| c as f32));
            for method in &methods {
                // Colours out of gamut have negative components.
                found.not_finite += method.answer_rgb(wi, wo).iter().filter(|value| !value.is_finite()).count() as u64;
                method.answer_spectral(wi, wo, nm as f32).into_iter().for_each(|value| found.see(value.into()));
            }
        }
    }
    found.asked = count;
    // A single patch is brighter than the mean in places; what it is divided by is the mean's.
    if drawn.options.conserve_energy && drawn.options.model == Model::Ensemble {
        found.scaled_surfaces = 1;
        let n = count.max(1) as f64;
        let mean = sum / n;
        found.mean_weight = mean - 4.0 * ((squares / n - mean * mean).max(0.0) / n).sqrt();
        for _ in 0..ALBEDOS {
            let (wi, nm) = (incident(&mut random), wavelength(&mut random));
            if let Some(albedo) = surface.albedo(wi, nm) {
                found.albedos += 1;
                found.see(albedo);
                found.albedo = found.albedo.max(albedo);
                let excess = (albedo - 1.0 - ALBEDO_SLACK) / drawn.options.tolerance;
                found.albedos_above += u64::from(excess > 1.0);
                found.albedo_excess = found.albedo_excess.max(excess);
            }
        }
    }
    Ok(found)
}

/// The published methods on that relief, where it is not too deep or too wide for them.
fn methods_of(drawn: &Drawn) -> Result<Vec<Box<dyn Method>>, BenchError> {
    let patch =
        Options { model: Model::Patch, tiling: Tiling::Periodic, conserve_energy: false, ..drawn.options.clone() };
    let asked = MethodOptions { lambda_step_nm: 20.0, period_um: Some(1.0), ..MethodOptions::default() };
    let kinds = MethodKind::ALL.into_iter().filter(|kind| kind.is_patch_only());
    kinds
        .filter_map(|kind| match methods::build(kind, &drawn.field, &patch, &asked) {
            Ok(method) => Some(Ok(method)),
            Err(methods::MethodError::TooManyTerms { .. } | methods::MethodError::TooWide { .. }) => None,
            Err(source) => Some(Err(BenchError::Method { candidate: kind.to_string(), source })),
        })
        .collect()
}

/// In the tables' range, its ends included.
fn wavelength(random: &mut Random) -> f64 {
    match random.unit() {
        u if u < 0.02 => 360.0,
        u if u < 0.04 => 830.0,
        _ => random.between(360.0, 830.0),
    }
}

/// One in four within a degree of the horizon, up to 89.99°.
fn incident(random: &mut Random) -> Vec3 {
    if random.unit() < 0.25 {
        direction(random.between(89.0, 89.99), random.between(-180.0, 180.0))
    } else {
        anywhere(random)
    }
}

/// Half where the sampler went; the others mirror, return, follow the horizon or lie anywhere.
fn outgoing(random: &mut Random, wi: Vec3, sampled: Option<Vec3>) -> Vec3 {
    match (random.unit() * 8.0) as u32 {
        0 => [-wi[0], -wi[1], wi[2]],
        1 => wi,
        2 => direction(random.between(89.9, 89.99), random.between(-180.0, 180.0)),
        3 => anywhere(random),
        _ => sampled.unwrap_or_else(|| anywhere(random)),
    }
}
