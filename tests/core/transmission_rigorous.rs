//! Gratings on transparent bodies by Maxwell's equations: tables against single solutions, energy, and samples.

use super::common::Random;
use super::transmission::{built, eval, medium, sampled};
use sunbeam::config::BuiltReport;
use sunbeam::grating::{ExactGrating, Profile, solve_both_sides};
use sunbeam::scattering::{TransparentBody, Vec3};

/// Largest root mean square error of an order's power by the tables.
const RMS: f64 = 4e-3;
const ETA: f64 = 1.5;
const BODIES: [(&str, TransparentBody); 2] = [
    ("film", TransparentBody { eta: ETA, is_film: true }),
    ("interface", TransparentBody { eta: ETA, is_film: false }),
];
/// Period, height and coherence length of the sinusoid in µm.
const SINUSOID: [f64; 3] = [0.6, 0.2, 30.0];

fn json(transmission: &str) -> String {
    let [period, height, coherence] = SINUSOID;
    format!(
        r#"{{"preset": "sinusoidal", "period": {period}, "height": {height}, "coherence_length": {coherence},
            "eta": {ETA}, "transmission": "{transmission}", "theory": "rigorous"}}"#
    )
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

#[test]
fn tables_of_bodies_match_single_solutions_and_conserve_energy() {
    let mut random = Random::new(3);
    let [period, height, coherence] = SINUSOID;
    let profile = || Profile::sinusoid(period, height).unwrap();
    for (name, body) in BODIES {
        let surface = built(&json(name));
        assert!(surface.transmits());
        let BuiltReport::Rigorous(report) = surface.report() else { panic!("a grating") };
        println!("{name}: {report:?}");
        assert!(report.rms < RMS, "{name}: {report:?}");
        let exact = ExactGrating::of_body(profile(), body, coherence);
        let (mut squares, mut count) = (0.0, 0);
        for _ in 0..25 {
            let (wi, nm) = (either_side(&mut random), random.wavelength_nm());
            let solved = solve_both_sides(&profile(), ETA, nm, inside(body, wi)).unwrap();
            for order in solved.above.iter().chain(&solved.below) {
                let order = if order.direction[2] < 0.0 && body.is_film {
                    let Some(passed) = order.through_flat_side(ETA) else { continue };
                    passed
                } else {
                    order.clone()
                };
                let wo = order.direction;
                if wo[2].abs() < 0.1 {
                    continue;
                }
                let (found, expected) = (eval(&surface, wi, wo, nm), exact.eval(wi, wo, nm).unwrap());
                let peak = exact_peak(body, wo, nm, coherence);
                squares += ((found - expected) / peak).powi(2);
                count += 1;
                // The exact lobe at the centre of an order has the order's efficiency.
                if wi[2] > 0.0 {
                    let efficiency = order.efficiency();
                    assert!((expected / peak - efficiency).abs() < 1e-3, "{name} {wi:?} {wo:?} {efficiency}");
                }
            }
        }
        let rms = (squares / f64::from(count)).sqrt();
        println!("{name}: RMS {rms:.1e} of {count} orders");
        assert!(rms < RMS, "{name}: {rms}");
        for _ in 0..6 {
            let (wi, nm) = (either_side(&mut random), random.wavelength_nm());
            let (albedo, error, unequal) = sampled(&surface, body, wi, nm, &mut random);
            println!("{name} {wi:?}: {albedo:.4} ± {error:.4}, reciprocity {unequal:.1e}");
            // The error of the tables, and noise.
            assert!(albedo < 1.0 + 2.0 * RMS + 4.0 * error, "{name} {wi:?}: {albedo} ± {error}");
            if !body.is_film {
                // All light is reflected or transmitted. Some leaves beyond the horizon by the width of orders.
                assert!(albedo > 0.97 - 4.0 * error, "{name} {wi:?}: {albedo} ± {error}");
            }
            assert!(unequal < 1e-6, "{name} {wi:?}: {unequal}");
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

/// Value of an order of efficiency 1 at its centre: the window's Gaussian over solid angle, without the cosine.
fn exact_peak(body: TransparentBody, wo: Vec3, nm: f64, coherence: f64) -> f64 {
    let sigma = sunbeam::table::CoherenceWindow::new(coherence).order_sigma_per_um() * nm * 1e-3;
    medium(body, wo[2] < 0.0).powi(2) / (std::f64::consts::TAU * sigma * sigma)
}

#[test]
fn densities_of_gratings_on_bodies_integrate_to_the_fraction_of_samples() {
    const SAMPLES: usize = 20_000;
    let mut random = Random::new(13);
    for (name, _) in BODIES {
        let surface = built(&json(name).replace("30", "8"));
        for wi in [[0.0, 0.0, 1.0], [0.4, 0.3, -(0.75_f64.sqrt())]] {
            let mut counts = [0usize; 2];
            for _ in 0..SAMPLES {
                let u = [random.unit(), random.unit(), random.unit()];
                if let Some(wo) = surface.sample_direction(wi, &[450.0, 650.0], u) {
                    counts[usize::from(wo[2] < 0.0)] += 1;
                }
            }
            // Midpoints of direction cosines x and y on either side; orders are five midpoints wide.
            const STEPS: i32 = 300;
            for (side, count) in [1.0, -1.0].into_iter().zip(counts) {
                let mut sum = 0.0;
                for i in 0..STEPS * STEPS {
                    let [x, y] = [i / STEPS, i % STEPS].map(|step| f64::from(2 * step + 1) / f64::from(STEPS) - 1.0);
                    let z_squared = 1.0 - x * x - y * y;
                    if z_squared > 0.0 {
                        let wo = [x, y, side * z_squared.sqrt()];
                        let area = 4.0 / f64::from(STEPS * STEPS);
                        sum += surface.eval_pdf(wi, wo, &[450.0, 650.0], |_, _| {}) * area / wo[2].abs();
                    }
                }
                let fraction = count as f64 / SAMPLES as f64;
                // Four standard errors of the fraction of samples, and the midpoints' error at the horizon.
                assert!((sum - fraction).abs() < 0.015, "{name} {wi:?} {side}: {sum} {fraction}");
            }
        }
    }
}
