use super::fresnel::{ComplexIndex, fresnel_unpolarised};
use super::small_slope::small_slope;
use crate::numeric::Real;
use serde::{Deserialize, Serialize};

/// A direction in the local frame (docs/model.md#conventions), of unit length.
pub type Vec3 = [f64; 3];

/// How far from 1 the length of a given direction may be: what is printed with four digits passes, and is normalised.
pub const LENGTH_TOLERANCE: f64 = 1e-3;

/// Why three numbers are not a direction; the message follows the name of what was given.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[allow(missing_docs)] // Each message says what its fields are.
pub enum DirectionError {
    #[error("is the zero vector; it must be a direction")]
    Zero,
    #[error("has length {length}; it must be 1 to {LENGTH_TOLERANCE}")]
    Length { length: f64 },
}

/// A direction from its components, normalised.
///
/// # Errors
/// A length that is not 1 to [`LENGTH_TOLERANCE`], infinities and NaN included.
pub fn unit_vector(components: [f64; 3]) -> Result<Vec3, DirectionError> {
    let length = components.iter().map(|c| c * c).sum::<f64>().sqrt();
    if length == 0.0 {
        return Err(DirectionError::Zero);
    }
    // Written so that infinity and NaN are refused as well.
    if length.is_nan() || (length - 1.0).abs() > LENGTH_TOLERANCE {
        return Err(DirectionError::Length { length });
    }
    Ok(components.map(|c| c / length))
}

/// The obliquity factor O (docs/model.md#the-reflectance), or what stands for it and for the Fresnel reflectance. All are
/// reciprocal, and leave the Fresnel reflectance alone at the mirror direction.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Obliquity {
    /// `(1 + wi·wo)² / (cosθi cosθo w²)`.
    #[default]
    Stam,
    /// 1.
    Unit,
    /// O is 1, and the small-slope factor Q takes the place of the Fresnel reflectance.
    SmallSlope,
}

/// Cosines are not taken below this, which is 0.000 006° from the horizon: products of their reciprocals then stay
/// finite in single precision.
pub(crate) const COSINE_MIN: f64 = 1e-7;

/// A pair of directions above the surface and what the model needs of it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pair {
    /// `wi.x + wo.x`.
    pub u: f64,
    /// `wi.y + wo.y`.
    pub v: f64,
    /// `cosθi + cosθo`.
    pub w: f64,
    /// Cosine of the angle of `wi` with the normal.
    pub cos_i: f64,
    /// Cosine of the angle of `wo` with the normal.
    pub cos_o: f64,
}

impl Pair {
    /// `None` unless both directions lie above the surface and are finite.
    pub fn new(wi: Vec3, wo: Vec3) -> Option<Self> {
        let finite = wi.iter().chain(&wo).all(|c| c.is_finite());
        if !(finite && wi[2] > 0.0 && wo[2] > 0.0) {
            return None;
        }
        let (cos_i, cos_o) = (wi[2].max(COSINE_MIN), wo[2].max(COSINE_MIN));
        Some(Self { u: wi[0] + wo[0], v: wi[1] + wo[1], w: cos_i + cos_o, cos_i, cos_o })
    }

    /// `|wi + wo|²`.
    pub fn sum_squared(&self) -> f64 {
        squared([self.u, self.v, self.w])
    }

    /// Cosine of the angle of either direction with the half vector.
    pub fn cos_half(&self) -> f64 {
        (0.5 * self.sum_squared().sqrt()).min(1.0)
    }

    /// What the interface makes of unpolarised light: the Fresnel reflectance R at the half vector, 1 without an index; or the
    /// small-slope factor Q, without an index that of a perfect conductor.
    #[inline]
    pub fn interface(&self, index: Option<ComplexIndex>, kind: Obliquity) -> f64 {
        match kind {
            Obliquity::SmallSlope => small_slope([self.u, self.v, self.w], [self.cos_i, self.cos_o], index),
            Obliquity::Stam | Obliquity::Unit => index.map_or(1.0, |index| fresnel_unpolarised(self.cos_half(), index)),
        }
    }

    /// Phase rate κ in rad/µm.
    pub fn kappa(&self, wavelength_um: f64) -> f64 {
        std::f64::consts::TAU * self.w / wavelength_um
    }

    /// The obliquity factor O.
    pub fn obliquity(&self, kind: Obliquity) -> f64 {
        obliquity(kind, [self.u, self.v, self.w], [self.cos_i, self.cos_o])
    }

    /// V-cavity shadowing and masking M.
    pub fn shadowing(&self) -> f64 {
        shadowing([self.u, self.v, self.w], [self.cos_i, self.cos_o])
    }
}

/// The obliquity factor O of the scattering vector `q = wi + wo` and the two cosines (docs/model.md, the reflectance).
#[inline(always)]
pub(crate) fn obliquity<R: Real>(kind: Obliquity, q: [R; 3], cosines: [R; 2]) -> R {
    match kind {
        Obliquity::Unit | Obliquity::SmallSlope => R::lit(1.0),
        Obliquity::Stam => {
            let ratio = squared(q) / (q[2] + q[2]);
            ratio * ratio / (cosines[0] * cosines[1])
        }
    }
}

/// V-cavity shadowing and masking M (Stam 1999, appendix): `min(1, 2 h·n wo·n / wo·h, 2 h·n wi·n / wo·h)`.
#[inline(always)]
pub(crate) fn shadowing<R: Real>(q: [R; 3], cosines: [R; 2]) -> R {
    (R::lit(4.0) * q[2] * cosines[0].min(cosines[1]) / squared(q)).min(R::lit(1.0))
}

/// `|wi + wo|² = 2(1 + wi·wo)`; summed this way nothing cancels at grazing forward directions.
#[inline(always)]
pub(super) fn squared<R: Real>(q: [R; 3]) -> R {
    q[0] * q[0] + q[1] * q[1] + q[2] * q[2]
}

/// The mirror-symmetric unit vector above the plane with the given x and y, `None` outside the unit disc.
pub(crate) fn direction_above(x: f64, y: f64) -> Option<Vec3> {
    let z_squared = 1.0 - x * x - y * y;
    (z_squared > 0.0).then(|| [x, y, z_squared.sqrt()])
}
