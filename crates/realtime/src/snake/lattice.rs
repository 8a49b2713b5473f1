//! The lattice of scales: where the corners of each scale lie, and the curves along which it ends.
//!
//! Lengths are in half scales: centres of scales are the points (i, j) of even sum, i along the body and j around it.
//! Points of odd sum are *nodes*: at each the tip of the scale before it lies between the flanks of the two beside it,
//! over the root of the one behind it.

use glam::DVec2;
use rand::{Rng, RngExt, SeedableRng};
use rand_pcg::Pcg64;

use super::SnakeOptions;

/// Exponent of a free edge: 1 is the edge of a rhombus, 2 that of an ellipse.
const OUTLINE: f64 = 1.4;
/// Greatest width of the wall below a free edge, as a share of the distance from the scale's centre. Wider walls lie in
/// the light of a low sun, with triangles that are lit and in shadow by turns; steeper ones turn away from their shading
/// normals, which are those of the scales above and below.
const WALL: f64 = 0.012;

/// A half of a scale, seen from the head: towards smaller or larger j.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum Side {
    Left,
    Right,
}

/// What differs from scale to scale; around 1, but for `lean` and `shade`, which are around 0.
#[derive(Clone, Copy)]
pub(super) struct Traits {
    pub(super) height: f64,
    pub(super) keel: f64,
    pub(super) shade: f64,
    /// Length from the centre to the tip.
    reach: f64,
    /// How far the tip lies to the right.
    lean: f64,
}

/// The nodes of one scale, seen from its centre. Halves are those of [`Side`], in its order.
#[derive(Clone, Copy)]
struct Frame {
    tip: DVec2,
    flanks: [DVec2; 2],
    /// Of the parallelograms of tip and flank.
    areas: [f64; 2],
}

/// Scales beyond the sheet whose frames are kept too, on each side: pixels at the rim ask for them.
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
    /// 0 on the axis behind the centre, 1 on the foot of the scale's edge, growing outward.
    pub(super) fn gauge(self) -> f64 {
        gauge(self.along, self.across)
    }

    /// Whether the gauge is at most 1: powers are dear, and most points are far from an edge.
    fn is_within(self) -> bool {
        let (along, across) = (self.along, self.across.abs());
        if along > 1.0 || across > 1.0 {
            return false;
        }
        along <= 0.0 || along + across <= 1.0 || along.powf(OUTLINE) + across.powf(OUTLINE) <= 1.0
    }

    /// The gauge on the edge itself, in this direction: at most `WALL` below 1.
    pub(super) fn edge(self) -> f64 {
        let (along, across) = (self.along.max(0.0), self.across.abs());
        if along > 0.0 { 1.0 - wall(along / (along + across)) } else { 1.0 }
    }
}

/// 1 on the foot of an edge: a rounded rhombus before the centre, straight flanks behind it.
pub(super) fn gauge(along: f64, across: f64) -> f64 {
    if along <= 0.0 {
        return across.abs();
    }
    (along.powf(OUTLINE) + across.abs().powf(OUTLINE)).powf(1.0 / OUTLINE)
}

/// Width of the wall from the node at the flank (`t` = 0) to the tip (1): as the step, it grows fast at first.
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
    /// The scales that the options describe, each with traits of its own.
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
        let places = (-MARGIN..=along + MARGIN).flat_map(|i| (-MARGIN..=around + MARGIN).map(move |j| (i, j)));
        lattice.frames = places.map(|scale| lattice.frame(scale)).collect();
        lattice
    }

    fn frame(&self, (i, j): (i64, i64)) -> Frame {
        let tip = self.node(i + 1, j) - centre(i, j);
        let flanks = [Side::Left, Side::Right].map(|side| self.flank((i, j), side) - centre(i, j));
        Frame { tip, flanks, areas: flanks.map(|flank| tip.perp_dot(flank)) }
    }

    fn kept_frame(&self, (i, j): (i64, i64)) -> Option<&Frame> {
        let (row, column) = (i + MARGIN, j + MARGIN);
        let columns = self.rows_around + 2 * MARGIN + 1;
        let is_kept = row >= 0 && (0..columns).contains(&column);
        is_kept.then(|| self.frames.get((row * columns + column) as usize)).flatten()
    }

    /// The traits of scale (i, j). Beyond the sides of the sheet scales are mirror images, so that the sides are straight.
    pub(super) fn traits(&self, i: i64, j: i64) -> Traits {
        let inside = if j < 0 { -j } else { j.min(2 * self.rows_around - j) };
        let place = |k: i64, rows: i64| (k + 2).clamp(0, rows + 4) as usize;
        let columns = self.rows_around as usize + 5;
        let mut found = self.traits[place(i, self.rows_along) * columns + place(inside, self.rows_around)];
        if inside != j {
            found.lean = -found.lean;
        } else if j == 0 || j == self.rows_around {
            found.lean = 0.0;
        }
        found
    }

    /// Where node (i, j) lies. Those on the ends of the sheet stay there.
    pub(super) fn node(&self, i: i64, j: i64) -> DVec2 {
        let before = self.traits(i - 1, j);
        let reach = if i == 0 || i == self.rows_along { 1.0 } else { before.reach };
        DVec2::new((i - 1) as f64 + reach, j as f64 + before.lean)
    }

    /// The point in the frame of scale (i, j).
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

    /// The point below it on the skin, where the next scale comes out: from the node at the flank to the node at the tip.
    pub(super) fn foot(&self, scale: (i64, i64), side: Side, t: f64) -> DVec2 {
        self.on_edge(scale, side, t, 1.0)
    }

    /// The point at which a ray from the scale's centre has this gauge; rays from flank to tip are `t` in [0, 1].
    fn on_edge(&self, (i, j): (i64, i64), side: Side, t: f64, level: f64) -> DVec2 {
        let centre = centre(i, j);
        let (tip, flank) = (self.node(i + 1, j) - centre, self.flank((i, j), side) - centre);
        centre + (tip * t + flank * (1.0 - t)) * (level / gauge(t, 1.0 - t))
    }

    /// The node at a flank.
    fn flank(&self, (i, j): (i64, i64), side: Side) -> DVec2 {
        self.node(i, if side == Side::Left { j - 1 } else { j + 1 })
    }

    /// The scale that is seen at a point of the sheet: the one nearest to the head that reaches there.
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
            // Where rounding leaves a gap, the nearest; of equals the first.
            .or_else(|| around().min_by(|one, other| beyond(one).total_cmp(&beyond(other))))
            .unwrap_or((first, middle))
    }
}

/// The centre of scale (i, j).
pub(super) fn centre(i: i64, j: i64) -> DVec2 {
    DVec2::new(i as f64, j as f64)
}

/// Traits by chance, as far from the mean as `variation` (0 to 1) allows.
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
