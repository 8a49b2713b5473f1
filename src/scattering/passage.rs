//! The incident wave vector and the range of outgoing wave vectors of a reflection or transmission, for samplers and
//! albedos.
//!
//! Wave vectors of directions point away from the relief: incident light travels against its wave vector. The
//! scattering vector is the sum of the incident and the outgoing wave vector, and w is its component along the normal.
//! S(f; κ) is the relief's power spectrum at the frequency f and the phase rate κ, which is proportional to w.
//!
//! Lengths of wave vectors are in units of the wave number in the medium for which the tables were built: air at a bare
//! relief, a clear layer over it (a cover), or the medium of a [`TransparentBody`]. Below a film they are those within
//! the film.

use super::transparent::{BodyWave, TransparentBody};
use crate::numeric::{Number, Numbers, Real};

/// Smallest |w| in the weights by which samplers draw orders at a transparent body, in units of the wave number in
/// vacuum. Weights are powers divided by w². Chosen: about the interval of w over which samplers interpolate powers
/// linearly. Interpolated powers do not vanish at w = 0 as the true ones do. Larger values give orders of small |w| too
/// few samples; smaller ones give them too many. Either only adds variance.
const DIVISOR_MIN: f64 = 0.05;
/// Typical outgoing cosine of a surface at grazing incidence. Samplers read S at the κ of this cosine.
///
/// With [`TYPICAL_COS_SLOPE`], the typical cosine is 0.3 + 0.5·cosθi: between that of the mirror direction, cosθi, and
/// that of widely spread light. Both constants are chosen. A cosine far from that of the actual light only adds
/// variance to samples.
const TYPICAL_COS_GRAZING: f64 = 0.3;
/// Increase of the typical outgoing cosine per unit of the incident cosine; see [`TYPICAL_COS_GRAZING`].
const TYPICAL_COS_SLOPE: f64 = 0.5;

/// A reflection or transmission: an incident direction, and the side of the relief on which light leaves. `N` is a
/// family of numbers (`src/numeric`): an `N::Real` is one number, a SIMD vector or a traced variable.
#[derive(Clone, Copy)]
pub(crate) struct Passage<N: Numbers> {
    /// Tangential part of the incident wave vector, times [`Passage::turn`].
    pub tangential: [N::Real; 2],
    /// Magnitude of the incident wave vector's normal component, negated in transmission. So |w| is `|normal + c|`,
    /// where c > 0 is the magnitude of the outgoing normal component.
    pub normal: N::Real,
    /// Squared length of outgoing wave vectors: 1 in the medium of the tables, 1/n² in air above a body of index n.
    /// Samplers compute the outgoing normal component from it and the outgoing tangential part.
    pub outgoing_squared: N::Real,
    /// Largest tangential length of outgoing wave vectors that leave.
    pub reach: N::Real,
    /// Sign by which tangential wave vectors are multiplied before and after sampling: −1 where the incident or the
    /// outgoing light lies below the relief, else 1. It is the sign of w at the mirror or refracted direction, and S of
    /// a negative w is that of −w at the opposite frequency. In transmission w of some outgoing directions has the
    /// other sign; samplers ignore this, which only adds variance.
    pub turn: N::Real,
    /// Typical |w|, at which samplers read S.
    pub typical_w: N::Real,
    /// Smallest |w| in the divisor w² of an order's power at a transparent body; `None` elsewhere, where nothing is
    /// divided by w².
    pub divisor_min: Option<f64>,
}

impl<N: Numbers> Passage<N> {
    /// Reflection of light from the unit vector `wi` above the surface, with outgoing tangential lengths up to `reach`.
    #[inline(always)]
    pub(crate) fn reflection(wi: [N::Real; 3], reach: f64) -> Self {
        let one = N::Real::lit(1.0);
        Self {
            tangential: [wi[0], wi[1]],
            normal: wi[2],
            outgoing_squared: one,
            reach: N::Real::lit(reach),
            turn: one,
            typical_w: wi[2].fma(N::Real::lit(1.0 + TYPICAL_COS_SLOPE), N::Real::lit(TYPICAL_COS_GRAZING)),
            divisor_min: None,
        }
    }

    /// Light at a transparent body from the direction `wi` to the side below the relief where `to_below` is true, else
    /// to the side above.
    #[inline(always)]
    pub(crate) fn at_body(body: TransparentBody, wi: &BodyWave<N>, to_below: N::Mask) -> Self {
        let lit = N::Real::lit;
        let one = lit(1.0);
        let is_reflected = (wi.is_below & to_below) | (!wi.is_below & !to_below);
        let turn = N::Real::select(wi.is_below | to_below, -one, one);
        // |w| of the refracted direction, whose normal component is `other_normal`, and of the mirror direction.
        let refracted = (wi.other_normal - wi.normal).abs();
        let reflected = wi.normal + wi.normal;
        Self {
            tangential: wi.tangential().map(|k| k * turn),
            normal: N::Real::select(is_reflected, wi.normal, -wi.normal),
            outgoing_squared: N::Real::select(to_below, one, lit(1.0 / (body.eta * body.eta))),
            reach: N::Real::select(to_below, lit(body.reach(true)), lit(body.reach(false))),
            turn,
            typical_w: N::Real::select(is_reflected, reflected, refracted),
            // Both bounds in units of the wave number in the medium.
            divisor_min: Some(body.normal_min.max(DIVISOR_MIN / body.eta)),
        }
    }
}
