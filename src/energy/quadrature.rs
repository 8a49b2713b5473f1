//! Quadrature over the hemisphere of directions, in coordinates in which the horizon is smooth.

use crate::numeric::math::sines_and_cosines;
use crate::scattering::Vec3;
use std::f64::consts::FRAC_PI_2;

/// Cosine of an incidence below which the horizon has panels of its own, and how many such cosines these are wide.
const GRAZING_COS: f64 = 0.03;
const HORIZON_COSINES: f64 = 8.0;

/// Abscissae and weights of a three-point Gauss–Hermite rule for a standard normal variate.
pub(super) const HERMITE_3: [(f64, f64); 3] =
    [(0.0, 2.0 / 3.0), (-1.732_050_807_568_877_2, 1.0 / 6.0), (1.732_050_807_568_877_2, 1.0 / 6.0)];

/// The same with five points.
pub(super) const HERMITE_5: [(f64, f64); 5] = [
    (0.0, 8.0 / 15.0),
    (-1.355_626_179_974_266, 0.222_075_922_005_612_6),
    (1.355_626_179_974_266, 0.222_075_922_005_612_6),
    (-2.856_970_013_872_805_6, 0.011_257_411_327_720_7),
    (2.856_970_013_872_805_6, 0.011_257_411_327_720_7),
];

/// Positive abscissae and weights of the six-point Gauss–Legendre rule on [−1, 1].
pub(super) const LEGENDRE_6: [(f64, f64); 3] = [
    (0.238_619_186_083_196_9, 0.467_913_934_572_691_04),
    (0.661_209_386_466_264_5, 0.360_761_573_048_138_6),
    (0.932_469_514_203_152, 0.171_324_492_379_170_35),
];

/// Positive abscissae and weights of the 16-point Gauss–Legendre rule on [−1, 1].
pub(super) const LEGENDRE_16: [(f64, f64); 8] = [
    (0.095_012_509_837_637_44, 0.189_450_610_455_068_5),
    (0.281_603_550_779_258_9, 0.182_603_415_044_923_6),
    (0.458_016_777_657_227_4, 0.169_156_519_395_002_5),
    (0.617_876_244_402_643_7, 0.149_595_988_816_576_7),
    (0.755_404_408_355_003, 0.124_628_971_255_533_9),
    (0.865_631_202_387_831_7, 0.095_158_511_682_492_8),
    (0.944_575_023_073_232_6, 0.062_253_523_938_647_9),
    (0.989_400_934_991_649_9, 0.027_152_459_411_754_1),
];

/// Visits directions over the part of the hemisphere between two direction cosines along x and two along y, with their areas in
/// direction cosines, `cosθ dω`. Panels of 16 places are at most `widest` radians wide along x and y.
///
/// With `y = sin α` and `x = cos α sin ψ` the cosine is `cos α cos ψ` and the area `cos α · cosθ dα dψ`, so that the cosine
/// that the obliquity factor divides by cancels, and places crowd towards the horizon. The factor also divides by the square
/// of `cos_i + cosθo`, so a grazing incidence has panels of its own within a few `cos_i` of the horizon.
pub(super) fn hemisphere(between: [[f64; 2]; 2], widest: [f64; 2], cos_i: f64, mut visit: impl FnMut(Vec3, f64)) {
    let edge = FRAC_PI_2 - if cos_i < GRAZING_COS { HORIZON_COSINES * cos_i } else { 0.0 };
    let [between_x, between_y] = between.map(|[low, high]| [low.max(-1.0), high.min(1.0)]);
    if between_x[0] >= between_x[1] || between_y[0] >= between_y[1] {
        return;
    }
    let [low, high] = between_y.map(f64::asin);
    // Where a limit along x meets the horizon the integrand has a kink.
    let mut ends = vec![low, high];
    for x in between_x {
        let alpha = x.abs().acos();
        ends.extend([-alpha, alpha].into_iter().filter(|alpha| low < *alpha && *alpha < high));
    }
    ends.sort_by(f64::total_cmp);
    // Of the places in a row: sin ψ, cos ψ and weight. Most rows go from one horizon to the other, so that one serves them all.
    let (mut row, mut row_between) = (Vec::new(), [f64::NAN; 2]);
    for piece in ends.windows(2) {
        in_panels([piece[0], piece[1]], widest[1], &LEGENDRE_16).for_each(|((y, across), weight_y)| {
            let between = between_x.map(|x| (x / across.max(f64::MIN_POSITIVE)).clamp(-1.0, 1.0).asin());
            if between != row_between {
                row_between = between;
                row.clear();
                let [low, high] = between.map(|psi: f64| psi.clamp(-edge, edge));
                let parts = [[between[0], low], [low, high], [high, between[1]]].into_iter();
                row.extend(parts.flat_map(|part| in_panels(part, widest[0], &LEGENDRE_16)));
            }
            for &((sin, cos), weight_x) in &row {
                visit([across * sin, y, across * cos], weight_x * weight_y * across * across * cos);
            }
        });
    }
}

/// Sines and cosines of angles between two with the weights of these, those of a rule in each of as many panels as `widest`
/// asks for; none if the two are in the wrong order.
pub(super) fn in_panels(
    [low, high]: [f64; 2],
    widest: f64,
    rule: &'static [(f64, f64)],
) -> impl Iterator<Item = ((f64, f64), f64)> {
    let range = (high - low).max(0.0);
    let panels = (range / widest).ceil() as usize;
    let half = 0.5 * range / panels.max(1) as f64;
    // All panels have the same angles from their middles, so that one sine and cosine of its own do for each.
    let mut turns = [(0.0, 0.0); LEGENDRE_16.len()];
    for (turns, nodes) in turns.chunks_mut(4).zip(rule.chunks(4)) {
        let angle = |i: usize| nodes.get(i).map_or(0.0, |(node, _)| half * node);
        turns.copy_from_slice(&sines_and_cosines(std::array::from_fn(angle)));
    }
    (0..panels).flat_map(move |panel| {
        let (sin, cos) = (low + (2 * panel + 1) as f64 * half).sin_cos();
        let turned = move |turn: f64, across: f64| (sin * across + cos * turn, cos * across - sin * turn);
        rule.iter().zip(turns).flat_map(move |(&(_, weight), (turn, across))| {
            [-turn, turn].map(|turn| (turned(turn, across), half * weight))
        })
    })
}
