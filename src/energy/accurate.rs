//! Accurate quadrature of a Gaussian of the power spectrum over the hemisphere.
//!
//! A Gaussian far from the horizon takes a Gauss–Hermite rule, if the relief's phase changes by less than 1 rad over
//! its standard deviation. Otherwise panels of Gauss–Legendre rules cover its part above the horizon (`quadrature.rs`).

use super::portion::{Incidence, Portion};
use super::quadrature::hemisphere;
use crate::numeric::math::GAUSSIAN_REACH;
use crate::scattering::{Vec3, direction_above};
use crate::table::SpectralTable;

/// Abscissae and weights of the three-point Gauss–Hermite rule for a standard normal variate.
const HERMITE_3: [(f64, f64); 3] =
    [(0.0, 2.0 / 3.0), (-1.732_050_807_568_877_2, 1.0 / 6.0), (1.732_050_807_568_877_2, 1.0 / 6.0)];
/// Standard deviation in direction cosines below which one quadrature node may stand for a Gaussian
/// ([`FAR_FOR_ONE_NODE`]). Chosen for the error of 0.2 % that the tests of the accurate integral allow.
const SHARP_SIGMA: f64 = 0.01;
/// Smallest ratio of the centre's cos²θo to σ at which one quadrature node stands for a sharp Gaussian. The mean of
/// `1/cosθo` then has an error of 0.1 %.
const FAR_FOR_ONE_NODE: f64 = 40.0;
/// Smallest ratio of the centre's cos²θo to σ at which three quadrature nodes per axis stand for a Gaussian. They give
/// the mean of `1/cosθo` to 1e-5.
const FAR_FOR_THREE_NODES: f64 = 16.0;
/// Largest change of the relief's phase over a panel of the Gauss–Legendre rule, in radians: about five periods for 16
/// quadrature nodes. Chosen: wider panels sample fringes too coarsely; narrower ones take longer.
const PANEL_PHASE_MAX: f64 = 30.0;
/// Largest width of a panel of the Gauss–Legendre rule, in standard deviations. A Gaussian is at most
/// 2·[`GAUSSIAN_REACH`] wide, so this only limits a Gaussian next to the horizon, whose angles are wider than its
/// direction cosines.
const PANEL_SIGMAS: f64 = 18.0;

/// Calls `visit` with the direction of each quadrature node and its fraction of the Gaussian. Nodes lie above the
/// horizon, and at frequencies that the pixels resolve. The portion must not be a square.
pub(super) fn integrate(
    table: &SpectralTable,
    gaussian: &Portion,
    &Incidence { wi, wavelength_um, phase_per_cosine }: &Incidence,
    mut visit: impl FnMut(Vec3, f64),
) {
    let axes = [&table.lattice().x, &table.lattice().y];
    // Interval of the outgoing direction cosines along each axis at which |wi + wo|/λ ≤ cutoff/period.
    let resolved = [0, 1].map(|c| {
        let reach = wavelength_um * axes[c].cutoff / axes[c].period_um;
        [-reach - wi[c], reach - wi[c]]
    });
    let sigma = gaussian.sigma_f.map(|sigma| wavelength_um * sigma);
    let widest = sigma[0].max(sigma[1]);
    let centre = [0, 1].map(|axis| wavelength_um * gaussian.f[axis] - wi[axis]);
    let rho_squared = centre[0] * centre[0] + centre[1] * centre[1];
    if rho_squared >= (1.0 + GAUSSIAN_REACH * widest).powi(2) {
        return;
    }
    let rho = rho_squared.sqrt();
    let ends = [0, 1].map(|axis| [-GAUSSIAN_REACH, GAUSSIAN_REACH].map(|t| centre[axis] + t * sigma[axis]));
    // Whether the pixels resolve all of the Gaussian.
    let is_whole = [0, 1].iter().all(|&axis| resolved[axis][0] <= ends[axis][0] && ends[axis][1] <= resolved[axis][1]);
    // Whether Gauss–Hermite rules are accurate for `1/cosθo` and the relief's phase. The pole of the former then lies
    // at least 1 σ beyond the Gaussian's ends, and the phase changes by phase_per_cosine·σ·ρ/cosθo < 1 rad over σ. Both
    // bounds are chosen.
    let is_clear = 1.0 - rho > (GAUSSIAN_REACH + 1.0) * widest
        && phase_per_cosine * widest * rho < (1.0 - rho_squared).max(0.0).sqrt();
    // Whether cos²θo/σ exceeds a ratio; cos²θo = 1 − ρ².
    let is_far = |ratio: f64| 1.0 - rho_squared > ratio * widest;
    if is_whole && is_clear && is_far(FAR_FOR_THREE_NODES) {
        let is_sharp = widest < SHARP_SIGMA && is_far(FAR_FOR_ONE_NODE);
        let rule: &[(f64, f64)] = if is_sharp { &[(0.0, 1.0)] } else { &HERMITE_3 };
        for (tx, weight_x) in rule {
            for (ty, weight_y) in rule {
                if let Some(wo) = direction_above(centre[0] + tx * sigma[0], centre[1] + ty * sigma[1]) {
                    visit(wo, weight_x * weight_y);
                }
            }
        }
        return;
    }
    let bounds = [0, 1].map(|axis| [ends[axis][0].max(resolved[axis][0]), ends[axis][1].min(resolved[axis][1])]);
    // Largest widths of panels in radians. A direction cosine changes by at most the angle, so a Gaussian is no
    // narrower in angles.
    let panels = sigma.map(|sigma| (PANEL_SIGMAS * sigma).min(PANEL_PHASE_MAX / phase_per_cosine));
    // Density of the kernel at its centre, per area of direction cosines. The kernel is a Gaussian or resembles one.
    let norm = table.norm() / (wavelength_um * wavelength_um);
    hemisphere(bounds, panels, wi[2], |wo, area| {
        let [x, y] = [0, 1].map(|c| axes[c].kernel.weight((wo[c] - centre[c]) / wavelength_um * axes[c].period_um));
        visit(wo, area * norm * x * y);
    });
}
