//! The relief of the scales: a height over the smooth skin, and the position of a point on its scale.
//!
//! The height of a scale is `unit · (DOME + keel(across)) · rise(x) · rise(y)`. The coordinate x is 0 on the edge of
//! the scale before it on the left, under which it comes out, and 1 at its own tip; y likewise for the scale on the
//! right. They follow from the gauge of those scales (`lattice.rs`): `x = (gauge − 1)/(gauge(2, 1) − 1)`.

use glam::DVec2;

use super::{
    SnakeOptions,
    lattice::{Lattice, gauge},
};

/// Height of a scale's dome, relative to the distance of neighbouring rows; chosen by eye.
const DOME: f64 = 0.05;
/// Height of a scale's keel, relative to the distance of neighbouring rows; chosen by eye.
const KEEL: f64 = 0.03;
/// The x at which the first factor of [`rise`] is one half: smaller values make scales rise more steeply. Chosen by
/// eye.
const RISE: f64 = 0.3;
/// Fall of a scale towards its free edges: 0 for none, 1 for a fall to the skin at the tip. Chosen by eye.
const FALL: f64 = 0.65;
/// Half width of the keel, relative to the half width of a scale; chosen by eye.
const KEEL_WIDTH: f64 = 0.11;
/// `x` of [`rise`] in the middle of a scale: `(gauge(1, 1) − 1)/(gauge(2, 1) − 1)`, 0.4226 with the lattice's outline,
/// rounded. Meshes depend on the digits.
const MIDDLE: f64 = 0.42;

/// The visible scale at a point of the skin.
pub(super) struct Spot {
    /// Position from the root (−1) to the tip (1).
    pub along: f64,
    /// Position from the left flank (−1) to the right one (1).
    pub across: f64,
    /// 0 on the axis to 1 on the free edge of the scale.
    pub edge: f64,
    /// Random lightness of the scale, −1 to 1.
    pub shade: f64,
}

/// The relief of all scales.
pub(super) struct Scales {
    pub(super) lattice: Lattice,
    /// Gauge of a scale at the tip of the scale that it overlaps: `gauge(2, 1)`.
    gauge_at_next_tip: f64,
    /// Distance of neighbouring rows times the options' relief, in cm.
    unit_cm: f64,
    /// Factor on the keels.
    keel: f64,
}

impl Scales {
    /// `width_cm` is the width of the sheet.
    pub(super) fn new(options: &SnakeOptions, width_cm: f64) -> Self {
        Self {
            lattice: Lattice::new(options),
            gauge_at_next_tip: gauge(2.0, 1.0),
            unit_cm: options.relief * width_cm / options.rows_around as f64,
            keel: options.keel,
        }
    }

    /// The visible scale at `u`, `v` in [0, 1].
    pub(super) fn at(&self, u: f64, v: f64) -> Spot {
        let point = DVec2::new(u * self.lattice.rows_along as f64, v * self.lattice.rows_around as f64);
        let (i, j) = self.lattice.on_top(point);
        let local = self.lattice.local((i, j), point);
        Spot {
            along: local.along,
            across: local.across,
            edge: (local.gauge() / local.edge()).min(1.0),
            shade: self.lattice.traits(i, j).shade,
        }
    }

    /// Height in cm of one scale over the smooth skin at a point of the lattice, continued beyond its edges.
    ///
    /// It is 0 where the scale comes out from under the two before it, so that it stays below them there.
    pub(super) fn height_cm(&self, (i, j): (i64, i64), point: DVec2) -> f64 {
        let traits = self.lattice.traits(i, j);
        let distance_from =
            |before: (i64, i64)| (self.lattice.local(before, point).gauge() - 1.0) / (self.gauge_at_next_tip - 1.0);
        let (x, y) = (distance_from((i - 1, j - 1)), distance_from((i - 1, j + 1)));
        let across = self.lattice.local((i, j), point).across;
        let keel = self.keel * traits.keel * KEEL / (1.0 + (across / KEEL_WIDTH).powi(2));
        self.unit_cm * (DOME * traits.height + keel) * rise(x) * rise(y)
    }
}

/// Profile from an edge at the root (0) to the opposite free edge (1), with the value 1 in the middle of the scale. Its
/// slope is 0 at the root, so that normals are continuous where scales meet.
fn rise(x: f64) -> f64 {
    let shape = |x: f64| x * x / (x * x + RISE * RISE) * (1.0 - FALL * x).max(0.0);
    shape(x) / shape(MIDDLE)
}

/// Smoothstep of a value in [0, 1].
pub(super) fn smooth(t: f64) -> f64 {
    t * t * (3.0 - 2.0 * t)
}
