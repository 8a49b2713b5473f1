//! The published methods against the oracle and their documented properties.

use super::common::{Random, preset, relief, sinusoid, waves};
use std::f64::consts::{PI, TAU};
use sunbeam::colour::{SpectralToRgb, ciede2000, linear_srgb_to_lab};
use sunbeam::height_field::{HeightField, Preset};
use sunbeam::lobe::Exact;
use sunbeam::methods::{AnswerKind, Flss, Method, MethodError, MethodKind, MethodOptions, Repeats, build};
use sunbeam::scattering::Options;
use sunbeam::table::{DENSITY_FLOOR_UM2, Model, Progress, Tiling};
use sunbeam::transform::Series;

const COHERENCE_UM: f64 = 65.0;

/// Options of the published methods: a patch without energy conservation.
fn surface(coherence_length_um: f64, tolerance: f64) -> Options {
    Options { coherence_length_um, tolerance, model: Model::Patch, conserve_energy: false, ..Options::default() }
}

fn method(kind: MethodKind, field: &HeightField, tolerance: f64, options: &MethodOptions) -> Box<dyn Method> {
    build(kind, field, &surface(COHERENCE_UM, tolerance), options).unwrap()
}

/// The relief's colour for the scattering vector `q = wi + wo`, passed as `wi` with `wo` zero.
fn relief_rgb(method: &dyn Method, q: [f32; 3]) -> [f32; 3] {
    assert_eq!(method.answers(), AnswerKind::Relief);
    method.answer_rgb(q, [0.0; 3])
}

fn relief_spectral(method: &dyn Method, q: [f32; 3], wavelength_nm: f32) -> Option<f32> {
    method.answer_spectral(q, [0.0; 3], wavelength_nm)
}

fn oracle(field: &HeightField, model: Model) -> Exact {
    let options = Options { model, coherence_length_um: COHERENCE_UM, conserve_energy: false, ..Options::default() };
    Exact::new(field, &options, None)
}

/// Errors of `S` at random frequencies and a few κ, ascending. They are relative to the largest of the oracle's value,
/// its mean over window positions, and the density floor, as for tables. Half of the frequencies are near orders.
fn errors(field: &HeightField, method: &dyn Method) -> Vec<f64> {
    let (patch, mean) = (oracle(field, Model::Patch), oracle(field, Model::Ensemble));
    let (lx, ly) = field.extent_um();
    // The oracle sums over all pixels, a million for a skin.
    let queries = if field.heights_um().len() > 100_000 { 20 } else { 60 };
    let mut random = Random::new(5);
    let mut errors = Vec::new();
    for (w, nm) in [(1.99, 380.0), (1.9, 450.0), (1.5, 380.0), (1.2, 550.0), (0.6, 633.0), (0.1, 780.0), (1e-4, 500.0)]
    {
        let um: f64 = nm * 1e-3;
        // Rounded to the method's single precision, so that both get equal arguments.
        let w = f64::from(w as f32);
        let across = (4.0 - w * w).sqrt();
        for i in 0..queries {
            let turn = random.between(0.0, TAU);
            let distance = across * random.unit().sqrt();
            let mut uv = [distance * turn.cos(), distance * turn.sin()];
            if field.size().1 == 1 {
                uv[1] *= 0.02;
            }
            if i % 2 == 0 {
                let near = |u: f64, l: f64, r: &mut Random| ((u * l / um).round() + r.between(-0.1, 0.1)) * um / l;
                uv = [near(uv[0], lx, &mut random), near(uv[1], ly, &mut random)];
            }
            let [u, v] = uv.map(|c| c as f32);
            if f64::from(u).powi(2) + f64::from(v).powi(2) + w * w > 4.0 {
                continue; // No two directions have this sum.
            }
            let f = [f64::from(u) / um, f64::from(v) / um];
            let kappa = TAU * w / um;
            let truth = patch.power_density(f, kappa);
            let scale = truth.max(mean.power_density(f, kappa)).max(DENSITY_FLOOR_UM2);
            let found = f64::from(relief_spectral(method, [u, v, w as f32], nm as f32).unwrap()) * um * um;
            errors.push((found - truth).abs() / scale);
        }
    }
    errors.sort_by(f64::total_cmp);
    errors
}

/// Median, 99th percentile and largest.
fn summary(errors: &[f64]) -> [f64; 3] {
    let at = |share: f64| errors[((errors.len() - 1) as f64 * share) as usize];
    [at(0.5), at(0.99), at(1.0)]
}

/// Checks errors: 99 of 100 at most `most`, and all at most ten times that.
fn within(name: &str, errors: &[f64], most: f64) {
    let found = summary(errors);
    println!("{name}: median {:.1e}, 99 % {:.1e}, most {:.1e}", found[0], found[1], found[2]);
    assert!(found[1] <= most && found[2] <= 10.0 * most, "{name}: {found:?}");
}

fn options() -> MethodOptions {
    MethodOptions::default()
}

#[test]
fn flss_matches_the_direct_sum() {
    for (name, tolerances) in [
        (Preset::Flat, &[1e-3, 1e-5][..]),
        (Preset::Blazed, &[1e-3, 1e-5]),
        (Preset::Sinusoidal, &[1e-3, 1e-5]),
        (Preset::Elaphe, &[1e-5]),
        (Preset::Xenopeltis, &[1e-3]),
    ] {
        let field = preset(name);
        for &tolerance in tolerances {
            let flss = method(MethodKind::Flss, &field, tolerance, &options());
            // In single precision orders' directions are good to 1e-5 and amplitudes to 1e-6.
            within(&format!("{name} {tolerance:e}"), &errors(&field, &*flss), 1e-4f64.max(tolerance));
        }
    }
}

#[test]
fn few_orders_are_summed_once_each() {
    // Even and odd sizes, with the shortest tiles, whose orders at half the sampling rate are within reach.
    for (nx, ny) in [(1, 1), (2, 3), (4, 6), (5, 1), (1, 4)] {
        let field = relief(nx, ny, 0.3, 0.35, 0.3);
        for (coherence_um, neighbourhood) in [(1.0, Some(64)), (3.0, Some(63)), (3.0, None)] {
            let options = MethodOptions { neighbourhood, ..options() };
            let flss = build(MethodKind::Flss, &field, &surface(coherence_um, 1e-5), &options).unwrap();
            let exact = Exact::new(
                &field,
                &Options { model: Model::Patch, coherence_length_um: coherence_um, ..Options::default() },
                None,
            );
            let mut random = Random::new(3);
            for _ in 0..200 {
                let q = [random.between(-1.4, 1.4), random.between(-0.9, 0.9), random.between(0.01, 1.0)]
                    .map(|c| f64::from(c as f32));
                let um = random.between(0.381, 0.779);
                let truth = exact.power_density([q[0] / um, q[1] / um], TAU * q[2] / um);
                let found =
                    f64::from(relief_spectral(&*flss, q.map(|c| c as f32), (um * 1e3) as f32).unwrap()) * um * um;
                // Errors are relative to the peak, since Gaussians of short windows overlap and cancel.
                let peak = 4.0 * PI * (coherence_um / 4.0).powi(2);
                assert!((found - truth).abs() < 1e-4 * peak, "{nx}x{ny} {neighbourhood:?}: {found} {truth}");
            }
        }
    }
}

#[test]
fn the_sources_series_holds_for_shallow_reliefs_only() {
    let series = |series, terms| MethodOptions { series, terms, ..options() };
    let blazed = preset(Preset::Blazed);
    let taylor = method(MethodKind::Flss, &blazed, 1e-5, &series(Series::Taylor, None));
    // κH is at most 4.1: terms up to e^4.1/√(2π·4.1) = 12 cancel to 1.
    within("blazed, Taylor", &errors(&blazed, &*taylor), 3e-4);

    let xenopeltis = preset(Preset::Xenopeltis);
    let chebyshev = method(MethodKind::Flss, &xenopeltis, 1e-3, &series(Series::Chebyshev, Some(23)));
    within("xenopeltis, 23 Chebyshev terms", &errors(&xenopeltis, &*chebyshev), 1e-3);
    let taylor = |terms| {
        let method = method(MethodKind::Flss, &xenopeltis, 1e-3, &series(Series::Taylor, terms));
        errors(&xenopeltis, &*method)
    };
    // 13.5²³/23! = 4000: at large κH the truncated series is a multiple of the value.
    let few = summary(&taylor(Some(23)));
    println!("xenopeltis, 23 Taylor terms: {few:?}");
    assert!(few[1] > 3.0, "{few:?}");
    // Terms up to 8e4 cancel, which leaves the digits of single precision.
    within("xenopeltis, 39 Taylor terms", &taylor(Some(39)), 1e-3);
}

#[test]
fn a_mirror_is_white() {
    let flat = preset(Preset::Flat);
    let s = COHERENCE_UM / 4.0;
    // In the mirror direction every wavelength has the peak 4πs²/λ², brightest in the blue.
    let expected = SpectralToRgb::default().rgb_of(|nm| 4.0 * PI * s * s / (nm * 1e-3).powi(2));
    for w in [2.0, 0.3, 1e-3] {
        let found = relief_rgb(&*method(MethodKind::Flss, &flat, 1e-3, &options()), [0.0, 0.0, w]);
        for c in 0..3 {
            // Rounding of 81 sums in single precision.
            assert!((f64::from(found[c]) / expected[c] - 1.0).abs() < 1e-5, "{found:?} {expected:?}");
        }
        // White as in Single 2014, with the value at 550 nm.
        let [r, g, b] = relief_rgb(&*method(MethodKind::Nmm, &flat, 1e-3, &options()), [0.0, 0.0, w]);
        assert!(r == g && g == b && (f64::from(g) / (4.0 * PI * s * s / 0.55f64.powi(2)) - 1.0).abs() < 1e-5);
    }
    // The integral over all directions is 1 for each wavelength: ∫ response du dv = (1, 1, 1).
    for (kind, half, steps) in [(MethodKind::Flss, 0.04, 80), (MethodKind::Pq, 0.38, 751)] {
        let method = method(kind, &flat, 1e-3, &options());
        let mut sum = [0.0f64; 3];
        let at = |i: usize| (half * (2.0 * (i as f64 + 0.5) / steps as f64 - 1.0)) as f32;
        for (iy, ix) in (0..steps).flat_map(|iy| (0..steps).map(move |ix| (iy, ix))) {
            let rgb = relief_rgb(&*method, [at(ix), at(iy), 1.5]);
            (0..3).for_each(|c| sum[c] += f64::from(rgb[c]));
        }
        let cell = (2.0 * half / steps as f64).powi(2);
        for channel in sum.map(|c| c * cell) {
            // Uniform steps are exact for periodic and for decaying functions; the rest is rounding of 81 sums.
            assert!((channel - 1.0).abs() < 1e-5, "{kind}: {channel}");
        }
    }
}

/// Mean over directions around `(u, v)`, which averages the speckle of one window.
fn around(method: &dyn Method, u: f64, v: f64, w: f64) -> [f64; 3] {
    const SIDE: usize = 12;
    let at = |i: usize| 0.02 * ((i as f64 + 0.5) / SIDE as f64 - 0.5);
    let mut sum = [0.0; 3];
    for i in 0..SIDE * SIDE {
        let q = [u + at(i % SIDE), v + at(i / SIDE), w].map(|c| c as f32);
        let rgb = relief_rgb(method, q);
        (0..3).for_each(|c| sum[c] += f64::from(rgb[c]) / (SIDE * SIDE) as f64);
    }
    sum
}

/// CIEDE2000 of two colours, at the exposure that gives the first a luminance of 0.5.
fn difference(a: [f64; 3], b: [f64; 3]) -> f64 {
    let factor = 0.5 / (0.2126 * a[0] + 0.7152 * a[1] + 0.0722 * a[2]);
    let lab = |rgb: [f64; 3]| linear_srgb_to_lab(rgb.map(|c| c * factor));
    ciede2000(lab(a), lab(b))
}

#[test]
fn weights_remove_the_hue_shift_of_nmm() {
    let (mut without, mut with) = (Vec::new(), Vec::new());
    for (name, places) in [
        (Preset::Blazed, [(-0.18, 0.0), (-0.22, 0.0), (0.4, 0.0)]),
        (Preset::Elaphe, [(0.5, 0.0), (0.5, 0.1), (-0.4, 0.4)]),
        (Preset::Xenopeltis, [(0.5, 0.0), (-0.4, 0.4), (0.1, -0.7)]),
    ] {
        let field = preset(name);
        let fine = method(MethodKind::Flss, &field, 1e-3, &MethodOptions { lambda_step_nm: 2.0, ..options() });
        let nmm = |weighted| method(MethodKind::Nmm, &field, 1e-3, &MethodOptions { weighted, ..options() });
        let (weighted, unweighted) = (nmm(true), nmm(false));
        for (u, v) in places {
            let truth = around(&*fine, u, v, 1.4);
            let (a, b) = (around(&*weighted, u, v, 1.4), around(&*unweighted, u, v, 1.4));
            let (a, b) = (difference(truth, a), difference(truth, b));
            println!("{name} ({u}, {v}): {truth:.3?}, ΔE {a:.2} weighted, {b:.2} unweighted");
            with.push(a);
            without.push(b);
        }
    }
    let mean = |all: &[f64]| all.iter().sum::<f64>() / all.len() as f64;
    // A difference of 1 is just visible. Averages over 144 directions leave some speckle.
    assert!(mean(&with) < 1.0 && with.iter().all(|d| *d < 2.0), "{with:?}");
    assert!(mean(&without) > 2.0, "{without:?}");
}

#[test]
fn pq_peaks_at_the_grating_angles() {
    let blazed = preset(Preset::Blazed);
    let pq = method(MethodKind::Pq, &blazed, 1e-3, &MethodOptions { repeats: Some(Repeats::Both(26)), ..options() });
    for (n, nm) in [(-1, 400.0), (-1, 700.0), (-2, 450.0), (1, 550.0)] {
        let expected = f64::from(n) * nm * 1e-3 / 2.5;
        let value = |u: f64| relief_spectral(&*pq, [u as f32, 0.0, 1.8], nm as f32).unwrap();
        let places = (-2000..=2000).map(|i| expected + f64::from(i) * 2e-5);
        let peak = places.max_by(|a, b| value(*a).total_cmp(&value(*b))).unwrap();
        // The search has steps of 2e-5 over the flat top of a peak 6e-3 wide, in single precision.
        assert!((peak - expected).abs() < 6e-5, "order {n} of {nm} nm at {peak}, not {expected}");
    }
}

#[test]
fn pq_keeps_the_power() {
    // All orders with power lie within the square: 1.35/0.4 µm·2 µm is more than six orders either way.
    let field = sinusoid(16, 2.0, 0.05);
    let pq = method(MethodKind::Pq, &field, 1e-5, &MethodOptions { repeats: Some(Repeats::Each([3, 2])), ..options() });
    const STEPS: usize = 675;
    for w in [0.1, 0.4] {
        let at = |i: usize| 1.35 * (2.0 * (i as f64 + 0.5) / STEPS as f64 - 1.0);
        let power: f64 = (0..STEPS * STEPS)
            .map(|i| f64::from(relief_spectral(&*pq, [at(i % STEPS) as f32, at(i / STEPS) as f32, w], 400.0).unwrap()))
            .sum();
        let integral = power * (2.7 / STEPS as f64).powi(2);
        // Fifty steps a cell are exact except for cells cut by the square's edge, which are dark.
        assert!((integral - 1.0).abs() < 1e-4, "{w}: {integral}");
    }
}

#[test]
fn stam_has_its_orders_where_the_grating_has() {
    let field = preset(Preset::Sinusoidal);
    for (method, d) in [
        (method(MethodKind::Stam, &field, 1e-3, &options()), 2.5),
        (method(MethodKind::Stam, &field, 1e-3, &MethodOptions { period_um: Some(1.6), ..options() }), 1.6),
    ] {
        for (n, um) in [(1, 0.4), (1, 0.7), (2, 0.5), (3, 0.6)] {
            let u = f64::from(n) * um / d;
            let value =
                |du: f64| f64::from(relief_spectral(&*method, [(u + du) as f32, 0.3, 1.0], (um * 1e3) as f32).unwrap());
            // Peak 2√π·s/(32·λ): the window's Gaussian, and 1/16 over the two units of v.
            let peak = 2.0 * PI.sqrt() * COHERENCE_UM / 4.0 / (32.0 * um);
            assert!((value(0.0) / peak - 1.0).abs() < 1e-3, "{n} {um}: {} {peak}", value(0.0));
            assert!(value(0.02) < 1e-3 * peak && value(-0.02) < 1e-3 * peak);
            assert_eq!(relief_rgb(&*method, [u as f32, 0.3, 1.0]), relief_rgb(&*method, [-u as f32, -0.1, 0.7]));
        }
        // No light falls between the violet of order 1 and the mirror direction.
        assert_eq!(relief_rgb(&*method, [(0.37 / d) as f32, 0.0, 1.0]), [0.0; 3]);
    }
    // The window is so long that its Gaussian is narrow against the colours.
    let long = build(MethodKind::Stam, &field, &surface(1e3, 1e-3), &options()).unwrap();
    let fine = SpectralToRgb::visible(0.1).unwrap();
    for u in [0.2, 0.24, 0.55, 0.8] {
        let q = [u, 0.1, 1.2];
        let found = relief_rgb(&*long, q).map(f64::from);
        let spectral = fine.rgb_of(|nm| relief_spectral(&*long, q, nm as f32).unwrap().into());
        let largest = spectral.iter().fold(0.0f64, |a, b| a.max(b.abs()));
        for c in 0..3 {
            assert!((found[c] - spectral[c]).abs() < 5e-3 * largest, "{u}: {found:?} {spectral:?}");
        }
    }
}

#[test]
fn every_query_answers_finite_numbers() {
    let odd = [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, f32::MAX, -1.0, -0.0, 1e-30, 1e-4, 0.152, 1.0, 2.0];
    let deep = relief(17, 13, 0.1, 0.1, 12.0);
    let fields = [preset(Preset::Flat), preset(Preset::Lamellar), waves(24, 18, 0.065, 0.07, 0.5), deep];
    for field in &fields {
        for kind in MethodKind::ALL.into_iter().filter(|kind| kind.is_patch_only()) {
            for coherence_um in [1.0, 65.0, 1e4] {
                let options = MethodOptions { period_um: Some(1.0), ..options() };
                let method = build(kind, field, &surface(coherence_um, 1e-2), &options).unwrap();
                for i in 0..odd.len().pow(3) {
                    let q = [odd[i % odd.len()], odd[i / odd.len() % odd.len()], odd[i / odd.len().pow(2)]];
                    let rgb = relief_rgb(&*method, q);
                    assert!(rgb.iter().all(|c| c.is_finite()), "{kind} {q:?}: {rgb:?}");
                    for nm in [f32::NAN, -1.0, 0.0, 379.0, 380.0, 555.0, 780.0, f32::INFINITY] {
                        let value = relief_spectral(&*method, q, nm).unwrap();
                        assert!(value.is_finite() && value >= 0.0, "{kind} {q:?} {nm}: {value}");
                        let inside = q[2] > 0.0
                            && q.iter().map(|c| c * c).sum::<f32>() <= 4.001
                            && (380.0..=780.0).contains(&nm);
                        assert!(inside || value == 0.0, "{kind} {q:?} {nm}: {value}");
                    }
                }
            }
        }
    }
}

#[test]
fn unsupported_options_are_refused() {
    let (flat, xenopeltis) = (preset(Preset::Flat), waves(24, 18, 0.065, 0.07, 0.8));
    let refused =
        |kind, field: &HeightField, options: MethodOptions| match build(kind, field, &surface(65.0, 1e-3), &options) {
            Err(error) => error.to_string(),
            Ok(_) => panic!("accepted {options:?}"),
        };
    for (name, options) in [
        ("lambda_step_nm", MethodOptions { lambda_step_nm: 0.0, ..options() }),
        ("lambda_step_nm", MethodOptions { lambda_step_nm: f64::NAN, ..options() }),
        ("terms", MethodOptions { terms: Some(257), ..options() }),
        ("terms", MethodOptions { terms: Some(0), ..options() }),
        ("neighbourhood", MethodOptions { neighbourhood: Some(65), ..options() }),
        ("repeats", MethodOptions { repeats: Some(Repeats::Each([1, 0])), ..options() }),
        ("period_um", MethodOptions { period_um: Some(-1.0), ..options() }),
        ("resolution", MethodOptions { resolution: 0.1, ..options() }),
    ] {
        // The constructor of a method refuses them as `build` does.
        let alone = Flss::new(&flat, 65.0, 1e-3, &options, &Progress::none()).err();
        assert!(matches!(alone, Some(MethodError::OutOfRange { name: n, .. }) if n == name), "{name}: {alone:?}");
        let message = refused(MethodKind::Flss, &flat, options);
        assert!(message.contains(name) && message.contains("must be"), "{message}");
    }
    for (parameter, options) in [
        ("model", Options { model: Model::Ensemble, ..surface(65.0, 1e-3) }),
        ("tiling", Options { tiling: Tiling::Aperiodic, ..surface(65.0, 1e-3) }),
        ("conserve_energy", Options { conserve_energy: true, ..surface(65.0, 1e-3) }),
    ] {
        let error = build(MethodKind::Nmm, &flat, &options, &MethodOptions::default()).err();
        assert!(matches!(error, Some(MethodError::Unsupported { parameter: p, .. }) if p == parameter), "{error:?}");
    }
    assert!(refused(MethodKind::Stam, &flat, options()).contains("period_um"));
    let taylor = MethodOptions { series: Series::Taylor, ..options() };
    assert!(refused(MethodKind::Flss, &relief(4, 4, 0.1, 0.1, 3.0), taylor).contains("chebyshev"));
    assert!(refused(MethodKind::Pq, &relief(4, 4, 0.1, 0.1, 20.0), options()).contains("too deep"));
    for (coherence, tolerance) in [(0.0, 1e-3), (f64::NAN, 1e-3), (65.0, 1.0)] {
        let error = build(MethodKind::Flss, &xenopeltis, &surface(coherence, tolerance), &options()).err();
        assert!(matches!(error, Some(MethodError::OutOfRange { .. })), "{error:?}");
    }
    let error = build(MethodKind::Flss, &preset(Preset::Elaphe), &surface(1.0, 1e-3), &options()).err();
    assert!(matches!(error, Some(MethodError::TooWide { limit: 64, .. })), "{error:?}");
    let large = HeightField::new(ndarray::Array2::zeros((4000, 4000)), 0.1, 0.1).unwrap();
    let error =
        build(MethodKind::Flss, &large, &surface(65.0, 1e-3), &MethodOptions { terms: Some(20), ..options() }).err();
    assert!(matches!(error, Some(MethodError::TooLarge { .. })), "{error:?}");
    let read: MethodOptions = serde_json::from_str(r#"{"series":"taylor","repeats":[3,4],"terms":39}"#).unwrap();
    let expected = Repeats::Each([3, 4]);
    assert_eq!(read, MethodOptions { series: Series::Taylor, repeats: Some(expected), terms: Some(39), ..options() });
    assert!(serde_json::from_str::<MethodOptions>(r#"{"term":39}"#).unwrap_err().to_string().contains("neighbourhood"));
}
