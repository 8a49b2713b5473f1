//! Expansions of the phase screen in powers or Chebyshev polynomials of the height (docs/model.md#the-two-expansions).
//!
//! `exp(iκh) = Σ_n a_n(κ) φ_n(h/H)`, so `c_j(κ) = Σ_n a_n(κ) DFT{φ_n(h/H)}_j`: the transforms depend on neither
//! direction nor wavelength. h is the height from the middle of its range and H half the range, both in µm; κ is the
//! phase rate in rad/µm and j an order of the tile (`mod.rs`).
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

/// Choice of the expansion of `exp(iκh)`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Series {
    /// Jacobi–Anger expansion `Σ (2−δ_n0) iⁿ J_n(κH) T_n(h/H)`. Every term is at most 2 in magnitude.
    #[default]
    Chebyshev,
    /// Taylor series `Σ (iκh)ⁿ/n!` of Single 2014. Its terms grow to `e^{κH}` before they cancel.
    Taylor,
}

/// Number N of Chebyshev terms whose remainder of `exp(iκh)`, |h| ≤ H, is below `tolerance` (absolute) up to `κH =
/// kappa_h`.
///
/// The remainder is at most `2 Σ_{n≥N} |J_n(κH)|`. For n > κH the Bessel functions decrease faster than geometrically.
pub fn chebyshev_terms(kappa_h: f64, tolerance: f64) -> usize {
    remainder_terms(tolerance, kappa_h, |n| 2.0 * libm::jn(n as i32, kappa_h).abs())
}

/// Number of Taylor terms whose remainder of `exp(iκh)`, |h| ≤ H, is below `tolerance` (absolute) at `κH = kappa_h`.
///
/// Rounding is not included; see [`Series::Taylor`].
pub fn taylor_terms(kappa_h: f64, tolerance: f64) -> usize {
    let mut term = 1.0;
    let mut n = 0;
    // For n > 2κH terms decrease at least by half, so the remainder is at most twice the first neglected term.
    while (n as f64) < 2.0 * kappa_h || 2.0 * term > tolerance {
        n += 1;
        term *= kappa_h / n as f64;
    }
    n.max(1)
}

/// Smallest N such that `Σ_{n≥N} term(n)` is at most `tolerance`; at least 1.
fn remainder_terms(tolerance: f64, kappa_h: f64, term: impl Fn(usize) -> f64) -> usize {
    // Beyond this n every J_n is below 1e-20 (transition region of width (κH)^⅓).
    let last = (kappa_h + 12.0 * (kappa_h.cbrt() + 2.0)).ceil() as usize;
    let mut remainder = 0.0;
    for n in (0..=last).rev() {
        remainder += term(n);
        if remainder > tolerance {
            return n + 1;
        }
    }
    1
}

/// The transforms `DFT{T_n(h/H)}` or `DFT{(h/H)ⁿ}` of one tile, one term at a time.
///
/// Powers are those of `h/H` rather than of `h`, so that terms neither overflow nor vanish in single precision.
pub struct TermTransform<T: Precision> {
    /// The expansion whose terms are transformed.
    series: Series,
    /// H in µm.
    half_range_um: f64,
    /// `h/H`, with h from the middle of the range; row-major.
    unit: Vec<f64>,
    /// The transform of the tile.
    fft: Fft2<T>,
}

impl<T: Precision> TermTransform<T> {
    /// Plans the transforms of `field`.
    pub fn new(field: &HeightField, series: Series) -> Self {
        let (nx, ny) = field.size();
        let (centred, half_range_um) = centred_heights(field);
        let scale = if half_range_um > 0.0 { 1.0 / half_range_um } else { 0.0 };
        let unit = centred.iter().map(|h| h * scale).collect();
        Self { series, half_range_um, unit, fft: Fft2::new(nx, ny, Direction::Positive) }
    }

    /// Half the range of heights, H, in µm.
    pub fn half_range_um(&self) -> f64 {
        self.half_range_um
    }

    /// Transform of term `n`, as means over the tile: row-major `[jy][jx]`, in FFT order.
    pub fn term(&self, n: usize) -> Vec<Complex<T>> {
        let mean = 1.0 / self.unit.len() as f64;
        let basis = |h: f64| match self.series {
            Series::Taylor => h.powi(n as i32),
            Series::Chebyshev => (n as f64 * h.clamp(-1.0, 1.0).acos()).cos(),
        };
        let bin = |&h: &f64| Complex::new(cast(basis(h) * mean), T::zero());
        let mut bins: Vec<_> = self.unit.par_iter().with_min_len(CHUNK).map(bin).collect();
        self.fft.process(&mut bins, &mut Vec::new());
        bins
    }
}

/// All transforms of [`TermTransform`] up to some term, from which `c_j(κ)` follows for any κ.
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
    /// The expansion.
    series: Series,
    /// H in µm.
    half_range_um: f64,
    /// `terms[n][bin]`: means over the tile, bins in FFT order.
    terms: Vec<Vec<Complex<T>>>,
}

impl<T: Precision> Expansion<T> {
    /// Computes the first `count` (at least one) terms.
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

    /// `c_j(κ)` of one bin (FFT order), `kappa` in rad/µm, summed in the precision of `T`.
    pub fn amplitude(&self, kappa: f64, bin: usize) -> Complex<T> {
        let weights = self.weights(kappa);
        self.terms.iter().zip(&weights).fold(Complex::new(T::zero(), T::zero()), |sum, (term, weight)| {
            sum + term[bin] * Complex::new(cast(weight.re), cast(weight.im))
        })
    }

    /// Coefficients a_n of the stored terms at `kappa` (rad/µm).
    pub fn weights(&self, kappa: f64) -> Vec<Complex64> {
        /// iⁿ for n = 0 to 3.
        const POWERS_OF_I: [Complex64; 4] =
            [Complex64::new(1.0, 0.0), Complex64::new(0.0, 1.0), Complex64::new(-1.0, 0.0), Complex64::new(0.0, -1.0)];
        let x = kappa * self.half_range_um;
        let mut power_over_factorial = 1.0;
        (0..self.len())
            .map(|n| {
                let magnitude = match self.series {
                    Series::Chebyshev => (if n == 0 { 1.0 } else { 2.0 }) * libm::jn(n as i32, x),
                    Series::Taylor => {
                        if n > 0 {
                            power_over_factorial *= x / n as f64;
                        }
                        power_over_factorial
                    }
                };
                POWERS_OF_I[n % 4] * magnitude
            })
            .collect()
    }
}

/// Conversion from `f64`.
fn cast<T: Precision>(value: f64) -> T {
    T::from_f64(value).unwrap_or_else(T::zero)
}
