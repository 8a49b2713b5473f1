//! Fresnel reflectance of unpolarised light at a plane interface (Born & Wolf, section 14.2), in double precision and
//! for every family of numbers.

use super::ComplexIndex;
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
    let transmitted = (n * n - (1.0 - cos * cos)).sqrt();
    let s = (cos - transmitted) / (cos + transmitted);
    let p = (n * n * cos - transmitted) / (n * n * cos + transmitted);
    (0.5 * (s.norm_sqr() + p.norm_sqr())).clamp(0.0, 1.0)
}

/// [`fresnel_unpolarised`] for every family of numbers, in real arithmetic: `a + ib` is the transmitted normal
/// component.
#[inline(always)]
pub fn fresnel_of_family<R: Real>(cos_theta: R, index: ComplexIndex) -> R {
    let lit = R::lit;
    let cos = cos_theta.clip(lit(0.0), lit(1.0));
    let cos_squared = cos * cos;
    let sin_squared = lit(1.0) - cos_squared;
    let (a, b) = transmitted(sin_squared, index);
    let b_squared = b * b;
    // Squares of differences: differences of squares would cancel for indices near one.
    let (less, more) = (cos - a, cos + a);
    let tiny = lit(1e-30);
    let s = less.fma(less, b_squared) / more.fma(more, b_squared).max(tiny);
    let (less, more) = (a.fma(cos, -sin_squared), a.fma(cos, sin_squared));
    let rest = b_squared * cos_squared;
    let p_over_s = less.fma(less, rest) / more.fma(more, rest).max(tiny);
    (s * lit(0.5)).fma(p_over_s, s * lit(0.5)).min(lit(1.0))
}

/// Transmitted normal component `√(ε − sin²θ) = a + ib` as `(a, b)`, both non-negative; ε is the squared index.
#[inline(always)]
pub(super) fn transmitted<R: Real>(sin_squared: R, ComplexIndex { eta, k }: ComplexIndex) -> (R, R) {
    let lit = R::lit;
    // Real part of (a + ib)²; the imaginary part is 2·eta·k.
    let real = lit(eta * eta - k * k) - sin_squared;
    let length = real.fma(real, lit(4.0 * eta * eta * k * k)).sqrt();
    // The larger of a and b from the sum that does not cancel, the smaller from their product.
    let larger = ((length + real.abs()) * lit(0.5)).sqrt();
    let smaller = lit(eta * k) / larger.max(lit(1e-15));
    let inverted = real.lt(lit(0.0));
    (R::select(inverted, smaller, larger), R::select(inverted, larger, smaller))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn real_arithmetic_matches_complex_arithmetic() {
        // About ten roundings of single precision; differences of nearly equal numbers lose more at indices near one.
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
    fn known_values() {
        let keratin = ComplexIndex { eta: 1.5, k: 0.0 };
        // Normal incidence: ((n−1)/(n+1))²; Brewster's angle: half of the s reflectance ((n²−1)/(n²+1))².
        assert!((fresnel_unpolarised(1.0, keratin) - 0.04).abs() < 1e-15);
        let brewster = (1.0f64 / (1.0 + 2.25)).sqrt();
        assert!((fresnel_unpolarised(brewster, keratin) - 0.5 * (1.25f64 / 3.25).powi(2)).abs() < 1e-15);
        assert!((fresnel_unpolarised(0.0, keratin) - 1.0).abs() < 1e-15);
        assert_eq!(fresnel_unpolarised(0.0, ComplexIndex { eta: 1.0, k: 0.0 }), 0.0);
        // A metal at normal incidence: ((n−1)² + k²)/((n+1)² + k²).
        let metal = ComplexIndex { eta: 0.2, k: 3.0 };
        assert!((fresnel_unpolarised(1.0, metal) - (0.64 + 9.0) / (1.44 + 9.0)).abs() < 1e-15);
    }
}
