//! Refractive index eta + ik from the samples that C++ passes (`IndexSamples` in bridge.rs).
//!
//! Each of eta and k has two lists: wavelengths in nm, and values at these wavelengths.
//!
//! | wavelengths | values | meaning |
//! | --- | --- | --- |
//! | empty | one | a constant |
//! | n, rising | n | samples with linear interpolation in between |
//! | empty | empty | not given (a perfect reflector), or not known by wavelength (`known` is false) |

use super::ffi;
use sunbeam::scattering::{ComplexIndex, SpectralIndex, SpectralIndexError};
use sunbeam::table::WAVELENGTH_MIN_NM;

/// The complex index, or `None` where both lists of eta or of k are empty.
///
/// An index that depends on the wavelength gets samples at all wavelengths that eta or k has. If only one of the two
/// has a sample at a wavelength, the other is interpolated linearly.
///
/// # Errors
/// The errors of [`SpectralIndex::sampled`].
pub(super) fn spectral_index(samples: &ffi::IndexSamples) -> Result<Option<SpectralIndex>, SpectralIndexError> {
    // Pairs of wavelength and value; none without values. A constant becomes one sample. Its wavelength is arbitrary,
    // because `linear` is constant beyond the ends.
    let samples_of = |nm: &[f64], values: &[f64]| -> Vec<(f64, f64)> {
        let wavelengths = if nm.is_empty() { &[WAVELENGTH_MIN_NM] } else { nm };
        wavelengths.iter().copied().zip(values.iter().copied()).collect()
    };
    let (eta, k) = (samples_of(&samples.eta_nm, &samples.eta), samples_of(&samples.k_nm, &samples.k));
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

/// Linear interpolation at `x` between samples `(x, value)` with rising x, constant beyond their ends. There is at
/// least one sample.
fn linear(samples: &[(f64, f64)], x: f64) -> f64 {
    let above = samples.partition_point(|sample| sample.0 < x).min(samples.len() - 1);
    let (low, high) = (samples[above.saturating_sub(1)], samples[above]);
    let t = if high.0 > low.0 { ((x - low.0) / (high.0 - low.0)).clamp(0.0, 1.0) } else { 1.0 };
    low.1 + t * (high.1 - low.1)
}
