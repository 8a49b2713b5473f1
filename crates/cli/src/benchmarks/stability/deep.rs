//! Deep relief: each expansion of the phase screen against the direct sum as κH grows.

use super::relief::{anywhere, rough};
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

/// Phase rates times half the range of heights, up to the deepest that the model promises.
pub const KAPPA_H: [f64; 14] = [1.0, 2.0, 4.0, 7.0, 10.0, 13.56, 17.0, 20.0, 25.0, 30.0, 50.0, 100.0, 150.0, 200.0];

/// What the remainder of either series is kept below, so that what is left is rounding.
const REMAINDER: f64 = 1e-8;
/// Tolerance of the tables and of the method FLSS.
const TOLERANCE: f64 = 1e-3;
/// Pixels of the relief and their edges in µm: neither square nor with a common factor.
const PIXELS: (usize, usize) = (17, 13);
const PIXEL_UM: (f64, f64) = (0.11, 0.23);
/// Shortest wavelength of the methods, in nm, at which κH is meant.
const SHORTEST_NM: f64 = 380.0;

/// Errors at one κH. Those of the series are the largest of any order amplitude, whose squares sum to 1; infinite where
/// a number overflows, which JSON says as `null`.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct DeepPoint {
    pub kappa_h: f64,
    pub taylor_terms: usize,
    pub chebyshev_terms: usize,
    pub taylor_f32: f64,
    pub taylor_f64: f64,
    pub chebyshev_f32: f64,
    pub chebyshev_f64: f64,
    /// 99th percentile and largest error of S by `flss` with its own Bessel functions, in single precision, relative as a
    /// table's is. Chebyshev's series.
    pub flss_p99: Option<f64>,
    pub flss_largest: Option<f64>,
    /// The same with Taylor's series; `None` where the method refuses the depth.
    pub flss_taylor_p99: Option<f64>,
    /// The same of the spectral tables at a tolerance of 1e-3.
    pub table_p99: f64,
    pub table_largest: f64,
    /// Bytes of those tables.
    pub table_bytes: usize,
}

/// Errors at each of [`KAPPA_H`] on a rough relief, over `directions` pairs of directions where directions matter.
///
/// # Errors
/// Tables or a method that were not made.
pub fn deep_relief(directions: usize) -> Result<Vec<DeepPoint>, BenchError> {
    KAPPA_H.iter().map(|kappa_h| point(*kappa_h, directions)).collect()
}

fn point(kappa_h: f64, directions: usize) -> Result<DeepPoint, BenchError> {
    let kappa_max = 2.0 * TAU / (SHORTEST_NM * 1e-3);
    let field = rough(&mut Random::new(7), PIXELS, PIXEL_UM, 2.0 * kappa_h / kappa_max)?;
    let taylor = taylor_terms(kappa_h, REMAINDER);
    let chebyshev = chebyshev_terms(kappa_h, REMAINDER);
    let flss = |series| {
        let asked = MethodOptions { series, ..MethodOptions::default() };
        match Flss::new(&field, Options::default().coherence_length_um, TOLERANCE, &asked, &Progress::none()) {
            Ok(method) => Ok(Some(method_errors(&field, &method, directions))),
            Err(MethodError::TaylorRange { .. } | MethodError::TooManyTerms { .. }) => Ok(None),
            Err(source) => Err(BenchError::Method { candidate: format!("flss at κH = {kappa_h}"), source }),
        }
    };
    let (mut own, mut sources) = (flss(Series::Chebyshev)?, flss(Series::Taylor)?);
    let options = Options { conserve_energy: false, tolerance: TOLERANCE, ..Options::default() };
    let surface = Surface::new(&field, &options)?;
    let exact = Exact::new(&field, &options, None);
    let mut random = Random::new(8);
    let mut tables: Vec<f64> = (0..directions)
        .map(|i| {
            let (wi, nm) = (anywhere(&mut random), random.between(360.0, 830.0));
            // Orders stand apart: directions anywhere are dark.
            let u = [random.unit(), random.unit(), random.unit()];
            let lit = if i % 4 == 0 { None } else { surface.sample_direction(wi, &[nm], u) };
            table_error(&surface, &exact, wi, lit.unwrap_or_else(|| anywhere(&mut random)), nm)
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
        flss_p99: own.as_mut().map(|errors| percentile_99(errors)),
        flss_largest: own.map(largest),
        flss_taylor_p99: sources.as_mut().map(|errors| percentile_99(errors)),
        table_p99: percentile_99(&mut tables),
        table_largest: largest(tables),
        table_bytes: surface.report().table.bytes,
    })
}

/// Largest error of any order amplitude at one κ.
fn series_error<T: Precision + Into<f64>>(field: &HeightField, series: Series, terms: usize, kappa: f64) -> f64 {
    let expansion = Expansion::<T>::new(field, series, terms);
    let double = |c: Complex<T>| Complex64::new(c.re.into(), c.im.into());
    let truth = OrderTransform::new(field).amplitudes(kappa);
    largest(truth.iter().enumerate().map(|(bin, c)| (double(expansion.amplitude(kappa, bin)) - c).norm()))
}

/// Errors of S at places and wavelengths over the whole range, every second near whole orders, relative to the largest of
/// the value, its mean over window places and the density floor.
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
        let (distance, turn) = ((4.0 - w * w).sqrt() * random.unit().sqrt(), 2.0 * PI * random.unit());
        let place = [(distance * turn.cos(), lx), (distance * turn.sin(), ly)];
        let near = errors.len() % 2 == 0;
        let [u, v] = place.map(|(value, extent)| {
            let order = (value * extent / um).round() + random.between(-0.1, 0.1);
            (if near { order * um / extent } else { value }) as f32
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
