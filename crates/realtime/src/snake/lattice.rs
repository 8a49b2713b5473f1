//! The lattice of scales: the corners of each scale, and the curves along which it ends.
//!
//! # Lattice
//! Coordinates (i, j) are in *half scales*, halves of the length and the width of a scale: i along the body towards the
//! tail, j around it in the direction of v. If i + j is even, the point is the centre of a scale; "scale (i, j)" is the
//! scale with this centre. If i + j is odd, the point is a *node*. At a node four scales meet. The tip of the scale
//! towards the head lies between the flanks of its two neighbours, over the root of the scale towards the tail. A *row*
//! is a line of equal i or of equal j. The skin, called *sheet*, extends over i from 0 to `rows_along` and j from 0 to
//! `rows_around`.
//!
//! ```text
//!             right flank (i, j + 1)
//!                  ╱       ╲
//!  root (i − 1, j)   (i, j)   tip (i + 1, j)   → tail
//!                  ╲       ╱
//!             left flank (i, j − 1)
//! ```
//!
//! The figure shows the skin from outside. *Left* and *right* are those of the snake itself: +v is on its right. Random
//! numbers displace the tips, so that node (i, j) lies near, not at, the point (i, j).
//!
//! # Scale
//! The shape of a scale is a rhombus with rounded sides towards the tail. These two *free edges* run from the flanks to
//! the tip, above the scales behind. A *wall*, a narrow steep strip, leads from a free edge down to its *foot* on those
//! scales.
//!
//! A scale has coordinates of its own, `along` and `across` ([`Local`]), with
//! `point = centre + along · tip + |across| · flank`. Here `tip` is the vector from the centre to the tip node, and
//! `flank` that to the flank node on the point's side. On the left, `across` is negative.
//!
//! The *gauge* of a point is `(along^p + |across|^p)^(1/p)` with p = [`OUTLINE`], and `|across|` for `along` ≤ 0. It is
//! 1 on the foot of a free edge and grows outward. The free edge has the gauge `1 − w`, where w is the width of the
//! wall.

use glam::DVec2;
use rand::{Rng, RngExt, SeedableRng};
use rand_pcg::Pcg64;

use super::SnakeOptions;

/// Exponent p of the free edges, chosen by eye: 1 makes straight edges (a rhombus), 2 round ones (an ellipse).
const OUTLINE: f64 = 1.4;
/// Width of the wall at the tip, in units of the gauge; chosen by eye. The triangles of wider walls are alternately lit
/// and in shadow under a low sun. Narrower, steeper walls deviate more from their shading normals, which are those of
/// the scales above and below.
const WALL_WIDTH_MAX: f64 = 0.012;
/// Number of rows of random traits beyond each side of the sheet. Meshes depend on this number: it determines which
/// random numbers a scale gets.
const TRAITS_MARGIN: i64 = 2;
/// Number of rows of scales beyond each side of the sheet whose corners are stored, because points near its sides need
/// them. Corners of scales farther away are computed each time. A larger number takes more memory.
const CORNERS_MARGIN: i64 = 3;

/// The gauge of a point in the coordinates of a scale ([`Local`]).
pub(super) fn gauge(along: f64, across: f64) -> f64 {
    if along <= 0.0 {
        return across.abs();
    }
    (along.powf(OUTLINE) + across.abs().powf(OUTLINE)).powf(1.0 / OUTLINE)
}

/// Width w of the wall in units of the gauge, at a fraction `t` of the way from the flank (0) to the tip (1). The width
/// grows fastest at the flank, as the height of the free edge over its foot does.
fn wall_width(t: f64) -> f64 {
    WALL_WIDTH_MAX * (1.0 - (1.0 - t).powi(3))
}

/// A half of a scale.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum Side {
    /// Towards smaller j.
    Left,
    /// Towards larger j.
    Right,
}

/// Random properties of one scale.
#[derive(Clone, Copy)]
pub(super) struct Traits {
    /// Factor on the height of the dome (scales.rs), near 1.
    pub(super) height: f64,
    /// Factor on the height of the keel (scales.rs), near 1.
    pub(super) keel: f64,
    /// Lightness of the pigment, −1 to 1.
    pub(super) shade: f64,
    /// Distance of the tip from the centre along i in half scales, near 1.
    reach: f64,
    /// Displacement of the tip along j in half scales, near 0.
    lean: f64,
}

impl Traits {
    /// Random traits. Each deviates from its mean by at most `variation`, in [0, 1], times the number below, which is
    /// chosen by eye. Meshes depend on the order of the random numbers.
    fn random(random: &mut impl Rng, variation: f64) -> Self {
        let mut vary = |largest: f64| variation * largest * random.random_range(-1.0..1.0);
        Self {
            height: 1.0 + vary(0.35),
            keel: 1.0 + vary(0.5),
            reach: 1.0 + vary(0.06),
            lean: vary(0.12),
            shade: vary(1.0),
        }
    }
}

/// A point in the coordinates of one scale.
#[derive(Clone, Copy)]
pub(super) struct Local {
    /// 0 at the centre, 1 at the tip node, about −1 at the root.
    pub(super) along: f64,
    /// 0 on the axis from root to tip, −1 at the node of the left flank, 1 at the node of the right flank.
    pub(super) across: f64,
}

impl Local {
    /// The gauge of the point: 1 on the foot of a free edge.
    pub(super) fn gauge(self) -> f64 {
        gauge(self.along, self.across)
    }

    /// Whether the gauge is at most 1. For most points the answer follows without computing powers: along^p ≤ along and
    /// |across|^p ≤ |across| for numbers up to 1, because p exceeds 1.
    fn is_within(self) -> bool {
        let (along, across) = (self.along, self.across.abs());
        if along > 1.0 || across > 1.0 {
            return false;
        }
        along <= 0.0 || along + across <= 1.0 || along.powf(OUTLINE) + across.powf(OUTLINE) <= 1.0
    }

    /// Gauge at which the ray from the centre through the point meets the free edge; 1 towards the root, where there is
    /// no wall.
    pub(super) fn free_edge_gauge(self) -> f64 {
        if self.along <= 0.0 {
            return 1.0;
        }
        1.0 - wall_width(self.along / (self.along + self.across.abs()))
    }
}

/// Vectors from the centre of a scale to its tip node and its two flank nodes, in half scales. Arrays are in the order
/// of [`Side`].
#[derive(Clone, Copy)]
struct Corners {
    tip: DVec2,
    flanks: [DVec2; 2],
    /// Signed area of the parallelogram of `tip` and each flank vector: negative on the left.
    areas: [f64; 2],
}

/// The scales of a snake, and some beyond the sides of the sheet.
pub(super) struct Lattice {
    /// Traits of scale (i, j) for i and j from −[`TRAITS_MARGIN`] on, j fastest. Entries with odd i + j belong to no
    /// scale.
    traits: Vec<Traits>,
    /// Corners of scale (i, j) for i and j from −[`CORNERS_MARGIN`] on, j fastest. Entries with odd i + j belong to no
    /// scale.
    corners: Vec<Corners>,
    /// Length of the sheet along the body, in half scales.
    pub(super) rows_along: i64,
    /// Width of the sheet around the body, in half scales.
    pub(super) rows_around: i64,
}

impl Lattice {
    /// The scales that the options describe, with random traits.
    pub(super) fn new(options: &SnakeOptions) -> Self {
        let mut random = Pcg64::seed_from_u64(options.seed);
        let (rows_along, rows_around) = (options.rows_along as i64, options.rows_around as i64);
        let count = (rows_along + 2 * TRAITS_MARGIN + 1) * (rows_around + 2 * TRAITS_MARGIN + 1);
        let mut lattice = Self {
            traits: (0..count).map(|_| Traits::random(&mut random, options.variation)).collect(),
            corners: Vec::new(),
            rows_along,
            rows_around,
        };
        lattice.corners = (-CORNERS_MARGIN..=rows_along + CORNERS_MARGIN)
            .flat_map(|i| (-CORNERS_MARGIN..=rows_around + CORNERS_MARGIN).map(move |j| (i, j)))
            .map(|scale| lattice.corners_from_nodes(scale))
            .collect();
        lattice
    }

    /// Extent of the sheet along and around the body, in half scales.
    pub(super) fn size(&self) -> DVec2 {
        DVec2::new(self.rows_along as f64, self.rows_around as f64)
    }

    /// The traits of scale (i, j). Scales beyond j = 0 and j = `rows_around` are mirror images of those inside. The
    /// tips of scales on these lines do not lean, so that the sheet has straight sides.
    pub(super) fn traits(&self, (i, j): (i64, i64)) -> Traits {
        let inside_j = if j < 0 { -j } else { j.min(2 * self.rows_around - j) };
        // Rows beyond the margin have the traits of the outermost row.
        let index = |k: i64, rows: i64| (k + TRAITS_MARGIN).clamp(0, rows + 2 * TRAITS_MARGIN) as usize;
        let columns = (self.rows_around + 2 * TRAITS_MARGIN + 1) as usize;
        let mut found = self.traits[index(i, self.rows_along) * columns + index(inside_j, self.rows_around)];
        if inside_j != j {
            found.lean = -found.lean;
        } else if j == 0 || j == self.rows_around {
            found.lean = 0.0;
        }
        found
    }

    /// Position of node (i, j), the tip of scale (i − 1, j). Nodes at the two ends of the sheet keep their i, so that
    /// the ends are straight.
    pub(super) fn node(&self, (i, j): (i64, i64)) -> DVec2 {
        let traits = self.traits((i - 1, j));
        let reach = if i == 0 || i == self.rows_along { 1.0 } else { traits.reach };
        DVec2::new((i - 1) as f64 + reach, j as f64 + traits.lean)
    }

    /// Position of the node at a flank of scale (i, j).
    fn flank(&self, (i, j): (i64, i64), side: Side) -> DVec2 {
        self.node((i, if side == Side::Left { j - 1 } else { j + 1 }))
    }

    /// The corners of scale (i, j), from the positions of its nodes.
    fn corners_from_nodes(&self, (i, j): (i64, i64)) -> Corners {
        let tip = self.node((i + 1, j)) - centre((i, j));
        let flanks = [Side::Left, Side::Right].map(|side| self.flank((i, j), side) - centre((i, j)));
        Corners { tip, flanks, areas: flanks.map(|flank| tip.perp_dot(flank)) }
    }

    /// The stored corners of scale (i, j); `None` beyond [`CORNERS_MARGIN`].
    fn stored_corners(&self, (i, j): (i64, i64)) -> Option<&Corners> {
        let (row, column) = (i + CORNERS_MARGIN, j + CORNERS_MARGIN);
        let columns = self.rows_around + 2 * CORNERS_MARGIN + 1;
        // Rows beyond the last one are past the end of the vector, so `get` returns `None`.
        if row < 0 || !(0..columns).contains(&column) {
            return None;
        }
        self.corners.get((row * columns + column) as usize)
    }

    /// A point of the lattice in the coordinates of a scale.
    pub(super) fn local(&self, scale: (i64, i64), point: DVec2) -> Local {
        let Corners { tip, flanks, areas } =
            self.stored_corners(scale).copied().unwrap_or_else(|| self.corners_from_nodes(scale));
        // The solution of offset = along · tip + |across| · flank by Cramer's rule.
        let offset = point - centre(scale);
        let tip_offset = tip.perp_dot(offset);
        let (side, sign) = if tip_offset < 0.0 { (Side::Left, -1.0) } else { (Side::Right, 1.0) };
        let (flank, area) = (flanks[side as usize], areas[side as usize]);
        Local { along: offset.perp_dot(flank) / area, across: sign * tip_offset / area }
    }

    /// A point of the free edge of a scale, at a fraction `t` of the way from the node at the flank (0) to the tip (1).
    pub(super) fn free_edge(&self, scale: (i64, i64), side: Side, t: f64) -> DVec2 {
        self.on_outline(scale, side, t, 1.0 - wall_width(t))
    }

    /// A point of the foot of a free edge, from the node at the flank (`t` = 0) to the node at the tip (1). The next
    /// scale comes out from under the free edge there.
    pub(super) fn foot(&self, scale: (i64, i64), side: Side, t: f64) -> DVec2 {
        self.on_outline(scale, side, t, 1.0)
    }

    /// The point with the gauge `level` on a ray from the centre of scale (i, j). With `t` from 0 to 1 the ray turns
    /// from the flank to the tip.
    fn on_outline(&self, (i, j): (i64, i64), side: Side, t: f64, level: f64) -> DVec2 {
        let centre = centre((i, j));
        let (tip, flank) = (self.node((i + 1, j)) - centre, self.flank((i, j), side) - centre);
        centre + (tip * t + flank * (1.0 - t)) * (level / gauge(t, 1.0 - t))
    }

    /// The visible scale at a point of the sheet: the scale nearest to the head in which the gauge of the point is at
    /// most 1.
    ///
    /// Towards the root, the gauge 1 bounds an endless strip instead of the scale, but there the scales nearer to the
    /// head lie on top.
    pub(super) fn visible_scale(&self, point: DVec2) -> (i64, i64) {
        let (first_i, middle_j) = (point.x.floor() as i64 - 1, point.y.round() as i64);
        // The scales around the point, from head to tail. A scale reaches about one half scale from its centre, so the
        // covering one is among them.
        let nearby = || {
            (first_i..=first_i + 3)
                .flat_map(|i| (middle_j - 2..=middle_j + 2).map(move |j| (i, j)))
                .filter(|(i, j)| (i + j) % 2 == 0)
        };
        let covers = |scale: &(i64, i64)| self.local(*scale, point).is_within();
        let gauge_in = |scale: &(i64, i64)| self.local(*scale, point).gauge();
        nearby()
            .find(covers)
            // Rounding may leave a gap, which the nearest scale closes.
            .or_else(|| nearby().min_by(|a, b| gauge_in(a).total_cmp(&gauge_in(b))))
            // Never used: one of two adjacent points of `nearby` is always a scale.
            .unwrap_or((first_i, middle_j))
    }
}

/// The centre of scale (i, j).
fn centre((i, j): (i64, i64)) -> DVec2 {
    DVec2::new(i as f64, j as f64)
}
