//! Deep relief: errors of each expansion of the phase screen against the direct sum, as κH grows.
//!
//! Symbols: κ = 2π(cosθi + cosθo)/λ is the phase rate in 1/µm, H half the range of heights in µm, h the height relative
//! to the middle of the range, and S the power spectral density in µm². The phase screen exp(iκh) is expanded in a
//! Taylor or Chebyshev series in h/H, whose coefficients depend on κH. Taylor's terms grow like e^κH before they
//! cancel, so rounding limits the depth. An order's amplitude is one bin of the Fourier transform of the phase screen.

use super::relief::{rough, uniform_direction};
use super::{largest, percentile_99, table_error};
use crate::benchmarks::BenchError;
use num_complex::{Complex, Complex64};
use serde::Serialize;
use std::f64::consts::{PI, TAU};
use sunbeam::height_field::HeightField;
use sunbeam::height_field::random::Random;
use sunbeam::lobe::{Exact, Surface};
use sunbeam::methods::{Flss, MethodError, MethodOptions, Relief};
use sunbeam::scattering::Options;
use sunbeam::table::{DENSITY_FLOOR_UM2, Model, Progress};
use sunbeam::transform::{Expansion, OrderTransform, Precision, Series, chebyshev_terms, taylor_terms};

/// Values of κH, up to the deepest relief that docs/model.md#hard-cases promises. At 13.56 the relief is 0.82 µm deep,
/// as on the scales of *Xenopeltis*.
pub const KAPPA_H: [f64; 14] = [1.0, 2.0, 4.0, 7.0, 10.0, 13.56, 17.0, 20.0, 25.0, 30.0, 50.0, 100.0, 150.0, 200.0];

/// Remainder to which either series is cut, small enough that rounding dominates the error.
const REMAINDER: f64 = 1e-8;
/// Tolerance of the tables and of the method FLSS.
const TOLERANCE: f64 = 1e-3;
/// Number of pixels of the relief along x and y. Chosen as two different primes, which fast transforms find hardest.
const PIXELS: (usize, usize) = (17, 13);
/// Edges of a pixel along x and y in µm. Chosen, unequal.
const PIXEL_UM: (f64, f64) = (0.11, 0.23);
/// Shortest wavelength of the methods in nm, at which κH is defined.
const SHORTEST_NM: f64 = 380.0;

/// Errors at one κH.
///
/// The error of a series is the largest of any order's amplitude; the squared amplitudes of all orders sum to 1. It is
/// infinite after an overflow, which is `null` in JSON. Errors of S are relative to the scale of a table's tolerance.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct DeepPoint {
    /// κH.
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
    /// Largest error of S by `flss` with Chebyshev's series.
    pub flss_largest: Option<f64>,
    /// 99th percentile of the error of S by `flss` with Taylor's series.
    pub flss_taylor_p99: Option<f64>,
    /// 99th percentile of the error of S by the spectral tables, at a tolerance of 1e-3.
    pub table_p99: f64,
    /// Largest error of S by the spectral tables.
    pub table_largest: f64,
    /// Size of the spectral tables in bytes.
    pub table_bytes: usize,
}

/// Errors at each of [`KAPPA_H`] on a rough relief; errors of S are taken over `directions` pairs of directions.
///
/// # Errors
/// Tables or a method that cannot be built.
pub fn deep_relief(directions: usize) -> Result<Vec<DeepPoint>, BenchError> {
    KAPPA_H.iter().map(|kappa_h| point(*kappa_h, directions)).collect()
}

/// Errors at one κH. The height of the relief follows from κH at the shortest wavelength and normal directions.
fn point(kappa_h: f64, directions: usize) -> Result<DeepPoint, BenchError> {
    let kappa_max = 2.0 * TAU / (SHORTEST_NM * 1e-3);
    let field = rough(&mut Random::new(7), PIXELS, PIXEL_UM, 2.0 * kappa_h / kappa_max)?;
    let taylor = taylor_terms(kappa_h, REMAINDER);
    let chebyshev = chebyshev_terms(kappa_h, REMAINDER);
    let flss = |series| {
        let method_options = MethodOptions { series, ..MethodOptions::default() };
        match Flss::new(&field, Options::default().coherence_length_um, TOLERANCE, &method_options, &Progress::none()) {
            Ok(method) => Ok(Some(method_errors(&field, &method, directions))),
            Err(MethodError::TaylorRange { .. } | MethodError::TooManyTerms { .. }) => Ok(None),
            Err(source) => Err(BenchError::Method { candidate: format!("flss at κH = {kappa_h}"), source }),
        }
    };
    let (mut flss_chebyshev, mut flss_taylor) = (flss(Series::Chebyshev)?, flss(Series::Taylor)?);
    let options = Options { conserve_energy: false, tolerance: TOLERANCE, ..Options::default() };
    let surface = Surface::new(&field, &options)?;
    let exact = Exact::new(&field, &options, None);
    let mut random = Random::new(8);
    let mut table_errors: Vec<f64> = (0..directions)
        .map(|i| {
            let (wi, nm) = (uniform_direction(&mut random), random.between(360.0, 830.0));
            // Most directions are sampled: orders are so narrow that uniform directions are dark.
            let u = [random.unit(), random.unit(), random.unit()];
            let sampled = if i % 4 == 0 { None } else { surface.sample_direction(wi, &[nm], u) };
            table_error(&surface, &exact, wi, sampled.unwrap_or_else(|| uniform_direction(&mut random)), nm)
        })
        .collect();
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
        table_p99: percentile_99(&mut table_errors),
        table_largest: largest(table_errors),
        table_bytes: surface.report().table.bytes,
    })
}

/// Largest error of any order's amplitude by a series of `terms` terms, at one κ in 1/µm.
fn series_error<T: Precision + Into<f64>>(field: &HeightField, series: Series, terms: usize, kappa: f64) -> f64 {
    let expansion = Expansion::<T>::new(field, series, terms);
    let double = |c: Complex<T>| Complex64::new(c.re.into(), c.im.into());
    let truth = OrderTransform::new(field).amplitudes(kappa);
    largest(truth.iter().enumerate().map(|(bin, c)| (double(expansion.amplitude(kappa, bin)) - c).norm()))
}

/// Errors of S at `count` scattering vectors and wavelengths over the whole range, half of them near the centre of an
/// order.
///
/// An error is relative to the largest of the patch's value, the ensemble's value and the density floor.
fn method_errors(field: &HeightField, method: &Flss, count: usize) -> Vec<f64> {
    let oracle = |model| Exact::new(field, &Options { model, conserve_energy: false, ..Options::default() }, None);
    let (patch, mean) = (oracle(Model::Patch), oracle(Model::Ensemble));
    let (lx, ly) = field.extent_um();
    let mut random = Random::new(9);
    let mut errors = Vec::new();
    while errors.len() < count {
        let nm = f64::from(random.between(SHORTEST_NM, 780.0) as f32);
        let um = nm * 1e-3;
        let w = f64::from(random.between(0.02, 2.0) as f32);
        let (radius, azimuth) = ((4.0 - w * w).sqrt() * random.unit().sqrt(), 2.0 * PI * random.unit());
        let near_order = errors.len() % 2 == 0;
        let [u, v] = [(radius * azimuth.cos(), lx), (radius * azimuth.sin(), ly)].map(|(value, extent)| {
            let order = (value * extent / um).round() + random.between(-0.1, 0.1);
            (if near_order { order * um / extent } else { value }) as f32
        });
        let (u64, v64) = (f64::from(u), f64::from(v));
        if u64 * u64 + v64 * v64 + w * w > 4.0 {
            continue;
        }
        let (f, kappa) = ([u64 / um, v64 / um], TAU * w / um);
        let truth = patch.power_density(f, kappa);
        let scale = truth.max(mean.power_density(f, kappa)).max(DENSITY_FLOOR_UM2);
        let found = method.relief_spectral([u, v, w as f32], nm as f32).map_or(f64::NAN, f64::from) * um * um;
        errors.push((found - truth).abs() / scale);
    }
    errors
}
