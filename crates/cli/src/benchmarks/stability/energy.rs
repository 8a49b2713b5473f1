//! How far the albedo exceeds one where energy is conserved: what lies between the nodes of the albedo's table.

use super::relief::{anywhere, direction, rough, sinusoid, step};
use crate::benchmarks::BenchError;
use rayon::prelude::*;
use serde::Serialize;
use sunbeam::height_field::random::Random;
use sunbeam::height_field::{HeightField, HeightFieldError, Preset};
use sunbeam::reflectance::{Options, Surface, Vec3};

/// An albedo above this counts as above one: the tables' default tolerance more.
const ALBEDO_MAX: f64 = 1.001;
/// Heights in µm between which random reliefs reach, evenly in the logarithm: up to κH = 300 at the shortest wavelength.
const HEIGHTS_UM: [f64; 2] = [0.01, 8.6];
/// Pixels in µm, evenly in the logarithm.
const PIXELS_UM: [f64; 2] = [0.05, 0.6];

/// Albedos of one kind of surface, in the ensemble and at default options, each integrated node by node.
#[derive(Clone, Debug, Serialize)]
pub struct EnergyRow {
    /// What they are of.
    pub name: String,
    /// Surfaces of that kind.
    pub surfaces: usize,
    /// Incidences and wavelengths, over all of them.
    pub albedos: usize,
    /// Of these, above 1.001.
    pub above: usize,
    /// The largest albedo.
    pub largest: f64,
    /// Least and largest height in µm of the surfaces on which one is above 1.001.
    pub heights_above_um: Option<[f64; 2]>,
}

impl EnergyRow {
    fn new(name: &str) -> Self {
        Self { name: name.to_owned(), surfaces: 0, albedos: 0, above: 0, largest: 0.0, heights_above_um: None }
    }

    fn merged(self, other: Self) -> Self {
        let heights_above_um = match (self.heights_above_um, other.heights_above_um) {
            (Some(a), Some(b)) => Some([a[0].min(b[0]), a[1].max(b[1])]),
            (a, b) => a.or(b),
        };
        Self {
            surfaces: self.surfaces + other.surfaces,
            albedos: self.albedos + other.albedos,
            above: self.above + other.above,
            largest: self.largest.max(other.largest),
            heights_above_um,
            ..self
        }
    }
}

/// `reliefs` random reliefs of each kind, and `incidences` random ones on each; on each grating among the presets 60 times
/// as many, on each preset of two dimensions as many, which take the longest.
///
/// # Errors
/// A surface that was not made.
pub fn energy(reliefs: u64, incidences: usize) -> Result<Vec<EnergyRow>, BenchError> {
    let mut rows = Vec::new();
    for (kind, name) in ["rough", "stepped", "sinusoidal"].into_iter().enumerate() {
        let row = (0..reliefs)
            .into_par_iter()
            .map(|number| {
                let mut random = Random::new(3000 + 1000 * kind as u64 + number);
                let field = relief(name, &mut random)?;
                albedos(name, &field, incidences, &mut random)
            })
            .try_reduce(|| EnergyRow::new(name), |a, b| Ok(a.merged(b)))?;
        rows.push(row);
    }
    for preset in [Preset::Blazed, Preset::Sinusoidal, Preset::Lamellar, Preset::Cd, Preset::Elaphe, Preset::Xenopeltis]
    {
        let field = preset.build(None, None)?;
        let count = if field.heights_um().nrows() == 1 { 60 * incidences } else { incidences };
        rows.push(albedos(&format!("`{preset}`"), &field, count, &mut Random::new(29))?);
    }
    Ok(rows)
}

fn relief(kind: &str, random: &mut Random) -> Result<HeightField, HeightFieldError> {
    let mut log = |[low, high]: [f64; 2]| random.between(low.ln(), high.ln()).exp();
    let (height_um, pixel_um) = (log(HEIGHTS_UM), (log(PIXELS_UM), log(PIXELS_UM)));
    let mut size = || 2 + (random.unit() * 23.0) as usize;
    let pixels = (size(), size());
    match kind {
        "rough" => rough(random, pixels, pixel_um, height_um),
        "stepped" => step(pixels, pixel_um, height_um),
        _ => sinusoid(64, 20.0 * pixel_um.0, height_um),
    }
}

fn albedos(name: &str, field: &HeightField, count: usize, random: &mut Random) -> Result<EnergyRow, BenchError> {
    let surface = Surface::new(field, &Options::default())?;
    let places: Vec<_> = (0..count).map(|_| (incident(random), random.between(360.0, 830.0))).collect();
    let found: Vec<f64> = places.par_iter().filter_map(|&(wi, nm)| surface.albedo(wi, nm)).collect();
    let above = found.iter().filter(|albedo| **albedo > ALBEDO_MAX).count();
    let heights = field.heights_um();
    let (low, high) = heights.iter().fold((f64::MAX, f64::MIN), |(low, high), h| (low.min(*h), high.max(*h)));
    Ok(EnergyRow {
        name: name.to_owned(),
        surfaces: 1,
        albedos: found.len(),
        above,
        largest: super::largest(found),
        heights_above_um: (above > 0).then_some([high - low; 2]),
    })
}

/// Up to 89.9°, half of them evenly in the angle, so that grazing ones come up.
fn incident(random: &mut Random) -> Vec3 {
    if random.unit() < 0.5 {
        direction(random.between(0.0, 89.9), random.between(-180.0, 180.0))
    } else {
        let wi = anywhere(random);
        if wi[2] < 89.9f64.to_radians().cos() { direction(89.9, 0.0) } else { wi }
    }
}
