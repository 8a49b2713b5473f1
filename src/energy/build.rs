//! Builds the nodes of albedo tables; see the [module](super) for a, b, t and A.

use super::grid::{Grid, place};
use super::integral::AlbedoIntegral;
use super::node_gaussian::Ridge;
use crate::numeric::math::lerp;
use crate::numeric::{Lanes, Number, Numbers, Real, VALUES_MAX, Values};
use crate::scattering::Vec3;
use crate::table::{Progress, Steps, WAVELENGTH_MAX_NM, WAVELENGTH_MIN_NM};
use rayon::prelude::*;
use std::f64::consts::PI;

/// Cells along a side and planes of wavelength, by the largest number of quadrature nodes of an integral. The fewer the
/// nodes, the narrower the orders and the ridges. Cells are even and planes odd, so that every other node makes a grid.
const RESOLUTIONS: [(usize, u32, u32); 4] = [(400, 48, 17), (1000, 32, 11), (4000, 20, 9), (usize::MAX, 16, 7)];
/// Fewest cells along a side where orders have ridges.
const CELLS_OF_RIDGES: u32 = 24;
/// Margin of the divisor, relative to it, for errors of interpolation. Chosen: at 0.015 no albedo found on a grating
/// exceeds one, and the means are lower by 0.003 to 0.008.
const MARGIN: f64 = 0.007;
/// Cells along a side from which ridges need no larger margin; with fewer it is larger by the ratio.
const MARGIN_CELLS: f64 = 48.0;
/// Excess of the divisor over one from which it gets the whole margin.
const MARGIN_FROM: f64 = 0.05;
/// Relative increase of the excess at the horizon, falling by e² per cell: `(A − 1)·cos²θ` is concave in the outermost
/// cells. Chosen; light that grazes so carries next to no power.
const RIM_INCREASE: f64 = 3.0;
/// Relative increase of the excess of orders with ridges at the horizon, falling as `(1 − cosθ)¹⁶`, to a tenth at 82°:
/// ridges are narrowest there. Chosen: at 0.3 albedos of a window of 5 µm reach 1.03 beyond 85°.
const GRAZING_INCREASE: f64 = 0.6;
/// Relative increase of the excess per unit of it: a large divisor changes much within a cell. It acts on reliefs some
/// µm deep.
const LARGE_INCREASE: f64 = 0.007;
/// Excess of t over one that is taken for an error of the quadrature. Chosen.
const NEGLIGIBLE: f64 = 3e-4;
/// Iterations for t. Each lowers it and any of them is a bound, so that more only spare light. Chosen.
const STEPS: usize = 4;
/// Half-sides of a node's box ([`Ridge`]) in cells along x and y, and in groups along the wavelength. With 0.6 and 0.5
/// albedos reach 1.04; with a whole cell their mean is lower by 0.01.
const BOX: [f64; 2] = [0.7, 0.6];

/// Largest change of cosθ across a cell, times the cells along a side: `cosθ = (1 − r²)²` is steepest at `r² = 1/3`.
const CELL_COSINE: f64 = 3.08;
/// Most nodes beyond a cell's corners that are raised with them, one for each half turn by which the heights' phase
/// changes across a cell. Chosen.
const DEEP_REACH_MAX: usize = 3;
/// Places within a cell of such a relief that are checked instead of its centre: x, y and group.
const DEEP_PLACES: [[f64; 3]; 4] = [[0.25, 0.25, 0.25], [0.75, 0.75, 0.25], [0.25, 0.75, 0.75], [0.75, 0.25, 0.75]];
/// Factor on what a place in a cell of such a relief lacks. Chosen: with 1 an albedo of 1.03 remains on a relief 2 µm
/// deep.
const DEEP_INCREASE: f32 = 1.5;

/// Directions side by side.
type Real4 = <Lanes<'static> as Numbers>::Real;

/// Wavelengths that are integrated together for `K` planes of a table.
pub(super) struct Group<const K: usize> {
    /// Wavelengths in nm with their weight in each plane.
    pub wavelengths: Vec<(f64, [f64; K])>,
    /// Distance to the next group in nm; zero where there is none.
    pub spacing_nm: f64,
}

/// `(A − 1)·cos²θ` at the nodes of a grid for several groups, `[group][y][x][plane]`.
pub(super) struct Nodes<const K: usize> {
    pub grid: Grid,
    pub values: Vec<[f32; K]>,
}

/// A builder of the nodes of one table.
pub(super) struct Builder<'a, const K: usize> {
    integral: &'a AlbedoIntegral<'a>,
    /// The group at a position from zero for the first to `groups − 1` for the last.
    group: &'a (dyn Fn(f64) -> Group<K> + Sync),
    /// Odd, so that every other group makes a grid as well.
    groups: usize,
    mirrored: bool,
    ridge_cosines: Vec<f64>,
}

/// Known divisors b at all positions between their groups, which are `stride` groups of the table apart.
#[derive(Clone, Copy)]
struct Known<'a, const K: usize> {
    nodes: &'a Nodes<K>,
    stride: f64,
}

/// Cells along a side and planes of wavelength for a surface.
pub(super) fn resolution(integral: &AlbedoIntegral) -> (u32, u32) {
    let points = integral.points_typical();
    let [.., coarsest] = RESOLUTIONS;
    let (_, cells, planes) = RESOLUTIONS.into_iter().find(|(most, ..)| points <= *most).unwrap_or(coarsest);
    (if integral.has_ridges() { Ord::max(cells, CELLS_OF_RIDGES) } else { cells }, planes)
}

/// The group of one wavelength at a position among `planes` planes, equally spaced over the tables' range.
pub(super) fn single_wavelength(planes: u32, at: f64) -> Group<1> {
    let spacing_nm = (WAVELENGTH_MAX_NM - WAVELENGTH_MIN_NM) / f64::from(planes - 1);
    Group { wavelengths: vec![(WAVELENGTH_MIN_NM + at * spacing_nm, [1.0])], spacing_nm }
}

impl<'a, const K: usize> Builder<'a, K> {
    pub(super) fn new(
        integral: &'a AlbedoIntegral<'a>,
        groups: usize,
        group: &'a (dyn Fn(f64) -> Group<K> + Sync),
    ) -> Self {
        Self { integral, group, groups, mirrored: integral.is_mirrored(), ridge_cosines: integral.ridge_cosines() }
    }

    /// The nodes of a table; `None` where nothing is divided: a dielectric's albedo has no ridges, and none of the
    /// coarse grid's exceeds one.
    pub(super) fn build(&self, grid: Grid, progress: &Progress) -> Option<Nodes<K>> {
        let coarse_grid = Grid { cells: grid.cells / 2 };
        let coarse_groups = self.groups / 2 + 1;
        let cells = self.gaps() * self.rows(grid) * grid.cells as usize;
        let steps = progress
            .of_steps(2 * coarse_groups * self.integrals(coarse_grid) + self.groups * self.integrals(grid) + cells);
        let albedo = self.nodes(coarse_grid, 2, None, &steps);
        if self.integral.is_dielectric() && albedo.values.iter().flatten().all(|value| *value == 0.0) {
            return None;
        }
        let coarse = self.nodes(coarse_grid, 2, Some(Known { nodes: &albedo, stride: 2.0 }), &steps);
        let known = Known { nodes: &coarse, stride: 2.0 };
        let mut nodes = self.nodes(grid, 1, Some(known), &steps);
        // The bound needs A ≥ b.
        nodes.values.iter_mut().zip(coarse.refined(grid, self.groups)).for_each(|(values, least)| {
            values.iter_mut().zip(least).for_each(|(value, least)| *value = value.max(least));
        });
        self.raise_cells(&mut nodes, known, &steps);
        Some(nodes)
    }

    /// Nodes of a plane that are integrated: all, or those up to the middle row where the others mirror them.
    fn integrals(&self, grid: Grid) -> usize {
        if self.mirrored { (grid.cells as usize / 2 + 1) * grid.side() } else { grid.in_plane() }
    }

    /// Rows of cells whose centres are integrated.
    fn rows(&self, grid: Grid) -> usize {
        if self.mirrored { grid.cells as usize / 2 } else { grid.cells as usize }
    }

    /// Gaps between groups; a single group counts as one.
    fn gaps(&self) -> usize {
        (self.groups - 1).max(1)
    }

    /// Nodes of every `stride`-th group: a without known divisors, t with them, and with the orders on their ridges in
    /// the table's own grid.
    fn nodes(&self, grid: Grid, stride: usize, b: Option<Known<K>>, steps: &Steps) -> Nodes<K> {
        let integrals = self.integrals(grid);
        let groups = (self.groups - 1) / stride + 1;
        let node = |i: usize| {
            steps.one();
            let (group_at, node) = ((i / integrals * stride) as f64, i % integrals);
            let at = [node % grid.side(), node / grid.side()].map(|at| at as f64);
            let (wi, radius) = grid.direction(at);
            if grid.is_beyond(radius) {
                return [0.0; K];
            }
            let group = (self.group)(group_at);
            let mut t = self.least(wi, group_at, &group, b, None);
            if stride == 1 {
                let half_side = |axis: usize| {
                    let ends = [-BOX[0], BOX[0]].map(|step| {
                        let mut end = at;
                        end[axis] += step;
                        grid.direction(end).0
                    });
                    [0, 1].map(|c| 0.5 * (ends[1][c] - ends[0][c]))
                };
                let half_sides = [0, 1].map(half_side);
                for &cosine in &self.ridge_cosines {
                    let ridge = Ridge { cosine, half_sides, half_range_um: BOX[1] * 1e-3 * group.spacing_nm };
                    let on_ridge = self.least(wi, group_at, &group, b, Some(ridge));
                    t = std::array::from_fn(|k| t[k].max(on_ridge[k]));
                }
            }
            self.tabulated(t, true, wi, radius, grid).map(|value| value as f32)
        };
        let found: Vec<[f32; K]> = (0..groups * integrals).into_par_iter().map(node).collect();
        let values = (0..groups * grid.in_plane()).map(|i| {
            let (group, node) = (i / grid.in_plane(), i % grid.in_plane());
            let node = if self.mirrored { node.min(grid.mirrored(node)) } else { node };
            found[group * integrals + node]
        });
        Nodes { grid, values: values.collect() }
    }

    /// Raises the corners of cells where the table, linear between nodes, lies below t: in the centre, and in cells on
    /// the horizon near it too. The centre is left out where nothing is divided at any corner. t of deep reliefs
    /// fluctuates within a cell, so all their cells are checked, and nodes further off are raised as well.
    fn raise_cells(&self, nodes: &mut Nodes<K>, b: Known<K>, steps: &Steps) {
        let grid = nodes.grid;
        let (cells, rows) = (grid.cells as usize, self.rows(grid));
        let cell_phase = self.integral.phase_max() * CELL_COSINE / f64::from(grid.cells);
        let reach = ((cell_phase / PI) as usize).min(DEEP_REACH_MAX);
        let corners = |gap: usize, y: usize, x: usize| {
            let node = move |i: usize| {
                let group = (gap + (i >> 2)).min(self.groups - 1);
                group * grid.in_plane() + (y + (i >> 1 & 1)) * grid.side() + x + (i & 1)
            };
            (0..8).map(node)
        };
        let lacking = |i: usize| {
            steps.one();
            let [gap, y, x] = [i / cells / rows, i / cells % rows, i % cells];
            let is_divided = corners(gap, y, x).any(|node| nodes.values[node] != [0.0; K]);
            let inside: &[[f64; 3]] = match reach {
                0 if is_divided => &[[0.5; 3]],
                0 => &[],
                _ => &DEEP_PLACES,
            };
            let rim = grid.on_rim([x, y]).map(|[x, y]| [x, y, 0.5]);
            inside.iter().copied().chain(rim).fold([0.0f32; K], |lacking, [fx, fy, fg]| {
                let (wi, radius) = grid.direction([x as f64 + fx, y as f64 + fy]);
                if radius >= 1.0 {
                    return lacking;
                }
                let fractions = [fx, fy, fg];
                let weight = |corner: usize| {
                    let fraction = |axis: usize| match corner >> axis & 1 {
                        0 => 1.0 - fractions[axis],
                        _ => fractions[axis],
                    };
                    fraction(0) * fraction(1) * fraction(2)
                };
                let mut table = [0.0; K];
                for (i, node) in corners(gap, y, x).enumerate() {
                    (0..K).for_each(|k| table[k] += weight(i) * f64::from(nodes.values[node][k]));
                }
                let group_at = if self.groups > 1 { gap as f64 + fg } else { 0.0 };
                let t = self.least(wi, group_at, &(self.group)(group_at), Some(b), None);
                let wanted = self.tabulated(t, false, wi, radius, grid);
                std::array::from_fn(|k| lacking[k].max((wanted[k] - table[k]) as f32))
            })
        };
        let lacking: Vec<[f32; K]> = (0..self.gaps() * rows * cells).into_par_iter().map(lacking).collect();
        let increase = if reach > 0 { DEEP_INCREASE } else { 1.0 };
        let mut raise = vec![[0f32; K]; nodes.values.len()];
        for i in 0..self.gaps() * cells * cells {
            let [gap, y, x] = [i / cells / cells, i / cells % cells, i % cells];
            let row = if self.mirrored { y.min(cells - 1 - y) } else { y };
            let lacking = lacking[(gap * rows + row) * cells + x].map(|lacking| lacking * increase);
            if lacking == [0.0; K] {
                continue;
            }
            let about = |at: usize, last: usize| at.saturating_sub(reach)..=(at + 1 + reach).min(last);
            for group in about(gap, self.groups - 1) {
                for (y, x) in about(y, cells).flat_map(|y| about(x, cells).map(move |x| (y, x))) {
                    let node = group * grid.in_plane() + y * grid.side() + x;
                    raise[node] = std::array::from_fn(|k| raise[node][k].max(lacking[k]));
                }
            }
        }
        for (values, raise) in nodes.values.iter_mut().zip(raise) {
            values.iter_mut().zip(raise).for_each(|(value, raise)| *value += raise);
        }
    }

    /// t of each plane of a group, from above; `max(1, a)` without known divisors.
    fn least(&self, wi: Vec3, group_at: f64, group: &Group<K>, b: Option<Known<K>>, ridge: Option<Ridge>) -> [f64; K] {
        let mut parts = Vec::new();
        let mut albedo = [Real4::lit(0.0); K];
        for (nm, weights) in &group.wavelengths {
            self.integral.visit::<Lanes>(wi, *nm, ridge, |wo, part| {
                let part = weights.map(|weight| Real4::lit(weight) * part);
                (0..K).for_each(|k| albedo[k] += part[k]);
                parts.push((wo, part));
            });
        }
        let mut t = albedo.map(|albedo| Lanes::total(albedo).max(1.0));
        let Some(b) = b.filter(|_| t.iter().any(|t| *t > 1.0 + NEGLIGIBLE)) else { return t };
        let divided: Vec<_> = parts
            .into_iter()
            .map(|(wo, part)| {
                let excess = b.nodes.excess::<Lanes>(group_at / b.stride, wo);
                (part, std::array::from_fn::<Real4, K, _>(|k| part[k] / (Real4::lit(1.0) + excess[k])))
            })
            .collect();
        for _ in 0..STEPS {
            // The integral is concave in t, so it stays below t where it is below t once.
            t = std::array::from_fn(|k| {
                let (zero, t) = (Real4::lit(0.0), Real4::lit(t[k]));
                let sum = divided.iter().fold(zero, |sum, (part, divided)| {
                    // A band's part may be negative.
                    let (part, most) = (part[k], t * divided[k]);
                    sum + Number::select(zero.lt(part), Number::min(part, most), Number::max(part, most))
                });
                Lanes::total(sum).max(1.0)
            });
        }
        t
    }

    /// The tabulated value `(A − 1)·cos²θ` for t, its excess increased towards the horizon; at nodes with the margin.
    fn tabulated(&self, t: [f64; K], at_node: bool, wi: Vec3, radius: f64, grid: Grid) -> [f64; K] {
        let ridges = !self.ridge_cosines.is_empty();
        let margin = match at_node {
            true if ridges => MARGIN * MARGIN_CELLS / f64::from(grid.cells),
            true => MARGIN,
            false => 0.0,
        };
        let cells_from_rim = 0.5 * f64::from(grid.cells) * (1.0 - radius.min(1.0));
        let grazing = if ridges { GRAZING_INCREASE * (1.0 - wi[2]).powi(16) } else { 0.0 };
        let increase = RIM_INCREASE * (-2.0 * cells_from_rim).exp() + grazing;
        t.map(|t| match t - 1.0 {
            excess if excess > NEGLIGIBLE => {
                let increased = (1.0 + increase + LARGE_INCREASE * excess) * excess;
                (increased + margin * t * (excess / MARGIN_FROM).min(1.0)) * wi[2] * wi[2]
            }
            _ => 0.0,
        })
    }
}

impl<const K: usize> Nodes<K> {
    /// `A − 1` in each plane, linear in direction and between groups.
    #[inline]
    fn excess<V: Values>(&self, group_at: f64, w: [V::Real; 3]) -> [V::Real; K] {
        let place = place::<V>(self.grid.cells, w);
        // A row has one node more than cells.
        let corner: [usize; VALUES_MAX] = std::array::from_fn(|lane| {
            let cell = V::lane(place.cell, lane);
            cell + cell / self.grid.cells as usize
        });
        let groups = [group_at.floor(), group_at.ceil()].map(|group| group as usize * self.grid.in_plane());
        std::array::from_fn(|k| {
            let node = |from: usize| V::pack(|lane| self.values[corner[lane] + from][k].into());
            let row = |from: usize| lerp(node(from), node(from + 1), place.x);
            let [low, high] = groups.map(|from| lerp(row(from), row(from + self.grid.side()), place.y));
            lerp(low, high, V::Real::lit(group_at.fract())) * place.per_squared_cosine
        })
    }

    /// The values at the nodes of a grid twice as fine and all its `groups`, of which these are every other.
    fn refined(&self, grid: Grid, groups: usize) -> impl Iterator<Item = [f32; K]> {
        let halves = |at: usize| [at / 2, at.div_ceil(2)];
        (0..groups * grid.in_plane()).map(move |i| {
            let [group, y, x] = [i / grid.in_plane(), i % grid.in_plane() / grid.side(), i % grid.side()].map(halves);
            let mut sum = [0.0; K];
            for node in 0..8 {
                let row = group[node >> 2] * self.grid.in_plane() + y[node >> 1 & 1] * self.grid.side();
                (0..K).for_each(|k| sum[k] += self.values[row + x[node & 1]][k]);
            }
            sum.map(|sum| sum / 8.0)
        })
    }
}
