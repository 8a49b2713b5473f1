//! Square grid over the hemisphere of directions.
//!
//! The direction `(x, y, cosθ)` lies at `X = x/√((1 + √cosθ)(1 + cosθ))` and `Y = y/√((1 + √cosθ)(1 + cosθ))`. Since
//! `x² + y² = 1 − cos²θ`, its squared radius is `X² + Y² = 1 − √cosθ`: the hemisphere fills the unit disc, with the
//! horizon at the rim. The grid divides the square [−1, 1]² around the disc into equal cells. The map needs no
//! trigonometry, is regular at the normal, and is fine towards the horizon, where albedos change most.
//!
//! A *plane* of a table has the values of one wavelength or colour band on this grid.

use crate::numeric::{Index, Number, Numbers, Real};
use crate::scattering::{COSINE_MIN, Vec3};

/// Values of cosθ at which the interpolation in cells on the horizon is checked (`build/raise.rs`): 89.94°, 89.77° and
/// 89.08°. Chosen: the albedo of wide orders has a pole at the horizon that is confined to the last degree.
///
/// Nodes on the rim and beyond it are evaluated at the first, since the albedo may be infinite at cosθ = 0. One cell
/// inside the rim of the finest grid (48 cells, `build.rs`) the cosine is 0.007.
const RIM_COSINES: [f64; 3] = [1e-3, 4e-3, 1.6e-2];

/// Place of a direction in a grid.
pub(crate) struct GridPlace<N: Numbers> {
    /// Index of its cell in a plane, `[y][x]`.
    pub cell: N::Index,
    /// Position in the cell along x, from 0 at the lower node to 1 at the upper.
    pub x: N::Real,
    /// Position in the cell along y, from 0 at the lower node to 1 at the upper.
    pub y: N::Real,
    /// 1/cos²θ, the factor on the tabulated excess `(A − 1)·cos²θ` of the divisor A (`mod.rs`).
    pub per_squared_cosine: N::Real,
}

/// Place of a direction of unit length in a grid with `cells` along each side. Directions below the horizon are treated
/// like those on it.
#[inline(always)]
pub(super) fn place<N: Numbers>(cells: u32, w: [N::Real; 3]) -> GridPlace<N> {
    let lit = |value: f64| N::Real::lit(value);
    // `[x, y]·scale` are the X and Y of the module, from −1 to 1.
    let cos = w[2].clip(lit(COSINE_MIN), lit(1.0));
    let scale = lit(1.0) / ((lit(1.0) + cos.sqrt()) * (lit(1.0) + cos)).sqrt();
    let count = f64::from(cells);
    // Cell along one axis, and the position in it.
    let along = |x: N::Real| {
        let position = (x * scale).fma(lit(0.5 * count), lit(0.5 * count)).clip(lit(0.0), lit(count));
        let cell = position.floor().min(lit(count - 1.0));
        (N::index(cell), position - cell)
    };
    let ((ix, x), (iy, y)) = (along(w[0]), along(w[1]));
    let per_squared_cosine = lit(1.0) / (cos * cos);
    GridPlace { cell: iy * N::Index::lit(cells) + ix, x, y, per_squared_cosine }
}

/// Grid of one plane. Its nodes, the corners of the cells, are numbered `[y][x]`.
#[derive(Clone, Copy)]
pub(super) struct Grid {
    /// Number of cells along each side.
    pub cells: u32,
}

impl Grid {
    /// Number of nodes along each side.
    pub(super) fn side(self) -> usize {
        self.cells as usize + 1
    }

    /// Number of nodes of a plane.
    pub(super) fn in_plane(self) -> usize {
        self.side() * self.side()
    }

    /// Largest change of cosθ along a cell's side. At the radius r, `cosθ = (1 − r²)²` is steepest at `r² = 1/3`, with
    /// the slope `8/(3√3)`. A cell's side is 2 over the number of cells.
    pub(super) fn cell_cosine(self) -> f64 {
        16.0 / (3.0 * 3f64.sqrt()) / f64::from(self.cells)
    }

    /// Position of a node along x and y, in cells from the first node.
    pub(super) fn position(self, node: usize) -> [f64; 2] {
        [node % self.side(), node / self.side()].map(|at| at as f64)
    }

    /// Node on the other side of the x axis: the same column, and the row counted from the other end.
    pub(super) fn mirrored(self, node: usize) -> usize {
        let (row, column) = (node / self.side(), node % self.side());
        (self.side() - 1 - row) * self.side() + column
    }

    /// Direction at a `position` along x and y in cells from the first node, and the position's radius `√(X² + Y²)`.
    /// Positions beyond the rim of the disc get the direction at the rim; their radius exceeds 1. Cosines are at least
    /// the first of [`RIM_COSINES`].
    pub(super) fn direction(self, position: [f64; 2]) -> (Vec3, f64) {
        let [x, y] = position.map(|p| 2.0 * p / f64::from(self.cells) - 1.0);
        let radius = x.hypot(y);
        // From X² + Y² = 1 − √cosθ.
        let cos = (1.0 - radius.min(1.0).powi(2)).powi(2).max(RIM_COSINES[0]);
        let sin = (1.0 - cos * cos).max(0.0).sqrt();
        let scale = if radius > 0.0 { sin / radius } else { 0.0 };
        ([x * scale, y * scale, cos], radius)
    }

    /// Check points of a cell near the horizon, `[x, y]` in cells from its first corner. They lie on the ray from the
    /// centre of the disc through the cell's centre, at [`RIM_COSINES`]; points outside the cell are left out.
    pub(super) fn on_rim(self, cell: [usize; 2]) -> impl Iterator<Item = [f64; 2]> {
        let half = 0.5 * f64::from(self.cells);
        // Centre of the cell, in cells from the centre of the disc. It is not (0, 0), as the number of cells is even.
        let centre = cell.map(|at| at as f64 + 0.5 - half);
        let length = centre[0].hypot(centre[1]);
        RIM_COSINES.into_iter().filter_map(move |cos| {
            // Radius √(1 − √cosθ), in cells.
            let radius = half * (1.0 - cos.sqrt()).sqrt();
            let point = [0, 1].map(|axis| centre[axis] * radius / length + half - cell[axis] as f64);
            point.iter().all(|at| (0.0..=1.0).contains(at)).then_some(point)
        })
    }

    /// Whether the distance of a node from the rim, outwards, exceeds the diagonal of a cell, `√2·2/cells`. Such a node
    /// belongs to no cell that overlaps the disc. `radius` is its distance from the centre of the disc.
    pub(super) fn is_beyond(self, radius: f64) -> bool {
        radius > 1.0 + 8f64.sqrt() / f64::from(self.cells)
    }
}
