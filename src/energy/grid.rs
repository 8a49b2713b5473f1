//! A square grid over the disc of directions.
//!
//! `X = x/√((1 + √cosθ)(1 + cosθ))`, and Y alike, lie in the unit disc: `X² + Y² = 1 − √cosθ`. The map needs no
//! trigonometry, is regular at the normal, and is fine towards the horizon, where albedos change most.

use crate::numeric::{Index, Number, Numbers, Real};
use crate::scattering::Vec3;

/// Smallest cosine that is told from the horizon, as in [`crate::scattering::Pair`].
const COSINE_MIN: f64 = 1e-7;
/// cosθ at which nodes on the horizon and beyond it are evaluated. Chosen: small against 0.007, one cell of the finest
/// grid inside.
const RIM_COSINE: f64 = 1e-4;

/// Cosines θ at which cells on the horizon are checked: 89.94° and 89.83°. Chosen: wide orders have a pole of
/// the albedo at the horizon that is confined to the last tenths of a degree.
const RIM_COSINES: [f64; 2] = [1e-3, 3e-3];

/// A direction's place in a grid.
pub(crate) struct GridPlace<N: Numbers> {
    /// Number of its cell in a plane.
    pub cell: N::Index,
    /// Fraction of the cell towards the next node along x.
    pub x: N::Real,
    /// Fraction of the cell towards the next node along y.
    pub y: N::Real,
    /// 1/cos²θ, the factor on the tabulated excess.
    pub per_squared_cosine: N::Real,
}

/// The place of a direction of unit length in a grid of `cells` along a side.
#[inline(always)]
pub(super) fn place<N: Numbers>(cells: u32, w: [N::Real; 3]) -> GridPlace<N> {
    let lit = |value: f64| N::Real::lit(value);
    let cos = w[2].clip(lit(COSINE_MIN), lit(1.0));
    let scale = lit(1.0) / ((lit(1.0) + cos.sqrt()) * (lit(1.0) + cos)).sqrt();
    let half = f64::from(cells) * 0.5;
    let along = |x: N::Real| {
        let at = (x * scale).fma(lit(half), lit(half)).clip(lit(0.0), lit(2.0 * half));
        let cell = at.floor().min(lit(2.0 * half - 1.0));
        (N::index(cell), at - cell)
    };
    let ((ix, x), (iy, y)) = (along(w[0]), along(w[1]));
    let per_squared_cosine = lit(1.0) / (cos * cos);
    GridPlace { cell: iy * N::Index::lit(cells) + ix, x, y, per_squared_cosine }
}

/// A grid of so many cells along a side; nodes of a plane are numbered `[y][x]`.
#[derive(Clone, Copy)]
pub(super) struct Grid {
    pub cells: u32,
}

impl Grid {
    /// Nodes along a side.
    pub(super) fn side(self) -> usize {
        self.cells as usize + 1
    }

    /// Nodes of a plane.
    pub(super) fn in_plane(self) -> usize {
        self.side() * self.side()
    }

    /// The node on the other side of the x axis.
    pub(super) fn mirrored(self, node: usize) -> usize {
        let row = node / self.side();
        node - row * self.side() + (self.side() - 1 - row) * self.side()
    }

    /// The direction at a position in cells, on the horizon if it lies beyond, and its distance from the middle in
    /// radii of the disc.
    pub(super) fn direction(self, at: [f64; 2]) -> (Vec3, f64) {
        let [x, y] = at.map(|at| 2.0 * at / f64::from(self.cells) - 1.0);
        let radius = x.hypot(y);
        let cos = (1.0 - radius.min(1.0).powi(2)).powi(2).max(RIM_COSINE);
        let sin = (1.0 - cos * cos).max(0.0).sqrt();
        let scale = if radius > 0.0 { sin / radius } else { 0.0 };
        ([x * scale, y * scale, cos], radius)
    }

    /// Places within the cell at which it is checked near the horizon, in cells from its first corner: the ray from the
    /// middle of the disc through the cell's centre at [`RIM_COSINES`].
    pub(super) fn on_rim(self, cell: [usize; 2]) -> impl Iterator<Item = [f64; 2]> {
        let half = 0.5 * f64::from(self.cells);
        let centre = cell.map(|at| at as f64 + 0.5 - half);
        let length = centre[0].hypot(centre[1]);
        RIM_COSINES.into_iter().filter_map(move |cos| {
            let radius = half * (1.0 - cos.sqrt()).sqrt();
            let place = [0, 1].map(|axis| centre[axis] * radius / length + half - cell[axis] as f64);
            place.iter().all(|at| (0.0..=1.0).contains(at)).then_some(place)
        })
    }

    /// Whether a node at a distance from the middle, in radii of the disc, touches no cell that overlaps the disc.
    pub(super) fn is_beyond(self, radius: f64) -> bool {
        radius > 1.0 + 8f64.sqrt() / f64::from(self.cells)
    }
}
