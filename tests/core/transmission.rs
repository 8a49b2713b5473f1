//! Transparent bodies: reflection and transmission against closed forms and the direct sum, energy, and samples.

use super::common::{Random, bessel, colour_differences, configured, direction, eval, relief, sinusoid, waves};
use std::f64::consts::{PI, TAU};
use sunbeam::colour::SpectralToRgb;
use sunbeam::config::BuiltSurface;
use sunbeam::height_field::HeightField;
use sunbeam::lobe::{ColourSurface, Exact, LinearSrgb, Lobe, Surface, TransmissiveLobe};
use sunbeam::scattering::{ComplexIndex, Options, RelativeSize, SizeRange, TransparentBody, Vec3, fresnel_unpolarised};
use sunbeam::table::Tiling;

/// Relative error of tables built to 1e-3, at the peaks of orders.
const TABLES: f64 = 2e-3;

/// Options of a transparent body and its relief, magnified as tables take it.
fn magnified(field: &HeightField, body: TransparentBody, options: Options) -> (HeightField, Options) {
    let coherence_length_um = options.coherence_length_um * body.eta;
    (field.resized(body.eta, body.eta), Options { coherence_length_um, body: Some(body), ..options })
}

/// The direction with the tangential wave vector `k` (over that in vacuum) on one side; `None` beyond the horizon.
fn leaving(body: TransparentBody, k: [f64; 2], is_below: bool) -> Option<Vec3> {
    let length = medium(body, is_below);
    let [x, y] = k.map(|k| k / length);
    let z_squared = 1.0 - x * x - y * y;
    (z_squared > 1e-3).then(|| [x, y, if is_below { -z_squared.sqrt() } else { z_squared.sqrt() }])
}

/// Index of the medium that directions on a side are in.
pub(super) fn medium(body: TransparentBody, is_below: bool) -> f64 {
    if is_below && !body.is_film { body.eta } else { 1.0 }
}

/// Tangential wave vector of a direction, over that in vacuum.
fn tangential(body: TransparentBody, w: Vec3) -> [f64; 2] {
    [w[0], w[1]].map(|c| c * medium(body, w[2] < 0.0))
}

#[test]
fn transmitted_orders_of_a_sinusoid_follow_the_closed_form() {
    // c_m of a sinusoid is J_m(κh/2) up to a phase, with κ = 2π(cn − c1)/λ. Fresnel's transmittance is the factor of
    // the refracted order, so ratios of orders 0 at two depths are free of other factors.
    let (d_um, coherence_um, eta) = (2.5, 40.0, 1.5);
    let surface = |height: f64| {
        configured(&format!(
            r#"{{"preset": "sinusoidal", "period": {d_um}, "height": {height}, "coherence_length": {coherence_um},
                "conserve_energy": false, "eta": {eta}, "transmission": "film"}}"#
        ))
    };
    let deep = surface(0.4);
    for (theta, phi) in [(0.0, 0.0), (30.0, 0.0), (50.0, 60.0)] {
        for wi in [direction(theta, phi), direction(theta, phi).map(|c| -c)] {
            for nm in [420.0, 550.0, 680.0] {
                let wo = wi.map(|c| -c);
                let sin_squared = 1.0 - wi[2] * wi[2];
                let kappa = TAU * ((eta * eta - sin_squared).sqrt() - wi[2].abs()) / (nm * 1e-3);
                let amplitude = bessel(0, 0.5 * kappa * 0.4);
                let s = coherence_um / 4.0;
                let spectrum = 4.0 * PI * s * s * amplitude * amplitude / (nm * 1e-3).powi(2);
                let passed = {
                    let cos_in = (1.0 - sin_squared / (eta * eta)).sqrt();
                    let (c, n) = (wi[2].abs(), eta * cos_in);
                    let s_state = 4.0 * c * n / (c + n).powi(2);
                    let p_state = 4.0 * eta * eta * c * n / (eta * eta * c + n).powi(2);
                    0.5 * (s_state * s_state + p_state * p_state)
                };
                let found = eval(&deep, wi, wo, nm);
                let expected = passed * spectrum;
                assert!((found / expected - 1.0).abs() < TABLES, "{wi:?} {nm}: {found} {expected}");
            }
        }
    }
}

#[test]
fn tables_match_the_direct_sum_on_both_sides() {
    let mut random = Random::new(5);
    let skin = waves(40, 36, 0.1, 0.1, 0.5);
    let mut blaze = sinusoid(200, 2.0, 0.15);
    blaze = HeightField::new(blaze.heights_um().mapv(|h| h + 0.3 * h * h), blaze.dx_um(), blaze.dy_um()).unwrap();
    for (field, tiling) in [(&blaze, Tiling::Periodic), (&skin, Tiling::Periodic), (&skin, Tiling::Aperiodic)] {
        for body in [TransparentBody::new(1.5, true, 15.0), TransparentBody::new(1.33, false, 15.0)] {
            let options = Options { coherence_length_um: 15.0, tiling, ..Options::default() };
            let (field, options) = magnified(field, body, options);
            let surface = Surface::new(&field, &options).unwrap();
            let exact = Exact::new(&field, &options, surface.albedo_table().cloned());
            // Values are compared with the largest of each way of light.
            let mut pairs = [const { Vec::new() }; 4];
            for _ in 0..500 {
                let mut side = || {
                    let w = random.direction();
                    if random.unit() < 0.5 { w } else { w.map(|c| -c) }
                };
                let (wi, wo) = (side(), side());
                let nm = random.wavelength_nm();
                let (found, expected) = (surface.eval(wi, wo, nm), exact.eval(wi, wo, nm));
                pairs[usize::from(wi[2] < 0.0) + 2 * usize::from(wo[2] < 0.0)].push((found, expected, wi, wo));
            }
            for pairs in pairs {
                let largest = pairs.iter().fold(0f64, |largest, pair| largest.max(pair.1));
                for (found, expected, wi, wo) in pairs {
                    // Interpolation errs relative to S; far from all orders values are small.
                    let off = (found - expected).abs();
                    assert!(off < 0.02 * expected + 1e-3 * largest, "{body:?} {wi:?} {wo:?}: {found} {expected}");
                }
            }
        }
    }
}

#[test]
fn a_flat_relief_divides_light_as_fresnel_does() {
    let eta = 1.5;
    for transmission in ["film", "interface"] {
        let surface = configured(&format!(
            r#"{{"preset": "flat", "coherence_length": 400, "eta": {eta}, "transmission": "{transmission}"}}"#
        ));
        let body = TransparentBody::new(eta, transmission == "film", 20.0);
        for theta in [0.0, 30.0, 60.0] {
            for is_below in [false, true] {
                let mut wi = direction(theta, 20.0);
                if is_below {
                    wi[2] = -wi[2];
                }
                let k = tangential(body, wi);
                // An order is a Gaussian in frequency with the variance 1/(8π²s²), over d²K = n² cosθ dω.
                let power = |wo: Vec3| {
                    let index = medium(body, wo[2] < 0.0);
                    eval(&surface, wi, wo, 550.0) / (index * index) * 0.55f64.powi(2) / (4.0 * PI * 100.0 * 100.0)
                };
                let mirrored = power([-wi[0], -wi[1], wi[2]]);
                let passed = leaving(body, [-k[0], -k[1]], !is_below).map_or(0.0, power);
                let from = medium(body, is_below);
                let relative = if from > 1.0 { 1.0 / eta } else { eta };
                let once = fresnel_unpolarised(wi[2].abs(), ComplexIndex { eta: relative, k: 0.0 });
                // Reflectances of both states at a boundary between air and the medium.
                let states = {
                    let (c, n) = (wi[2].abs(), (eta * eta - k[0] * k[0] - k[1] * k[1]).sqrt());
                    [(c - n) / (c + n), (eta * eta * c - n) / (eta * eta * c + n)].map(|r| r * r)
                };
                let mean = |of: fn(f64) -> f64| 0.5 * (of(states[0]) + of(states[1]));
                let (reflected, through) = match (body.is_film, is_below) {
                    (false, _) => (once, 1.0 - once),
                    (true, false) => (once, mean(|r| (1.0 - r) * (1.0 - r))),
                    // Light passes the flat side before and after.
                    (true, true) => (mean(|r| r * (1.0 - r) * (1.0 - r)), mean(|r| (1.0 - r) * (1.0 - r))),
                };
                assert!((mirrored - reflected).abs() < TABLES, "{transmission} {wi:?}: {mirrored} {reflected}");
                assert!((passed - through).abs() < TABLES, "{transmission} {wi:?}: {passed} {through}");
            }
        }
    }
}

/// Mean weight of samples, which is the albedo of both sides together, its standard error, and the largest relative
/// difference from reciprocity.
pub(super) fn sampled(
    surface: &BuiltSurface,
    body: TransparentBody,
    wi: Vec3,
    nm: f64,
    random: &mut Random,
) -> (f64, f64, f64) {
    const SAMPLES: usize = 8_000;
    let (mut sum, mut squares, mut unequal) = (0.0, 0.0, 0f64);
    for _ in 0..SAMPLES {
        let u = [random.unit(), random.unit(), random.unit()];
        let Some(wo) = surface.sample_direction(wi, &[nm], u) else { continue };
        let mut f = 0.0;
        let pdf = surface.eval_pdf(wi, wo, &[nm], |_, value| f = value);
        assert!(pdf > 0.0 && f >= 0.0 && f.is_finite(), "{wi:?} {wo:?}: {f} {pdf}");
        let weight = f * wo[2].abs() / pdf;
        sum += weight;
        squares += weight * weight;
        let [of_wi, of_wo] = [wi, wo].map(|w| medium(body, w[2] < 0.0).powi(2));
        let back = eval(surface, wo, wi, nm) * of_wo / of_wi;
        unequal = unequal.max((f - back).abs() / f.max(1e-6));
    }
    let mean = sum / SAMPLES as f64;
    (mean, ((squares / SAMPLES as f64 - mean * mean) / SAMPLES as f64).sqrt(), unequal)
}

#[test]
fn bodies_conserve_energy_and_are_reciprocal() {
    let mut random = Random::new(9);
    let mut largest = 0f64;
    for (json, eta) in [
        (r#""preset": "blazed", "coherence_length": 20"#, 1.5),
        (r#""preset": "sinusoidal", "period": 0.8, "height": 0.5, "coherence_length": 20"#, 1.8),
        (r#""preset": "lamellar", "period": 1.2, "height": 0.6, "coherence_length": 20"#, 1.5),
        (r#""preset": "xenopeltis", "coherence_length": 20"#, 1.56),
    ] {
        for transmission in ["film", "interface"] {
            let json = format!(r#"{{{json}, "eta": {eta}, "transmission": "{transmission}"}}"#);
            let surface = configured(&json);
            let body = TransparentBody::new(eta, transmission == "film", 20.0);
            for theta in [0.0, 35.0, 65.0, 85.0] {
                for side in [1.0, -1.0] {
                    let mut wi = direction(theta, 30.0);
                    wi[2] *= side;
                    let (albedo, error, unequal) = sampled(&surface, body, wi, 550.0, &mut random);
                    println!("{json} {theta} {side}: {albedo:.3} ± {error:.3}");
                    largest = largest.max(albedo - 4.0 * error);
                    // Energy between nodes of the table, and noise.
                    assert!(albedo < 1.01 + 4.0 * error, "{json} {wi:?}: {albedo} ± {error}");
                    assert!(unequal < 1e-6, "{json} {wi:?}: {unequal}");
                }
            }
        }
    }
    assert!(largest > 0.85, "{largest}");
}

/// Asserts that the density of samples from `wi` integrates, on either side, to the fraction of samples that leave
/// there, within `tolerance`.
pub(super) fn assert_density_integrates(
    surface: &BuiltSurface,
    wi: Vec3,
    samples: usize,
    tolerance: f64,
    random: &mut Random,
) {
    let mut counts = [0usize; 2];
    for _ in 0..samples {
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
        let fraction = count as f64 / samples as f64;
        assert!((sum - fraction).abs() < tolerance, "{wi:?} {side}: {sum} {fraction}");
    }
}

#[test]
fn densities_integrate_to_the_fraction_of_samples() {
    const SAMPLES: usize = 40_000;
    let mut random = Random::new(13);
    for (preset, transmission) in [("blazed", "film"), ("blazed", "interface"), ("xenopeltis", "interface")] {
        let surface = configured(&format!(
            r#"{{"preset": "{preset}", "coherence_length": 8, "eta": 1.5, "transmission": "{transmission}",
                "conserve_energy": false}}"#
        ));
        for wi in [direction(0.0, 0.0), direction(40.0, 30.0).map(|c| -c), direction(70.0, 100.0)] {
            // Four standard errors of the fraction of samples, and the midpoints' error at the horizon.
            assert_density_integrates(&surface, wi, SAMPLES, 0.01, &mut random);
        }
    }
}

#[test]
fn colours_are_those_of_the_spectrum() {
    let mut random = Random::new(17);
    let field = sinusoid(100, 2.0, 0.15);
    let body = TransparentBody::new(1.5, true, 6.0);
    let options = Options { coherence_length_um: 6.0, ..Options::default() };
    let (field, options) = magnified(&field, body, options);
    let colours = ColourSurface::new(&field, &options, None).unwrap();
    let lobe = colours.transmissive_lobe_over::<sunbeam::numeric::Plain<f64>>(colours.words(), None).unwrap();
    let surface = Surface::new(&field, &options).unwrap();
    let to_rgb = SpectralToRgb::visible(2.0).unwrap();
    for is_below in [false, true] {
        let pairs: Vec<_> = (0..400)
            .map(|_| {
                let (wi, wo) = (random.direction(), random.direction());
                let wo = if is_below { wo.map(|c| -c) } else { wo };
                (to_rgb.rgb_of(|nm| surface.eval(wi, wo, nm)), lobe.eval(wi, wo, LinearSrgb, true))
            })
            .collect();
        // The tolerance of colour tables (tests/core/colour_table.rs).
        let errors = colour_differences(&pairs);
        let (median, most) = (errors[errors.len() / 2], errors[errors.len() * 99 / 100]);
        assert!(median < 0.1 && most < 1.0, "{is_below}: {median} {most}");
    }
}

/// 200,000 queries of random reliefs, bodies and relative sizes, a fifth of them near the horizon; and albedos of
/// both sides together, as mean weights of samples.
#[test]
fn random_queries_are_finite_and_no_light_is_made() {
    const SURFACES: usize = 20;
    const QUERIES: usize = 10_000;
    const SAMPLES: usize = 4_000;
    let mut largest = 0f64;
    let mut random = Random::new(19);
    for i in 0..SURFACES {
        let height_um = 0.01 * 500f64.powf(random.unit());
        let field = match i % 3 {
            0 => relief(24, 20, 0.1, 0.12, height_um),
            1 => waves(40, 1, 0.05, 0.05, height_um),
            _ => sinusoid(64, random.between(0.3, 4.0), 0.5 * height_um),
        };
        let eta = [1.0, 1.2, 1.3, 1.5, 2.4][i % 5];
        let coherence_length_um = random.between(2.0, 30.0);
        let body = TransparentBody::new(eta, random.unit() < 0.5, coherence_length_um);
        let sizes = SizeRange { scale: [0.5, 1.0], depth: [0.3, 1.0] };
        let sizes = (i % 4 == 0).then_some(sizes);
        let options = Options { coherence_length_um, tolerance: 1e-2, sizes, ..Options::default() };
        let (magnified, options) = magnified(&field, body, options);
        let surface = Surface::new(&magnified, &options).unwrap();
        for _ in 0..QUERIES {
            let mut side = || {
                let mut w = random.direction();
                if random.unit() < 0.2 {
                    w[2] *= 1e-6;
                    let length = w.iter().map(|c| c * c).sum::<f64>().sqrt();
                    w = w.map(|c| c / length);
                }
                if random.unit() < 0.5 { w } else { w.map(|c| -c) }
            };
            let (wi, wo) = (side(), side());
            let nm = random.wavelength_nm();
            let ([f], pdf) = match sizes {
                None => {
                    let answer = surface.eval_pdf(wi, wo, nm);
                    ([answer.f], answer.pdf)
                }
                Some(_) => {
                    let size = RelativeSize { scale: random.between(0.5, 1.0), depth: random.between(0.3, 1.0) };
                    let relief = surface.lobe_of_size::<f64>(size);
                    TransmissiveLobe { body, relief }.eval_pdf(wi, wo, [nm], true)
                }
            };
            assert!(f.is_finite() && f >= 0.0 && pdf.is_finite() && pdf >= 0.0, "{body:?} {wi:?} {wo:?}: {f} {pdf}");
        }
        // Wavelengths beyond the tables' range scatter nothing.
        assert_eq!(surface.eval(direction(10.0, 0.0), direction(10.0, 180.0), 900.0), 0.0);
        for _ in 0..6 {
            let wi = if random.unit() < 0.5 { random.direction() } else { random.direction().map(|c| -c) };
            let nm = random.wavelength_nm();
            let mut weight = || surface.sample(wi, &[nm], random.three()).map_or(0.0, |sample| sample.weight);
            let weights: Vec<f64> = (0..SAMPLES).map(|_| weight()).collect();
            let mean = weights.iter().sum::<f64>() / SAMPLES as f64;
            let variance = weights.iter().map(|weight| (weight - mean).powi(2)).sum::<f64>() / SAMPLES as f64;
            let bound = mean - 4.0 * (variance / SAMPLES as f64).sqrt();
            // Near the horizon an index of 1 is not limited (docs/model.md#bodies-that-transmit).
            if eta > 1.0 || wi[2].abs() > 0.25 {
                largest = largest.max(bound);
            }
            println!("{body:?} {height_um:.2} µm {wi:?} {nm:.0}: {mean:.3}, {:.2}", variance.sqrt());
        }
    }
    // The excess that is accepted between nodes of the table, and the tolerance of the tables.
    assert!((0.8..1.02).contains(&largest), "{largest}");
}
