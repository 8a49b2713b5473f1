//! Resolution of a colour table: radii of its rings, directions on each, knots over w.
//!
//! Ring k has the radius `r_k = knee_radius/growth · sinh(growth·(k + ½))`: uniform spacing `knee_radius` near the
//! centre, relative spacing `growth` further out. The finest feature over radius and direction is the Gaussian of an
//! order, of standard deviation `λ·sigma`. Features over w are fringes of the whole range of heights, of width
//! `λ/(2·range)` per half wave.

use std::f64::consts::{SQRT_2, TAU};

/// Wavelength in µm at which features are sampled: near the short end of what counts for colour (chosen).
const WAVELENGTH_UM: f64 = 0.45;
/// Spacing of directions in standard deviations of an order. A cubic B-spline then errs by 0.5 % of a Gaussian's peak.
const DIRECTION_SPACING: f64 = 0.87;
/// Spacing of the rings near the centre in standard deviations of an order. The cubic through four rings errs more than
/// a B-spline, by 7 % at a spacing of 1.
const RING_SPACING: f64 = 0.45;
/// Upper bound of both spacings, for short windows: a tenth of the disc of direction cosines (chosen).
const SPACING_MAX: f64 = 0.1;
/// Relative spacing of the outer rings. The integral over wavelength smears features by the width of the colour
/// matching functions, 4 to 9 %.
const GROWTH: f64 = 0.025;
/// Knots over w per feature: per half wave of the fastest fringe, and per e-fold of `1 + w/`[`W_LOG`]. Chosen for a
/// ΔE₀₀ below 1 at 99 % of the pixels (`tests/core/colour_table.rs`).
const KNOTS_PER_FEATURE: f64 = 1.3;
/// Scale of w above which knots are spaced logarithmically. The taper of an aperiodic scan spreads order zero over all
/// directions, and that light does not fall as w² near the horizon (chosen).
pub(super) const W_LOG: f64 = 0.02;
/// Fewest intervals between knots: a cubic.
const INTERVALS_MIN: usize = 3;
/// Most intervals between knots, which bounds a table's size. Reached by reliefs deeper than 350 µm.
const INTERVALS_MAX: usize = 4096;
/// Fewest directions on a ring.
const DIRECTIONS_MIN: usize = 16;
/// Outermost over innermost radius of a group of rings with equally many directions. A larger ratio wastes directions
/// on the inner rings, a smaller one integrates along more rays (chosen).
const GROUP_RATIO: f64 = SQRT_2;

/// Radius and resolution of one ring.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct RingPlan {
    pub radius: f64,
    /// Number of uniformly spaced directions.
    pub directions: usize,
    /// Number of intervals between knots over `[0, w_max]`.
    pub intervals: usize,
    /// Largest w of a look-up that reads the ring.
    pub w_max: f64,
    /// Knots per unit of w, and per e-fold of `1 + w/`[`W_LOG`].
    pub knots: (f64, f64),
}

impl RingPlan {
    /// Number of spline coefficients over w, and of the samples they are computed from.
    pub(super) fn heights(&self) -> usize {
        self.intervals + 3
    }

    /// Position of `w` in knots, from 0 to `intervals`.
    pub(super) fn knot_position(&self, w: f64) -> f64 {
        self.knots.0 * w + self.knots.1 * (1.0 + w / W_LOG).ln()
    }

    /// The w of the samples: at the knots, and one more in the first and the last interval. The first is a tenth of an
    /// interval above w = 0, where scaling by w² would be lost to rounding.
    pub(super) fn samples(&self) -> Vec<f64> {
        let last = self.intervals as f64;
        let mut positions: Vec<f64> = (0..=self.intervals).map(|i| i as f64).collect();
        positions[0] = 0.1;
        positions.insert(1, 0.4);
        positions.insert(positions.len() - 1, last - 1.0 / 3.0);
        positions.into_iter().map(|position| self.at_knot_position(position)).collect()
    }

    /// Inverse of [`RingPlan::knot_position`], by bisection.
    fn at_knot_position(&self, position: f64) -> f64 {
        let (mut low, mut high) = (0.0, self.w_max);
        for _ in 0..50 {
            let middle = 0.5 * (low + high);
            *(if self.knot_position(middle) < position { &mut low } else { &mut high }) = middle;
        }
        0.5 * (low + high)
    }
}

/// Rings of a table, from the centre outwards, and the parameters of their radii; see the [module](self).
#[derive(Clone, Debug)]
pub(super) struct Rings {
    pub knee_radius: f64,
    pub growth: f64,
    pub rings: Vec<RingPlan>,
}

impl Rings {
    /// Plans the rings for orders of standard deviation `sigma` (cycles/µm) and heights over `range_um`. `tapered` adds
    /// knots near the horizon, and `resolution` multiplies the number of samples along each axis.
    pub(super) fn plan(sigma: f64, range_um: f64, tapered: bool, resolution: f64) -> Self {
        let spacing = (DIRECTION_SPACING * WAVELENGTH_UM * sigma / resolution).min(SPACING_MAX);
        let knee_radius = spacing * RING_SPACING / DIRECTION_SPACING;
        let growth = GROWTH / resolution;
        let radius = |k: f64| knee_radius / growth * (growth * (k + 0.5)).sinh();
        let mut rings = Vec::new();
        for k in 0.. {
            // A look-up at radius r reads two rings on either side, so the last rings lie beyond the largest radius, 2.
            let inner = radius(k as f64 - 2.0);
            if inner >= 2.0 {
                break;
            }
            let radius = radius(k as f64);
            let group = (2.0 / radius).log(GROUP_RATIO).floor().max(0.0);
            let around = TAU * 2.0 * GROUP_RATIO.powf(-group) / spacing;
            // |q| ≤ 2 at the innermost radius from which the ring is read.
            let w_max = (4.0 - inner.max(0.0).powi(2)).sqrt();
            let per_w = 2.0 * range_um / WAVELENGTH_UM * KNOTS_PER_FEATURE * resolution;
            let per_efold = if tapered { KNOTS_PER_FEATURE * resolution } else { 0.0 };
            let wanted = per_w * w_max + per_efold * (1.0 + w_max / W_LOG).ln();
            let intervals = (wanted.ceil() as usize).clamp(INTERVALS_MIN, INTERVALS_MAX);
            // A flat field needs no knots; uniform ones serve.
            let knots = if wanted > 0.0 {
                let scale = intervals as f64 / wanted;
                (scale * per_w, scale * per_efold)
            } else {
                (intervals as f64 / w_max, 0.0)
            };
            rings.push(RingPlan {
                radius,
                directions: (around.ceil() as usize).max(DIRECTIONS_MIN),
                intervals,
                w_max,
                knots,
            });
        }
        Self { knee_radius, growth, rings }
    }

    /// Number of words of all samples.
    pub(super) fn words(&self) -> usize {
        self.rings.iter().map(|ring| ring.directions * ring.heights()).sum()
    }
}
