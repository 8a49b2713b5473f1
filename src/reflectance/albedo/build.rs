//! Fills an [`AlbedoTable`].

use super::gathered::Gathered;
use super::{AlbedoLayout, AlbedoTable, bf16_above};
use crate::reflectance::Vec3;
use crate::reflectance::surface::{COS_85_DEGREES, Options};
use crate::table::{KernelKind, SpectralTable, WAVELENGTH_MAX_NM, WAVELENGTH_MIN_NM};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::f64::consts::TAU;

/// Cells along a side and planes of wavelength, and places in a sum up to which each grid is used.
const GRIDS: [(u32, u32, usize); 4] = [(48, 16, 400), (32, 10, 1000), (20, 8, 4000), (16, 6, usize::MAX)];
/// Passes over places between the nodes at most, each over others.
const PASSES: usize = 4;
/// Directions of every cell in a pass, and for every cell along a side those about the horizon, in a ring of this width in radii of the disc:
/// there narrow orders, if that is all there is, make ridges that their own direction does not take away, since both directions are grazing.
const SAMPLES: usize = 1;
const RIM_SAMPLES: usize = 8;
const RIDGED_RIM_SAMPLES: usize = 32;
const RIM_WIDTH: f64 = 0.4;
/// Excess of an albedo that is let pass, and what is added besides what is lacking, as a share of that and of the divisor: what is found
/// is seldom the top of a ridge.
const NEGLIGIBLE: f64 = 3e-4;
const OVERSHOOT: f64 = 0.2;
const MARGIN: f64 = 0.003;
/// Cosine below which divisors have a margin, and how large that is.
const RIM_COSINE: f64 = 0.05;
const RIM_MARGIN: f64 = 0.02;
/// Albedo up to which nothing is divided: quadrature is good to about this.
pub(super) const ALBEDO_MAX: f64 = 1.0003;
/// Steps towards the least divisor, each of which is one.
const STEPS: usize = 4;
/// How much the division changes.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub struct AlbedoReport {
    /// Largest albedo before, over the nodes below 85°.
    pub albedo_max_unscaled: f64,
    /// Mean of the albedo over incident directions weighted by cosθ and over wavelengths, before and after.
    pub albedo_mean_unscaled: f64,
    pub albedo_mean_scaled: f64,
}

impl AlbedoTable {
    /// The table of an ensemble; `None` for a table of amplitudes, whose powers do not add.
    pub fn build(table: &SpectralTable, options: &Options) -> Option<(Self, AlbedoReport)> {
        if table.kernel() != KernelKind::Power {
            return None;
        }
        let gathered = Gathered::new(table, options);
        let layout = layout(&gathered);
        let guess = Nodes::new(layout, &gathered, None);
        if guess.values.iter().all(|&value| value == 0.0) {
            let mean = mean(&gathered, &layout, None);
            return Some((guess.packed(), report(&guess, mean)));
        }
        // Each is lower where the one before is higher; after two, nodes lie above what lets through the most.
        let lower = Nodes::new(layout, &gathered, Some(&guess.packed()));
        let mut nodes = Nodes::new(layout, &gathered, Some(&lower.packed()));
        for pass in 0..PASSES {
            if !nodes.raise(&gathered, pass) {
                break;
            }
        }
        nodes.widen_rim();
        let built = nodes.packed();
        let mean = mean(&gathered, &layout, Some(&built));
        Some((built, report(&guess, mean)))
    }
}

/// The grid for a table.
pub(super) fn layout(gathered: &Gathered) -> AlbedoLayout {
    let places = gathered.places();
    let (cells, planes, _) = GRIDS.into_iter().find(|grid| places <= grid.2).unwrap_or(GRIDS[GRIDS.len() - 1]);
    AlbedoLayout {
        cells,
        planes,
        wavelength_min_nm: WAVELENGTH_MIN_NM as f32,
        planes_per_nm: ((f64::from(planes) - 1.0) / (WAVELENGTH_MAX_NM - WAVELENGTH_MIN_NM)) as f32,
    }
}

/// The least `t ≥ 1` with `∫ f min(1, t/b(wo)) cosθo dωo ≤ t`, from above; the albedo itself, if above one, without `b`.
fn least(gathered: &Gathered, known: Option<&AlbedoTable>, wi: Vec3, wavelength_nm: f64) -> f64 {
    let mut parts = Vec::new();
    let mut albedo = 0.0;
    gathered.visit(wi, wavelength_nm, |wo, part| {
        albedo += part;
        parts.push((wo, part));
    });
    if albedo <= ALBEDO_MAX {
        return 1.0;
    }
    let Some(known) = known else { return albedo };
    let view = known.view::<f64>();
    let parts: Vec<(f64, f64)> =
        parts.into_iter().map(|(wo, part)| (part, part / view.albedo(wo, wavelength_nm, true))).collect();
    let mut t = albedo;
    for _ in 0..STEPS {
        // Concave in t, and no more than t where t does, so that every step does if the first does.
        t = parts.iter().map(|(part, divided)| part.min(t * divided)).sum::<f64>().max(1.0);
    }
    t
}

/// Excesses at the nodes, `[wavelength][y][x]`.
struct Nodes {
    layout: AlbedoLayout,
    values: Vec<f32>,
}

impl Nodes {
    /// What [`least`] gives at every node; nodes that no cell of the disc has are zero.
    fn new(layout: AlbedoLayout, gathered: &Gathered, known: Option<&AlbedoTable>) -> Self {
        let (side, in_plane) = (layout.side(), layout.in_plane());
        let value = |i: usize| {
            let (wi, radius) = layout.direction([(i % side) as f64, (i % in_plane / side) as f64]);
            if layout.is_beyond(radius) {
                return 0.0;
            }
            let nm = layout.wavelength_nm((i / in_plane) as f64);
            ((least(gathered, known, wi, nm) - 1.0) * wi[2] * wi[2]) as f32
        };
        let count = in_plane * layout.planes as usize;
        Self { layout, values: (0..count).into_par_iter().map(value).collect() }
    }

    /// Numbers of the eight nodes of a cell, with their weights at a place in it.
    fn corners(&self, [x, y, l]: [usize; 3], [tx, ty, tl]: [f64; 3]) -> [(usize, f64); 8] {
        let weight = |upper: usize, t: f64| if upper == 1 { t } else { 1.0 - t };
        std::array::from_fn(|k| {
            let (dx, dy, dl) = (k & 1, k >> 1 & 1, k >> 2);
            let node = ((l + dl) * self.layout.side() + y + dy) * self.layout.side() + x + dx;
            (node, weight(dx, tx) * weight(dy, ty) * weight(dl, tl))
        })
    }

    /// Raises nodes until nothing at the places of a pass lies below what [`least`] asks for; whether there was anything to raise. What is
    /// raised lowers the albedos of all other directions.
    fn raise(&mut self, gathered: &Gathered, pass: usize) -> bool {
        let known = self.packed();
        let cells = self.layout.cells as usize;
        let rim_samples = if gathered.has_ridges() { RIDGED_RIM_SAMPLES } else { RIM_SAMPLES };
        let (gaps, in_disc, in_rim) = (self.layout.planes as usize - 1, SAMPLES * cells * cells, rim_samples * cells);
        let nodes = &*self;
        let asked: Vec<_> = (0..gaps * (in_disc + in_rim))
            .into_par_iter()
            .flat_map_iter(|i| {
                let known = &known;
                let (k, gap) = (i / gaps, i % gaps);
                let [a, b, mut l] = scattered(PASSES * i + pass);
                // At an end of the range of wavelengths no second cell looks.
                if (k + pass) % 2 == 0 && (gap == 0 || gap + 1 == gaps) {
                    l = if gap == 0 { 0.0 } else { 1.0 };
                }
                let at = if k < in_disc {
                    let cell = k / SAMPLES;
                    [(cell % cells) as f64 + a, (cell / cells) as f64 + b]
                } else {
                    // More evenly in cosθ than the cells are.
                    let radius = 1.0 - RIM_WIDTH * a * a;
                    let (sin, cos) = (TAU * b).sin_cos();
                    [cos, sin].map(|along| 0.5 * cells as f64 * (1.0 + radius * along))
                };
                let (wi, radius) = nodes.layout.direction(at);
                let [low, between, high] = [0.0, l, 1.0].map(|l| nodes.layout.wavelength_nm(gap as f64 + l));
                let within = radius < 1.0;
                let grazing = if within { gathered.grazing_wavelengths(wi, [low, high]) } else { Vec::new() };
                let place = move |nm: f64| {
                    let [x, y] = at.map(|at| (at as usize).min(cells - 1));
                    let inside = [at[0] - x as f64, at[1] - y as f64, (nm - low) / (high - low)];
                    let corners = nodes.corners([x, y, gap], inside);
                    let have: f64 = corners.iter().map(|&(node, weight)| weight * f64::from(nodes.values[node])).sum();
                    let t = least(gathered, Some(known), wi, nm);
                    let lacking = (t - 1.0) * wi[2] * wi[2] - have;
                    let excess = lacking / (have + wi[2] * wi[2]);
                    (excess > NEGLIGIBLE)
                        .then(|| (corners, have + (1.0 + OVERSHOOT) * lacking + MARGIN * t * wi[2] * wi[2]))
                };
                let wavelengths = grazing.into_iter().chain(within.then_some(between));
                wavelengths.filter_map(place).collect::<Vec<_>>()
            })
            .collect();
        raise(&mut self.values, asked)
    }

    /// Adds a margin to nodes about the horizon that divide, where `A` changes most from node to node and next to no light is lost by it.
    fn widen_rim(&mut self) {
        let (layout, side) = (self.layout, self.layout.side());
        for (i, value) in self.values.iter_mut().enumerate().filter(|(_, value)| **value > 0.0) {
            let (wi, _) = layout.direction([(i % side) as f64, (i % layout.in_plane() / side) as f64]);
            if wi[2] < RIM_COSINE {
                *value += (RIM_MARGIN * (f64::from(*value) + wi[2] * wi[2])) as f32;
            }
        }
    }

    fn packed(&self) -> AlbedoTable {
        let (cells, planes) = (self.layout.cells as usize, self.layout.planes as usize);
        let half = |node: usize| bf16_above(self.values[node]);
        let words = (0..cells * cells * (planes - 1)).flat_map(|i| {
            let corners = self.corners([i % cells, i / cells % cells, i / cells / cells], [0.0; 3]);
            [0, 2, 4, 6].map(|k| half(corners[k].0) | half(corners[k + 1].0) << 16)
        });
        AlbedoTable { layout: self.layout, words: words.collect() }
    }
}

/// Raises nodes so that every place has at least what is asked there: places as nodes with their weights. Whether there was anything to
/// raise.
pub(super) fn raise<const K: usize>(
    values: &mut [f32],
    asked: impl IntoIterator<Item = ([(usize, f64); K], f64)>,
) -> bool {
    let mut most = vec![0f32; values.len()];
    for (corners, asked) in asked {
        let have: f64 = corners.iter().map(|&(node, weight)| weight * f64::from(values[node])).sum();
        let squares: f64 = corners.iter().map(|corner| corner.1 * corner.1).sum();
        for (node, weight) in corners {
            // Times their weights these sum to what is lacking.
            most[node] = most[node].max(((asked - have) * weight / squares) as f32);
        }
    }
    values.iter_mut().zip(&most).for_each(|(value, by)| *value += by);
    most.iter().any(|&by| by > 0.0)
}

/// Means before and after.
fn mean(gathered: &Gathered, layout: &AlbedoLayout, built: Option<&AlbedoTable>) -> [f64; 2] {
    let (side, in_plane) = (layout.side(), layout.in_plane());
    let at = |i: usize| {
        let (wi, radius) = layout.direction([(i % side) as f64, (i % in_plane / side) as f64]);
        if radius >= 1.0 || i % 2 == 1 || i / in_plane % 2 == 1 {
            return [0.0; 3];
        }
        // Every other node of every other plane. Solid angle of a node, up to a constant, times cosθ.
        let weight = wi[2].powf(1.5);
        let (mut before, mut after) = (0.0, 0.0);
        let nm = layout.wavelength_nm((i / in_plane) as f64);
        let view = built.map(|built| built.view::<f64>());
        let place = view.as_ref().map(|view| view.place(wi));
        gathered.visit(wi, nm, |wo, part| {
            before += part;
            let factor = match (&view, &place) {
                (Some(view), Some(place)) => view.factor_at(place, &view.place(wo), nm, true),
                _ => 1.0,
            };
            after += part * factor;
        });
        [weight, weight * before, weight * after]
    };
    let sums = (0..in_plane * layout.planes as usize)
        .into_par_iter()
        .map(at)
        .reduce(|| [0.0; 3], |a, b| std::array::from_fn(|k| a[k] + b[k]));
    [sums[1] / sums[0], sums[2] / sums[0]]
}

/// `unscaled` holds the albedos above one, as excesses.
fn report(unscaled: &Nodes, mean: [f64; 2]) -> AlbedoReport {
    let layout = &unscaled.layout;
    let side = layout.side();
    let steep = unscaled.values.iter().enumerate().filter_map(|(i, &value)| {
        let (wi, _) = layout.direction([(i % side) as f64, (i % layout.in_plane() / side) as f64]);
        (wi[2] > COS_85_DEGREES).then(|| 1.0 + f64::from(value) / (wi[2] * wi[2]))
    });
    AlbedoReport {
        albedo_max_unscaled: steep.fold(1.0, f64::max),
        albedo_mean_unscaled: mean[0],
        albedo_mean_scaled: mean[1],
    }
}

/// A point of an additive sequence, any few neighbours of which lie evenly in the unit cube (reciprocal powers of the root of
/// x⁴ = x + 1).
pub(super) fn scattered(i: usize) -> [f64; 3] {
    [0.819_172_513_396_164_4, 0.671_043_606_703_789_2, 0.549_700_477_901_970_3]
        .map(|step| (0.5 + step * i as f64).fract())
}
