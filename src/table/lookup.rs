use super::lattice::{Lattice, LatticeAxis, TAPS_MAX};
use crate::numeric::math::cubic_b_spline_weights;
use crate::numeric::{Number, Real, VALUES_MAX, Values};
use serde::{Deserialize, Serialize};
use std::f64::consts::TAU;
use sunbeam_fourier::num_complex::Complex64;

/// Floats at the head of a node's record, about κ = 0: of a power its value and slope there, of an amplitude the real
/// and imaginary part of its value.
pub const HEADER: usize = 2;

/// How the values of neighbouring nodes combine.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum NodeQuantity {
    /// `S = norm · Σ e_j P_j(κ)`, real records.
    Power,
    /// `S = norm · |Σ e_j D_j(κ)|²`, complex records.
    Amplitude,
}

impl NodeQuantity {
    /// Floats a spline coefficient takes.
    pub fn components(self) -> usize {
        match self {
            Self::Power => 1,
            Self::Amplitude => 2,
        }
    }
}

/// `S(f; κ)` of one surface node by node, as other tables are made of it; see the [module](super) for the formulae.
///
/// A node's record is [`HEADER`] floats followed by the cubic B-spline coefficients of `Q(κ)`, with `P(κ) = (κ₀²·(P(0)
/// + κ·P'(0)) + κ²·Q(κ))/(κ² + κ₀²)` for powers and `D(κ) = D(0) + Q(κ)·κ/(κ + iκ₀)` for amplitudes (real and imaginary
/// part in turn). Far beyond κ₀ the `Q` of a power is the power itself, so that nothing large cancels where it is
/// small. `P'(0)` is zero where the tile repeats: the powers of orders have no term linear in κ. Coefficient `i`
/// belongs to the knot `(i − 1)·kappa_step`; four of them can be read from any knot up to the last in use.
#[derive(Clone, Debug)]
pub struct SpectralTable {
    pub(super) lattice: Lattice,
    pub(super) quantity: NodeQuantity,
    pub(super) norm: f64,
    pub(super) kappa_max: f64,
    pub(super) kappa_step: f64,
    pub(super) kappa_knee: f64,
    /// Start of each node's record, row-major from node `(−reach, −reach)`; 0 of nodes out of reach.
    pub(super) offsets: Vec<u32>,
    pub(super) records: Vec<f32>,
}

impl SpectralTable {
    /// The lattice of nodes.
    pub fn lattice(&self) -> &Lattice {
        &self.lattice
    }

    /// How nodes combine.
    pub fn quantity(&self) -> NodeQuantity {
        self.quantity
    }

    /// Normalisation of the value, µm².
    pub fn norm(&self) -> f64 {
        self.norm
    }

    /// Largest κ answered for, rad/µm.
    pub fn kappa_max(&self) -> f64 {
        self.kappa_max
    }

    /// Spacing of the knots in κ, rad/µm.
    pub fn kappa_step(&self) -> f64 {
        self.kappa_step
    }

    /// κ₀ of the record's formula, rad/µm.
    pub fn kappa_knee(&self) -> f64 {
        self.kappa_knee
    }

    /// The nodes that a pair of directions can reach, row by row: their numbers along x and y and their records.
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

    /// Standard deviation of what a node's power is spread by, in nodes, along x and y. Amplitudes are squared, so
    /// theirs is narrower than what joins them by √2.
    pub fn power_sigma(&self) -> (f64, f64) {
        let narrower = match self.quantity {
            NodeQuantity::Power => 1.0,
            NodeQuantity::Amplitude => 0.5f64.sqrt(),
        };
        (self.lattice.x.sigma * narrower, self.lattice.y.sigma * narrower)
    }

    /// Whether the pixels say anything about a frequency (cycles/µm); `S` is zero elsewhere.
    pub fn is_resolved(&self, f: [f64; 2]) -> bool {
        let known = |axis: &LatticeAxis, f: f64| (f * axis.period_um).abs() <= axis.cutoff;
        known(&self.lattice.x, f[0]) && known(&self.lattice.y, f[1])
    }
}

impl SpectralTable {
    /// Largest κ (rad/µm) that occurs together with the frequency `f` (cycles/µm), since `|wi + wo| ≤ 2`.
    pub(crate) fn kappa_limit(&self, f: [f64; 2]) -> f64 {
        let radial = TAU * f[0].hypot(f[1]);
        (self.kappa_max * self.kappa_max - radial * radial).max(0.0).sqrt()
    }

    /// The record that a look-up at `f` (cycles/µm) would find in a single node of weight one: the sum of the records
    /// around it, each times its weight; empty where there is none, beyond the cutoff or far from all orders. It has as
    /// many of [`NodeCurve::coefficients`] as are asked for, at most those up to [`SpectralTable::kappa_limit`].
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

    /// `S(f; κ)` in µm² at a frequency in cycles/µm and κ in rad/µm. What evaluates is [`super::PackedTable`]; this is
    /// for integrals over tables that are not packed.
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

    /// `S` at `position` (in nodes) from node values given by their row-major number, in place of the records.
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

/// The nodes a look-up at `position` reads.
fn taps(axis: &LatticeAxis, position: f64) -> std::ops::Range<i64> {
    let first = axis.first_tap(position);
    first..first + axis.taps as i64
}

/// Where a look-up reads the splines in κ.
pub struct NodeCurve {
    first: usize,
    weights: [f64; 4],
    /// `κ²/(κ²+κ₀²)` or `κ/(κ + iκ₀)`, which undoes the scaling of the records.
    factor: Complex64,
    /// Of a power and its slope at κ = 0: `κ₀²/(κ²+κ₀²)` and `κκ₀²/(κ²+κ₀²)`.
    from_zero: [f64; 2],
}

impl NodeCurve {
    /// Prepares look-ups at `kappa` (rad/µm, clamped to the table's range).
    // Its coefficients are better built where they are used than moved there.
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

    /// Number of the first of the four coefficients read, and their weights.
    pub(crate) fn coefficients(&self) -> (usize, [f64; 4]) {
        (self.first, self.weights)
    }

    /// Factors of a power and its slope at κ = 0, and of the spline, in the record's formula.
    pub(crate) fn factors(&self) -> ([f64; 2], Complex64) {
        (self.from_zero, self.factor)
    }

    /// A node's power at this κ from its record (see [`SpectralTable`]); zero beyond the record's end. A spline may
    /// undershoot a zero by the tolerance.
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

/// [`NodeCurve`] for powers, each at its own κ.
pub(crate) struct PowerCurves<V: Values> {
    first: V::Index,
    weights: [V::Real; 4],
    factors: [V::Real; HEADER + 1],
}

impl<V: Values> PowerCurves<V> {
    /// Prepares look-ups at `kappa` (rad/µm, clamped to the table's range).
    #[inline(always)]
    pub fn new(table: &SpectralTable, kappa: V::Real) -> Self {
        let kappa = kappa.clip(V::Real::lit(0.0), V::Real::lit(table.kappa_max));
        let t = kappa * V::Real::lit(1.0 / table.kappa_step);
        let first = V::index(t);
        let weights = cubic_b_spline_weights(t - V::real(first));
        Self { first, weights, factors: power_factors(kappa, table.kappa_knee) }
    }

    /// [`NodeCurve::power`] of a record each.
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

/// Of a power at κ the factors in its record's formula: of its value and its slope at κ = 0, and of its spline.
#[inline(always)]
fn power_factors<R: Real>(kappa: R, knee: f64) -> [R; HEADER + 1] {
    let along = kappa * R::lit(1.0 / knee);
    let squared = along * along;
    let fading = R::lit(1.0) / (squared + R::lit(1.0));
    [fading, kappa * fading, squared * fading]
}
