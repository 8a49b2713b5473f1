//! Hankel and Bessel functions of kr for one wave number k, tabulated over the distance r as Chebyshev series.
//!
//! - Hankel: one series for each *panel* r ∈ [2^e, 2^{e+1}] µm, in the variable x = 2r/2^e − 3 ∈ [−1, 1]. It expands
//!   `e^{−ikr} H(kr)`, which neither oscillates nor decays exponentially.
//! - Bessel: one series over r ∈ [0, R], in the variable x = 2(r/R)² − 1, since J₀(z) and J₁(z)/z are even in z.
//!
//! Distances are in µm, wave numbers in rad/µm. Every series is for a pair of functions, of the orders 0 and 1.

use super::{chebyshev_coefficients, chebyshev_nodes};
use crate::Error;
use complex_bessel::{Scaling, besselj_seq, hankel1_seq};
use num_complex::Complex64;

/// Number of Chebyshev terms on a panel. `e^{−ikr} H(kr)` is singular at r = 0 only, which is x = −3. The remainder of
/// n terms, relative to the largest value on the panel, therefore falls as (3 + √8)^−n: here 2e-14.
const PANEL_TERMS: usize = 18;

/// Number of Chebyshev terms of the Bessel functions in addition to ⌈|kR|⌉, their largest argument. J₀ then has an
/// error of 1e-12 (`RELATIVE` of the tests) relative to its largest magnitude over the range.
const BESSEL_TERMS: usize = 14;

/// Chebyshev coefficients of `e^{−ikr} H₀⁽¹⁾(kr)` and `e^{−ikr} H₁⁽¹⁾(kr)` on one panel.
struct Panel([[Complex64; 2]; PANEL_TERMS]);

/// Hankel functions H₀⁽¹⁾, H₁⁽¹⁾ and Bessel functions J₀, J₁ of kr for one complex wave number k and many distances r.
pub(crate) struct Radial {
    /// k in rad/µm.
    wave_number: Complex64,
    /// Binary exponent e of the first panel.
    exponent_min: i32,
    /// Panels of consecutive exponents.
    panels: Vec<Panel>,
    /// Chebyshev coefficients of J₀(kr) and J₁(kr)/(kr) over r² in [0, `bessel_range`²].
    bessel: Vec<[Complex64; 2]>,
    /// Largest distance R of the Bessel functions in µm.
    bessel_range: f64,
}

impl Radial {
    /// Tables for distances from `r_min` > 0 to `r_max` (Hankel) and from 0 to `bessel_range` > 0 (Bessel), in µm.
    ///
    /// # Errors
    /// Functions that overflow.
    pub(crate) fn new(wave_number: Complex64, r_min: f64, r_max: f64, bessel_range: f64) -> Result<Self, Error> {
        let (exponent_min, exponent_max) = (binary_exponent(r_min), binary_exponent(r_max));
        let panels = (exponent_min..=exponent_max).map(|e| panel(wave_number, e)).collect::<Result<Vec<_>, _>>()?;
        let terms = BESSEL_TERMS + (wave_number.norm() * bessel_range).ceil() as usize;
        let mut values = Vec::with_capacity(terms);
        for x in chebyshev_nodes(terms) {
            // kr at the distance r = R·√((1 + x)/2).
            let z = wave_number * bessel_range * (0.5 * (1.0 + x)).sqrt();
            let j = besselj_seq(0.0, z, 2, Scaling::Unscaled).map_err(|_| OVERFLOW)?.values;
            // z is never 0, since Chebyshev nodes exclude −1.
            values.push([j[0], j[1] / z]);
        }
        Ok(Self { wave_number, exponent_min, panels, bessel: pair_coefficients(&values), bessel_range })
    }

    /// `[H₀⁽¹⁾(kr), H₁⁽¹⁾(kr)]` for r (µm) in the range of the table. Outside of it the nearest panel is extrapolated.
    pub(crate) fn hankel(&self, r: f64) -> [Complex64; 2] {
        let last = self.panels.len() - 1;
        let index = usize::try_from(binary_exponent(r) - self.exponent_min).unwrap_or(0).min(last);
        // 2^−e of the panel, for x = 2r/2^e − 3.
        let scale = two_to(-(self.exponent_min + index as i32));
        let phase = (Complex64::I * self.wave_number * r).exp();
        clenshaw(&self.panels[index].0, 2.0 * r * scale - 3.0).map(|value| value * phase)
    }

    /// `[J₀(kr), J₁(kr)/(kr)]` for r (µm) from 0 to `bessel_range`.
    pub(crate) fn bessel(&self, r: f64) -> [Complex64; 2] {
        let fraction = r / self.bessel_range;
        clenshaw(&self.bessel, 2.0 * fraction * fraction - 1.0)
    }
}

/// Error of the Bessel and Hankel routines. Bessel functions overflow where Im kr is too large, scaled Hankel functions
/// where |kr| is too small or too large.
const OVERFLOW: Error = Error::NotFinite { what: "a Bessel or Hankel function" };

/// Tabulates the Hankel functions on [2^exponent, 2^{exponent+1}].
///
/// # Errors
/// Functions that overflow.
fn panel(wave_number: Complex64, exponent: i32) -> Result<Panel, Error> {
    let mut values = Vec::with_capacity(PANEL_TERMS);
    for x in chebyshev_nodes(PANEL_TERMS) {
        // kr at the distance r = 2^e·(x + 3)/2.
        let z = wave_number * (0.5 * (x + 3.0) * two_to(exponent));
        // This scaling multiplies by e^{−iz}.
        let h = hankel1_seq(0.0, z, 2, Scaling::Exponential).map_err(|_| OVERFLOW)?.values;
        values.push([h[0], h[1]]);
    }
    let mut coefficients = [[Complex64::ZERO; 2]; PANEL_TERMS];
    coefficients.copy_from_slice(&pair_coefficients(&values));
    Ok(Panel(coefficients))
}

/// Chebyshev coefficients of a pair of functions from their values at the nodes.
fn pair_coefficients(values: &[[Complex64; 2]]) -> Vec<[Complex64; 2]> {
    let series = |i: usize| chebyshev_coefficients(&values.iter().map(|pair| pair[i]).collect::<Vec<_>>());
    series(0).into_iter().zip(series(1)).map(|(a, b)| [a, b]).collect()
}

/// Sums of a pair of Chebyshev series of at least two terms at x.
///
/// Clenshaw's recurrence runs separately over even and odd terms, so that the processor can overlap both. With
/// y = T₂(x), `T_{n+2} = 2y·T_n − T_{n−2}`, so either half obeys `b_n = c_n + 2y·b_{n+2} − b_{n+4}`. The sums are
/// `c₀ + y·b₂ − b₄` (even) and `c₁·x + T₃(x)·b₃ − x·b₅` (odd).
// Inlining slows the callers by up to a tenth.
#[inline(never)]
fn clenshaw(coefficients: &[[Complex64; 2]], x: f64) -> [Complex64; 2] {
    let y = 2.0 * x * x - 1.0;
    // b_{n+2} and b_{n+4}: `[even or odd terms][n + 2 or n + 4][function]`.
    let mut recurrence = [[[Complex64::ZERO; 2]; 2]; 2];
    // If the number of terms is odd, the last chunk has an even term alone.
    for even_and_odd in coefficients[2..].chunks(2).rev() {
        for ([b_plus_2, b_plus_4], c) in recurrence.iter_mut().zip(even_and_odd) {
            let b = [0, 1].map(|i| c[i] + b_plus_2[i] * (2.0 * y) - b_plus_4[i]);
            *b_plus_4 = std::mem::replace(b_plus_2, b);
        }
    }
    // T₃(x) = (2y − 1)·x.
    let t3_over_x = 2.0 * y - 1.0;
    [0, 1].map(|i| {
        let [[b2, b4], [b3, b5]] = recurrence.map(|values| values.map(|pair| pair[i]));
        let odd_over_x = coefficients[1][i] - b5 + b3 * t3_over_x;
        coefficients[0][i] - b4 + b2 * y + odd_over_x * x
    })
}

/// Binary exponent e with 2^e ≤ x < 2^{e+1}, for positive normal x: the exponent bits of the IEEE 754 format.
fn binary_exponent(x: f64) -> i32 {
    ((x.to_bits() >> 52) & 0x7ff) as i32 - 1023
}

/// 2^exponent, exactly, for exponents from −1022 to 1023: the exponent bits of the IEEE 754 format.
fn two_to(exponent: i32) -> f64 {
    f64::from_bits(((exponent + 1023) as u64) << 52)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Bound on the truncation of the Chebyshev series and the error of Amos' routines (`complex_bessel`).
    const RELATIVE: f64 = 1e-12;

    #[test]
    fn tables_match_the_functions_between_nodes() {
        for k in [Complex64::new(12.0, 0.0), Complex64::new(10.0, 76.0), Complex64::new(1.4, 1.9)] {
            let table = Radial::new(k, 1e-9, 3.0, 0.4).unwrap();
            for i in 0..400 {
                let r = 1e-9 * f64::powf(3e9, f64::from(i) / 400.0);
                let exact = hankel1_seq(0.0, k * r, 2, Scaling::Unscaled).unwrap().values;
                for (a, b) in table.hankel(r).iter().zip(&exact) {
                    assert!((a - b).norm() <= RELATIVE * b.norm(), "H({k} · {r}): {a}, not {b}");
                }
                let r = 0.4 * f64::from(i + 1) / 401.0;
                let j = besselj_seq(0.0, k * r, 2, Scaling::Unscaled).unwrap().values;
                // About the largest magnitude over the range of the series. J₁(kr) is |kr| ≤ 31 times the tabulated
                // function, hence the factor 50 on its bound.
                let scale = (k.im * 0.4).exp();
                let [j0, j1_over] = table.bessel(r);
                assert!(
                    (j0 - j[0]).norm() < RELATIVE * scale && (j1_over * k * r - j[1]).norm() < RELATIVE * scale * 50.0
                );
            }
        }
    }
}
