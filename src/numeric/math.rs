//! Functions that evaluators share: packed words, splines, polynomials, and maps of uniform random numbers to other
//! distributions. `R` is a type of real numbers and `N` a family of numbers (mod.rs); `lit` makes a constant.

use super::{Index, Number, Numbers, Real};
use wide::f64x4;

/// Largest number of single precision below one, `1 − 2⁻²⁴`; keeps random numbers within [0, 1).
pub(crate) const BELOW_ONE: f64 = 1.0 - f32::EPSILON as f64 / 2.0;
/// Distance from the centre of a Gaussian, in standard deviations, at which samplers cut it off. Its density there is
/// 4e-6 of the peak, and the fraction 6e-7 of its integral lies beyond. Larger values evaluate more orders and nodes;
/// with 2, sample weights at the horizon reach 8000.
pub(crate) const GAUSSIAN_REACH: f64 = 5.0;
/// Upper bound of |[`normal_quantile`]| in standard deviations: 5.42, its value for `u` near 1, with room for rounding.
pub(crate) const NORMAL_QUANTILE_MAX: f64 = 5.45;

/// Pairs of sine and cosine of four angles in radians. The error is at most two units in the last place of 1 for angles
/// within ±10⁷. One call takes a fraction of the time of four scalar calls.
#[inline]
pub(crate) fn sines_and_cosines(angles: [f64; 4]) -> [(f64, f64); 4] {
    let (sines, cosines) = f64x4::new(angles).sin_cos();
    let (sines, cosines) = (sines.to_array(), cosines.to_array());
    std::array::from_fn(|i| (sines[i], cosines[i]))
}

/// Numbers in the lower and the upper 16 bits of a word, each the upper half of a single-precision number (bfloat16).
#[inline(always)]
pub fn bf16_pair<N: Numbers>(word: N::Index) -> [N::Real; 2] {
    [N::from_bits(word << 16), N::from_bits(word & N::Index::lit(0xffff_0000))]
}

/// Integers from 0 to 65 535 in the lower and the upper 16 bits of a word.
#[inline(always)]
pub fn u16_pair<N: Numbers>(word: N::Index) -> [N::Real; 2] {
    [N::real(word & N::Index::lit(0xffff)), N::real(word >> 16)]
}

/// Cubic B-spline at a distance from its centre in knots. It is zero from a distance of 2 on, and its integral is 1.
#[inline(always)]
pub fn cubic_b_spline<R: Real>(distance: R) -> R {
    let d = distance.abs();
    // 2/3 − d²(1 − d/2) up to a distance of 1, (2 − d)³/6 beyond.
    let rest = (R::lit(2.0) - d).max(R::lit(0.0));
    let near = R::lit(2.0 / 3.0) - d * d * d.fma(R::lit(-0.5), R::lit(1.0));
    R::select(d.lt(R::lit(1.0)), near, rest * rest * rest * R::lit(1.0 / 6.0))
}

/// Weights of the coefficients of the knots −1, 0, 1, 2 in a uniform cubic B-spline at `t` in [0, 1].
#[inline(always)]
pub fn cubic_b_spline_weights<R: Real>(t: R) -> [R; 4] {
    // Pieces of the spline: t³/6 at the distance 2 − t from the centre, 2/3 − t²(1 − t/2) at the distance t.
    let s = R::lit(1.0) - t;
    let outer = |t: R| t * t * t * R::lit(1.0 / 6.0);
    let inner = |t: R| (t * t).fma(t.fma(R::lit(0.5), R::lit(-1.0)), R::lit(2.0 / 3.0));
    [outer(s), inner(t), inner(s), outer(t)]
}

/// Linear interpolation `a + t·(b − a)`.
#[inline(always)]
pub fn lerp<R: Real>(a: R, b: R, t: R) -> R {
    (b - a).fma(t, a)
}

/// Polynomial `Σ coefficients[i]·xⁱ`, by Horner's rule.
#[inline(always)]
pub fn polynomial<R: Real>(x: R, coefficients: &[f64]) -> R {
    coefficients.iter().rev().fold(R::lit(0.0), |sum, &c| sum.fma(x, R::lit(c)))
}

/// Quantile of the standard normal distribution, for `u` in (0, 1).
///
/// It is `√2·erf⁻¹(x)` with `x = 2u − 1`, by the two polynomials of Giles, *Approximating the erfinv function* (GPU
/// Computing Gems Jade, 2011). The error is a few units in the last place of single precision. `x` is clamped to
/// ±`BELOW_ONE`, so that the result stays within ±5.42 for `u` of 0 and 1, too.
#[inline(always)]
pub fn normal_quantile<R: Real>(u: R) -> R {
    /// Coefficients of `erf⁻¹(x)/x` in powers of `w − 2.5`, for `w = −ln(1 − x²) < 5`, from Giles.
    const CENTRAL: [f64; 9] = [
        1.501_409_41,
        0.246_640_727,
        -0.004_177_681_64,
        -0.001_253_725_03,
        0.000_218_580_87,
        -4.391_506_54e-06,
        -3.523_387_7e-06,
        3.432_739_39e-07,
        2.810_226_36e-08,
    ];
    /// Coefficients of `erf⁻¹(x)/x` in powers of `√w − 3`, for `w ≥ 5`, from Giles.
    const TAIL: [f64; 9] = [
        2.832_976_82,
        1.001_674_06,
        0.009_438_870_47,
        -0.007_622_461_3,
        0.005_739_507_73,
        -0.003_676_828_4,
        0.001_349_343_22,
        0.000_100_950_558,
        -0.000_200_214_257,
    ];
    let x = (u + u - R::lit(1.0)).clip(R::lit(-BELOW_ONE), R::lit(BELOW_ONE));
    let w = -((R::lit(1.0) - x) * (R::lit(1.0) + x)).log2() * R::lit(std::f64::consts::LN_2);
    let central = polynomial(w - R::lit(2.5), &CENTRAL);
    let tail = polynomial(w.max(R::lit(0.0)).sqrt() - R::lit(3.0), &TAIL);
    R::select(w.lt(R::lit(5.0)), central, tail) * x * R::lit(std::f64::consts::SQRT_2)
}

/// Unit vector in the upper hemisphere (z > 0) from two random numbers in [0, 1), uniform in solid angle, and whether
/// it is valid.
///
/// The numbers are scaled to the square [−1, 1]². Lambert's equal-area map takes its inscribed disc to the hemisphere,
/// without trigonometric functions. Points of the square outside the disc give no valid direction. The density over
/// directions is [`SQUARE_PDF`].
#[inline(always)]
pub fn square_to_hemisphere<N: Numbers>(u: [N::Real; 2]) -> ([N::Real; 3], N::Mask) {
    let lit = N::Real::lit;
    let [a, b] = u.map(|u| u + u - lit(1.0));
    let squared = a * a + b * b;
    let scale = (lit(2.0) - squared).max(lit(0.0)).sqrt();
    ([a * scale, b * scale, lit(1.0) - squared], squared.lt(lit(1.0)))
}

/// Density of [`square_to_hemisphere`] in 1/sr. It is 1/(4·2): points are uniform over the square, whose area is 4, and
/// the map takes a unit of area to 2 sr. The integral of the density over the hemisphere is π/4, the probability of a
/// valid direction.
pub const SQUARE_PDF: f64 = 0.125;

#[cfg(test)]
mod tests {
    use super::super::Plain;
    use super::*;

    #[test]
    fn normal_quantile_inverts_the_distribution() {
        // The polynomials were fitted for single precision; 3e-8 is found.
        const ABSOLUTE: f64 = 2e-6;
        for i in 1..2000 {
            let u = f64::from(i) / 2000.0;
            let back = 0.5 * libm::erfc(-normal_quantile(u) / std::f64::consts::SQRT_2);
            assert!((back - u).abs() < ABSOLUTE, "{u} {back}");
            // Rounding of `u` and of `1 − x` to single precision, over the density there. The polynomial adds about 20
            // roundings of 6e-8 at a result of up to 3.3.
            let (z, single) = (normal_quantile(u), f64::from(normal_quantile(u as f32)));
            let density = (-0.5 * z * z).exp() / std::f64::consts::TAU.sqrt();
            assert!((single - z).abs() < 2.0 * f64::from(f32::EPSILON) / density + 4e-6, "{u} {z} {single}");
        }
        assert!(normal_quantile(0.0f32).is_finite() && normal_quantile(1.0f32).is_finite());
    }

    #[test]
    fn four_sines_and_cosines_match_scalar() {
        // Two units in the last place of 1. Phases κh, with κ ≤ 4π/(360 nm), are below 10⁷ for depths h up to 0.28 m.
        const ROUNDING: f64 = 2.0 * f64::EPSILON;
        for scale in [1e-9, 1.0, 1e3, 1e7] {
            for i in 0..1000 {
                let angles = [0.1, -0.37, 0.74, -1.0].map(|angle| angle * scale * (0.5 + f64::from(i) / 2000.0));
                for (angle, found) in angles.into_iter().zip(sines_and_cosines(angles)) {
                    let (sin, cos) = angle.sin_cos();
                    let off = (found.0 - sin).abs().max((found.1 - cos).abs());
                    assert!(off <= ROUNDING, "{angle}: {found:?}, not {:?}", (sin, cos));
                }
            }
        }
    }

    #[test]
    fn cubic_b_splines_sum_to_one() {
        for i in 0..10 {
            let t = f64::from(i) / 10.0;
            let sum: f64 = (-2..3).map(|k| cubic_b_spline(t + f64::from(k))).sum();
            assert!((sum - 1.0).abs() < 1e-15);
            for (weight, k) in cubic_b_spline_weights(t).into_iter().zip(-1..3) {
                assert!((weight - cubic_b_spline(t - f64::from(k))).abs() < 1e-15);
            }
        }
    }

    #[test]
    fn pairs_unpack_a_word() {
        let word = 0x3f80_4000;
        assert_eq!(bf16_pair::<Plain<f32>>(word), [2.0, 1.0]);
        assert_eq!(u16_pair::<Plain<f64>>(word), [16384.0, 16256.0]);
    }

    #[test]
    fn square_maps_uniformly_to_unit_vectors() {
        // Error of the midpoint rule on 200 × 200 points.
        const QUADRATURE: f64 = 1e-3;
        let (mut sum, mut count) = (0.0, 0);
        for i in 0..200 {
            for j in 0..200 {
                let u = [i, j].map(|k| (f64::from(k) + 0.5) / 200.0);
                let (w, is_valid) = square_to_hemisphere::<Plain<f64>>(u);
                if is_valid {
                    assert!((w.iter().map(|c| c * c).sum::<f64>() - 1.0).abs() < 1e-12 && w[2] > 0.0);
                    sum += w[2];
                    count += 1;
                }
            }
        }
        // The mean cosine over a hemisphere is a half.
        assert!((sum / f64::from(count) - 0.5).abs() < QUADRATURE);
        // The valid fraction of the square is the density times the solid angle of the hemisphere.
        assert!((f64::from(count) / 4e4 - SQUARE_PDF * std::f64::consts::TAU).abs() < QUADRATURE);
    }
}
