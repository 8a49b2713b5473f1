//! Quadrature of one node of an ensemble table over the hemisphere.
//!
//! A node carries the power `P(κ)` about its frequency f, spread as a Gaussian of standard deviation `σ_f`. Seen from
//! wi it lies at `q = λf − wi` in the plane of outgoing direction cosines, `ρ = |q|` from the normal, with standard
//! deviation `σ = λσ_f`. The horizon is the circle ρ = 1. Where a node lies near it the obliquity factor makes a pole
//! of `1/cosθo`, which the radial rule integrates.

use super::quadrature::{HERMITE_3, HERMITE_5, LEGENDRE_6, LEGENDRE_16, SymmetricRule, hemisphere, in_panels};
use crate::scattering::{Vec3, direction_above};
use std::borrow::Cow;
use std::f64::consts::TAU;

/// σ in direction cosines below which one node across the radius stands for a Gaussian's width. Chosen; the tests of
/// the accurate integral hold it to 0.2 %.
const SHARP: f64 = 0.01;
/// σ in direction cosines from which five nodes across the radius are taken near the horizon instead of three. Chosen,
/// as SHARP.
const WIDE: f64 = 0.04;
/// Standard deviations at which a Gaussian is cut; 6e-7 of it lies beyond.
const CUT: f64 = 5.0;
/// Standard deviations from the horizon beyond which Gauss–Hermite rules follow `1/cosθo`.
const CLEAR: f64 = 6.0;
/// Standard deviations from the horizon, in cos²θo, from which one node stands for a Gaussian: the mean of `1/cosθo` is
/// then off by a thousandth.
const ONE_NODE: f64 = 40.0;
/// Standard deviations from the horizon, in cos²θo, from which three nodes an axis stand for a Gaussian, or one for a
/// merged Gaussian. For three the mean of `1/cos³θo` is off by 1e-4, for one that of `1/cosθo` by 0.6 %.
const THREE_NODES: f64 = 16.0;
/// Largest change of the relief's phase, in radians, within σ of a Gauss–Hermite rule.
const PHASE_SIGMA: f64 = 1.0;
/// Largest change of the relief's phase, in radians, within a panel of 16 quadrature nodes: about five periods.
pub(super) const PHASE_PANEL: f64 = 30.0;
/// Fraction of cosθi below which σ counts as sharp: the obliquity factor changes with the distance from the mirror
/// direction over cosθi.
const SHARP_OF_COSINE: f64 = 0.3;
/// Standard deviations inside the horizon at which the mean of `(1 − ρ)^(−½)` over a Gaussian is largest.
const PEAK_SIGMAS: f64 = 0.77;

/// Power `P(κ)` about a frequency, with a Gaussian spread.
#[derive(Clone)]
pub(super) struct NodeGaussian<'a> {
    /// Frequency along x and y in cycles/µm.
    pub f: [f64; 2],
    /// Standard deviation along x and y in cycles/µm.
    pub sigma_f: [f64; 2],
    /// Record of the table that gives `P(κ)`, or a sum of several.
    pub record: Cow<'a, [f32]>,
    /// Whether it stands for several nodes, and coarser rules serve.
    pub merged: bool,
}

/// Incident light, and everything else that is common to all nodes of an integral.
pub(super) struct Incidence {
    pub wi: Vec3,
    pub wavelength_um: f64,
    /// Outgoing direction cosines along x and y between which the pixels resolve the relief.
    pub resolved: [[f64; 2]; 2],
    /// Change of the relief's phase, in radians from its lowest point to its highest, per unit of cosθo.
    pub phase: f64,
    /// Whether Gaussians that `resolved` cuts are integrated up to the cut.
    pub exact_cut: bool,
    pub ridge: Option<Ridge>,
}

/// A box of incident directions and wavelengths in which narrow orders may leave along the surface. An order whose
/// ridge crosses the box is counted where it adds most.
#[derive(Clone, Copy)]
pub(crate) struct Ridge {
    /// cosθo at which such an order is counted.
    pub cosine: f64,
    /// Half of the box's sides along the grid's x and y, in direction cosines of wi.
    pub half_sides: [[f64; 2]; 2],
    /// Half of the box's range of wavelengths in µm.
    pub half_range_um: f64,
}

/// cosθo at which the mean of `1/cosθo` over a Gaussian of width σ is largest.
pub(super) fn peak_cosine(sigma: f64) -> f64 {
    (1.0 - (1.0 - PEAK_SIGMAS * sigma).powi(2)).max(0.0).sqrt()
}

impl Ridge {
    /// `q`, moved along the radius onto the ridge if that crosses the box. The mirrored order, at f = 0, never passes
    /// the horizon and stays.
    fn moved(&self, q: [f64; 2], f: [f64; 2], sigma: f64) -> [f64; 2] {
        if f == [0.0; 2] {
            return q;
        }
        let rho = length(q);
        let ridge = (1.0 - self.cosine.max(peak_cosine(sigma)).powi(2)).sqrt();
        // Change of ρ from the middle of the box to its side: the component along q. A Gaussian itself bridges σ.
        let along = |[x, y]: [f64; 2]| (q[0] * x + q[1] * y) / rho;
        let [x, y] = self.half_sides.map(along);
        let reach = length([length([x, y]), self.half_range_um * along(f)]) - sigma;
        if (rho - ridge).abs() < reach { q.map(|c| c * ridge / rho) } else { q }
    }
}

impl NodeGaussian<'_> {
    /// Calls `visit` with directions above the horizon, each with a factor and an exponent: `factor·exp(exponent)` is
    /// its fraction of the Gaussian in the plane of direction cosines.
    pub(super) fn integrate(&self, incidence: &Incidence, mut visit: impl FnMut(Vec3, f64, f64)) {
        let Incidence { wi, wavelength_um, resolved, phase, exact_cut, ridge } = *incidence;
        let sigma = self.sigma_f.map(|sigma| wavelength_um * sigma);
        let widest = sigma[0].max(sigma[1]);
        let mut q = [0, 1].map(|c| wavelength_um * self.f[c] - wi[c]);
        if let Some(ridge) = ridge {
            q = ridge.moved(q, self.f, widest);
        }
        // Most of a skin's nodes lie beyond the horizon and need no root.
        let rho_squared = q[0] * q[0] + q[1] * q[1];
        if rho_squared >= (1.0 + CUT * widest).powi(2) {
            return;
        }
        let rho = rho_squared.sqrt();
        let limits = [0, 1].map(|c| resolved[c].map(|limit| (limit - q[c]) / sigma[c]));
        if limits.iter().any(|[low, high]| *low >= CUT || *high <= -CUT) {
            return;
        }
        let whole = limits.map(|[low, high]| low <= -CUT && high >= CUT);
        let clear =
            1.0 - rho > CLEAR * widest && phase * widest * rho < PHASE_SIGMA * (1.0 - rho_squared).max(0.0).sqrt();
        let far = |sigmas: f64| 1.0 - rho_squared > sigmas * widest;
        let sharp = if self.merged { far(THREE_NODES) } else { widest < SHARP && far(ONE_NODE) };
        if clear && sharp && whole == [true; 2] {
            if let Some(wo) = direction_above(q[0], q[1]) {
                visit(wo, 1.0, 0.0);
            }
        } else if clear && (far(THREE_NODES) || exact_cut) {
            let [x, y] = [0, 1].map(|c| gaussian_rule(limits[c], whole[c]));
            for (tx, px) in x {
                for (ty, py) in y {
                    if let Some(wo) = direction_above(q[0] + tx * sigma[0], q[1] + ty * sigma[1]) {
                        visit(wo, px * py, 0.0);
                    }
                }
            }
        } else if exact_cut {
            let bounds = [0, 1].map(|c| limits[c].map(|t| q[c] + t.clamp(-CUT, CUT) * sigma[c]));
            let widths = sigma.map(|sigma| (2.5 * CUT * sigma).min(PHASE_PANEL / phase));
            let norm = 1.0 / (TAU * sigma[0] * sigma[1]);
            hemisphere(bounds, widths, wi[2], |wo, area| {
                let z = [0, 1].map(|c| (wo[c] - q[c]) / sigma[c]);
                visit(wo, area * norm, -0.5 * (z[0] * z[0] + z[1] * z[1]));
            });
        } else {
            let visit_resolved = |wo: Vec3, factor: f64, exponent: f64| {
                if [0, 1].iter().all(|&c| resolved[c][0] <= wo[c] && wo[c] <= resolved[c][1]) {
                    visit(wo, factor, exponent);
                }
            };
            match self.merged {
                true => self.integrate_radially(incidence, q, sigma, &LEGENDRE_6, visit_resolved),
                false => self.integrate_radially(incidence, q, sigma, &LEGENDRE_16, visit_resolved),
            }
        }
    }

    /// Near the horizon: Gauss–Hermite across the radius, Gauss–Legendre along it in the angle ψ with `ρ = sin ψ`, in
    /// which `1/cosθo` is no pole.
    fn integrate_radially<const PAIRS: usize>(
        &self,
        incidence: &Incidence,
        [qx, qy]: [f64; 2],
        [sx, sy]: [f64; 2],
        rule: &'static SymmetricRule<PAIRS>,
        mut visit: impl FnMut(Vec3, f64, f64),
    ) {
        let rho = length([qx, qy]);
        let (ex, ey) = if rho > 1e-9 { (qx / rho, qy / rho) } else { (1.0, 0.0) };
        let (sigma_along, sigma_across) = (length([ex * sx, ey * sy]), length([ey * sx, ex * sy]));
        let sharp = self.merged || sigma_across < SHARP.min(SHARP_OF_COSINE * incidence.wi[2]);
        let across: &[(f64, f64)] = match () {
            _ if sharp => &[(0.0, 1.0)],
            _ if sigma_across < WIDE => &HERMITE_3,
            _ => &HERMITE_5,
        };
        for &(t, fraction) in across {
            let offset = t * sigma_across;
            let reach_squared = 1.0 - offset * offset;
            if reach_squared <= 0.0 {
                continue;
            }
            // The horizon on this line: cos²θo = reach² − ρ², and dρ = cosθo dψ.
            let reach = reach_squared.sqrt();
            let psi = |rho: f64| (rho / reach).clamp(-1.0, 1.0).asin();
            let range = [psi(rho - CUT * sigma_along), psi(rho + CUT * sigma_along)];
            let widest = PHASE_PANEL / incidence.phase * PAIRS as f64 / LEGENDRE_16.0.len() as f64;
            let norm = fraction / (TAU.sqrt() * sigma_along);
            for psi in in_panels(range, widest, rule) {
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

/// `√(x² + y²)` of numbers of order one, where `hypot` would guard against overflow.
fn length([x, y]: [f64; 2]) -> f64 {
    (x * x + y * y).sqrt()
}

/// Abscissae and weights for a standard normal variate between two limits: Gauss–Hermite if it is `whole`, else the two
/// nodes that have the first four moments of the part between the limits.
fn gaussian_rule([low, high]: [f64; 2], whole: bool) -> [(f64, f64); 3] {
    if whole {
        return HERMITE_3;
    }
    let (low, high) = (low.max(-CUT), high.min(CUT));
    let density = |t: f64| (-0.5 * t * t).exp() / TAU.sqrt();
    let below = |t: f64| 0.5 * (1.0 + libm::erf(t / std::f64::consts::SQRT_2));
    let (a, b) = (density(low), density(high));
    let mass = below(high) - below(low);
    // Moments of less than this are lost to rounding.
    if mass < 1e-6 {
        return [(0.5 * (low + high), mass.max(0.0)), (0.0, 0.0), (0.0, 0.0)];
    }
    let mean = (a - b) / mass;
    let second = 1.0 + (low * a - high * b) / mass;
    let third = 2.0 * mean + (low * low * a - high * high * b) / mass;
    let variance = (second - mean * mean).max(0.0);
    let skew = third - 3.0 * mean * variance - mean.powi(3);
    if variance < 1e-9 {
        return [(mean, mass), (0.0, 0.0), (0.0, 0.0)];
    }
    // Distances from the mean: the roots of t² − (skew/variance)·t − variance.
    let half = 0.5 * skew / variance;
    let root = (half * half + variance).sqrt();
    let (left, right) = (half - root, half + root);
    let unit = mass / (right - left);
    [(mean + left, right * unit), (mean + right, -left * unit), (0.0, 0.0)]
}
