//! Band means of the ratio R/R0 in a colour lobe (`colour_lobe.rs`), for reliefs of other sizes than the table's. R is
//! the material's Fresnel reflectance at a wavelength, R0 that of one reference index for all wavelengths.
//!
//! A *band* is a channel of linear sRGB: an integral over wavelengths with the channel's weights. The *half vector* of
//! a pair of directions is the unit vector along their sum, the scattering vector. The *cosine at a half vector* is
//! that of the angle between the half vector and either direction: half the length of the scattering vector. R and R0
//! depend on this cosine.
//!
//! A table of colours contains R/R0 at the half vector of the scattering vector at which it is read. For a resized
//! relief the table is read at another scattering vector than that of the directions. The lobe therefore multiplies
//! each channel by the band mean of R/R0 at the half vector of the directions, divided by that at the half vector of
//! the look-up. The quotient is exact where the power spectrum S is constant over a band.

use crate::colour::SpectralToRgb;
use crate::numeric::Real;
use crate::numeric::math::polynomial;
use serde::{Deserialize, Serialize};

/// Number of coefficients of a polynomial in the cosine. With this number it follows the ratios of measured metals to
/// 0.2 %; a larger number costs more per evaluation.
const COEFFICIENTS: usize = 6;
/// Step in nm of the mean over a band, the default of [`SpectralToRgb`]. Refractive indices vary little over 5 nm. A
/// smaller step lengthens the build; a larger one misses the shape of the channels' weights.
const STEP_NM: f64 = 5.0;
/// Smallest mean of R/R0. Chosen: it keeps quotients finite where a polynomial comes close to zero. Smaller values
/// allow larger quotients of rounding errors; larger ones would change materials that are dark in one band.
const MEAN_MIN: f64 = 1e-3;

/// Means of R/R0 over the bands of linear sRGB, in the form of polynomials in the cosine at the half vector.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct BandRatio {
    /// Coefficients `[band][power of the cosine]`.
    polynomials: [[f64; COEFFICIENTS]; 3],
}

impl BandRatio {
    /// Means of `ratio`, a function of the wavelength in nm and the cosine at the half vector. `weights` are
    /// [`BandRatio::band_weights`].
    pub(super) fn new(weights: &SpectralToRgb, ratio: impl Fn(f64, f64) -> f64) -> Self {
        // Chebyshev nodes of [0, 1]: a polynomial through values there stays accurate up to both ends.
        let cosines: [f64; COEFFICIENTS] =
            std::array::from_fn(|i| 0.5 - 0.5 * (std::f64::consts::PI * (i as f64 + 0.5) / COEFFICIENTS as f64).cos());
        let white = weights.rgb_of(|_| 1.0);
        let means = cosines.map(|cos| {
            let sums = weights.rgb_of(|nm| ratio(nm, cos));
            std::array::from_fn::<f64, 3, _>(|band| sums[band] / white[band])
        });
        Self { polynomials: std::array::from_fn(|band| polynomial_through(cosines, means.map(|mean| mean[band]))) }
    }

    /// Weights of wavelengths in the bands, for [`BandRatio::new`].
    ///
    /// # Errors
    /// None in practice, since [`STEP_NM`] is a step that [`SpectralToRgb`] accepts.
    pub(super) fn band_weights() -> Result<SpectralToRgb, crate::colour::ColourError> {
        SpectralToRgb::visible(STEP_NM)
    }

    /// Mean at `cosine`, divided by the mean at `read_cosine`, for red, green and blue. `cosine` is the cosine at the
    /// half vector of the directions, `read_cosine` that at the half vector at which the table is read. `R` is a type
    /// of numbers: single ones, SIMD vectors or traced variables (`src/numeric`).
    #[inline(always)]
    pub(super) fn quotients<R: Real>(&self, cosine: R, read_cosine: R) -> [R; 3] {
        let [cosine, read_cosine] = [cosine, read_cosine].map(|cosine| cosine.clip(R::lit(0.0), R::lit(1.0)));
        let mean = |band: usize, cosine: R| polynomial(cosine, &self.polynomials[band]).max(R::lit(MEAN_MIN));
        std::array::from_fn(|band| mean(band, cosine) / mean(band, read_cosine))
    }
}

/// Coefficients, from the constant on, of the polynomial with these `values` at the abscissae `x`.
fn polynomial_through<const N: usize>(x: [f64; N], values: [f64; N]) -> [f64; N] {
    // Newton's divided differences, computed in place.
    let mut divided = values;
    for order in 1..N {
        for i in (order..N).rev() {
            divided[i] = (divided[i] - divided[i - 1]) / (x[i] - x[i - order]);
        }
    }
    // Expands the nested form from the highest difference down: p(t) ← p(t)·(t − x_i) + divided_i.
    let mut coefficients = [0.0; N];
    for i in (0..N).rev() {
        for power in (0..N).rev() {
            let lower = if power > 0 { coefficients[power - 1] } else { 0.0 };
            coefficients[power] = lower - x[i] * coefficients[power];
        }
        coefficients[0] += divided[i];
    }
    coefficients
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scattering::{ComplexIndex, fresnel_unpolarised};

    #[test]
    fn polynomials_follow_the_means_of_a_metal() {
        // An index that changes over the visible range as gold's does: dielectric losses in the blue, a mirror in the
        // red.
        let index = |nm: f64| {
            let t = ((nm - 400.0) / 300.0).clamp(0.0, 1.0);
            ComplexIndex { eta: 1.6 - 1.4 * t, k: 1.9 + 1.9 * t }
        };
        let ratio = |nm: f64, cos: f64| fresnel_unpolarised(cos, index(nm)) / fresnel_unpolarised(cos, index(700.0));
        let weights = BandRatio::band_weights().unwrap();
        let bands = BandRatio::new(&weights, ratio);
        for i in 0..=20 {
            let cos = f64::from(i) / 20.0;
            let [at, normal] = [cos, 1.0].map(|cos| weights.rgb_of(|nm| ratio(nm, cos)));
            let quotients = bands.quotients(cos, 1.0);
            for band in 0..3 {
                let expected = at[band] / normal[band];
                // The accuracy of the polynomials, as at `COEFFICIENTS`.
                assert!((quotients[band] / expected - 1.0).abs() < 2e-3, "{cos} {band}: {quotients:?}");
            }
        }
    }
}
