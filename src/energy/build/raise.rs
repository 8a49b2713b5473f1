//! Raises the nodes about cells in which the table lies below the divisor that it needs: the last step of a build.
//!
//! Symbols are those of [`build.rs`](super): `t` is the divisor that a direction needs, and `b` a known lower bound of
//! divisors. Nodes lie on the corners of the grid's cells, in planes of wavelength with gaps between them. A node has
//! `(A − 1)·cos²θ` of its divisor A.
//!
//! - The *deficit* of a cell is the largest amount by which the value that `t` requires exceeds the table, linear
//!   between nodes, at the cell's check points. It is never negative.
//! - A relief is *deep* if its phase changes so much across a cell that `t` fluctuates there ([`DEEP_PHASE`]).

use super::{Builder, Nodes};
use crate::table::Steps;
use rayon::prelude::*;
use std::f64::consts::PI;

/// Largest number of nodes beyond a cell's corners, along each axis, that are raised with the corners. The number is
/// one for each half turn by which the *relief phase* changes across a cell. This is the phase between the relief's
/// lowest and highest point (`AlbedoIntegral::phase_max`), in proportion to cosθ. Chosen: a larger limit darkens
/// reliefs tens of µm deep.
const DEEP_REACH_MAX: usize = 3;
/// Change of the relief phase across a cell, in radians, from which reliefs with ridges count as deep, and transparent
/// bodies (`transparent.rs`). Other reliefs count as deep from half a turn, π. With π for all, an albedo of 1.037
/// remains on a rough relief 1.2 µm deep.
pub(in crate::energy) const DEEP_PHASE: f64 = 2.0;
/// Check points within a cell of a deep relief, in place of its centre: fractions of the cell along x, y and plane.
/// Chosen half-way between its centre and four of its corners.
const DEEP_CHECK_POINTS: [[f64; 3]; 4] =
    [[0.25, 0.25, 0.25], [0.75, 0.75, 0.25], [0.25, 0.75, 0.75], [0.75, 0.25, 0.75]];
/// Factor on the deficits of deep reliefs, which are found at a few points only. With 1 an albedo of 1.03 remains on a
/// relief 2 µm deep.
const DEEP_INCREASE: f32 = 1.5;

impl Builder<'_> {
    /// Raises the corners of the cells that have a deficit. `b` has the coarse nodes with the known divisors.
    ///
    /// - Cells are checked in their centre, unless nothing is divided at any corner.
    /// - Cells on the horizon are also checked close to it (`Grid::on_rim`).
    /// - All cells of deep reliefs are checked, at several points, and nodes further off are raised as well.
    pub(super) fn raise_cells(&self, nodes: &mut Nodes, b: &Nodes, steps: &Steps) {
        let grid = nodes.grid;
        let (cells, rows, gaps) = (grid.cells as usize, self.integrated_rows(grid), self.planes - 1);
        // Change of the relief phase across a cell, in radians, and the number of nodes raised beyond a corner.
        let cell_phase = self.integral.phase_max() * grid.cell_cosine();
        let reach = ((cell_phase / PI) as usize).min(DEEP_REACH_MAX);
        let is_deep = reach > 0 || (self.integral.has_ridges() && cell_phase > DEEP_PHASE);
        let increase = if is_deep { DEEP_INCREASE } else { 1.0 };
        // Deficits `[gap][y][x]` of the cells in the integrated rows.
        let deficit = |i: usize| {
            steps.one();
            increase * self.deficit(nodes, b, [i % cells, i / cells % rows, i / cells / rows], is_deep)
        };
        let deficits: Vec<f32> = (0..gaps * rows * cells).into_par_iter().map(deficit).collect();
        // A node is raised by the largest deficit of the cells about it.
        let mut raises = vec![0f32; nodes.values.len()];
        for i in 0..gaps * cells * cells {
            let [x, y, gap] = [i % cells, i / cells % cells, i / cells / cells];
            // Mirrored cells have equal deficits, which are stored for one of them.
            let row = if self.is_mirrored { y.min(cells - 1 - y) } else { y };
            let deficit = deficits[(gap * rows + row) * cells + x];
            if deficit == 0.0 {
                continue;
            }
            // Range of the nodes of a cell along one axis, and of `reach` nodes beyond on either side.
            let about = |at: usize, last: usize| at.saturating_sub(reach)..=(at + 1 + reach).min(last);
            for plane in about(gap, gaps) {
                for (y, x) in about(y, cells).flat_map(|y| about(x, cells).map(move |x| (y, x))) {
                    let node = plane * grid.in_plane() + y * grid.side() + x;
                    raises[node] = raises[node].max(deficit);
                }
            }
        }
        nodes.values.iter_mut().zip(raises).for_each(|(value, raise)| *value += raise);
    }

    /// Deficit of the cell `[x, y, gap]`. `b` has the coarse nodes with the known divisors.
    fn deficit(&self, table: &Nodes, b: &Nodes, cell: [usize; 3], is_deep: bool) -> f32 {
        let grid = table.grid;
        // Position of a check point, given as fractions of the cell.
        let position = |point: [f64; 3]| [0, 1, 2].map(|axis| cell[axis] as f64 + point[axis]);
        // A value of zero divides nothing. Values are not negative, so that the centre's is zero if all corners' are.
        let is_divided = table.value(position([0.5; 3])) > 0.0;
        // Check points: fractions of the cell along x, along y and to the next plane.
        let inside: &[[f64; 3]] = match is_deep {
            true => &DEEP_CHECK_POINTS,
            false if is_divided => &[[0.5; 3]],
            false => &[],
        };
        // Cells on the horizon have further check points close to it; others have none here.
        let rim = grid.on_rim([cell[0], cell[1]]).map(|[x, y]| [x, y, 0.5]);
        let mut deficit = 0.0;
        for point in inside.iter().copied().chain(rim) {
            let [x, y, plane] = position(point);
            let (wi, radius) = grid.direction([x, y]);
            // No direction lies beyond the horizon.
            if radius < 1.0 {
                // Orders are not moved onto ridges, and there is no margin: both are for nodes alone.
                let (ridge, margin) = (None, 0.0);
                let t = self.divisor(wi, plane, Some(b), ridge);
                let needed = self.tabulated(t, margin, wi, radius, grid);
                deficit = f64::max(deficit, needed - table.value([x, y, plane]));
            }
        }
        deficit as f32
    }
}
