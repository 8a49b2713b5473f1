//! Table of the power spectrum `S(f; κ)` with one record per node, in single precision. Packed tables, samplers,
//! albedos and colours are computed from it.
//!
//! f is the spatial frequency in cycles/µm, κ the phase rate in rad per µm of height, and e_j the interpolation weight
//! of node j of the frequency lattice at f ([module](super)).

use super::lattice::{Lattice, LatticeAxis, TAPS_MAX};
use serde::{Deserialize, Serialize};
use std::f64::consts::{FRAC_1_SQRT_2, TAU};
use std::ops::Range;
use sunbeam_fourier::num_complex::Complex64;

/// Number of floats at the head of a node's record. They are `P(0)` and `P'(0)` of a power, where `P' = dP/dκ`, or real
/// and imaginary part of `D(0)` of an amplitude.
pub const HEADER: usize = 2;

/// Quantity whose values nodes hold, which determines how nodes add up to S.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum NodeQuantity {
    /// Power: `S = norm · Σ e_j P_j(κ)`, real records.
    Power,
    /// Complex amplitude: `S = norm · |Σ e_j D_j(κ)|²`.
    Amplitude,
}

impl NodeQuantity {
    /// Number of floats per spline coefficient.
    pub fn components(self) -> usize {
        match self {
            Self::Power => 1,
            Self::Amplitude => 2,
        }
    }
}

/// `S(f; κ)` of one surface as one record per node; formulas and symbols are those of the [module](super).
///
/// A record is [`HEADER`] floats, then the coefficients of the cubic B-spline `Q(κ)` with uniform knots, real and
/// imaginary part in turn for amplitudes. With κ₀ the reciprocal of half the range of heights,
///
/// - powers: `P(κ) = (κ₀²·(P(0) + κ·P'(0)) + κ²·Q(κ)) / (κ² + κ₀²)`,
/// - amplitudes: `D(κ) = D(0) + Q(κ)·κ/(κ + iκ₀)`.
///
/// `Q` is finite as κ → 0. For κ far above κ₀ the spline of a power is the power itself, so no large terms cancel where
/// the power is small. `P'(0)` is zero where the tile repeats: powers of orders have no term linear in κ.
///
/// Coefficient `i` belongs to the knot at `κ = (i − 1)·kappa_step`. A κ between the knots k and k + 1 reads the
/// coefficients k to k + 3. A record ends at the largest κ of any pair of directions that reads its node.
#[derive(Clone, Debug)]
pub struct SpectralTable {
    pub(super) lattice: Lattice,
    pub(super) quantity: NodeQuantity,
    /// Factor `norm` of `S` in µm².
    pub(super) norm: f64,
    /// Largest κ in rad/µm.
    pub(super) kappa_max: f64,
    /// Distance between knots in rad/µm.
    pub(super) kappa_step: f64,
    /// κ₀ in rad/µm.
    pub(super) kappa_knee: f64,
    /// Start of each node's record in `records`, row-major from node `(−reach, −reach)`; 0 for a node without a record.
    pub(super) offsets: Vec<u32>,
    /// Records in the order of the nodes, after one unused float.
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

    /// Factor `norm` of `S` in µm².
    pub fn norm(&self) -> f64 {
        self.norm
    }

    /// Largest κ in rad/µm.
    pub fn kappa_max(&self) -> f64 {
        self.kappa_max
    }

    /// Distance between knots in κ, in rad/µm.
    pub fn kappa_step(&self) -> f64 {
        self.kappa_step
    }

    /// κ₀ of the records' formulas in rad/µm.
    pub fn kappa_knee(&self) -> f64 {
        self.kappa_knee
    }

    /// Nodes with a record, row by row: `(jx, jy, record)` with the node numbers jx and jy.
    pub fn kept_nodes(&self) -> Vec<(i64, i64, &[f32])> {
        let (x, y) = (&self.lattice.x, &self.lattice.y);
        let kept: Vec<usize> = (0..self.offsets.len()).filter(|&index| self.offsets[index] != 0).collect();
        // A record ends where the next begins.
        let mut starts: Vec<usize> = kept.iter().map(|&index| self.offsets[index] as usize).collect();
        starts.push(self.records.len());
        kept.iter()
            .zip(starts.windows(2))
            .map(|(&index, span)| {
                let (row, column) = (index / x.nodes(), index % x.nodes());
                (column as i64 - x.reach as i64, row as i64 - y.reach as i64, &self.records[span[0]..span[1]])
            })
            .collect()
    }

    /// Standard deviations in nodes, along x and y, of the peak about a node that interpolation makes of its power:
    /// those of the kernel. Amplitudes are squared after interpolation, so their peaks are narrower by √2.
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

    /// Largest κ in rad/µm of any pair of directions at a frequency in cycles/µm, since
    /// `κ² + (2π|f|)² = (2π/λ)²·|wi + wo|²` is at most `kappa_max²`.
    pub(crate) fn kappa_limit(&self, f: [f64; 2]) -> f64 {
        let radial = TAU * f[0].hypot(f[1]);
        (self.kappa_max * self.kappa_max - radial * radial).max(0.0).sqrt()
    }

    /// Interpolates records at a frequency in cycles/µm: `record` becomes the weighted sum of the records around `f`,
    /// with a header and `coefficients` spline coefficients. The caller passes the buffer, to reuse its memory.
    ///
    /// `record` becomes empty beyond the cutoff, and where no node with a record has a weight. Coefficients beyond the
    /// last that is read at [`SpectralTable::kappa_limit`] are meaningless.
    pub(crate) fn interpolate_record(&self, f: [f64; 2], coefficients: usize, record: &mut Vec<f32>) {
        record.clear();
        if !self.is_resolved(f) {
            return;
        }
        let (x, y) = (&self.lattice.x, &self.lattice.y);
        // Position in nodes.
        let (px, py) = (f[0] * x.period_um, f[1] * y.period_um);
        // Weights of the columns that the look-up reads.
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
                    // Beyond the end of a node's record, numbers of the next records are added. The record
                    // reaches `kappa_limit(f)`, so no κ of a pair of directions at f reads the coefficients affected.
                    for (sum, value) in record.iter_mut().zip(&self.records[start..]) {
                        *sum += e * value;
                    }
                }
            }
        }
    }

    /// `S` in µm² at `position` (in nodes, within the cutoff) from the values of nodes: `value(index)`, with the
    /// row-major index of a node in the lattice. Powers are real.
    pub(super) fn combine(&self, position: [f64; 2], value: impl Fn(usize) -> Complex64) -> f64 {
        let (x, y) = (&self.lattice.x, &self.lattice.y);
        let mut sum = Complex64::ZERO;
        for jy in taps(y, position[1]) {
            for jx in taps(x, position[0]) {
                let e = y.kernel.weight(position[1] - jy as f64) * x.kernel.weight(position[0] - jx as f64);
                let (row, column) = ((jy + y.reach as i64) as usize, (jx + x.reach as i64) as usize);
                sum += e * value(row * x.nodes() + column);
            }
        }
        self.norm
            * match self.quantity {
                NodeQuantity::Power => sum.re.max(0.0),
                NodeQuantity::Amplitude => sum.norm_sqr(),
            }
    }
}

/// Numbers of the nodes that a look-up at `position` (in nodes) reads along an axis.
fn taps(axis: &LatticeAxis, position: f64) -> Range<i64> {
    let first = axis.first_tap(position);
    first..first + axis.taps as i64
}
