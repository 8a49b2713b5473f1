//! The directions at which methods are timed and judged.

use std::f64::consts::TAU;
use sunbeam::height_field::random::Random;
use sunbeam::lobe::Surface;
use sunbeam::scattering::Vec3;

/// Directions of incidence: angle with the normal and azimuth in degrees.
pub const INCIDENT_DEG: [(f64, f64); 4] = [(0.0, 0.0), (30.0, 20.0), (60.0, 100.0), (80.0, 0.0)];

/// Reciprocals of the root of x³ = x + 1 and of its square: the additive sequence of low discrepancy in the plane.
const STEPS: [f64; 2] = [0.754_877_666_246_692_8, 0.569_840_290_998_053_3];
/// Wavelengths for which directions are drawn.
const VISIBLE_NM: [f64; 2] = [400.0, 700.0];
/// Cosines are not taken below this, 89.9°: what is nearer to the horizon is another question.
const COSINE_MIN: f64 = 1.7e-3;

/// A pair of directions, each component a number of single precision, so that every method sees the same place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DirectionPair {
    pub wi: Vec3,
    pub wo: Vec3,
    /// Which of [`INCIDENT_DEG`].
    pub incident: usize,
}

impl DirectionPair {
    /// Both as the methods take them.
    pub fn single(&self) -> [[f32; 3]; 2] {
        [self.wi, self.wo].map(|direction| direction.map(|c| c as f32))
    }

    /// `wi + wo` in single precision.
    pub fn sum(&self) -> [f32; 3] {
        std::array::from_fn(|c| (self.wi[c] + self.wo[c]) as f32)
    }
}

/// `count` pairs, the same on every machine, in turn for each of [`INCIDENT_DEG`]. Half of the outgoing directions are
/// spread evenly over the hemisphere; the other half lies where `surface` sends its light, drawn by its sampler: a
/// grating's orders cover so little of the hemisphere that the even half alone would only see black.
pub fn directions(surface: &Surface, count: usize) -> Vec<DirectionPair> {
    let mut random = Random::new(1);
    (0..count)
        .map(|i| {
            let (incident, turn) = (i % INCIDENT_DEG.len(), i / INCIDENT_DEG.len());
            let (theta, phi) = INCIDENT_DEG[incident];
            let ((st, ct), (sp, cp)) = (theta.to_radians().sin_cos(), phi.to_radians().sin_cos());
            let wi = rounded([st * cp, st * sp, ct]);
            let wo = if turn % 2 == 0 { even(turn / 2) } else { lit(surface, wi, &mut random) };
            DirectionPair { wi, wo: rounded(wo), incident }
        })
        .collect()
}

fn rounded(direction: Vec3) -> Vec3 {
    direction.map(|c| f64::from(c as f32))
}

fn even(i: usize) -> Vec3 {
    let [a, b] = STEPS.map(|step| (0.5 + step * i as f64).fract());
    let (z, phi) = (a.max(COSINE_MIN), TAU * b);
    let r = (1.0 - z * z).sqrt();
    [r * phi.cos(), r * phi.sin(), z]
}

fn lit(surface: &Surface, wi: Vec3, random: &mut Random) -> Vec3 {
    // Few samples lie beyond the horizon; should all of them, the normal will do.
    (0..1000)
        .find_map(|_| {
            let u = [random.unit(), random.unit(), random.unit()];
            let nm = VISIBLE_NM[0] + (VISIBLE_NM[1] - VISIBLE_NM[0]) * random.unit();
            surface.sample_direction(wi, &[nm], u).filter(|wo| wo[2] > COSINE_MIN)
        })
        .unwrap_or([0.0, 0.0, 1.0])
}
