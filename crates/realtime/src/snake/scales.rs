//! The relief of the scales: a height over the skin, and where on its scale a point lies.

use glam::DVec2;
use rand::{Rng, RngExt, SeedableRng};
use rand_pcg::Pcg64;

use super::SnakeOptions;

/// Rise of a scale from its covered root to its free edge, camber across it and height of its keel,
/// against the distance of neighbouring rows.
const TILT: f64 = 0.14;
const CAMBER: f64 = 0.15;
const KEEL: f64 = 0.06;
/// Half width of the keel against the half width of a scale.
const KEEL_WIDTH: f64 = 0.11;
/// Exponent of the outline: 1 is a rhombus, 2 an ellipse.
const OUTLINE: f64 = 1.4;
/// Width of the drop at the free edge, against the half length of a scale.
const DROP_WIDTH: f64 = 0.2;
/// Depth of that drop, more than the highest step, against the distance of rows.
const DROP: f64 = 0.35;
/// How far a vertex may be moved onto an edge, in cells. Below 1/2, so that no two can meet.
const REACH: f64 = 0.4;

struct Scale {
    height: f64,
    keel: f64,
    size: f64,
    lean: f64,
    shade: f64,
}

/// What the scale on top is like at a point of the skin.
pub(super) struct Spot {
    /// Height over the smooth skin in cm.
    pub height_cm: f64,
    /// Height of the same scale where it is not cut off at its free edge: at most a step higher.
    pub uncut_cm: f64,
    /// Which scale it is, for [`Scales::uncut_cm`].
    pub index: (i64, i64),
    /// Position on that scale: −1 at the root to 1 at the tip, and −1 to 1 across.
    pub along: f64,
    pub across: f64,
    /// 0 on the keel to 1 on the outline of the scale.
    pub edge: f64,
    /// Seeded, −1 to 1, one value for the whole scale.
    pub shade: f64,
}

/// The lattice of scales in units of half a scale: scale centres are the points (i, j) of even sum.
pub(super) struct Scales {
    scales: Vec<Scale>,
    rows_along: usize,
    rows_around: usize,
    unit_cm: f64,
    keel: f64,
}

impl Scales {
    /// `width_cm` is the width of the sheet.
    pub(super) fn new(options: &SnakeOptions, width_cm: f64) -> Self {
        let mut random = Pcg64::seed_from_u64(options.seed);
        let count = (options.rows_along + 5) * (options.rows_around + 5);
        let scales = (0..count).map(|_| scale(&mut random, options.variation)).collect();
        Self {
            scales,
            rows_along: options.rows_along,
            rows_around: options.rows_around,
            unit_cm: options.relief * width_cm / options.rows_around as f64,
            keel: options.keel,
        }
    }

    fn scale(&self, i: i64, j: i64) -> &Scale {
        let clamp = |k: i64, rows: usize| (k + 2).clamp(0, rows as i64 + 4) as usize;
        let (i, j) = (clamp(i, self.rows_along), clamp(j, self.rows_around));
        &self.scales[i * (self.rows_around + 5) + j]
    }

    /// The uppermost scale at `u`, `v` in [0, 1].
    pub(super) fn at(&self, u: f64, v: f64) -> Spot {
        let (p, q) = (u * self.rows_along as f64, v * self.rows_around as f64);
        let mut top = Spot {
            height_cm: f64::NEG_INFINITY,
            uncut_cm: 0.0,
            index: (0, 0),
            along: 0.0,
            across: 0.0,
            edge: 1.0,
            shade: 0.0,
        };
        for index in neighbours(p, q) {
            let spot = self.spot(index, p, q);
            if spot.height_cm > top.height_cm {
                top = spot;
            }
        }
        top
    }

    /// Height in cm of one scale at `u`, `v`, continued beyond its outline.
    pub(super) fn uncut_cm(&self, index: (i64, i64), u: f64, v: f64) -> f64 {
        self.spot(index, u * self.rows_along as f64, v * self.rows_around as f64).uncut_cm
    }

    /// Moves a grid point that lies within `REACH` of a cell from a visible free edge onto that edge, so
    /// that edges are smooth lines of vertices and not stairs. Points on the rim of the sheet stay on it.
    pub(super) fn snap(&self, u: f64, v: f64, cell: DVec2) -> (f64, f64) {
        let rows = DVec2::new(self.rows_along as f64, self.rows_around as f64);
        let start = DVec2::new(u, v) * rows;
        let limit = cell * rows * REACH;
        let fixed = DVec2::new(f64::from(u8::from(u > 0.0 && u < 1.0)), f64::from(u8::from(v > 0.0 && v < 1.0)));
        let mut best = (f64::NEG_INFINITY, start);
        for index in neighbours(start.x, start.y) {
            let Some(edge) = self.step_to_edge(index, start, fixed) else { continue };
            if (edge - start).abs().cmpgt(limit).any() {
                continue;
            }
            let height = self.spot(index, edge.x, edge.y).height_cm;
            let hidden = neighbours(edge.x, edge.y)
                .filter(|&other| other != index)
                .any(|other| self.spot(other, edge.x, edge.y).height_cm > height);
            if !hidden && height > best.0 {
                best = (height, edge);
            }
        }
        let snapped = best.1 / rows;
        (snapped.x.clamp(0.0, 1.0), snapped.y.clamp(0.0, 1.0))
    }

    /// Newton steps from a lattice point to the free edge of one scale.
    fn step_to_edge(&self, index: (i64, i64), start: DVec2, fixed: DVec2) -> Option<DVec2> {
        const DELTA: f64 = 1e-4;
        let mut point = start;
        for _ in 0..4 {
            let outline = |dp: f64, dq: f64| self.outline(index, point.x + dp, point.y + dq);
            let gradient = fixed
                * DVec2::new(
                    (outline(DELTA, 0.0) - outline(-DELTA, 0.0)) / (2.0 * DELTA),
                    (outline(0.0, DELTA) - outline(0.0, -DELTA)) / (2.0 * DELTA),
                );
            if gradient.length_squared() < 1e-6 {
                return None;
            }
            point -= gradient * (outline(0.0, 0.0) / gradient.length_squared());
        }
        let on_free_edge = point.x > index.0 as f64 + 0.02 && self.outline(index, point.x, point.y).abs() < 1e-3;
        on_free_edge.then_some(point)
    }

    fn outline(&self, index: (i64, i64), p: f64, q: f64) -> f64 {
        let scale = self.scale(index.0, index.1);
        let along = p - index.0 as f64;
        outline(along, q - index.1 as f64 - scale.lean * along) - scale.size
    }

    fn spot(&self, index: (i64, i64), p: f64, q: f64) -> Spot {
        let scale = self.scale(index.0, index.1);
        let along = p - index.0 as f64;
        let across = q - index.1 as f64 - scale.lean * along;
        let shape = outline(along, across);
        // The root reaches under the two scales before it and tapers where it is covered anyway.
        let root = smooth(((along + 1.5) / 0.5).clamp(0.0, 1.0));
        let rise = TILT * scale.height * 0.5 * (along + 1.0);
        let camber = CAMBER * (1.0 - across * across);
        let ridge = self.keel * scale.keel * KEEL * smooth(((along + 1.0) / 0.6).clamp(0.0, 1.0))
            / (1.0 + (across / KEEL_WIDTH).powi(2));
        let drop = smooth(((shape - scale.size) / DROP_WIDTH).clamp(0.0, 1.0));
        let height = (rise + camber + ridge + 0.2) * root - 0.2;
        Spot {
            height_cm: self.unit_cm * (height - DROP * drop),
            uncut_cm: self.unit_cm * height,
            index,
            along,
            across,
            edge: shape.clamp(0.0, 1.0),
            shade: scale.shade,
        }
    }
}

/// The scales that can be on top at a lattice point.
fn neighbours(p: f64, q: f64) -> impl Iterator<Item = (i64, i64)> {
    let (near_p, near_q) = (p.round() as i64, q.round() as i64);
    (near_p - 2..=near_p + 2)
        .flat_map(move |i| (near_q - 2..=near_q + 2).map(move |j| (i, j)))
        .filter(|(i, j)| (i + j) % 2 == 0)
}

/// 1 on the outline of a scale of nominal size: a rounded rhombus behind its centre, straight flanks before it.
fn outline(along: f64, across: f64) -> f64 {
    (along.max(0.0).powf(OUTLINE) + across.abs().powf(OUTLINE)).powf(1.0 / OUTLINE)
}

fn scale(random: &mut impl Rng, variation: f64) -> Scale {
    let mut vary = |amount: f64| variation * amount * random.random_range(-1.0..1.0);
    Scale {
        height: 1.0 + vary(0.35),
        keel: 1.0 + vary(0.5),
        size: 1.0 + vary(0.06),
        lean: vary(0.12),
        shade: vary(1.0),
    }
}

/// Smoothstep of a value in [0, 1].
pub(super) fn smooth(t: f64) -> f64 {
    t * t * (3.0 - 2.0 * t)
}
