//! The transforms against closed forms and each other: the naive sum against mathematics, the FFT against the naive
//! sum, the series against the FFT.

use super::common::{direction, preset, relief, sinusoid};
use ndarray::Array2;
use std::f64::consts::{PI, TAU};
use sunbeam::height_field::{HeightField, Preset};
use sunbeam::lobe::{Exact, Surface};
use sunbeam::scattering::Options;
use sunbeam::transform::{
    Expansion, OrderTransform, Precision, Series, TermTransform, chebyshev_terms, naive_order_amplitude, taylor_terms,
};
use sunbeam_fourier::num_complex::{Complex, Complex64};

/// Rounding of sums of up to 131072 terms of modulus one, against closed forms.
const CLOSED_FORM: f64 = 1e-9;
/// Difference of two sums of a few hundred terms of modulus one in double precision.
const ROUNDING: f64 = 1e-12;
/// Error at an offset of 1000 µm: heights have a spacing of 1.1e-13 µm, which κ ≤ 35 rad/µm turns into phases of 4e-12.
const ROUNDING_AT_1_MM: f64 = 1e-10;
/// Largest κ, 2π·2/0.38 µm: both directions along the normal at 380 nm.
const KAPPA: f64 = TAU * 2.0 / 0.38;
/// Half of the height range with κH = 13.56, the case of docs/model.md#the-two-expansions.
const HALF_RANGE_UM: f64 = 0.41;
/// Rounding of single-precision sums: the terms and 39 additions at 6e-8 each.
const SINGLE: f64 = 2e-6;

fn orders() -> impl Iterator<Item = i64> {
    -6..=6
}

#[test]
fn a_sinusoid_has_bessel_amplitudes_with_their_sign() {
    let amplitude = 0.23;
    let field = sinusoid(128, 2.0, amplitude);
    for kappa in [0.0, 3.0, 11.0, 34.0] {
        for j in orders() {
            // exp(iκA sin φ) = Σ J_m e^{imφ}; the positive exponent picks m = −j.
            let expected = libm::jn(-j as i32, kappa * amplitude);
            let found = naive_order_amplitude(&field, kappa, j, 0);
            assert!((found - expected).norm() < CLOSED_FORM, "κ {kappa} j {j}: {found} {expected}");
        }
    }
    // Negative control: the other sign of the exponent differs.
    assert!((naive_order_amplitude(&field, 3.0, 1, 0) - libm::jn(1, 3.0 * amplitude)).norm() > 0.1);
}

#[test]
fn powers_of_a_sinusoid_have_binomial_harmonics() {
    let (n, amplitude) = (128, 0.23);
    let transform = TermTransform::<f64>::new(&sinusoid(n, 2.0, amplitude), Series::Taylor);
    assert!((transform.half_range_um() - amplitude).abs() < ROUNDING);
    for (power, harmonics) in [
        // sin φ; sin²φ = 1/2 − cos 2φ/2; sin³φ = 3/4 sin φ − 1/4 sin 3φ: half of each at ±j.
        (1, &[(1, 0.5)][..]),
        (2, &[(0, 0.5), (2, 0.25)][..]),
        (3, &[(1, 3.0 / 8.0), (3, 1.0 / 8.0)][..]),
    ] {
        let bins = transform.term(power);
        for j in orders() {
            let expected = harmonics.iter().find(|harmonic| harmonic.0 == j.abs()).map_or(0.0, |harmonic| harmonic.1);
            let found = bins[j.rem_euclid(n as i64) as usize].norm();
            assert!((found - expected).abs() < ROUNDING, "power {power} order {j}: {found} {expected}");
        }
    }
}

#[test]
fn a_sampled_sawtooth_has_its_closed_form() {
    let (n, height) = (1024.0, 0.25);
    let field = preset(Preset::Blazed);
    for kappa in [0.0, 5.0, 17.3, TAU / 0.25] {
        for j in orders() {
            let a = kappa * height / TAU + j as f64;
            let size = if a.abs() < 1e-12 { 1.0 } else { (PI * a).sin() / (n * (PI * a / n).sin()) };
            // Samples lie half a pixel inside the edges, and the middle of the geometric series gives the phase.
            let expected = Complex64::from_polar(size.abs(), 0.5 * kappa * height / n + PI * a * (n - 1.0) / n)
                * if size < 0.0 { -1.0 } else { 1.0 };
            let found = naive_order_amplitude(&field, kappa, j, 0);
            assert!((found - expected).norm() < CLOSED_FORM, "κ {kappa} j {j}: {found} {expected}");
        }
    }
}

#[test]
fn a_fine_sawtooth_has_the_sinc_of_the_continuum() {
    let (n, height) = (1 << 17, 0.25);
    let heights = Array2::from_shape_fn((1, n), |(_, ix)| height * (ix as f64 + 0.5) / n as f64);
    let field = HeightField::new(heights, 2.5 / n as f64, 2.5).unwrap();
    for kappa in [5.0, 17.3] {
        for j in -3..=3 {
            let a = kappa * height / TAU + j as f64;
            let sinc = (PI * a).sin() / (PI * a);
            // The sampled form differs from the continuum by πa/(6n²) ≈ 2e-10.
            assert!((naive_order_amplitude(&field, kappa, j, 0).norm() - sinc.abs()).abs() < CLOSED_FORM);
        }
    }
}

#[test]
fn a_lamellar_grating_has_odd_orders_only() {
    let (n, height) = (1024.0, 0.125);
    let field = preset(Preset::Lamellar);
    for kappa in [0.0, 7.0, 25.0] {
        let step = Complex64::cis(kappa * height);
        for j in orders() {
            let expected = match j {
                0 => 0.5 * (1.0 + step),
                _ if j % 2 == 0 => Complex64::ZERO,
                _ => (step - 1.0) * 2.0 / (n * (1.0 - Complex64::cis(TAU * j as f64 / n))),
            };
            assert!((naive_order_amplitude(&field, kappa, j, 0) - expected).norm() < CLOSED_FORM, "κ {kappa} j {j}");
        }
    }
}

#[test]
fn a_facet_that_rises_along_x_is_bright_at_minus_sine_of_twice_its_slope() {
    let field = preset(Preset::Blazed);
    let alpha = (0.25f64 / 2.5).atan();
    let wavelength_nm = 2500.0 * (2.0 * alpha).sin();
    let options = Options::default();
    let surface = Surface::new(&field, &options).unwrap();
    let exact = Exact::new(&field, &options, None);
    let (wi, degrees) = ([0.0, 0.0, 1.0], (2.0 * alpha).to_degrees());
    let (bright, dark) = (direction(degrees, 180.0), direction(degrees, 0.0));
    for f in [
        |s: &Surface, _: &Exact, wi, wo, nm| s.eval_pdf(wi, wo, nm).f,
        |_: &Surface, e: &Exact, wi, wo, nm| e.eval(wi, wo, nm),
    ] {
        let (lit, unlit) =
            (f(&surface, &exact, wi, bright, wavelength_nm), f(&surface, &exact, wi, dark, wavelength_nm));
        // At its blaze the grating sends all light into one order; the opposite order is at a zero of the sinc.
        assert!(lit > 1e3 * unlit.max(1.0), "{lit} {unlit}");
    }
}

#[test]
fn the_fft_agrees_with_the_naive_sum_on_awkward_tiles() {
    for (nx, ny) in [(1, 1), (7, 1), (1, 13), (31, 17), (40, 12)] {
        let field = relief(nx, ny, 0.1, 0.3, 0.8);
        let (low, high) = field.range_um();
        let transform = OrderTransform::new(&field);
        for kappa in [0.0, 1.0, 34.0] {
            let bins = transform.amplitudes(kappa);
            let turn = Complex64::cis(-kappa * (low + 0.5 * (high - low)));
            for jy in -(ny as i64) / 2..=ny as i64 / 2 {
                for jx in -(nx as i64) / 2..=nx as i64 / 2 {
                    let bin = jy.rem_euclid(ny as i64) as usize * nx + jx.rem_euclid(nx as i64) as usize;
                    let naive = naive_order_amplitude(&field, kappa, jx, jy) * turn;
                    assert!((bins[bin] - naive).norm() < ROUNDING, "{nx}x{ny} κ {kappa} order {jx},{jy}");
                }
            }
            let power: f64 = bins.iter().map(Complex::norm_sqr).sum();
            assert!((power - 1.0).abs() < ROUNDING, "Parseval: {power}");
        }
    }
}

#[test]
fn a_millimetre_of_offset_changes_nothing() {
    let near = relief(31, 17, 0.1, 0.3, 0.8);
    let far = HeightField::new(near.heights_um() + 1000.0, 0.1, 0.3).unwrap();
    let (a, b) = (OrderTransform::new(&near).amplitudes(KAPPA), OrderTransform::new(&far).amplitudes(KAPPA));
    let worst = a.iter().zip(&b).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max);
    assert!(worst < ROUNDING_AT_1_MM, "{worst:e}");
    let powers = naive_order_amplitude(&near, KAPPA, 2, 1).norm() - naive_order_amplitude(&far, KAPPA, 2, 1).norm();
    assert!(powers.abs() < ROUNDING_AT_1_MM, "{powers:e}");
}

/// A relief with half range 0.41 µm, so that κH = 13.56 at [`KAPPA`].
fn deep() -> HeightField {
    let mut field = relief(37, 23, 0.1, 0.1, 1.0);
    let (low, high) = field.range_um();
    let scaled = field.heights_um().mapv(|h| 2.0 * HALF_RANGE_UM * (h - low) / (high - low));
    field = HeightField::new(scaled, 0.1, 0.1).unwrap();
    field
}

fn worst<T: Precision + Into<f64>>(field: &HeightField, series: Series, terms: usize, kappa: f64) -> f64 {
    let expansion = Expansion::<T>::new(field, series, terms);
    let truth = OrderTransform::new(field).amplitudes(kappa);
    let double = |c: Complex<T>| Complex64::new(c.re.into(), c.im.into());
    truth.iter().enumerate().map(|(i, c)| (double(expansion.amplitude(kappa, i)) - c).norm()).fold(0.0, f64::max)
}

#[test]
fn chebyshev_terms_suffice_and_are_few() {
    let kappa_h = KAPPA * HALF_RANGE_UM;
    // Order amplitudes need the model's counts; the bound at every height needs a few more.
    for (tolerance, enough) in [(1e-3, 20), (3e-6, 25)] {
        let terms = chebyshev_terms(kappa_h, tolerance);
        assert!((enough..=enough + 3).contains(&terms), "{tolerance:e}: {terms}");
        for count in [enough, terms] {
            let double = worst::<f64>(&deep(), Series::Chebyshev, count, KAPPA);
            let single = worst::<f32>(&deep(), Series::Chebyshev, count, KAPPA);
            println!("Chebyshev for {tolerance:e}, {count} terms: {double:.1e} in f64, {single:.1e} in f32");
            assert!(double <= tolerance, "{count} terms: {double:e}");
            assert!(single <= tolerance + SINGLE, "{count} terms: {single:e}");
        }
    }
    let all = worst::<f64>(&deep(), Series::Chebyshev, 39, KAPPA);
    println!("Chebyshev, 39 terms: {all:.1e} in f64; 1e-15 asks for {}", chebyshev_terms(kappa_h, 1e-15));
    assert!(all <= ROUNDING, "{all:e}");
    // Negative control: fewer terms miss the tolerance.
    assert!(worst::<f64>(&deep(), Series::Chebyshev, 16, KAPPA) > 1e-3);
}

#[test]
fn taylor_loses_its_digits_in_single_precision() {
    let terms = taylor_terms(KAPPA * HALF_RANGE_UM, 1e-6);
    let double = worst::<f64>(&deep(), Series::Taylor, terms, KAPPA);
    let single = worst::<f32>(&deep(), Series::Taylor, terms, KAPPA);
    println!("Taylor, {terms} terms: {double:.1e} in f64, {single:.1e} in f32");
    // Terms of up to e^13.56/√(2π·13.56) = 8e4 cancel: the error is 2e-11 in double precision and 5e-3 in single
    // precision at one pixel, less in the mean over pixels.
    assert!(double < 1e-6 + 1e-9);
    assert!((3e-5..5e-3).contains(&single), "{single:e}");
}

#[test]
fn both_series_agree_on_shallow_relief() {
    let field = relief(37, 23, 0.1, 0.1, 0.1);
    for kappa in [0.0, 1.0, 10.0] {
        for series in [Series::Chebyshev, Series::Taylor] {
            assert!(worst::<f64>(&field, series, 24, kappa) < ROUNDING, "{series:?} κ {kappa}");
        }
    }
}
