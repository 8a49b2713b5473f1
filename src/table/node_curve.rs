//! Evaluation of the records of a [`SpectralTable`]: at one κ in double precision, and at several κ side by side.
//!
//! A record holds one node's power P(κ) or complex amplitude D(κ) over the phase rate κ in rad/µm. It is a header of
//! [`HEADER`] floats, P(0) and P'(0) or the real and imaginary part of D(0), followed by the coefficients of a cubic
//! B-spline Q(κ). Those of an amplitude are pairs of real and imaginary part. With κ₀ > 0 ([`SpectralTable`]),
//!
//! ```text
//! P(κ) = (κ₀²·(P(0) + κ·P'(0)) + κ²·Q(κ)) / (κ² + κ₀²)
//! D(κ) = D(0) + Q(κ)·κ/(κ + iκ₀)
//! ```

use super::spectral::{HEADER, NodeQuantity, SpectralTable};
use crate::numeric::math::cubic_b_spline_weights;
use crate::numeric::{Number, Real, VALUES_MAX, Values};
use sunbeam_fourier::num_complex::Complex64;

/// Weights at one κ of the numbers in a record of a [`SpectralTable`]; the same for every node.
///
/// ```
/// use sunbeam::table::{self, CoherenceWindow, Model, NodeCurve, Progress, Spectrum, Tiling};
/// use sunbeam::Preset;
///
/// let field = Preset::Blazed.build(None, None)?;
/// let window = CoherenceWindow::new(20.0);
/// let spectrum = Spectrum::new(&field, Model::Ensemble, Tiling::Periodic, window, 1e-3);
/// let table = table::build(&spectrum, 1e-3, &Progress::none())?.table;
///
/// // Powers of the orders at κ = 10 rad/µm sum to the incident power, 1.
/// let curve = NodeCurve::new(&table, 10.0);
/// let power: f64 = table.kept_nodes().iter().map(|(_, _, record)| curve.power(record)).sum();
/// assert!((power - 1.0).abs() < 0.05);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub struct NodeCurve {
    /// Index of the first of the four coefficients read.
    first: usize,
    /// Weights of the four coefficients.
    weights: [f64; 4],
    /// Factor on the spline: `κ²/(κ² + κ₀²)` for powers, `κ/(κ + iκ₀)` for amplitudes.
    spline_factor: Complex64,
    /// Factors on a power's header: `κ₀²/(κ² + κ₀²)` on `P(0)` and `κκ₀²/(κ² + κ₀²)` on `P'(0)`. `D(0)`, an
    /// amplitude's header, has the factor 1.
    header_factors: [f64; HEADER],
}

impl NodeCurve {
    /// Prepares evaluations at `kappa` in rad/µm, clamped to the table's range.
    // Inlined, since it is faster to build the array in place than to move it.
    #[inline]
    pub fn new(table: &SpectralTable, kappa: f64) -> Self {
        let kappa = kappa.clamp(0.0, table.kappa_max);
        // Position in knots.
        let t = kappa / table.kappa_step;
        let first = t as usize;
        // Factors on P(0), P'(0) and Q of a power.
        let [zero, slope, spline] = power_factors(kappa, table.kappa_knee);
        let spline_factor = match table.quantity {
            NodeQuantity::Power => Complex64::new(spline, 0.0),
            // κ/(κ + iκ₀) = (κ² − iκκ₀)/(κ² + κ₀²), where `slope` is κκ₀²/(κ² + κ₀²).
            NodeQuantity::Amplitude => Complex64::new(spline, -slope / table.kappa_knee),
        };
        // κ lies between the knots `first` and `first + 1`. Coefficient i belongs to the knot i − 1, so the four
        // around κ are those from `first` on.
        let weights = cubic_b_spline_weights(t - first as f64);
        Self { first, weights, spline_factor, header_factors: [zero, slope] }
    }

    /// Index of the first of the four coefficients read, and their weights.
    pub(crate) fn coefficients(&self) -> (usize, [f64; 4]) {
        (self.first, self.weights)
    }

    /// Factors on a power's header, `P(0)` and `P'(0)`, and on the spline of a power or an amplitude.
    pub(crate) fn factors(&self) -> ([f64; HEADER], Complex64) {
        (self.header_factors, self.spline_factor)
    }

    /// Power of a node at this κ from its record in a table of powers; zero where κ is beyond the record. Where the
    /// power is about zero, the result may be negative by the tolerance.
    pub fn power(&self, record: &[f32]) -> f64 {
        let Some(c) = record[HEADER..].get(self.first..self.first + 4) else { return 0.0 };
        let spline: f64 = self.weights.iter().zip(c).map(|(w, &c)| w * c as f64).sum();
        self.header_factors[0] * record[0] as f64
            + self.header_factors[1] * record[1] as f64
            + self.spline_factor.re * spline
    }

    /// Amplitude of a node at this κ from its record in a table of amplitudes; zero where κ is beyond the record.
    pub fn amplitude(&self, record: &[f32]) -> Complex64 {
        let Some(c) = record[HEADER..].get(2 * self.first..2 * self.first + 8) else { return Complex64::ZERO };
        let pairs = self.weights.iter().zip(c.chunks_exact(2));
        let spline: Complex64 = pairs.map(|(w, c)| Complex64::new(c[0] as f64, c[1] as f64) * w).sum();
        Complex64::new(record[0] as f64, record[1] as f64) + self.spline_factor * spline
    }
}

/// [`NodeCurve`] for tables of powers, at several κ side by side. `V` is a family of numbers by value (`src/numeric`):
/// single numbers, or vectors of several *lanes*, each with its own κ.
pub(crate) struct PowerCurves<V: Values> {
    /// Index of the first of the four coefficients read.
    first: V::Index,
    /// Weights of the four coefficients.
    weights: [V::Real; 4],
    /// Factors on `P(0)`, `P'(0)` and the spline.
    factors: [V::Real; HEADER + 1],
}

impl<V: Values> PowerCurves<V> {
    /// Prepares evaluations at `kappa` in rad/µm, clamped to the table's range.
    #[inline(always)]
    pub(crate) fn new(table: &SpectralTable, kappa: V::Real) -> Self {
        let kappa = kappa.clip(V::Real::lit(0.0), V::Real::lit(table.kappa_max));
        let t = kappa * V::Real::lit(1.0 / table.kappa_step);
        let first = V::index(t);
        let weights = cubic_b_spline_weights(t - V::real(first));
        Self { first, weights, factors: power_factors(kappa, table.kappa_knee) }
    }

    /// [`NodeCurve::power`] of one record per lane: `record_of(lane)`.
    #[inline(always)]
    pub(crate) fn power<'a>(&self, record_of: impl Fn(usize) -> &'a [f32]) -> V::Real {
        // Header and the four coefficients of each lane; all zeros where κ is beyond the record, so that the power is 0
        // there. They are copied side by side, since lanes read different records. `V` has COUNT ≤ VALUES_MAX lanes.
        let mut lanes = [[0f32; HEADER + 4]; VALUES_MAX];
        for (i, lane) in lanes.iter_mut().enumerate().take(V::COUNT) {
            let (record, first) = (record_of(i), HEADER + V::lane(self.first, i));
            if let Some(coefficients) = record.get(first..first + 4) {
                lane[..HEADER].copy_from_slice(&record[..HEADER]);
                lane[HEADER..].copy_from_slice(coefficients);
            }
        }
        let number = |i: usize| V::pack(|lane| lanes[lane][i].into());
        let first_term = self.weights[0] * number(HEADER);
        let spline = (1..4).fold(first_term, |sum, i| self.weights[i].fma(number(HEADER + i), sum));
        let header = self.factors[0] * number(0) + self.factors[1] * number(1);
        self.factors[HEADER].fma(spline, header)
    }
}

/// Factors on `P(0)`, `P'(0)` and `Q(κ)` in the formula of a power: `[κ₀², κ·κ₀², κ²]/(κ² + κ₀²)`, with κ₀ = `knee`.
#[inline(always)]
fn power_factors<R: Real>(kappa: R, knee: f64) -> [R; HEADER + 1] {
    let ratio = kappa * R::lit(1.0 / knee);
    let squared = ratio * ratio;
    let zero = R::lit(1.0) / (squared + R::lit(1.0));
    [zero, kappa * zero, squared * zero]
}
