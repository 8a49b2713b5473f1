//! The tables against the oracle, and the oracle against direct sums.

use super::common::{Random, built, oracle, preset, relief, table_error, waves};
use std::f64::consts::{PI, TAU};
use sunbeam::height_field::{HeightField, Preset};
use sunbeam::lobe::{Exact, Surface};
use sunbeam::scattering::Options;
use sunbeam::table::{Model, Tiling};
use sunbeam::transform::naive_order_amplitude;
use sunbeam_fourier::num_complex::Complex64;

/// Largest error as a multiple of the tolerance, which 99 of 100 look-ups keep.
const WORST: f64 = 10.0;
/// Error of sums of a few thousand terms of size one, relative to the largest value.
const BRUTE_FORCE: f64 = 1e-10;

/// Prints median, 99th percentile and maximum of the error over random look-ups, half of them at samples' directions.
/// Returns whether they are within the tolerance.
fn holds(name: &str, field: &HeightField, options: &Options, queries: usize) -> bool {
    let surface = built(field, &Options { conserve_energy: false, ..options.clone() });
    let exact = oracle(field, &surface);
    let mut random = Random::new(7);
    let mut errors = Vec::new();
    while errors.len() < queries {
        let (wi, nm) = (random.direction(), random.wavelength_nm());
        let drawn = if errors.len() % 2 == 0 {
            surface.sample_direction(wi, &[nm], [random.between(0.02, 1.0), random.unit(), random.unit()])
        } else {
            Some(random.direction())
        };
        if let Some(wo) = drawn {
            errors.push(table_error(&surface, &exact, wi, wo, nm));
        }
    }
    errors.sort_by(f64::total_cmp);
    let at = |share: f64| errors[((queries - 1) as f64 * share) as usize] / options.tolerance;
    let (median, percentile, most) = (at(0.5), at(0.99), at(1.0));
    let fine = percentile <= 1.0 && most <= WORST;
    let mark = if fine { "" } else { "  <-- beyond" };
    println!(
        "{name:34} tolerance {:.0e}: median {median:.1e} 99 % {percentile:.2} max {most:.2} of it, {:.2} s, \
         {:.1} MB{mark}",
        options.tolerance,
        surface.report().build_seconds,
        surface.report().bytes as f64 / 1e6
    );
    fine
}

fn with(model: Model, tiling: Tiling, coherence_length_um: f64, tolerance: f64) -> Options {
    Options { model, tiling, coherence_length_um, tolerance, ..Options::default() }
}

/// Tilings of a model; aperiodic ensembles have a test of their own.
fn tilings(model: Model) -> impl Iterator<Item = Tiling> {
    let alone = (model == Model::Patch).then_some(Tiling::Aperiodic);
    std::iter::once(Tiling::Periodic).chain(alone)
}

const MODELS: [Model; 2] = [Model::Ensemble, Model::Patch];

#[test]
fn gratings_are_within_the_tolerance() {
    let mut all = true;
    for name in [Preset::Flat, Preset::Blazed, Preset::Sinusoidal, Preset::Lamellar] {
        for model in MODELS {
            let options = with(model, Tiling::Periodic, 65.0, 1e-3);
            all &= holds(&format!("{name} {model:?}"), &preset(name), &options, 600);
        }
    }
    assert!(all);
}

#[test]
fn large_tiles_are_within_the_tolerance() {
    let mut all = true;
    for name in [Preset::Cd, Preset::Elaphe, Preset::Xenopeltis] {
        let field = preset(name);
        let options = with(Model::Ensemble, Tiling::Periodic, 65.0, 1e-3);
        all &= holds(&format!("{name} Ensemble"), &field, &options, 10);
    }
    let options = with(Model::Patch, Tiling::Periodic, 65.0, 1e-3);
    all &= holds("elaphe Patch", &preset(Preset::Elaphe), &options, 10);
    assert!(all);
}

#[test]
fn every_coherence_length_is_within_the_tolerance() {
    let mut all = true;
    let field = waves(24, 18, 0.065, 0.07, 0.5);
    for model in MODELS {
        for length in [1.0, 3.0, 10.0, 100.0, 1e3, 1e4] {
            for tiling in tilings(model) {
                let options = with(model, tiling, length, 1e-3);
                all &= holds(&format!("waves {model:?} {tiling:?} {length} µm"), &field, &options, 400);
            }
        }
    }
    assert!(all);
}

#[test]
fn aperiodic_patches_are_within_the_tolerance() {
    let field = waves(100, 100, 0.065, 0.065, 0.4);
    for length in [10.0, 65.0] {
        let options = with(Model::Patch, Tiling::Aperiodic, length, 1e-3);
        assert!(holds(&format!("scan Patch {length} µm"), &field, &options, 600));
    }
}

#[test]
fn aperiodic_ensembles_are_within_the_tolerance() {
    let mut all = true;
    let (scan, small) = (waves(100, 100, 0.065, 0.065, 0.4), waves(24, 18, 0.065, 0.07, 0.5));
    for length in [10.0, 65.0] {
        let options = with(Model::Ensemble, Tiling::Aperiodic, length, 1e-3);
        all &= holds(&format!("scan Ensemble {length} µm"), &scan, &options, 600);
    }
    for (length, tolerance) in [(1.0, 1e-3), (10.0, 1e-3), (1e4, 1e-3), (20.0, 1e-2), (20.0, 1e-4), (20.0, 1e-6)] {
        let options = with(Model::Ensemble, Tiling::Aperiodic, length, tolerance);
        all &= holds(&format!("waves Ensemble {length} µm"), &small, &options, 400);
    }
    assert!(all);
}

/// The spectrum of fine pixels reaches far beyond the frequencies of visible light, where the table cuts it off.
#[test]
fn fine_pixels_are_within_the_tolerance() {
    let mut all = true;
    let smooth = waves(180, 150, 0.018, 0.02, 0.5);
    let mut random = Random::new(3);
    let grain = smooth.heights_um().mapv(|height| height + random.between(-0.05, 0.05));
    let field = HeightField::new(grain, smooth.dx_um(), smooth.dy_um()).unwrap();
    for (length, tolerance) in [(3.0, 1e-2), (2.0, 1e-3), (20.0, 1e-3), (1e4, 1e-3), (20.0, 1e-5), (1e4, 1e-6)] {
        let alone = with(Model::Ensemble, Tiling::Aperiodic, length, tolerance);
        all &= holds(&format!("grain alone {length} µm"), &field, &alone, 150);
    }
    let repeated = with(Model::Ensemble, Tiling::Periodic, 1.0, 1e-3);
    all &= holds("grain repeated 1 µm", &field, &repeated, 400);
    assert!(all);
}

/// Coarse pixels have no spectrum beyond half of their rate, where the table is empty and its error undefined.
#[test]
fn stated_errors_of_coarse_pixels_are_within_the_tolerance() {
    let field = waves(40, 40, 0.13, 0.13, 0.5);
    for model in MODELS {
        let options = Options { conserve_energy: false, ..with(model, Tiling::Aperiodic, 20.0, 1e-3) };
        let surface = Surface::new(&field, &options).unwrap();
        let stated = surface.report().table.relative_error;
        assert!(stated <= options.tolerance, "{model:?}: {stated}");
    }
}

#[test]
fn every_tolerance_is_met() {
    let mut all = true;
    let field = waves(24, 18, 0.065, 0.07, 0.5);
    for model in MODELS {
        for tiling in tilings(model) {
            for tolerance in [1e-2, 1e-3, 1e-4, 1e-5, 1e-6] {
                let options = with(model, tiling, 20.0, tolerance);
                all &= holds(&format!("waves {model:?} {tiling:?}"), &field, &options, 400);
            }
        }
    }
    assert!(all);
}

#[test]
fn the_periodic_oracle_is_the_sum_over_orders() {
    let field = relief(7, 5, 0.3, 0.4, 0.5);
    let (lx, ly) = field.extent_um();
    let mut random = Random::new(11);
    for model in MODELS {
        let options = with(model, Tiling::Periodic, 8.0, 1e-3);
        let s = options.coherence_length_um / 4.0;
        let exact = Exact::new(&field, &options, None);
        for _ in 0..40 {
            let (f, kappa) = ([random.between(-1.6, 1.6), random.between(-1.2, 1.2)], random.between(0.0, 34.0));
            let (mut power, mut amplitude) = (0.0, Complex64::ZERO);
            for jy in -2..=2i64 {
                for jx in -3..=3i64 {
                    let c = naive_order_amplitude(&field, kappa, jx, jy);
                    let d2 = (f[0] - jx as f64 / lx).powi(2) + (f[1] - jy as f64 / ly).powi(2);
                    power += c.norm_sqr() * 4.0 * PI * s * s * (-4.0 * PI * PI * s * s * d2).exp();
                    amplitude += c * TAU * s * s * (-2.0 * PI * PI * s * s * d2).exp();
                }
            }
            let expected = if model == Model::Ensemble { power } else { amplitude.norm_sqr() / (PI * s * s) };
            let found = exact.power_density(f, kappa);
            assert!((found - expected).abs() <= BRUTE_FORCE * s * s, "{model:?}: {found} {expected}");
        }
    }
}

/// The raised cosine over a quarter of each edge, by which model and documentation taper an aperiodic scan.
fn edge(i: usize, n: usize) -> f64 {
    let t = (i.min(n - 1 - i) as f64 + 0.5) / n as f64;
    if t < 0.25 { (0.5 * PI * t / 0.25).sin().powi(2) } else { 1.0 }
}

#[test]
fn the_aperiodic_oracle_is_the_sum_over_pixels() {
    let (nx, ny, dx, dy) = (9, 7, 0.3, 0.2);
    let field = relief(nx, ny, dx, dy, 0.5);
    let mut random = Random::new(13);
    let pixels: Vec<_> = (0..nx * ny)
        .map(|i| {
            let (ix, iy) = (i % nx, i / nx);
            let at = [(ix as f64 - 4.0) * dx, (iy as f64 - 3.0) * dy];
            (at, edge(ix, nx) * edge(iy, ny), field.heights_um()[[iy, ix]])
        })
        .collect();
    for model in MODELS {
        let options = with(model, Tiling::Aperiodic, 6.0, 1e-3);
        let s = options.coherence_length_um / 4.0;
        let exact = Exact::new(&field, &options, None);
        for _ in 0..20 {
            let (f, kappa) = ([random.between(-1.6, 1.6), random.between(-2.5, 2.5)], random.between(0.0, 34.0));
            let wave = |at: [f64; 2], h: f64| Complex64::cis(kappa * h + TAU * (f[0] * at[0] + f[1] * at[1]));
            let squared = |a: [f64; 2], b: [f64; 2]| (a[0] - b[0]).powi(2) + (a[1] - b[1]).powi(2);
            let expected = dx
                * dy
                * match model {
                    Model::Ensemble => {
                        let mut sum = 0.0;
                        for &(a, ta, ha) in &pixels {
                            for &(b, tb, hb) in &pixels {
                                let window = (-squared(a, b) / (4.0 * s * s)).exp();
                                sum += ta * tb * window * (wave(a, ha) * wave(b, hb).conj()).re;
                            }
                        }
                        sum / pixels.iter().map(|p| p.1 * p.1).sum::<f64>()
                    }
                    Model::Patch => {
                        let window = |p: &([f64; 2], f64, f64)| p.1 * (-squared(p.0, [0.0; 2]) / (2.0 * s * s)).exp();
                        let sum: Complex64 = pixels.iter().map(|p| wave(p.0, p.2) * window(p)).sum();
                        sum.norm_sqr() / pixels.iter().map(|p| window(p).powi(2)).sum::<f64>()
                    }
                };
            let found = exact.power_density(f, kappa);
            assert!((found - expected).abs() <= BRUTE_FORCE, "{model:?}: {found} {expected}");
        }
    }
}

#[test]
fn the_density_integrates_to_one() {
    let field = relief(7, 5, 0.3, 0.4, 0.5);
    let (lx, ly) = field.extent_um();
    for (model, tiling, length) in [
        (Model::Ensemble, Tiling::Periodic, 8.0),
        // The window is twice the tile, so that orders of a patch do not overlap: e^{−π²·2²}.
        (Model::Patch, Tiling::Periodic, 8.0 * lx.max(ly)),
        (Model::Ensemble, Tiling::Aperiodic, 8.0),
        (Model::Patch, Tiling::Aperiodic, 8.0),
    ] {
        let exact = Exact::new(&field, &with(model, tiling, length, 1e-3), None);
        let half = |n: f64, extent: f64| match tiling {
            // The range covers all orders and seven standard deviations.
            Tiling::Periodic => 0.5 * n / extent + 7.0 * 4.0 / (8f64.sqrt() * PI * length),
            // The range is one period of the sum over pixels.
            Tiling::Aperiodic => 0.5 * n / extent,
        };
        let (fx, fy) = (half(7.0, lx), half(5.0, ly));
        // Uniform steps are exact for smooth functions that are periodic or decay.
        const STEPS: usize = 400;
        for kappa in [0.0, 9.0, 34.0] {
            let mut sum = 0.0;
            for iy in 0..STEPS {
                for ix in 0..STEPS {
                    let at = |i: usize, half: f64| half * (2.0 * (i as f64 + 0.5) / STEPS as f64 - 1.0);
                    sum += exact.power_density([at(ix, fx), at(iy, fy)], kappa);
                }
            }
            let integral = sum * 4.0 * fx * fy / (STEPS * STEPS) as f64;
            assert!((integral - 1.0).abs() < 1e-9, "{model:?} {tiling:?} κ {kappa}: {integral}");
        }
    }
}
