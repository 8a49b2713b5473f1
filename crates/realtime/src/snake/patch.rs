//! The vertices of one scale: a grid over its visible part. lattice.rs defines root, flanks, tip, free edge and foot.
//!
//! The visible part is bounded by four curves: the scale's own two free edges towards the tail, and the feet of the two
//! scales before it, under which it comes out. A Coons patch, the bilinear blend of four boundary curves, maps the unit
//! square to it.

use glam::DVec2;

use super::lattice::{Lattice, Side};

/// The visible part of scale (i, j), over coordinates `x`, `y` in [0, 1]. The root is at (0, 0), the node of the left
/// flank at (1, 0), that of the right flank at (0, 1), and the tip at (1, 1). The free edges are `x` = 1 and `y` = 1.
pub(super) struct Patch<'a> {
    lattice: &'a Lattice,
    scale: (i64, i64),
}

impl<'a> Patch<'a> {
    /// The patch of scale (i, j), where i + j is even.
    pub(super) fn new(lattice: &'a Lattice, scale: (i64, i64)) -> Self {
        Self { lattice, scale }
    }

    /// Whether the sheet contains the vertex `x`, `y` of a grid of `cells`²; it ends in the middle of the scales on its
    /// rim.
    pub(super) fn covers(&self, x: usize, y: usize, cells: usize) -> bool {
        let (i, j) = self.scale;
        (i > 0 || x + y >= cells)
            && (i < self.lattice.rows_along || x + y <= cells)
            && (j > 0 || x <= y)
            && (j < self.lattice.rows_around || x >= y)
    }

    /// The point of the lattice at `x`, `y`: a Coons patch of the four edges.
    pub(super) fn point(&self, x: f64, y: f64) -> DVec2 {
        let [root_left, root_right, free_left, free_right] =
            [Edge::RootLeft, Edge::RootRight, Edge::FreeLeft, Edge::FreeRight]
                .map(|edge| move |t: f64| self.edge(edge, t));
        let between = root_left(x).lerp(free_right(x), y) + root_right(y).lerp(free_left(y), x);
        let corners = root_left(0.0).lerp(root_right(1.0), y).lerp(root_left(1.0).lerp(free_right(1.0), y), x);
        between - corners
    }

    /// A point of an edge; `t` is 0 at the end nearer to the root. At the ends of the sheet the missing edges are
    /// mirror images of the others, so that scales end there in a straight line.
    fn edge(&self, edge: Edge, t: f64) -> DVec2 {
        let (i, j) = self.scale;
        let rows = self.lattice.rows_along;
        let mirrored = |other: Edge| {
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
            Edge::FreeLeft => self.lattice.lip((i, j), Side::Left, t),
            Edge::FreeRight => self.lattice.lip((i, j), Side::Right, t),
        }
    }
}

/// The sides of the grid: two at the root, two free ones.
#[derive(Clone, Copy)]
enum Edge {
    /// From the root to the left flank: the foot of the scale before it on the left.
    RootLeft,
    /// From the root to the right flank: the foot of the scale before it on the right.
    RootRight,
    /// From the left flank to the tip.
    FreeLeft,
    /// From the right flank to the tip.
    FreeRight,
}
