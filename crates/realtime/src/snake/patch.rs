//! The visible part of one scale, over which mesh.rs lays a grid. lattice.rs defines root, flanks, tip, free edge and
//! foot. All scales form the *sheet*; scale (i, j) lies at i along it from the head and j around the body, both in half
//! scales.
//!
//! The visible part is bounded by four curves: the scale's own two free edges towards the tail, and the feet of the two
//! scales nearer to the head, under which the scale comes out. A Coons patch, the bilinearly blended surface of four
//! boundary curves, maps the unit square to the visible part.

use glam::DVec2;

use super::lattice::{Lattice, Side};

/// The visible part of scale (i, j), over coordinates `x`, `y` in [0, 1]. The root is at (0, 0) and the tip at (1, 1).
/// The node of the left flank is at (1, 0), that of the right flank at (0, 1). The free edges are `x` = 1 and `y` = 1.
pub(super) struct Patch<'a> {
    lattice: &'a Lattice,
    scale: (i64, i64),
}

impl<'a> Patch<'a> {
    /// The patch of scale (i, j). Scales lie only where i + j is even.
    pub(super) fn new(lattice: &'a Lattice, scale: (i64, i64)) -> Self {
        Self { lattice, scale }
    }

    /// Whether the sheet contains the vertex (`x`, `y`) of a grid of `cells`² cells, where `x` and `y` count from 0 to
    /// `cells`. The sheet ends in the middle of the scales on its rim: on the diagonal between the flanks at head and
    /// tail, and on the axis from root to tip at the sides.
    pub(super) fn covers(&self, x: usize, y: usize, cells: usize) -> bool {
        let (i, j) = self.scale;
        (i > 0 || x + y >= cells)
            && (i < self.lattice.rows_along || x + y <= cells)
            && (j > 0 || x <= y)
            && (j < self.lattice.rows_around || x >= y)
    }

    /// The point `(i, j)` of the lattice, in half scales, at `x`, `y` in [0, 1]: the interpolations between both pairs
    /// of opposite edges, less the bilinear interpolation of the corners.
    pub(super) fn point(&self, x: f64, y: f64) -> DVec2 {
        let root_left = |t| self.edge(Edge::RootLeft, t);
        let root_right = |t| self.edge(Edge::RootRight, t);
        let free_left = |t| self.edge(Edge::FreeLeft, t);
        let free_right = |t| self.edge(Edge::FreeRight, t);
        let between_edges = root_left(x).lerp(free_right(x), y) + root_right(y).lerp(free_left(y), x);
        let (root, left_flank) = (root_left(0.0), root_left(1.0));
        let (right_flank, tip) = (root_right(1.0), free_right(1.0));
        between_edges - root.lerp(right_flank, y).lerp(left_flank.lerp(tip, y), x)
    }

    /// A point of an edge, from its end nearer to the root (`t` = 0) to its other end (`t` = 1). On the scales at the
    /// two ends of the sheet, the edges beyond the end are mirror images of the others. The sheet then ends in a
    /// straight line. Its sides are straight by [`Lattice::traits`].
    fn edge(&self, edge: Edge, t: f64) -> DVec2 {
        let (i, j) = self.scale;
        let rows = self.lattice.rows_along;
        let mirrored = |other: Edge| {
            // Reflection about the line of equal i through the scale's centre. A point's components x, y are i and j.
            let point = self.edge(other, 1.0 - t);
            DVec2::new(2.0 * i as f64 - point.x, point.y)
        };
        match edge {
            Edge::RootLeft if i == 0 => mirrored(Edge::FreeLeft),
            Edge::RootRight if i == 0 => mirrored(Edge::FreeRight),
            Edge::FreeLeft if i == rows => mirrored(Edge::RootLeft),
            Edge::FreeRight if i == rows => mirrored(Edge::RootRight),
            Edge::RootLeft => self.lattice.foot((i - 1, j - 1), Side::Right, t),
            Edge::RootRight => self.lattice.foot((i - 1, j + 1), Side::Left, t),
            Edge::FreeLeft => self.lattice.free_edge((i, j), Side::Left, t),
            Edge::FreeRight => self.lattice.free_edge((i, j), Side::Right, t),
        }
    }
}

/// The sides of the grid: two from the root to the flanks, and the two free edges.
#[derive(Clone, Copy)]
enum Edge {
    /// From the root to the left flank (`y` = 0): the foot of scale (i − 1, j − 1), whose right free edge lies over it.
    RootLeft,
    /// From the root to the right flank (`x` = 0): the foot of scale (i − 1, j + 1), whose left free edge lies over it.
    RootRight,
    /// From the left flank to the tip (`x` = 1).
    FreeLeft,
    /// From the right flank to the tip (`y` = 1).
    FreeRight,
}
