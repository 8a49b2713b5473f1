//! The nodes of a table gathered into leaves, and leaves into cells: what the sampler's choice of an order runs over.

use super::lattice::LatticeAxis;
use super::lookup::{BANDS, SpectralTable};
use serde::{Deserialize, Serialize};

/// Width of a leaf as a share of the period, in nodes per µm: 8 nodes of a 65 µm tile, which span 4° about the normal
/// in green light.
const LEAF_PER_UM: f64 = 0.123;
/// Most leaves that a look-up meets along one axis.
pub const LEAVES_MET_MAX: usize = 4;
/// Leaves of a cell along each axis that has cells at all.
const LEAVES_IN_CELL: usize = 2;
/// Leaves that propagate at most, up to which all of them are one cell.
const FEW: f64 = 64.0;

/// Standard deviations of a node's Gaussian beyond which it is no longer expected to reach.
const REACH_SIGMAS: f64 = 2.0;

/// Reads a power, times an amount, from the means of κ bands: linear between the middles of two neighbours.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct BandReading {
    pub amount: f64,
    /// The lower band and the fraction towards the next.
    band: usize,
    fraction: f64,
}

impl BandReading {
    /// Reads the power at `position` bands, counted between middles from the first.
    pub fn new(amount: f64, position: f64) -> Self {
        let position = position.clamp(0.0, (BANDS - 1) as f64);
        let band = (position as usize).min(BANDS - 2);
        Self { amount, band, fraction: position - band as f64 }
    }

    /// The same with its amount times `factor`.
    pub fn times(self, factor: f64) -> Self {
        Self { amount: self.amount * factor, ..self }
    }

    /// The power of band means.
    pub fn of(&self, means: &[f32]) -> f64 {
        let (low, high) = (f64::from(means[self.band]), f64::from(means[self.band + 1]));
        self.amount * (low + self.fraction * (high - low))
    }
}

/// A node drawn by [`Leaves::choose`], with what is left of the random numbers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OrderChoice {
    /// Node numbers along x and y.
    pub jx: i64,
    pub jy: i64,
    /// The random numbers, stretched to [0, 1) again.
    pub u: [f64; 2],
}

/// Leaves along one axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct LeafAxis {
    /// Nodes in a leaf; the first leaf begins with the first node.
    pub len: usize,
    /// Leaves.
    pub count: usize,
    /// Leaves in a cell.
    pub in_cell: usize,
    /// Cells.
    pub cells: usize,
    /// Most leaves, and cells, that one look-up meets.
    pub met: usize,
    pub cells_met: usize,
}

impl LeafAxis {
    fn new(axis: &LatticeAxis, one_cell: bool) -> Self {
        let len = leaf_len(axis);
        let count = axis.nodes().div_ceil(len);
        let in_cell = if one_cell { count } else { LEAVES_IN_CELL.min(count) };
        let cells = count.div_ceil(in_cell);
        let met = |len: usize| if axis.taps < 2 { 1 } else { (axis.taps - 2) / len + 2 };
        Self { len, count, in_cell, cells, met: met(len).min(count), cells_met: met(len * in_cell).min(cells) }
    }

    /// Number, counted from `-reach`, of the middle of a leaf.
    fn middle(&self, leaf: usize) -> f64 {
        (leaf * self.len) as f64 + 0.5 * (self.len - 1) as f64
    }

    /// How far from a node of it, in nodes, a leaf's Gaussians of standard deviation `sigma` are expected to reach.
    fn reach(&self, sigma: f64) -> f64 {
        (self.len - 1) as f64 + REACH_SIGMAS * sigma
    }
}

/// A power of two of nodes, at least so many that a look-up meets no more than [`LEAVES_MET_MAX`] leaves.
fn leaf_len(axis: &LatticeAxis) -> usize {
    let wanted = (LEAF_PER_UM * axis.period_um).log2().round().max(0.0).exp2() as usize;
    let least = axis.taps.saturating_sub(1).div_ceil(LEAVES_MET_MAX - 1).max(1).next_power_of_two();
    wanted.min(axis.nodes().next_power_of_two()).max(least)
}

/// The leaves of a [`SpectralTable`] with their power in each κ band, by which nodes are drawn within them.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Leaves {
    pub x: LeafAxis,
    pub y: LeafAxis,
    /// `[leaf along y][leaf along x][band]`.
    powers: Vec<f32>,
    /// `[leaf along y][leaf along x]`: centre of power along x and y, in nodes from the first, and half the extent of a box
    /// of the same spread with what its Gaussians reach further.
    places: Vec<f32>,
    /// Farthest that a leaf's Gaussians reach from a node of it, along x and y in nodes.
    reach: [f64; 2],
    /// The part of a leaf's power that is in one row of nodes, `[row of nodes][leaf along x][band]`.
    rows: Vec<f32>,
}

impl Leaves {
    /// Gathers the nodes of `table`. `frequency_span` is the largest diameter in cycles/µm of the disc of frequencies that
    /// propagate, `2/λ`.
    pub fn new(table: &SpectralTable, frequency_span: f64) -> Self {
        let lattice = table.lattice();
        let propagating = |axis: &LatticeAxis| {
            let len = leaf_len(axis) as f64;
            (frequency_span * axis.period_um / len + 2.0).min((axis.nodes() as f64 / len).ceil())
        };
        let one_cell = propagating(&lattice.x) * propagating(&lattice.y) <= FEW;
        let (x, y) = (LeafAxis::new(&lattice.x, one_cell), LeafAxis::new(&lattice.y, one_cell));
        let columns = lattice.x.nodes();
        let mut rows = vec![0f32; lattice.y.nodes() * x.count * BANDS];
        let mut powers = vec![0f32; y.count * x.count * BANDS];
        for (row, offsets) in table.offsets().chunks(columns).enumerate() {
            for (leaf, offsets) in offsets.chunks(x.len).enumerate() {
                let mut sums = [0f64; BANDS];
                for &offset in offsets {
                    let record = &table.records()[4 * offset as usize..][..BANDS];
                    sums.iter_mut().zip(record).for_each(|(sum, &power)| *sum += power as f64);
                }
                for (band, sum) in sums.into_iter().enumerate() {
                    rows[(row * x.count + leaf) * BANDS + band] = sum as f32;
                    powers[(row / y.len * x.count + leaf) * BANDS + band] += sum as f32;
                }
            }
        }
        let (sx, sy) = table.proposal_sigma();
        let reach = [x.reach(sx), y.reach(sy)];
        let mut leaves = Self { x, y, powers, places: Vec::new(), reach, rows };
        leaves.places = (0..x.count * y.count)
            .flat_map(|leaf| leaves.place(table, leaf % x.count, leaf / x.count))
            .map(|place| place as f32)
            .collect();
        leaves
    }

    /// See [`Leaves::places`].
    fn place(&self, table: &SpectralTable, leaf_x: usize, leaf_y: usize) -> [f64; 4] {
        let lattice = table.lattice();
        let (mut total, mut first, mut second) = (0.0, [0.0; 2], [0.0; 2]);
        let middle = [self.x.middle(leaf_x), self.y.middle(leaf_y)];
        for row in leaf_y * self.y.len..((leaf_y + 1) * self.y.len).min(lattice.y.nodes()) {
            for column in leaf_x * self.x.len..((leaf_x + 1) * self.x.len).min(lattice.x.nodes()) {
                let offset = table.offsets()[row * lattice.x.nodes() + column];
                let power: f64 = table.records()[4 * offset as usize..][..BANDS].iter().map(|&p| f64::from(p)).sum();
                total += power;
                for (axis, at) in [column, row].into_iter().enumerate() {
                    let from = at as f64 - middle[axis];
                    first[axis] += power * from;
                    second[axis] += power * from * from;
                }
            }
        }
        let (sx, sy) = table.proposal_sigma();
        let [x, y] = std::array::from_fn(|axis| {
            let (mean, square) = if total > 0.0 { (first[axis] / total, second[axis] / total) } else { (0.0, 0.0) };
            // A box is √3 standard deviations wide to either side.
            let half = (3.0 * (square - mean * mean).max(0.0)).sqrt() + REACH_SIGMAS * [sx, sy][axis];
            (middle[axis] + mean, half)
        });
        [x.0, y.0, x.1, y.1]
    }

    /// For every leaf, `[leaf along y][leaf along x]`, its centre of power along x and y, in nodes from the first, and half
    /// the extent, along x and y in nodes, of a box of the same spread with what its Gaussians reach further.
    pub fn places(&self) -> &[f32] {
        &self.places
    }

    /// [`Leaves::places`] of one leaf.
    pub fn place_of(&self, leaf_x: usize, leaf_y: usize) -> [f64; 4] {
        let start = 4 * (leaf_y * self.x.count + leaf_x);
        std::array::from_fn(|i| self.places[start + i] as f64)
    }

    /// Farthest that a leaf's Gaussians are expected to reach from a node of it, along x and y in nodes.
    pub fn reach(&self) -> [f64; 2] {
        self.reach
    }

    /// Power of a leaf in each band.
    pub fn power(&self, leaf_x: usize, leaf_y: usize) -> &[f32] {
        &self.powers[(leaf_y * self.x.count + leaf_x) * BANDS..][..BANDS]
    }

    /// `[leaf along y][leaf along x][band]`.
    pub fn powers(&self) -> &[f32] {
        &self.powers
    }

    /// `[row of nodes][leaf along x][band]`.
    pub fn rows(&self) -> &[f32] {
        &self.rows
    }

    /// Bytes held.
    pub fn bytes(&self) -> usize {
        size_of_val(self.powers.as_slice()) + size_of_val(self.places.as_slice()) + size_of_val(self.rows.as_slice())
    }

    /// Draws a node of a leaf by its power under `reading` from two random numbers in [0, 1): first the row, then the
    /// node. `None` where the leaf has no power.
    pub fn choose(
        &self,
        table: &SpectralTable,
        leaf: [usize; 2],
        reading: &BandReading,
        u: [f64; 2],
    ) -> Option<OrderChoice> {
        let lattice = table.lattice();
        let (first_row, first) = (leaf[1] * self.y.len, leaf[0] * self.x.len);
        let rows = self.y.len.min(lattice.y.nodes() - first_row);
        let row_power =
            |i: usize| reading.of(&self.rows[((first_row + i) * self.x.count + leaf[0]) * BANDS..][..BANDS]);
        let (row, uy) = pick(rows, row_power, u[1])?;
        let start = (first_row + row) * lattice.x.nodes() + first;
        let columns = self.x.len.min(lattice.x.nodes() - first);
        let node_power = |i: usize| reading.of(&table.records()[4 * table.offsets()[start + i] as usize..][..BANDS]);
        let (column, ux) = pick(columns, node_power, u[0])?;
        let (rx, ry) = (lattice.x.reach as i64, lattice.y.reach as i64);
        Some(OrderChoice { jx: (first + column) as i64 - rx, jy: (first_row + row) as i64 - ry, u: [ux, uy] })
    }
}

/// One of `count` numbers by its weight, and where in its interval `u` lies; `None` where all weights are zero.
pub fn pick(count: usize, weight: impl Fn(usize) -> f64, u: f64) -> Option<(usize, f64)> {
    let total: f64 = (0..count).map(&weight).sum();
    let (target, mut passed, mut found) = (u * total, 0.0, None);
    for i in 0..count {
        let weight = weight(i);
        if weight > 0.0 {
            // The last one of any weight is kept where rounding leaves the target beyond the end.
            found = Some((i, ((target - passed) / weight).clamp(0.0, 1.0 - f64::EPSILON)));
            passed += weight;
            if target < passed {
                break;
            }
        }
    }
    found
}
