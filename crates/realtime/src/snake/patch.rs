//! Where the vertices of one scale lie: a grid over the part of it that is seen, whose sides are the edges of scales.

use glam::DVec2;

use super::lattice::{Lattice, Side};

/// The part of scale (i, j) that is seen, over coordinates `x`, `y` in [0, 1]: the root at (0, 0), the node at the left
/// flank at (1, 0), that at the right one at (0, 1), the tip at (1, 1). The free edges are `x` = 1 and `y` = 1.
pub(super) struct Patch<'a> {
    lattice: &'a Lattice,
    scale: (i64, i64),
}

impl<'a> Patch<'a> {
    /// The patch of scale (i, j) of even sum.
    pub(super) fn new(lattice: &'a Lattice, scale: (i64, i64)) -> Self {
        Self { lattice, scale }
    }

    /// Whether the sheet, which ends in the middle of the scales on its rim, has the point `x`, `y` of so many cells.
    pub(super) fn covers(&self, x: usize, y: usize, cells: usize) -> bool {
        let (i, j) = self.scale;
        (i > 0 || x + y >= cells)
            && (i < self.lattice.rows_along || x + y <= cells)
            && (j > 0 || x <= y)
            && (j < self.lattice.rows_around || x >= y)
    }

    /// The point of the lattice: Coons' patch, which blends the four edges.
    pub(super) fn point(&self, x: f64, y: f64) -> DVec2 {
        let [root_left, root_right, free_left, free_right] =
            [Edge::RootLeft, Edge::RootRight, Edge::FreeLeft, Edge::FreeRight]
                .map(|edge| move |t: f64| self.edge(edge, t));
        let between = root_left(x).lerp(free_right(x), y) + root_right(y).lerp(free_left(y), x);
        let corners = root_left(0.0).lerp(root_right(1.0), y).lerp(root_left(1.0).lerp(free_right(1.0), y), x);
        between - corners
    }

    /// A point of an edge, 0 at its end nearer to the root. At the ends of the sheet, scales end in a straight line across
    /// because the edges that are cut off there are mirror images of the others.
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

#[derive(Clone, Copy)]
enum Edge {
    RootLeft,
    RootRight,
    FreeLeft,
    FreeRight,
}
