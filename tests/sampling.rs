//! `sample`, `eval` and `pdf` agree (model.md §5.3 and §5.4).

mod common;

use common::{Random, direction, preset, sinusoid, waves};
use sunbeam::height_field::{HeightField, Preset};
use sunbeam::reflectance::{Options, Surface, Vec3};
use sunbeam::table::Model;

/// The least probability of a χ² as large as found: one test of 10⁴ fails by chance, were the seeds not fixed.
const SIGNIFICANCE: f64 = 1e-4;
/// Quotients of the same few numbers.
const ROUNDING: f64 = 1e-12;
/// Standard errors a Monte Carlo mean may lie off (6e-5 of all seeds).
const STANDARD_ERRORS: f64 = 4.0;
/// Bins along either direction cosine, and places in each along either axis where the density is read.
const BINS: usize = 40;
const PLACES: usize = 16;
/// Bins that reach beyond this radius count with the rest: the density over direction cosines has a pole at 1.
const RADIUS: f64 = 0.99;
const SAMPLES: usize = 200_000;
/// Bins with fewer expected samples are taken together.
const POOLED: f64 = 10.0;

fn build(field: &HeightField, options: &Options) -> Surface {
    Surface::new(field, options).unwrap()
}

/// Upper tail of the χ² distribution (Wilson and Hilferty).
fn chi_square_tail(chi_square: f64, freedom: f64) -> f64 {
    let z = ((chi_square / freedom).cbrt() - (1.0 - 2.0 / (9.0 * freedom))) / (2.0 / (9.0 * freedom)).sqrt();
    0.5 * libm::erfc(z / 2f64.sqrt())
}

/// Probability of the histogram of samples for `wavelengths` under the density for `claimed`.
fn agreement(surface: &Surface, wi: Vec3, wavelengths: &[f64], claimed: &[f64]) -> f64 {
    let width = 2.0 / BINS as f64;
    let inside = |bin: usize| {
        let far = |i: usize| (width * i as f64 - 1.0).abs().max((width * (i + 1) as f64 - 1.0).abs());
        far(bin % BINS).hypot(far(bin / BINS)) < RADIUS
    };
    let mut expected: Vec<f64> = (0..BINS * BINS)
        .map(|bin| {
            if !inside(bin) {
                return 0.0;
            }
            let mut sum = 0.0;
            for place in 0..PLACES * PLACES {
                let at = |bin: usize, place: usize| (bin as f64 + (place as f64 + 0.5) / PLACES as f64) * width - 1.0;
                let (x, y) = (at(bin % BINS, place % PLACES), at(bin / BINS, place / PLACES));
                let wo = [x, y, (1.0 - x * x - y * y).sqrt()];
                sum += surface.pdf(wi, wo, claimed) / wo[2];
            }
            sum * width * width / (PLACES * PLACES) as f64
        })
        .collect();
    // The last bin holds the rest, with the samples that fall below the horizon.
    expected.push(1.0 - expected.iter().sum::<f64>());
    assert!(expected[BINS * BINS] > -1e-3, "the density integrates to more than one: {}", expected[BINS * BINS]);
    let mut found = vec![0.0; BINS * BINS + 1];
    let mut random = Random::new(23);
    for _ in 0..SAMPLES {
        let bin = surface.sample_direction(wi, wavelengths, random.three()).map_or(BINS * BINS, |wo| {
            let index = |c: f64| (((c + 1.0) / width) as usize).min(BINS - 1);
            index(wo[1]) * BINS + index(wo[0])
        });
        found[if bin < BINS * BINS && inside(bin) { bin } else { BINS * BINS }] += 1.0;
    }
    let (mut chi_square, mut freedom, mut few) = (0.0, -1.0, (0.0, 0.0));
    let mut add = |expected: f64, found: f64| {
        chi_square += (found - expected).powi(2) / expected;
        freedom += 1.0;
    };
    for (expected, found) in expected.iter().map(|p| p * SAMPLES as f64).zip(found) {
        if expected >= POOLED {
            add(expected, found);
        } else {
            few = (few.0 + expected, few.1 + found);
        }
    }
    if few.0 >= POOLED {
        add(few.0, few.1);
    }
    chi_square_tail(chi_square, f64::max(freedom, 1.0))
}

fn surfaces() -> Vec<(&'static str, Surface)> {
    let options = |coherence_length_um, model| Options {
        coherence_length_um,
        model,
        conserve_energy: false,
        ..Options::default()
    };
    vec![
        ("blazed", build(&preset(Preset::Blazed), &options(15.0, Model::Ensemble))),
        ("sinusoidal", build(&sinusoid(128, 2.5, 0.125), &options(15.0, Model::Ensemble))),
        ("waves", build(&waves(48, 32, 0.12, 0.15, 0.5), &options(15.0, Model::Ensemble))),
        ("waves patch", build(&waves(48, 32, 0.12, 0.15, 0.5), &options(15.0, Model::Patch))),
        ("waves, small window", build(&waves(48, 32, 0.12, 0.15, 0.5), &options(3.0, Model::Ensemble))),
    ]
}

#[test]
fn directions_are_distributed_as_the_pdf_says() {
    for (name, surface) in surfaces() {
        for (theta, phi, nm) in [(0.0, 0.0, 550.0), (55.0, 70.0, 420.0), (80.0, -160.0, 650.0)] {
            let p = agreement(&surface, direction(theta, phi), &[nm], &[nm]);
            println!("{name} at {theta}°: p = {p:.4}");
            assert!(p > SIGNIFICANCE, "{name} at {theta}°: {p:e}");
        }
    }
}

#[test]
fn several_wavelengths_share_one_density() {
    let carried = [420.0, 500.0, 580.0, 660.0];
    for (name, surface) in &surfaces()[1..3] {
        let wi = direction(40.0, 20.0);
        let p = agreement(surface, wi, &carried, &carried);
        println!("{name}: p = {p:.4}");
        assert!(p > SIGNIFICANCE, "{name}: {p:e}");
        let mut random = Random::new(4);
        for _ in 0..1000 {
            let wo = random.direction();
            let mean = carried.iter().map(|&nm| surface.eval_pdf(wi, wo, nm).pdf).sum::<f64>() / 4.0;
            assert!((surface.pdf(wi, wo, &carried) - mean).abs() <= ROUNDING * mean);
        }
    }
}

#[test]
fn a_wrong_density_is_rejected() {
    let surface = &surfaces()[1].1;
    let p = agreement(surface, direction(40.0, 20.0), &[550.0], &[560.0]);
    assert!(p < 1e-9, "{p}");
}

#[test]
fn weight_times_density_is_the_reflectance() {
    for (name, surface) in surfaces() {
        let mut random = Random::new(9);
        for _ in 0..2000 {
            let (wi, nm) = (random.direction(), random.wavelength_nm());
            let carried = [nm, random.wavelength_nm(), random.wavelength_nm()];
            let Some(sample) = surface.sample(wi, &carried, random.three()) else { continue };
            let f = surface.eval_pdf(wi, sample.wo, nm).f * sample.wo[2];
            assert!((sample.weight * sample.pdf - f).abs() <= ROUNDING * f, "{name}");
            assert!((sample.pdf - surface.pdf(wi, sample.wo, &carried)).abs() <= ROUNDING * sample.pdf, "{name}");
            let length: f64 = sample.wo.iter().map(|c| c * c).sum();
            assert!((length - 1.0).abs() < ROUNDING && sample.wo[2] > 0.0);
        }
    }
}

#[test]
fn weights_average_to_the_albedo_and_stay_bounded() {
    for name in [Preset::Blazed, Preset::Sinusoidal, Preset::Lamellar, Preset::Elaphe, Preset::Xenopeltis] {
        let surface = build(&preset(name), &Options::default());
        let large = preset(name).size().1 > 1;
        for theta in [0.0, 30.0, 60.0, 75.0, 85.0] {
            let (wi, nm) = (direction(theta, 25.0), 530.0);
            let samples = if large { 20_000 } else { 50_000 };
            let (mut sum, mut squares, mut most) = (0.0, 0.0, 0.0f64);
            let mut random = Random::new(31);
            for _ in 0..samples {
                let weight = surface.sample(wi, &[nm], random.three()).map_or(0.0, |s| s.weight);
                sum += weight;
                squares += weight * weight;
                most = most.max(weight);
            }
            let mean = sum / samples as f64;
            let deviation = (squares / samples as f64 - mean * mean).max(0.0).sqrt();
            println!(
                "{name} at {theta}°: mean {mean:.4}, deviation/mean {:.2}, max/mean {:.1}",
                deviation / mean,
                most / mean
            );
            if !large {
                let albedo = surface.albedo(wi, nm).unwrap();
                let error = deviation / (samples as f64).sqrt();
                // Half a per mille for the tables.
                assert!((mean - albedo).abs() < STANDARD_ERRORS * error + 1e-3, "{mean} ± {error}: {albedo}");
            }
        }
    }
}
