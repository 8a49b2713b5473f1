//! Directions, and the factors O (obliquity) and M (shadowing) of a pair of them (docs/model.md#the-reflectance).
//!
//! `wi` and `wo` are unit vectors towards the light and the viewer, at the angles θi and θo from the normal z. Their
//! half vector is the unit vector along `wi + wo`. Both factors follow from the scattering vector
//! `q = wi + wo = (u, v, w)` and the two cosines, since `1 + wi·wo = |q|²/2`.
//!
//! Functions over `R: Real` serve single numbers, SIMD vectors and traced variables (`src/numeric`); `R::lit` makes a
//! constant.

use super::ComplexIndex;
use super::fresnel::fresnel_unpolarised;
use super::small_slope::small_slope;
use crate::numeric::Real;
use serde::{Deserialize, Serialize};

/// A direction in the local frame (docs/model.md#conventions), of unit length.
pub type Vec3 = [f64; 3];

/// Accepted deviation of a given direction's length from 1. Chosen: directions printed with four digits pass. A larger
/// value would accept vectors that were not meant to be normalised; a smaller one would refuse rounded directions.
pub const LENGTH_TOLERANCE: f64 = 1e-3;

/// Reason why three numbers are no direction. The caller prints the message after the parameter's name.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[allow(missing_docs, reason = "each message describes its fields")]
pub enum DirectionError {
    #[error("is the zero vector; it must be a direction")]
    Zero,
    #[error("has length {length}; it must be 1 within {LENGTH_TOLERANCE}")]
    Length { length: f64 },
}

/// A normalised direction from its components.
///
/// # Errors
/// A length that differs from 1 by more than [`LENGTH_TOLERANCE`], infinities and NaN included.
pub fn unit_vector(components: [f64; 3]) -> Result<Vec3, DirectionError> {
    let length = components.iter().map(|c| c * c).sum::<f64>().sqrt();
    if length == 0.0 {
        return Err(DirectionError::Zero);
    }
    if length.is_nan() || (length - 1.0).abs() > LENGTH_TOLERANCE {
        return Err(DirectionError::Length { length });
    }
    Ok(components.map(|c| c / length))
}

/// Choice of the obliquity factor O (docs/model.md#the-reflectance). All choices are reciprocal, and give the Fresnel
/// reflectance at the mirror direction.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Obliquity {
    /// `(1 + wi·wo)² / (cosθi cosθo w²)`, as in Stam's diffraction shaders and in the tangent-plane approximation of a
    /// perfect conductor.
    #[default]
    Stam,
    /// 1, as in theories that are shift-invariant in direction cosines.
    Unit,
    /// 1; the small-slope factor Q (`small_slope.rs`) replaces the Fresnel reflectance R.
    SmallSlope,
}

/// Smallest cosine with the normal, to which smaller cosines are raised. Chosen: products of reciprocal cosines stay
/// finite in single precision, and the direction with this cosine is an invisible 0.000 006° above the horizon. A
/// larger value would change more grazing directions.
pub(crate) const COSINE_MIN: f64 = 1e-7;

/// A pair of directions above the surface: scattering vector `(u, v, w)` and cosines.
///
/// ```
/// use sunbeam::scattering::{Obliquity, Pair};
///
/// // At the mirror direction Stam's factor is 1.
/// let pair = Pair::new([0.6, 0.0, 0.8], [-0.6, 0.0, 0.8]).expect("above the surface");
/// assert!((pair.obliquity(Obliquity::Stam) - 1.0).abs() < 1e-12);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pair {
    /// `wi.x + wo.x`.
    pub u: f64,
    /// `wi.y + wo.y`.
    pub v: f64,
    /// `cos_i + cos_o`, so at least 2e-7.
    pub w: f64,
    /// Cosine of the angle of `wi` with the normal, raised to at least 1e-7.
    pub cos_i: f64,
    /// Cosine of the angle of `wo` with the normal, raised to at least 1e-7.
    pub cos_o: f64,
}

impl Pair {
    /// The pair of two unit vectors; `None` unless both lie above the surface and are finite.
    pub fn new(wi: Vec3, wo: Vec3) -> Option<Self> {
        let finite = wi.iter().chain(&wo).all(|c| c.is_finite());
        if !(finite && wi[2] > 0.0 && wo[2] > 0.0) {
            return None;
        }
        let (cos_i, cos_o) = (wi[2].max(COSINE_MIN), wo[2].max(COSINE_MIN));
        Some(Self { u: wi[0] + wo[0], v: wi[1] + wo[1], w: cos_i + cos_o, cos_i, cos_o })
    }

    /// `|wi + wo|²`: 4 for equal directions, 0 for opposite directions.
    pub fn sum_squared(&self) -> f64 {
        squared([self.u, self.v, self.w])
    }

    /// Cosine between either direction and the half vector.
    pub fn cos_half(&self) -> f64 {
        (0.5 * self.sum_squared().sqrt()).min(1.0)
    }

    /// The interface's factor for unpolarised light: the Fresnel reflectance R at the half vector, or the small-slope
    /// factor Q for [`Obliquity::SmallSlope`]. Without an index R is 1, and Q is that of a perfect conductor.
    #[inline]
    pub fn interface(&self, index: Option<ComplexIndex>, kind: Obliquity) -> f64 {
        match kind {
            Obliquity::SmallSlope => small_slope([self.u, self.v, self.w], [self.cos_i, self.cos_o], index),
            Obliquity::Stam | Obliquity::Unit => index.map_or(1.0, |index| fresnel_unpolarised(self.cos_half(), index)),
        }
    }

    /// Phase rate κ, the phase in rad per µm of height.
    pub fn kappa(&self, wavelength_um: f64) -> f64 {
        std::f64::consts::TAU * self.w / wavelength_um
    }

    /// The obliquity factor O.
    pub fn obliquity(&self, kind: Obliquity) -> f64 {
        obliquity(kind, [self.u, self.v, self.w], [self.cos_i, self.cos_o])
    }

    /// The factor M of shadowing and masking by V-shaped grooves, at most 1.
    pub fn shadowing(&self) -> f64 {
        shadowing([self.u, self.v, self.w], [self.cos_i, self.cos_o])
    }
}

/// `O·M`: the obliquity factor of the scattering vector `q` and the two cosines, times M if `has_shadowing`.
#[inline(always)]
pub(crate) fn angular_factor<R: Real>(kind: Obliquity, has_shadowing: bool, q: [R; 3], cosines: [R; 2]) -> R {
    let factor = obliquity(kind, q, cosines);
    if has_shadowing { factor * shadowing(q, cosines) } else { factor }
}

/// Cosines of two directions with the normal, at least [`COSINE_MIN`].
#[inline(always)]
pub(crate) fn floored_cosines<R: Real>(wi: [R; 3], wo: [R; 3]) -> [R; 2] {
    let least = R::lit(COSINE_MIN);
    [wi[2].max(least), wo[2].max(least)]
}

/// The obliquity factor O of the scattering vector `q = wi + wo` and the two cosines (docs/model.md#the-reflectance).
#[inline(always)]
fn obliquity<R: Real>(kind: Obliquity, q: [R; 3], cosines: [R; 2]) -> R {
    match kind {
        Obliquity::Unit | Obliquity::SmallSlope => R::lit(1.0),
        Obliquity::Stam => {
            // (1 + wi·wo)/w = |q|²/(2w).
            let ratio = squared(q) / (q[2] + q[2]);
            ratio * ratio / (cosines[0] * cosines[1])
        }
    }
}

/// The factor M: the fraction of V-shaped grooves that is lit and visible (Stam 1999, appendix). With the normal n and
/// the half vector h it is `min(1, 2 h·n wo·n / wo·h, 2 h·n wi·n / wo·h)`. Here `h·n = w/|q|` and
/// `wi·h = wo·h = |q|/2`.
#[inline(always)]
fn shadowing<R: Real>(q: [R; 3], cosines: [R; 2]) -> R {
    (R::lit(4.0) * q[2] * cosines[0].min(cosines[1]) / squared(q)).min(R::lit(1.0))
}

/// `|q|²`. For `q = wi + wo` it equals `2(1 + wi·wo)`, but unlike that sum it loses no digits where `wi·wo` is near −1.
#[inline(always)]
pub(super) fn squared<R: Real>(q: [R; 3]) -> R {
    q[0] * q[0] + q[1] * q[1] + q[2] * q[2]
}

/// The unit vector above the surface with the given x and y; `None` unless they lie within the unit circle.
pub(crate) fn direction_above(x: f64, y: f64) -> Option<Vec3> {
    let z_squared = 1.0 - x * x - y * y;
    (z_squared > 0.0).then(|| [x, y, z_squared.sqrt()])
}
