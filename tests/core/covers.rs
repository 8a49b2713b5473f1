//! Covers and relative sizes of a relief: against closed forms, and against the direct sum with the vectors inside.

use super::common::{Random, bessel, configured, direction, eval, sinusoid};
use std::f64::consts::{PI, TAU};
use sunbeam::lobe::{Exact, Lobe, Surface};
use sunbeam::scattering::{ComplexIndex, Obliquity, Options, Pair, RelativeSize, Vec3, fresnel_unpolarised};

/// Index of polycarbonate.
const ETA: f64 = 1.58;
/// Relative error of tables built to 1e-3, at the peaks of orders.
const TABLES: f64 = 2e-3;

/// Cosine inside the cover of a direction outside.
fn cos_inside(w: Vec3) -> f64 {
    (1.0 - (w[0] * w[0] + w[1] * w[1]) / (ETA * ETA)).sqrt()
}

fn transmittance(w: Vec3) -> f64 {
    1.0 - fresnel_unpolarised(w[2], ComplexIndex { eta: ETA, k: 0.0 })
}

/// The direction of order `m` of a grating of period `d_um` for light from `wi`; `None` if it does not leave.
fn order(wi: Vec3, m: i32, d_um: f64, nm: f64) -> Option<Vec3> {
    let (x, y) = (f64::from(m) * nm * 1e-3 / d_um - wi[0], -wi[1]);
    let z_squared = 1.0 - x * x - y * y;
    (z_squared > 1e-3).then(|| [x, y, z_squared.sqrt()])
}

#[test]
fn orders_under_a_cover_follow_the_vector_inside() {
    // S at the order's own direction under a periodic ensemble is 4πs²·|c_m|², with c_m = i^m J_m(κ·h/2) of a sinusoid.
    let (d_um, height_um, coherence_um) = (2.5, 0.25, 40.0);
    let json = format!(
        r#"{{"preset": "sinusoidal", "period": {d_um}, "height": {height_um}, "coherence_length": {coherence_um},
            "conserve_energy": false, "cover_eta": {ETA}}}"#
    );
    let surface = configured(&json);
    let mut compared = 0;
    for (theta, phi) in [(0.0, 0.0), (30.0, 0.0), (55.0, 35.0), (75.0, 180.0)] {
        let wi = direction(theta, phi);
        for nm in [420.0, 550.0, 680.0] {
            for m in -3..=3 {
                let Some(wo) = order(wi, m, d_um, nm) else { continue };
                let w = ETA * (cos_inside(wi) + cos_inside(wo));
                let kappa = TAU * w / (nm * 1e-3);
                let amplitude = bessel(m, 0.5 * kappa * height_um);
                let s = coherence_um / 4.0;
                let spectrum = 4.0 * PI * s * s * amplitude * amplitude;
                // Stam's factor of the directions inside.
                let inside = |w: Vec3| [w[0] / ETA, w[1] / ETA, cos_inside(w)];
                let stam = Pair::new(inside(wi), inside(wo)).unwrap().obliquity(Obliquity::Stam);
                let expected = transmittance(wi) * transmittance(wo) * stam * spectrum / (nm * 1e-3).powi(2);
                let found = eval(&surface, wi, wo, nm);
                if amplitude * amplitude > 1e-3 {
                    assert!((found / expected - 1.0).abs() < TABLES, "{theta}° {nm} nm, order {m}: {found} {expected}");
                    compared += 1;
                }
            }
        }
    }
    assert!(compared > 30, "{compared}");
}

#[test]
fn orders_of_a_resized_grating_follow_the_closed_form() {
    // Orders under the same window as that of the tables, which keep their width.
    let (d_um, height_um, coherence_um) = (2.5, 0.25, 40.0);
    let field = sinusoid(100, d_um, 0.5 * height_um);
    let options = Options { coherence_length_um: coherence_um, conserve_energy: false, ..Options::default() };
    let surface = Surface::new(&field, &options).unwrap();
    let sigma_um = coherence_um / 4.0;
    let mut compared = 0;
    for (scale, depth) in [(1.0, 1.0), (0.6, 0.9), (0.8, 0.3), (0.41, 1.0)] {
        let lobe = surface.lobe_of_size(RelativeSize { scale, depth });
        for (wi, nm) in [(direction(0.0, 0.0), 420.0), (direction(30.0, 20.0), 550.0), (direction(60.0, 200.0), 680.0)]
        {
            for m in -3..=3 {
                let Some(wo) = order(wi, m, scale * d_um, nm) else { continue };
                let pair = Pair::new(wi, wo).unwrap();
                let amplitude = bessel(m, 0.5 * pair.kappa(nm * 1e-3) * depth * height_um);
                let spectrum = 4.0 * PI * sigma_um * sigma_um * amplitude * amplitude;
                let expected = pair.obliquity(Obliquity::Stam) * spectrum / (nm * 1e-3).powi(2);
                let [found] = lobe.eval(wi, wo, [nm], true);
                if amplitude * amplitude > 1e-3 {
                    assert!((found / expected - 1.0).abs() < TABLES, "{scale} {depth}, order {m}: {found} {expected}");
                    compared += 1;
                }
            }
        }
    }
    assert!(compared > 15, "{compared}");
}

#[test]
fn a_flat_relief_under_a_cover_mirrors_as_a_metal_seen_through_fresnel() {
    // ∫ f cosθo dωo of the mirror order is R·T(θi)·T(θo): the factors hardly vary over a narrow order.
    let json = format!(
        r#"{{"preset": "flat", "coherence_length": 400, "eta": 1.0, "k": 6.9, "conserve_energy": false,
            "cover_eta": {ETA}}}"#
    );
    let surface = configured(&json);
    for theta in [0.0, 30.0, 60.0] {
        let wi = direction(theta, 20.0);
        let mirror = [-wi[0], -wi[1], wi[2]];
        // An order is a Gaussian in frequency with the variance 1/(8π²s²).
        let per_order = eval(&surface, wi, mirror, 550.0) * (0.55f64).powi(2) / (4.0 * PI * 100.0 * 100.0);
        let relative = ComplexIndex { eta: 1.0 / ETA, k: 6.9 / ETA };
        let expected = fresnel_unpolarised(cos_inside(wi), relative) * transmittance(wi).powi(2);
        assert!((per_order / expected - 1.0).abs() < TABLES, "{theta}°: {per_order} {expected}");
    }
}

#[test]
fn an_index_of_one_is_no_cover() {
    let bare = r#"{"preset": "blazed", "coherence_length": 20, "eta": 0.2, "k": 3.4"#;
    let (bare, covered) = (configured(&format!("{bare}}}")), configured(&format!(r#"{bare}, "cover_eta": 1}}"#)));
    let mut random = Random::new(3);
    for _ in 0..200 {
        let (wi, wo) = (random.direction(), random.direction());
        let (a, b) = (eval(&bare, wi, wo, 550.0), eval(&covered, wi, wo, 550.0));
        assert!((a - b).abs() <= 1e-9 * a.abs().max(1e-9), "{wi:?} {wo:?}: {a} {b}");
    }
}

#[test]
fn covers_are_reciprocal_and_samples_have_their_density() {
    for json in [
        r#"{"preset": "blazed", "coherence_length": 20, "eta": 1.0, "k": 6.9, "cover_eta": 1.5}"#,
        r#"{"preset": "sinusoidal", "period": 0.8, "height": 0.1, "coherence_length": 20, "eta": 1.0, "k": 6.9,
            "cover_eta": 1.5, "theory": "rigorous"}"#,
    ] {
        let surface = configured(json);
        let mut random = Random::new(7);
        for wi in [direction(0.0, 0.0), direction(40.0, 30.0), direction(70.0, 100.0)] {
            let (mut weights, mut count) = (0.0, 0);
            const SAMPLES: usize = 40_000;
            for _ in 0..SAMPLES {
                let u = [random.unit(), random.unit(), random.unit()];
                let Some(wo) = surface.sample_direction(wi, &[550.0], u) else { continue };
                let mut f = 0.0;
                let pdf = surface.eval_pdf(wi, wo, &[550.0], |_, value| f = value);
                assert!(pdf > 0.0 && f >= 0.0, "{wo:?}: {f} {pdf}");
                let back = eval(&surface, wo, wi, 550.0);
                assert!((f - back).abs() <= 1e-6 * f.max(1e-6), "{wo:?}: {f} {back}");
                weights += f * wo[2] / pdf;
                count += 1;
            }
            // Metal and cover reflect part of the light. The rigorous theory also draws orders that the cover reflects
            // totally.
            let albedo = weights / SAMPLES as f64;
            assert!((0.2..1.0).contains(&albedo) && count > SAMPLES / 4, "{json}: {albedo} of {count}");
            // The density integrates to the fraction of samples that leave: midpoints of direction cosines x and y.
            const STEPS: i32 = 400;
            let mut sum = 0.0;
            for i in 0..STEPS * STEPS {
                let [x, y] = [i / STEPS, i % STEPS].map(|step| f64::from(2 * step + 1) / f64::from(STEPS) - 1.0);
                let z_squared = 1.0 - x * x - y * y;
                if z_squared > 0.0 {
                    let wo = [x, y, z_squared.sqrt()];
                    let area = 4.0 / f64::from(STEPS * STEPS);
                    sum += surface.eval_pdf(wi, wo, &[550.0], |_, _| {}) * area / wo[2];
                }
            }
            let fraction = count as f64 / SAMPLES as f64;
            // Four standard errors of the fraction of samples, and the midpoints' error at the horizon.
            assert!((sum - fraction).abs() < 4e-3, "{json}, {wi:?}: {sum} {fraction}");
        }
    }
}

#[test]
fn relative_sizes_are_the_relief_built_at_that_size() {
    let exact = |field: &sunbeam::height_field::HeightField| {
        let options = Options { coherence_length_um: 30.0, conserve_energy: false, ..Options::default() };
        Exact::new(field, &options, None)
    };
    // `sinusoid` takes the amplitude, half of the height.
    let (given, small) = (sinusoid(256, 2.0, 0.2).resized(0.6, 0.25), sinusoid(256, 1.2, 0.05));
    let (given, small) = (exact(&given), exact(&small));
    let json = r#"{"preset": "sinusoidal", "period": 2.0, "height": 0.4, "scale": 0.6, "depth": 0.25,
        "coherence_length": 30, "conserve_energy": false}"#;
    let surface = configured(json);
    let mut random = Random::new(11);
    for _ in 0..100 {
        let wi = random.direction();
        let nm = random.wavelength_nm();
        let Some(wo) = order(wi, (random.unit() * 3.0) as i32 - 1, 1.2, nm) else { continue };
        let (a, b) = (given.eval(wi, wo, nm), small.eval(wi, wo, nm));
        assert!((a - b).abs() <= 1e-6 * b, "{wi:?} {wo:?}: {a} {b}");
        let found = eval(&surface, wi, wo, nm);
        assert!((found - b).abs() <= TABLES * b + 1e-4, "{wi:?} {wo:?} {nm}: {found} {b}");
    }
}
