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
//! - A *node* is a corner of the grid's cells in one group. *Quadrature nodes* of an integral, and *narrow nodes*, the
//!   orders of the spectral table, always have their full names.
//! - The *excess* of an albedo or a divisor is its difference from one, such as `A − 1`.
//! - A *ridge* is a narrow maximum of `t` along the incidences from which an order leaves along the surface
//!   ([`Ridge`]).
//! - A *plane* has the values of one wavelength, or of one band (red, green or blue).
//! - A *group* has the wavelengths that are integrated together for K planes. A table over wavelengths has one group
//!   for each plane, with one wavelength and K = 1. A table of bands has one group, with many wavelengths and K = 3.
//! - A position among groups, `group_at`, is 0 at the first group and may lie between two groups.
//! - A *gap* is the interval between two neighbouring groups.
//! - The *coarse* grid and the coarse groups are every other ([`COARSE_STRIDE`]) of the table's.

mod raise;

pub(super) use raise::DEEP_PHASE;

use super::grid::{Grid, place};
use super::integral::AlbedoIntegral;
use super::node_gaussian::Ridge;
use crate::numeric::math::lerp;
use crate::numeric::{Lanes, Number, Numbers, Real, VALUES_MAX, Values};
use crate::scattering::Vec3;
use crate::table::{Progress, Steps, WAVELENGTH_MAX_NM, WAVELENGTH_MIN_NM};
use rayon::prelude::*;

/// Number of cells along each side of the finest grid, that of the first row of [`RESOLUTIONS`].
const FINEST_CELLS: u32 = RESOLUTIONS[0].1.0;
/// Sizes of tables: the largest number of quadrature nodes of a typical integral ([`AlbedoIntegral::typical_nodes`]),
/// then the numbers of cells along each side and of planes. A table takes the first row whose largest number is not
/// exceeded, else [`SMALLEST_SIZE`]. Few quadrature nodes mean few narrow orders, whose ridges need fine grids.
///
/// Chosen for albedos of at most 1.01 (`tests/core/energy.rs`). Cells are even and planes odd, so that every other node
/// forms a coarse grid.
const RESOLUTIONS: [(usize, (u32, u32)); 3] = [(400, (48, 17)), (1000, (32, 11)), (4000, (20, 9))];
/// Numbers of cells and planes of the smallest table, chosen as those of [`RESOLUTIONS`].
pub(super) const SMALLEST_SIZE: (u32, u32) = (16, 7);
/// Spacing of the coarse grid and groups, in nodes or groups of the table. [`Nodes::refined`] assumes 2.
const COARSE_STRIDE: usize = 2;
/// Smallest number of cells along each side of a table of few narrow orders. The divisor is raised about a ridge over a
/// width proportional to the cells. Chosen: larger cells would darken more directions.
pub(super) const NARROW_CELLS_MIN: u32 = 24;
/// Relative margin of the divisor for errors of interpolation. A smaller margin leaves larger albedos between nodes.
/// With 0.015 no measured albedo of a grating exceeds one, but mean albedos are lower by 0.003 to 0.008. Tables with
/// ridges and fewer cells than [`FINEST_CELLS`] have a margin that is larger in inverse proportion.
///
/// It is also the relative increase of the excess per unit of excess, since a large divisor changes much within a cell.
/// This increase matters for reliefs a few µm deep.
pub(super) const MARGIN: f64 = 0.007;
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
/// Half-side of a node's box ([`Ridge`]) along the grid's x and y, in cells. With 0.6 here and 0.5 for [`BOX_GROUPS`]
/// albedos reach 1.04; with 1 here the mean albedo is lower by 0.01.
const BOX_CELLS: f64 = 0.7;
/// Half-side of a node's box ([`Ridge`]) along the wavelength, in groups; see [`BOX_CELLS`].
const BOX_GROUPS: f64 = 0.6;

/// Four directions side by side.
type Real4 = <Lanes<'static> as Numbers>::Real;

/// Wavelengths that are integrated together for K planes of a table.
pub(super) struct Group<const K: usize> {
    /// Wavelengths in nm, each with its weight in every plane.
    pub wavelengths: Vec<(f64, [f64; K])>,
    /// Distance to the next group in nm; zero if the table has one group.
    pub spacing_nm: f64,
}

/// Values `(A − 1)·cos²θ` at the nodes of a grid, for several groups.
pub(super) struct Nodes<const K: usize> {
    /// Grid of each group.
    grid: Grid,
    /// Values `[group][y][x][plane]`.
    pub values: Vec<[f32; K]>,
}

/// Builder of the nodes of one table.
pub(super) struct Builder<'a, const K: usize> {
    /// Integral of the model's reflectance over outgoing directions.
    integral: &'a AlbedoIntegral<'a>,
    /// Makes the group at a position `group_at`, from 0 to `groups − 1`.
    group: &'a (dyn Fn(f64) -> Group<K> + Sync),
    /// Number of groups: odd, so that every other group belongs to the coarse grid.
    groups: usize,
    /// Whether the relief varies along x alone, so that directions mirrored at the x axis have equal albedos.
    is_mirrored: bool,
    /// Values of cosθo of orders on ridges ([`AlbedoIntegral::ridge_cosines`]); empty without ridges.
    ridge_cosines: Vec<f64>,
}

/// Number of cells along each side of a surface's table, and number of its planes of wavelength.
pub(super) fn resolution(integral: &AlbedoIntegral) -> (u32, u32) {
    let quadrature_nodes = integral.typical_nodes();
    let found = RESOLUTIONS.into_iter().find(|(nodes_max, _)| quadrature_nodes <= *nodes_max);
    let (cells, planes) = found.map_or(SMALLEST_SIZE, |(_, size)| size);
    (if integral.has_ridges() { Ord::max(cells, NARROW_CELLS_MIN) } else { cells }, planes)
}

/// Group of one wavelength, at a position among `planes` planes that are equally spaced over the tables' range.
pub(super) fn single_wavelength(planes: u32, group_at: f64) -> Group<1> {
    let spacing_nm = (WAVELENGTH_MAX_NM - WAVELENGTH_MIN_NM) / f64::from(planes - 1);
    Group { wavelengths: vec![(WAVELENGTH_MIN_NM + group_at * spacing_nm, [1.0])], spacing_nm }
}

impl<'a, const K: usize> Builder<'a, K> {
    /// A builder for a table of `groups` groups. `group` makes the group at a position.
    pub(super) fn new(
        integral: &'a AlbedoIntegral<'a>,
        groups: usize,
        group: &'a (dyn Fn(f64) -> Group<K> + Sync),
    ) -> Self {
        let (is_mirrored, ridge_cosines) = (integral.is_mirrored(), integral.ridge_cosines());
        Self { integral, group, groups, is_mirrored, ridge_cosines }
    }

    /// Nodes of a table with the given grid. `None` if nothing has to be divided: no albedo at a node of the coarse
    /// grid exceeds one, and the surface is a dielectric, which has no ridges between those nodes.
    pub(super) fn build(&self, grid: Grid, progress: &Progress) -> Option<Nodes<K>> {
        let coarse_grid = Grid { cells: grid.cells / COARSE_STRIDE as u32 };
        let coarse_groups = self.groups / COARSE_STRIDE + 1;
        // Steps are nodes and cells that are integrated: coarse nodes twice, for a and for t, then the table's nodes,
        // then the cells.
        let cells = self.gaps() * self.integrated_rows(grid) * grid.cells as usize;
        let steps = progress.of_steps(
            2 * coarse_groups * self.integrated_nodes(coarse_grid) + self.groups * self.integrated_nodes(grid) + cells,
        );
        let albedo = self.fill_nodes(coarse_grid, COARSE_STRIDE, None, &steps);
        // `tabulated` sets negligible excesses to zero.
        if self.integral.is_dielectric() && albedo.values.iter().flatten().all(|value| *value == 0.0) {
            return None;
        }
        // This t has a in place of b. Since a may exceed the final divisor, t may be too small to be a divisor. It is
        // the b of the table's nodes instead, which are raised to it below.
        let coarse = self.fill_nodes(coarse_grid, COARSE_STRIDE, Some(&albedo), &steps);
        let mut nodes = self.fill_nodes(grid, 1, Some(&coarse), &steps);
        // t bounds the albedo only if A ≥ b everywhere. `least` has b, the coarse table, at the table's nodes.
        for (values, least) in nodes.values.iter_mut().zip(coarse.refined(grid, self.groups)) {
            values.iter_mut().zip(least).for_each(|(value, least)| *value = value.max(least));
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

    /// Number of gaps between groups; one for a single group.
    fn gaps(&self) -> usize {
        (self.groups - 1).max(1)
    }

    /// Nodes of every `stride`-th group on a grid, with the margin and the increases of [`Builder::tabulated`].
    ///
    /// - Without `b` they hold the divisor `max(1, a)`, else `t` with the coarse nodes `b` as known divisors.
    /// - A stride of 1 means the table's own grid. Its nodes get the largest `t` of several: with the orders in place,
    ///   and with the orders moved onto each ridge.
    fn fill_nodes(&self, grid: Grid, stride: usize, b: Option<&Nodes<K>>, steps: &Steps) -> Nodes<K> {
        let integrated = self.integrated_nodes(grid);
        let groups = (self.groups - 1) / stride + 1;
        let integrate = |i: usize| {
            steps.one();
            let (group_at, node) = ((i / integrated * stride) as f64, i % integrated);
            let position = grid.position(node);
            let (wi, radius) = grid.direction(position);
            // No direction is interpolated from such a node.
            if grid.is_beyond(radius) {
                return [0.0; K];
            }
            let group = (self.group)(group_at);
            let mut t = self.divisor(wi, group_at, &group, b, None);
            if stride == 1 {
                let half_sides = box_half_sides(grid, position);
                for &cosine in &self.ridge_cosines {
                    let ridge = Ridge { cosine, half_sides, half_range_um: BOX_GROUPS * 1e-3 * group.spacing_nm };
                    let on_ridge = self.divisor(wi, group_at, &group, b, Some(ridge));
                    t = std::array::from_fn(|k| t[k].max(on_ridge[k]));
                }
            }
            let is_node = true;
            self.tabulated(t, is_node, wi, radius, grid).map(|value| value as f32)
        };
        let found: Vec<[f32; K]> = (0..groups * integrated).into_par_iter().map(integrate).collect();
        // With mirror symmetry only the rows up to the middle are integrated; the others copy them.
        let values = (0..groups * grid.in_plane()).map(|i| {
            let (group_index, node) = (i / grid.in_plane(), i % grid.in_plane());
            let node = if self.is_mirrored { node.min(grid.mirrored(node)) } else { node };
            found[group_index * integrated + node]
        });
        Nodes { grid, values: values.collect() }
    }

    /// Upper bound of `t` in each plane of the group at `group_at`, with the coarse nodes `b` as known divisors;
    /// without `b`, `max(1, a)`. With a `ridge`, narrow orders near the horizon are moved onto it.
    ///
    /// Quadrature nodes are computed four at once, one in each lane; `Lanes::total` sums the lanes.
    fn divisor(
        &self,
        wi: Vec3,
        group_at: f64,
        group: &Group<K>,
        b: Option<&Nodes<K>>,
        ridge: Option<Ridge>,
    ) -> [f64; K] {
        // Sets of four directions wo, with their parts of the integral a in every plane.
        let mut parts = Vec::new();
        let mut albedo = [Real4::lit(0.0); K];
        for (nm, weights) in &group.wavelengths {
            self.integral.visit::<Lanes>(wi, *nm, ridge, |wo, part| {
                let part = weights.map(|weight| Real4::lit(weight) * part);
                (0..K).for_each(|k| albedo[k] += part[k]);
                parts.push((wo, part));
            });
        }
        // max(1, a) is the first upper bound of t.
        let first_t = albedo.map(|albedo| Lanes::total(albedo).max(1.0));
        let Some(b) = b.filter(|_| first_t.iter().any(|t| *t > 1.0 + NEGLIGIBLE)) else { return first_t };
        // Parts of a, and these parts divided by b(wo) = 1 + excess.
        let divided: Vec<_> = parts
            .into_iter()
            .map(|(wo, part)| {
                // `b` has every other group.
                let excess = b.excess::<Lanes>(group_at / COARSE_STRIDE as f64, wo);
                (part, std::array::from_fn::<Real4, K, _>(|k| part[k] / (Real4::lit(1.0) + excess[k])))
            })
            .collect();
        lowered(first_t, &divided)
    }

    /// Tabulated value `(A − 1)·cos²θ` that `t` requires in a direction wi at `radius` of the grid. The excess is
    /// increased in proportion to itself ([`MARGIN`]), at the rim of the grid ([`RIM_INCREASE`]), and near the horizon
    /// where there are ridges ([`GRAZING_INCREASE`]). At nodes the margin is added, too: a share of t for errors
    /// between them.
    fn tabulated(&self, t: [f64; K], is_node: bool, wi: Vec3, radius: f64, grid: Grid) -> [f64; K] {
        // Unlike `AlbedoIntegral::has_ridges`, includes spectral tables of many narrow nodes, whose ridges are low.
        let any_ridges = !self.ridge_cosines.is_empty();
        let margin = match is_node {
            true if any_ridges => MARGIN * f64::from(FINEST_CELLS) / f64::from(grid.cells),
            true => MARGIN,
            false => 0.0,
        };
        let cells_from_rim = 0.5 * f64::from(grid.cells) * (1.0 - radius.min(1.0));
        let grazing = if any_ridges { GRAZING_INCREASE * (1.0 - wi[2]).powi(16) } else { 0.0 };
        let increase = RIM_INCREASE * (-2.0 * cells_from_rim).exp() + grazing;
        t.map(|t| {
            let excess = t - 1.0;
            if excess > NEGLIGIBLE {
                let increased = (1.0 + increase + MARGIN * excess) * excess;
                (increased + margin * t * (excess / MARGIN_FROM).min(1.0)) * wi[2] * wi[2]
            } else {
                0.0
            }
        })
    }
}

/// Lowers `first_t`, the upper bound max(1, a) of `t` in each plane, towards `t`. `parts` are pairs: a part of the
/// integral a, and this part divided by b(wo).
///
/// Each iteration replaces t by the larger of 1 and I(t) (symbols at the head). The first t fulfils the
/// condition I(t) ≤ t, and I does not decrease with t, unless parts are negative. So I(I(t)) ≤ I(t): the new t fulfils
/// it, too.
fn lowered<const K: usize>(first_t: [f64; K], parts: &[([Real4; K], [Real4; K])]) -> [f64; K] {
    let mut t = first_t;
    for _ in 0..ITERATIONS {
        t = std::array::from_fn(|k| {
            let (zero, t) = (Real4::lit(0.0), Real4::lit(t[k]));
            let sum = parts.iter().fold(zero, |sum, (part, divided)| {
                // part·min(1, t/b): the smaller of `part` and `scaled`, or the larger of two negative ones. Parts of a
                // band may be negative.
                let (part, scaled) = (part[k], t * divided[k]);
                sum + Number::select(zero.lt(part), Number::min(part, scaled), Number::max(part, scaled))
            });
            Lanes::total(sum).max(1.0)
        });
    }
    t
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

impl<const K: usize> Nodes<K> {
    /// `A − 1` of directions `w` in each plane, linear in the grid and between groups. `group_at` counts the groups of
    /// these nodes.
    #[inline]
    fn excess<V: Values>(&self, group_at: f64, w: [V::Real; 3]) -> [V::Real; K] {
        let place = place::<V>(self.grid.cells, w);
        // Node at the cell's first corner. A row has one node more than cells, so each row of cells before adds one.
        let corner: [usize; VALUES_MAX] = std::array::from_fn(|lane| {
            let cell = V::lane(place.cell, lane);
            cell + cell / self.grid.cells as usize
        });
        let groups = [group_at.floor(), group_at.ceil()].map(|group| group as usize * self.grid.in_plane());
        std::array::from_fn(|k| {
            let node = |offset: usize| V::pack(|lane| self.values[corner[lane] + offset][k].into());
            let row = |offset: usize| lerp(node(offset), node(offset + 1), place.x);
            let [low, high] = groups.map(|offset| lerp(row(offset), row(offset + self.grid.side()), place.y));
            lerp(low, high, V::Real::lit(group_at.fract())) * place.per_squared_cosine
        })
    }

    /// Values `[group][y][x]` of coarse nodes, interpolated to the table's grid and to its `groups` groups.
    fn refined(&self, grid: Grid, groups: usize) -> impl Iterator<Item = [f32; K]> {
        // Coarse neighbours of a fine number, equal for an even one.
        let neighbours = |at: usize| [at / 2, at.div_ceil(2)];
        (0..groups * grid.in_plane()).map(move |i| {
            let [group, y, x] =
                [i / grid.in_plane(), i % grid.in_plane() / grid.side(), i % grid.side()].map(neighbours);
            let mut sum = [0.0; K];
            for corner in 0..8 {
                let row = group[corner >> 2] * self.grid.in_plane() + y[corner >> 1 & 1] * self.grid.side();
                (0..K).for_each(|k| sum[k] += self.values[row + x[corner & 1]][k]);
            }
            sum.map(|sum| sum / 8.0)
        })
    }
}
