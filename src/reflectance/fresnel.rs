use rustfft::num_complex::Complex64;
use serde::{Deserialize, Serialize};

/// Complex refractive index `eta + i k` relative to the outside.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ComplexIndex {
    pub eta: f64,
    pub k: f64,
}

/// Unpolarised Fresnel reflectance at a plane interface for the cosine of the angle of incidence (model.md §2; Born &
/// Wolf §14.2). `k = 0` is a dielectric. In [0, 1] for every index with `eta > 0`, `k ≥ 0` and cosine in [0, 1].
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

#[cfg(test)]
mod tests {
    use super::*;

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
