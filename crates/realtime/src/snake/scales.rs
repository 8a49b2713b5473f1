//! The relief of the scales: a height over the skin, and where on its scale a point lies.

use glam::DVec2;

use super::{
    SnakeOptions,
    lattice::{Lattice, gauge},
};

/// Height of a scale's dome and of its keel against the distance of neighbouring rows.
const DOME: f64 = 0.05;
const KEEL: f64 = 0.03;
/// The way in which a scale rises out of the skin, and how much it falls again towards its free edges: with 0 not at all,
/// with 1 to the skin at the tip.
const RISE: f64 = 0.3;
const FALL: f64 = 0.65;
/// Half width of the keel against the half width of a scale.
const KEEL_WIDTH: f64 = 0.11;
/// `x` of [`rise`] in the middle of a scale.
const MIDDLE: f64 = 0.42;

/// What the scale on top is like at a point of the skin.
pub(super) struct Spot {
    /// Position on that scale: −1 at the root to 1 at the tip, and −1 to 1 across.
    pub along: f64,
    pub across: f64,
    /// 0 on the axis to 1 on the free edge of the scale.
    pub edge: f64,
    /// Seeded, −1 to 1, one value for the whole scale.
    pub shade: f64,
}

/// The relief of all scales.
pub(super) struct Scales {
    pub(super) lattice: Lattice,
    /// The gauge of a scale at the tip of the one that it overlaps.
    gauge_at_the_next_tip: f64,
    unit_cm: f64,
    keel: f64,
}

impl Scales {
    /// `width_cm` is the width of the sheet.
    pub(super) fn new(options: &SnakeOptions, width_cm: f64) -> Self {
        Self {
            lattice: Lattice::new(options),
            gauge_at_the_next_tip: gauge(2.0, 1.0),
            unit_cm: options.relief * width_cm / options.rows_around as f64,
            keel: options.keel,
        }
    }

    /// What is seen at `u`, `v` in [0, 1].
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

    /// Height in cm over the smooth skin of one scale at a point of the lattice, continued beyond its edges.
    ///
    /// It is 0 where the scale comes out from under the two before it, so that it is never above them there.
    pub(super) fn height_cm(&self, (i, j): (i64, i64), point: DVec2) -> f64 {
        let traits = self.lattice.traits(i, j);
        let from =
            |above: (i64, i64)| (self.lattice.local(above, point).gauge() - 1.0) / (self.gauge_at_the_next_tip - 1.0);
        // 0 on either edge at the root, both 1 at the tip.
        let (x, y) = (from((i - 1, j - 1)), from((i - 1, j + 1)));
        let across = self.lattice.local((i, j), point).across;
        let keel = self.keel * traits.keel * KEEL / (1.0 + (across / KEEL_WIDTH).powi(2));
        self.unit_cm * (DOME * traits.height + keel) * rise(x) * rise(y)
    }
}

/// Rise from an edge at the root (0) to the free edge opposite (1); 1 in the middle of the scale. It leaves the skin without
/// a crease, so that normals are continuous where scales meet.
fn rise(x: f64) -> f64 {
    let shape = |x: f64| x * x / (x * x + RISE * RISE) * (1.0 - FALL * x).max(0.0);
    shape(x) / shape(MIDDLE)
}

/// Smoothstep of a value in [0, 1].
pub(super) fn smooth(t: f64) -> f64 {
    t * t * (3.0 - 2.0 * t)
}
