use crate::numeric::Real;
use serde::{Deserialize, Serialize};
use sunbeam_fourier::num_complex::Complex64;

/// Complex refractive index `eta + i k` relative to the outside.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ComplexIndex {
    /// The real part; positive.
    pub eta: f64,
    /// The imaginary part; zero for a dielectric.
    pub k: f64,
}

/// Unpolarised Fresnel reflectance at a plane interface for the cosine of the angle of incidence (docs/model.md#the-reflectance; Born &
/// Wolf, section 14.2). `k = 0` is a dielectric. In [0, 1] for every index with `eta > 0`, `k ≥ 0` and cosine in [0, 1].
pub fn fresnel_unpolarised(cos_theta: f64, index: ComplexIndex) -> f64 {
    if index.eta == 1.0 && index.k == 0.0 {
        // No interface; the formula would be 0/0 at grazing incidence.
        return 0.0;
    }
    let cos = cos_theta.clamp(0.0, 1.0);
    let n = Complex64::new(index.eta, index.k);
    let transmitted = (n * n - (1.0 - cos * cos)).sqrt();
    let s = (cos - transmitted) / (cos + transmitted);
    let p = (n * n * cos - transmitted) / (n * n * cos + transmitted);
    (0.5 * (s.norm_sqr() + p.norm_sqr())).clamp(0.0, 1.0)
}

/// [`fresnel_unpolarised`] of a given index for numbers of any family, without complex ones (Born & Wolf, section 14.2: the
/// transmitted normal component is `a + ib`).
#[inline(always)]
pub fn fresnel_of_family<R: Real>(cos_theta: R, index: ComplexIndex) -> R {
    let lit = R::lit;
    let cos = cos_theta.clip(lit(0.0), lit(1.0));
    let cos_squared = cos * cos;
    let sin_squared = lit(1.0) - cos_squared;
    let (a, b) = transmitted(sin_squared, index);
    let b_squared = b * b;
    // Squares of differences rather than differences of squares, which would cancel for indices near one.
    let (less, more) = (cos - a, cos + a);
    let tiny = lit(1e-30);
    let s = less.fma(less, b_squared) / more.fma(more, b_squared).max(tiny);
    let (less, more) = (a.fma(cos, -sin_squared), a.fma(cos, sin_squared));
    let rest = b_squared * cos_squared;
    let p_over_s = less.fma(less, rest) / more.fma(more, rest).max(tiny);
    (s * lit(0.5)).fma(p_over_s, s * lit(0.5)).min(lit(1.0))
}

/// The transmitted normal component `√(ε − sin²θ)` as `(a, b)` of `a + ib`, neither of them negative.
#[inline(always)]
pub(super) fn transmitted<R: Real>(sin_squared: R, ComplexIndex { eta, k }: ComplexIndex) -> (R, R) {
    let lit = R::lit;
    // The square of a + ib has this real part, and 2·eta·k as its imaginary part.
    let real = lit(eta * eta - k * k) - sin_squared;
    let length = real.fma(real, lit(4.0 * eta * eta * k * k)).sqrt();
    // The larger of a and b by the sum that does not cancel, the other by their product.
    let larger = ((length + real.abs()) * lit(0.5)).sqrt();
    let smaller = lit(eta * k) / larger.max(lit(1e-15));
    let inverted = real.lt(lit(0.0));
    (R::select(inverted, smaller, larger), R::select(inverted, larger, smaller))
}

/// Largest `k/eta` of what counts as a dielectric.
const DIELECTRIC_MAX: f64 = 0.1;

impl ComplexIndex {
    /// Whether the index is that of a dielectric, which may absorb a little: `k ≤ 0.1·eta`, and `eta > 0`.
    pub fn is_dielectric(&self) -> bool {
        self.eta > 0.0 && self.k <= DIELECTRIC_MAX * self.eta
    }
}

/// A complex refractive index that may depend on the wavelength.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum SpectralIndex {
    /// The same at every wavelength.
    Constant(ComplexIndex),
    /// Wavelengths in nm, rising, and the index at each; linear in between, and beyond the ends as at them.
    Sampled(Vec<(f64, ComplexIndex)>),
}

/// Why samples are no index.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[allow(missing_docs)] // Each message says what its fields are.
pub enum SpectralIndexError {
    #[error("an index by wavelength needs at least one sample")]
    Empty,
    #[error("the wavelengths of an index must be finite and rise: {before_nm} nm is followed by {after_nm} nm")]
    Order { before_nm: f64, after_nm: f64 },
    #[error(
        "the index at {wavelength_nm} nm is {eta} + {k}i; eta must be positive and finite, k finite and not negative"
    )]
    Value { wavelength_nm: f64, eta: f64, k: f64 },
}

impl SpectralIndex {
    /// An index by samples `(wavelength in nm, index)`.
    ///
    /// # Errors
    /// No samples, wavelengths that do not rise, or `eta ≤ 0`, `k < 0` or numbers that are not finite.
    pub fn sampled(samples: Vec<(f64, ComplexIndex)>) -> Result<Self, SpectralIndexError> {
        if samples.is_empty() {
            return Err(SpectralIndexError::Empty);
        }
        let mut before_nm = f64::NEG_INFINITY;
        for &(wavelength_nm, ComplexIndex { eta, k }) in &samples {
            if !(wavelength_nm.is_finite() && wavelength_nm > before_nm) {
                return Err(SpectralIndexError::Order { before_nm, after_nm: wavelength_nm });
            }
            if !(eta.is_finite() && eta > 0.0 && k.is_finite() && k >= 0.0) {
                return Err(SpectralIndexError::Value { wavelength_nm, eta, k });
            }
            before_nm = wavelength_nm;
        }
        Ok(Self::Sampled(samples))
    }

    /// Whether it is that of a dielectric at all wavelengths ([`ComplexIndex::is_dielectric`]).
    pub fn is_dielectric(&self) -> bool {
        match self {
            Self::Constant(index) => index.is_dielectric(),
            Self::Sampled(samples) => samples.iter().all(|(_, index)| index.is_dielectric()),
        }
    }

    /// The index at a wavelength in nm.
    pub fn at(&self, wavelength_nm: f64) -> ComplexIndex {
        let samples = match self {
            Self::Constant(index) => return *index,
            Self::Sampled(samples) => samples,
        };
        let above = samples.partition_point(|(nm, _)| *nm < wavelength_nm);
        let (Some(&(low_nm, low)), Some(&(high_nm, high))) = (samples.get(above.wrapping_sub(1)), samples.get(above))
        else {
            let end = if above == 0 { samples.first() } else { samples.last() };
            return end.map_or(ComplexIndex { eta: 1.0, k: 0.0 }, |(_, index)| *index);
        };
        let t = (wavelength_nm - low_nm) / (high_nm - low_nm);
        ComplexIndex { eta: low.eta + t * (high.eta - low.eta), k: low.k + t * (high.k - low.k) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_family_has_the_same_reflectance() {
        // Single precision, some ten roundings; differences of nearly equal numbers cost more at indices near one.
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
    fn indices_are_linear_between_samples() {
        let sample = |nm, eta, k| (nm, ComplexIndex { eta, k });
        let index = SpectralIndex::sampled(vec![sample(400.0, 1.0, 2.0), sample(500.0, 2.0, 4.0)]).unwrap();
        for (nm, eta) in [(300.0, 1.0), (400.0, 1.0), (425.0, 1.25), (500.0, 2.0), (900.0, 2.0)] {
            assert_eq!(index.at(nm), ComplexIndex { eta, k: 2.0 * eta });
        }
        assert_eq!(SpectralIndex::sampled(vec![]), Err(SpectralIndexError::Empty));
        assert!(SpectralIndex::sampled(vec![sample(400.0, 1.0, 0.0); 2]).is_err());
        assert!(SpectralIndex::sampled(vec![sample(400.0, 1.0, -1.0)]).is_err());
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
