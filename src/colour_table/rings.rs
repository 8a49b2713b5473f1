//! Plan of a colour table: radii of the rings, their directions and heights.

use std::f64::consts::TAU;

/// Spacing of directions in standard deviations of an order's Gaussian at
/// [`WAVELENGTH_UM`]: a cubic B-spline errs by 0.5 % of a Gaussian's peak at this one.
const SPACING_SIGMAS: f64 = 0.87;
/// Spacing of rings near the centre, in the same unit. The cubic through four rings errs by 7 % at a spacing of one.
const RING_SPACING_SIGMAS: f64 = 0.45;
/// Wavelength in µm near the short end of the colour matching functions.
const WAVELENGTH_UM: f64 = 0.45;
/// Relative spacing of the rings: the colour matching functions are bells of 4 to 9 % in wavelength.
const GROWTH: f64 = 0.025;
/// Knots over w in half waves of the fastest phase, that of the whole range of heights, at [`WAVELENGTH_UM`].
const KNOTS_PER_HALF_WAVE: f64 = 1.3;
/// The w down to which knots may be dense. A scan's taper spreads order zero over all directions, where F falls neither
/// as w² nor uniformly.
pub(super) const W_LOG: f64 = 0.02;
/// Knots per e-fold of w for such scans.
const KNOTS_PER_EFOLD: f64 = 1.3;
/// Least and greatest number of intervals between knots.
const INTERVALS: std::ops::RangeInclusive<usize> = 3..=4096;
/// Least number of directions on a ring.
const DIRECTIONS_MIN: usize = 16;
/// Outermost over innermost radius of a group of rings, which share their directions.
const GROUP_RATIO: f64 = std::f64::consts::SQRT_2;

/// Radius and resolution of one ring.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct RingPlan {
    pub radius: f64,
    /// Equally spaced directions.
    pub directions: usize,
    /// Intervals between knots over `[0, w_max]`.
    pub intervals: usize,
    /// Largest w of a query on the ring.
    pub w_max: f64,
    /// Knots per unit of w; the field below counts them per e-fold of `1 + w/`[`W_LOG`].
    pub knots: (f64, f64),
}

impl RingPlan {
    /// Number of spline coefficients over height, equal to the number of samples.
    pub fn heights(&self) -> usize {
        self.intervals + 3
    }

    /// Position of `w` among the knots, 0 to [`RingPlan::intervals`].
    pub fn knot_position(&self, w: f64) -> f64 {
        self.knots.0 * w + self.knots.1 * (1.0 + w / W_LOG).ln()
    }

    /// Sampled values of w: the knots, with the first one slightly above 0 to keep squares of w representable, and one
    /// more within the first and the last interval.
    pub fn samples(&self) -> Vec<f64> {
        let last = self.intervals as f64;
        let mut positions: Vec<f64> = (0..=self.intervals).map(|i| i as f64).collect();
        positions[0] = 0.1;
        positions.insert(1, 0.4);
        positions.insert(positions.len() - 1, last - 1.0 / 3.0);
        positions.into_iter().map(|position| self.at_knot_position(position)).collect()
    }

    /// The inverse of [`RingPlan::knot_position`], by bisection.
    fn at_knot_position(&self, position: f64) -> f64 {
        let (mut low, mut high) = (0.0, self.w_max);
        for _ in 0..50 {
            let middle = 0.5 * (low + high);
            *(if self.knot_position(middle) < position { &mut low } else { &mut high }) = middle;
        }
        0.5 * (low + high)
    }
}

/// The rings of a table, from the centre outwards, and the constants of the formula of their radii,
/// `r_k = knee_radius/growth · sinh(growth·(k + ½))`.
#[derive(Clone, Debug)]
pub(super) struct Rings {
    pub knee_radius: f64,
    pub growth: f64,
    pub rings: Vec<RingPlan>,
}

impl Rings {
    /// `sigma` is the standard deviation of an order's Gaussian in cycles/µm, `range_um` the range of heights,
    /// `tapered` says whether the scan stands alone, and `resolution` multiplies the number of samples in each
    /// direction.
    pub fn plan(sigma: f64, range_um: f64, tapered: bool, resolution: f64) -> Self {
        // The spacing stays well below the radius of the whole disc.
        let spacing = (SPACING_SIGMAS * WAVELENGTH_UM * sigma / resolution).min(0.1);
        let knee_radius = spacing * RING_SPACING_SIGMAS / SPACING_SIGMAS;
        let growth = GROWTH / resolution;
        let radius = |k: f64| knee_radius / growth * (growth * (k + 0.5)).sinh();
        let mut rings = Vec::new();
        for k in 0.. {
            let inner = radius(k as f64 - 2.0);
            if inner >= 2.0 {
                break;
            }
            let radius = radius(k as f64);
            // The last rings lie beyond 2, for interpolation up to there.
            let group = (2.0 / radius).log(GROUP_RATIO).floor().max(0.0);
            let around = TAU * 2.0 * GROUP_RATIO.powf(-group) / spacing;
            // Queries reach inwards from half of the ring's neighbourhood, up to |q| = 2.
            let w_max = (4.0 - inner.max(0.0).powi(2)).sqrt();
            let per_w = 2.0 * range_um / WAVELENGTH_UM * KNOTS_PER_HALF_WAVE * resolution;
            let per_efold = if tapered { KNOTS_PER_EFOLD * resolution } else { 0.0 };
            let wanted = per_w * w_max + per_efold * (1.0 + w_max / W_LOG).ln();
            let intervals = (wanted.ceil() as usize).clamp(*INTERVALS.start(), *INTERVALS.end());
            // At least one interval, even for a flat field.
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

    /// Number of words of the rings' samples.
    pub fn words(&self) -> usize {
        self.rings.iter().map(|ring| ring.directions * ring.heights()).sum()
    }
}
