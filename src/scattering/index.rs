//! Complex refractive indices, constant or by wavelength. Waves are `exp(−iωt)`, so an absorbing medium has k > 0.

use serde::{Deserialize, Serialize};

/// Complex refractive index `eta + i k` of the medium below the surface, relative to the medium above: air, or a
/// cover, which is a clear layer over the relief.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ComplexIndex {
    /// Real part, positive.
    pub eta: f64,
    /// Imaginary part, zero for a lossless dielectric.
    pub k: f64,
}

/// Largest `k/eta` of a dielectric. Chosen: keratin with melanin stays below 0.05, metals lie above 0.7. Dielectrics
/// have the small-slope factor by default. A larger value would give it to strong absorbers; a value below 0.05 would
/// deny it to pigmented keratin.
const DIELECTRIC_MAX: f64 = 0.1;

impl ComplexIndex {
    /// Whether the medium counts as a dielectric, which may absorb a little: `eta > 0` and `k ≤ 0.1·eta`.
    pub fn is_dielectric(&self) -> bool {
        self.eta > 0.0 && self.k <= DIELECTRIC_MAX * self.eta
    }
}

/// Complex refractive index that may depend on the wavelength.
///
/// ```
/// use sunbeam::scattering::{ComplexIndex, SpectralIndex};
///
/// let sample = |nm, eta| (nm, ComplexIndex { eta, k: 0.0 });
/// let index = SpectralIndex::sampled(vec![sample(400.0, 1.58), sample(700.0, 1.55)])?;
/// assert!((index.at(550.0).eta - 1.565).abs() < 1e-12);
/// # Ok::<(), sunbeam::scattering::SpectralIndexError>(())
/// ```
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum SpectralIndex {
    /// One index for every wavelength.
    Constant(ComplexIndex),
    /// Increasing wavelengths in nm with the index at each. Linearly interpolated in between, constant beyond the ends.
    /// [`SpectralIndex::sampled`] checks them.
    Sampled(Vec<(f64, ComplexIndex)>),
}

/// Reason why the samples of an index are refused.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[allow(missing_docs, reason = "each message describes its fields")]
pub enum SpectralIndexError {
    #[error("an index by wavelength needs at least one sample")]
    Empty,
    #[error("the wavelengths of an index must be finite, but one is {wavelength_nm} nm")]
    NotFinite { wavelength_nm: f64 },
    #[error("the wavelengths of an index must rise: {before_nm} nm is followed by {after_nm} nm")]
    Order { before_nm: f64, after_nm: f64 },
    #[error(
        "the index at {wavelength_nm} nm is {eta} + {k}i; eta must be positive and finite, k finite and not negative"
    )]
    Value { wavelength_nm: f64, eta: f64, k: f64 },
}

impl SpectralIndex {
    /// An index from samples `(wavelength in nm, index)`.
    ///
    /// # Errors
    /// No samples, wavelengths that do not increase, `eta ≤ 0`, `k < 0`, or numbers that are not finite.
    pub fn sampled(samples: Vec<(f64, ComplexIndex)>) -> Result<Self, SpectralIndexError> {
        if samples.is_empty() {
            return Err(SpectralIndexError::Empty);
        }
        let mut before_nm = f64::NEG_INFINITY;
        for &(wavelength_nm, ComplexIndex { eta, k }) in &samples {
            if !wavelength_nm.is_finite() {
                return Err(SpectralIndexError::NotFinite { wavelength_nm });
            }
            if wavelength_nm <= before_nm {
                return Err(SpectralIndexError::Order { before_nm, after_nm: wavelength_nm });
            }
            if !(eta.is_finite() && eta > 0.0 && k.is_finite() && k >= 0.0) {
                return Err(SpectralIndexError::Value { wavelength_nm, eta, k });
            }
            before_nm = wavelength_nm;
        }
        Ok(Self::Sampled(samples))
    }

    /// Whether the medium is a dielectric ([`ComplexIndex::is_dielectric`]) at every wavelength given.
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
        // The wavelength lies between the samples `below` and `samples[above]`. Beyond the ends, one of both is
        // missing.
        let above = samples.partition_point(|(nm, _)| *nm < wavelength_nm);
        let below = above.checked_sub(1).and_then(|i| samples.get(i));
        let (Some(&(low_nm, low)), Some(&(high_nm, high))) = (below, samples.get(above)) else {
            let end = if above == 0 { samples.first() } else { samples.last() };
            // Without samples, which `sampled` refuses, the index is 1.
            return end.map_or(ComplexIndex { eta: 1.0, k: 0.0 }, |(_, index)| *index);
        };
        let fraction = (wavelength_nm - low_nm) / (high_nm - low_nm);
        ComplexIndex { eta: low.eta + fraction * (high.eta - low.eta), k: low.k + fraction * (high.k - low.k) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn samples_are_interpolated_linearly() {
        let sample = |nm, eta, k| (nm, ComplexIndex { eta, k });
        let index = SpectralIndex::sampled(vec![sample(400.0, 1.0, 2.0), sample(500.0, 2.0, 4.0)]).unwrap();
        for (nm, eta) in [(300.0, 1.0), (400.0, 1.0), (425.0, 1.25), (500.0, 2.0), (900.0, 2.0)] {
            assert_eq!(index.at(nm), ComplexIndex { eta, k: 2.0 * eta });
        }
        assert_eq!(SpectralIndex::sampled(vec![]), Err(SpectralIndexError::Empty));
        assert!(SpectralIndex::sampled(vec![sample(400.0, 1.0, 0.0); 2]).is_err());
        let error = SpectralIndex::sampled(vec![sample(f64::NAN, 1.0, 0.0)]).unwrap_err();
        assert_eq!(error.to_string(), "the wavelengths of an index must be finite, but one is NaN nm");
        assert!(SpectralIndex::sampled(vec![sample(400.0, 1.0, -1.0)]).is_err());
    }
}
