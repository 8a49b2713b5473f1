//! Expansions of the phase screen in powers or Chebyshev polynomials of the height (docs/model.md#the-two-expansions).
//!
//! Here h is the height from the middle of its range and H half the range, both in µm; κ is the phase rate in rad per
//! µm of height, and n numbers the terms. With `exp(iκh) = Σ_n a_n(κ) φ_n(h/H)`, the amplitude of the diffraction
//! order j is `c_j(κ) = Σ_n a_n(κ) DFT{φ_n(h/H)}_j`. Direction and wavelength are in κ alone, so the transforms depend
//! on neither. Orders j of the tile and the sign of the DFT are those of `screen.rs`. J_n is a Bessel function. Single
//! 2014 is listed in docs/model.md#sources.
//!
//! | series | φ_n(u), u = h/H | a_n(κ) |
//! | --- | --- | --- |
//! | Chebyshev | T_n(u) = cos(n·arccos u) | (2 − δ_n0) iⁿ J_n(κH) |
//! | Taylor | uⁿ | (iκH)ⁿ/n! |

use super::screen::{CHUNK, centred_heights};
use super::{Direction, Fft2};
use crate::height_field::HeightField;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use sunbeam_fourier::Precision;
use sunbeam_fourier::num_complex::{Complex, Complex64};

/// Expansion of `exp(iκh)`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Series {
    /// Jacobi–Anger expansion `Σ (2 − δ_n0) iⁿ J_n(κH) T_n(h/H)`. Every term is at most 2 in magnitude.
    #[default]
    Chebyshev,
    /// Taylor series `Σ (iκh)ⁿ/n!` of Single 2014. Its terms grow to about `e^{κH}` before they cancel.
    Taylor,
}

/// Number N of Chebyshev terms that represent `exp(iκh)` with an absolute error of at most `tolerance`, for all |h| ≤ H
/// and κH up to `kappa_h`, which is finite; at least 1. `tolerance` is well above 1e-20.
///
/// The error is at most `2 Σ_{n≥N} |J_n(κH)|`. For n > κH the Bessel functions decrease faster than geometrically, so
/// the sum is cut where they are below 1e-20.
pub fn chebyshev_terms(kappa_h: f64, tolerance: f64) -> usize {
    // Beyond this n every J_n is below 1e-20: J_n falls over a transition of the width (κH)^⅓ around n = κH.
    let last = (kappa_h + 12.0 * (kappa_h.cbrt() + 2.0)).ceil() as usize;
    let mut error = 0.0;
    for n in (0..=last).rev() {
        error += 2.0 * libm::jn(n as i32, kappa_h).abs();
        if error > tolerance {
            return n + 1;
        }
    }
    1
}

/// Number of Taylor terms that represent `exp(iκh)` with an absolute error of at most `tolerance`, for all |h| ≤ H and
/// κH up to `kappa_h`, which is finite; at least 1. `tolerance` is positive.
///
/// Rounding is not included; see [`Series::Taylor`].
pub fn taylor_terms(kappa_h: f64, tolerance: f64) -> usize {
    // Logarithms of terms, since terms reach `e^{κH}` and could overflow.
    let (mut log_term, log_accepted) = (0.0, (0.5 * tolerance).ln());
    let mut n = 0;
    // For n > 2κH terms decrease at least by half, so the error is at most twice the first neglected term.
    while (n as f64) < 2.0 * kappa_h || log_term > log_accepted {
        n += 1;
        log_term += (kappa_h / n as f64).ln();
    }
    n.max(1)
}

/// Transforms `DFT{T_n(h/H)}` or `DFT{(h/H)ⁿ}` of one tile, one term at a time.
///
/// Powers are those of `h/H` rather than of `h`, so that they neither overflow nor vanish in single precision.
pub struct TermTransform<T: Precision> {
    /// Expansion whose terms are transformed.
    series: Series,
    /// H in µm.
    half_range_um: f64,
    /// Heights `h/H` from −1 to 1, row-major; 0 for a flat relief.
    scaled_heights: Vec<f64>,
    /// Transform over the pixels of the tile.
    fft: Fft2<T>,
}

impl<T: Precision> TermTransform<T> {
    /// Plans the transforms of `field`.
    pub fn new(field: &HeightField, series: Series) -> Self {
        let (nx, ny) = field.size();
        let (centred, half_range_um) = centred_heights(field);
        let scale = if half_range_um > 0.0 { 1.0 / half_range_um } else { 0.0 };
        let scaled_heights = centred.iter().map(|h| h * scale).collect();
        Self { series, half_range_um, scaled_heights, fft: Fft2::new(nx, ny, Direction::Positive) }
    }

    /// Half the range of heights, H, in µm.
    pub fn half_range_um(&self) -> f64 {
        self.half_range_um
    }

    /// Transform of term `n`, as means over the tile, `[jy][jx]` in FFT order.
    pub fn term(&self, n: usize) -> Vec<Complex<T>> {
        let per_pixel = 1.0 / self.scaled_heights.len() as f64;
        let basis = |u: f64| match self.series {
            Series::Taylor => u.powi(n as i32),
            // Rounding may take u beyond ±1.
            Series::Chebyshev => (n as f64 * u.clamp(-1.0, 1.0).acos()).cos(),
        };
        let value = |&u: &f64| Complex::new(cast(basis(u) * per_pixel), T::zero());
        let mut bins: Vec<_> = self.scaled_heights.par_iter().with_min_len(CHUNK).map(value).collect();
        let mut scratch = Vec::new();
        self.fft.process(&mut bins, &mut scratch);
        bins
    }
}

/// Transforms of the first terms of an expansion ([`TermTransform`]), from which `c_j(κ)` follows for any κ.
///
/// `T` is `f64`, or `f32` as in the GPU textures of Single 2014.
///
/// ```
/// use sunbeam::Preset;
/// use sunbeam::transform::{Expansion, OrderTransform, Series, chebyshev_terms};
///
/// let field = Preset::Sinusoidal.build(None, None)?;
/// // H is 0.125 µm: κ up to 25 rad/µm.
/// let terms = chebyshev_terms(25.0 * 0.125, 1e-12);
/// let expansion = Expansion::<f64>::new(&field, Series::Chebyshev, terms);
/// let exact = OrderTransform::new(&field).amplitudes(20.0);
/// assert!((expansion.amplitude(20.0, 1) - exact[1]).norm() < 1e-11);
/// # Ok::<(), sunbeam::height_field::HeightFieldError>(())
/// ```
pub struct Expansion<T: Precision> {
    /// Expansion whose terms are stored.
    series: Series,
    /// H in µm.
    half_range_um: f64,
    /// Transforms `[n][bin]` as means over the tile, bins `[jy][jx]` in FFT order.
    terms: Vec<Vec<Complex<T>>>,
}

impl<T: Precision> Expansion<T> {
    /// Computes the first `count` terms, at least one.
    pub fn new(field: &HeightField, series: Series, count: usize) -> Self {
        let transform = TermTransform::new(field, series);
        let terms = (0..count.max(1)).into_par_iter().map(|n| transform.term(n)).collect();
        Self { series, half_range_um: transform.half_range_um, terms }
    }

    /// Number of terms stored.
    pub fn len(&self) -> usize {
        self.terms.len()
    }

    /// Always false: at least one term is stored.
    pub fn is_empty(&self) -> bool {
        false
    }

    /// `c_j(κ)` at `kappa` in rad/µm of the order with the index `bin` in `[jy][jx]`, FFT order. It is summed in the
    /// precision of `T`.
    pub fn amplitude(&self, kappa: f64, bin: usize) -> Complex<T> {
        let weights = self.weights(kappa);
        self.terms.iter().zip(&weights).fold(Complex::new(T::zero(), T::zero()), |sum, (term, weight)| {
            sum + term[bin] * Complex::new(cast(weight.re), cast(weight.im))
        })
    }

    /// Coefficients `a_n(κ)` of the stored terms at `kappa` in rad/µm.
    pub fn weights(&self, kappa: f64) -> Vec<Complex64> {
        /// iⁿ for n = 0 to 3.
        const POWERS_OF_I: [Complex64; 4] =
            [Complex64::new(1.0, 0.0), Complex64::new(0.0, 1.0), Complex64::new(-1.0, 0.0), Complex64::new(0.0, -1.0)];
        let kappa_h = kappa * self.half_range_um;
        let mut power_over_factorial = 1.0;
        (0..self.len())
            .map(|n| {
                // a_n/iⁿ.
                let real = match self.series {
                    Series::Chebyshev => (if n == 0 { 1.0 } else { 2.0 }) * libm::jn(n as i32, kappa_h),
                    Series::Taylor => {
                        if n > 0 {
                            power_over_factorial *= kappa_h / n as f64;
                        }
                        power_over_factorial
                    }
                };
                POWERS_OF_I[n % 4] * real
            })
            .collect()
    }
}

/// Conversion from `f64`, rounded to the precision of `T`. Both precisions accept every number.
fn cast<T: Precision>(value: f64) -> T {
    T::from_f64(value).unwrap_or_else(T::zero)
}
