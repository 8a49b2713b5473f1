//! The lattice of scales: the corners of each scale, and the curves along which it ends.
//!
//! Lengths are in half scales. The centres of scales are the points (i, j) with even i + j, i along the body (towards
//! the tail) and j around it. Points with odd i + j are *nodes*. At a node the tip of the scale before it lies between
//! the flanks of its two neighbours, over the root of the scale behind it.
//!
//! The shape of a scale is a rounded rhombus. Its *tip* points to the tail, its *root* to the head, and its two
//! *flanks* are the corners at the sides. The two *free edges* run from the flanks to the tip. Each ends in a *wall*, a
//! narrow steep strip from the free edge down to its *foot* on the scales below. A scale has coordinates of its own,
//! [`Local`]: `along` is 1 at the node of its tip, `across` is ±1 at the nodes of its flanks. The *gauge* `(along^p +
//! |across|^p)^(1/p)` with p = [`OUTLINE`] is 1 on the foot of the free edge, and grows outward. The free edge itself
//! lies at a gauge of 1 less the width of the [`wall`] below it.

use glam::DVec2;
use rand::{Rng, RngExt, SeedableRng};
use rand_pcg::Pcg64;

use super::SnakeOptions;

/// Exponent p of the free edges: 1 for a rhombus, 2 for an ellipse; chosen by eye.
const OUTLINE: f64 = 1.4;
/// Greatest width of the wall below a free edge, as a fraction of the distance from the scale's centre. Chosen by eye.
///
/// Wider walls have triangles that are alternately lit and in shadow under a low sun. Narrower, steeper walls turn away
/// from their shading normals, which are those of the scales above and below.
const WALL: f64 = 0.012;

/// A half of a scale seen from the head: towards smaller j (left) or larger j (right).
#[derive(Clone, Copy, PartialEq)]
pub(super) enum Side {
    Left,
    Right,
}

/// Random properties of one scale. `height`, `keel` and `reach` are near 1, `shade` and `lean` near 0.
#[derive(Clone, Copy)]
pub(super) struct Traits {
    /// Factor on the height of the dome.
    pub(super) height: f64,
    /// Factor on the height of the keel.
    pub(super) keel: f64,
    /// Lightness, −1 to 1.
    pub(super) shade: f64,
    /// Distance of the tip from the centre.
    reach: f64,
    /// Displacement of the tip to the right.
    lean: f64,
}

/// The nodes of one scale relative to its centre; arrays are in the order of [`Side`].
#[derive(Clone, Copy)]
struct Frame {
    tip: DVec2,
    flanks: [DVec2; 2],
    /// Signed areas of the parallelograms of tip and flank.
    areas: [f64; 2],
}

/// Number of rows of scales beyond each side of the sheet whose frames are stored: pixels at the rim need them.
const MARGIN: i64 = 3;

/// A point in the frame of one scale.
#[derive(Clone, Copy)]
pub(super) struct Local {
    /// 0 at the centre, 1 at the node at the tip, about −1 at the root.
    pub(super) along: f64,
    /// −1 and 1 at the nodes at the flanks.
    pub(super) across: f64,
}

impl Local {
    /// The gauge: 0 on the axis behind the centre, 1 on the foot of the scale's edge.
    pub(super) fn gauge(self) -> f64 {
        gauge(self.along, self.across)
    }

    /// Whether the gauge is at most 1. Points far from the edge are decided without computing powers.
    fn is_within(self) -> bool {
        let (along, across) = (self.along, self.across.abs());
        if along > 1.0 || across > 1.0 {
            return false;
        }
        along <= 0.0 || along + across <= 1.0 || along.powf(OUTLINE) + across.powf(OUTLINE) <= 1.0
    }

    /// The gauge of the free edge in the direction of this point: at most [`WALL`] below 1.
    pub(super) fn edge(self) -> f64 {
        let (along, across) = (self.along.max(0.0), self.across.abs());
        if along > 0.0 { 1.0 - wall(along / (along + across)) } else { 1.0 }
    }
}

/// The gauge: 1 on the foot of an edge, which is a rounded rhombus before the centre and straight flanks behind it.
pub(super) fn gauge(along: f64, across: f64) -> f64 {
    if along <= 0.0 {
        return across.abs();
    }
    (along.powf(OUTLINE) + across.abs().powf(OUTLINE)).powf(1.0 / OUTLINE)
}

/// Width of the wall from the node at the flank (`t` = 0) to the tip (1). It grows fastest at the flank, as the step
/// does.
fn wall(t: f64) -> f64 {
    WALL * (1.0 - (1.0 - t).powi(3))
}

/// The scales of a snake, and some beyond the rim of the sheet.
pub(super) struct Lattice {
    traits: Vec<Traits>,
    frames: Vec<Frame>,
    pub(super) rows_along: i64,
    pub(super) rows_around: i64,
}

impl Lattice {
    /// The scales that the options describe, with random traits.
    pub(super) fn new(options: &SnakeOptions) -> Self {
        let mut random = Pcg64::seed_from_u64(options.seed);
        let count = (options.rows_along + 5) * (options.rows_around + 5);
        let (along, around) = (options.rows_along as i64, options.rows_around as i64);
        let mut lattice = Self {
            traits: (0..count).map(|_| traits(&mut random, options.variation)).collect(),
            frames: Vec::new(),
            rows_along: along,
            rows_around: around,
        };
        let scales = (-MARGIN..=along + MARGIN).flat_map(|i| (-MARGIN..=around + MARGIN).map(move |j| (i, j)));
        lattice.frames = scales.map(|scale| lattice.frame(scale)).collect();
        lattice
    }

    /// Tip and flanks of scale (i, j), from the positions of its nodes.
    fn frame(&self, (i, j): (i64, i64)) -> Frame {
        let tip = self.node(i + 1, j) - centre(i, j);
        let flanks = [Side::Left, Side::Right].map(|side| self.flank((i, j), side) - centre(i, j));
        Frame { tip, flanks, areas: flanks.map(|flank| tip.perp_dot(flank)) }
    }

    /// The stored frame of scale (i, j); `None` beyond [`MARGIN`].
    fn kept_frame(&self, (i, j): (i64, i64)) -> Option<&Frame> {
        let (row, column) = (i + MARGIN, j + MARGIN);
        let columns = self.rows_around + 2 * MARGIN + 1;
        let is_kept = row >= 0 && (0..columns).contains(&column);
        is_kept.then(|| self.frames.get((row * columns + column) as usize)).flatten()
    }

    /// The traits of scale (i, j). Scales beyond the sides of the sheet are mirror images, so that the sides are
    /// straight.
    pub(super) fn traits(&self, i: i64, j: i64) -> Traits {
        let inside = if j < 0 { -j } else { j.min(2 * self.rows_around - j) };
        let index = |k: i64, rows: i64| (k + 2).clamp(0, rows + 4) as usize;
        let columns = self.rows_around as usize + 5;
        let mut found = self.traits[index(i, self.rows_along) * columns + index(inside, self.rows_around)];
        if inside != j {
            found.lean = -found.lean;
        } else if j == 0 || j == self.rows_around {
            found.lean = 0.0;
        }
        found
    }

    /// Position of node (i, j). Nodes on the ends of the sheet stay there.
    pub(super) fn node(&self, i: i64, j: i64) -> DVec2 {
        let before = self.traits(i - 1, j);
        let reach = if i == 0 || i == self.rows_along { 1.0 } else { before.reach };
        DVec2::new((i - 1) as f64 + reach, j as f64 + before.lean)
    }

    /// A point of the lattice in the coordinates of scale (i, j).
    pub(super) fn local(&self, scale: (i64, i64), point: DVec2) -> Local {
        let from_centre = point - centre(scale.0, scale.1);
        let Frame { tip, flanks, areas } = self.kept_frame(scale).copied().unwrap_or_else(|| self.frame(scale));
        let turn = tip.perp_dot(from_centre);
        let (side, sign) = if turn < 0.0 { (Side::Left, -1.0) } else { (Side::Right, 1.0) };
        let (flank, area) = (flanks[side as usize], areas[side as usize]);
        Local { along: from_centre.perp_dot(flank) / area, across: sign * turn / area }
    }

    /// A point of the free edge of a scale, from the node at its flank (`t` = 0) to its tip (1).
    pub(super) fn lip(&self, scale: (i64, i64), side: Side, t: f64) -> DVec2 {
        self.on_edge(scale, side, t, 1.0 - wall(t))
    }

    /// A point of the foot of a free edge, where the next scale comes out: from the node at the flank to the node at
    /// the tip.
    pub(super) fn foot(&self, scale: (i64, i64), side: Side, t: f64) -> DVec2 {
        self.on_edge(scale, side, t, 1.0)
    }

    /// The point with this gauge on a ray from the scale's centre; `t` in [0, 1] turns the ray from flank to tip.
    fn on_edge(&self, (i, j): (i64, i64), side: Side, t: f64, level: f64) -> DVec2 {
        let centre = centre(i, j);
        let (tip, flank) = (self.node(i + 1, j) - centre, self.flank((i, j), side) - centre);
        centre + (tip * t + flank * (1.0 - t)) * (level / gauge(t, 1.0 - t))
    }

    /// The node at a flank.
    fn flank(&self, (i, j): (i64, i64), side: Side) -> DVec2 {
        self.node(i, if side == Side::Left { j - 1 } else { j + 1 })
    }

    /// The visible scale at a point of the sheet: the scale nearest to the head among those that cover the point.
    pub(super) fn on_top(&self, point: DVec2) -> (i64, i64) {
        let (first, middle) = (point.x.floor() as i64 - 1, point.y.round() as i64);
        let around = || {
            (first..=first + 3)
                .flat_map(|i| (middle - 2..=middle + 2).map(move |j| (i, j)))
                .filter(|(i, j)| (i + j) % 2 == 0)
        };
        let reaches = |scale: &(i64, i64)| self.local(*scale, point).is_within();
        let beyond = |scale: &(i64, i64)| self.local(*scale, point).gauge();
        around()
            .find(reaches)
            // Rounding may leave a gap, which the nearest scale closes.
            .or_else(|| around().min_by(|one, other| beyond(one).total_cmp(&beyond(other))))
            .unwrap_or((first, middle))
    }
}

/// The centre of scale (i, j).
pub(super) fn centre(i: i64, j: i64) -> DVec2 {
    DVec2::new(i as f64, j as f64)
}

/// Random traits; `variation` in [0, 1] is their relative spread.
fn traits(random: &mut impl Rng, variation: f64) -> Traits {
    let mut vary = |amount: f64| variation * amount * random.random_range(-1.0..1.0);
    Traits {
        height: 1.0 + vary(0.35),
        keel: 1.0 + vary(0.5),
        reach: 1.0 + vary(0.06),
        lean: vary(0.12),
        shade: vary(1.0),
    }
}
