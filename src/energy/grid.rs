//! Square grid over the hemisphere of directions.
//!
//! The direction `(x, y, cosθ)` lies at `X = x/√((1 + √cosθ)(1 + cosθ))` and `Y = y/√((1 + √cosθ)(1 + cosθ))`. Since
//! `x² + y² = 1 − cos²θ`, its squared radius is `X² + Y² = 1 − √cosθ`: the hemisphere fills the unit disc, with the
//! horizon at the rim. The grid divides the square [−1, 1]² around the disc into equal cells. The map needs no
//! trigonometry, is regular at the normal, and is fine towards the horizon, where albedos change most.
//!
//! A *plane* of a table has the values of one wavelength on this grid.

use crate::numeric::{Index, Number, Numbers, Real};
use crate::scattering::{COSINE_MIN, Vec3};

/// Smallest cosθ at nodes on the rim and beyond it, since the albedo may be infinite at the horizon. One cell inside
/// the rim of the finest grid (56 cells, `build.rs`) the cosine is 0.005.
const RIM_COSINE: f64 = 1e-3;

/// Place of a direction in a grid.
pub(crate) struct GridPlace<N: Numbers> {
    /// Index of its cell in a plane, `[y][x]`; below a transparent body, plus the number of packets of the side above.
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
    /// [`RIM_COSINE`].
    pub(super) fn direction(self, position: [f64; 2]) -> (Vec3, f64) {
        let [x, y] = position.map(|p| 2.0 * p / f64::from(self.cells) - 1.0);
        let radius = x.hypot(y);
        // From X² + Y² = 1 − √cosθ.
        let cos = (1.0 - radius.min(1.0).powi(2)).powi(2).max(RIM_COSINE);
        let sin = (1.0 - cos * cos).max(0.0).sqrt();
        let scale = if radius > 0.0 { sin / radius } else { 0.0 };
        ([x * scale, y * scale, cos], radius)
    }
}
