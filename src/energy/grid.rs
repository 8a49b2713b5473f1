//! Directions on a square grid.
//!
//! `X = x/√((1 + √cosθ)(1 + cosθ))`, and Y alike, lie in the unit disc: `X² + Y² = 1 − √cosθ`. That is regular about the normal, needs
//! no trigonometry, and goes as √cosθ towards the horizon, where albedos change most.

use super::AlbedoLayout;
use crate::numeric::{Index, Number, Numbers, Real};
use crate::scattering::Vec3;

/// Cosines are not taken below this; as for [`crate::scattering::Pair`].
const COSINE_MIN: f64 = 1e-7;
/// cosθ at which nodes on the horizon and beyond it are evaluated.
const RIM_COSINE: f64 = 1e-4;

/// A direction's place in the grid.
pub(crate) struct GridPlace<N: Numbers> {
    /// Number of its cell in a plane.
    pub cell: N::Index,
    /// Fractions towards the next node along x and y.
    pub x: N::Real,
    pub y: N::Real,
    /// 1/cos²θ, which the tabulated excess is multiplied by.
    pub per_squared_cosine: N::Real,
}

/// Where in a grid of `cells` along a side a direction of unit length lies.
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

impl AlbedoLayout {
    /// Nodes along a side.
    pub(super) fn side(&self) -> usize {
        self.cells as usize + 1
    }

    /// Cells of a plane.
    pub(super) fn cells_in_plane(&self) -> usize {
        (self.cells * self.cells) as usize
    }

    /// Nodes of a plane.
    pub(super) fn in_plane(&self) -> usize {
        self.side() * self.side()
    }

    /// The direction at a place in nodes along x and y, on the horizon if it lies beyond; and how far from the middle of the disc, in radii.
    pub(super) fn direction(&self, at: [f64; 2]) -> (Vec3, f64) {
        let [x, y] = at.map(|at| 2.0 * at / f64::from(self.cells) - 1.0);
        let radius = x.hypot(y);
        let cos = (1.0 - radius.min(1.0).powi(2)).powi(2).max(RIM_COSINE);
        let sin = (1.0 - cos * cos).max(0.0).sqrt();
        let scale = if radius > 0.0 { sin / radius } else { 0.0 };
        ([x * scale, y * scale, cos], radius)
    }

    /// Whether a node so far from the middle of the disc, in radii, belongs to no cell that has a part of the disc.
    pub(super) fn is_beyond(&self, radius: f64) -> bool {
        radius > 1.0 + 8f64.sqrt() / f64::from(self.cells)
    }
}
