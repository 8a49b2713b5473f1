//! The pairs of directions (wi, wo) at which methods are timed and their errors computed.

use crate::arguments::direction_from_degrees;
use std::f64::consts::TAU;
use sunbeam::height_field::random::Random;
use sunbeam::lobe::Surface;
use sunbeam::scattering::Vec3;

/// Directions of incidence: angle with the normal and azimuth, in degrees. Chosen from normal to grazing incidence,
/// along and across the grooves.
pub(crate) const INCIDENT_DEG: [(f64, f64); 4] = [(0.0, 0.0), (30.0, 20.0), (60.0, 100.0), (80.0, 0.0)];

/// Steps of the additive low-discrepancy sequence R₂ in the unit square (M. Roberts 2018): the reciprocals of the real
/// root of x³ = x + 1 and of its square.
const R2_STEPS: [f64; 2] = [0.754_877_666_246_692_8, 0.569_840_290_998_053_3];
/// Range of the wavelengths for which the sampler draws directions, in nm. Chosen: the part of the visible range with
/// most of a colour's weight.
const SAMPLED_NM: [f64; 2] = [400.0, 700.0];
/// Smallest outgoing cosine, 89.9°. Directions nearer to the horizon belong to the stability benchmark.
const COSINE_MIN: f64 = 1.7e-3;

/// A pair of directions. Components are rounded to single precision, so that every method gets the same ones.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct DirectionPair {
    /// Unit vector towards the light.
    pub(crate) wi: Vec3,
    /// Unit vector towards the viewer.
    pub(crate) wo: Vec3,
    /// Index of `wi` in [`INCIDENT_DEG`].
    pub(crate) incident: usize,
}

impl DirectionPair {
    /// `[wi, wo]` in single precision.
    pub(crate) fn single(&self) -> [[f32; 3]; 2] {
        [self.wi, self.wo].map(|direction| direction.map(|c| c as f32))
    }

    /// `wi + wo` in single precision.
    pub(crate) fn sum(&self) -> [f32; 3] {
        std::array::from_fn(|c| (self.wi[c] + self.wo[c]) as f32)
    }
}

/// `count` pairs, the same on every machine, in turn for each of [`INCIDENT_DEG`].
///
/// Half of the outgoing directions are uniform over the hemisphere, half are drawn by the sampler of `surface`: a
/// grating's orders cover so little of the hemisphere that uniform directions alone would be black.
pub(crate) fn directions(surface: &Surface, count: usize) -> Vec<DirectionPair> {
    let mut random = Random::new(1);
    (0..count)
        .map(|i| {
            let (incident, round) = (i % INCIDENT_DEG.len(), i / INCIDENT_DEG.len());
            let (theta_deg, phi_deg) = INCIDENT_DEG[incident];
            let wi = rounded(direction_from_degrees(theta_deg, phi_deg));
            let wo = if round % 2 == 0 { uniform(round / 2) } else { sampled(surface, wi, &mut random) };
            DirectionPair { wi, wo: rounded(wo), incident }
        })
        .collect()
}

/// A direction rounded to single precision.
fn rounded(direction: Vec3) -> Vec3 {
    direction.map(|c| f64::from(c as f32))
}

/// The `i`-th direction of a low-discrepancy sequence that is uniform in solid angle.
fn uniform(i: usize) -> Vec3 {
    let [a, b] = R2_STEPS.map(|step| (0.5 + step * i as f64).fract());
    let (z, phi) = (a.max(COSINE_MIN), TAU * b);
    let r = (1.0 - z * z).sqrt();
    [r * phi.cos(), r * phi.sin(), z]
}

/// A direction drawn by the sampler.
fn sampled(surface: &Surface, wi: Vec3, random: &mut Random) -> Vec3 {
    // Few samples lie below the horizon. If a thousand in turn do, the normal is returned.
    (0..1000)
        .find_map(|_| {
            let u = [random.unit(), random.unit(), random.unit()];
            let nm = SAMPLED_NM[0] + (SAMPLED_NM[1] - SAMPLED_NM[0]) * random.unit();
            surface.sample_direction(wi, &[nm], u).filter(|wo| wo[2] > COSINE_MIN)
        })
        .unwrap_or([0.0, 0.0, 1.0])
}
