//! Transparent bodies: reflection and transmission by the relief between air, above, and a lossless medium, below. The
//! medium is a half-space, or a film with a flat lower side and air behind it.
//!
//! Light arrives from either side of the relief and is scattered to either side. All four cases read one power
//! spectrum S of the relief, in µm², at the sum of the two wave vectors. One factor F serves all: that of first-order
//! small-slope theory, whose kernel B is Rice's perturbation theory, as in `small_slope.rs`. The same functions for
//! films exist in WGSL (`methods/transparent.wgsl`).
//!
//! ```text
//! n, ε         index of the medium, and its square
//! λ            wavelength in vacuum
//! K            wave vector of a direction in units of 2π/λ, away from the relief: of length 1 above and n below, where
//!              light behind a film has the K that it had inside the film
//! Ki, Ko       K of the incident and the outgoing direction; incident light travels along −Ki
//! k            length of the tangential part of K
//! c1, cn       normal components in air and in the medium, √(1 − k²) and √(n² − k²); c1 is imaginary beyond k = 1
//! ζ            normal component in the direction's own medium: c1 above, cn below
//! v, e         cn and n for a direction above; n·c1 and 1 below
//! s, p         c1 + cn and ε·c1 + cn, the denominators of Fresnel's coefficients for the polarisation states s and p;
//!              as subscripts of B, the states themselves
//! φ            azimuth from the tangential direction of the arriving light (−Ki) to that of the leaving light (Ko)
//! σ            1 for reflection, −1 for transmission
//! w            normal component of Ki + Ko, along the normal z that points into the air
//! τ            transmittance of the flat side for a direction below a film: 4·c1·cn/s² or 4ε·c1·cn/p² by its state;
//!              1 for all other directions
//!
//! B_ss = cosφ/(s s0)        B_sp = v0 sinφ/(s p0)
//! B_ps = v sinφ/(p s0)      B_pp = (v v0 cosφ − σ e e0 k k0)/(p p0)
//! F    = 2 ζ ζ0 (ε − 1)²/w² · Σ |B|² τ τ0      sum over the four pairs of states
//! ```
//!
//! Symbols with 0 are those of the incident direction, symbols without it those of the outgoing one. The first
//! subscript of B is the outgoing state. The factor 2 of F is 4 times ½, where ½ is from the mean over the two
//! incident states.
//!
//! The fraction of the incident power per tangential area `d²Ko` is `F·S/λ²`, with S at the frequency `(Ki + Ko)_xy/λ`
//! and the phase rate `2πw/λ`. F is reciprocal. At a half-space it is Fresnel's reflectance at the mirror direction,
//! and Fresnel's transmittance at the refracted direction.
//!
//! S of a negative phase rate equals S of the positive one at the opposite frequency. In transmission w vanishes for
//! some pairs, none of them refracted, and there S vanishes in proportion to w². Both F and S therefore use a |w| of at
//! least [`TransparentBody::normal_min`], so that their product stays smooth.
//!
//! The bound also depends on the coherence window: the shorter the coherence length, the wider an order. Where w
//! changes by about its own magnitude over the width of an order, 1/w² would raise the tails of strong orders above
//! weak orders.
//!
//! Tables are those of the relief magnified n times, as under a [`Cover`](super::Cover) of index n. Wave vectors in
//! code are therefore divided by n ("over n"): they are in units of the wave number in the medium, and no longer than
//! 1.
//!
//! `N` is a family of numbers (`src/numeric`). An `N::Real` is one number, a SIMD vector or a traced variable, and
//! `N::Double` one of double precision; `lit` makes constants, `widen` and `narrow` convert.

use super::small_slope::SINES_MIN;
use super::{COSINE_MIN, Reading, TYPICAL_WAVELENGTH_UM, Vec3};
use crate::numeric::{Number, Numbers, Plain, Real};
use crate::table::CoherenceWindow;
use serde::{Deserialize, Serialize};

/// Smallest |w| in units of the wave number in vacuum, for any coherence length. The phase of a relief 1 µm high is
/// then at most 0.02 rad, where S is proportional to w² with a relative error of 1e-4. Chosen: larger values change
/// more pairs of directions; with smaller ones 1/w² amplifies the rounding errors of S.
const NORMAL_MIN: f64 = 1e-3;

/// Fate of the light that passes through the relief.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Transmission {
    /// Absorption, or a body that is no dielectric.
    #[default]
    None,
    /// Exit into air through a flat side below.
    Film,
    /// Propagation in the medium, a half-space.
    Interface,
}

impl Transmission {
    /// All kinds, the default first.
    pub const ALL: [Self; 3] = [Self::None, Self::Film, Self::Interface];

    /// The name in the users' interfaces.
    pub fn name(self) -> &'static str {
        match self {
            Self::None => "none",
            Self::Film => "film",
            Self::Interface => "interface",
        }
    }
}

/// A lossless medium below the relief, and its lower boundary.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct TransparentBody {
    /// Index n of the medium, at least 1.
    pub eta: f64,
    /// Whether a flat side bounds the medium below, with air behind it. Otherwise it is a half-space.
    pub is_film: bool,
    /// Smallest |w| over n that F and S use; see [`TransparentBody::new`].
    pub normal_min: f64,
}

/// Wave of one direction at a transparent body: its wave vector, and its terms of the factor F. Symbols are those at
/// the head of this file.
#[derive(Clone, Copy)]
pub(crate) struct BodyWave<N: Numbers> {
    /// Whether the direction lies below the relief.
    pub is_below: N::Mask,
    /// Tangential part of K over n.
    tangential: [N::Double; 2],
    /// ζ over n, positive.
    pub normal: N::Real,
    /// Squared index of the medium in which the direction is given: ε below an interface, 1 elsewhere.
    pub eta_squared: N::Real,
    /// Normal component over n of the refracted wave, in the medium on the other side of the relief; zero where it is
    /// imaginary.
    pub other_normal: N::Real,
    /// k, the tangential length of K.
    k: N::Real,
    /// Real and imaginary part of v.
    v: [N::Real; 2],
    /// e, which is n above and 1 below.
    e: N::Real,
    /// `1/|s|²` and `1/|p|²` of the denominators s and p.
    per_squared: [N::Real; 2],
    /// Transmittances of a flat boundary between the media, for the states s and p; zero where light is totally
    /// reflected.
    refracted: [N::Real; 2],
    /// τ of the states s and p.
    passed: [N::Real; 2],
}

/// A pair of directions at a transparent body.
pub(crate) struct TransparentPair<N: Numbers> {
    /// Tangential part of `Ki + Ko` over n, with the sign that makes [`TransparentPair::normal`] positive.
    tangential: [N::Double; 2],
    /// `|w|` over n, at least [`TransparentBody::normal_min`].
    normal: N::Real,
    /// `4 ζ ζ0 (ε − 1)²/w² · |B|² τ τ0` of the states ss, sp, ps and pp; the first letter is the outgoing state.
    pub powers: [N::Real; 4],
    /// Tangential area `d²Ko` over n² per projected solid angle `cosθo dωo`.
    per_projected_solid_angle: N::Real,
}

impl TransparentBody {
    /// A body of index `eta` under a relief with a coherence length in µm, which sets the smallest |w|.
    pub fn new(eta: f64, is_film: bool, coherence_length_um: f64) -> Self {
        // Standard deviation of an order, in units of the wave number in vacuum. With a smaller bound, albedos exceed
        // one at short coherence lengths.
        let width = TYPICAL_WAVELENGTH_UM * CoherenceWindow::new(coherence_length_um).order_sigma_per_um();
        Self { eta, is_film, normal_min: NORMAL_MIN.max(width) / eta }
    }

    /// Largest tangential length of outgoing wave vectors over n, on one side.
    #[inline(always)]
    pub(crate) fn reach(self, is_below: bool) -> f64 {
        if is_below && !self.is_film { 1.0 } else { 1.0 / self.eta }
    }

    /// Factor on `S/λ²` of the magnified relief that gives the scattering function (BSDF) of light from `wi` to `wo` in
    /// 1/sr. The directions have unit length and point away from the relief on either side of it.
    pub fn factor(self, wi: Vec3, wo: Vec3) -> f64 {
        self.pair(&self.wave::<Plain<'_, f64>>(wi), &self.wave(wo)).factor()
    }

    /// Transmittance of a flat film for unpolarised light at a cosine with the normal in air, without light that is
    /// reflected between its two sides.
    pub fn transmittance(self, cos: f64) -> f64 {
        // Transmittances depend on z alone, so the vector need not have unit length.
        let [s, p] = self.wave::<Plain<'_, f64>>([0.0, 0.0, cos]).refracted;
        // Each state passes two sides of equal transmittance.
        0.5 * (s * s + p * p)
    }

    /// Reflectance of a flat upper side for unpolarised light at a cosine with the normal in air.
    pub fn reflectance(self, cos: f64) -> f64 {
        super::fresnel_unpolarised(cos, super::ComplexIndex { eta: self.eta, k: 0.0 })
    }

    /// Wave of a direction `w` of unit length, which points away from the relief on either side of it.
    #[inline(always)]
    pub(crate) fn wave<N: Numbers>(self, w: [N::Real; 3]) -> BodyWave<N> {
        let lit = N::Real::lit;
        let (zero, one) = (lit(0.0), lit(1.0));
        let eps = self.eta * self.eta;
        let is_below = w[2].lt(zero);
        let cos = w[2].abs().max(lit(COSINE_MIN));
        let cos_squared = cos * cos;
        // Directions below an interface are those inside the medium; all others are in air.
        let is_inside = if self.is_film { N::mask(false) } else { is_below };
        // c1² = 1 − k² and cn² = ε − k², with k² = ε(1 − cos²) inside the medium and 1 − cos² in air.
        let c1_squared = N::Real::select(is_inside, cos_squared.fma(lit(eps), lit(1.0 - eps)), cos_squared);
        let cn_squared = N::Real::select(is_inside, cos_squared * lit(eps), cos_squared + lit(eps - 1.0));
        let (c1, c1_imaginary) = (c1_squared.max(zero).sqrt(), (-c1_squared).max(zero).sqrt());
        let cn = cn_squared.sqrt();
        let (s, p) = (c1 + cn, c1.fma(lit(eps), cn));
        // c1 is real or imaginary, so |s|² is (Re c1 + cn)² + (Im c1)². |p|² is alike.
        let imaginary_squared = c1_imaginary * c1_imaginary;
        let per_squared = [one / s.fma(s, imaginary_squared), one / p.fma(p, imaginary_squared * lit(eps * eps))];
        // 4·c1·cn/s² and 4ε·c1·cn/p².
        let refracted =
            [(1.0, per_squared[0]), (eps, per_squared[1])].map(|(factor, per)| c1 * cn * lit(4.0 * factor) * per);
        let passed = match self.is_film {
            true => refracted.map(|transmittance| N::Real::select(is_below, transmittance, one)),
            false => [one; 2],
        };
        // Index of the medium in which the direction is given, air below a film. The tangential part of K is this index
        // times that of the direction.
        let index = N::Real::select(is_inside, lit(self.eta), one);
        let [x, y] = [w[0] * index, w[1] * index];
        let index_over_n = N::Double::select(is_inside, N::Double::lit(1.0), N::Double::lit(1.0 / self.eta));
        BodyWave {
            is_below,
            tangential: [N::widen(w[0]) * index_over_n, N::widen(w[1]) * index_over_n],
            normal: N::Real::select(is_below, cn, c1) * lit(1.0 / self.eta),
            other_normal: N::Real::select(is_below, c1, cn) * lit(1.0 / self.eta),
            eta_squared: index * index,
            k: x.fma(x, y * y).sqrt(),
            v: [
                N::Real::select(is_below, c1 * lit(self.eta), cn),
                N::Real::select(is_below, c1_imaginary * lit(self.eta), zero),
            ],
            e: N::Real::select(is_below, one, lit(self.eta)),
            per_squared,
            refracted,
            passed,
        }
    }

    /// The pair of two directions, light arriving from `wi` and leaving along `wo`.
    #[inline(always)]
    pub(crate) fn pair<N: Numbers>(self, wi: &BodyWave<N>, wo: &BodyWave<N>) -> TransparentPair<N> {
        let lit = N::Real::lit;
        let (zero, one) = (lit(0.0), lit(1.0));
        // σ, and w over n. Wave vectors of directions below point downwards, so their normal components are negative.
        let is_reflected = wi.is_on_side_of(wo);
        let sigma = N::Real::select(is_reflected, one, -one);
        let signed = |wave: &BodyWave<N>| N::Real::select(wave.is_below, -wave.normal, wave.normal);
        let w = signed(wi) + signed(wo);
        let normal = w.abs().max(lit(self.normal_min));
        let sign = N::Double::select(w.lt(zero), N::Double::lit(-1.0), N::Double::lit(1.0));
        let tangential = [0, 1].map(|i| (wi.tangential[i] + wo.tangential[i]) * sign);
        // k·k0·cosφ = −(Ki·Ko)_xy. For a direction along the normal φ is arbitrary, and cosφ is 0 here: the sum over
        // the states of that direction does not depend on φ.
        let eps = self.eta * self.eta;
        let dot = wi.tangential[0].fma(wo.tangential[0], wi.tangential[1] * wo.tangential[1]);
        let k_k0 = wi.k * wo.k;
        let cos = (-N::narrow(dot) * lit(eps) / k_k0.max(lit(SINES_MIN))).clip(-one, one);
        let (cos_squared, sin_squared) = (cos * cos, one - cos * cos);
        let squared = |[re, im]: [N::Real; 2]| re.fma(re, im * im);
        // Real and imaginary part of B_pp·p·p0; `wi` has the symbols with 0.
        let pp_re = (wi.v[0] * wo.v[0] - wi.v[1] * wo.v[1]).fma(cos, -(sigma * wi.e * wo.e * k_k0));
        let pp_im = (wi.v[0] * wo.v[1] + wi.v[1] * wo.v[0]) * cos;
        // τ/|s|² and τ/|p|² of the outgoing and of the incident direction.
        let [[per_s, per_p], [per_s0, per_p0]] =
            [wo, wi].map(|wave| [0, 1].map(|state| wave.per_squared[state] * wave.passed[state]));
        let contrast = self.contrast_over_normal(is_reflected, normal, wi);
        // ζ ζ0 and w² are both divided by n², which cancels.
        let scale = lit(4.0) * wi.normal * wo.normal * contrast * contrast;
        let powers = [
            cos_squared * per_s * per_s0,
            sin_squared * squared(wi.v) * per_s * per_p0,
            sin_squared * squared(wo.v) * per_p * per_s0,
            squared([pp_re, pp_im]) * per_p * per_p0,
        ];
        // d²Ko = eta_squared·cosθo dωo. S/λ² of the relief is that of the magnified relief over ε, so the same quotient
        // also turns F into the factor on S/λ² of the magnified relief.
        let per_projected_solid_angle = wo.eta_squared * lit(1.0 / eps);
        TransparentPair { tangential, normal, powers: powers.map(|power| power * scale), per_projected_solid_angle }
    }

    /// `(ε − 1)/|w|`, with w over n. For n = 1 the relief is flat (`config/build.rs`) and light goes straight on,
    /// where the quotient is 0/0. It is then 0 in reflection, and in transmission `s0`, its limit at the refracted
    /// direction as n tends to 1.
    #[inline(always)]
    fn contrast_over_normal<N: Numbers>(self, is_reflected: N::Mask, normal: N::Real, wi: &BodyWave<N>) -> N::Real {
        if self.eta == 1.0 {
            let s0 = N::Real::lit(1.0) / wi.per_squared[0].sqrt();
            return N::Real::select(is_reflected, N::Real::lit(0.0), s0);
        }
        N::Real::lit(self.eta * self.eta - 1.0) / normal
    }
}

impl<N: Numbers> BodyWave<N> {
    /// Whether another direction lies on the same side of the relief as this one.
    #[inline(always)]
    pub(crate) fn is_on_side_of(&self, other: &Self) -> N::Mask {
        (self.is_below & other.is_below) | (!self.is_below & !other.is_below)
    }

    /// Reflectance of a flat relief on this side, for unpolarised light.
    #[inline(always)]
    pub(crate) fn reflectance(&self) -> N::Real {
        let [s, p] = self.refracted;
        N::Real::lit(1.0) - (s + p) * N::Real::lit(0.5)
    }

    /// Unit vector along K with a positive z on either side. Below a film it is the refracted direction inside the
    /// film.
    #[inline(always)]
    pub(crate) fn in_own_medium(&self) -> [N::Real; 3] {
        // K over n has the length 1/n above and 1 below, the reciprocal of e.
        let [x, y] = self.tangential();
        [x, y, self.normal].map(|c| c * self.e)
    }

    /// Tangential part of K over n, in double precision.
    #[inline(always)]
    pub(crate) fn tangential_double(&self) -> [N::Double; 2] {
        self.tangential
    }

    /// Tangential part of K over n.
    #[inline(always)]
    pub(crate) fn tangential(&self) -> [N::Real; 2] {
        self.tangential.map(N::narrow)
    }
}

impl<N: Numbers> TransparentPair<N> {
    /// F for unpolarised light: the sum over outgoing states, and the mean over the two incident ones.
    #[inline(always)]
    pub(crate) fn power(&self) -> N::Real {
        let [ss, sp, ps, pp] = self.powers;
        ((ss + pp) + (sp + ps)) * N::Real::lit(0.5)
    }

    /// Factor on `S/λ²` of the magnified relief that gives the scattering function (BSDF) of the pair in 1/sr.
    #[inline(always)]
    pub(crate) fn factor(&self) -> N::Real {
        self.power() * self.per_projected_solid_angle
    }

    /// Tangential area `d²Ko` over n² per projected solid angle `cosθo dωo`.
    #[inline(always)]
    pub(crate) fn per_projected_solid_angle(&self) -> N::Real {
        self.per_projected_solid_angle
    }

    /// Tangential part of `Ki + Ko` over n, with the sign that makes [`TransparentPair::normal`] positive.
    #[inline(always)]
    pub(crate) fn tangential(&self) -> [N::Double; 2] {
        self.tangential
    }

    /// `|w|` over n, at least [`TransparentBody::normal_min`].
    #[inline(always)]
    pub(crate) fn normal(&self) -> N::Real {
        self.normal
    }

    /// [`Reading::arguments`] of this scattering vector in tables of the magnified relief.
    #[inline(always)]
    pub(crate) fn at(&self, reading: &Reading<N>) -> ([N::Double; 2], N::Real) {
        reading.arguments(self.tangential, self.normal)
    }
}

#[cfg(test)]
mod tests;
