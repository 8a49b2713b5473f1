//! A table of `S(f; κ)` node by node in single precision, from which packed tables, samplers, albedos and colours are
//! computed.

use super::lattice::{Lattice, LatticeAxis, TAPS_MAX};
use super::node_curve::NodeCurve;
use serde::{Deserialize, Serialize};
use std::f64::consts::{FRAC_1_SQRT_2, TAU};
use std::ops::Range;
use sunbeam_fourier::num_complex::Complex64;

/// Floats at the head of a node's record: `P(0)` and `P'(0)` of a power, real and imaginary part of `D(0)` of an
/// amplitude.
pub const HEADER: usize = 2;

/// Quantity that a node holds, which decides how nodes add up.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum NodeQuantity {
    /// Power: `S = norm · Σ e_j P_j(κ)`, real records.
    Power,
    /// Complex amplitude: `S = norm · |Σ e_j D_j(κ)|²`.
    Amplitude,
}

impl NodeQuantity {
    /// Floats per spline coefficient.
    pub fn components(self) -> usize {
        match self {
            Self::Power => 1,
            Self::Amplitude => 2,
        }
    }
}

/// `S(f; κ)` of one surface as one record per node; formulas and symbols are those of the [module](super).
///
/// A record is [`HEADER`] floats, then the coefficients of the cubic B-spline `Q(κ)`, real and imaginary part in turn
/// for amplitudes. With κ₀ the reciprocal of half the range of heights,
///
/// - powers: `P(κ) = (κ₀²·(P(0) + κ·P'(0)) + κ²·Q(κ)) / (κ² + κ₀²)`,
/// - amplitudes: `D(κ) = D(0) + Q(κ)·κ/(κ + iκ₀)`.
///
/// `Q` is finite as κ → 0. For κ far above κ₀ it is the power itself, so that nothing large cancels where a power is
/// small. `P'(0)` is zero where the tile repeats: powers of orders have no term linear in κ.
///
/// Coefficient `i` belongs to the knot at `κ = (i − 1)·kappa_step`. Four coefficients can be read from each knot up to
/// the record's last.
#[derive(Clone, Debug)]
pub struct SpectralTable {
    pub(super) lattice: Lattice,
    pub(super) quantity: NodeQuantity,
    pub(super) norm: f64,
    pub(super) kappa_max: f64,
    pub(super) kappa_step: f64,
    pub(super) kappa_knee: f64,
    /// Start of each node's record in `records`, row-major from node `(−reach, −reach)`; 0 for a node without a record.
    pub(super) offsets: Vec<u32>,
    pub(super) records: Vec<f32>,
}

impl SpectralTable {
    /// Lattice of the nodes.
    pub fn lattice(&self) -> &Lattice {
        &self.lattice
    }

    /// Quantity that nodes hold.
    pub fn quantity(&self) -> NodeQuantity {
        self.quantity
    }

    /// Factor `norm` of `S` in µm².
    pub fn norm(&self) -> f64 {
        self.norm
    }

    /// Largest κ in rad/µm.
    pub fn kappa_max(&self) -> f64 {
        self.kappa_max
    }

    /// Distance between knots in κ, rad/µm.
    pub fn kappa_step(&self) -> f64 {
        self.kappa_step
    }

    /// κ₀ of the record's formula, rad/µm.
    pub fn kappa_knee(&self) -> f64 {
        self.kappa_knee
    }

    /// Nodes with a record, row by row: numbers along x and y, and the record.
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

    /// Standard deviation in nodes, along x and y, by which interpolation spreads a node's power. Amplitudes are
    /// squared, so theirs is the kernel's over √2.
    pub fn power_sigma(&self) -> (f64, f64) {
        let factor = match self.quantity {
            NodeQuantity::Power => 1.0,
            NodeQuantity::Amplitude => FRAC_1_SQRT_2,
        };
        (self.lattice.x.sigma * factor, self.lattice.y.sigma * factor)
    }

    /// Whether the pixels resolve a frequency in cycles/µm; `S` is zero elsewhere.
    pub fn is_resolved(&self, f: [f64; 2]) -> bool {
        let resolved = |axis: &LatticeAxis, f: f64| (f * axis.period_um).abs() <= axis.cutoff;
        resolved(&self.lattice.x, f[0]) && resolved(&self.lattice.y, f[1])
    }

    /// Largest κ in rad/µm of any pair of directions at a frequency in cycles/µm, since `|wi + wo| ≤ 2`.
    pub(crate) fn kappa_limit(&self, f: [f64; 2]) -> f64 {
        let radial = TAU * f[0].hypot(f[1]);
        (self.kappa_max * self.kappa_max - radial * radial).max(0.0).sqrt()
    }

    /// Interpolates records at a frequency in cycles/µm: `record` becomes the weighted sum of the records about `f`, up
    /// to `coefficients` spline coefficients.
    ///
    /// `record` is left empty beyond the cutoff, or where no node has a weight. Coefficients are complete up to the
    /// knots that [`SpectralTable::kappa_limit`] reads.
    pub(crate) fn interpolate_record(&self, f: [f64; 2], coefficients: usize, record: &mut Vec<f32>) {
        record.clear();
        let (x, y) = (&self.lattice.x, &self.lattice.y);
        let (px, py) = (f[0] * x.period_um, f[1] * y.period_um);
        if px.abs() > x.cutoff || py.abs() > y.cutoff {
            return;
        }
        let mut weights_x = [0.0; TAPS_MAX];
        for (ex, jx) in weights_x.iter_mut().zip(taps(x, px)) {
            *ex = x.kernel.weight(px - jx as f64);
        }
        let first_column = (x.first_tap(px) + x.reach as i64) as usize;
        for jy in taps(y, py) {
            let ey = y.kernel.weight(py - jy as f64);
            let row = (jy + y.reach as i64) as usize * x.nodes() + first_column;
            for (ex, offset) in weights_x.iter().zip(&self.offsets[row..row + x.taps]) {
                let (e, start) = ((ey * ex) as f32, *offset as usize);
                if start > 0 && e > 0.0 {
                    if record.is_empty() {
                        record.resize(HEADER + coefficients * self.quantity.components(), 0.0);
                    }
                    for (sum, value) in record.iter_mut().zip(&self.records[start..]) {
                        *sum += e * value;
                    }
                }
            }
        }
    }

    /// `S(f; κ)` in µm² at a frequency in cycles/µm and κ in rad/µm. Evaluators read [`super::PackedTable`]; this
    /// serves integrals over tables that are not packed.
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

    /// `S` in µm² at `position` (in nodes) from given node values, by their row-major number.
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
fn taps(axis: &LatticeAxis, position: f64) -> Range<i64> {
    let first = axis.first_tap(position);
    first..first + axis.taps as i64
}
