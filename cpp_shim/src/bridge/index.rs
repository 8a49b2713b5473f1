//! Refractive index from the samples that C++ passes.

use super::ffi;
use sunbeam::scattering::{ComplexIndex, SpectralIndex, SpectralIndexError};
use sunbeam::table::WAVELENGTH_MIN_NM;

/// The complex index at the wavelengths of both parts, each linearly interpolated; `None` for a perfect reflector.
pub(super) fn spectral_index(samples: &ffi::IndexSamples) -> Result<Option<SpectralIndex>, SpectralIndexError> {
    let part = |nm: &[f64], values: &[f64]| -> Vec<(f64, f64)> {
        let all = if nm.is_empty() { &[WAVELENGTH_MIN_NM] } else { nm };
        all.iter().copied().zip(values.iter().copied()).collect()
    };
    let (eta, k) = (part(&samples.eta_nm, &samples.eta), part(&samples.k_nm, &samples.k));
    if let (&[(_, eta)], &[(_, k)]) = (eta.as_slice(), k.as_slice()) {
        return Ok(Some(SpectralIndex::Constant(ComplexIndex { eta, k })));
    }
    if eta.is_empty() || k.is_empty() {
        return Ok(None);
    }
    let mut wavelengths: Vec<f64> = eta.iter().chain(&k).map(|sample| sample.0).collect();
    wavelengths.sort_by(f64::total_cmp);
    wavelengths.dedup();
    let index = |nm| (nm, ComplexIndex { eta: linear(&eta, nm), k: linear(&k, nm) });
    SpectralIndex::sampled(wavelengths.into_iter().map(index).collect()).map(Some)
}

/// Linear interpolation at `x` between samples in rising order, constant beyond their ends. Needs at least one sample.
fn linear(samples: &[(f64, f64)], x: f64) -> f64 {
    let above = samples.partition_point(|sample| sample.0 < x).min(samples.len() - 1);
    let (low, high) = (samples[above.saturating_sub(1)], samples[above]);
    let t = if high.0 > low.0 { ((x - low.0) / (high.0 - low.0)).clamp(0.0, 1.0) } else { 1.0 };
    low.1 + t * (high.1 - low.1)
}
