//! Fresnel reflectance of unpolarised light at a plane interface (Born & Wolf, section 14.2), in double precision and
//! for every family of numbers.
//!
//! ```text
//! θ     angle of incidence, in the medium above: air, or a cover (a clear layer over the relief)
//! ε     squared index (eta + i·k)² of the medium below, relative to that above
//! t     √(ε − sin²θ) = a + ib, normal component of the transmitted wave vector over the wave number above
//! s, p  polarisation states: electric field perpendicular to the plane of incidence, and within it
//! r_s   (cosθ − t)/(cosθ + t)
//! r_p   (ε cosθ − t)/(ε cosθ + t) = −r_s · (t cosθ − sin²θ)/(t cosθ + sin²θ)
//! R     (|r_s|² + |r_p|²)/2, the reflectance
//! ```
//!
//! In code, `R: Real` is not the reflectance but a type of numbers: single ones, SIMD vectors or traced variables
//! (`src/numeric`). `lit` makes a constant.

use super::ComplexIndex;
use super::small_slope::SQUARED_MODULUS_MIN;
use crate::numeric::Real;
use sunbeam_fourier::num_complex::Complex64;

/// Fresnel reflectance of unpolarised light, from the cosine of the angle of incidence.
///
/// In [0, 1] for every index with `eta > 0` and `k ≥ 0`; the cosine is clamped to [0, 1].
///
/// ```
/// use sunbeam::scattering::{ComplexIndex, fresnel_unpolarised};
///
/// // Glass at normal incidence: ((n − 1)/(n + 1))².
/// let glass = ComplexIndex { eta: 1.5, k: 0.0 };
/// assert!((fresnel_unpolarised(1.0, glass) - 0.04).abs() < 1e-12);
/// ```
pub fn fresnel_unpolarised(cos_theta: f64, index: ComplexIndex) -> f64 {
    if index.eta == 1.0 && index.k == 0.0 {
        // Equal media reflect nothing; the formula would be 0/0 at grazing incidence.
        return 0.0;
    }
    let cos = cos_theta.clamp(0.0, 1.0);
    let n = Complex64::new(index.eta, index.k);
    let t = (n * n - (1.0 - cos * cos)).sqrt();
    let r_s = (cos - t) / (cos + t);
    let r_p = (n * n * cos - t) / (n * n * cos + t);
    (0.5 * (r_s.norm_sqr() + r_p.norm_sqr())).clamp(0.0, 1.0)
}

/// [`fresnel_unpolarised`] for every type of numbers, in real arithmetic, since the types have no complex numbers.
#[inline(always)]
pub fn fresnel_of_family<R: Real>(cos_theta: R, index: ComplexIndex) -> R {
    let lit = R::lit;
    let cos = cos_theta.clip(lit(0.0), lit(1.0));
    let cos_squared = cos * cos;
    let sin_squared = lit(1.0) - cos_squared;
    let (a, b) = transmitted_normal(sin_squared, index);
    let b_squared = b * b;
    // |(x − y)/(x + y)|² of a real x and a complex y. `difference` and `sum` are the real parts of x − y and x + y up
    // to sign; both have the same squared imaginary part. Squares of differences keep their digits for indices near
    // one, unlike differences of squares. Equal media at grazing incidence would give 0/0; the bound on the divisor,
    // 1e-18, makes it 0.
    let ratio = |difference: R, sum: R, imaginary_squared: R| {
        difference.fma(difference, imaginary_squared) / sum.fma(sum, imaginary_squared).max(lit(SQUARED_MODULUS_MIN))
    };
    // |r_s|² with x = cosθ and y = t, and |r_p|²/|r_s|² with x = sin²θ and y = t·cosθ.
    let s = ratio(cos - a, cos + a, b_squared);
    let p_over_s = ratio(a.fma(cos, -sin_squared), a.fma(cos, sin_squared), b_squared * cos_squared);
    (s * lit(0.5)).fma(p_over_s, s * lit(0.5)).min(lit(1.0))
}

/// Real and imaginary part of `t = √(ε − sin²θ) = a + ib`, both non-negative.
#[inline(always)]
pub(super) fn transmitted_normal<R: Real>(sin_squared: R, ComplexIndex { eta, k }: ComplexIndex) -> (R, R) {
    let lit = R::lit;
    // Real part of t², a² − b²; the imaginary part is 2ab = 2·eta·k.
    let real = lit(eta * eta - k * k) - sin_squared;
    let length = real.fma(real, lit(4.0 * eta * eta * k * k)).sqrt();
    // The larger of a and b is √((|t²| + |a² − b²|)/2), a sum of positive terms; the smaller follows from the product
    // ab = eta·k. Where t = 0, k is 0, and the bound on the divisor makes the smaller 0.
    let larger = ((length + real.abs()) * lit(0.5)).sqrt();
    let smaller = lit(eta * k) / larger.max(lit(SQUARED_MODULUS_MIN.sqrt()));
    let is_b_larger = real.lt(lit(0.0));
    (R::select(is_b_larger, smaller, larger), R::select(is_b_larger, larger, smaller))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn real_arithmetic_matches_complex_arithmetic() {
        // About ten roundings of single precision, amplified at indices near one, where equal numbers are subtracted.
        const SINGLE: f64 = 3e-6;
        for (eta, k) in [(1.5, 0.0), (0.2, 3.4), (1.02, 0.0), (0.7, 0.0), (2.0, 80.0), (1.0, 0.3), (1e-3, 1e-3)] {
            let index = ComplexIndex { eta, k };
            for i in 0..=1000 {
                let cos = f64::from(i) / 1000.0;
                let expected = fresnel_unpolarised(cos, index);
                assert!((fresnel_of_family(cos, index) - expected).abs() < 1e-12, "{eta} {k} {cos}");
                let single = f64::from(fresnel_of_family(cos as f32, index));
                assert!((single - expected).abs() < SINGLE, "{eta} {k} {cos}: {single} {expected}");
            }
        }
        assert_eq!(fresnel_of_family(0.0f32, ComplexIndex { eta: 1.0, k: 0.0 }), 0.0);
    }

    #[test]
    fn reflectance_has_closed_forms_at_special_angles() {
        let glass = ComplexIndex { eta: 1.5, k: 0.0 };
        // Normal incidence: ((n − 1)/(n + 1))².
        assert!((fresnel_unpolarised(1.0, glass) - 0.04).abs() < 1e-15);
        // Brewster's angle, tanθ = n: half of the s reflectance ((n² − 1)/(n² + 1))².
        let cos_brewster = (1.0f64 / (1.0 + 2.25)).sqrt();
        assert!((fresnel_unpolarised(cos_brewster, glass) - 0.5 * (1.25f64 / 3.25).powi(2)).abs() < 1e-15);
        assert!((fresnel_unpolarised(0.0, glass) - 1.0).abs() < 1e-15);
        assert_eq!(fresnel_unpolarised(0.0, ComplexIndex { eta: 1.0, k: 0.0 }), 0.0);
        // A metal at normal incidence: ((n − 1)² + k²)/((n + 1)² + k²).
        let metal = ComplexIndex { eta: 0.2, k: 3.0 };
        assert!((fresnel_unpolarised(1.0, metal) - (0.64 + 9.0) / (1.44 + 9.0)).abs() < 1e-15);
    }
}
