//! Fills the nodes of albedo tables, in the steps of the [module](super).
//!
//! ```text
//! f(wi, wo)  reflectance of the model in 1/sr
//! a(wi)      its albedo, ∫ f cosθo dωo
//! A(w)       divisor of a direction: f is divided by max(1, A(wi), A(wo)). The table holds (A − 1)·cos²θ, with θ the
//!            angle of w with the normal
//! b(w)       known lower bound of the divisor: 1 ≤ b ≤ max(1, A)
//! I(T)       ∫ f min(1, T/b(wo)) cosθo dωo. With T = max(1, A(wi)), I(T)/T bounds the albedo after division
//! t(wi)      least t ≥ 1 with I(t) ≤ t: the smallest divisor of wi with which no albedo above 1 remains
//! ```
//!
//! - A *plane* has the nodes of one wavelength on the square grid over directions (`grid.rs`). A position among planes
//!   is 0 at the first, and may lie between two. A *gap* is the interval between two neighbouring planes.
//! - A *node* is a corner of the grid's cells in one plane. *Quadrature nodes* of an integral have their full name.
//! - The *excess* of an albedo or a divisor is its difference from one, such as `A − 1`.
//! - An *order* is a narrow node of the spectral table (`integral.rs`). A *ridge* is a narrow maximum of `t` along the
//!   incidences from which an order leaves along the surface. Ridges lie between the nodes. A node therefore stands for
//!   a *box* of incidences and wavelengths around it. An order whose ridge crosses the box counts as if it left on the
//!   ridge ([`Ridge`]).
//! - The *coarse* grid and the coarse planes are every other ([`COARSE_STRIDE`]) of the table's.

mod raise;

pub(super) use raise::DEEP_PHASE;

use super::grid::{Grid, place};
use super::integral::AlbedoIntegral;
use super::ridge::Ridge;
use crate::numeric::math::lerp;
use crate::numeric::{Lanes, Numbers, Real, VALUES_MAX, Values};
use crate::scattering::Vec3;
use crate::table::{Progress, Steps};
use rayon::prelude::*;

/// Numbers of cells along each side and of planes of a table with ridges. Chosen for albedos of at most 1.01
/// (`tests/core/energy.rs`). Cells are even and planes odd, so that every other node forms a coarse grid. With 32 cells
/// and 11 planes ridges raise the divisor more widely, and the mean albedo of a blazed grating is lower by 0.02.
const SIZE_WITH_RIDGES: (u32, u32) = (48, 17);
/// Numbers of cells and planes of tables without ridges, chosen as those of [`SIZE_WITH_RIDGES`].
const SIZE_WITHOUT: (u32, u32) = (20, 9);
/// Numbers of cells and planes where the spectrum is continuous, and smoother than that of orders. They take half of the
/// time of [`SIZE_WITHOUT`].
const SIZE_CONTINUOUS: (u32, u32) = (16, 7);
/// Spacing of the coarse grid and planes, in nodes or planes of the table.
const COARSE_STRIDE: usize = 2;
/// Relative margin of a node's divisor for errors of interpolation. A smaller margin leaves larger albedos between
/// nodes. With 0.015 no measured albedo of a grating exceeds one, but mean albedos are lower by 0.003 to 0.008.
pub(super) const MARGIN: f64 = 0.007;
/// Relative increase of the excess per unit of excess, since a large divisor changes much within a cell. It matters for
/// reliefs a few µm deep.
const EXCESS_INCREASE: f64 = 0.007;
/// Excess of the divisor from which it gets the whole [`MARGIN`]. Smaller excesses get a proportional part, so that the
/// margin does not begin with a step. Chosen.
pub(super) const MARGIN_FROM: f64 = 0.05;
/// Relative increase of the excess at the rim of the grid, falling by a factor e² per cell. Light that leaves along the
/// surface is then divided by more: without it, an albedo of 1.026 remains at 26° on a random relief whose orders leave
/// there. Chosen large, since hardly any power leaves there.
const RIM_INCREASE: f64 = 3.0;
/// Relative increase of the excess at the horizon where orders have ridges, falling as `(1 − cosθ)¹⁶`, to a tenth at
/// 82°: ridges are narrowest there. With 0.3, albedos at a coherence length of 5 µm reach 1.03 beyond 85°.
const GRAZING_INCREASE: f64 = 0.6;
/// Excess of `t` that is attributed to errors of the quadrature, and set to zero. Chosen.
const NEGLIGIBLE: f64 = 3e-4;
/// Number of iterations for `t`. Every iterate is an upper bound of `t`. Chosen: more iterations darken less, but take
/// longer.
const ITERATIONS: usize = 4;
/// Half-side of a node's box ([`Ridge`]) along the grid's x and y, in cells. With 0.6 here and 0.5 for [`BOX_PLANES`]
/// albedos reach 1.04; with 1 here the mean albedo is lower by 0.01.
const BOX_CELLS: f64 = 0.7;
/// Half-side of a node's box ([`Ridge`]) along the wavelength, in planes; see [`BOX_CELLS`].
const BOX_PLANES: f64 = 0.6;

/// Four directions side by side.
type Real4 = <Lanes<'static> as Numbers>::Real;

/// Values `(A − 1)·cos²θ` at the nodes of a grid, in several planes of wavelength.
pub(super) struct Nodes {
    /// Grid of each plane.
    grid: Grid,
    /// Values `[plane][y][x]`.
    pub values: Vec<f32>,
}

/// Builder of the nodes of one table.
pub(super) struct Builder<'a> {
    /// Integral of the model's reflectance over outgoing directions.
    integral: &'a AlbedoIntegral<'a>,
    /// Number of planes: odd, so that every other belongs to the coarse ones, and at least three.
    planes: usize,
    /// Wavelength in nm at a position among the planes, up to one plane beyond the last.
    wavelength_nm: &'a (dyn Fn(f64) -> f64 + Sync),
    /// Whether the relief varies along x alone, so that directions mirrored at the x axis have equal albedos.
    is_mirrored: bool,
    /// Values of cosθo of orders on ridges ([`AlbedoIntegral::ridge_cosines`]); empty without ridges.
    ridge_cosines: Vec<f64>,
}

/// Number of cells along each side of a surface's table, and number of its planes of wavelength.
pub(super) fn resolution(integral: &AlbedoIntegral) -> (u32, u32) {
    match (integral.has_ridges(), integral.is_continuous()) {
        (true, _) => SIZE_WITH_RIDGES,
        (false, false) => SIZE_WITHOUT,
        (false, true) => SIZE_CONTINUOUS,
    }
}

impl<'a> Builder<'a> {
    /// A builder for a table of `planes` planes, with the wavelength in nm at a position among them.
    pub(super) fn new(
        integral: &'a AlbedoIntegral<'a>,
        planes: u32,
        wavelength_nm: &'a (dyn Fn(f64) -> f64 + Sync),
    ) -> Self {
        let (is_mirrored, ridge_cosines) = (integral.is_mirrored(), integral.ridge_cosines());
        Self { integral, planes: planes as usize, wavelength_nm, is_mirrored, ridge_cosines }
    }

    /// Nodes of a table with the given grid. `None` if nothing has to be divided: no albedo at a node of the coarse
    /// grid exceeds one, and the surface is a dielectric. Its small-slope factor vanishes at the horizon, so there are
    /// no ridges between those nodes.
    pub(super) fn build(&self, grid: Grid, progress: &Progress) -> Option<Nodes> {
        let coarse_grid = Grid { cells: grid.cells / COARSE_STRIDE as u32 };
        let coarse_planes = self.planes / COARSE_STRIDE + 1;
        // Steps are nodes and cells that are integrated: coarse nodes twice, for a and for t, then the table's nodes,
        // then the cells.
        let cells = (self.planes - 1) * self.integrated_rows(grid) * grid.cells as usize;
        let steps = progress.of_steps(
            2 * coarse_planes * self.integrated_nodes(coarse_grid) + self.planes * self.integrated_nodes(grid) + cells,
        );
        let albedo = self.fill_nodes(coarse_grid, COARSE_STRIDE, None, &steps);
        // `tabulated` sets negligible excesses to zero.
        if self.integral.is_dielectric() && albedo.values.iter().all(|value| *value == 0.0) {
            return None;
        }
        // With a as b, `fill_nodes` returns a t that may be too small a divisor, since b may exceed the final divisor.
        // It serves as the b of the table's nodes, which are raised to it below.
        let coarse = self.fill_nodes(coarse_grid, COARSE_STRIDE, Some(&albedo), &steps);
        let mut nodes = self.fill_nodes(grid, 1, Some(&coarse), &steps);
        // b must not exceed the divisor anywhere.
        for (i, value) in nodes.values.iter_mut().enumerate() {
            let [x, y] = grid.position(i % grid.in_plane());
            let position = [x, y, (i / grid.in_plane()) as f64].map(|at| at / COARSE_STRIDE as f64);
            *value = value.max(coarse.value(position) as f32);
        }
        self.raise_cells(&mut nodes, &coarse, &steps);
        Some(nodes)
    }

    /// Number of nodes of a plane that are integrated: all, or those up to the middle row, which the others mirror.
    fn integrated_nodes(&self, grid: Grid) -> usize {
        if self.is_mirrored { (grid.cells as usize / 2 + 1) * grid.side() } else { grid.in_plane() }
    }

    /// Number of rows of cells whose centres are integrated: all, or half of them, which the others mirror.
    fn integrated_rows(&self, grid: Grid) -> usize {
        if self.is_mirrored { grid.cells as usize / 2 } else { grid.cells as usize }
    }

    /// Nodes of every `stride`-th plane on a grid, with the increases of [`Builder::tabulated`].
    ///
    /// - Without `b` they hold the divisor `max(1, a)`, else `t` with the coarse nodes `b` as known divisors.
    /// - A stride of 1 means the table's own grid. Its nodes also get a margin, and the largest of several `t`: with
    ///   the orders in place, and moved onto the ridges that cross the node's box, at one of several cosθo at a time.
    fn fill_nodes(&self, grid: Grid, stride: usize, b: Option<&Nodes>, steps: &Steps) -> Nodes {
        let integrated = self.integrated_nodes(grid);
        let planes = (self.planes - 1) / stride + 1;
        let integrate = |i: usize| {
            steps.one();
            let (plane, node) = ((i / integrated * stride) as f64, i % integrated);
            let position = grid.position(node);
            let (wi, radius) = grid.direction(position);
            // No direction is interpolated from such a node.
            if grid.is_beyond(radius) {
                return 0.0;
            }
            let t = self.divisor(wi, plane, b, None);
            if stride != 1 {
                return self.tabulated(t, 0.0, wi, radius, grid) as f32;
            }
            let half_sides = box_half_sides(grid, position);
            let spacing_nm = (self.wavelength_nm)(plane + 1.0) - (self.wavelength_nm)(plane);
            let t = self.ridge_cosines.iter().fold(t, |t, &cosine| {
                let ridge = Ridge { cosine, half_sides, half_range_um: BOX_PLANES * 1e-3 * spacing_nm };
                t.max(self.divisor(wi, plane, b, Some(ridge)))
            });
            self.tabulated(t, MARGIN, wi, radius, grid) as f32
        };
        let found: Vec<f32> = (0..planes * integrated).into_par_iter().map(integrate).collect();
        // With mirror symmetry only the rows up to the middle are integrated; the others copy them.
        let values = (0..planes * grid.in_plane()).map(|i| {
            let (plane, node) = (i / grid.in_plane(), i % grid.in_plane());
            let node = if self.is_mirrored { node.min(grid.mirrored(node)) } else { node };
            found[plane * integrated + node]
        });
        Nodes { grid, values: values.collect() }
    }

    /// Upper bound of `t` at a position among the planes, with the coarse nodes `b` as known divisors; without `b`,
    /// `max(1, a)`. With a `ridge`, orders near the horizon are moved onto it.
    ///
    /// Quadrature nodes are computed four at once, one in each lane; `Lanes::total` sums the lanes.
    fn divisor(&self, wi: Vec3, plane: f64, b: Option<&Nodes>, ridge: Option<Ridge>) -> f64 {
        // Sets of four directions wo, with their parts of the integral a.
        let mut parts = Vec::new();
        let mut albedo = Real4::lit(0.0);
        self.integral.visit::<Lanes>(wi, (self.wavelength_nm)(plane), ridge, |wo, part| {
            albedo += part;
            parts.push((wo, part));
        });
        // max(1, a) is the first upper bound of t.
        let mut t = Lanes::total(albedo).max(1.0);
        let Some(b) = b.filter(|_| t > 1.0 + NEGLIGIBLE) else { return t };
        // Parts of a with 1/b(wo), where b = 1 + excess. `b` has every other plane.
        let per_b = |wo| Real4::lit(1.0) / (Real4::lit(1.0) + b.excess::<Lanes>(plane / COARSE_STRIDE as f64, wo));
        let parts: Vec<_> = parts.into_iter().map(|(wo, part)| (part, per_b(wo))).collect();
        // Each iteration replaces t by the larger of 1 and I(t) (symbols at the head). The first t fulfils the
        // condition I(t) ≤ t, and I does not decrease with t. So I(I(t)) ≤ I(t): the new t fulfils it, too.
        for _ in 0..ITERATIONS {
            let reached = parts.iter().fold(Real4::lit(0.0), |sum, &(part, per_b)| {
                (Real4::lit(t) * per_b).min(Real4::lit(1.0)).fma(part, sum)
            });
            t = Lanes::total(reached).max(1.0);
        }
        t
    }

    /// Tabulated value `(A − 1)·cos²θ` that `t` requires in a direction wi at `radius` of the grid. `margin` is a share
    /// of t for errors between nodes ([`MARGIN`]). The excess is increased in proportion to itself, at the rim of the
    /// grid ([`RIM_INCREASE`]), and near the horizon where there are ridges ([`GRAZING_INCREASE`]).
    fn tabulated(&self, t: f64, margin: f64, wi: Vec3, radius: f64, grid: Grid) -> f64 {
        let excess = t - 1.0;
        if excess <= NEGLIGIBLE {
            return 0.0;
        }
        let cells_from_rim = 0.5 * f64::from(grid.cells) * (1.0 - radius.min(1.0));
        let rim = RIM_INCREASE * (-2.0 * cells_from_rim).exp();
        let grazing = if !self.ridge_cosines.is_empty() { GRAZING_INCREASE * (1.0 - wi[2]).powi(16) } else { 0.0 };
        let increased = (1.0 + rim + grazing + EXCESS_INCREASE * excess) * excess;
        (increased + margin * t * (excess / MARGIN_FROM).min(1.0)) * wi[2] * wi[2]
    }
}

/// Half-sides of the box of a node at `position` in the grid, `[grid axis][x, y]` in direction cosines
/// ([`Ridge::half_sides`]): half of the difference between the directions at both ends of the box along each axis.
fn box_half_sides(grid: Grid, position: [f64; 2]) -> [[f64; 2]; 2] {
    [0, 1].map(|axis: usize| {
        let ends = [-BOX_CELLS, BOX_CELLS].map(|step| {
            let mut end = position;
            end[axis] += step;
            grid.direction(end).0
        });
        [0, 1].map(|c| 0.5 * (ends[1][c] - ends[0][c]))
    })
}

impl Nodes {
    /// Value at a position `[x, y, plane]` in nodes and planes from the first, linear between nodes.
    fn value(&self, position: [f64; 3]) -> f64 {
        // Both neighbours along an axis, each with its weight; they coincide at a node.
        let [x, y, plane] = position.map(|at| {
            let fraction = at.fract();
            [(at.floor() as usize, 1.0 - fraction), (at.ceil() as usize, fraction)]
        });
        let mut sum = 0.0;
        for corner in 0..8 {
            let ((x, in_x), (y, in_y), (plane, in_plane)) = (x[corner & 1], y[corner >> 1 & 1], plane[corner >> 2]);
            let node = plane * self.grid.in_plane() + y * self.grid.side() + x;
            sum += in_x * in_y * in_plane * f64::from(self.values[node]);
        }
        sum
    }

    /// `A − 1` of directions `w` at a position among these planes, linear in the grid and between planes.
    #[inline]
    fn excess<V: Values>(&self, plane: f64, w: [V::Real; 3]) -> V::Real {
        let place = place::<V>(self.grid.cells, w);
        // Node at the cell's first corner. A row has one node more than cells, so each row of cells before adds one.
        let corner: [usize; VALUES_MAX] = std::array::from_fn(|lane| {
            let cell = V::lane(place.cell, lane);
            cell + cell / self.grid.cells as usize
        });
        let planes = [plane.floor(), plane.ceil()].map(|plane| plane as usize * self.grid.in_plane());
        let node = |offset: usize| V::pack(|lane| self.values[corner[lane] + offset].into());
        let row = |offset: usize| lerp(node(offset), node(offset + 1), place.x);
        let [low, high] = planes.map(|offset| lerp(row(offset), row(offset + self.grid.side()), place.y));
        lerp(low, high, V::Real::lit(plane.fract())) * place.per_squared_cosine
    }
}
