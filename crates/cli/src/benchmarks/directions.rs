//! The pairs of directions (wi, wo) at which methods are timed and their errors computed.

use crate::arguments::direction_from_degrees;
use crate::reflector::single;
use std::f64::consts::TAU;
use sunbeam::height_field::random::Random;
use sunbeam::lobe::Surface;
use sunbeam::scattering::Vec3;

/// Directions of incidence as `(angle with the normal, azimuth)` in degrees: from normal to grazing incidence, across
/// (azimuth 0) and nearly along the grooves.
pub(crate) const INCIDENT_DEG: [(f64, f64); 4] = [(0.0, 0.0), (30.0, 20.0), (60.0, 100.0), (80.0, 0.0)];

/// Steps of the additive low-discrepancy sequence R₂ in the unit square (M. Roberts 2018): 1/x and 1/x² for the real
/// root of x³ = x + 1.
const R2_STEPS: [f64; 2] = [0.754_877_666_246_692_8, 0.569_840_290_998_053_3];
/// Range of the wavelengths in nm for which the sampler draws directions. Wavelengths beyond this range hardly
/// contribute to a colour.
const SAMPLED_NM: [f64; 2] = [400.0, 700.0];
/// Smallest cosine of an outgoing direction with the normal, about that of 89.9°. The stability benchmark covers
/// directions nearer to the horizon.
const COSINE_MIN: f64 = 1.7e-3;
/// Number of draws after which sampling gives up. It only ends a search that cannot succeed: few samples lie below the
/// horizon.
const DRAWS_MAX: usize = 1000;

/// A pair of directions. Components are rounded to single precision, so that methods in single and in double precision
/// get equal directions.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct DirectionPair {
    /// Unit vector towards the light.
    pub(crate) wi: Vec3,
    /// Unit vector towards the viewer.
    pub(crate) wo: Vec3,
    /// Index of `wi` in [`INCIDENT_DEG`].
    pub(crate) incident_index: usize,
}

impl DirectionPair {
    /// `[wi, wo]` in single precision.
    pub(crate) fn single(&self) -> [[f32; 3]; 2] {
        [self.wi, self.wo].map(single)
    }

    /// `wi + wo` rounded to single precision, the sum from which methods in single precision compute.
    pub(crate) fn sum(&self) -> [f32; 3] {
        std::array::from_fn(|c| (self.wi[c] + self.wo[c]) as f32)
    }
}

/// `count` pairs, whose incident directions cycle through [`INCIDENT_DEG`]. The pairs are equal in every run.
///
/// In even cycles the pairs share one outgoing direction, uniform over the hemisphere. In odd cycles the sampler of
/// `surface` draws one per pair. The orders of a grating cover so little of the hemisphere that nearly all uniform
/// directions are black.
pub(crate) fn direction_pairs(surface: &Surface, count: usize) -> Vec<DirectionPair> {
    // An arbitrary fixed seed.
    let mut random = Random::new(1);
    (0..count)
        .map(|i| {
            let (incident_index, cycle) = (i % INCIDENT_DEG.len(), i / INCIDENT_DEG.len());
            let (theta_deg, phi_deg) = INCIDENT_DEG[incident_index];
            let wi = rounded(direction_from_degrees(theta_deg, phi_deg));
            let wo = if cycle % 2 == 0 { uniform(cycle / 2) } else { sampled(surface, wi, &mut random) };
            DirectionPair { wi, wo: rounded(wo), incident_index }
        })
        .collect()
}

/// A direction rounded to single precision.
fn rounded(direction: Vec3) -> Vec3 {
    direction.map(|c| f64::from(c as f32))
}

/// The `i`-th direction of a low-discrepancy sequence that is uniform in solid angle over the upper hemisphere.
fn uniform(i: usize) -> Vec3 {
    let [a, b] = R2_STEPS.map(|step| (0.5 + step * i as f64).fract());
    // Equal ranges of the cosine have equal solid angles, so a uniform cosine gives uniform directions.
    let (cos_theta, phi) = (a.max(COSINE_MIN), TAU * b);
    let sin_theta = (1.0 - cos_theta * cos_theta).sqrt();
    [sin_theta * phi.cos(), sin_theta * phi.sin(), cos_theta]
}

/// A direction drawn by the sampler, each draw for another random wavelength. It is the normal if [`DRAWS_MAX`] draws
/// in a row end below [`COSINE_MIN`].
fn sampled(surface: &Surface, wi: Vec3, random: &mut Random) -> Vec3 {
    (0..DRAWS_MAX)
        .find_map(|_| {
            let u = [random.unit(), random.unit(), random.unit()];
            let nm = SAMPLED_NM[0] + (SAMPLED_NM[1] - SAMPLED_NM[0]) * random.unit();
            surface.sample_direction(wi, &[nm], u).filter(|wo| wo[2] > COSINE_MIN)
        })
        .unwrap_or([0.0, 0.0, 1.0])
}
