//! Quadrature of one node of an ensemble table over the hemisphere.
//!
//! A node carries the power `P(κ)` at the phase rate κ in rad/µm. It is spread around the node's frequency f as a
//! Gaussian of the standard deviation `σ_f`. At the incidence wi and the wavelength λ this is a Gaussian in the plane
//! of outgoing direction cosines:
//!
//! - centre `λf − wi`, at the distance ρ from the origin, the normal,
//! - standard deviation `σ = λσ_f` along each axis.
//!
//! The horizon is the unit circle, ρ = 1, where the obliquity factor has the pole `1/cosθo`. Far from it Gauss–Hermite
//! rules follow the integrand. Near it a rule along the radius is used, in an angle in which there is no pole.
//!
//! A *merged* Gaussian stands for several weaker nodes together, and needs less accuracy.

use super::quadrature::{HERMITE_3, HERMITE_5, LEGENDRE_6, LEGENDRE_16, SymmetricRule, hemisphere, in_panels};
use crate::numeric::math::GAUSSIAN_REACH;
use crate::scattering::{Vec3, direction_above};
use std::borrow::Cow;
use std::f64::consts::TAU;

/// σ in direction cosines below which one quadrature node stands for a Gaussian's width. At transparent bodies σ is in
/// units of the wave number in the medium. Far from the horizon the larger σ of both axes is compared, near the horizon
/// the σ across the radius. Larger values take fewer nodes. Chosen with [`WIDE_SIGMA`] for the error of 0.2 % that the
/// tests of the accurate integral allow.
pub(super) const SHARP_SIGMA: f64 = 0.01;
/// Largest ratio of σ across the radius to cosθi for one quadrature node near the horizon. The obliquity factor depends
/// on the distance from the mirror direction in units of cosθi. Chosen.
const SHARP_OF_COSINE: f64 = 0.3;
/// σ across the radius, in direction cosines, from which five quadrature nodes are used instead of three; see
/// [`SHARP_SIGMA`] for the error.
const WIDE_SIGMA: f64 = 0.04;
/// Smallest `cos²θo/σ`, with θo of the centre, at which one quadrature node stands for a Gaussian. The mean of
/// `1/cosθo` then has an error of 0.1 %.
const ONE_NODE_SIGMAS: f64 = 40.0;
/// Smallest `cos²θo/σ`, with θo of the centre, at which three quadrature nodes per axis stand for a Gaussian, and one
/// for a merged Gaussian. Three give the mean of `1/cosθo` to 1e-5, one to 0.6 %.
const THREE_NODES_SIGMAS: f64 = 16.0;
/// Largest change of the relief's phase over a panel of 16 quadrature nodes, in radians: about five periods. Chosen:
/// wider panels sample fringes too coarsely; narrower ones take longer.
pub(super) const PANEL_PHASE_MAX: f64 = 30.0;
/// Largest width of a panel of 16 quadrature nodes, in standard deviations of a Gaussian or a wide node. Chosen: wider
/// panels are less accurate; narrower ones take longer.
pub(super) const PANEL_SIGMAS: f64 = 18.0;
/// Distance of the centre inside the horizon, in standard deviations, at which the mean of `(1 − ρ)^(−½)` over a
/// Gaussian is largest, to two digits. Near the horizon `1/cosθo` is proportional to this power.
const PEAK_SIGMAS: f64 = 0.77;

/// Power `P(κ)` around a frequency, with a Gaussian spread.
#[derive(Clone)]
pub(super) struct NodeGaussian<'a> {
    /// Frequency along x and y in cycles/µm.
    pub f: [f64; 2],
    /// Standard deviation along x and y in cycles/µm.
    pub sigma_f: [f64; 2],
    /// Record of the table that gives `P(κ)`: header and spline coefficients, or the sums of those of several nodes.
    pub record: Cow<'a, [f32]>,
    /// Whether the Gaussian stands for several nodes; coarser rules then suffice.
    pub merged: bool,
}

/// Incident light, and all other parameters that are common to the nodes of an integral.
pub(super) struct Incidence {
    /// Incident direction.
    pub wi: Vec3,
    /// Wavelength in µm.
    pub wavelength_um: f64,
    /// Outgoing direction cosines between which the pixels resolve the relief, `[[x low, x high], [y low, y high]]`.
    pub resolved: [[f64; 2]; 2],
    /// Change of the relief's phase, in radians from its lowest point to its highest, per unit of cosθo.
    pub phase: f64,
    /// Whether panels end exactly at the limits of `resolved`. Otherwise their quadrature nodes beyond are dropped.
    pub exact_cut: bool,
    /// Ridge onto which narrow orders near the horizon are moved; `None` leaves them in place.
    pub ridge: Option<Ridge>,
}

/// Rule for the quadrature of a Gaussian, in order of cost.
enum Rule {
    /// One node at the centre.
    OneNode,
    /// Gauss–Hermite rules along both axes, or their counterparts for a Gaussian that is cut.
    Hermite,
    /// Panels over the part of the hemisphere within the resolved range.
    CutPanels,
    /// Panels along the radius, without the nodes beyond the resolved range.
    RadialPanels,
}

/// Ridge of the albedo, and the box of incident directions and wavelengths that a node of the albedo's table
/// represents.
///
/// The albedo has a ridge along the incidences from which an order leaves along the surface. Such an order adds most to
/// the albedo at some cosθo slightly above the horizon. Where this happens anywhere in the box, the order is counted as
/// if it happened at the node itself.
#[derive(Clone, Copy)]
pub(crate) struct Ridge {
    /// cosθo at which such an order is counted.
    pub cosine: f64,
    /// Half-sides `[grid axis][x, y]` of the box along the x and y axes of the albedo table's grid. Each is a
    /// difference of wi's direction cosines along x and y.
    pub half_sides: [[f64; 2]; 2],
    /// Half of the box's range of wavelengths in µm.
    pub half_range_um: f64,
}

/// cosθo of the centre at which the mean of `1/cosθo` over a Gaussian of the standard deviation `sigma` (in direction
/// cosines) is largest.
pub(super) fn peak_cosine(sigma: f64) -> f64 {
    // cosθo = √(1 − ρ²) at ρ = 1 − PEAK_SIGMAS·σ.
    (1.0 - (1.0 - PEAK_SIGMAS * sigma).powi(2)).max(0.0).sqrt()
}

impl Ridge {
    /// Centre of a Gaussian at the frequency `f`, moved along the radius onto the ridge if the ridge crosses the box.
    /// `sigma` is its larger standard deviation in direction cosines.
    fn moved(&self, centre: [f64; 2], f: [f64; 2], sigma: f64) -> [f64; 2] {
        // Order 0, in the mirror direction, never passes the horizon.
        if f == [0.0; 2] {
            return centre;
        }
        let rho = length(centre);
        let ridge_rho = (1.0 - self.cosine.max(peak_cosine(sigma)).powi(2)).sqrt();
        // Changes of ρ from the middle of the box to its sides: `centre = λf − wi` is linear in wi and λ.
        let along_radius = |[x, y]: [f64; 2]| (centre[0] * x + centre[1] * y) / rho;
        let [x, y] = self.half_sides.map(along_radius);
        // Largest change of ρ within the ellipsoid that touches the box's sides, less the σ that the Gaussian covers.
        // It is NaN for ρ = 0, where the comparison below is false.
        let reach = length([length([x, y]), self.half_range_um * along_radius(f)]) - sigma;
        if (rho - ridge_rho).abs() < reach { centre.map(|c| c * ridge_rho / rho) } else { centre }
    }
}

impl NodeGaussian<'_> {
    /// Calls `visit` with each quadrature node of the Gaussian above the horizon: its direction, a factor and an
    /// exponent. `factor·exp(exponent)` is the node's fraction of the Gaussian's integral over the plane of direction
    /// cosines. The exponential is left to the caller, which computes several at once.
    pub(super) fn integrate(&self, incidence: &Incidence, mut visit: impl FnMut(Vec3, f64, f64)) {
        let Incidence { wi, wavelength_um, resolved, ridge, .. } = *incidence;
        let sigma = self.sigma_f.map(|sigma| wavelength_um * sigma);
        let widest = sigma[0].max(sigma[1]);
        let mut centre = [0, 1].map(|axis| wavelength_um * self.f[axis] - wi[axis]);
        if let Some(ridge) = ridge {
            centre = ridge.moved(centre, self.f, widest);
        }
        // Most nodes of a natural relief lie beyond the horizon, and are rejected before a root is taken.
        let rho_squared = centre[0] * centre[0] + centre[1] * centre[1];
        if rho_squared >= (1.0 + GAUSSIAN_REACH * widest).powi(2) {
            return;
        }
        // Limits of the resolved range, in standard deviations from the centre.
        let limits = [0, 1].map(|axis| resolved[axis].map(|limit| (limit - centre[axis]) / sigma[axis]));
        if limits.iter().any(|[low, high]| *low >= GAUSSIAN_REACH || *high <= -GAUSSIAN_REACH) {
            return;
        }
        // Along each axis, whether the limits lie beyond the Gaussian's ends.
        let is_whole = limits.map(|[low, high]| low <= -GAUSSIAN_REACH && high >= GAUSSIAN_REACH);
        match self.rule(incidence, rho_squared, widest, is_whole) {
            Rule::OneNode => {
                if let Some(wo) = direction_above(centre[0], centre[1]) {
                    visit(wo, 1.0, 0.0);
                }
            }
            Rule::Hermite => {
                let [x, y] = [0, 1].map(|axis| gaussian_rule(limits[axis], is_whole[axis]));
                for (tx, weight_x) in x {
                    for (ty, weight_y) in y {
                        if let Some(wo) = direction_above(centre[0] + tx * sigma[0], centre[1] + ty * sigma[1]) {
                            visit(wo, weight_x * weight_y, 0.0);
                        }
                    }
                }
            }
            Rule::CutPanels => integrate_cut(incidence, centre, sigma, limits, visit),
            Rule::RadialPanels => {
                let visit_resolved = |wo: Vec3, factor: f64, exponent: f64| {
                    if [0, 1].iter().all(|&axis| resolved[axis][0] <= wo[axis] && wo[axis] <= resolved[axis][1]) {
                        visit(wo, factor, exponent);
                    }
                };
                match self.merged {
                    true => self.integrate_radially(incidence, centre, sigma, &LEGENDRE_6, visit_resolved),
                    false => self.integrate_radially(incidence, centre, sigma, &LEGENDRE_16, visit_resolved),
                }
            }
        }
    }

    /// The cheapest rule that is accurate enough. `rho_squared` is ρ² of the Gaussian's centre, and `widest` its larger
    /// σ. `is_whole` tells for each axis whether the resolved range includes all of the Gaussian.
    fn rule(&self, incidence: &Incidence, rho_squared: f64, widest: f64, is_whole: [bool; 2]) -> Rule {
        let rho = rho_squared.sqrt();
        // Whether Gauss–Hermite rules follow `1/cosθo` and the relief's phase. The pole of the former then lies 1 σ
        // beyond the Gaussian's ends, and the phase changes by phase·σ·ρ/cosθo < 1 rad over σ. Both bounds are chosen.
        let is_clear = 1.0 - rho > (GAUSSIAN_REACH + 1.0) * widest
            && incidence.phase * widest * rho < (1.0 - rho_squared).max(0.0).sqrt();
        // Whether cos²θo/σ exceeds a bound; cos²θo = 1 − ρ².
        let is_far = |sigmas: f64| 1.0 - rho_squared > sigmas * widest;
        let is_sharp =
            if self.merged { is_far(THREE_NODES_SIGMAS) } else { widest < SHARP_SIGMA && is_far(ONE_NODE_SIGMAS) };
        if is_clear && is_sharp && is_whole == [true; 2] {
            Rule::OneNode
        } else if is_clear && (is_far(THREE_NODES_SIGMAS) || incidence.exact_cut) {
            Rule::Hermite
        } else if incidence.exact_cut {
            Rule::CutPanels
        } else {
            Rule::RadialPanels
        }
    }

    /// [`NodeGaussian::integrate`] by [`Rule::RadialPanels`]: a Gauss–Hermite rule across the radius through the centre
    /// `[cx, cy]`, and panels of `rule` along it. The rule is in the angle ψ with `ρ = sin ψ`, in which the pole
    /// `1/cosθo` cancels. The Gaussian counts as the product of one along the radius and one across it.
    fn integrate_radially<const PAIRS: usize>(
        &self,
        incidence: &Incidence,
        [cx, cy]: [f64; 2],
        [sigma_x, sigma_y]: [f64; 2],
        rule: &'static SymmetricRule<PAIRS>,
        mut visit: impl FnMut(Vec3, f64, f64),
    ) {
        let rho = length([cx, cy]);
        // Unit vector along the radius; any unit vector for a centre at the normal.
        let (ex, ey) = if rho > 1e-9 { (cx / rho, cy / rho) } else { (1.0, 0.0) };
        let sigma_along = length([ex * sigma_x, ey * sigma_y]);
        let sigma_across = length([ey * sigma_x, ex * sigma_y]);
        let is_sharp = self.merged || sigma_across < SHARP_SIGMA.min(SHARP_OF_COSINE * incidence.wi[2]);
        // Abscissae across the radius in standard deviations, and their weights.
        let across: &[(f64, f64)] = if is_sharp {
            &[(0.0, 1.0)]
        } else if sigma_across < WIDE_SIGMA {
            &HERMITE_3
        } else {
            &HERMITE_5
        };
        for &(t, fraction) in across {
            // A line at this distance from the radius meets the horizon at ±reach.
            let offset = t * sigma_across;
            let reach_squared = 1.0 - offset * offset;
            if reach_squared <= 0.0 {
                continue;
            }
            let reach = reach_squared.sqrt();
            // A position `along` the line is reach·sin ψ. There cosθo = reach·cos ψ, and d(along) = cosθo dψ.
            let psi_at = |along: f64| (along / reach).clamp(-1.0, 1.0).asin();
            let range = [psi_at(rho - GAUSSIAN_REACH * sigma_along), psi_at(rho + GAUSSIAN_REACH * sigma_along)];
            // PANEL_PHASE_MAX is for 16 nodes. A rule of fewer nodes gets panels that are narrower in proportion. The
            // phase changes by at most `phase` per radian of ψ.
            let widest_panel = PANEL_PHASE_MAX / incidence.phase * PAIRS as f64 / LEGENDRE_16.0.len() as f64;
            let norm = fraction / (TAU.sqrt() * sigma_along);
            for psi in in_panels(range, widest_panel, rule) {
                let (along, cos) = (reach * psi.sin, reach * psi.cos);
                let z = (along - rho) / sigma_along;
                // Rounding may put an angle beyond the horizon.
                if cos > 0.0 {
                    let wo = [along * ex - offset * ey, along * ey + offset * ex, cos];
                    visit(wo, psi.weight * norm * cos, -0.5 * z * z);
                }
            }
        }
    }
}

/// [`NodeGaussian::integrate`] by [`Rule::CutPanels`]. `limits` are those of the resolved range, in standard deviations
/// from the centre. `centre` and `sigma` are in direction cosines.
fn integrate_cut(
    incidence: &Incidence,
    centre: [f64; 2],
    sigma: [f64; 2],
    limits: [[f64; 2]; 2],
    mut visit: impl FnMut(Vec3, f64, f64),
) {
    let bounds =
        [0, 1].map(|axis| limits[axis].map(|t| centre[axis] + t.clamp(-GAUSSIAN_REACH, GAUSSIAN_REACH) * sigma[axis]));
    // Widths in radians of the angles of `hemisphere`, in which a Gaussian is no narrower than in direction cosines.
    let panels = sigma.map(|sigma| (PANEL_SIGMAS * sigma).min(PANEL_PHASE_MAX / incidence.phase));
    let norm = 1.0 / (TAU * sigma[0] * sigma[1]);
    hemisphere(bounds, panels, incidence.wi[2], |wo, area| {
        let z = [0, 1].map(|axis| (wo[axis] - centre[axis]) / sigma[axis]);
        visit(wo, area * norm, -0.5 * (z[0] * z[0] + z[1] * z[1]));
    });
}

/// `√(x² + y²)` of numbers of order one, faster than `hypot`, which guards against overflow.
fn length([x, y]: [f64; 2]) -> f64 {
    (x * x + y * y).sqrt()
}

/// Abscissae and weights for a standard normal variate between two limits: three-point Gauss–Hermite if the variate is
/// `whole`, else two nodes.
///
/// The two nodes reproduce the moments of orders 0 to 3 of the distribution between the limits, so they form its Gauss
/// rule. The weights sum to the probability between the limits. Surplus entries have the weight 0.
fn gaussian_rule([low, high]: [f64; 2], whole: bool) -> [(f64, f64); 3] {
    if whole {
        return HERMITE_3;
    }
    let (low, high) = (low.max(-GAUSSIAN_REACH), high.min(GAUSSIAN_REACH));
    let density = |t: f64| (-0.5 * t * t).exp() / TAU.sqrt();
    let cumulative = |t: f64| 0.5 * (1.0 + libm::erf(t / std::f64::consts::SQRT_2));
    let (a, b) = (density(low), density(high));
    let probability = cumulative(high) - cumulative(low);
    // The moments of a smaller probability are lost to rounding.
    if probability < 1e-6 {
        return [(0.5 * (low + high), probability.max(0.0)), (0.0, 0.0), (0.0, 0.0)];
    }
    // Moments of the truncated normal distribution.
    let mean = (a - b) / probability;
    let second = 1.0 + (low * a - high * b) / probability;
    let third = 2.0 * mean + (low * low * a - high * high * b) / probability;
    let variance = (second - mean * mean).max(0.0);
    let third_central = third - 3.0 * mean * variance - mean.powi(3);
    // One node suffices for so narrow a range; a division by its variance follows.
    if variance < 1e-9 {
        return [(mean, probability), (0.0, 0.0), (0.0, 0.0)];
    }
    // Distances of the nodes from the mean: the roots of t² − (third_central/variance)·t − variance.
    let half = 0.5 * third_central / variance;
    let root = (half * half + variance).sqrt();
    let (left, right) = (half - root, half + root);
    // Weights that make the mean of both nodes 0.
    let unit = probability / (right - left);
    [(mean + left, right * unit), (mean + right, -left * unit), (0.0, 0.0)]
}
