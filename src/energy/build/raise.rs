//! Raises the nodes about cells in which the table lies below the divisor that it needs: the last step of a build.
//!
//! Symbols are those of [`build.rs`](super): `t` is the divisor that a direction needs, and `b` a known lower bound of
//! divisors. Nodes lie on the corners of the grid's cells, in groups of wavelengths with gaps between them. A node has
//! `(A − 1)·cos²θ` of its divisor A, for K planes (one wavelength, or three bands).
//!
//! - The *deficit* of a cell is the largest amount by which the value that `t` requires exceeds the table, linear
//!   between nodes, at the cell's check points. It is never negative.
//! - A relief is *deep* if its phase changes so much across a cell that `t` fluctuates there ([`DEEP_PHASE`]).

use super::{Builder, Nodes};
use crate::energy::grid::Grid;
use crate::table::Steps;
use rayon::prelude::*;
use std::f64::consts::PI;

/// Largest number of nodes beyond a cell's corners, along each axis, that are raised with the corners. The number is
/// one for each half turn by which the *relief phase* changes across a cell: the phase between the relief's lowest and
/// highest point, in proportion to cosθ ([`AlbedoIntegral::phase_max`]). Chosen: a larger limit darkens reliefs tens of
/// µm deep.
const DEEP_REACH_MAX: usize = 3;
/// Change of the relief phase across a cell, in radians, from which reliefs with ridges and transparent bodies count as
/// deep. Other reliefs count as deep from half a turn, π. With π for all, an albedo of 1.037 remains on a rough relief
/// 1.2 µm deep.
pub(in crate::energy) const DEEP_PHASE: f64 = 2.0;
/// Check points within a cell of a deep relief, in place of its centre: fractions of the cell along x, y and group.
/// Chosen half-way between its centre and four of its corners.
const DEEP_CHECK_POINTS: [[f64; 3]; 4] =
    [[0.25, 0.25, 0.25], [0.75, 0.75, 0.25], [0.25, 0.75, 0.75], [0.75, 0.25, 0.75]];
/// Factor on the deficits of deep reliefs, which are found at a few points only. With 1 an albedo of 1.03 remains on a
/// relief 2 µm deep.
const DEEP_INCREASE: f32 = 1.5;

impl<const K: usize> Builder<'_, K> {
    /// Raises the corners of the cells that have a deficit. `b` has the coarse nodes with the known divisors.
    ///
    /// - Cells are checked in their centre, unless nothing is divided at any corner.
    /// - Cells on the horizon are also checked close to it ([`Grid::on_rim`]).
    /// - All cells of deep reliefs are checked, at several points, and nodes further off are raised as well.
    pub(super) fn raise_cells(&self, nodes: &mut Nodes<K>, b: &Nodes<K>, steps: &Steps) {
        let grid = nodes.grid;
        let (cells, rows) = (grid.cells as usize, self.integrated_rows(grid));
        // Change of the relief phase across a cell, in radians, and the number of nodes raised beyond a corner.
        let cell_phase = self.integral.phase_max() * grid.cell_cosine();
        let reach = ((cell_phase / PI) as usize).min(DEEP_REACH_MAX);
        let is_deep = reach > 0 || self.integral.has_ridges() && cell_phase > DEEP_PHASE;
        let deficits = self.deficits(nodes, b, is_deep, steps);
        // A node is raised by the largest deficit of the cells about it.
        let increase = if is_deep { DEEP_INCREASE } else { 1.0 };
        let mut raises = vec![[0f32; K]; nodes.values.len()];
        for i in 0..self.gaps() * cells * cells {
            let [gap, y, x] = [i / cells / cells, i / cells % cells, i % cells];
            // Mirrored cells have equal deficits, which are stored for one of them.
            let row = if self.is_mirrored { y.min(cells - 1 - y) } else { y };
            let deficit = deficits[(gap * rows + row) * cells + x].map(|deficit| deficit * increase);
            if deficit == [0.0; K] {
                continue;
            }
            // Range of the nodes of a cell along one axis, and of `reach` nodes beyond on either side.
            let about = |at: usize, last: usize| at.saturating_sub(reach)..=(at + 1 + reach).min(last);
            for group in about(gap, self.groups - 1) {
                for (y, x) in about(y, cells).flat_map(|y| about(x, cells).map(move |x| (y, x))) {
                    let node = group * grid.in_plane() + y * grid.side() + x;
                    raises[node] = std::array::from_fn(|k| raises[node][k].max(deficit[k]));
                }
            }
        }
        for (values, raise) in nodes.values.iter_mut().zip(raises) {
            values.iter_mut().zip(raise).for_each(|(value, raise)| *value += raise);
        }
    }

    /// Deficits of the cells in the integrated rows, `[gap][y][x]`; arguments are those of [`Builder::deficit`].
    fn deficits(&self, table: &Nodes<K>, b: &Nodes<K>, is_deep: bool, steps: &Steps) -> Vec<[f32; K]> {
        let (cells, rows) = (table.grid.cells as usize, self.integrated_rows(table.grid));
        let deficit_of = |i: usize| {
            steps.one();
            self.deficit(table, b, [i / cells / rows, i / cells % rows, i % cells], is_deep)
        };
        (0..self.gaps() * rows * cells).into_par_iter().map(deficit_of).collect()
    }

    /// Deficit of the cell `[gap, y, x]` in each plane. `b` has the coarse nodes with the known divisors.
    fn deficit(&self, table: &Nodes<K>, b: &Nodes<K>, cell: [usize; 3], is_deep: bool) -> [f32; K] {
        let (grid, [gap, y, x]) = (table.grid, cell);
        let corners = self.corners(grid, cell);
        // A value of zero divides nothing.
        let is_divided = corners.iter().any(|&node| table.values[node] != [0.0; K]);
        // Check points: fractions of the cell along x, along y and to the next group.
        let inside: &[[f64; 3]] = match is_deep {
            true => &DEEP_CHECK_POINTS,
            false if is_divided => &[[0.5; 3]],
            false => &[],
        };
        // Cells on the horizon have further check points close to it; others have none here.
        let rim = grid.on_rim([x, y]).map(|[x, y]| [x, y, 0.5]);
        let mut deficit = [0f32; K];
        for point in inside.iter().copied().chain(rim) {
            let (wi, radius) = grid.direction([x as f64 + point[0], y as f64 + point[1]]);
            // No direction lies beyond the horizon.
            if radius >= 1.0 {
                continue;
            }
            // Trilinear interpolation of the table.
            let mut interpolated = [0.0; K];
            for (corner, node) in corners.into_iter().enumerate() {
                let fraction = |axis: usize| if corner >> axis & 1 == 0 { 1.0 - point[axis] } else { point[axis] };
                let weight = fraction(0) * fraction(1) * fraction(2);
                (0..K).for_each(|k| interpolated[k] += weight * f64::from(table.values[node][k]));
            }
            let group_at = if self.groups > 1 { gap as f64 + point[2] } else { 0.0 };
            // Orders are not moved onto ridges, and the margin is not added: both are for nodes alone.
            let (ridge, is_node) = (None, false);
            let t = self.divisor(wi, group_at, &(self.group)(group_at), Some(b), ridge);
            let needed = self.tabulated(t, is_node, wi, radius, grid);
            deficit = std::array::from_fn(|k| deficit[k].max((needed[k] - interpolated[k]) as f32));
        }
        deficit
    }

    /// Indices of the nodes at the corners of the cell `[gap, y, x]`. Bits 0, 1 and 2 of a corner's number are steps
    /// along x, along y and to the next group.
    fn corners(&self, grid: Grid, [gap, y, x]: [usize; 3]) -> [usize; 8] {
        std::array::from_fn(|corner| {
            let group = (gap + (corner >> 2)).min(self.groups - 1);
            group * grid.in_plane() + (y + (corner >> 1 & 1)) * grid.side() + x + (corner & 1)
        })
    }
}
