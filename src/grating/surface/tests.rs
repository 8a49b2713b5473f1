//! Tests of a grating's surfaces over a table of orders with a closed form.

use super::*;
use crate::colour::WavelengthWeights;
use crate::grating::GratingColourSurface;
use crate::grating::wavelengths::Spacing;
use crate::lobe::{LinearSrgb, Lobe, UNIFORM_FRACTION};
use crate::numeric::math::SQUARE_PDF;
use crate::table::WAVELENGTH_MIN_NM;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;

/// Period d of the orders in the closed form.
const PERIOD_UM: f64 = 1.6;
/// 17 nodes along either side of a cell, and wavelengths at steps of at most 47 nm, all of them solved.
const TABLE_RESOLUTION: TableResolution =
    TableResolution { stored: 17, spacing: Some(Spacing { step_nm: 47.0, solved_every: 1 }), tolerance: 1e-3 };

/// Orders with a closed form that has the properties of a grating's: reciprocity, efficiencies that rise from the
/// horizon as a root, and a dependence on the wavelength. It solves no grating, and its numbers are arbitrary.
struct ClosedForm {
    /// 1 for light above the relief alone, 2 for a film.
    sides: usize,
}

/// Cosine with the normal of the order with the wave number `a` along x, in projection onto the plane across the
/// grooves. `t` is the length of the wave vector's projection, the largest `|a|` that propagates. Both are in units of
/// 2π/d.
fn cos(t: f64, a: f64) -> f64 {
    (1.0 - (a / t).powi(2)).max(0.0).sqrt()
}

/// Efficiency between the incident wave number `a` and the outgoing one `c`, both along x; `t` is that of [`cos`].
fn efficiency(t: f64, a: f64, c: f64, nm: f64) -> f64 {
    let (m, fade) = (c - a, (nm / 600.0).recip());
    0.2 * fade * (-0.3 * m.abs()).exp() * (1.0 + 0.5 * (0.7 * (a - c)).sin()) * (cos(t, a) * cos(t, c)).sqrt()
}

/// Factor of a film's efficiencies between the wave number `a` on the side `from` and `c` on the side `to`; side 0 is
/// above, 1 below.
fn film_factor([from, to]: [usize; 2], a: f64, c: f64) -> f64 {
    // On the reversed path a + c changes its sign. The signs of the sines make transmission equal on both paths.
    match [from, to] {
        [0, 0] => 1.0,
        [1, 1] => 0.6,
        [0, _] => 1.2 + 0.3 * (0.4 * (a + c)).sin(),
        _ => 1.2 - 0.3 * (0.4 * (a + c)).sin(),
    }
}

impl OrderSolver for ClosedForm {
    fn efficiencies(&self, t: f64, b: f64, wavelengths_nm: &[f64]) -> Result<Vec<Vec<f64>>, GratingError> {
        // Propagating orders m have |b + m| ≤ t. The Bloch phase b is taken for the wave number of order 0.
        let first = -((t + b).floor());
        let count = ((t - b).floor() + (t + b).floor()) as usize + 1;
        // Wave number along x of the order with the order number i, in units of 2π/d.
        let wave_number = |i: usize| b + first + i as f64;
        // A channel is an order on a side: the propagating orders above, then those below.
        let channels = count * self.sides;
        // Efficiency between two channels.
        let between = |from: usize, to: usize, nm: f64| {
            let (a, c) = (wave_number(from % count), wave_number(to % count));
            efficiency(t, a, c, nm) * film_factor([from / count, to / count], a, c)
        };
        let matrix = |&nm: &f64| (0..channels * channels).map(|at| between(at / channels, at % channels, nm)).collect();
        Ok(wavelengths_nm.iter().map(matrix).collect())
    }

    fn sides(&self) -> usize {
        self.sides
    }
}

/// The surface of the closed form with 1 or 2 sides.
fn tabulated_on(sides: usize, coherence_length_um: f64) -> GratingSurface {
    let solver = ClosedForm { sides };
    GratingSurface::tabulate(
        PERIOD_UM,
        coherence_length_um,
        &solver,
        TABLE_RESOLUTION,
        &Progress::none(),
        Instant::now(),
    )
    .unwrap()
}

/// The surface of the closed form for light above the relief alone.
fn tabulated(coherence_length_um: f64) -> GratingSurface {
    tabulated_on(1, coherence_length_um)
}

/// The direction on side 0, above, or 1, below.
fn on_side(side: usize, [x, y, z]: Vec3) -> Vec3 {
    if side == 0 { [x, y, z] } else { [x, y, -z] }
}

/// The unit vector at the angle `theta` to the normal and the azimuth `phi`, in radians.
fn direction(theta: f64, phi: f64) -> Vec3 {
    [theta.sin() * phi.cos(), theta.sin() * phi.sin(), theta.cos()]
}

#[test]
fn reported_error_is_that_of_linear_interpolation() {
    let report = *tabulated(65.0).report();
    // Linear interpolation between 17 nodes a side.
    assert!(report.rms < 2e-3 && report.p99 < 8e-3, "{report:?}");
    assert!(report.rms > 1e-6, "the error is measured: {report:?}");
    // Far below the table's size of about 1 MB, and its points: at least 36 in each of nine cells.
    assert!(report.bytes > 10_000 && report.solved > 100, "{report:?}");
}

#[test]
fn reflectance_is_reciprocal() {
    // Rounding of t and a in double precision, next to square roots.
    const RELATIVE: f64 = 1e-6;
    let surface = tabulated(5.0);
    let mut bright_pairs = 0;
    for i in 0..400 {
        let x = f64::from(i);
        let (wi, wo) = (direction(0.02 + 0.0037 * x, 0.9 * x), direction(1.5 - 0.0035 * x, 2.3 * x + 0.1));
        for nm in [380.0, 511.0, 777.0] {
            let (there, back) = (surface.eval(wi, wo, nm), surface.eval(wo, wi, nm));
            assert!((there - back).abs() <= RELATIVE * there.max(1e-3), "{wi:?} {wo:?} {nm}: {there} {back}");
            bright_pairs += usize::from(there > 1e-3);
        }
    }
    assert!(bright_pairs > 50, "{bright_pairs}");
}

/// Efficiencies and reflectances at, just above and just below the horizon of an order.
#[test]
fn efficiencies_are_accurate_at_the_horizon() {
    // Next to the horizon these efficiencies vary as the fourth root of `t − |c|`, the square root of the table's
    // coordinate. Linear interpolation of √x between 0 and h errs by at most √h/4: by 1/16 with the step h = 1/16 of 17
    // nodes. Efficiencies are at most 0.3.
    const ABSOLUTE: f64 = 0.3 / 16.0;
    let surface = tabulated(65.0);
    let mut compared = 0;
    for nm in [450.0, 523.0, 650.0] {
        for phi in [0.0, 0.4] {
            for order in [-3_i32, -2, -1, 1, 2, 3] {
                for apart in [-1e-4, -1e-7, 0.0, 1e-7, 1e-4] {
                    // The incident wave number `a` for which this order has `|a + order| − t = apart`.
                    let periods = 1e3 * PERIOD_UM / nm;
                    let y = 0.3 * f64::sin(phi);
                    let t = periods * f64::sqrt(1.0 - y * y);
                    let a = (t + apart) * f64::from(order).signum() - f64::from(order);
                    if a.abs() > 0.99 * t {
                        continue;
                    }
                    let wi = [-a / periods, y, f64::sqrt(1.0 - (a / periods).powi(2) - y * y)];
                    for m in [order, 0, -order.signum()] {
                        let c = a + f64::from(m);
                        let found = surface.efficiency(nm, [wi[0], wi[1]], m);
                        let expected = if c.abs() < t { efficiency(t, a, c, nm) } else { 0.0 };
                        assert!(
                            (found - expected).abs() < ABSOLUTE,
                            "{nm} {phi} {order} {apart} {m}: {found} {expected}"
                        );
                        compared += 1;
                        let x = f64::from(m) / periods - wi[0];
                        let squared = 1.0 - x * x - y * y;
                        if squared > 0.0 {
                            let wo = [x, -y, squared.sqrt()];
                            let (there, back) = (surface.eval(wi, wo, nm), surface.eval(wo, wi, nm));
                            assert!(there.is_finite() && there >= 0.0 && surface.pdf(wi, wo, &[nm]).is_finite());
                            // At the horizon itself rounding decides whether the order propagates.
                            let same = (there - back).abs() <= 1e-6 * there.max(1e-3);
                            assert!(same || apart == 0.0, "{nm} {phi} {order} {apart} {m}: {there} {back}");
                        }
                    }
                }
            }
        }
    }
    assert!(compared > 300, "{compared}");
}

/// Integral of a function over the direction cosines (x, y) of the hemisphere, by the midpoint rule within six standard
/// deviations of each order. `sigma` is the standard deviation in cycles/µm.
fn over_orders(wi: Vec3, nm: f64, sigma: f64, f: impl Fn(Vec3) -> f64) -> f64 {
    // A quarter of the standard deviation in direction cosines.
    let step = 0.25 * nm * 1e-3 * sigma;
    let mut sum = 0.0;
    // At the incidences of these tests, no order beyond ±4 propagates.
    for m in -6..=6 {
        let centre = [f64::from(m) * nm * 1e-3 / PERIOD_UM - wi[0], -wi[1]];
        for i in -24..=24 {
            for k in -24..=24 {
                let (x, y) = (centre[0] + f64::from(i) * step, centre[1] + f64::from(k) * step);
                let squared = 1.0 - x * x - y * y;
                if squared > 0.0 {
                    sum += f([x, y, squared.sqrt()]) * step * step;
                }
            }
        }
    }
    sum
}

#[test]
fn albedo_is_the_sum_of_the_efficiencies() {
    // The efficiency varies over the width of an order, and the table has its own error.
    const ABSOLUTE: f64 = 5e-3;
    let surface = tabulated(65.0);
    for (theta, phi, nm) in [(0.3f64, 0.2f64, 450.0), (0.9, 1.0, 620.0), (0.1, 3.0, 540.0)] {
        let wi = direction(theta, phi);
        let periods = 1e3 * PERIOD_UM / nm;
        let (t, a) = (periods * (1.0 - wi[1] * wi[1]).sqrt(), -wi[0] * periods);
        // |m| is at most 2d/λ, 7.1 at 450 nm.
        let expected: f64 =
            (-9..=9).map(|m| a + f64::from(m)).filter(|c| c.abs() < t).map(|c| efficiency(t, a, c, nm)).sum();
        let found = over_orders(wi, nm, surface.layout().sigma_per_um, |wo| surface.eval(wi, wo, nm));
        assert!((found - expected).abs() < ABSOLUTE, "{theta} {phi} {nm}: {found} {expected}");
    }
}

#[test]
fn samples_follow_their_density() {
    let (surface, wi, nm) = (tabulated(20.0), direction(0.5, 0.4), 550.0);
    let sigma = surface.layout().sigma_per_um;
    // Without its uniform part, the density integrates to the remaining fraction. No order lies near the horizon, where
    // samples would be lost. Divided by cosθo, a density over solid angle becomes one over direction cosines.
    let integral =
        over_orders(wi, nm, sigma, |wo| (surface.pdf(wi, wo, &[nm]) - UNIFORM_FRACTION * SQUARE_PDF) / wo[2]);
    assert!((integral - (1.0 - UNIFORM_FRACTION)).abs() < 2e-3, "{integral}");
    // The mean of the weights is the albedo.
    let expected = over_orders(wi, nm, sigma, |wo| surface.eval(wi, wo, nm));
    let (mut sum, mut squares, count) = (0.0, 0.0, 40_000);
    for i in 0..count {
        // Roberts' sequence: multiples of the first three powers of 1/g, with g⁴ = g + 1.
        let u = [0.819_172_513_396_164_4, 0.671_043_606_703_789_2, 0.549_700_477_901_970_2]
            .map(|step| (0.5 + step * f64::from(i)).fract());
        let weight = surface.sample(wi, &[nm], u).map_or(0.0, |sample| sample.weight);
        sum += weight;
        squares += weight * weight;
    }
    let n = f64::from(count);
    let (mean, spread) = (sum / n, (squares / n - (sum / n).powi(2)).max(0.0).sqrt());
    // Four standard errors of independent samples; these are stratified.
    assert!((mean - expected).abs() < 4.0 * spread / n.sqrt() + 1e-3, "{mean} {expected} {spread}");
    // Samples follow the efficiencies, so that weights hardly vary.
    assert!(spread < 0.2 * mean, "{mean} {spread}");
}

/// Linear sRGB by the sum over every nm.
fn summed(surface: &GratingSurface, wi: Vec3, wo: Vec3) -> [f64; 3] {
    let mut sum = [0.0; 3];
    for (i, weight) in WavelengthWeights::per_nm().iter().enumerate() {
        let f = surface.eval(wi, wo, WAVELENGTH_MIN_NM + i as f64);
        for c in 0..3 {
            sum[c] += f64::from(weight[c]) * f;
        }
    }
    sum
}

#[test]
fn colours_match_the_sum_over_wavelengths() {
    // The colour lobe takes one efficiency for the whole width of an order.
    const OF_LARGEST: f64 = 0.02;
    for sides in [1, 2] {
        let surface = GratingColourSurface::new(tabulated_on(sides, 65.0));
        for (from, to) in (0..sides).flat_map(|from| (0..sides).map(move |to| (from, to))) {
            let (mut largest, mut worst) = (0.0_f64, 0.0_f64);
            for (theta, phi) in [(0.0, 0.0), (0.5, 0.3), (0.9, 2.0), (1.2, 1.5)] {
                let wi = on_side(from, direction(theta, phi));
                for i in 0..160 {
                    // Along the plane of the orders, and close to it.
                    let (x, y) = (-1.0 + f64::from(i) / 80.0 - wi[0], -wi[1] + 0.002 * f64::from(i % 5));
                    if x * x + y * y >= 1.0 {
                        continue;
                    }
                    let wo = on_side(to, [x, y, (1.0 - x * x - y * y).sqrt()]);
                    let (found, expected) = (surface.eval(wi, wo), summed(surface.grating(), wi, wo));
                    for c in 0..3 {
                        largest = largest.max(expected[c].abs());
                        worst = worst.max((found[c] - expected[c]).abs());
                    }
                    let back = surface.eval(wo, wi);
                    assert!((0..3).all(|c| (back[c] - found[c]).abs() <= 1e-6 * largest), "{found:?} {back:?}");
                }
            }
            assert!(worst < OF_LARGEST * largest && largest > 0.1, "{from} {to}: {worst} of {largest}");
        }
    }
}

/// Mean of the weights of `count` samples and its standard error, for each channel of linear sRGB.
pub(in crate::grating) fn mean_weights(surface: &GratingColourSurface, wi: Vec3, count: u32) -> [[f64; 2]; 3] {
    let lobe = surface.lobe::<f64>();
    // Masks the lanes of a SIMD vector; a plain number has a single lane.
    let active = true;
    let mut random = Pcg64Mcg::seed_from_u64(3);
    let mut sums = [[0.0; 2]; 3];
    for _ in 0..count {
        let wo = lobe.sample(wi, LinearSrgb, std::array::from_fn(|_| random.random()), active);
        let (value, pdf) = lobe.eval_pdf(wi, wo, LinearSrgb, active);
        for (value, [sum, squares]) in value.into_iter().zip(&mut sums) {
            let weight = if pdf > 0.0 { value * wo[2].abs() / pdf } else { 0.0 };
            *sum += weight;
            *squares += weight * weight;
        }
    }
    let n = f64::from(count);
    sums.map(|[sum, squares]| [sum / n, ((squares / n - (sum / n).powi(2)) / n).sqrt()])
}

#[test]
fn mean_weights_of_colours_are_the_albedo() {
    for (sides, from) in [(1, 0), (2, 0), (2, 1)] {
        let surface = GratingColourSurface::new(tabulated_on(sides, 65.0));
        for (theta, phi) in [(0.3, 0.4), (1.0, 2.2)] {
            let wi = on_side(from, direction(theta, phi));
            let mut expected = [0.0; 3];
            for (i, weight) in WavelengthWeights::per_nm().iter().enumerate() {
                let nm = WAVELENGTH_MIN_NM + i as f64;
                let from_side = [Side::Above, Side::Below][from];
                // |m| is at most 2d/λ, 8.9 at 360 nm.
                let channels =
                    [Side::Above, Side::Below][..sides].iter().flat_map(|&to| (-9..=9).map(move |m| (m, to)));
                let albedo: f64 = channels
                    .map(|(m, to)| surface.grating().efficiency_between(nm, [wi[0], wi[1]], m, [from_side, to]))
                    .sum();
                for c in 0..3 {
                    expected[c] += f64::from(weight[c]) * albedo;
                }
            }
            for (c, [mean, error]) in mean_weights(&surface, wi, 100_000).into_iter().enumerate() {
                // Four standard errors, and the parts of orders below the horizon.
                assert!(
                    (mean - expected[c]).abs() < 4.0 * error + 0.005 * expected[c],
                    "{sides} {from} {c}: {mean} ± {error}, {expected:?}"
                );
                assert!(error < 0.01 * expected[c], "{error}");
            }
        }
    }
}
