//! Resolution of a colour table: radii of its rings, directions on each ring, knots of splines over w.
//!
//! The table holds a colour over the scattering vector (u, v, w), on rings in the plane of (u, v) around the origin.
//! Each component is the sum of a direction cosine of the light and one of the viewer.
//!
//! Ring k has the radius `r_k = inner_spacing/growth · sinh(growth·(k + ½))`. Near the centre rings are `inner_spacing`
//! apart, further out `growth·r`. The finest feature over radius and direction is the Gaussian of an order. Its
//! standard deviation is `sigma_per_um` in cycles/µm, and `λ·sigma_per_um` in direction cosines. Features over w are
//! the fringes between the highest and the lowest point of the relief, `range_um` apart. A half wave of them is
//! `λ/(2·range_um)` wide.

use std::f64::consts::{SQRT_2, TAU};

/// Wavelength in µm for which features are resolved: about the peak of blue. Shorter wavelengths have narrower features
/// but little effect on the colour.
const WAVELENGTH_UM: f64 = 0.45;
/// Spacing of directions in standard deviations of an order. A cubic B-spline then errs by 1 % of a Gaussian's peak.
const DIRECTION_SPACING: f64 = 0.87;
/// Spacing of the rings near the centre in standard deviations of an order. It is finer than that of directions,
/// because the cubic through four rings errs more than a B-spline: by 5 % instead of 2 % at a spacing of 1.
const RING_SPACING: f64 = 0.45;
/// Upper bound of the spacing of directions, in direction cosines. It acts at short coherence lengths, where it bounds
/// the spacing of inner rings by 0.052. Larger values save little, since these tables are small; smaller ones enlarge
/// them.
const SPACING_MAX: f64 = 0.1;
/// Spacing of the outer rings over their radius. The integral over wavelength smears features by the width of the
/// colour matching functions, 0.04 to 0.09 of the radius. Larger values blur colours; smaller values take more rings.
const GROWTH: f64 = 0.025;
/// Knots over w per feature: per half wave of the fastest fringe, and per e-fold of `1 + w/`[`W_LOG`]. This is enough
/// for a ΔE₂₀₀₀ below 1 in 99 % of the directions (`tests/core/colour_table.rs`).
const KNOTS_PER_FEATURE: f64 = 1.3;
/// Scale of w above which the additional knots of an aperiodic scan are spaced logarithmically. The taper of such a
/// scan spreads order zero over all directions, and that light does not fall as w² near the horizon. Larger values
/// resolve less of the horizon; smaller ones take more knots.
pub(super) const W_LOG: f64 = 0.02;
/// Smallest number of intervals between knots. Even the colour of a flat relief may change with w, by the interface's
/// reflectance.
const INTERVALS_MIN: usize = 3;
/// Largest number of intervals between knots. It bounds a table's size, and is reached by reliefs deeper than 350 µm:
/// `INTERVALS_MAX·WAVELENGTH_UM/(4·KNOTS_PER_FEATURE)`, since w goes up to 2.
const INTERVALS_MAX: usize = 4096;
/// Smallest number of directions on a ring. Fewer would not build faster, since rays are integrated 16 at a time
/// (`path.rs`).
const DIRECTIONS_MIN: usize = 16;
/// Outermost over innermost radius of a group of rings with equally many directions. A larger ratio wastes directions
/// on the inner rings, a smaller one integrates along more rays.
const GROUP_RATIO: f64 = SQRT_2;

/// Radius and resolution of one ring.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct RingPlan {
    /// Radius in the plane of (u, v), in direction cosines.
    pub radius: f64,
    /// Number of directions, uniformly spaced over a full turn.
    pub directions: usize,
    /// Number of intervals between knots over `[0, w_max]`.
    pub intervals: usize,
    /// Largest w of a look-up that reads the ring.
    pub w_max: f64,
    /// Knots per unit of w, in addition to the logarithmic ones.
    pub knots_per_w: f64,
    /// Knots per e-fold of `1 + w/`[`W_LOG`], in addition to the uniform ones.
    pub knots_per_efold: f64,
}

impl RingPlan {
    /// Number of spline coefficients over w, and of the samples they are computed from.
    pub(super) fn w_count(&self) -> usize {
        self.intervals + 3
    }

    /// Position of `w` in knots, from 0 at w = 0 to `intervals` at `w_max`.
    pub(super) fn knot_position(&self, w: f64) -> f64 {
        self.knots_per_w * w + self.knots_per_efold * (1.0 + w / W_LOG).ln()
    }

    /// Values of w of the [`RingPlan::w_count`] samples, ascending: one at each knot, and one more inside the first and
    /// the last interval. The sample of knot 0 is moved up by a tenth of an interval, since the scaled colour of
    /// `fit.rs` may be 0/0 at w = 0. The additional samples are about halfway between their neighbours. Closer to one,
    /// the fit would amplify rounding more.
    pub(super) fn sampled_w(&self) -> Vec<f64> {
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
        // 50 halvings leave w_max·2⁻⁵⁰, close to the rounding of double precision.
        for _ in 0..50 {
            let middle = 0.5 * (low + high);
            if self.knot_position(middle) < position {
                low = middle;
            } else {
                high = middle;
            }
        }
        0.5 * (low + high)
    }
}

/// Number of directions on a ring: at most `spacing` (in direction cosines) apart at the outer radius of its group.
fn directions(radius: f64, spacing: f64) -> usize {
    // Group g has radii from 2·GROUP_RATIO^(−g − 1) to 2·GROUP_RATIO^(−g). Group 0 also has the rings beyond 2, which
    // only look-ups near 2 read.
    let group = (2.0 / radius).log(GROUP_RATIO).floor().max(0.0);
    let outer_radius = 2.0 * GROUP_RATIO.powf(-group);
    ((TAU * outer_radius / spacing).ceil() as usize).max(DIRECTIONS_MIN)
}

/// Rings of a table, with the parameters of their radii; see the [module](self).
#[derive(Clone, Debug)]
pub(super) struct Rings {
    /// Spacing near the centre, in direction cosines.
    pub inner_spacing: f64,
    /// Spacing of the outer rings over their radius.
    pub growth: f64,
    /// Rings from the centre outwards.
    pub rings: Vec<RingPlan>,
}

impl Rings {
    /// Plans the rings for orders of the standard deviation `sigma_per_um` (cycles/µm) > 0, and heights that differ by
    /// at most `range_um`. `tapered` adds knots near the horizon for an aperiodic scan. `resolution`, above 0,
    /// multiplies the number of samples along each axis, within the bounds above.
    pub(super) fn plan(sigma_per_um: f64, range_um: f64, tapered: bool, resolution: f64) -> Self {
        let spacing = (DIRECTION_SPACING * WAVELENGTH_UM * sigma_per_um / resolution).min(SPACING_MAX);
        let inner_spacing = spacing * RING_SPACING / DIRECTION_SPACING;
        let growth = GROWTH / resolution;
        let radius_of = |k: f64| inner_spacing / growth * (growth * (k + 0.5)).sinh();
        let mut rings = Vec::new();
        for k in 0.. {
            // A look-up at radius r reads two rings on either side, so ring k serves radii from that of ring k − 2, or
            // from 0 where this is negative. Radii of look-ups are at most 2.
            let innermost = radius_of(k as f64 - 2.0);
            if innermost >= 2.0 {
                break;
            }
            let radius = radius_of(k as f64);
            // |(u, v, w)| ≤ 2, at the innermost radius that the ring serves.
            let w_max = (4.0 - innermost.max(0.0).powi(2)).sqrt();
            let per_w = 2.0 * range_um / WAVELENGTH_UM * KNOTS_PER_FEATURE * resolution;
            let per_efold = if tapered { KNOTS_PER_FEATURE * resolution } else { 0.0 };
            let needed_intervals = per_w * w_max + per_efold * (1.0 + w_max / W_LOG).ln();
            let intervals = (needed_intervals.ceil() as usize).clamp(INTERVALS_MIN, INTERVALS_MAX);
            // Scaled so that the last knot lies at w_max. A flat periodic field has no features; uniform knots serve.
            let (knots_per_w, knots_per_efold) = if needed_intervals > 0.0 {
                let scale = intervals as f64 / needed_intervals;
                (scale * per_w, scale * per_efold)
            } else {
                (intervals as f64 / w_max, 0.0)
            };
            rings.push(RingPlan {
                radius,
                directions: directions(radius, spacing),
                intervals,
                w_max,
                knots_per_w,
                knots_per_efold,
            });
        }
        Self { inner_spacing, growth, rings }
    }

    /// Number of 32-bit words of all spline coefficients; a word holds red, green and blue (`pack.rs`).
    pub(super) fn words(&self) -> usize {
        self.rings.iter().map(|ring| ring.directions * ring.w_count()).sum()
    }
}
