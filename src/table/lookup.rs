//! Single-precision form of a table, node by node: records, and look-ups in them.
//!
//! - `κ₀` (`kappa_knee`): the reciprocal of half the range of heights, in rad/µm. `Δ` (`kappa_step`): distance of
//!   knots.
//! - Record of a node: [`HEADER`] floats at κ = 0, then the cubic B-spline coefficients of `Q(κ)`.
//! - Power: `P(κ) = (κ₀²·(P(0) + κ·P'(0)) + κ²·Q(κ))/(κ² + κ₀²)`.
//! - Amplitude: `D(κ) = D(0) + Q(κ)·κ/(κ + iκ₀)`, its coefficients as real and imaginary part in turn.
//! - Coefficient `i` belongs to the knot `(i − 1)·Δ`. A look-up at `t = κ/Δ` reads the four from `i = ⌊t⌋` on.
//! - `e_j`: interpolation weight of a node, `p`: position in nodes (lattice.rs).

use super::lattice::{Lattice, LatticeAxis, TAPS_MAX};
use crate::numeric::math::cubic_b_spline_weights;
use crate::numeric::{Number, Real, VALUES_MAX, Values};
use serde::{Deserialize, Serialize};
use std::f64::consts::TAU;
use sunbeam_fourier::num_complex::Complex64;

/// Floats at the head of a record, at κ = 0: value and slope of a power, real and imaginary part of an amplitude.
pub const HEADER: usize = 2;

/// Quantity that the nodes of a table store, and how they add up.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum NodeQuantity {
    /// Powers `P_j`, real: `S = norm · Σ e_j P_j(κ)`.
    Power,
    /// Amplitudes `D_j`, complex: `S = norm · |Σ e_j D_j(κ)|²`.
    Amplitude,
}

impl NodeQuantity {
    /// Floats of a spline coefficient: 1 or 2.
    pub fn components(self) -> usize {
        match self {
            Self::Power => 1,
            Self::Amplitude => 2,
        }
    }
}

/// Power density `S(f; κ)` of one surface in single precision, a record for each node; other tables are made from it.
///
/// The head of the file has the formulas of a record. Far beyond κ₀ the `Q` of a power is the power itself, so nothing
/// large cancels where a power is small. `P'(0)` is zero where the tile repeats: the powers of orders have no term
/// linear in κ. Four coefficients can be read from any knot up to the last in use.
#[derive(Clone, Debug)]
pub struct SpectralTable {
    pub(super) lattice: Lattice,
    pub(super) quantity: NodeQuantity,
    pub(super) norm: f64,
    pub(super) kappa_max: f64,
    pub(super) kappa_step: f64,
    pub(super) kappa_knee: f64,
    /// Start of each node's record in `records`, row-major from node `(−reach, −reach)`; 0 for nodes out of reach.
    pub(super) offsets: Vec<u32>,
    /// Records of the nodes in reach, one after the other from index 1.
    pub(super) records: Vec<f32>,
}

impl SpectralTable {
    /// Lattice of the nodes.
    pub fn lattice(&self) -> &Lattice {
        &self.lattice
    }

    /// Quantity of the nodes.
    pub fn quantity(&self) -> NodeQuantity {
        self.quantity
    }

    /// Factor `norm` of the table's formula, in µm².
    pub fn norm(&self) -> f64 {
        self.norm
    }

    /// Largest tabulated κ in rad/µm.
    pub fn kappa_max(&self) -> f64 {
        self.kappa_max
    }

    /// Distance Δ of the knots in rad/µm.
    pub fn kappa_step(&self) -> f64 {
        self.kappa_step
    }

    /// κ₀ in rad/µm.
    pub fn kappa_knee(&self) -> f64 {
        self.kappa_knee
    }

    /// Nodes that some pair of directions reaches, row by row: node numbers along x and y, and the record.
    pub fn kept_nodes(&self) -> Vec<(i64, i64, &[f32])> {
        let columns = self.lattice.x.nodes();
        let mut starts: Vec<(usize, usize)> = self
            .offsets
            .iter()
            .enumerate()
            .filter(|(_, offset)| **offset != 0)
            .map(|(index, offset)| (index, *offset as usize))
            .collect();
        starts.push((0, self.records.len()));
        let number = |index: usize| {
            let (row, column) = (index / columns, index % columns);
            (column as i64 - self.lattice.x.reach as i64, row as i64 - self.lattice.y.reach as i64)
        };
        starts
            .windows(2)
            .map(|pair| {
                let (jx, jy) = number(pair[0].0);
                (jx, jy, &self.records[pair[0].1..pair[1].1])
            })
            .collect()
    }

    /// Standard deviation in nodes, along x and y, of the power of one node over frequencies. A square is narrower than
    /// its root by √2, so an amplitude's power is narrower than its kernel.
    pub fn power_sigma(&self) -> (f64, f64) {
        let narrower = match self.quantity {
            NodeQuantity::Power => 1.0,
            NodeQuantity::Amplitude => 0.5f64.sqrt(),
        };
        (self.lattice.x.sigma * narrower, self.lattice.y.sigma * narrower)
    }

    /// Whether `f` in cycles/µm is below the cutoff of the pixels; `S` is zero beyond.
    pub fn is_resolved(&self, f: [f64; 2]) -> bool {
        let known = |axis: &LatticeAxis, f: f64| (f * axis.period_um).abs() <= axis.cutoff;
        known(&self.lattice.x, f[0]) && known(&self.lattice.y, f[1])
    }
}

impl SpectralTable {
    /// Largest κ in rad/µm that occurs together with the frequency `f` in cycles/µm, since `|wi + wo| ≤ 2`.
    pub(crate) fn kappa_limit(&self, f: [f64; 2]) -> f64 {
        let radial = TAU * f[0].hypot(f[1]);
        (self.kappa_max * self.kappa_max - radial * radial).max(0.0).sqrt()
    }

    /// Record interpolated at `f` (cycles/µm): the sum of the records of the nodes around it, each times its weight.
    /// Empty beyond the cutoff and where no node has a record. It has `coefficients` spline coefficients, which should
    /// not exceed those up to [`SpectralTable::kappa_limit`].
    pub(crate) fn interpolated_record(&self, f: [f64; 2], coefficients: usize, sum: &mut Vec<f32>) {
        sum.clear();
        let (x, y) = (&self.lattice.x, &self.lattice.y);
        let (px, py) = (f[0] * x.period_um, f[1] * y.period_um);
        if px.abs() > x.cutoff || py.abs() > y.cutoff {
            return;
        }
        let mut across = [0.0; TAPS_MAX];
        for (ex, jx) in across.iter_mut().zip(taps(x, px)) {
            *ex = x.kernel.weight(px - jx as f64);
        }
        let first_column = (x.first_tap(px) + x.reach as i64) as usize;
        for jy in taps(y, py) {
            let ey = y.kernel.weight(py - jy as f64);
            let row = (jy + y.reach as i64) as usize * x.nodes() + first_column;
            for (ex, offset) in across.iter().zip(&self.offsets[row..row + x.taps]) {
                let (e, start) = ((ey * ex) as f32, *offset as usize);
                if start > 0 && e > 0.0 {
                    if sum.is_empty() {
                        sum.resize(HEADER + coefficients * self.quantity.components(), 0.0);
                    }
                    for (sum, value) in sum.iter_mut().zip(&self.records[start..]) {
                        *sum += e * value;
                    }
                }
            }
        }
    }

    /// `S(f; κ)` in µm², `f` in cycles/µm and κ in rad/µm, for integrals over tables that are not packed. Evaluators
    /// read a [`super::PackedTable`].
    pub(crate) fn density(&self, f: [f64; 2], kappa: f64) -> f64 {
        if !self.is_resolved(f) {
            return 0.0;
        }
        let curve = NodeCurve::new(self, kappa);
        let position = [f[0] * self.lattice.x.period_um, f[1] * self.lattice.y.period_um];
        self.combine(position, |index| match self.offsets[index] as usize {
            0 => Complex64::ZERO,
            start if self.quantity == NodeQuantity::Power => curve.power(&self.records[start..]).into(),
            start => curve.amplitude(&self.records[start..]),
        })
    }

    /// `S` in µm² at `position` (in nodes), with `value` giving each node's quantity by its row-major index.
    pub(super) fn combine(&self, position: [f64; 2], value: impl Fn(usize) -> Complex64) -> f64 {
        let (x, y) = (&self.lattice.x, &self.lattice.y);
        let mut sum = Complex64::ZERO;
        for jy in taps(y, position[1]) {
            for jx in taps(x, position[0]) {
                let e = y.kernel.weight(position[1] - jy as f64) * x.kernel.weight(position[0] - jx as f64);
                let row = (jy + y.reach as i64) as usize;
                sum += e * value(row * x.nodes() + (jx + x.reach as i64) as usize);
            }
        }
        self.norm
            * match self.quantity {
                NodeQuantity::Power => sum.re.max(0.0),
                NodeQuantity::Amplitude => sum.norm_sqr(),
            }
    }
}

/// Numbers of the nodes that a look-up at `position` reads along an axis.
fn taps(axis: &LatticeAxis, position: f64) -> std::ops::Range<i64> {
    let first = axis.first_tap(position);
    first..first + axis.taps as i64
}

/// Weights with which a record is read at one κ.
pub struct NodeCurve {
    /// Number ⌊κ/Δ⌋ of the first coefficient read.
    first: usize,
    weights: [f64; 4],
    /// Factor of the spline: `κ²/(κ²+κ₀²)` of powers, `κ/(κ + iκ₀)` of amplitudes.
    factor: Complex64,
    /// Factors of a power and of its slope at κ = 0: `κ₀²/(κ²+κ₀²)` and `κκ₀²/(κ²+κ₀²)`.
    from_zero: [f64; 2],
}

impl NodeCurve {
    /// Weights at `kappa` in rad/µm, clamped to the table's range.
    // Inlined: the call would move all weights through memory.
    #[inline]
    pub fn new(table: &SpectralTable, kappa: f64) -> Self {
        let kappa = kappa.clamp(0.0, table.kappa_max);
        let t = kappa / table.kappa_step;
        let first = t as usize;
        let [zero, slope, spline] = power_factors(kappa, table.kappa_knee);
        let factor = match table.quantity {
            NodeQuantity::Power => Complex64::new(spline, 0.0),
            NodeQuantity::Amplitude => Complex64::new(spline, -slope / table.kappa_knee),
        };
        // Coefficient first + i belongs to the knot first + i − 1.
        Self { first, weights: cubic_b_spline_weights(t - first as f64), factor, from_zero: [zero, slope] }
    }

    /// Number of the first of the four coefficients read, and the weights of the four.
    pub(crate) fn coefficients(&self) -> (usize, [f64; 4]) {
        (self.first, self.weights)
    }

    /// Factors of a power and its slope at κ = 0, and factor of the spline.
    pub(crate) fn factors(&self) -> ([f64; 2], Complex64) {
        (self.from_zero, self.factor)
    }

    /// A node's power at this κ from its record; zero beyond the record's end. The spline may undershoot a zero of the
    /// power by the tolerance.
    pub fn power(&self, record: &[f32]) -> f64 {
        let Some(c) = record[HEADER..].get(self.first..self.first + 4) else { return 0.0 };
        let scaled: f64 = self.weights.iter().zip(c).map(|(w, &c)| w * c as f64).sum();
        self.from_zero[0] * record[0] as f64 + self.from_zero[1] * record[1] as f64 + self.factor.re * scaled
    }

    /// A node's amplitude at this κ from its record; zero beyond the record's end.
    pub fn amplitude(&self, record: &[f32]) -> Complex64 {
        let Some(c) = record[HEADER..].get(2 * self.first..2 * self.first + 8) else { return Complex64::ZERO };
        let pairs = self.weights.iter().zip(c.chunks_exact(2));
        let scaled: Complex64 = pairs.map(|(w, c)| Complex64::new(c[0] as f64, c[1] as f64) * w).sum();
        Complex64::new(record[0] as f64, record[1] as f64) + self.factor * scaled
    }
}

/// [`NodeCurve`] of powers for several lanes, each at its own κ.
pub(crate) struct PowerCurves<V: Values> {
    first: V::Index,
    weights: [V::Real; 4],
    factors: [V::Real; HEADER + 1],
}

impl<V: Values> PowerCurves<V> {
    /// Weights at `kappa` in rad/µm, clamped to the table's range.
    #[inline(always)]
    pub fn new(table: &SpectralTable, kappa: V::Real) -> Self {
        let kappa = kappa.clip(V::Real::lit(0.0), V::Real::lit(table.kappa_max));
        let t = kappa * V::Real::lit(1.0 / table.kappa_step);
        let first = V::index(t);
        let weights = cubic_b_spline_weights(t - V::real(first));
        Self { first, weights, factors: power_factors(kappa, table.kappa_knee) }
    }

    /// [`NodeCurve::power`] of one record for each lane.
    #[inline(always)]
    pub fn power<'a>(&self, record: impl Fn(usize) -> &'a [f32]) -> V::Real {
        let mut read = [[0f32; HEADER + 4]; VALUES_MAX];
        for (lane, read) in read.iter_mut().enumerate().take(V::COUNT) {
            let (record, first) = (record(lane), HEADER + V::lane(self.first, lane));
            if let Some(coefficients) = record.get(first..first + 4) {
                read[..HEADER].copy_from_slice(&record[..HEADER]);
                read[HEADER..].copy_from_slice(coefficients);
            }
        }
        let read = |i: usize| V::pack(|lane| read[lane][i].into());
        let scaled = (1..4).fold(self.weights[0] * read(HEADER), |sum, i| self.weights[i].fma(read(HEADER + i), sum));
        let from_zero = self.factors[0] * read(0) + self.factors[1] * read(1);
        self.factors[HEADER].fma(scaled, from_zero)
    }
}

/// Factors in the formula of a power at κ: of its value and of its slope at κ = 0, and of its spline.
#[inline(always)]
fn power_factors<R: Real>(kappa: R, knee: f64) -> [R; HEADER + 1] {
    let along = kappa * R::lit(1.0 / knee);
    let squared = along * along;
    let fading = R::lit(1.0) / (squared + R::lit(1.0));
    [fading, kappa * fading, squared * fading]
}
