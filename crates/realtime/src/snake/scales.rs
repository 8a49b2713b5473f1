//! The relief of the scales: a height over the smooth skin, and the visible scale at a point.
//!
//! The height of a scale is `unit · (dome + keel(across)) · rise(x) · rise(y)`. The unit is the width of a half scale
//! times the factor [`SnakeOptions::relief`]. The *dome* is the height of a scale in its middle, and the *keel* a ridge
//! along its axis. Both have random factors near 1 (`Traits` in lattice.rs).
//!
//! A scale comes out from under two *upper scales* nearer to the head, one on its left and one on its right. The *foot*
//! of an upper scale is the curve along which it ends on the scale below. The *gauge* in the coordinates of a scale
//! (lattice.rs) measures the distance from the scale's centre, and is 1 on the scale's foot.
//!
//! The coordinate x grows from 0 on the foot of the left upper scale to 1 at the tip of the covered scale. It is
//! `(gauge − 1)/(gauge(2, 1) − 1)`, with the gauge of the left upper scale. In that scale's coordinates the covered
//! scale has its centre at (1, 1) and its tip at (2, 1), apart from random displacements. The coordinate y is defined
//! likewise for the right upper scale.

use glam::DVec2;

use super::{
    SnakeOptions,
    lattice::{Lattice, gauge},
};

/// Height of a scale's dome, relative to the width of a half scale; chosen by eye. Higher domes bend the skin's normals
/// more, lower ones make scales flatter.
const DOME: f64 = 0.05;
/// Height of a scale's keel, relative to the width of a half scale; chosen by eye. A higher keel is more visible.
const KEEL: f64 = 0.03;
/// The x at which the first factor of [`rise`], x²/(x² + RISE²), is one half; chosen by eye. Smaller values make scales
/// rise more steeply.
const RISE: f64 = 0.3;
/// Slope of the second factor of [`rise`], 1 − FALL·x, which lowers a scale towards its free edges; chosen by eye. With
/// 0 nothing is lowered, with 1 the tip lies on the skin.
const FALL: f64 = 0.65;
/// Half width of the keel at half its height, relative to the half width of a scale; chosen by eye. A narrower keel is
/// sharper, and is lost where the mesh is coarse.
const KEEL_WIDTH: f64 = 0.11;
/// The x in the middle of a scale, `(gauge(1, 1) − 1)/(gauge(2, 1) − 1)` = 0.4226, rounded. Meshes depend on the
/// digits.
const MIDDLE: f64 = 0.42;

/// A point of the skin in the coordinates of its visible scale.
pub(super) struct Spot {
    /// Position along the axis of the scale: −1 at the root, 0 at the centre, 1 at the tip.
    pub along: f64,
    /// Position across the axis: −1 at the left flank, 0 on the axis, 1 at the right flank.
    pub across: f64,
    /// Gauge of the point over the gauge at which the ray from the centre through the point meets the free edge, at
    /// most 1: 0 at the centre, 1 on the free edge and beyond.
    pub edge: f64,
    /// Random lightness of the scale, −1 to 1.
    pub shade: f64,
}

/// The relief of all scales.
pub(super) struct Scales {
    pub(super) lattice: Lattice,
    /// Gauge, in the coordinates of a scale, of the tip of the scale that it overlaps: `gauge(2, 1)`. The
    /// coordinate x or y is 1 at this gauge.
    gauge_at_next_tip: f64,
    /// Width of a half scale times the options' relief, in cm.
    unit_cm: f64,
    /// Factor on the keels of all scales, [`SnakeOptions::keel`].
    keel: f64,
}

impl Scales {
    /// The relief that the options describe, on a sheet of the width `width_cm`.
    pub(super) fn new(options: &SnakeOptions, width_cm: f64) -> Self {
        Self {
            lattice: Lattice::new(options),
            gauge_at_next_tip: gauge(2.0, 1.0),
            unit_cm: options.relief * width_cm / options.rows_around as f64,
            keel: options.keel,
        }
    }

    /// The point at `u` along and `v` around the body, in [0, 1].
    pub(super) fn at(&self, u: f64, v: f64) -> Spot {
        let point = DVec2::new(u, v) * self.lattice.size();
        let scale = self.lattice.visible_scale(point);
        let local = self.lattice.local(scale, point);
        Spot {
            along: local.along,
            across: local.across,
            edge: (local.gauge() / local.free_edge_gauge()).min(1.0),
            shade: self.lattice.traits(scale).shade,
        }
    }

    /// Height in cm of scale (i, j) over the smooth skin at a point of the lattice, in half scales (lattice.rs). It is
    /// continued beyond the scale's edges.
    ///
    /// The height is 0 on the feet of the two upper scales, so that the scale stays below them there.
    pub(super) fn height_cm(&self, (i, j): (i64, i64), point: DVec2) -> f64 {
        let traits = self.lattice.traits((i, j));
        let from_foot =
            |upper: (i64, i64)| (self.lattice.local(upper, point).gauge() - 1.0) / (self.gauge_at_next_tip - 1.0);
        let (x, y) = (from_foot((i - 1, j - 1)), from_foot((i - 1, j + 1)));
        let across = self.lattice.local((i, j), point).across;
        let keel = self.keel * traits.keel * KEEL / (1.0 + (across / KEEL_WIDTH).powi(2));
        self.unit_cm * (DOME * traits.height + keel) * rise(x) * rise(y)
    }
}

/// Height profile from the foot of an upper scale (x = 0) to the tip (1), with the value 1 in the middle of the scale.
/// Its slope is 0 at the foot, so that normals are continuous there.
fn rise(x: f64) -> f64 {
    let profile = |x: f64| x * x / (x * x + RISE * RISE) * (1.0 - FALL * x).max(0.0);
    profile(x) / profile(MIDDLE)
}
