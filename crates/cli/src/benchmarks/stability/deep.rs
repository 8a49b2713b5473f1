//! Deep relief: errors of each expansion of the phase screen against the direct sum, as κH grows.
//!
//! Symbols:
//!
//! - (u, v, w) = wi + wo: the scattering vector;
//! - f = (u, v)/λ: the spatial frequency in cycles/µm;
//! - κ = 2πw/λ: the phase rate in rad/µm;
//! - h: the height in µm, relative to the middle of the range of heights;
//! - H: half the range of heights in µm;
//! - S(f; κ): the power spectral density in µm². The *patch* model has it for one fixed coherence window, the
//!   *ensemble* model as the mean over all positions of the window.
//!
//! The phase screen exp(iκh) is expanded in a Taylor or Chebyshev series in h/H, whose coefficients depend on κH.
//! Taylor's terms grow like e^κH before they cancel, so rounding limits the depth. An order's amplitude is one bin of
//! the Fourier transform of the phase screen. FLSS is full lambda spectral sampling (Dhillon et al. 2014).

use super::relief::{rough_of_primes, uniform_direction};
use super::{error_scale, largest, percentile_99, table_error};
use crate::arguments::{SHORTEST_VISIBLE_UM, VISIBLE_NM};
use crate::benchmarks::BenchError;
use num_complex::{Complex, Complex64};
use serde::Serialize;
use std::f64::consts::TAU;
use sunbeam::height_field::HeightField;
use sunbeam::height_field::random::Random;
use sunbeam::lobe::{Exact, Surface};
use sunbeam::methods::{Flss, MethodError, MethodOptions, Relief};
use sunbeam::scattering::Options;
use sunbeam::table::{Model, Progress, WAVELENGTH_MAX_NM, WAVELENGTH_MIN_NM};
use sunbeam::transform::{Expansion, OrderTransform, Precision, Series, chebyshev_terms, taylor_terms};

/// Values of κH at 380 nm, up to very deep reliefs (docs/stability.md). At 13.56 the relief is 0.82 µm deep, as on the
/// scales of *Xenopeltis*.
pub const KAPPA_H: [f64; 14] = [1.0, 2.0, 4.0, 7.0, 10.0, 13.56, 17.0, 20.0, 25.0, 30.0, 50.0, 100.0, 150.0, 200.0];

/// Largest remainder of either series. It is so small that rounding dominates the error in single precision; a larger
/// one would hide the rounding.
const REMAINDER: f64 = 1e-8;
/// Tolerance of the tables and of the method FLSS.
const TOLERANCE: f64 = 1e-3;
/// Smallest w of the scattering vectors at which FLSS is compared: there both directions are at most 1.2° above the
/// horizon.
const W_MIN: f64 = 0.02;
/// Largest distance between an order and a scattering vector that is moved there, in orders along each axis. Most
/// random vectors lie between orders, where S is small.
const NEAR_ORDER: f64 = 0.1;

/// Errors at one κH.
///
/// The error of a series is the largest absolute error of any order's amplitude; the squared amplitudes of all orders
/// sum to 1. It is infinite after an overflow, which is `null` in JSON. Errors of S are relative to the scale of a
/// table's tolerance (`error_scale`).
#[derive(Clone, Copy, Debug, Serialize)]
pub struct DeepPoint {
    /// κH at 380 nm along the normal.
    pub kappa_h: f64,
    /// Terms of Taylor's series.
    pub taylor_terms: usize,
    /// Terms of Chebyshev's series.
    pub chebyshev_terms: usize,
    /// Error of Taylor's series in single precision.
    pub taylor_f32: f64,
    /// Error of Taylor's series in double precision.
    pub taylor_f64: f64,
    /// Error of Chebyshev's series in single precision.
    pub chebyshev_f32: f64,
    /// Error of Chebyshev's series in double precision.
    pub chebyshev_f64: f64,
    /// 99th percentile of the error of S by `flss` with Chebyshev's series; `None` where the method refuses the depth.
    pub flss_p99: Option<f64>,
    /// Largest error of S by `flss` with Chebyshev's series; `None` as in `flss_p99`.
    pub flss_largest: Option<f64>,
    /// 99th percentile of the error of S by `flss` with Taylor's series; `None` where the method refuses the depth.
    pub flss_taylor_p99: Option<f64>,
    /// 99th percentile of the error of S by the spectral tables, at a tolerance of `TOLERANCE`.
    pub table_p99: f64,
    /// Largest error of S by the spectral tables.
    pub table_largest: f64,
    /// Size of the spectral tables in bytes.
    pub table_bytes: usize,
}

/// Errors at each of [`KAPPA_H`] on a rough relief. Errors of S are taken over `directions` random queries.
///
/// # Errors
/// Tables or a method that cannot be built.
pub fn deep_relief(directions: usize) -> Result<Vec<DeepPoint>, BenchError> {
    KAPPA_H.iter().map(|kappa_h| point(*kappa_h, directions)).collect()
}

/// Errors at one κH, with the κ of 380 nm and of directions along the normal (w = 2).
fn point(kappa_h: f64, directions: usize) -> Result<DeepPoint, BenchError> {
    let kappa_max = 2.0 * TAU / SHORTEST_VISIBLE_UM;
    // H is half of the range of heights.
    let range_um = 2.0 * kappa_h / kappa_max;
    let field = rough_of_primes(range_um)?;
    let taylor = taylor_terms(kappa_h, REMAINDER);
    let chebyshev = chebyshev_terms(kappa_h, REMAINDER);
    let flss = |series| {
        let method_options = MethodOptions { series, ..MethodOptions::default() };
        match Flss::new(&field, Options::default().coherence_length_um, TOLERANCE, &method_options, &Progress::none()) {
            Ok(method) => Ok(Some(method_errors(&field, &method, directions))),
            // The relief is too deep for the series.
            Err(MethodError::TaylorRange { .. } | MethodError::TooManyTerms { .. }) => Ok(None),
            Err(source) => Err(BenchError::Method { candidate: format!("flss at κH = {kappa_h}"), source }),
        }
    };
    let (mut flss_chebyshev, mut flss_taylor) = (flss(Series::Chebyshev)?, flss(Series::Taylor)?);
    let options = Options { conserve_energy: false, tolerance: TOLERANCE, ..Options::default() };
    let surface = Surface::new(&field, &options)?;
    // Albedos divide the reflectance and not S, so the direct sums here need no table of them (`None`).
    let mut errors_of_tables = table_errors(&surface, &Exact::new(&field, &options, None), directions);
    Ok(DeepPoint {
        kappa_h,
        taylor_terms: taylor,
        chebyshev_terms: chebyshev,
        taylor_f32: series_error::<f32>(&field, Series::Taylor, taylor, kappa_max),
        taylor_f64: series_error::<f64>(&field, Series::Taylor, taylor, kappa_max),
        chebyshev_f32: series_error::<f32>(&field, Series::Chebyshev, chebyshev, kappa_max),
        chebyshev_f64: series_error::<f64>(&field, Series::Chebyshev, chebyshev, kappa_max),
        flss_p99: flss_chebyshev.as_mut().map(|errors| percentile_99(errors)),
        flss_largest: flss_chebyshev.map(largest),
        flss_taylor_p99: flss_taylor.as_mut().map(|errors| percentile_99(errors)),
        table_p99: percentile_99(&mut errors_of_tables),
        table_largest: largest(errors_of_tables),
        table_bytes: surface.report().table.bytes,
    })
}

/// Errors of the tables' S at `count` random pairs of directions, and wavelengths of the tables' whole range.
fn table_errors(surface: &Surface, exact: &Exact, count: usize) -> Vec<f64> {
    // An arbitrary fixed seed.
    let mut random = Random::new(8);
    (0..count)
        .map(|i| {
            let (wi, nm) = (uniform_direction(&mut random), random.between(WAVELENGTH_MIN_NM, WAVELENGTH_MAX_NM));
            // Three of four outgoing directions are sampled: orders are so narrow that most uniform ones are dark.
            let u = [random.unit(), random.unit(), random.unit()];
            let sampled = if i % 4 == 0 { None } else { surface.sample_direction(wi, &[nm], u) };
            table_error(surface, exact, wi, sampled.unwrap_or_else(|| uniform_direction(&mut random)), nm)
        })
        .collect()
}

/// Largest error of any order's amplitude by a series of `terms` terms, at one κ in rad/µm.
fn series_error<T: Precision + Into<f64>>(field: &HeightField, series: Series, terms: usize, kappa: f64) -> f64 {
    let expansion = Expansion::<T>::new(field, series, terms);
    let double = |c: Complex<T>| Complex64::new(c.re.into(), c.im.into());
    let truth = OrderTransform::new(field).amplitudes(kappa);
    largest(truth.iter().enumerate().map(|(bin, c)| (double(expansion.amplitude(kappa, bin)) - c).norm()))
}

/// Errors of S by `method`, which has the patch model, at `count` random scattering vectors (u, v, w) and visible
/// wavelengths. Half of the vectors lie near the centre of an order.
///
/// An error is relative to [`error_scale`], whose mean is the S of the ensemble model.
fn method_errors(field: &HeightField, method: &Flss, count: usize) -> Vec<f64> {
    let exact = |model| Exact::new(field, &Options { model, conserve_energy: false, ..Options::default() }, None);
    let (patch, ensemble) = (exact(Model::Patch), exact(Model::Ensemble));
    let (lx, ly) = field.extent_um();
    // Rounded to single precision, so that the method and the direct sum get equal numbers.
    let single = |value: f64| f64::from(value as f32);
    // An arbitrary fixed seed.
    let mut random = Random::new(9);
    let mut errors = Vec::new();
    while errors.len() < count {
        let nm = single(random.between(*VISIBLE_NM.start(), *VISIBLE_NM.end()));
        let um = nm * 1e-3;
        let w = single(random.between(W_MIN, 2.0));
        // A point (u, v) that is uniform over the disc in which |(u, v, w)| ≤ 2.
        let (radius, azimuth) = ((4.0 - w * w).sqrt() * random.unit().sqrt(), TAU * random.unit());
        let is_near_order = errors.len() % 2 == 0;
        let [u, v] = [(radius * azimuth.cos(), lx), (radius * azimuth.sin(), ly)].map(|(component, extent_um)| {
            let order = (component * extent_um / um).round() + random.between(-NEAR_ORDER, NEAR_ORDER);
            single(if is_near_order { order * um / extent_um } else { component })
        });
        // The move to an order and the rounding may make the vector longer than any sum of two unit vectors.
        if u * u + v * v + w * w > 4.0 {
            continue;
        }
        let (f, kappa) = ([u / um, v / um], TAU * w / um);
        let truth = patch.power_density(f, kappa);
        // The method answers with S/λ². A missing answer becomes NaN, which `largest` makes infinite.
        let answer = method.relief_spectral([u as f32, v as f32, w as f32], nm as f32);
        let found = answer.map_or(f64::NAN, f64::from) * um * um;
        errors.push((found - truth).abs() / error_scale(truth, ensemble.power_density(f, kappa)));
    }
    errors
}
