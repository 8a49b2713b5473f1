//! Tabulates `A` from above.

use super::AlbedoLayout;
use super::grid::{GridPlace, place};
use super::lobes::Lobes;
use crate::numeric::math::lerp;
use crate::numeric::{Lanes, Number, Numbers, Plain, Real, VALUES_MAX, Values};
use crate::scattering::Vec3;
use crate::table::{Progress, Steps};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

/// How finely a table is made.
#[derive(Clone, Copy)]
pub(super) struct Fineness {
    /// Most places in an integral that it is for.
    places: usize,
    /// Cells along a side and planes of wavelength; the one is even and the other odd, so that every other node makes a grid as well.
    pub cells: u32,
    pub planes: u32,
    /// Directions in every cell, besides its corners, at which the table is not below what is asked for; and about the horizon for every cell
    /// along a side, half of which a relief along x has on the axes.
    pub samples: usize,
    pub rim_samples: usize,
    /// Directions that are looked at about each where something was lacking.
    pub again: usize,
}

/// Integrals of few places are over narrow orders, where `A` has ridges; they are quick as well.
const FINENESS: [Fineness; 4] = [
    Fineness { places: 400, cells: 48, planes: 17, samples: 4, rim_samples: 192, again: 8 },
    Fineness { places: 1000, cells: 32, planes: 11, samples: 3, rim_samples: 96, again: 8 },
    Fineness { places: 4000, cells: 20, planes: 9, samples: 2, rim_samples: 24, again: 4 },
    Fineness { places: usize::MAX, cells: 16, planes: 7, samples: 2, rim_samples: 24, again: 4 },
];
/// What a divisor is raised by, as a share of it, since ridges go on between the places that are looked at: so much, and so much more at the
/// horizon, where it bends most and next to no light is lost by it; less where the excess over one is less than this.
const MARGIN: f64 = 0.004;
const RIM_MARGIN: f64 = 0.04;
const MARGIN_FROM: f64 = 0.05;
/// Excess over one that is let pass: quadrature is good to about this.
const NEGLIGIBLE: f64 = 3e-4;
/// Share of a build that is taken to be done when all nodes have a value.
const NODES_SHARE: f64 = 0.4;
/// Steps towards the least divisor, each of which is one.
const STEPS: usize = 4;

/// Places of an integral side by side.
type Four = <Lanes<'static> as Numbers>::Real;

/// A place among planes: the numbers of the first nodes of that before it and of that behind it, and how far it is from the one to the other.
pub(super) struct Between {
    starts: [usize; 2],
    towards: f64,
}

/// How much the division changes.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub struct AlbedoReport {
    /// Largest albedo before, over directions below 85°.
    pub albedo_max_unscaled: f64,
    /// Mean of the albedo over incident directions weighted by cosθ and over wavelengths, before and after.
    pub albedo_mean_unscaled: f64,
    /// The mean of the same albedos once energy is conserved.
    pub albedo_mean_scaled: f64,
}

/// Planes that are integrated together.
pub(super) struct Group<const K: usize> {
    /// Where each lies, from zero for the first plane to one for the last.
    pub planes: [f64; K],
    /// Wavelengths in nm with their weights in each plane, where they sum to one.
    pub wavelengths: Vec<(f64, [f64; K])>,
}

/// What a table is built from. Its planes are as many groups of `K` as they make.
pub(super) struct Source<'a, const K: usize> {
    pub lobes: &'a Lobes<'a>,
    pub fineness: Fineness,
    /// The group at a place from zero for the first to one for the last.
    pub group: &'a (dyn Fn(f64) -> Group<K> + Sync),
}

/// `(A − 1)·cos²θ` at the nodes of a grid, `[plane][y][x]`.
pub(super) struct Nodes {
    pub layout: AlbedoLayout,
    pub values: Vec<f32>,
}

impl Fineness {
    /// For a surface.
    pub fn of(lobes: &Lobes) -> Self {
        let places = lobes.count_places();
        let found =
            FINENESS.into_iter().find(|fineness| places <= fineness.places).unwrap_or(FINENESS[FINENESS.len() - 1]);
        if !lobes.has_ridges() {
            return found;
        }
        // A wide cell has more of a ridge in it, not less.
        let Self { samples, rim_samples, again, .. } = FINENESS[1];
        Self {
            samples: found.samples.max(samples),
            rim_samples: found.rim_samples.max(rim_samples),
            again: found.again.max(again),
            ..found
        }
    }

    /// For bands instead of wavelengths: ridges are washed out, and an integral takes as many times longer as it has wavelengths.
    pub fn of_bands(lobes: &Lobes) -> Self {
        Self { cells: if lobes.has_ridges() { 32 } else { 16 }, samples: 1, rim_samples: 16, ..Self::of(lobes) }
    }
}

impl<const K: usize> Source<'_, K> {
    /// The nodes of a table. `progress` counts integrals.
    pub fn build(&self, layout: AlbedoLayout, progress: &Progress) -> Nodes {
        let coarse = layout.coarse(K);
        let integrals = |layout: &AlbedoLayout| layout.planes as usize / K * self.integrals(layout);
        let steps = progress.part(0.0, NODES_SHARE).of_steps(2 * integrals(&coarse) + integrals(&layout));
        let albedo = self.nodes(coarse, None, &steps);
        let divided = self.nodes(coarse, Some(&albedo), &steps);
        let mut nodes = self.nodes(layout, Some(&divided), &steps);
        // Light that leaves must not be divided by less than what is assumed here.
        nodes.values.iter_mut().zip(divided.refined(layout)).for_each(|(value, least)| *value = value.max(least));
        self.raise(&mut nodes, &progress.part(NODES_SHARE, 1.0));
        nodes
    }

    /// The groups of a grid's planes.
    fn groups(&self, layout: &AlbedoLayout) -> Vec<Group<K>> {
        let groups = layout.planes as usize / K;
        (0..groups).map(|i| (self.group)(i as f64 / (groups - 1).max(1) as f64)).collect()
    }

    /// Integrals in each plane of a grid: over its nodes, or those up to the middle row where the others are the same.
    fn integrals(&self, layout: &AlbedoLayout) -> usize {
        if self.lobes.is_mirrored() { (layout.cells as usize / 2 + 1) * layout.side() } else { layout.in_plane() }
    }

    /// What [`Source::least`] gives at the nodes of a grid; nodes that no cell of the disc has are zero.
    fn nodes(&self, layout: AlbedoLayout, known: Option<&Nodes>, steps: &Steps) -> Nodes {
        let in_plane = layout.in_plane();
        let groups = self.groups(&layout);
        let (mirrored, integrals) = (self.lobes.is_mirrored(), self.integrals(&layout));
        let asked = (0..groups.len() * integrals).into_par_iter().map(|i| {
            let (wi, radius) = layout.node(i % integrals);
            steps.one();
            let nothing = [f64::NEG_INFINITY; K];
            if layout.is_beyond(radius) { [0.0; K] } else { self.least(wi, &groups[i / integrals], known, nothing) }
        });
        let asked: Vec<[f64; K]> = asked.collect();
        let values = (0..in_plane * layout.planes as usize).map(|i| {
            let (plane, node) = (i / in_plane, i % in_plane);
            let node = if mirrored { node.min(layout.mirrored(node)) } else { node };
            asked[plane / K * integrals + node][plane % K] as f32
        });
        Nodes { layout, values: values.collect() }
    }

    /// The least `t ≥ 1` with `∫ f min(1, t/b(wo)) cosθo dωo ≤ t`, from above, where `b` is what is known already; the albedo itself,
    /// if above one, where nothing is. As `(t − 1)·cos²θi`; more than that, but no more than is `had`, where that is enough for the albedo.
    pub(super) fn least(&self, wi: Vec3, group: &Group<K>, known: Option<&Nodes>, had: [f64; K]) -> [f64; K] {
        let mut parts = Vec::new();
        let mut albedo = [Four::lit(0.0); K];
        for (nm, weights) in &group.wavelengths {
            self.lobes.visit::<Lanes>(wi, *nm, |wo, part| {
                let part = weights.map(|weight| Four::lit(weight) * part);
                (0..K).for_each(|k| albedo[k] += part[k]);
                parts.push((wo, part));
            });
        }
        let albedo = albedo.map(Lanes::total);
        let margin = MARGIN + RIM_MARGIN * (1.0 - wi[2]).powi(16);
        let asked = |t: f64| match t - 1.0 {
            excess if excess > NEGLIGIBLE => (excess + margin * t * (excess / MARGIN_FROM).min(1.0)) * wi[2] * wi[2],
            _ => 0.0,
        };
        let mut t = albedo.map(|albedo| albedo.max(1.0));
        let is_lacking = (0..K).any(|k| albedo[k] > 1.0 + NEGLIGIBLE && asked(t[k]) > had[k]);
        if let Some(known) = known.filter(|_| is_lacking) {
            let planes = group.planes.map(|plane| known.layout.between(plane));
            let divided: Vec<_> = parts
                .into_iter()
                .map(|(wo, part)| {
                    let excess = known.excess::<Lanes, K>(&planes, wo);
                    (part, std::array::from_fn::<Four, K, _>(|k| part[k] / (Four::lit(1.0) + excess[k])))
                })
                .collect();
            for _ in 0..STEPS {
                // Concave in t, and no more than t where t does, so that every step does if the first does.
                let step = |k: usize| {
                    let (zero, t) = (Four::lit(0.0), Four::lit(t[k]));
                    let sum = divided.iter().fold(zero, |sum, (part, per)| {
                        let (part, most) = (part[k], t * per[k]);
                        sum + Number::select(zero.lt(part), Number::min(part, most), Number::max(part, most))
                    });
                    Lanes::total(sum)
                };
                t = std::array::from_fn(|k| step(k).max(1.0));
            }
        }
        t.map(asked)
    }

    /// What a table changes, over every other node of its grid.
    pub fn report(&self, built: &Nodes) -> AlbedoReport {
        let layout = built.layout.coarse(K);
        let (mirrored, integrals) = (self.lobes.is_mirrored(), self.integrals(&layout));
        let groups = self.groups(&layout);
        let at = |i: usize| {
            let node = i % integrals;
            let (wi, radius) = layout.node(node);
            let mut found = Found::default();
            if radius >= 1.0 {
                return found;
            }
            let group = &groups[i / integrals];
            let planes = group.planes.map(|plane| built.layout.between(plane));
            let from = built.excess::<Plain<f64>, K>(&planes, wi).map(Four::lit);
            let (mut before, mut after) = ([Four::lit(0.0); K], [Four::lit(0.0); K]);
            for (nm, weights) in &group.wavelengths {
                self.lobes.visit::<Lanes>(wi, *nm, |wo, part| {
                    let to = built.excess::<Lanes, K>(&planes, wo);
                    for k in 0..K {
                        let part = Four::lit(weights[k]) * part;
                        before[k] += part;
                        after[k] += part / (Four::lit(1.0) + Number::max(from[k], to[k]));
                    }
                });
            }
            let [before, after] = [before, after].map(|albedo| albedo.map(Lanes::total));
            let stands_for = if mirrored && layout.mirrored(node) != node { 2.0 } else { 1.0 };
            // Solid angle of a node, up to a constant, times cosθ.
            let weight = stands_for * wi[2].powf(1.5);
            found.sums = [weight * K as f64, weight * before.iter().sum::<f64>(), weight * after.iter().sum::<f64>()];
            if wi[2] > 85f64.to_radians().cos() {
                found.most = before.into_iter().fold(0.0, f64::max);
            }
            found
        };
        let found = (0..groups.len() * integrals).into_par_iter().map(at).reduce(Found::default, Found::merged);
        let [weights, before, after] = found.sums;
        AlbedoReport {
            albedo_max_unscaled: found.most,
            albedo_mean_unscaled: before / weights,
            albedo_mean_scaled: after / weights,
        }
    }
}

/// Of some directions: sums of weights, and of albedos before and after times these; and the largest albedo before, below 85°.
#[derive(Clone, Copy, Default)]
struct Found {
    sums: [f64; 3],
    most: f64,
}

impl Found {
    fn merged(self, other: Self) -> Self {
        Self { sums: std::array::from_fn(|k| self.sums[k] + other.sums[k]), most: self.most.max(other.most) }
    }
}

impl Nodes {
    /// Interpolated between nodes and towards the next plane.
    #[inline]
    pub(super) fn value<V: Values>(&self, planes: &Between, place: &GridPlace<V>) -> V::Real {
        let corners: [usize; VALUES_MAX] =
            std::array::from_fn(|lane| self.layout.first_corner(V::lane(place.cell, lane)));
        let node = |from: usize| V::pack(|lane| self.values[corners[lane] + from].into());
        let row = |from: usize| lerp(node(from), node(from + 1), place.x);
        let within = |start: usize| lerp(row(start), row(start + self.layout.side()), place.y);
        lerp(within(planes.starts[0]), within(planes.starts[1]), V::Real::lit(planes.towards))
    }

    /// `A − 1` in the planes of a group.
    #[inline]
    fn excess<V: Values, const K: usize>(&self, planes: &[Between; K], w: [V::Real; 3]) -> [V::Real; K] {
        let place = place::<V>(self.layout.cells, w);
        planes.each_ref().map(|planes| self.value(planes, &place) * place.per_squared_cosine)
    }

    /// At the nodes of a grid of which these are every other, in planes as well where it has more of them.
    fn refined(&self, layout: AlbedoLayout) -> Vec<f32> {
        let (side, in_plane) = (layout.side(), layout.in_plane());
        let halves = |at: usize| [at / 2, at / 2 + at % 2];
        let value = |i: usize| {
            let plane = i / in_plane;
            let planes = if layout.planes == self.layout.planes { [plane; 2] } else { halves(plane) };
            let (ys, xs) = (halves(i % in_plane / side), halves(i % side));
            let row = |plane: usize, y: usize| (plane * self.layout.side() + y) * self.layout.side();
            let rows = planes.into_iter().flat_map(|plane| ys.map(|y| row(plane, y)));
            rows.flat_map(|row| xs.map(|x| self.values[row + x])).sum::<f32>() / 8.0
        };
        (0..in_plane * layout.planes as usize).map(value).collect()
    }
}

impl AlbedoLayout {
    /// The grid of every other node, in planes as well where there are several groups of `together` planes.
    fn coarse(&self, together: usize) -> Self {
        let by = if self.planes as usize > together { 2 } else { 1 };
        let planes = (self.planes - 1) / by + 1;
        Self { cells: self.cells / 2, planes, planes_per_nm: self.planes_per_nm / by as f32, ..*self }
    }

    /// A node's direction and distance from the middle of the disc, in radii, by its number.
    fn node(&self, i: usize) -> (Vec3, f64) {
        self.direction([(i % self.side()) as f64, (i % self.in_plane() / self.side()) as f64])
    }

    /// The node of the same plane on the other side of the x axis.
    pub(super) fn mirrored(&self, node: usize) -> usize {
        let (side, row) = (self.side(), node % self.in_plane() / self.side());
        node - row * side + (side - 1 - row) * side
    }

    /// Number of the `k`-th of eight nodes of a cell: bits of `k` are steps along x, along y, and to the next plane, if there is one.
    pub(super) fn corner(&self, [x, y, plane]: [usize; 3], k: usize) -> usize {
        let plane = (plane + (k >> 2)).min(self.planes as usize - 1);
        plane * self.in_plane() + (y + (k >> 1 & 1)) * self.side() + x + (k & 1)
    }

    /// The planes about a place from zero for the first plane to one for the last.
    pub(super) fn between(&self, plane: f64) -> Between {
        let at = plane * f64::from(self.planes - 1);
        // Rounding must not lead from one plane to the next.
        let (plane, towards) =
            if (at - at.round()).abs() < 1e-9 { (at.round(), 0.0) } else { (at.floor(), at.fract()) };
        let start = |plane: usize| plane.min(self.planes as usize - 1) * self.in_plane();
        Between { starts: [start(plane as usize), start(plane as usize + 1)], towards }
    }

    /// Number in its plane of the first corner of a cell.
    fn first_corner(&self, cell: usize) -> usize {
        // A row has one node more than cells.
        cell + cell / self.cells as usize
    }

    /// The eight nodes around a place, in a plane and in the next, with their weights.
    pub(super) fn around(&self, planes: &Between, place: &GridPlace<Plain<f64>>) -> [(usize, f64); 8] {
        let (corner, side) = (self.first_corner(place.cell as usize), self.side());
        std::array::from_fn(|k| {
            let [x, y, plane] = [k & 1, k >> 1 & 1, k >> 2];
            let weight = |upper: usize, t: f64| if upper == 1 { t } else { 1.0 - t };
            let share = weight(x, place.x) * weight(y, place.y) * weight(plane, planes.towards);
            (planes.starts[plane] + corner + y * side + x, share)
        })
    }
}
