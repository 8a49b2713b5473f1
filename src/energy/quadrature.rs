//! Quadrature of one portion of the power over the hemisphere of outgoing directions.
//!
//! A portion lies around the outgoing direction cosines `λf − wi`, at the distance ρ from the normal. Direction cosines
//! are u along the radius from the normal to this centre, and v across:
//!
//! ```text
//! v = sin α      u = cos α sin ψ      cosθo = cos α cos ψ      (α and ψ from −π/2 to π/2; the horizon has |ψ| = π/2)
//! ```
//!
//! The portion is divided into rows of equal width in v, and each row into steps of equal width in ψ. A step has one
//! quadrature node, at its middle, with the portion's probability in the step. Along a row `du = cosθo dψ`. So equal
//! steps of ψ integrate the factor `1/cosθo` of the reflectance without its pole at the horizon.

use super::portion::{Incidence, Portion, REACH};
use crate::scattering::{Vec3, direction_above};
use std::f64::consts::TAU;

/// Rows per unit of v. Chosen: more take longer.
const ROWS_PER_COSINE: f64 = 8.0;
/// Smallest number of rows of a portion that has several. For a Gaussian, the sum over rows of equal width then errs by
/// less than 3e-4, the power beyond [`REACH`].
const ROWS_MIN: f64 = 5.0;
/// Steps per radian of ψ where `w = cosθi + cosθo` is 1. Elsewhere they are in inverse proportion to w, since the
/// reflectance varies with the relative change of w. With 12, the error on gratings falls to a third, and a build takes
/// half as long again.
const STEPS_PER_RADIAN: f64 = 8.0;
/// Steps per radian of the relief's phase. A radian of ψ changes cosθo by at most 1, so the phase by at most
/// `phase_per_cosine`. Chosen: more take longer.
const STEPS_PER_PHASE: f64 = 0.125;
/// Smallest number of steps of a row that has several. Two would have three times the variance of a Gaussian.
const STEPS_MIN: f64 = 3.0;
/// Largest number of rows, and of steps in a row. Chosen: more take longer.
const COUNT_MAX: f64 = 256.0;

/// Distribution of a portion's power along one axis, as a variate of mean 0 and standard deviation 1. Lengths are in
/// standard deviations.
#[derive(Clone, Copy)]
enum Variate {
    /// Normal variate, cut off at [`REACH`].
    Normal,
    /// Uniform variate, that of a square.
    Uniform,
}

impl Variate {
    /// Largest distance from the centre.
    fn reach(self) -> f64 {
        match self {
            Self::Normal => REACH,
            // √3.
            Self::Uniform => 1.732_050_807_568_877_2,
        }
    }

    /// Probability of a row of the given middle and width. A single row, of the width `2·reach`, has all.
    fn in_row(self, middle: f64, width: f64) -> f64 {
        match self {
            Self::Normal if width < 2.0 * self.reach() => width * (-0.5 * middle * middle).exp() / TAU.sqrt(),
            _ => 0.5 * width / self.reach(),
        }
    }

    /// Probability below `x`. The normal distribution is approximated to 1.4e-4 (E. Page 1977). The steps of a row have
    /// the sum 1, unless the horizon cuts it.
    fn below(self, x: f64) -> f64 {
        // The ends of a row have exactly 0 and 1, in spite of rounding.
        if x.abs() > self.reach() - 1e-9 {
            return f64::from(x > 0.0);
        }
        match self {
            Self::Normal => 1.0 / (1.0 + (-x * (1.5976 + 0.070_566 * x * x)).exp()),
            Self::Uniform => 0.5 + 0.5 * x / self.reach(),
        }
    }
}

/// Calls `visit` with the directions of a portion's quadrature nodes above the horizon, and their fractions of the
/// portion's power. `refinement` multiplies the numbers of rows and steps.
pub(super) fn integrate(
    portion: &Portion,
    &Incidence { wi, wavelength_um, phase_per_cosine, limits }: &Incidence,
    refinement: f64,
    mut visit: impl FnMut(Vec3, f64),
) {
    let variate = if portion.is_square { Variate::Uniform } else { Variate::Normal };
    let reach = variate.reach();
    let sigma = portion.sigma_f.map(|sigma| wavelength_um * sigma);
    let widest = reach * sigma[0].max(sigma[1]);
    let centre = [0, 1].map(|axis| wavelength_um * portion.f[axis] - wi[axis]);
    let rho_squared = centre[0] * centre[0] + centre[1] * centre[1];
    // Most portions of a natural relief lie beyond the horizon. They are rejected before a root is taken.
    if rho_squared >= (1.0 + widest).powi(2) {
        return;
    }
    let rho = rho_squared.sqrt();
    // Number of equal parts of an interval.
    let count = |width: f64, per_unit: f64| (refinement * width * per_unit).round().clamp(1.0, COUNT_MAX);
    let steps_per_radian = |cos_o: f64| STEPS_PER_RADIAN / (wi[2] + cos_o) + STEPS_PER_PHASE * phase_per_cosine;
    // Fraction that the pixels resolve of a rectangle around wo with the given half-sides.
    let resolved = |wo: Vec3, half: [f64; 2]| {
        let along = |c: usize| (0.5 + 0.5 * (limits[c] - (wi[c] + wo[c]).abs()) / half[c]).clamp(0.0, 1.0);
        along(0) * along(1)
    };
    // A narrow portion far from the horizon, which the pixels resolve, has one node, at its centre. `cos_outer` is
    // about the smallest cosθo; 0 gives the largest count. Since `du = cosθo dψ`, steps per unit of u are those per
    // radian of ψ over cosθo.
    let cos_outer = (1.0 - (rho + widest).powi(2)).max(0.0).sqrt();
    let is_narrow = count(2.0 * widest, ROWS_PER_COSINE.max(steps_per_radian(cos_outer) / cos_outer)) == 1.0;
    if let Some(wo) = direction_above(centre[0], centre[1]).filter(|&wo| is_narrow && resolved(wo, [widest; 2]) == 1.0)
    {
        visit(wo, 1.0);
        return;
    }
    let radial = if rho > 0.0 { centre.map(|c| c / rho) } else { [1.0, 0.0] };
    // Standard deviation of v, that of u in a row, and the change of u's mean with v. A square whose sides are oblique
    // to the radius is replaced by a parallelogram with its covariance.
    let sigma_v = (radial[0] * sigma[1]).hypot(radial[1] * sigma[0]);
    let sigma_u = sigma[0] * sigma[1] / sigma_v;
    let slope = radial[0] * radial[1] * (sigma[1] * sigma[1] - sigma[0] * sigma[0]) / (sigma_v * sigma_v);
    let rows = match count(2.0 * reach * sigma_v, ROWS_PER_COSINE) {
        1.0 => 1.0,
        rows => rows.max(ROWS_MIN),
    };
    let row_width = 2.0 * reach / rows;
    for row in 0..rows as usize {
        let middle = (row as f64 + 0.5) * row_width - reach;
        let v = middle * sigma_v;
        let u_mean = rho + slope * v;
        if v.abs() >= 1.0 {
            continue;
        }
        // cos α, the value of u at which the row meets the horizon.
        let u_horizon = (1.0 - v * v).sqrt();
        let [first, last] = [-reach, reach].map(|x| ((u_mean + x * sigma_u) / u_horizon).clamp(-1.0, 1.0).asin());
        // Both ends of a row beyond the horizon are clamped to it.
        if first == last {
            continue;
        }
        let steps = match count(last - first, steps_per_radian(u_horizon * (0.5 * (first + last)).cos())) {
            1.0 => 1.0,
            steps => steps.max(STEPS_MIN),
        };
        let half_step = 0.5 * (last - first) / steps;
        // Sine and cosine of ψ after each half step, by the addition theorems.
        let (half_sin, half_cos) = half_step.sin_cos();
        let half_step_on = |(sin, cos)| (sin * half_cos + cos * half_sin, cos * half_cos - sin * half_sin);
        let below = |sin: f64| variate.below((u_horizon * sin - u_mean) / sigma_u);
        let mut end = first.sin_cos();
        let mut below_start = below(end.0);
        for _ in 0..steps as usize {
            let (sin, cos) = half_step_on(end);
            end = half_step_on((sin, cos));
            let below_end = below(end.0);
            let (u, cos_o) = (u_horizon * sin, u_horizon * cos);
            let wo = [radial[0] * u - radial[1] * v, radial[1] * u + radial[0] * v, cos_o];
            // Half-sides of the step along u and v, and of the rectangle around it.
            let [half_u, half_v] = [half_step * cos_o, 0.5 * row_width * sigma_v];
            let half = [0, 1].map(|c: usize| (radial[c] * half_u).abs() + (radial[1 - c] * half_v).abs());
            visit(wo, variate.in_row(middle, row_width) * (below_end - below_start) * resolved(wo, half));
            below_start = below_end;
        }
    }
}
