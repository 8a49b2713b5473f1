//! Nodes of a slab of an albedo table, and the cells between them. A table for several relative sizes of the relief has
//! a slab of planes for each λ" = λ/depth (`sizes.rs`). Other tables have one slab, with all planes of wavelength.
//!
//! Nodes lie on the corners of a square grid over directions (`grid.rs`), in planes of wavelength. A node holds the
//! value `(A − 1)·cos²θ` of its divisor A (`mod.rs`); the *excess* is `A − 1`. A *cell* lies between two neighbouring
//! planes and has eight corners. The table is linear in each of its three coordinates `[x, y, plane]`, which count
//! cells and planes from the first.

use super::grid::Grid;
use super::{AlbedoLayout, AlbedoView};
use crate::numeric::Plain;
use crate::scattering::Vec3;
use crate::table::Steps;
use rayon::prelude::*;
use std::array;

/// Factor on the excess that check points near the horizon require where albedos have a pole there, and divisors change
/// most within a cell. With 1.0, an albedo of 1.07 remains at 89° on a blazed grating. Little power leaves there.
const RIM_INCREASE: f64 = 1.4;
/// Radius r of the grid beyond which [`RIM_INCREASE`] applies. There cosθ = (1 − r²)², so this is 85.6°. With 0.9, an
/// albedo of 1.02 remains at 88° on a blazed grating with a coherence length of 5 µm.
const RIM_RADIUS: f64 = 0.85;
/// Bound of the albedo after division above which a cell is checked again: the albedo that is accepted between nodes.
const ACCEPTED_BETWEEN_NODES: f64 = 1.01;
/// Largest number of rounds of checks. Presets need fewer than ten.
const ROUNDS_MAX: usize = 16;

/// Shape of a slab.
#[derive(Clone, Copy)]
pub(super) struct Nodes {
    /// Grid of each plane, with an even number of cells.
    pub grid: Grid,
    /// Number of planes, at least two.
    pub planes: u32,
    /// Whether directions mirrored at the x axis have equal values. Only nodes up to the middle row are then stored,
    /// and the others copy them.
    pub is_mirrored: bool,
    /// Whether albedos have a pole at the horizon.
    pub has_pole: bool,
}

/// Check point of a cell at which the table is too small.
struct Violation {
    /// Number of the cell.
    cell: usize,
    /// Position in the cell along x, y and plane, from 0 to 1.
    at: [f64; 3],
    /// Value that is needed.
    needed: f64,
    /// Difference of the needed value from the table's.
    deficit: f64,
    /// Whether the albedo may exceed [`ACCEPTED_BETWEEN_NODES`], so that the cell is checked again.
    exceeds_accepted: bool,
}

impl Nodes {
    /// Number of stored rows of nodes in a plane.
    fn rows(self) -> usize {
        if self.is_mirrored { self.grid.side().div_ceil(2) } else { self.grid.side() }
    }

    /// Number of stored nodes in a plane.
    fn in_plane(self) -> usize {
        self.rows() * self.grid.side()
    }

    /// Number of stored nodes.
    pub(super) fn len(self) -> usize {
        self.planes as usize * self.in_plane()
    }

    /// Approximate number of check points of all rounds of [`Nodes::raise`]: on presets 1.3 to 1.6 times those of the
    /// first round.
    pub(super) fn expected_checks(self, checks: usize) -> usize {
        checks * self.cells() * 3 / 2
    }

    /// Number of cells between stored nodes.
    fn cells(self) -> usize {
        (self.planes as usize - 1) * (self.rows() - 1) * self.grid.cells as usize
    }

    /// Values `[plane][y][x]` of the stored nodes; those beyond the horizon have the value near it (`grid.rs`).
    /// `excess` is that of a direction in a plane.
    pub(super) fn values(self, steps: &Steps, excess: impl Fn(Vec3, f64) -> f64 + Sync) -> Vec<f32> {
        let value = |i: usize| {
            steps.one();
            let (wi, _) = self.grid.direction(self.grid.position(i % self.in_plane()));
            (excess(wi, (i / self.in_plane()) as f64) * wi[2] * wi[2]) as f32
        };
        (0..self.len()).into_par_iter().map(value).collect()
    }

    /// Packets `[gap][y][x]` of all cells, from the values of the stored nodes.
    pub(super) fn packets(self, values: &[f32]) -> Vec<u32> {
        let cells = self.grid.cells as usize;
        // Bits of the value at a corner of a cell.
        let corner = |x: usize, y: usize, plane: usize| {
            let node = y * self.grid.side() + x;
            let node = if self.is_mirrored { node.min(self.grid.mirrored(node)) } else { node };
            bf16_above(values[plane * self.in_plane() + node])
        };
        let words = (0..cells * cells * (self.planes as usize - 1)).flat_map(|i| {
            let [x, y, plane] = [i % cells, i / cells % cells, i / cells / cells];
            [(y, plane), (y + 1, plane), (y, plane + 1), (y + 1, plane + 1)]
                .map(|(y, plane)| corner(x, y, plane) | corner(x + 1, y, plane) << 16)
        });
        words.collect()
    }

    /// Layout of the slab's packets.
    pub(super) fn layout(self) -> AlbedoLayout {
        let (cells, planes) = (self.grid.cells, self.planes);
        // The wavelengths of the planes are not read.
        AlbedoLayout { cells, planes, wavelength_min_nm: 0.0, planes_per_nm: 0.0, sizes: None }
    }

    /// Position of a cell along x, y and plane.
    fn cell(self, i: usize) -> [usize; 3] {
        let (columns, rows) = (self.grid.cells as usize, self.rows() - 1);
        [i % columns, i / columns % rows, i / columns / rows]
    }

    /// Raises values until the table has the excess that is needed at check points in all cells. `needed(wi, plane,
    /// enough)` is that excess; a result below `enough`, the table's excess, need not be exact.
    ///
    /// A round has `checks` points in each cell. Cells in which the albedo may exceed [`ACCEPTED_BETWEEN_NODES`] are
    /// checked again, at other points, since a ridge of the albedo may be higher elsewhere in the cell.
    pub(super) fn raise(
        self,
        values: &mut [f32],
        checks: usize,
        steps: &Steps,
        needed: impl Fn(Vec3, f64, f64) -> f64 + Sync,
    ) {
        let mut cells: Vec<usize> = (0..self.cells()).collect();
        for round in 0..ROUNDS_MAX {
            let (words, layout) = (self.packets(values), self.layout());
            let table = AlbedoView::<Plain<f64>> { layout, words: &words };
            let check = |cell: usize, k: usize| {
                steps.one();
                let at = unit_point(round * checks + k);
                let [x, y, plane] = array::from_fn(|axis| self.cell(cell)[axis] as f64 + at[axis]);
                let (wi, radius) = self.grid.direction([x, y]);
                // No direction lies beyond the horizon.
                if radius >= 1.0 {
                    return None;
                }
                let table_excess = table.excess_in_plane(wi, plane);
                let increase = if self.has_pole && radius > RIM_RADIUS { RIM_INCREASE } else { 1.0 };
                let excess = increase * needed(wi, plane, table_excess / increase);
                let exceeds_accepted = 1.0 + excess > ACCEPTED_BETWEEN_NODES * (1.0 + table_excess);
                let [needed, deficit] = [excess, excess - table_excess].map(|excess| excess * wi[2] * wi[2]);
                (deficit > 0.0).then_some(Violation { cell, at, needed, deficit, exceeds_accepted })
            };
            let in_cell = |&cell: &usize| (0..checks).filter_map(move |k| check(cell, k));
            let mut violations: Vec<_> = cells.par_iter().flat_map_iter(in_cell).collect();
            cells = violations.iter().filter(|found| found.exceeds_accepted).map(|found| found.cell).collect();
            cells.dedup();
            // The largest deficits are mended first, since this mends others around them.
            violations.sort_by(|a, b| b.deficit.total_cmp(&a.deficit));
            violations.iter().for_each(|violation| self.mend(values, violation));
            if cells.is_empty() {
                break;
            }
        }
    }

    /// Raises the corners of a cell in proportion to their weights in the interpolation, until the table has the needed
    /// value: the raise with the least sum of squares.
    fn mend(self, values: &mut [f32], &Violation { cell, at, needed, .. }: &Violation) {
        let [x, y, plane] = self.cell(cell);
        // Corners with their weights. The bits of i tell along which axes a corner is the upper one.
        let corners: [(usize, f64); 8] = array::from_fn(|i| {
            let upper = [i & 1, i >> 1 & 1, i >> 2];
            let weights = [0, 1, 2].map(|axis| if upper[axis] == 1 { at[axis] } else { 1.0 - at[axis] });
            let node = (plane + upper[2]) * self.in_plane() + (y + upper[1]) * self.grid.side() + x + upper[0];
            (node, weights.iter().product())
        });
        let value: f64 = corners.iter().map(|&(node, weight)| weight * f64::from(values[node])).sum();
        let squares: f64 = corners.iter().map(|&(_, weight)| weight * weight).sum();
        let raise_per_weight = (needed - value).max(0.0) / squares;
        corners.iter().for_each(|&(node, weight)| values[node] += (raise_per_weight * weight) as f32);
    }
}

/// Point `k` of the additive low-discrepancy sequence R₃ in the unit cube (M. Roberts 2018). Its steps are 1/g, 1/g²
/// and 1/g³ for the real root g > 0 of `g⁴ = g + 1`.
pub(super) fn unit_point(k: usize) -> [f64; 3] {
    [0.819_172_513_396_164_5, 0.671_043_606_703_789_2, 0.549_700_477_901_970_3]
        .map(|step| (0.5 + k as f64 * step).fract())
}

/// Bits of the smallest bfloat16 that is at least `value`, which must not be negative.
fn bf16_above(value: f32) -> u32 {
    let bits = value.to_bits();
    (bits >> 16) + u32::from(bits & 0xffff != 0)
}
