//! Plan of a colour table: radii of the rings, their directions and their samples in w (symbols in `mod.rs`).

use std::f64::consts::TAU;

/// Spacing of directions, in standard deviations of an order's Gaussian at [`WAVELENGTH_UM`].
///
/// Chosen: a cubic B-spline through samples at this spacing errs by 0.5 % of the Gaussian's peak.
const SPACING_SIGMAS: f64 = 0.87;
/// Spacing of rings near the centre, in standard deviations of an order's Gaussian at [`WAVELENGTH_UM`].
///
/// Chosen smaller than [`SPACING_SIGMAS`], since the cubic through four rings errs by 7 % at a spacing of one.
const RING_SPACING_SIGMAS: f64 = 0.45;
/// Wavelength in µm that sets the spacings: the peak of z̄, the matching function of the shortest wavelengths.
const WAVELENGTH_UM: f64 = 0.45;
/// Largest spacing of directions, in direction cosines. Chosen: well below the disc's radius of 2.
const SPACING_MAX: f64 = 0.1;
/// Relative spacing of outer rings. Chosen: the colour matching functions, which smear orders radially, have standard
/// deviations of 4 to 9 % in wavelength.
const GROWTH: f64 = 0.025;
/// Knots in w per half wave of the fastest phase, of the whole range of heights at [`WAVELENGTH_UM`]. Chosen.
const KNOTS_PER_HALF_WAVE: f64 = 1.3;
/// The w down to which the knots of tapered scans become denser. Chosen.
///
/// The taper spreads order zero over all directions, so F does not fall as w² there.
pub(super) const W_LOG: f64 = 0.02;
/// Knots in w per e-fold of `1 + w/W_LOG` for tapered scans. Chosen.
const KNOTS_PER_EFOLD: f64 = 1.3;
/// Fewest intervals between knots, for samples within the first and the last of them.
const INTERVALS_MIN: usize = 3;
/// Most intervals between knots, reached at heights of some 350 µm. Bounds the interpolation matrix of `build.rs`.
const INTERVALS_MAX: usize = 4096;
/// Fewest directions on a ring. Chosen; enough for the start-up of the periodic prefilter in `build.rs`.
const DIRECTIONS_MIN: usize = 16;
/// Outermost over innermost radius of a group of rings, which share their directions and the integration along rays.
/// Chosen.
const GROUP_RATIO: f64 = std::f64::consts::SQRT_2;

/// Radius and resolution of one ring.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct RingPlan {
    /// Radius r in the plane of `(u, v)`.
    pub radius: f64,
    /// Number of equally spaced directions.
    pub directions: usize,
    /// Number of intervals between knots over `[0, w_max]`.
    pub intervals: usize,
    /// Largest w of a query on the ring.
    pub w_max: f64,
    /// Knots per unit of w.
    pub knots_per_w: f64,
    /// Knots per e-fold of `1 + w/`[`W_LOG`].
    pub knots_per_efold: f64,
}

impl RingPlan {
    /// Number of spline coefficients in w, equal to the number of samples.
    pub(super) fn heights(&self) -> usize {
        self.intervals + 3
    }

    /// Coordinate y of `w` in knots, 0 to [`RingPlan::intervals`].
    pub(super) fn knot_position(&self, w: f64) -> f64 {
        self.knots_per_w * w + self.knots_per_efold * (1.0 + w / W_LOG).ln()
    }

    /// Sampled values of w: the knots, and one more within the first and the last interval, as many as coefficients.
    /// The first lies slightly above 0, where H is 0/0.
    pub(super) fn samples(&self) -> Vec<f64> {
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
    /// Plans the rings of a table.
    ///
    /// `sigma` is the standard deviation of an order's Gaussian in cycles/µm, and `range_um` the range of heights.
    /// `tapered` tells an aperiodic scan. `resolution` is a factor on the number of samples along each axis.
    pub(super) fn plan(sigma: f64, range_um: f64, tapered: bool, resolution: f64) -> Self {
        let spacing = (SPACING_SIGMAS * WAVELENGTH_UM * sigma / resolution).min(SPACING_MAX);
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
            // A look-up reads a ring from up to two rings further inwards, where w is largest for |q| = 2.
            let w_max = (4.0 - inner.max(0.0).powi(2)).sqrt();
            let per_w = 2.0 * range_um / WAVELENGTH_UM * KNOTS_PER_HALF_WAVE * resolution;
            let per_efold = if tapered { KNOTS_PER_EFOLD * resolution } else { 0.0 };
            let wanted = per_w * w_max + per_efold * (1.0 + w_max / W_LOG).ln();
            let intervals = (wanted.ceil() as usize).clamp(INTERVALS_MIN, INTERVALS_MAX);
            // A flat relief has no phase; its intervals are uniform in w.
            let (knots_per_w, knots_per_efold) = if wanted > 0.0 {
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
                knots_per_w,
                knots_per_efold,
            });
        }
        Self { knee_radius, growth, rings }
    }

    /// Number of words of the rings' samples.
    pub(super) fn words(&self) -> usize {
        self.rings.iter().map(|ring| ring.directions * ring.heights()).sum()
    }
}
