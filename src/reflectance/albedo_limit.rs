//! The search for the energy scaling: as little as keeps every albedo at or below one.

use super::Vec3;
use super::albedo_scale::{AlbedoScale, AlbedoScaleReport, Cell};
use super::power_bins::PowerBins;
use super::surface::{COS_85_DEGREES, Options};
use crate::table::SpectralTable;
use rayon::prelude::*;

/// Lobes that a table's power is gathered into.
const LOBES: usize = 600;
/// Intervals in cosθ, nodes in azimuth and in wavelength: few sharp lobes are cheap and need a fine grid; many or wide
/// ones are smooth and dear.
const SHARP_GRID: (usize, usize, usize) = (24, 32, 12);
const SMOOTH_GRID: (usize, usize, usize) = (16, 16, 6);
/// Albedo up to which a direction is left alone: quadrature is good to about this.
const ALBEDO_MAX: f64 = 1.0003;
/// What directions beyond that are brought to, first, and in the passes that look at other places than those before,
/// where it makes up for what lies between them.
const FIRST_TARGET: f64 = 1.0;
const TARGET: f64 = 0.997;
/// Last passes, in which what is found above one is brought as far below it, within a limit: excesses left by then are
/// chance finds on steep slopes of the albedo, whose top is elsewhere in the cell.
const WARY_PASSES: usize = 3;
const WARY_TARGET_MIN: f64 = 0.98;
/// Passes at most, each over places of its own.
const PASSES: usize = 7;
/// Rounds of the fixed point, which converges by about a half each.
const BALANCE_ROUNDS: usize = 10;
/// Cosine below which directions can be lowered for the sake of others, least factor of that in one round, and share of
/// what they bring below which a node among them is left alone.
const HORIZON_COS: f64 = 0.04;
const HORIZON_FACTOR_MIN: f64 = 0.5;
const NEGLIGIBLE: f64 = 0.02;
/// Rounds that only lower, in each ring of cells.
const LOWER_ROUNDS: usize = 4;
/// Incidences looked at in each cell of a sharp table's grid, where cells span most of cosθ, and at the horizon, and those
/// for which grazing orders are looked for as well.
const SAMPLES: usize = 9;
const GRAZING_SAMPLES: usize = 5;
const PEAKS: usize = 5;
/// Most incidences looked at in a cell of another's, and places summed over in a pass, by which there are fewer.
const SMOOTH_SAMPLES: usize = 16;
const EFFORT: usize = 25_000_000;
/// Orders that leave along the surface within a cell, about.
const ORDERS_IN_CELL: usize = 8;

impl AlbedoScale {
    /// Finds the scaling for an ensemble table; `None` for a table of amplitudes.
    pub fn build(table: &SpectralTable, options: &Options) -> Option<(Self, AlbedoScaleReport)> {
        let bins = PowerBins::new(table, LOBES)?;
        let sharp = bins.sharp();
        let mut scale = Self::one(if sharp { SHARP_GRID } else { SMOOTH_GRID });
        let nodes: Vec<_> = (0..scale.values().len()).map(|i| scale.node(i)).collect();
        let at_nodes: Vec<Limit> =
            nodes.par_iter().map(|&(wi, nm)| Limit::new(&scale, &bins, options, wi, nm)).collect();
        let unscaled: Vec<f64> = at_nodes.iter().map(|limit| limit.albedo(&scale)).collect();
        if unscaled.iter().any(|&albedo| albedo > ALBEDO_MAX) {
            let limit = |scale: &Self, (wi, nm): (Vec3, f64)| Limit::new(scale, &bins, options, wi, nm);
            let cost = bins.places(options).max(1);
            for pass in 0..PASSES {
                let rings = places(&scale, &bins, cost, pass);
                let first = pass == 0;
                let target = |albedo: f64| match pass {
                    0 => FIRST_TARGET,
                    _ if pass + WARY_PASSES < PASSES => TARGET,
                    _ => (2.0 - albedo).clamp(WARY_TARGET_MIN, TARGET),
                };
                if first {
                    let between = rings.par_iter().flatten().map(|place| limit(&scale, place.at));
                    let between: Vec<Limit> = between.collect();
                    balance(&mut scale, &at_nodes.iter().chain(&between).collect::<Vec<_>>());
                }
                let mut lowered = false;
                // From the horizon, where the scaling is least, to the normal.
                for (ring, places) in rings.iter().enumerate() {
                    let limits = places.par_iter().flat_map_iter(|place| place.all(&bins));
                    let limits: Vec<Limit> = limits.map(|at| limit(&scale, at)).collect();
                    let nodes = at_nodes.iter().filter(|limit| first && limit.ring == ring);
                    lowered |= keep(&mut scale, &limits.iter().chain(nodes).collect::<Vec<_>>(), target);
                }
                if !(lowered || first) {
                    break;
                }
            }
        }
        let scaled: Vec<f64> = at_nodes.iter().map(|limit| limit.albedo(&scale)).collect();
        let weights: Vec<f64> = (0..nodes.len()).map(|i| solid_angle(&scale, i)).collect();
        let mean =
            |albedo: &[f64]| albedo.iter().zip(&weights).map(|(a, w)| a * w).sum::<f64>() / weights.iter().sum::<f64>();
        let steep = nodes.iter().zip(&unscaled).filter(|((wi, _), _)| wi[2] > COS_85_DEGREES);
        let report = AlbedoScaleReport {
            albedo_max_unscaled: steep.map(|(_, &a)| a).fold(0.0, f64::max),
            albedo_mean_unscaled: mean(&unscaled),
            albedo_mean_scaled: mean(&scaled),
        };
        Some((scale, report))
    }
}

/// The albedo at one incidence and wavelength, which is linear in the scaling of outgoing directions and in that of the
/// incident one.
struct Limit {
    wi: Cell,
    /// Interval in cosθ of the grid.
    ring: usize,
    plane: (usize, f64),
    /// What reaches each node of a plane, those of no light left out: first those about the horizon and nearer to it than
    /// the incidence.
    parts: Vec<(u32, f32)>,
    /// Number of these.
    lower: usize,
}

impl Limit {
    fn new(scale: &AlbedoScale, bins: &PowerBins, options: &Options, wi: Vec3, wavelength_nm: f64) -> Self {
        let mut sums = vec![0.0; scale.in_plane()];
        bins.visit(wi, wavelength_nm, options, |wo, part| {
            scale.cell(wo).nodes().into_iter().for_each(|(node, share)| sums[node] += share * part);
        });
        let wi = scale.cell(wi);
        let (nodes_across, horizon) = (scale.shape().0 + 1, (HORIZON_COS.sqrt() * scale.shape().0 as f64) as usize);
        let ring = wi.nodes()[0].0 % nodes_across;
        let lit = sums.into_iter().enumerate().filter(|(_, part)| *part > 0.0);
        let lit = lit.map(|(node, part)| (node as u32, part as f32));
        let (mut parts, rest): (Vec<_>, Vec<_>) =
            lit.partition(|(node, _)| *node as usize % nodes_across < ring.min(horizon));
        let lower = parts.len();
        parts.extend(rest);
        Self { wi, ring, plane: scale.plane(wavelength_nm), parts, lower }
    }

    fn albedo(&self, scale: &AlbedoScale) -> f64 {
        let [lower, rest] = self.sums(scale);
        lower + rest
    }

    /// What leaves about the horizon, nearer to it than the incidence, and what else.
    fn sums(&self, scale: &AlbedoScale) -> [f64; 2] {
        let own: f64 = self.wi.nodes().into_iter().map(|(node, share)| share * self.value(scale, node)).sum();
        let (lower, rest) = self.parts.split_at(self.lower);
        [lower, rest].map(|parts| own * parts.iter().map(|part| self.received(scale, part)).sum::<f64>())
    }

    fn received(&self, scale: &AlbedoScale, &(node, part): &(u32, f32)) -> f64 {
        f64::from(part) * self.value(scale, node as usize)
    }

    /// Factors of nodes that bring the albedo down to `target`.
    ///
    /// Directions about the horizon carry little power, but what leaves there counts as 1/cosθo: they are lowered first,
    /// within limits, and the incident direction where that does not do.
    fn remedy(&self, scale: &AlbedoScale, target: f64) -> Vec<(usize, f64)> {
        let [lower, rest] = self.sums(scale);
        let theirs = if lower > 0.0 { ((target - rest) / lower).clamp(HORIZON_FACTOR_MIN, 1.0) } else { 1.0 };
        let own = (target / (rest + theirs * lower)).min(1.0);
        let own = self.wi.nodes().into_iter().map(|(node, _)| (node, own));
        let total: f64 = self.parts[..self.lower].iter().map(|part| self.received(scale, part)).sum();
        let matters = |part: &&(u32, f32)| self.received(scale, part) > NEGLIGIBLE * total;
        let lower = self.parts[..self.lower].iter().filter(matters).map(|part| (part.0 as usize, theirs));
        own.chain(lower).flat_map(|(node, factor)| self.planes(scale, node).map(|node| (node, factor))).collect()
    }

    /// The scaling at a node of a plane, between the two about the wavelength.
    fn value(&self, scale: &AlbedoScale, node: usize) -> f64 {
        let [low, high] = self.planes(scale, node).map(|node| f64::from(scale.values()[node]));
        low + self.plane.1 * (high - low)
    }

    fn planes(&self, scale: &AlbedoScale, node: usize) -> [usize; 2] {
        [0, 1].map(|upper| (self.plane.0 + upper) * scale.in_plane() + node)
    }
}

/// Multiplies each node by the least of the factors that are asked for it.
fn apply(scale: &mut AlbedoScale, factors: impl IntoIterator<Item = (usize, f64)>) {
    let mut least: Vec<Option<f64>> = vec![None; scale.values().len()];
    for (node, factor) in factors {
        least[node] = Some(least[node].map_or(factor, |least| least.min(factor)));
    }
    for (value, factor) in scale.values_mut().iter_mut().zip(least) {
        *value = (f64::from(*value) * factor.unwrap_or(1.0)).min(1.0) as f32;
    }
}

/// Raises and lowers until every incident direction is either left alone or reflects just one.
fn balance(scale: &mut AlbedoScale, limits: &[&Limit]) {
    for _ in 0..BALANCE_ROUNDS {
        let factors: Vec<f64> = limits.par_iter().map(|limit| limit.albedo(scale).max(1e-30).powf(-0.5)).collect();
        let nodes: Vec<_> =
            limits.iter().map(|limit| limit.wi.nodes().map(|(node, _)| limit.planes(scale, node))).collect();
        let asked = nodes.into_iter().zip(factors);
        apply(scale, asked.flat_map(|(nodes, factor)| nodes.into_iter().flatten().map(move |node| (node, factor))));
    }
}

/// Lowers until every limit is kept, to the `target` for the albedo found; whether there was anything to lower.
fn keep(scale: &mut AlbedoScale, limits: &[&Limit], target: impl Fn(f64) -> f64 + Sync) -> bool {
    for round in 0..LOWER_ROUNDS {
        let found = limits.par_iter().map(|limit| (limit, limit.albedo(scale)));
        let broken = found.filter(|(_, albedo)| *albedo > ALBEDO_MAX);
        let factors: Vec<_> = broken.flat_map_iter(|(limit, albedo)| limit.remedy(scale, target(albedo))).collect();
        if factors.is_empty() {
            return round > 0;
        }
        apply(scale, factors);
    }
    true
}

/// A place to look at.
struct Place {
    /// Incidence and wavelength in nm.
    at: (Vec3, f64),
    /// Wavelengths that bound its cell, where orders that leave along the surface are to be looked for: there albedos peak.
    bounds: Option<[f64; 2]>,
}

impl Place {
    /// Itself, and the same incidence at the wavelengths at which an order grazes the surface.
    fn all(&self, bins: &PowerBins) -> impl Iterator<Item = (Vec3, f64)> + use<> {
        let (wi, nm) = self.at;
        let grazing = self.bounds.map_or(Vec::new(), |[low, high]| bins.grazing_wavelengths(wi, low, high));
        grazing.into_iter().chain([nm]).map(move |nm| (wi, nm))
    }
}

/// Places between the nodes, for each ring of cells from the horizon to the normal: scattered over the cells, every other
/// one on the edge nearer the normal, about which the last cells are very long, and every other two at an end of the range of
/// wavelengths, beyond which no cell looks. The more an albedo costs, in places that its integral takes, the fewer.
fn places(scale: &AlbedoScale, bins: &PowerBins, cost: usize, pass: usize) -> Vec<Vec<Place>> {
    let (cosines, azimuths, wavelengths) = scale.shape();
    let in_ring = (wavelengths - 1) * azimuths;
    let effort = in_ring * cosines * cost;
    let smooth = (EFFORT / effort).clamp(1, SMOOTH_SAMPLES);
    let peaks = match (bins.sharp(), bins.narrow()) {
        (true, _) => PEAKS,
        (false, true) => usize::from(ORDERS_IN_CELL * effort <= EFFORT),
        _ => 0,
    };
    let in_cell = |c: usize, cell: usize| {
        let (l, a) = (cell / azimuths, cell % azimuths);
        let towards_normal = 1 + (SAMPLES - 1) * (c + 2) / (cosines + 1);
        let samples = if bins.sharp() { towards_normal.max(GRAZING_SAMPLES) } else { smooth };
        (0..samples).map(move |k| {
            let [between, da, inside] = scattered(k + SMOOTH_SAMPLES * (pass + PASSES * (c * in_ring + cell)));
            let dc = if k % 2 == 1 { 1.0 } else { inside };
            let dl = match (l, (k / 2 + pass) % 2) {
                (0, 0) => 0.0,
                (_, 0) if l == wavelengths - 2 => 1.0,
                _ => between,
            };
            let at = |l: f64| scale.at(c as f64 + dc, a as f64 + da, l);
            let bounds = [at(l as f64).1, at(l as f64 + 1.0).1];
            Place { at: at(l as f64 + dl), bounds: (k < peaks).then_some(bounds) }
        })
    };
    (0..cosines).map(|c| (0..in_ring).flat_map(|cell| in_cell(c, cell)).collect()).collect()
}

/// cosθ times a node's share of cosθ, up to a constant.
fn solid_angle(scale: &AlbedoScale, node: usize) -> f64 {
    let cosines = scale.shape().0;
    let i = (node % (cosines + 1)) as f64;
    let at = |i: f64| (i.clamp(0.0, cosines as f64) / cosines as f64).powi(2);
    at(i) * (at(i + 1.0) - at(i - 1.0))
}

/// A point of an additive sequence, any few neighbours of which lie evenly in the unit cube (reciprocal powers of the root of
/// x⁴ = x + 1).
fn scattered(i: usize) -> [f64; 3] {
    [0.819_172_513_396_164_4, 0.671_043_606_703_789_2, 0.549_700_477_901_970_3]
        .map(|step| (0.5 + step * i as f64).fract())
}
