//! Gratings on bodies that transmit by Maxwell's equations: tables and the reference without tables against
//! single solutions, energy, and samples.

use super::common::{Random, configured, eval};
use super::transmission::{assert_density_integrates, medium, sampled};
use std::f64::consts::TAU;
use sunbeam::config::BuiltReport;
use sunbeam::grating::{ExactGrating, Order, Profile, solve_both_sides};
use sunbeam::scattering::{TransparentBody, Vec3};
use sunbeam::table::CoherenceWindow;

/// Largest root mean square error of an order's power by the tables.
const RMS: f64 = 4e-3;
const ETA: f64 = 1.5;
// `normal_min` is of the scalar theory.
const FILM: TransparentBody = TransparentBody { eta: ETA, is_film: true, normal_min: 0.0 };
const INTERFACE: TransparentBody = TransparentBody { is_film: false, ..FILM };
/// Period, height and coherence length of the sinusoid in µm.
const PERIOD_UM: f64 = 0.6;
const HEIGHT_UM: f64 = 0.1;

fn json(transmission: &str, coherence_um: f64) -> String {
    format!(
        r#"{{"preset": "sinusoidal", "period": {PERIOD_UM}, "height": {HEIGHT_UM}, "coherence_length": {coherence_um},
            "eta": {ETA}, "transmission": "{transmission}", "theory": "rigorous"}}"#
    )
}

fn profile() -> Profile {
    Profile::sinusoid(PERIOD_UM, HEIGHT_UM).unwrap()
}

/// A direction on either side, up to 80° from the normal.
fn either_side(random: &mut Random) -> Vec3 {
    loop {
        let w = random.direction();
        if w[2] > 0.17 {
            return if random.unit() < 0.5 { w } else { [w[0], w[1], -w[2]] };
        }
    }
}

/// The direction within the medium of a direction behind the flat side of a film; other directions unchanged.
fn inside(body: TransparentBody, w: Vec3) -> Vec3 {
    if !(body.is_film && w[2] < 0.0) {
        return w;
    }
    let [x, y] = [w[0] / ETA, w[1] / ETA];
    [x, y, -(1.0 - x * x - y * y).sqrt()]
}

/// Orders on both sides for light from `wi`, those behind a film after its flat side.
fn orders(body: TransparentBody, wi: Vec3, nm: f64) -> Vec<Order> {
    let solved = solve_both_sides(&profile(), ETA, nm, inside(body, wi)).unwrap();
    let below = solved.below.iter().filter_map(|order| match body.is_film {
        true => order.through_flat_side(ETA),
        false => Some(order.clone()),
    });
    solved.above.iter().cloned().chain(below).collect()
}

/// Value of an order of efficiency 1 at its centre: the window's Gaussian over solid angle, without the cosine.
fn peak(body: TransparentBody, wo: Vec3, nm: f64, coherence_um: f64) -> f64 {
    let sigma = CoherenceWindow::new(coherence_um).order_sigma_per_um() * nm * 1e-3;
    medium(body, wo[2] < 0.0).powi(2) / (TAU * sigma * sigma)
}

#[test]
fn tables_of_a_film_match_single_solutions() {
    assert_tables_match_single_solutions("film", FILM);
}

#[test]
fn tables_of_an_interface_match_single_solutions() {
    assert_tables_match_single_solutions("interface", INTERFACE);
}

fn assert_tables_match_single_solutions(transmission: &str, body: TransparentBody) {
    const COHERENCE_UM: f64 = 30.0;
    let mut random = Random::new(3);
    let surface = configured(&json(transmission, COHERENCE_UM));
    let BuiltReport::Rigorous(report) = surface.report() else { panic!("a grating") };
    println!("{report:?}");
    assert!(surface.transmits() && report.rms < RMS, "{report:?}");
    let exact = ExactGrating::of_body(profile(), body, COHERENCE_UM);
    let (mut squares, mut count) = (0.0, 0);
    for _ in 0..24 {
        let (wi, nm) = (either_side(&mut random), random.wavelength_nm());
        for order in orders(body, wi, nm) {
            let wo = order.direction;
            let (found, peak) = (eval(&surface, wi, wo, nm), peak(body, wo, nm, COHERENCE_UM));
            let expected = exact.eval(wi, wo, nm).unwrap();
            squares += ((found - expected) / peak).powi(2);
            count += 1;
        }
    }
    let rms = (squares / f64::from(count)).sqrt();
    println!("RMS {rms:.1e} of {count} orders");
    assert!(rms < RMS, "{rms}");
    for _ in 0..8 {
        let (wi, nm) = (either_side(&mut random), random.wavelength_nm());
        let (albedo, error, unequal) = sampled(&surface, body, wi, nm, &mut random);
        let expected: f64 = orders(body, wi, nm).iter().map(Order::efficiency).sum();
        println!("{wi:?}: {albedo:.4} ± {error:.4}, {expected:.4}, reciprocity {unequal:.1e}");
        assert!(albedo < 1.0 + 2.0 * RMS + 4.0 * error, "{wi:?}: {albedo} ± {error}");
        // Orders are averaged over their width, and part of those near the horizon is beyond it.
        // Jones matrices of light that enters through the flat side of a film are not listed.
        let is_listed = wi[2] > 0.0 || !body.is_film;
        assert!(!is_listed || (albedo - expected).abs() < 0.03 + 4.0 * error, "{wi:?}: {albedo} ± {error}, {expected}");
        assert!(unequal < 1e-6, "{wi:?}: {unequal}");
    }
}

#[test]
fn the_reference_has_the_orders_of_light_from_above() {
    /// The solver's accepted errors of power.
    const ABSOLUTE: f64 = 1e-3;
    const COHERENCE_UM: f64 = 200.0;
    let mut random = Random::new(5);
    for body in [FILM, INTERFACE] {
        let exact = ExactGrating::of_body(profile(), body, COHERENCE_UM);
        for _ in 0..6 {
            let (mut wi, nm) = (either_side(&mut random), random.wavelength_nm());
            if body.is_film {
                // Jones matrices of light that enters through the flat side are not listed.
                wi[2] = wi[2].abs();
            }
            for order in orders(body, wi, nm).iter().filter(|order| order.direction[2].abs() > 0.1) {
                let found =
                    exact.eval(wi, order.direction, nm).unwrap() / peak(body, order.direction, nm, COHERENCE_UM);
                let expected = order.efficiency();
                assert!((found - expected).abs() < ABSOLUTE, "{body:?} {wi:?} {}: {found} {expected}", order.index);
            }
        }
    }
}

#[test]
fn densities_of_a_grating_on_a_film_integrate_to_the_fraction_of_samples() {
    const SAMPLES: usize = 20_000;
    let mut random = Random::new(13);
    let surface = configured(&json("film", 8.0));
    for wi in [[0.0, 0.0, 1.0], [0.4, 0.3, -(0.75_f64.sqrt())]] {
        // Four standard errors of the fraction of samples, and the midpoints' error at the horizon.
        assert_density_integrates(&surface, wi, SAMPLES, 0.015, &mut random);
    }
}
