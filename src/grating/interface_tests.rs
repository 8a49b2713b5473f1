//! Tests of gratings on an interface: tables against the solver, energy, reciprocity, samples and colours.

use super::surface::tests::mean_weights;
use super::{ExactGrating, GratingBody, GratingColourSurface, GratingSurface, Profile, Side};
use crate::colour::WavelengthWeights;
use crate::scattering::{TransparentBody, Vec3};
use crate::table::{Progress, WAVELENGTH_MIN_NM};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use std::f64::consts::TAU;
use std::sync::LazyLock;

/// Period of [`profile`].
const PERIOD_UM: f64 = 0.6;
/// Refractive index of the medium below the relief.
const ETA: f64 = 1.5;
/// Coherence length: four standard deviations of the coherence window.
const COHERENCE_UM: f64 = 40.0;
/// Sides from which light arrives and to which it leaves.
const SIDES: [Side; 2] = [Side::Above, Side::Below];

/// A sinusoid of height 0.12 µm.
fn profile() -> Profile {
    Profile::sinusoid(PERIOD_UM, 0.12).unwrap()
}

/// The tables of a profile on the interface, within the default limits of memory and time (`build_limit` 1).
fn tabulated(profile: &Profile) -> GratingSurface {
    GratingSurface::of_body(profile, GratingBody::Interface(ETA), COHERENCE_UM, 1.0, &Progress::none()).unwrap()
}

/// The tables of [`profile`], built once for all tests.
static SURFACE: LazyLock<GratingSurface> = LazyLock::new(|| tabulated(&profile()));

/// Refractive index on a side.
fn index(side: Side) -> f64 {
    if side == Side::Below { ETA } else { 1.0 }
}

/// The direction on a side with these components, in its medium; `None` beyond the horizon.
fn on_side(side: Side, [x, y]: [f64; 2]) -> Option<Vec3> {
    let z_squared = 1.0 - x * x - y * y;
    let sign = if side == Side::Below { -1.0 } else { 1.0 };
    (z_squared > 0.0).then(|| [x, y, sign * z_squared.sqrt()])
}

/// Random direction on a side, uniform over its projected hemisphere.
fn random_direction(random: &mut Pcg64Mcg, side: Side) -> Vec3 {
    let (radius, phi) = (random.random::<f64>().sqrt(), random.random_range(0.0..TAU));
    on_side(side, [radius * phi.cos(), radius * phi.sin()]).unwrap()
}

/// Direction on a side of order m of the light from `wi`; `None` where it does not propagate.
fn order(wi: Vec3, m: i32, side: Side, nm: f64) -> Option<Vec3> {
    let index_in = if wi[2] < 0.0 { ETA } else { 1.0 };
    let x = f64::from(m) * nm * 1e-3 / PERIOD_UM - index_in * wi[0];
    on_side(side, [x / index(side), -index_in * wi[1] / index(side)])
}

#[test]
fn reported_error_of_an_interface_is_below_the_accepted() {
    let report = SURFACE.report();
    // Error of efficiencies at random incidences. 0.004 is chosen; an RMS near 0 would mean no comparison.
    assert!(report.rms < 0.004 && report.rms > 1e-5, "{report:?}");
}

#[test]
fn interface_values_match_the_solver() {
    // `f_r` at the centre of an order of efficiency 1, without the factor n² of the outgoing side.
    let peak = |nm: f64| 1.0 / (TAU * (SURFACE.layout().sigma_per_um * nm * 1e-3).powi(2));
    let interface = TransparentBody::new(ETA, /* is_film */ false, COHERENCE_UM);
    let exact = ExactGrating::of_body(profile(), interface, COHERENCE_UM);
    let mut random = Pcg64Mcg::seed_from_u64(5);
    let (mut squares, mut count) = (0.0, 0);
    for i in 0..40 {
        let (from, to) = (SIDES[i % 2], SIDES[i / 2 % 2]);
        let (wi, nm) = (random_direction(&mut random, from), random.random_range(400.0..720.0));
        for m in -2..=2 {
            let Some(wo) = order(wi, m, to, nm) else { continue };
            let unit = peak(nm) * index(to).powi(2);
            let (found, expected) = (SURFACE.eval(wi, wo, nm) / unit, exact.eval(wi, wo, nm).unwrap() / unit);
            squares += (found - expected).powi(2);
            count += 1;
            // Values differ most where an order of the medium appears.
            assert!((found - expected).abs() < 0.06, "{from:?} {to:?} {wi:?} {m} {nm}: {found} {expected}");
        }
    }
    let rms = (squares / f64::from(count)).sqrt();
    assert!(count > 60 && rms < 0.006, "{rms} of {count}");
}

#[test]
fn interfaces_conserve_power_and_are_reciprocal() {
    let mut random = Pcg64Mcg::seed_from_u64(7);
    let mut squares = 0.0_f64;
    for i in 0..400 {
        let from = SIDES[i % 2];
        let (wi, nm) = (random_direction(&mut random, from), random.random_range(360.0..830.0));
        let mut sum = 0.0;
        for (m, to) in (-8..=8).flat_map(|m| SIDES.map(|to| (m, to))) {
            sum += SURFACE.efficiency_between(nm, [wi[0], wi[1]], m, [from, to]);
            let Some(wo) = order(wi, m, to, nm) else { continue };
            let (there, back) = (SURFACE.eval(wi, wo, nm), SURFACE.eval(wo, wi, nm));
            let [there, back] = [there / index(to).powi(2), back / index(from).powi(2)];
            // Rounding of the wave numbers t and a (`mod.rs`) in double precision, next to square roots.
            assert!((there - back).abs() <= 1e-6 * there.max(1e-3), "{wi:?} {wo:?} {nm}: {there} {back}");
        }
        // Errors of single efficiencies add; they are largest near the critical angle.
        assert!((sum - 1.0).abs() < 0.12, "{from:?} {wi:?} {nm}: {sum}");
        squares += (sum - 1.0).powi(2) / 400.0;
    }
    assert!(squares.sqrt() < 0.015, "RMS of the lost power: {}", squares.sqrt());
}

#[test]
fn shallow_interfaces_refract_by_fresnels_equations() {
    let flat = tabulated(&Profile::sinusoid(0.5, 1e-5).unwrap());
    // Fresnel transmittance for unpolarised light; `n` is the index behind the interface over that before it.
    let transmitted = |cos_i: f64, n: f64| {
        let cos_t = (1.0 - (1.0 - cos_i * cos_i) / (n * n)).max(0.0).sqrt();
        let (s, p) = ((cos_i + n * cos_t).powi(-2), (n * cos_i + cos_t).powi(-2));
        2.0 * n * cos_i * cos_t * (s + p)
    };
    for (from, n) in [(Side::Above, ETA), (Side::Below, 1.0 / ETA)] {
        for sine in [0.0, 0.2, 0.5, 0.6, 0.7, 0.9] {
            for [x, y] in [[sine, 0.0], [0.0, sine], [-0.8 * sine, 0.6 * sine]] {
                let found = [Side::Above, Side::Below].map(|to| flat.efficiency_between(550.0, [x, y], 0, [from, to]));
                let expected = transmitted((1.0_f64 - sine * sine).sqrt(), n);
                let [reflected, through] = if from == Side::Above { found } else { [found[1], found[0]] };
                // From below, the transmittance falls to 0 like a square root at a sine of 0.667, the critical angle.
                assert!((through - expected).abs() < 0.02, "{from:?} {x} {y}: {through} {expected}");
                assert!((reflected - 1.0 + expected).abs() < 0.02, "{from:?} {x} {y}: {reflected} {expected}");
            }
        }
    }
}

#[test]
fn samples_at_an_interface_carry_the_whole_power() {
    let mut random = Pcg64Mcg::seed_from_u64(11);
    for (from, at) in [(Side::Above, [0.3, 0.2]), (Side::Below, [0.2, -0.3]), (Side::Below, [0.4, 0.75])] {
        let (wi, nm) = (on_side(from, at).unwrap(), 550.0);
        let (mut sum, mut squares) = (0.0, 0.0);
        let count = 40_000;
        for _ in 0..count {
            let u = std::array::from_fn(|_| random.random());
            let weight = SURFACE.sample(wi, &[nm], u).map_or(0.0, |sample| sample.weight);
            sum += weight;
            squares += weight * weight;
        }
        let n = f64::from(count);
        let (mean, error) = (sum / n, ((squares / n - (sum / n).powi(2)) / n).sqrt());
        // The error of the table, and tails of orders beyond the horizon.
        assert!((mean - 1.0).abs() < 4.0 * error + 0.03, "{from:?} {at:?}: {mean} ± {error}");
        // Standard deviation of the weights, whose mean is 1. Samples nearly follow the efficiencies.
        assert!(error * n.sqrt() < 0.35, "weights vary by {}", error * n.sqrt());
    }
}

#[test]
fn colours_of_interfaces_match_the_sum_over_wavelengths() {
    let colours = GratingColourSurface::new(SURFACE.clone());
    for (from, to) in SIDES.into_iter().flat_map(|from| SIDES.map(|to| (from, to))) {
        let (mut largest, mut worst) = (0.0_f64, 0.0_f64);
        for [x, y] in [[0.0, 0.0], [0.4, 0.1], [-0.3, 0.6], [0.1, 0.85]] {
            let wi = on_side(from, [x, y]).unwrap();
            for step in 0..120 {
                // In and beside the cone of the orders, where `wo_y` is that of order 0.
                let wo_x = -1.0 + f64::from(step) / 60.0;
                let wo_y = -index(from) * wi[1] / index(to) + 0.002 * f64::from(step % 5);
                let Some(wo) = on_side(to, [wo_x, wo_y]) else { continue };
                let mut expected = [0.0; 3];
                for (i, weight) in WavelengthWeights::per_nm().iter().enumerate() {
                    let value = SURFACE.eval(wi, wo, WAVELENGTH_MIN_NM + i as f64);
                    (0..3).for_each(|c| expected[c] += f64::from(weight[c]) * value);
                }
                let found = colours.eval(wi, wo);
                for c in 0..3 {
                    largest = largest.max(expected[c].abs());
                    worst = worst.max((found[c] - expected[c]).abs());
                }
            }
        }
        // The colour lobe takes one efficiency for the whole width of an order. Near the critical angle, which one of
        // the directions has, the colour of order 0 changes within one step of its table.
        assert!(worst < 0.08 * largest && largest > 0.1, "{from:?} {to:?}: {worst} of {largest}");
    }
}

#[test]
fn mean_weights_of_colours_are_the_albedo_of_interfaces() {
    let colours = GratingColourSurface::new(SURFACE.clone());
    // An albedo of 1, since nothing is absorbed.
    let expected: [f64; 3] =
        std::array::from_fn(|c| WavelengthWeights::per_nm().iter().map(|weight| f64::from(weight[c])).sum());
    for (from, at) in [(Side::Above, [0.3, 0.1]), (Side::Below, [0.3, 0.1]), (Side::Below, [-0.2, 0.8])] {
        let wi = on_side(from, at).unwrap();
        for (c, [mean, error]) in mean_weights(&colours, wi, 60_000).into_iter().enumerate() {
            // Four standard errors, the error of the table, and the parts of orders below the horizon.
            assert!((mean - expected[c]).abs() < 4.0 * error + 0.03 * expected[c], "{from:?} {c}: {mean} ± {error}");
        }
    }
}
