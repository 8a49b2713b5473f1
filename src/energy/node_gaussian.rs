//! One lobe of an ensemble table, integrated over the hemisphere.

use super::quadrature::{HERMITE_3, HERMITE_5, LEGENDRE_6, LEGENDRE_16, hemisphere, in_panels};
use crate::scattering::{Vec3, direction_above};
use std::borrow::Cow;
use std::f64::consts::TAU;

/// Standard deviation in direction cosines below which a lobe is not integrated across.
const SHARP: f64 = 0.01;
/// Standard deviation beyond which three places across do not do near the horizon.
const WIDE: f64 = 0.04;
/// Standard deviations beyond which nothing of a lobe counts.
const CUT: f64 = 5.0;
/// Standard deviations from the horizon at which a three-point rule follows 1/cosθo.
const CLEAR: f64 = 6.0;
/// Standard deviations inside the horizon, in cos²θo, from which on one place along an axis does, or three do. By one, the mean of 1/cosθo over
/// the Gaussian is off by a thousandth; by three, that of 1/cos³θo, which a grazing incidence makes of it, by a tenth of that. Merged lobes
/// take one place where others take three, and 1/cosθo is off by 0.6 % where they begin to.
const ONE_PLACE: f64 = 40.0;
const THREE_PLACES: f64 = 16.0;
/// Phase in radians between the relief's highest and lowest point that may pass within a standard deviation of a
/// three-point rule, and within a panel of 16 places.
const PHASE_SIGMA: f64 = 1.0;
pub(super) const PHASE_PANEL: f64 = 30.0;
/// Share of cosθi that a lobe may be wide and not be integrated across: the obliquity factor grows as the distance from
/// the mirror direction over that cosine.
const ACROSS_OF_COSINE: f64 = 0.3;

/// Power `P(κ)` about the frequency `f` with a Gaussian spread.
#[derive(Clone)]
pub(super) struct Lobe<'a> {
    pub f: [f64; 2],
    pub sigma_f: [f64; 2],
    /// A record of the table, or a sum of such.
    pub record: Cow<'a, [f32]>,
}

/// What an integral over lobes depends on besides them.
pub(super) struct Setting {
    pub wi: Vec3,
    pub wavelength_um: f64,
    /// Direction cosines along x and y between which the table knows anything.
    pub known: [[f64; 2]; 2],
    /// Phase in radians from the relief's lowest point to its highest that one cosθo more makes.
    pub phase: f64,
    /// Whether lobes may be oblong, and what is known ends within some of them, also near the horizon.
    pub cut: bool,
}

impl Lobe<'_> {
    /// Visits directions with their shares of the lobe's Gaussian in the plane of direction cosines, of which nothing
    /// lies beyond the horizon or where the table knows nothing. A share is a factor times the exponential of what follows it.
    pub fn integrate(&self, setting: &Setting, fine: bool, mut visit: impl FnMut(Vec3, f64, f64)) {
        let Setting { wi, wavelength_um, known, phase, cut } = *setting;
        let q = [0, 1].map(|c| wavelength_um * self.f[c] - wi[c]);
        let sigma = self.sigma_f.map(|sigma| wavelength_um * sigma);
        let widest = sigma[0].max(sigma[1]);
        // The root is late, because most of a skin's lobes are beyond the horizon.
        let rho_squared = q[0] * q[0] + q[1] * q[1];
        if rho_squared >= (1.0 + CUT * widest).powi(2) {
            return;
        }
        let rho = rho_squared.sqrt();
        let reach = [0, 1].map(|c| known[c].map(|limit| (limit - q[c]) / sigma[c]));
        if reach.iter().any(|[low, high]| *low >= CUT || *high <= -CUT) {
            return;
        }
        let whole = reach.map(|[low, high]| low <= -CUT && high >= CUT);
        let clear =
            1.0 - rho > CLEAR * widest && phase * widest * rho < PHASE_SIGMA * (1.0 - rho_squared).max(0.0).sqrt();
        let far = |sigmas: f64| 1.0 - rho_squared > sigmas * widest;
        let sharp = if fine { widest < SHARP && far(ONE_PLACE) } else { far(THREE_PLACES) };
        if clear && sharp && whole == [true; 2] {
            if let Some(wo) = direction_above(q[0], q[1]) {
                visit(wo, 1.0, 0.0);
            }
        } else if clear && (far(THREE_PLACES) || cut) {
            let [x, y] = [0, 1].map(|c| gaussian_rule(reach[c], whole[c]));
            for (tx, px) in x {
                for (ty, py) in y {
                    if let Some(wo) = direction_above(q[0] + tx * sigma[0], q[1] + ty * sigma[1]) {
                        visit(wo, px * py, 0.0);
                    }
                }
            }
        } else if cut {
            let within = [0, 1].map(|c| reach[c].map(|t| q[c] + t.clamp(-CUT, CUT) * sigma[c]));
            let widths = sigma.map(|sigma| (2.5 * CUT * sigma).min(PHASE_PANEL / phase));
            let norm = 1.0 / (TAU * sigma[0] * sigma[1]);
            hemisphere(within, widths, wi[2], |wo, area| {
                let z = [0, 1].map(|c| (wo[c] - q[c]) / sigma[c]);
                visit(wo, area * norm, -0.5 * (z[0] * z[0] + z[1] * z[1]));
            });
        } else {
            self.integrate_radially(setting, q, sigma, fine, |wo, factor, exponent| {
                if [0, 1].iter().all(|&c| known[c][0] <= wo[c] && wo[c] <= known[c][1]) {
                    visit(wo, factor, exponent);
                }
            });
        }
    }

    /// Near the horizon, along the radius in cosθo, which the obliquity factor divides by, so that the integrand stays
    /// smooth.
    fn integrate_radially(
        &self,
        setting: &Setting,
        [qx, qy]: [f64; 2],
        [sx, sy]: [f64; 2],
        fine: bool,
        mut visit: impl FnMut(Vec3, f64, f64),
    ) {
        let rho = length([qx, qy]);
        let (ex, ey) = if rho > 1e-9 { (qx / rho, qy / rho) } else { (1.0, 0.0) };
        // Lobes gathered from an oblong tile are oblong.
        let (sigma, across) = (length([ex * sx, ey * sy]), length([ey * sx, ex * sy]));
        let sharp = !fine || across < SHARP.min(ACROSS_OF_COSINE * setting.wi[2]);
        let across_rule: &[(f64, f64)] = match () {
            _ if sharp => &[(0.0, 1.0)],
            _ if across < WIDE => &HERMITE_3,
            _ => &HERMITE_5,
        };
        for &(t, p) in across_rule {
            // cosθo along the radius at this offset across: cos² = reach² − ρ².
            let offset = t * across;
            let reach_squared = 1.0 - offset * offset;
            if reach_squared <= 0.0 {
                continue;
            }
            // ρ = reach·sin ψ makes dρ = cosθo dψ.
            let reach = reach_squared.sqrt();
            let psi = |r: f64| (r / reach).clamp(-1.0, 1.0).asin();
            let between = [psi(rho - CUT * sigma), psi(rho + CUT * sigma)];
            let rule: &[(f64, f64)] = if fine { &LEGENDRE_16 } else { &LEGENDRE_6 };
            let widest = PHASE_PANEL / setting.phase * rule.len() as f64 / LEGENDRE_16.len() as f64;
            let norm = p / (TAU.sqrt() * sigma);
            in_panels(between, widest, rule).for_each(|((sin, cos), weight)| {
                let (r, cos) = (reach * sin, reach * cos);
                let z = (r - rho) / sigma;
                // An angle beyond the horizon by rounding.
                if cos > 0.0 {
                    visit([r * ex - offset * ey, r * ey + offset * ex, cos], weight * norm * cos, -0.5 * z * z);
                }
            });
        }
    }
}

/// Of numbers of order one, so that squares do for what `hypot` takes a call.
fn length([x, y]: [f64; 2]) -> f64 {
    (x * x + y * y).sqrt()
}

/// Abscissae and weights for the part of a standard normal variate between two limits: three if that is `whole`, else the
/// two that have its first four moments.
fn gaussian_rule([low, high]: [f64; 2], whole: bool) -> [(f64, f64); 3] {
    if whole {
        return HERMITE_3;
    }
    let (low, high) = (low.max(-CUT), high.min(CUT));
    let density = |t: f64| (-0.5 * t * t).exp() / TAU.sqrt();
    let below = |t: f64| 0.5 * (1.0 + libm::erf(t / std::f64::consts::SQRT_2));
    let (a, b) = (density(low), density(high));
    let mass = below(high) - below(low);
    // So little is left that rounding would place it.
    if mass < 1e-6 {
        return [(0.5 * (low + high), mass.max(0.0)), (0.0, 0.0), (0.0, 0.0)];
    }
    let mean = (a - b) / mass;
    let second = 1.0 + (low * a - high * b) / mass;
    let third = 2.0 * mean + (low * low * a - high * high * b) / mass;
    // About the mean.
    let variance = (second - mean * mean).max(0.0);
    let skew = third - 3.0 * mean * variance - mean.powi(3);
    if variance < 1e-9 {
        return [(mean, mass), (0.0, 0.0), (0.0, 0.0)];
    }
    // The roots of t² − (skew/variance)·t − variance.
    let half = 0.5 * skew / variance;
    let root = (half * half + variance).sqrt();
    let (left, right) = (half - root, half + root);
    let share = mass / (right - left);
    [(mean + left, right * share), (mean + right, -left * share), (0.0, 0.0)]
}
