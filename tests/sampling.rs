//! `sample`, `eval` and `pdf` agree (model.md §5.3 and §5.4).

mod common;

use common::{Random, direction, preset, sinusoid, waves};
use sunbeam::bench::sampler::{sampler, sampler_row};
use sunbeam::height_field::{HeightField, Preset};
use sunbeam::reflectance::{Options, Surface, Vec3};
use sunbeam::table::{Model, Tiling};

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
        for (theta, phi, nm) in [(0.0, 0.0, 550.0), (55.0, 70.0, 420.0), (80.0, -160.0, 650.0), (85.0, 25.0, 530.0)] {
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

/// Samples of each incidence and wavelength: the 99.9th percentile has 10 above it.
const WEIGHTS: usize = 10_000;
/// Deviation of the weights over their mean, up to 75° and at 85°. What is left there are orders that leave along the
/// surface: within their width the obliquity factor and the energy scaling go from much to nothing, which leaves as wide
/// as several orders follow in part only.
const DEVIATION: f64 = 0.5;
const DEVIATION_85: f64 = 0.55;
/// The same at 85° of a scan that stands alone: its lattice is coarse, and a look-up reads 8 × 8 nodes of it, so that
/// leaves of fewer than 4 nodes, 6° of the hemisphere, would cost more than they save.
const DEVIATION_85_ALONE: f64 = 0.65;
/// 99.9th percentile over the mean.
const PERCENTILE: f64 = 10.0;
/// Largest weight over the mean. The bound that the uniform lobe sets is higher, but where orders are dim enough to come
/// near it they are drawn too seldom to matter.
const LARGEST: f64 = 20.0;

/// Holds the statistics of a surface against the limits, at 85° against a deviation of its own.
fn weighs_evenly(name: &str, surface: &Surface, deviation_85: f64) {
    for row in sampler(surface, WEIGHTS) {
        let deviation = if row.theta_deg > 80.0 { deviation_85 } else { DEVIATION };
        assert!(row.relative_std <= deviation, "{name}: {row:?}");
        assert!(row.p999_to_mean <= PERCENTILE, "{name}: {row:?}");
        assert!(row.max_to_mean <= LARGEST, "{name}: {row:?}");
    }
}

#[test]
fn gratings_are_weighed_evenly() {
    for name in [Preset::Blazed, Preset::Sinusoidal, Preset::Lamellar] {
        weighs_evenly(name.name(), &build(&preset(name), &Options::default()), DEVIATION_85);
    }
}

#[test]
fn large_tiles_are_weighed_evenly() {
    for name in [Preset::Cd, Preset::Elaphe, Preset::Xenopeltis] {
        weighs_evenly(name.name(), &build(&preset(name), &Options::default()), DEVIATION_85);
    }
}

#[test]
fn a_scan_that_stands_alone_is_weighed_evenly() {
    let options = Options { tiling: Tiling::Aperiodic, ..Options::default() };
    weighs_evenly("waves", &build(&waves(100, 100, 0.065, 0.065, 0.4), &options), DEVIATION_85_ALONE);
}

#[test]
fn weights_average_to_the_albedo() {
    for name in [Preset::Blazed, Preset::Sinusoidal, Preset::Lamellar] {
        let surface = build(&preset(name), &Options::default());
        for theta in [0.0, 30.0, 60.0, 75.0, 85.0] {
            let row = sampler_row(&surface, theta, 25.0, 530.0, 50_000);
            let albedo = surface.albedo(direction(theta, 25.0), 530.0).unwrap();
            let error = row.mean * row.relative_std / 50_000f64.sqrt();
            // Half a per mille for the tables.
            assert!((row.mean - albedo).abs() < STANDARD_ERRORS * error + 1e-3, "{} ± {error}: {albedo}", row.mean);
        }
    }
}

/// What is reflected is never drawn with next to no density: the weight stays bounded over the whole hemisphere, where
/// sampling alone would seldom look.
#[test]
fn the_density_is_positive_wherever_something_is_reflected() {
    for (name, surface) in surfaces() {
        let mut random = Random::new(12);
        for _ in 0..5000 {
            let (wi, wo, nm) = (random.direction(), random.direction(), random.wavelength_nm());
            let answer = surface.eval_pdf(wi, wo, nm);
            assert!(answer.pdf.is_finite() && answer.pdf > 0.0, "{name}: {answer:?}");
        }
    }
}
