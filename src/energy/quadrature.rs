//! Product of Gauss–Legendre rules over the hemisphere of outgoing directions.
//!
//! A direction `(x, y, cosθo)` has two angles from −π/2 to π/2: α from the xz plane, and ψ around the y axis from the
//! normal.
//!
//! - `x = cos α sin ψ`, `y = sin α`, `cosθo = cos α cos ψ`
//! - `cosθo dω = dx dy = cos²α cos ψ dα dψ = cos α · cosθo dα dψ`
//!
//! Stam's obliquity factor is `O = (1 + wi·wo)²/(cosθi cosθo (cosθi + cosθo)²)`. The factor cosθo of the area
//! `cosθo dω` cancels the pole `1/cosθo` of O, so the integrand is smooth at the horizon. Uniform steps of the angles
//! are short steps of x and y there. At grazing incidence `1/(cosθi + cosθo)²` changes rapidly near the horizon, which
//! then gets panels of its own.

use crate::scattering::Vec3;
use std::f64::consts::FRAC_PI_2;

/// Width of the horizon's panels in ψ: a multiple of cosθi, in radians. At their inner edge cosθo is about 8 cosθi for
/// α = 0, so `1/(cosθi + cosθo)²` is 1/81 of its value at the horizon. Chosen: wider panels sample this fall more
/// coarsely; narrower ones leave more of it to the other panels.
const HORIZON_COSINES: f64 = 8.0;

/// Positive abscissae and weights of the 16-point Gauss–Legendre rule on [−1, 1]. The negative abscissae have equal
/// weights.
const LEGENDRE_16: [(f64, f64); 8] = [
    (0.095_012_509_837_637_44, 0.189_450_610_455_068_5),
    (0.281_603_550_779_258_9, 0.182_603_415_044_923_6),
    (0.458_016_777_657_227_4, 0.169_156_519_395_002_5),
    (0.617_876_244_402_643_7, 0.149_595_988_816_576_7),
    (0.755_404_408_355_003, 0.124_628_971_255_533_9),
    (0.865_631_202_387_831_7, 0.095_158_511_682_492_8),
    (0.944_575_023_073_232_6, 0.062_253_523_938_647_9),
    (0.989_400_934_991_649_9, 0.027_152_459_411_754_1),
];

/// Quadrature node on an interval of angles.
#[derive(Clone, Copy)]
struct Angle {
    sin: f64,
    cos: f64,
    /// Weight in radians. The weights of all nodes sum to the length of the interval.
    weight: f64,
}

/// Calls `visit` with each quadrature node's direction `(x, y, cosθo)` and its area `cosθo dω`, over the directions
/// with x and y within `bounds`, `[[x low, x high], [y low, y high]]`.
///
/// Panels of 16 nodes are at most `widest` radians wide, above 0: `widest[0]` in ψ, `widest[1]` in α. `cos_i` is cosθi.
pub(super) fn hemisphere(bounds: [[f64; 2]; 2], widest: [f64; 2], cos_i: f64, mut visit: impl FnMut(Vec3, f64)) {
    let [bounds_x, bounds_y] = bounds.map(|[low, high]| [low.max(-1.0), high.min(1.0)]);
    if bounds_x[0] >= bounds_x[1] || bounds_y[0] >= bounds_y[1] {
        return;
    }
    let [alpha_low, alpha_high] = bounds_y.map(f64::asin);
    // The range of ψ over α has a kink where a bound along x meets the horizon, at cos α = |x|. Panels end there.
    let mut ends = vec![alpha_low, alpha_high];
    for x in bounds_x {
        let kink = x.abs().acos();
        ends.extend([-kink, kink].into_iter().filter(|alpha| alpha_low < *alpha && *alpha < alpha_high));
    }
    ends.sort_by(f64::total_cmp);
    // |ψ| from which the horizon has panels of its own; π/2 where they would not be narrower than the others.
    let horizon = HORIZON_COSINES * cos_i;
    let edge = FRAC_PI_2 - if horizon < widest[0].min(FRAC_PI_2) { horizon } else { 0.0 };
    // Nodes in ψ at one α, and the range of ψ that they cover. Most α have the full range and share its nodes.
    let (mut psi_nodes, mut psi_range) = (Vec::new(), [f64::NAN; 2]);
    for alpha_range in ends.windows(2) {
        for alpha in in_panels([alpha_range[0], alpha_range[1]], widest[1]) {
            let range = bounds_x.map(|x| (x / alpha.cos.max(f64::MIN_POSITIVE)).clamp(-1.0, 1.0).asin());
            if range != psi_range {
                psi_range = range;
                psi_nodes.clear();
                // Panels of the horizon at the low and at the high end, and the others between them.
                let [inner_low, inner_high] = [-edge, edge].map(|psi: f64| psi.clamp(range[0], range[1]));
                let parts = [[range[0], inner_low], [inner_low, inner_high], [inner_high, range[1]]].into_iter();
                psi_nodes.extend(parts.flat_map(|part| in_panels(part, widest[0])));
            }
            for psi in &psi_nodes {
                let area = psi.weight * alpha.weight * alpha.cos * alpha.cos * psi.cos;
                visit([alpha.cos * psi.sin, alpha.sin, alpha.cos * psi.cos], area);
            }
        }
    }
}

/// Quadrature nodes between two angles in radians. [`LEGENDRE_16`] is applied in each of the fewest panels of equal
/// width that are at most `widest` radians wide. Empty if `high ≤ low`.
fn in_panels([low, high]: [f64; 2], widest: f64) -> impl Iterator<Item = Angle> {
    let range = (high - low).max(0.0);
    let panels = (range / widest).ceil() as usize;
    let half_width = 0.5 * range / panels.max(1) as f64;
    // Sine and cosine of each pair's angle from the middle of its panel, equal in all panels.
    let offsets = LEGENDRE_16.map(|(abscissa, _)| (half_width * abscissa).sin_cos());
    // The addition theorems give sine and cosine of the sum of the panel's middle and the offset.
    (0..panels).flat_map(move |panel| {
        let (sin, cos) = (low + (2 * panel + 1) as f64 * half_width).sin_cos();
        LEGENDRE_16.into_iter().zip(offsets).flat_map(move |((_, weight), (offset_sin, offset_cos))| {
            [-offset_sin, offset_sin].map(|offset_sin| Angle {
                sin: sin * offset_cos + cos * offset_sin,
                cos: cos * offset_cos - sin * offset_sin,
                weight: half_width * weight,
            })
        })
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Tolerance of the rules' own errors: chosen far below the relative error of any table.
    const RULE_ERROR: f64 = 1e-9;

    #[test]
    fn panels_integrate_a_constant_and_the_cosine() {
        const ROUNDING: f64 = 1e-13;
        for widest in [3.0, 0.7, 0.1] {
            let (mut cosine, mut length) = (0.0, 0.0);
            for angle in in_panels([-0.4, 0.9], widest) {
                cosine += angle.weight * angle.cos;
                length += angle.weight;
            }
            assert!((length - 1.3).abs() < ROUNDING, "{widest}: {length}");
            let exact = 0.9f64.sin() + 0.4f64.sin();
            assert!((cosine - exact).abs() < RULE_ERROR, "{widest}: {cosine} {exact}");
        }
        assert_eq!(in_panels([0.5, 0.5], 0.1).count(), 0);
    }

    /// Sum of the nodes' areas cosθ dω: the area in the plane of direction cosines.
    fn area(bounds: [[f64; 2]; 2], cos_i: f64) -> f64 {
        let mut sum = 0.0;
        hemisphere(bounds, [0.1, 0.1], cos_i, |_, area| sum += area);
        sum
    }

    #[test]
    fn areas_of_off_centre_bounds_are_exact_at_grazing_incidence() {
        // Part of the unit disc with x above a bound.
        let segment = |x: f64| x.acos() - x * (1.0 - x * x).sqrt();
        for cos_i in [0.5, 0.02] {
            for x in [-0.3, 0.5, 0.99] {
                let expected = segment(x);
                for bounds in [[x, 1.0], [-1.0, -x]] {
                    let found = area([bounds, [-1.0, 1.0]], cos_i);
                    assert!((found - expected).abs() < RULE_ERROR, "{cos_i} {bounds:?}: {found} {expected}");
                }
            }
        }
    }
}
