//! The hard cases of docs/model.md#hard-cases: for all directions, wavelengths and height fields, answers are finite,
//! not negative, reciprocal, and equal to the oracle's. Sweeps and random queries are in `stability.rs`.

use super::common::{Random, built, direction, oracle, preset, relief, sinusoid, table_error, waves};
use ndarray::Array2;
use sunbeam::height_field::{HeightField, Preset};
use sunbeam::scattering::{Options, Vec3};
use sunbeam::table::{Model, Tiling};

/// Relative difference of reciprocal look-ups, whose arguments are sums of both directions: rounding.
const RECIPROCITY: f64 = 1e-9;
/// Largest error of a single look-up as a multiple of the tolerance, which 99 of 100 keep.
const WORST: f64 = 10.0;

fn field(heights: Array2<f64>, dx_um: f64, dy_um: f64) -> HeightField {
    HeightField::new(heights, dx_um, dy_um).unwrap()
}

/// Pairs of directions that are hard for every surface.
fn pairs() -> Vec<(Vec3, Vec3)> {
    let mut pairs = vec![([0.0, 0.0, 1.0], [0.0, 0.0, 1.0])];
    for theta in [10.0, 60.0, 89.0, 89.9, 89.99] {
        for phi in [0.0, 35.0, 90.0] {
            let wi = direction(theta, phi);
            // Mirror direction, retro-reflection, across the plane of incidence, and grazing with normal.
            pairs.push((wi, direction(theta, phi + 180.0)));
            pairs.push((wi, wi));
            pairs.push((wi, direction(theta, phi + 90.0)));
            pairs.push((wi, [0.0, 0.0, 1.0]));
            pairs.push((wi, direction(89.99, phi + 170.0)));
        }
    }
    // w → 0, far below the cosines that a renderer meets.
    for cos in [1e-6, 1e-9, 1e-300] {
        let level = |x: f64| [x, 0.0, cos];
        pairs.push((level(1.0), level(-1.0)));
        pairs.push((level(1.0), level(1.0)));
        pairs.push((level(1.0), direction(30.0, 0.0)));
    }
    pairs
}

/// Exact directions of the first orders along x, and of an order at the horizon to rounding.
fn order_pairs(field: &HeightField, nm: f64) -> Vec<(Vec3, Vec3)> {
    let step = nm * 1e-3 / field.extent_um().0;
    let mut pairs = Vec::new();
    for (theta, j) in [(0.0, 1.0), (0.0, -2.0), (40.0, 1.0), (75.0, 2.0), (89.9, 1.0)] {
        let wi = direction(theta, 180.0);
        let x: f64 = step * j - wi[0];
        if x.abs() < 1.0 {
            pairs.push((wi, [x, 0.0, (1.0 - x * x).sqrt()]));
        }
    }
    // An order that leaves along the surface: wi.x = λj/L − 1.
    let j = (1.0 / step).ceil();
    let x = step * j - 1.0;
    if x < 1.0 {
        pairs.push(([x, 0.0, (1.0 - x * x).sqrt()], [1.0, 0.0, 1e-8]));
    }
    pairs
}

/// Checks one surface on all hard pairs, random pairs and samples.
fn stands(name: &str, field: &HeightField, options: &Options) {
    let surface = built(field, options);
    let exact = oracle(field, &surface);
    let mut random = Random::new(1);
    let mut worst = (0.0, ([0.0; 3], [0.0; 3], 0.0));
    for nm in [360.0, 550.0, 830.0] {
        let mut asked = pairs();
        asked.extend(order_pairs(field, nm));
        for _ in 0..20 {
            let wi = random.direction();
            asked.push((wi, random.direction()));
            asked.extend(surface.sample_direction(wi, &[nm], random.three()).map(|wo| (wi, wo)));
        }
        for (wi, wo) in asked {
            let (there, back) = (surface.eval_pdf(wi, wo, nm), surface.eval_pdf(wo, wi, nm));
            let context = || format!("{name}: {wi:?} {wo:?} {nm} nm: {there:?} {back:?}");
            assert!(there.f.is_finite() && there.f >= 0.0, "{}", context());
            assert!(there.pdf.is_finite() && there.pdf > 0.0, "{}", context());
            assert!((there.f - back.f).abs() <= RECIPROCITY * there.f.max(back.f), "{}", context());
            let truth = exact.eval(wi, wo, nm);
            assert!(truth.is_finite() && truth >= 0.0, "{}: {truth}", context());
            if let Some(sample) = surface.sample(wi, &[nm], random.three()) {
                assert!(sample.weight.is_finite() && sample.weight >= 0.0 && sample.pdf > 0.0, "{}", context());
                assert!(sample.wo.iter().all(|c| c.is_finite()) && sample.wo[2] > 0.0, "{}", context());
            }
            if wi[2].min(wo[2]) > 1e-7 {
                let error = table_error(&surface, &exact, wi, wo, nm) / options.tolerance;
                if error > worst.0 {
                    worst = (error, (wi, wo, nm));
                }
            }
        }
    }
    println!("{name}: worst error {:.2} of the tolerance, at {:?}", worst.0, worst.1);
    assert!(worst.0 <= WORST, "{name}: {worst:?}");
}

fn both(name: &str, field: &HeightField, options: &Options) {
    for model in [Model::Ensemble, Model::Patch] {
        // Patches are divided by the albedo of their ensemble, which takes longest to build; `gratings` and aperiodic
        // reliefs cover it.
        let conserve_energy = options.conserve_energy && model == Model::Ensemble;
        stands(&format!("{name} {model:?}"), field, &Options { model, conserve_energy, ..options.clone() });
    }
}

#[test]
fn flat_fields_one_pixel_and_one_column() {
    both("flat preset", &preset(Preset::Flat), &Options::default());
    let plain = Options { conserve_energy: false, ..Options::default() };
    both("flat 6×4", &field(Array2::from_elem((4, 6), 3.0), 0.5, 0.25), &plain);
    both("one column", &field(relief(11, 1, 0.2, 0.2, 0.3).heights_um().t().to_owned(), 2.0, 0.2), &plain);
    let alone = Options { tiling: Tiling::Aperiodic, model: Model::Patch, ..Options::default() };
    let alone = Options { conserve_energy: false, ..alone };
    stands("one pixel alone", &field(Array2::zeros((1, 1)), 0.065, 0.065), &alone);
}

#[test]
fn gratings() {
    for name in [Preset::Blazed, Preset::Sinusoidal, Preset::Lamellar] {
        for model in [Model::Ensemble, Model::Patch] {
            let options = Options { model, conserve_energy: true, ..Options::default() };
            stands(&format!("{name} {model:?}"), &preset(name), &options);
        }
    }
}

#[test]
fn prime_sizes_and_pixels_that_are_not_square() {
    both("rough 17×13", &relief(17, 13, 0.11, 0.23, 0.4), &Options::default());
    let alone = Options { tiling: Tiling::Aperiodic, model: Model::Patch, ..Options::default() };
    stands("rough 17×13 alone", &relief(17, 13, 0.065, 0.075, 0.4), &alone);
}

#[test]
fn deep_relief() {
    // κH = 200 at 360 nm along the normal.
    let amplitude = 200.0 / (4.0 * std::f64::consts::PI / 0.36);
    both("deep", &sinusoid(64, 2.5, amplitude), &Options::default());
}

#[test]
fn heights_a_millimetre_up_give_the_same_values() {
    let near = waves(16, 12, 0.2, 0.2, 0.4);
    let far = field(near.heights_um() + 1000.0, 0.2, 0.2);
    both("1 mm up", &far, &Options::default());
    let (a, b) = (built(&near, &Options::default()), built(&far, &Options::default()));
    let mut random = Random::new(2);
    for _ in 0..1000 {
        let (wi, nm) = (random.direction(), random.wavelength_nm());
        let Some(wo) = a.sample_direction(wi, &[nm], random.three()) else { continue };
        let (near, far) = (a.eval_pdf(wi, wo, nm).f, b.eval_pdf(wi, wo, nm).f);
        // Heights at 1 mm have a spacing of 1.1e-13 µm, below the tables' single precision of 6e-8. Sums over nodes of
        // both signs and the knots' spacing magnify the difference slightly.
        assert!((near - far).abs() <= 1e-5 * near.max(1e-3), "{near} {far}");
    }
}

#[test]
fn a_step_edge() {
    let step = Array2::from_shape_fn((8, 16), |(_, ix)| if ix < 5 { 0.0 } else { 1.7 });
    let plain = Options { conserve_energy: false, ..Options::default() };
    both("step", &field(step.clone(), 0.3, 0.3), &plain);
    let alone = Options { tiling: Tiling::Aperiodic, model: Model::Patch, ..Options::default() };
    stands("step alone", &field(step, 0.065, 0.065), &alone);
}

#[test]
fn ensembles_that_do_not_repeat() {
    let alone = Options { tiling: Tiling::Aperiodic, conserve_energy: false, ..Options::default() };
    let step = Array2::from_shape_fn((8, 16), |(_, ix)| if ix < 5 { 0.0 } else { 1.7 });
    stands("one pixel alone", &field(Array2::zeros((1, 1)), 0.065, 0.065), &alone);
    stands("step alone", &field(step, 0.065, 0.065), &alone);
    for coherence_length_um in [1.0, 30.0, 1e4] {
        let options = Options { coherence_length_um, ..alone.clone() };
        stands(&format!("{coherence_length_um} µm alone"), &waves(16, 12, 0.065, 0.07, 0.4), &options);
    }
}

#[test]
fn coherence_from_1_um_to_10_mm() {
    for coherence_length_um in [1.0, 30.0, 1e3, 1e4] {
        for tiling in [Tiling::Periodic, Tiling::Aperiodic] {
            let options = Options { coherence_length_um, tiling, conserve_energy: false, ..Options::default() };
            let (name, field) = (format!("{coherence_length_um} µm {tiling:?}"), waves(16, 12, 0.065, 0.07, 0.4));
            if tiling == Tiling::Periodic {
                both(&name, &field, &options);
            } else {
                stands(&name, &field, &Options { model: Model::Patch, ..options });
            }
        }
    }
}

#[test]
fn the_least_tolerance() {
    let options = Options { tolerance: 1e-6, conserve_energy: false, ..Options::default() };
    both("1e-6", &waves(16, 12, 0.065, 0.07, 0.4), &options);
    both("1e-6 blazed", &preset(Preset::Blazed), &options);
}

#[test]
fn directions_below_the_surface_answer_zero() {
    let surface = built(&preset(Preset::Blazed), &Options::default());
    let up = [0.0, 0.0, 1.0];
    for bad in
        [[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [f64::NAN, 0.0, 1.0], [0.0, 0.0, f64::NAN], [f64::INFINITY, 0.0, 1.0]]
    {
        assert_eq!(surface.eval_pdf(up, bad, 500.0).f, 0.0);
        assert_eq!(surface.eval_pdf(bad, up, 500.0).f, 0.0);
    }
    for nm in [0.0, -1.0, 359.0, 831.0, f64::NAN, f64::INFINITY] {
        assert_eq!(surface.eval_pdf(up, up, nm).f, 0.0);
    }
    assert!(surface.sample(up, &[], [0.5; 3]).is_none());
    assert!(surface.sample([0.0, 0.0, -1.0], &[500.0], [0.5; 3]).is_none());
}

#[test]
fn eval_matches_eval_pdf() {
    for preset in [Preset::Blazed, Preset::Elaphe] {
        for model in [Model::Ensemble, Model::Patch] {
            // All factors of the value are on. A skin's ensemble is shared with other tests, so only its patch is
            // shadowed.
            let (is_skin, is_patch) = (preset == Preset::Elaphe, model == Model::Patch);
            let (conserve_energy, shadowing) = (!is_skin || !is_patch, !is_skin || is_patch);
            let options = Options { model, conserve_energy, shadowing, ..Options::default() };
            let surface = built(&crate::common::preset(preset), &options);
            let mut random = Random::new(11);
            let mut lit = 0;
            for _ in 0..500 {
                let (wi, nm, anywhere) = (random.direction(), random.wavelength_nm(), random.direction());
                let wo = surface.sample(wi, &[nm], random.three()).map_or(anywhere, |sample| sample.wo);
                let answer = surface.eval_pdf(wi, wo, nm);
                assert_eq!(surface.eval(wi, wo, nm), answer.f);
                lit += usize::from(answer.f > 0.0);
            }
            assert!(lit > 250, "{lit}");
            assert_eq!(surface.eval([0.0, 0.0, 1.0], [0.0, 0.0, -1.0], 550.0), 0.0);
            assert_eq!(surface.eval([0.0, 0.0, 1.0], [0.0, 0.0, 1.0], 300.0), 0.0);
        }
    }
}
