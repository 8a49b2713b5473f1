//! Stam's shader of GPU Gems against the chapter's formula, written here in the chapter's terms.

use super::common::{Random, preset};
use std::f64::consts::PI;
use sunbeam::colour::SpectralToRgb;
use sunbeam::height_field::Preset;
use sunbeam::lobe::Exact;
use sunbeam::methods::{AnswerKind, Method, MethodError, MethodKind, MethodOptions, StamForm, build};
use sunbeam::scattering::Options;
use sunbeam::table::Model;

/// Relative error in single precision: a bump falls by 16 a µm, and wavelengths up to 5 µm have an error of 1e-6.
const ROUNDING: f64 = 3e-5;

fn gems() -> MethodOptions {
    MethodOptions { stam_form: StamForm::Gems, ..MethodOptions::default() }
}

fn surface() -> Options {
    Options { model: Model::Patch, conserve_energy: false, ..Options::default() }
}

fn method(options: &MethodOptions) -> Box<dyn Method> {
    build(MethodKind::Stam, &preset(Preset::Blazed), &surface(), options).unwrap()
}

/// The answer to a pair of directions with the sum `q` and equal cosines.
fn answer(method: &dyn Method, q: [f32; 3]) -> [f32; 3] {
    let half = 0.5 * q[2];
    method.answer_rgb([q[0], q[1], half], [0.0, 0.0, half])
}

/// The colour, without the `1/(π cosθi)` of a reflectance.
fn colour(method: &dyn Method, q: [f64; 3]) -> [f64; 3] {
    answer(method, q.map(|c| c as f32)).map(|value| PI * 0.5 * q[2] * f64::from(value))
}

fn difference(a: [f64; 3], b: [f64; 3]) -> f64 {
    (0..3).map(|c| (a[c] - b[c]).abs()).fold(0.0, f64::max)
}

/// The chapter's colour for `q` and a spacing in µm; `orders` is 7 in the chapter.
fn chapter(q: [f64; 3], spacing_um: f64, r: f64, highlight: [f64; 3], orders: u32) -> [f64; 3] {
    let u = q[0] * spacing_um;
    let exponent = (r * u / q[2]).powi(2);
    std::array::from_fn(|c| {
        let centre = [0.75, 0.5, 0.25][c];
        let bump = |n: u32| {
            let y = 2.0 * u.abs() / f64::from(n) - 1.0;
            (1.0 - (4.0 * (y - centre)).powi(2)).max(0.0)
        };
        highlight[c] * (-exponent).exp() + (1..=orders).map(bump).sum::<f64>()
    })
}

#[test]
fn the_colours_are_those_worked_out_by_hand() {
    // The period of the blazed grating is 2.5 µm.
    let method = method(&gems());
    for (u, expected) in [
        (0.0, [1.0, 0.7, 0.3]),       // the highlight alone
        (0.1, [0.0; 3]),              // 0.25 µm: nothing
        (0.25, [0.0, 0.0, 1.0]),      // 0.625 µm
        (0.3, [0.0, 1.0, 0.0]),       // 0.75 µm, and 0.375 µm in the second order
        (0.275, [0.0, 0.75, 0.75]),   // 0.6875 µm, half way between the two
        (0.7, [1.0, 0.0, 8.0 / 9.0]), // 1.75 µm: 0.875 µm in the second order, 0.583 µm in the third
        (0.45, [0.0, 0.0, 0.75]),     // 1.125 µm: 0.5625 µm in the second order, half a width off blue
    ] {
        let found = colour(&*method, [u, 0.2, 1.6]);
        assert!(difference(found, expected) < ROUNDING, "{u}: {found:?}, not {expected:?}");
    }
    // One sharpness away from the mirror direction: r d u/w = 50/µm · 2.5 µm · 0.016/2 = 1.
    let found = colour(&*method, [0.016, 0.0, 2.0]);
    assert!(difference(found, [1.0, 0.7, 0.3].map(|value| value / 1f64.exp())) < ROUNDING, "{found:?}");
}

#[test]
fn the_colours_are_those_of_the_chapter() {
    let (r, highlight) = (12.0, [0.2, 3.0, 0.5]);
    let own = MethodOptions { period_um: Some(1.9), gems_sharpness: r, gems_highlight: highlight, ..gems() };
    let mut random = Random::new(9);
    for (options, spacing_um, r, highlight) in [(gems(), 2.5, 50.0, [1.0, 0.7, 0.3]), (own, 1.9, r, highlight)] {
        let method = method(&options);
        let mut eighth = 0.0f64;
        for i in 0..4000 {
            // Half of the pairs are near the mirror direction, at the highlight.
            let u = if i % 2 == 0 { random.between(-1.7, 1.7) } else { random.between(-0.05, 0.05) };
            let q = [u, random.between(-0.3, 0.3), random.between(0.02, 1.0)].map(|c| f64::from(c as f32));
            let (found, expected) = (colour(&*method, q), chapter(q, spacing_um, r, highlight, 7));
            assert!(difference(found, expected) < ROUNDING, "{q:?}: {found:?}, not {expected:?}");
            eighth = eighth.max(difference(found, chapter(q, spacing_um, r, highlight, 8)));
        }
        // An eighth order, which the library's own form has, would be noticed at wide spacings.
        assert_eq!(eighth > 0.01, 1.7 * spacing_um / 8.0 > 0.5, "{eighth}");
    }
}

#[test]
fn an_order_has_its_light_at_half_a_micrometre_to_one() {
    // At a spacing of 1 µm the first order's wavelength is u, and the second's does not reach 0.5 µm.
    let of = |stam_form| method(&MethodOptions { period_um: Some(1.0), stam_form, ..gems() });
    let (gems, spacing) = (of(StamForm::Gems), of(StamForm::Spacing));
    let lit = |method: &dyn Method, um: f64| colour(method, [um, 0.0, 1.6]).iter().any(|value| *value > ROUNDING);
    for um in (51..100).map(|i| 0.01 * f64::from(i)) {
        assert!(lit(&*gems, um), "{um} µm");
    }
    for um in [0.3, 0.36, 0.39, 0.45, 0.49] {
        assert!(!lit(&*gems, um), "{um} µm");
        assert_eq!(lit(&*spacing, um), um > 0.38, "{um} µm");
    }
}

#[test]
fn gems_is_symmetric_where_a_blaze_is_not() {
    let (gems, exact) = (method(&gems()), Exact::new(&preset(Preset::Blazed), &surface(), None));
    let visible = SpectralToRgb::visible(5.0).unwrap();
    let wi = [0.0, 0.0, 1.0];
    let mut ratios = Vec::new();
    for u in [0.16f64, 0.2, 0.24, 0.28] {
        let w = 1.0 + (1.0 - u * u).sqrt();
        assert_eq!(answer(&*gems, [u as f32, 0.0, w as f32]), answer(&*gems, [-u as f32, 0.0, w as f32]));
        let green = |u: f64| visible.rgb_of(|nm| exact.eval(wi, [u, 0.0, w - 1.0], nm))[1];
        ratios.push(green(-u) / green(u));
    }
    // Facets of 5.7° send light along the normal to −0.2: the first order there has more than nine tenths of it.
    println!("left to right by the direct sum: {ratios:.1?}");
    assert!(ratios.iter().all(|ratio| *ratio > 20.0), "{ratios:?}");
}

#[test]
fn gems_has_colours_alone() {
    let gems = method(&gems());
    assert_eq!(gems.answers(), AnswerKind::Reflectance);
    assert_eq!(gems.answer_spectral([0.3, 0.0, 0.5], [0.0, 0.0, 0.5], 550.0), None);
    assert_eq!(method(&MethodOptions::default()).answers(), AnswerKind::Relief);
}

#[test]
fn all_colours_are_finite() {
    let wide = MethodOptions { period_um: Some(1e3), gems_sharpness: 1e4, ..gems() };
    let odd = [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, f32::MAX, -1.0, -0.0, 1e-30, 1e-4, 1.0, 2.0];
    for method in [method(&gems()), method(&wide)] {
        for i in 0..odd.len().pow(3) {
            let q = [odd[i % 10], odd[i / 10 % 10], odd[i / 100]];
            let rgb = answer(&*method, q);
            assert!(rgb.iter().all(|value| value.is_finite() && *value >= 0.0), "{q:?}: {rgb:?}");
            let inside = q[2] > 0.0 && q.iter().map(|c| c * c).sum::<f32>() <= 4.001;
            assert!(inside || rgb == [0.0; 3], "{q:?}: {rgb:?}");
        }
    }
}

#[test]
fn options_are_read_and_checked() {
    let read: MethodOptions =
        serde_json::from_str(r#"{"stam_form":"gems","gems_sharpness":9,"gems_highlight":[1,2,3]}"#).unwrap();
    assert_eq!(read, MethodOptions { gems_sharpness: 9.0, gems_highlight: [1.0, 2.0, 3.0], ..gems() });
    assert!(serde_json::from_str::<MethodOptions>(r#"{"stam_form":"cg"}"#).unwrap_err().to_string().contains("gems"));
    for (name, options) in [
        ("gems_sharpness", MethodOptions { gems_sharpness: -1.0, ..gems() }),
        ("gems_sharpness", MethodOptions { gems_sharpness: f64::NAN, ..gems() }),
        ("gems_highlight", MethodOptions { gems_highlight: [0.0, -0.1, 0.0], ..gems() }),
        ("gems_highlight", MethodOptions { gems_highlight: [0.0, 0.0, f64::INFINITY], ..gems() }),
    ] {
        let error = build(MethodKind::Stam, &preset(Preset::Blazed), &surface(), &options).err();
        assert!(matches!(error, Some(MethodError::OutOfRange { name: n, .. }) if n == name), "{error:?}");
    }
    let flat = build(MethodKind::Stam, &preset(Preset::Flat), &surface(), &gems()).err();
    assert_eq!(flat, Some(MethodError::NoPeriod));
}
