//! The small-slope factor Q and its four amplitudes (docs/model.md#the-small-slope-factor): the first-order small-slope
//! approximation (Voronovich 1985), whose kernel B is Rice's first-order perturbation (Rice 1951).
//!
//! Lengths of wave vectors are in units of the wave number above the relief: in air, or in a cover, which is a clear
//! layer over the relief. Refractive indices are relative to that medium. `wi` and `wo` are unit vectors from the
//! surface to the light and the viewer.
//!
//! ```text
//! q0, q      cosines of wi and wo with the normal z; w = q + q0
//! k0, k      sines of wi and wo: lengths of their tangential parts (not `ComplexIndex::k`)
//! φ          azimuth from the tangential direction of the arriving light (−wi) to that of the leaving light (wo)
//! ε          squared index (eta + i·k)², here with `ComplexIndex::k`, called `absorption` in code
//! t0, t      normal components of the wave vectors in the medium below, √(ε − k0²) and √(ε − k²)
//! D_s, D_p   q + t and εq + t, the denominators of Fresnel's coefficients; D_s0 and D_p0 alike with q0 and t0
//! s, p       polarisation states: electric field along z × d and along d × s, for light that travels along d
//!
//! B_ss = −(ε − 1) cosφ/(D_s D_s0)      B_sp = (ε − 1) t0 sinφ/(D_s D_p0)
//! B_ps = (ε − 1) t sinφ/(D_p D_s0)     B_pp = (ε − 1) (t t0 cosφ − ε k k0)/(D_p D_p0)
//! amplitudes: 2√(q q0)/w · B; the first letter of ss, sp, ps and pp is the outgoing state
//! Q = 2 q q0/w² · (|B_ss|² + |B_sp|² + |B_ps|² + |B_pp|²)
//!
//! perfect conductor, the limit of large ε:
//! B_ss = −cosφ    B_sp = sinφ/q0    B_ps = sinφ/q    B_pp = (cosφ − k k0)/(q q0)
//! ```
//!
//! [`small_slope`] computes Q for every type `R` of numbers (`src/numeric`): single ones, SIMD vectors and traced
//! variables, whose constants `R::lit` makes. [`small_slope_amplitudes`] computes the amplitudes in double precision.

use super::fresnel::transmitted_normal;
use super::geometry::{COSINE_MIN, squared};
use super::{ComplexIndex, Vec3};
use crate::numeric::Real;
use sunbeam_fourier::num_complex::Complex64;

/// Smallest divisor in the azimuth's cosine, a product of two sines or of two tangential lengths. Chosen: where the
/// product is smaller, one direction is so near to the normal that the azimuth is lost to rounding and does not matter.
/// Larger values would falsify the azimuth of directions farther from the normal.
pub(crate) const SINES_MIN: f64 = 1e-6;
/// Smallest squared modulus by which anything is divided. Chosen so that the product of two reciprocals, 1e36, stays
/// finite in single precision. Larger values would change reflectances of indices near one at grazing angles.
pub(super) const SQUARED_MODULUS_MIN: f64 = 1e-18;

/// Amplitudes between the linear states s and p, as square roots of power. The first letter is the outgoing state, the
/// second the incident state.
///
/// The states' unit vectors are `s ∝ z × d` and `p = d × s`, with the direction of travel `d`. The time dependence is
/// `exp(−iωt)`, so an absorbing index is `eta + ik`.
///
/// ```
/// use sunbeam::scattering::{ComplexIndex, fresnel_unpolarised, small_slope_amplitudes};
///
/// // At the mirror direction they are Fresnel's.
/// let (wi, wo, keratin) = ([0.6, 0.0, 0.8], [-0.6, 0.0, 0.8], ComplexIndex { eta: 1.56, k: 0.0 });
/// let amplitudes = small_slope_amplitudes(wi, wo, Some(keratin));
/// assert!((amplitudes.unpolarised() - fresnel_unpolarised(0.8, keratin)).abs() < 1e-12);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Amplitudes {
    /// From s to s.
    pub ss: Complex64,
    /// From p to s.
    pub sp: Complex64,
    /// From s to p.
    pub ps: Complex64,
    /// From p to p.
    pub pp: Complex64,
}

impl Amplitudes {
    /// The factor Q of unpolarised light: the sum over outgoing states, and the mean over the two incident ones.
    pub fn unpolarised(&self) -> f64 {
        0.5 * [self.ss, self.sp, self.ps, self.pp].map(|a| a.norm_sqr()).iter().sum::<f64>()
    }
}

/// Amplitudes of the small-slope factor for light from `wi` to `wo`, unit vectors above the surface that point away
/// from it. Without an index they are those of a perfect conductor.
///
/// At the mirror direction they are Fresnel's. Swapping the directions swaps `sp` and `ps` and reverses their signs.
pub fn small_slope_amplitudes(wi: Vec3, wo: Vec3, index: Option<ComplexIndex>) -> Amplitudes {
    let (q0, q) = (wi[2].max(COSINE_MIN), wo[2].max(COSINE_MIN));
    let (k0, k) = (wi[0].hypot(wi[1]), wo[0].hypot(wo[1]));
    // Unit tangential directions of travel, of the leaving and of the arriving light. A direction along the normal has
    // none, and takes that of the other direction.
    let unit = |w: Vec3, length: f64, sign: f64| (length > 0.0).then(|| [sign * w[0] / length, sign * w[1] / length]);
    let (to, from) = (unit(wo, k, 1.0), unit(wi, k0, -1.0));
    let to = to.or(from).unwrap_or([1.0, 0.0]);
    let from = from.unwrap_or(to);
    let (cos, sin) = (from[0] * to[0] + from[1] * to[1], from[0] * to[1] - from[1] * to[0]);
    let scale = 2.0 * (q * q0).sqrt() / (q + q0);
    let scaled =
        |ss: Complex64, sp, ps, pp| Amplitudes { ss: scale * ss, sp: scale * sp, ps: scale * ps, pp: scale * pp };
    let Some(ComplexIndex { eta, k: absorption }) = index else {
        let real = |value: f64| Complex64::new(value, 0.0);
        return scaled(real(-cos), real(sin / q0), real(sin / q), real((cos - k * k0) / (q * q0)));
    };
    let n = Complex64::new(eta, absorption);
    let eps = n * n;
    let (t, t0) = ((eps - k * k).sqrt(), (eps - k0 * k0).sqrt());
    // Denominators D_s and D_p of both directions.
    let (s, s0) = (q + t, q0 + t0);
    let (p, p0) = (eps * q + t, eps * q0 + t0);
    let contrast = eps - 1.0;
    scaled(
        -contrast * cos / (s * s0),
        contrast * t0 * sin / (s * p0),
        contrast * t * sin / (p * s0),
        contrast * (t * t0 * cos - eps * (k * k0)) / (p * p0),
    )
}

/// Terms of one direction in Q, with the symbols at the head of this file.
struct Terms<R> {
    /// Real and imaginary part of t.
    t: [R; 2],
    /// `|t|²`.
    t_squared: R,
    /// `1/|D_s|²`.
    per_s_squared: R,
    /// `1/|D_p|²`.
    per_p_squared: R,
}

impl<R: Real> Terms<R> {
    /// Terms of a direction with the cosine `q`. `eps` are the real and imaginary part of ε.
    #[inline(always)]
    fn new(q: R, index: ComplexIndex, eps: [f64; 2]) -> Self {
        let one = R::lit(1.0);
        let (re, im) = transmitted_normal(one - q * q, index);
        let im_squared = im * im;
        let s_re = q + re;
        let (p_re, p_im) = (q.fma(R::lit(eps[0]), re), q.fma(R::lit(eps[1]), im));
        let reciprocal = |squared: R| one / squared.max(R::lit(SQUARED_MODULUS_MIN));
        Self {
            t: [re, im],
            t_squared: re.fma(re, im_squared),
            per_s_squared: reciprocal(s_re.fma(s_re, im_squared)),
            per_p_squared: reciprocal(p_re.fma(p_re, p_im * p_im)),
        }
    }
}

/// The small-slope factor Q for unpolarised light, from the scattering vector `sum` = wi + wo and the cosines of `wi`
/// and `wo`, which are at least [`COSINE_MIN`]. Without an index it is the factor of a perfect conductor.
#[inline(always)]
pub(crate) fn small_slope<R: Real>(sum: [R; 3], [q0, q]: [R; 2], index: Option<ComplexIndex>) -> R {
    let lit = R::lit;
    let one = lit(1.0);
    let (q_squared, q0_squared, q_q0) = (q * q, q0 * q0, q * q0);
    // 1 + wi·wo = |wi + wo|²/2.
    let one_plus_dot = lit(0.5) * squared(sum);
    // k·k0·cosφ is the scalar product of the tangential parts of −wi and wo, so it equals q·q0 − wi·wo.
    let k_k0 = ((one - q_squared) * (one - q0_squared)).max(lit(0.0)).sqrt();
    let divisor = k_k0.max(lit(SINES_MIN));
    let cos = ((one + q_q0 - one_plus_dot) / divisor).clip(-one, one);
    let cos_squared = cos * cos;
    let sin_squared = one - cos_squared;
    let w = q + q0;
    let per_w_squared = one / (w * w);
    // In both branches `straight` stands for |B_ss|² + |B_pp|², and `crossed` for |B_sp|² + |B_ps|².
    let Some(index) = index else {
        // Both sums are multiplied by (q·q0)², so the factor 2·q·q0/w² of Q becomes 2/(w²·q·q0).
        // cosφ − k·k0, which loses digits at grazing directions. The second form follows with (k·k0)² = 1 − q² − q0² +
        // q²q0². It keeps the digits but divides by k·k0, so it is used for large k·k0 only.
        let grazing = (q_squared + q0_squared + q_q0 - q_squared * q0_squared - one_plus_dot) / divisor;
        let difference = R::select(k_k0.lt(lit(0.5)), cos - k_k0, grazing);
        let crossed = sin_squared * (q_squared + q0_squared);
        let straight = difference.fma(difference, cos_squared * q_q0 * q_q0);
        return lit(2.0) * per_w_squared * (straight + crossed) / q_q0;
    };
    let ComplexIndex { eta, k: absorption } = index;
    let (eps_re, eps_im) = (eta * eta - absorption * absorption, 2.0 * eta * absorption);
    // Terms of the outgoing direction, and of the incident one, whose symbols end in 0 in the formulas.
    let (o, i) = (Terms::new(q, index, [eps_re, eps_im]), Terms::new(q0, index, [eps_re, eps_im]));
    // Real and imaginary part of t t0 cosφ − ε k k0.
    let pp_re = (o.t[0] * i.t[0] - o.t[1] * i.t[1]) * cos - lit(eps_re) * k_k0;
    let pp_im = (o.t[0] * i.t[1] + o.t[1] * i.t[0]) * cos - lit(eps_im) * k_k0;
    let pp_squared = pp_re.fma(pp_re, pp_im * pp_im);
    let straight = (cos_squared * o.per_s_squared).fma(i.per_s_squared, pp_squared * o.per_p_squared * i.per_p_squared);
    let ps_squared = o.t_squared * o.per_p_squared * i.per_s_squared;
    let sp_squared = i.t_squared * o.per_s_squared * i.per_p_squared;
    let crossed = sin_squared * (ps_squared + sp_squared);
    // |ε − 1|², which `straight` and `crossed` leave out.
    let contrast_squared = (eps_re - 1.0) * (eps_re - 1.0) + eps_im * eps_im;
    lit(2.0 * contrast_squared) * q_q0 * per_w_squared * (straight + crossed)
}

#[cfg(test)]
mod tests {
    use super::super::perturbation::first_order;
    use super::super::{Obliquity, Pair};
    use super::*;
    use crate::height_field::random::Random;

    /// `(eta, k)` of dielectrics, metals, and a medium near the smallest accepted index.
    const INDICES: [(f64, f64); 7] =
        [(1.56, 0.0), (1.02, 0.0), (0.7, 0.0), (1.5, 0.1), (0.2, 3.4), (1.0, 6.9), (1e-3, 1e-3)];

    fn indices() -> impl Iterator<Item = Option<ComplexIndex>> {
        INDICES.into_iter().map(|(eta, k)| Some(ComplexIndex { eta, k })).chain([None])
    }

    /// Two directions. One in eight is the normal, and one in eight is close to the horizon.
    fn directions(random: &mut Random) -> [Vec3; 2] {
        [0, 1].map(|_| {
            let cos: f64 = match (random.unit() * 8.0) as u32 {
                0 => 1.0,
                1 => 1e-3 + 1e-2 * random.unit(),
                _ => random.between(0.01, 1.0),
            };
            let (sin, turn) = ((1.0 - cos * cos).sqrt(), std::f64::consts::TAU * random.unit());
            [sin * turn.cos(), sin * turn.sin(), cos]
        })
    }

    #[test]
    fn double_and_single_precision_have_the_power_of_the_amplitudes() {
        // Rounding in double precision, multiplied where products cancel: up to 2e-11 is found.
        const DOUBLE: f64 = 1e-10;
        // Rounding in single precision, 6e-8, multiplied where products cancel. The azimuth's rounding is larger
        // at grazing angles, so the difference may grow as 1/cosθ.
        const SINGLE: f64 = 1e-4;
        let mut random = Random::new(7);
        for index in indices() {
            for _ in 0..2000 {
                let [wi, wo] = directions(&mut random);
                let expected = small_slope_amplitudes(wi, wo, index).unpolarised();
                let pair = Pair::new(wi, wo).unwrap();
                // `small_slope` in double precision.
                let found = pair.interface(index, Obliquity::SmallSlope);
                assert!(
                    (found - expected).abs() <= DOUBLE * (expected + 0.01),
                    "{index:?} {wi:?} {wo:?}: {found} {expected}"
                );
                let [sum, cosines] =
                    [[pair.u, pair.v, pair.w], [pair.cos_i, pair.cos_o, 0.0]].map(|v| v.map(|c| c as f32));
                let single = f64::from(small_slope(sum, [cosines[0], cosines[1]], index));
                let most = SINGLE * (expected + 0.01) / wi[2].min(wo[2]);
                assert!((single - expected).abs() <= most, "{index:?} {wi:?} {wo:?}: {single} {expected}");
            }
        }
    }

    /// At the mirror direction both states have Fresnel's amplitudes (Born & Wolf, section 1.5), at every angle and
    /// azimuth.
    #[test]
    fn the_mirror_direction_has_fresnels_amplitudes() {
        const ROUNDING: f64 = 1e-12;
        for index in INDICES.map(|(eta, k)| ComplexIndex { eta, k }) {
            let n = Complex64::new(index.eta, index.k);
            for i in 0..400 {
                let (angle, turn) = (f64::from(i % 90).to_radians(), f64::from(i));
                let (sin, cos) = angle.sin_cos();
                let (x, y) = (sin * turn.cos(), sin * turn.sin());
                let found = small_slope_amplitudes([x, y, cos], [-x, -y, cos], Some(index));
                let inside = (n * n - sin * sin).sqrt();
                let s = (cos - inside) / (cos + inside);
                let p = (n * n * cos - inside) / (n * n * cos + inside);
                assert!((found.ss - s).norm() < ROUNDING && (found.pp - p).norm() < ROUNDING, "{index:?} {i}");
                assert!(found.sp.norm() < ROUNDING && found.ps.norm() < ROUNDING, "{index:?} {i}");
            }
        }
    }

    /// The amplitudes are those of a shallow relief to first order in its height, phases included, at any azimuth.
    ///
    /// [`first_order`] takes the complex height h·exp(iK·x), with lengths in inverse wave numbers. To first order its
    /// phase screen is 1 + i(q + q0)·h·exp(iK·x): beside the mirror's, one order of amplitude i(q + q0)·h. The power of
    /// an order is its squared field times q/q0. So a field per h of [`first_order`] times √(q/q0) is i(q + q0) times
    /// the amplitude, up to the sign of i.
    #[test]
    fn amplitudes_are_the_first_order_of_a_shallow_relief() {
        // Rounding of the solved system.
        const ROUNDING: f64 = 1e-9;
        let mut random = Random::new(10);
        for (eta, k) in INDICES {
            let mut compared = 0;
            while compared < 200 {
                let [wi, wo] = directions(&mut random);
                // States are undefined along the normal.
                if wi[2].max(wo[2]) > 0.999 {
                    continue;
                }
                compared += 1;
                let found = small_slope_amplitudes(wi, wo, Some(ComplexIndex { eta, k }));
                // Reflected amplitudes, `[outgoing state][incident state]`. The transmitted ones are not compared here.
                let [expected, _] = first_order(wi, wo, Complex64::new(eta, k));
                let scale = Complex64::i() * (wo[2] / wi[2]).sqrt() / (wi[2] + wo[2]);
                for (found, expected) in [
                    (found.ss, expected[0][0]),
                    (found.sp, expected[0][1]),
                    (found.ps, expected[1][0]),
                    (found.pp, expected[1][1]),
                ] {
                    let off = (found - scale * expected).norm();
                    assert!(
                        off < ROUNDING * (1.0 + found.norm()),
                        "{eta} {k} {wi:?} {wo:?}: {found} {}",
                        scale * expected
                    );
                }
            }
        }
    }

    #[test]
    fn swapped_directions_swap_and_negate_the_crossed_amplitudes() {
        const ROUNDING: f64 = 1e-12;
        let mut random = Random::new(8);
        for index in indices() {
            for _ in 0..500 {
                let [wi, wo] = directions(&mut random);
                let there = small_slope_amplitudes(wi, wo, index);
                let back = small_slope_amplitudes(wo, wi, index);
                let size = there.unpolarised() + 1.0;
                for (a, b) in [(there.ss, back.ss), (there.pp, back.pp), (there.sp, -back.ps), (there.ps, -back.sp)] {
                    assert!((a - b).norm() < ROUNDING * size, "{index:?} {wi:?} {wo:?}: {a} {b}");
                }
                let pair = |a, b| Pair::new(a, b).unwrap().interface(index, Obliquity::SmallSlope);
                assert!((pair(wi, wo) - pair(wo, wi)).abs() < ROUNDING * size);
            }
        }
    }

    /// The amplitudes of a metal tend to those of a perfect conductor as its index grows.
    #[test]
    fn large_indices_tend_to_the_perfect_conductor() {
        let mut random = Random::new(9);
        for _ in 0..500 {
            let [wi, wo] = [0, 1].map(|_| {
                loop {
                    let [w, _] = directions(&mut random);
                    if w[2] > 0.05 {
                        break w;
                    }
                }
            });
            let limit = small_slope_amplitudes(wi, wo, None);
            let mut before = f64::INFINITY;
            // The difference falls as 1/(|n| cosθ), so by ten from size to size. The bounds 10 and 0.2 leave room.
            for size in [1e4, 1e5, 1e6] {
                let found = small_slope_amplitudes(wi, wo, Some(ComplexIndex { eta: size, k: size }));
                let off = [found.ss - limit.ss, found.sp - limit.sp, found.ps - limit.ps, found.pp - limit.pp]
                    .map(Complex64::norm)
                    .into_iter()
                    .fold(0.0, f64::max);
                assert!(off < 10.0 * limit.unpolarised().sqrt().max(1.0) / (size * wi[2] * wo[2]), "{size}: {off}");
                assert!(off < 0.2 * before, "{size}: {off} after {before}");
                before = off;
            }
        }
    }

    /// Q is finite at the ends of all ranges: equal media, directions at the horizon, the largest and smallest accepted
    /// indices.
    #[test]
    fn the_ends_of_every_range_are_finite() {
        let grazing = [(1.0 - COSINE_MIN * COSINE_MIN).sqrt(), 0.0, COSINE_MIN];
        let directions = [[0.0, 0.0, 1.0], grazing, [-grazing[0], 0.0, grazing[2]], [0.6, 0.0, 0.8]];
        let ends = [(1.0, 0.0), (1e-3, 0.0), (1e3, 0.0), (1e3, 1e3), (1e-3, 1e3), (1.0 + 1e-9, 0.0), (1e-3, 1.0)];
        for index in ends.map(|(eta, k)| Some(ComplexIndex { eta, k })).into_iter().chain([None]) {
            for (wi, wo) in directions.iter().flat_map(|wi| directions.iter().map(move |wo| (*wi, *wo))) {
                let pair = Pair::new(wi, wo).unwrap();
                let double = pair.interface(index, Obliquity::SmallSlope);
                let sum = [pair.u as f32, pair.v as f32, pair.w as f32];
                let single = small_slope(sum, [pair.cos_i as f32, pair.cos_o as f32], index);
                assert!(
                    double.is_finite() && double >= 0.0 && single.is_finite() && single >= 0.0,
                    "{index:?} {wi:?} {wo:?}"
                );
            }
        }
        assert_eq!(small_slope([0.0f32, 0.0, 1.0], [0.5, 0.5], Some(ComplexIndex { eta: 1.0, k: 0.0 })), 0.0);
    }
}
