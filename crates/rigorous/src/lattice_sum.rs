//! Lattice sum F: the quasi-periodic Green's function, the field of line sources one period apart, without one source.
//!
//! `F(x, z) = Σ_{p≠0} e^{2πibp} (i/4) H₀⁽¹⁾(k·|(x − pd, z)|)`
//!
//! Without the source p = 0, F is smooth in the box |x| ≤ d/2, |z| ≤ h. The box holds all vectors between two points
//! of a relief of height h, up to multiples of the period along x.
//!
//! | symbol | meaning |
//! | --- | --- |
//! | x, z | vector from the source p = 0 to the field point, in µm |
//! | d | period in µm |
//! | b | Bloch phase in turns: each source has e^{2πib} times the amplitude of the one before |
//! | h | height of the relief in µm, the half height of the box |
//! | k | wave number in the medium across the grooves, in rad/µm; complex where the medium absorbs |
//! | E | wave number at which Ewald's method splits the sum (`split`), in rad/µm |
//! | α, γ | of order n: wave number 2π(b + n)/d along x, and decay rate √(α² − k²) along \|z\| |
//! | R_p | distance from source p to the field point |
//! | T_n | Chebyshev polynomial of degree n |
//!
//! The sum converges too slowly to be added directly. Ewald's method splits it into two sums that converge as
//! Gaussians: one over the diffraction orders, one over the periods (Capolino, Wilton & Johnson, IEEE Trans. Antennas
//! Propag. 53, 2005):
//!
//! `F = Σ_n order_term + Σ_p period_term − (i/4) H₀⁽¹⁾(k·R_0)`, p = 0 included.
//!
//! [`Ewald::order_term`] and [`Ewald::sum_over_periods`] have the formulas of the terms. [`Ewald`] evaluates F on a
//! grid of Chebyshev nodes; [`LatticeSum`] interpolates by polynomials.

use crate::Error;
use crate::special::{Radial, chebyshev_coefficients, chebyshev_nodes, expint_1, faddeeva};
use ndarray::linalg::general_mat_mul;
use ndarray::{Array1, Array2, ArrayView2, Axis, ShapeBuilder, Zip, s};
use num_complex::Complex64;
use std::f64::consts::{LN_2, PI, TAU};

/// Exponent beyond which terms of Ewald's sums are neglected: e^−`EXPONENT_MAX` is 2⁻⁵², the rounding of double
/// precision.
const EXPONENT_MAX: f64 = 52.0 * LN_2;
/// Largest |k|/2E. Both sums grow as e^{(|k|/2E)²} before they cancel. At this value the growth is a factor of 21,
/// which costs about one decimal digit; smaller values need more orders.
const SPLIT_MAX: f64 = 1.75;
/// Largest accepted ratio of the last Chebyshev coefficients to the largest one. It is far below the error of the
/// quadrature; smaller values need more terms.
const TAIL_MAX: f64 = 1e-9;
/// Largest number of Chebyshev terms along each axis. It bounds time and memory; `limits.rs` derives the largest period
/// and height from it.
const TERMS_MAX: usize = 400;
/// Smallest half height of the box in periods, so that the box of a flat relief is not empty.
pub(crate) const HALF_HEIGHT_MIN: f64 = 1e-3;
/// Lower bound on the distance, in periods, between source p = 0 and the points at which F is computed. The lowest of n
/// Chebyshev nodes along z lies at sin(π/2n) half heights, which is at least 1/n.
pub(crate) const DISTANCE_MIN: f64 = HALF_HEIGHT_MIN / TERMS_MAX as f64;

/// F and its gradient as polynomials over the box |x| ≤ d/2, |z| ≤ h.
pub(crate) struct LatticeSum {
    /// Half width of the box along x, in µm.
    half_x: f64,
    /// Half height of the box along z, in µm.
    half_z: f64,
    /// Number of polynomials T_n(x/half_x), n from 0 on.
    terms_x: usize,
    /// Number of polynomials T_2m(z/half_z), m from 0 on; F is even in z.
    terms_z: usize,
    /// Row n, column `part · terms_z + m`: coefficient of T_n(x/half_x)·T_2m(z/half_z). The parts 0 to 3 are Re F, Im
    /// F, Re ∂F/∂x and Im ∂F/∂x. Arrays of this file are in column-major order (`.f()`), since whole columns are added.
    coefficients: Array2<f64>,
}

/// F, ∂F/∂x and ∂F/∂z; the derivatives are in 1/µm.
pub(crate) type FieldAndGradient = [Complex64; 3];

impl LatticeSum {
    /// Computes the polynomials for the period d (µm), wave number k (rad/µm), Bloch phase b (turns) and height h of
    /// the relief (µm).
    ///
    /// `radial` tabulates the Hankel functions H₀⁽¹⁾(kr) and H₁⁽¹⁾(kr) for distances r up to the corners of the box.
    ///
    /// # Errors
    /// [`Error::NotFinite`] for sums that are not finite, or that [`TERMS_MAX`] terms along an axis do not resolve.
    pub(crate) fn new(
        period: f64,
        wave_number: Complex64,
        bloch: f64,
        height: f64,
        radial: &Radial,
    ) -> Result<Self, Error> {
        let (half_x, half_z) = (0.5 * period, height.max(HALF_HEIGHT_MIN * period));
        let ewald = Ewald::new(period, wave_number, bloch);
        // Numbers of Chebyshev nodes along each axis; both grow until the last coefficients are small. `phases` are
        // bounds of the phase's change over half of each axis (`nodes_needed`).
        //
        // Along x, the nearest singularity is the source at ±d, two half axes from the middle: cosh θ = 2. Along z, at
        // x = d/2, the field of the source at d has the phase k√(z² + d²/4). Its slope is largest at z = h; times the
        // half axis h it is kh²/√(h² + d²/4). The field is singular at z = ±id/2: sinh θ = d/2h.
        //
        // The number along z is even, so that no node has z = 0, where source p = 0 may be singular.
        let phases = [half_x, half_z * half_z / half_z.hypot(half_x)].map(|length| wave_number.norm() * length);
        let mut nodes_x = nodes_needed(phases[0], 2_f64.acosh());
        let mut nodes_z = nodes_needed(phases[1], (half_x / half_z).asinh()).next_multiple_of(2);
        loop {
            let values = ewald.on_grid(half_x, half_z, nodes_x, nodes_z, radial);
            if values.iter().flatten().any(|value| !value.is_finite()) {
                return Err(Error::NotFinite { what: "the sum over the periods" });
            }
            let series = transform(&values);
            let (tail_x, tail_z) = tails(&series);
            if tail_x <= TAIL_MAX && tail_z <= TAIL_MAX {
                return Ok(Self::from_series(half_x, half_z, &series));
            }
            // A quarter more nodes along each axis that is not resolved.
            let grown = |nodes: usize, tail: f64| {
                if tail > TAIL_MAX { (nodes + nodes.div_ceil(4)).min(TERMS_MAX) } else { nodes }
            };
            let before = (nodes_x, nodes_z);
            (nodes_x, nodes_z) = (grown(nodes_x, tail_x), grown(nodes_z, tail_z).next_multiple_of(2));
            if before == (nodes_x, nodes_z) {
                return Err(Error::NotFinite { what: "the polynomial for the sum over the periods" });
            }
        }
    }

    /// Arranges the coefficients `series[n][m]` of F in T_n(x/half_x)·T_2m(z/half_z), and derives those of ∂F/∂x.
    fn from_series(half_x: f64, half_z: f64, series: &[Vec<Complex64>]) -> Self {
        let (terms_x, terms_z) = (series.len(), series[0].len());
        // T_n' = 2n(T_{n−1} + T_{n−3} + …), with half of T₀. The derivative of Σ c_n T_n therefore has the coefficients
        // c'_n = c'_{n+2} + 2(n + 1)c_{n+1}, with half of c'₀.
        let mut derivative = vec![vec![Complex64::ZERO; terms_z]; terms_x];
        for n in (0..terms_x - 1).rev() {
            for m in 0..terms_z {
                let above = if n + 2 < terms_x { derivative[n + 2][m] } else { Complex64::ZERO };
                derivative[n][m] = above + series[n + 1][m] * (2.0 * (n + 1) as f64);
            }
        }
        for value in &mut derivative[0] {
            *value *= 0.5;
        }
        let coefficients = Array2::from_shape_fn((terms_x, 4 * terms_z).f(), |(n, column)| {
            let (part, m) = (column / terms_z, column % terms_z);
            let value = if part < 2 { series[n][m] } else { derivative[n][m] / half_x };
            if part % 2 == 0 { value.re } else { value.im }
        });
        Self { half_x, half_z, terms_x, terms_z, coefficients }
    }

    /// F and its gradient at points (x[i], z[i]) of the box.
    ///
    /// One matrix product sums over the polynomials in x. For ∂F/∂z the polynomials in z are replaced by their
    /// derivatives.
    pub(crate) fn at(&self, x: &[f64], z: &[f64]) -> Vec<FieldAndGradient> {
        let (count, terms_z) = (x.len(), self.terms_z);
        // Point × polynomial.
        let in_x = polynomials(x, self.half_x, self.terms_x);
        let in_z = polynomials(z, self.half_z, 2 * terms_z);
        let even = in_z.slice(s![.., ..;2]);
        let slopes = slopes_of_even(&in_z, self.half_z);
        // Sums over n, arranged as the columns of `coefficients`.
        let mut sums = Array2::zeros((count, 4 * terms_z).f());
        general_mat_mul(1.0, &in_x, &self.coefficients, 0.0, &mut sums);
        // Sum over m for one of the four parts of `coefficients`, with the factor of each m.
        let over_z = |part: usize, factors: ArrayView2<'_, f64>| {
            let mut result = Array1::zeros(count);
            for (m, factor) in factors.columns().into_iter().enumerate() {
                let sum = sums.column(part * terms_z + m);
                Zip::from(&mut result).and(factor).and(sum).for_each(|result, factor, sum| *result += factor * sum);
            }
            result
        };
        // Real and imaginary part of F, ∂F/∂x and ∂F/∂z.
        let [re, im, re_x, im_x] = [0, 1, 2, 3].map(|part| over_z(part, even));
        let [re_z, im_z] = [0, 1].map(|part| over_z(part, slopes.view()));
        (0..count)
            .map(|i| [(&re, &im), (&re_x, &im_x), (&re_z, &im_z)].map(|(re, im)| Complex64::new(re[i], im[i])))
            .collect()
    }
}

/// Number of Chebyshev nodes along an axis of the box with which the last two coefficients are about [`TAIL_MAX`].
///
/// `phase` bounds the change of F's phase over half the axis, in radians. Lengths are in half axes. The bound comes
/// from Bernstein ellipses, which have the foci ±1 in the complex plane. On the ellipse with the semi-axes cosh θ and
/// sinh θ, F is at most e^{phase·sinh θ}, so coefficient n is at most e^{phase·sinh θ − nθ}. θ is at most `singular`,
/// that of the ellipse through the nearest singularity. The θ with the fewest nodes satisfies
/// `phase·(θ cosh θ − sinh θ) = −ln TAIL_MAX`, whose left side is about phase·θ³/3.
fn nodes_needed(phase: f64, singular: f64) -> usize {
    let exponent = -TAIL_MAX.ln();
    let theta = (3.0 * exponent / phase).cbrt().min(singular);
    let degree = (exponent + phase * theta.sinh()) / theta;
    (degree.ceil() + 2.0).min(TERMS_MAX as f64) as usize
}

/// Derivatives with respect to z of the even polynomials T_2m(z/half), point × m, in 1/µm. `in_z` holds T_n(z/half) for
/// all degrees n: point × n.
fn slopes_of_even(in_z: &Array2<f64>, half: f64) -> Array2<f64> {
    let mut slopes = Array2::zeros((in_z.nrows(), in_z.ncols() / 2).f());
    let mut odd_sum = Array1::<f64>::zeros(in_z.nrows());
    for (m, mut slope) in slopes.columns_mut().into_iter().enumerate().skip(1) {
        // T_2m' = 4m(T_{2m−1} + T_{2m−3} + … + T₁).
        odd_sum += &in_z.column(2 * m - 1);
        let factor = 4.0 * m as f64 / half;
        slope.zip_mut_with(&odd_sum, |slope, sum| *slope = factor * sum);
    }
    slopes
}

/// T_0 to T_{count−1} (columns) at `points/half` (rows); `count` is at least 2.
fn polynomials(points: &[f64], half: f64, count: usize) -> Array2<f64> {
    let mut columns = Array2::zeros((points.len(), count).f());
    columns.column_mut(0).fill(1.0);
    for (value, p) in columns.column_mut(1).iter_mut().zip(points) {
        *value = p / half;
    }
    // T_n(x) = 2x·T_{n−1}(x) − T_{n−2}(x).
    let doubled: Vec<f64> = points.iter().map(|p| 2.0 * p / half).collect();
    for n in 2..count {
        let (before, mut rest) = columns.view_mut().split_at(Axis(1), n);
        Zip::from(rest.column_mut(0))
            .and(&doubled)
            .and(before.column(n - 2))
            .and(before.column(n - 1))
            .for_each(|into, doubled, two_back, one_back| *into = doubled * one_back - two_back);
    }
    columns
}

/// Chebyshev coefficients `[n][m]` of T_n·T_2m from `values[ix][iz]`, with z at the positive nodes only.
fn transform(values: &[Vec<Complex64>]) -> Vec<Vec<Complex64>> {
    // F is even in z: values at the negative nodes are those at the positive ones in reverse, and odd coefficients
    // vanish.
    let in_z: Vec<Vec<Complex64>> = values
        .iter()
        .map(|row| {
            let both: Vec<Complex64> = row.iter().chain(row.iter().rev()).copied().collect();
            chebyshev_coefficients(&both).into_iter().step_by(2).collect()
        })
        .collect();
    let mut series = vec![vec![Complex64::ZERO; in_z[0].len()]; in_z.len()];
    for m in 0..in_z[0].len() {
        let column: Vec<Complex64> = in_z.iter().map(|row| row[m]).collect();
        for (n, c) in chebyshev_coefficients(&column).into_iter().enumerate() {
            series[n][m] = c;
        }
    }
    series
}

/// Largest magnitudes of the last two coefficients in x, and of the last one in z, relative to the largest coefficient.
///
/// Two are needed in x, because every other one vanishes where F is even or odd in x. `series` has at least two rows,
/// since `nodes_needed` returns more than two.
fn tails(series: &[Vec<Complex64>]) -> (f64, f64) {
    let largest = |values: &mut dyn Iterator<Item = &Complex64>| values.map(|c| c.norm()).fold(0.0, f64::max);
    let all = largest(&mut series.iter().flatten()).max(f64::MIN_POSITIVE);
    let in_x = largest(&mut series[series.len() - 2..].iter().flatten());
    let in_z = largest(&mut series.iter().filter_map(|row| row.last()));
    (in_x / all, in_z / all)
}

/// Ewald's sums over the orders and over the periods; the symbols are those of the module.
struct Ewald {
    /// d in µm.
    period: f64,
    /// b in turns.
    bloch: f64,
    /// E in rad/µm.
    split: f64,
    /// (α, γ) of each order in rad/µm; its field varies as e^{iαx − γ|z|}.
    orders: Vec<(f64, Complex64)>,
    /// `(k/2E)^{2q}/q!`, q from 0 on.
    weights: Vec<Complex64>,
}

impl Ewald {
    /// Sets E, and lists the orders whose terms exceed e^−[`EXPONENT_MAX`] and the weights down to rounding.
    ///
    /// E = √π/d balances both sums; where |k|/2E would exceed [`SPLIT_MAX`], E is larger.
    fn new(period: f64, wave_number: Complex64, bloch: f64) -> Self {
        let split = (PI.sqrt() / period).max(0.5 * wave_number.norm() / SPLIT_MAX);
        // Terms of orders fall as |e^{−γ²/4E²}|, so α² reaches up to Re(k)² + 4E²·EXPONENT_MAX. `reach` is α·d/2π.
        let reach = (wave_number.re.powi(2) + 4.0 * split * split * EXPONENT_MAX).sqrt() * period / TAU;
        let orders = ((-reach - bloch).floor() as i64..=(reach - bloch).ceil() as i64)
            .map(|n| {
                let alpha = TAU * (bloch + n as f64) / period;
                (alpha, decay(alpha, wave_number))
            })
            .collect();
        let ratio = wave_number * wave_number / (4.0 * split * split);
        let mut weights = vec![Complex64::ONE];
        while weights[weights.len() - 1].norm() > f64::EPSILON {
            weights.push(weights[weights.len() - 1] * ratio / weights.len() as f64);
        }
        Self { period, bloch, split, orders, weights }
    }

    /// F at the Chebyshev nodes of the box, `[ix][iz]`: at `nodes_x` nodes along x, and at the positive half of
    /// `nodes_z` nodes along z.
    ///
    /// F is the sum over orders, plus the sum over periods, minus the source p = 0. `radial` has the Hankel functions
    /// of this source.
    fn on_grid(
        &self,
        half_x: f64,
        half_z: f64,
        nodes_x: usize,
        nodes_z: usize,
        radial: &Radial,
    ) -> Vec<Vec<Complex64>> {
        let xs: Vec<f64> = chebyshev_nodes(nodes_x).iter().map(|x| x * half_x).collect();
        // Nodes are in descending order.
        let zs: Vec<f64> = chebyshev_nodes(nodes_z)[..nodes_z / 2].iter().map(|z| z * half_z).collect();
        // Terms without their phase along x: `[order][iz]`.
        let order_terms: Vec<Vec<Complex64>> =
            self.orders.iter().map(|&(_, gamma)| zs.iter().map(|&z| self.order_term(gamma, z)).collect()).collect();
        xs.iter()
            .map(|&x| {
                let phases: Vec<Complex64> = self.orders.iter().map(|&(alpha, _)| Complex64::cis(alpha * x)).collect();
                zs.iter()
                    .enumerate()
                    .map(|(iz, &z)| {
                        let over_orders: Complex64 =
                            phases.iter().zip(&order_terms).map(|(phase, terms)| phase * terms[iz]).sum();
                        let [h0, _] = radial.hankel(x.hypot(z));
                        over_orders + self.sum_over_periods(x, z) - Complex64::new(0.0, 0.25) * h0
                    })
                    .collect()
            })
            .collect()
    }

    /// Term of one order in the sum over orders at z > 0, without its phase e^{iαx}:
    /// `[e^{γz} erfc(γ/2E + zE) + e^{−γz} erfc(γ/2E − zE)]/(4dγ)`, with `erfc(a) = e^{−a²} w(ia)` (w: `faddeeva.rs`).
    fn order_term(&self, gamma: Complex64, z: f64) -> Complex64 {
        // u = γ/2E and s = zE, so γz = 2us: both products of exponentials are e^{−u² − s²}.
        let (u, s) = (gamma / (2.0 * self.split), z * self.split);
        let scale = (-u * u - s * s).exp();
        let above = scale * faddeeva(Complex64::I * (u + s));
        // For an argument of erfc with negative real part, w could overflow before it is scaled. There the identity
        // erfc(−a) = 2 − erfc(a) is used.
        let below = if u.re >= s {
            scale * faddeeva(Complex64::I * (u - s))
        } else {
            2.0 * (-gamma * z).exp() - scale * faddeeva(Complex64::I * (s - u))
        };
        (above + below) / (4.0 * self.period * gamma)
    }

    /// Sum over periods, including p = 0: `Σ_p e^{2πibp}/4π · Σ_q (k/2E)^{2q}/q! · E_{q+1}(R_p²E²)`, with the
    /// exponential integrals E_1, E_2, …; E without an index is the wave number. R_p > 0 for all p. Periods with R_p²E²
    /// above [`EXPONENT_MAX`] are neglected.
    fn sum_over_periods(&self, x: f64, z: f64) -> Complex64 {
        let reach = EXPONENT_MAX.sqrt() / self.split;
        let (first, last) = (((x - reach) / self.period).ceil() as i64, ((x + reach) / self.period).floor() as i64);
        let mut sum = Complex64::ZERO;
        for p in first..=last {
            // R_p²E².
            let square = ((x - p as f64 * self.period).powi(2) + z * z) * self.split * self.split;
            let exponential = (-square).exp();
            // Recurrence from E_1 on: E_{q+2}(t) = (e^{−t} − t·E_{q+1}(t))/(q + 1), with t = R_p²E².
            let mut integral = expint_1(square);
            let mut series = Complex64::ZERO;
            for (q, weight) in self.weights.iter().enumerate() {
                series += weight * integral;
                integral = (exponential - square * integral) / (q + 1) as f64;
            }
            // Whole turns are dropped before the phase is rounded.
            sum += Complex64::cis(TAU * (self.bloch * p as f64).fract()) * series;
        }
        sum / (4.0 * PI)
    }
}

/// γ = √(α² − k²) of an order: with a positive real part, or −iβ (β > 0) for an order that propagates undamped.
///
/// At the cut-off of the order, γ = 0, the sum has a pole. The rounding error of γ² is about ε|k|². Where |γ|² is
/// smaller, the result is γ of a propagating order with |γ|² = ε|k|².
fn decay(alpha: f64, wave_number: Complex64) -> Complex64 {
    let square = alpha * alpha - wave_number * wave_number;
    let root = square.sqrt();
    // With loss, Im γ² < 0 and the principal root is the outgoing one. Without loss γ² lies on the branch cut, and the
    // outgoing root is the limit from Im γ² < 0.
    let gamma = if square.im == 0.0 && square.re < 0.0 { Complex64::new(0.0, -(-square.re).sqrt()) } else { root };
    let least = f64::EPSILON.sqrt() * wave_number.norm();
    if gamma.norm() < least { Complex64::new(0.0, -least) } else { gamma }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::limits::{HEIGHT_WAVES_MAX, PERIOD_WAVES_MAX};

    fn lattice_sum(period: f64, k: Complex64, bloch: f64, height: f64) -> LatticeSum {
        // Hankel functions from 1e-6 µm to beyond the corners of the box. The Bessel functions are not used.
        let radial = Radial::new(k, 1e-6, 2.0 * (period + height), 0.1).unwrap();
        LatticeSum::new(period, k, bloch, height, &radial).unwrap()
    }

    /// The reference: in a medium with loss the sum over periods converges directly.
    #[test]
    fn matches_the_direct_sum_over_periods() {
        let (period, k, bloch) = (1.3, Complex64::new(9.0, 0.8), 0.37);
        let sum = lattice_sum(period, k, bloch, 0.5);
        let (xs, zs) = ([0.0, 0.3, -0.64, 0.11], [0.0, -0.5, 0.21, 0.4]);
        for ((x, z), [field, along_x, along_z]) in xs.iter().zip(zs).zip(sum.at(&xs, &zs)) {
            let mut direct = [Complex64::ZERO; 3];
            for p in (-60..=60).filter(|&p| p != 0) {
                let (dx, phase) = (x - f64::from(p) * period, Complex64::cis(TAU * bloch * f64::from(p)));
                let r = dx.hypot(z);
                let hankel =
                    complex_bessel::hankel1_seq(0.0, k * r, 2, complex_bessel::Scaling::Unscaled).unwrap().values;
                let quarter = Complex64::new(0.0, 0.25) * phase;
                direct[0] += quarter * hankel[0];
                direct[1] -= quarter * k * hankel[1] * dx / r;
                direct[2] -= quarter * k * hankel[1] * z / r;
            }
            // Truncation of the polynomials, and of their derivatives.
            assert!((field - direct[0]).norm() < 1e-8, "{field} {}", direct[0]);
            assert!((along_x - direct[1]).norm() < 1e-6 && (along_z - direct[2]).norm() < 1e-6);
        }
    }

    /// The reference: above all sources the field is the sum of the orders alone.
    #[test]
    fn matches_the_sum_over_orders() {
        let (period, k, bloch) = (1.0, Complex64::new(TAU * 2.3, 0.0), -0.2);
        let sum = lattice_sum(period, k, bloch, 1.0);
        let (x, z) = (0.23, 0.9);
        let orders: Complex64 = (-30..=30)
            .map(|n| {
                let alpha = TAU * (bloch + f64::from(n)) / period;
                let gamma = decay(alpha, k);
                (Complex64::new(0.0, alpha * x) - gamma * z).exp() / (2.0 * period * gamma)
            })
            .sum();
        let r = f64::hypot(x, z);
        let near = Complex64::new(0.0, 0.25) * complex_bessel::hankel1(0.0, k * r).unwrap();
        let [field, ..] = sum.at(&[x], &[z])[0];
        // Truncation of the polynomials.
        assert!((field + near - orders).norm() < 1e-8, "{} {orders}", field + near);
    }

    /// [`TERMS_MAX`] terms suffice at the limits of [`limits`](crate::limits), and do not at 1.2 times the limits.
    #[test]
    fn polynomials_serve_the_documented_limits() {
        let sum = |waves: f64, bloch: f64, height_waves: f64| {
            // The period is 1; `waves` and `height_waves` are the period and the height in wavelengths.
            let k = Complex64::new(TAU * waves, 0.0);
            let height = height_waves / waves;
            // Hankel functions to 1 % beyond the corners of the box.
            let radial = Radial::new(k, 1e-6, 1.01 * 0.5_f64.hypot(height.max(HALF_HEIGHT_MIN)), 0.1).unwrap();
            LatticeSum::new(1.0, k, bloch, height, &radial).map(|_| ())
        };
        for bloch in [0.0, 0.13, 0.5] {
            // A table over directions extends one wavelength further.
            assert_eq!(sum(PERIOD_WAVES_MAX + 1.0, bloch, 0.1), Ok(()), "{bloch}");
            // No relief is higher than twice its period.
            assert_eq!(sum(0.5 * HEIGHT_WAVES_MAX, bloch, HEIGHT_WAVES_MAX), Ok(()), "{bloch}");
        }
        assert!(sum(1.2 * PERIOD_WAVES_MAX, 0.13, 0.1).is_err());
        assert!(sum(0.6 * HEIGHT_WAVES_MAX, 0.13, 1.2 * HEIGHT_WAVES_MAX).is_err());
    }
}
