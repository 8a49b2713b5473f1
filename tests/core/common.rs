//! Helpers of several test binaries.
#![allow(dead_code, reason = "each binary uses some of them")]

use ndarray::Array2;
use std::f64::consts::{PI, TAU};
use std::sync::{Arc, Mutex, OnceLock, PoisonError};
use sunbeam::cache::Cache;
use sunbeam::colour::{ciede2000, linear_srgb_to_lab};
use sunbeam::config::{BuiltSurface, SurfaceConfig};
use sunbeam::height_field::{HeightField, Preset};
use sunbeam::lobe::{Exact, Surface};
use sunbeam::scattering::{Options, Vec3};
use sunbeam::table::{DENSITY_FLOOR_UM2, Progress};

/// SplitMix64, a generator with equal numbers on all machines.
pub(crate) struct Random(u64);

impl Random {
    pub(crate) fn new(seed: u64) -> Self {
        Self(seed)
    }

    /// Uniform in [0, 1).
    pub(crate) fn unit(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64
    }

    pub(crate) fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit()
    }

    pub(crate) fn three(&mut self) -> [f64; 3] {
        [self.unit(), self.unit(), self.unit()]
    }

    /// Uniform over the upper hemisphere.
    pub(crate) fn direction(&mut self) -> Vec3 {
        let theta = (1.0 - self.unit()).acos().to_degrees();
        direction(theta, self.between(-180.0, 180.0))
    }

    /// Uniform over the tables' wavelengths.
    pub(crate) fn wavelength_nm(&mut self) -> f64 {
        self.between(360.0, 830.0)
    }
}

/// The direction at `theta` from the normal and `phi` from the tangent, in degrees.
pub(crate) fn direction(theta: f64, phi: f64) -> Vec3 {
    let ((st, ct), (sp, cp)) = (theta.to_radians().sin_cos(), phi.to_radians().sin_cos());
    [st * cp, st * sp, ct]
}

pub(crate) fn preset(preset: Preset) -> HeightField {
    preset.build(None, None).unwrap()
}

/// Folder of the tables that tests in all languages share and keep. File names contain a hash of the sources that build
/// the tables.
pub(crate) const CACHE_FOLDER: &str = concat!(env!("CARGO_TARGET_TMPDIR"), "/../test_cache");

/// Cache of the tables that tests share.
pub(crate) fn cache() -> Cache {
    const LIMIT_BYTES: u64 = 2_000_000_000;
    Cache::new(CACHE_FOLDER, LIMIT_BYTES)
}

/// A surface shared by all tests of the process, since the tables of a skin take seconds.
pub(crate) fn built(field: &HeightField, options: &Options) -> Arc<Surface> {
    type Entry = (HeightField, Options, Arc<OnceLock<Arc<Surface>>>);
    static BUILT: Mutex<Vec<Entry>> = Mutex::new(Vec::new());
    let place = {
        let mut all = BUILT.lock().unwrap_or_else(PoisonError::into_inner);
        match all.iter().find(|(of, with, _)| of == field && with == options) {
            Some((.., place)) => place.clone(),
            None => {
                let place = Arc::default();
                all.push((field.clone(), options.clone(), Arc::clone(&place)));
                place
            }
        }
    };
    place.get_or_init(|| Arc::new(cache().surface(field, options, &Progress::none()).unwrap().0)).clone()
}

/// The surface of a configuration in JSON, with tables that tests share.
pub(crate) fn configured(json: &str) -> BuiltSurface {
    SurfaceConfig::from_json(json).unwrap().build_by_theory(&cache(), &Progress::none()).unwrap().0
}

/// Value of a surface in 1/sr at one wavelength in nm.
pub(crate) fn eval(surface: &BuiltSurface, wi: Vec3, wo: Vec3, nm: f64) -> f64 {
    let mut value = f64::NAN;
    surface.eval(wi, wo, &[nm], |_, f| value = f);
    value
}

/// ΔE₀₀ between pairs of true and found colours in linear sRGB, ascending, at an exposure that clips a tenth of the lit
/// pixels.
pub(crate) fn colour_differences(pixels: &[([f64; 3], [f64; 3])]) -> Vec<f64> {
    let brightest = |rgb: &[f64; 3]| rgb.iter().fold(0.0f64, |a, b| a.max(*b));
    let peak = pixels.iter().map(|(truth, _)| brightest(truth)).fold(0.0, f64::max);
    let mut lit: Vec<f64> = pixels.iter().map(|(t, _)| brightest(t)).filter(|v| *v > 1e-4 * peak).collect();
    lit.sort_by(f64::total_cmp);
    let exposure = 1.0 / lit[lit.len() * 9 / 10];
    let lab = |rgb: &[f64; 3]| linear_srgb_to_lab(rgb.map(|v| (v * exposure).clamp(0.0, 1.0)));
    let mut errors: Vec<f64> = pixels.iter().map(|(truth, found)| ciede2000(lab(truth), lab(found))).collect();
    errors.sort_by(f64::total_cmp);
    errors
}

/// A rough relief of `nx` by `ny` pixels with heights from about 0 to `height_um`.
pub(crate) fn relief(nx: usize, ny: usize, dx_um: f64, dy_um: f64, height_um: f64) -> HeightField {
    let mut random = Random::new((nx * 1000 + ny) as u64);
    let heights = Array2::from_shape_simple_fn((ny, nx), || height_um * random.unit());
    HeightField::new(heights, dx_um, dy_um).unwrap()
}

/// A smooth periodic relief with slopes as on real surfaces.
pub(crate) fn waves(nx: usize, ny: usize, dx_um: f64, dy_um: f64, height_um: f64) -> HeightField {
    let height = |(iy, ix): (usize, usize)| {
        let (x, y) = (TAU * ix as f64 / nx as f64, TAU * iy as f64 / ny as f64);
        height_um * (0.5 + 0.25 * (3.0 * x + y).sin() + 0.15 * (x - 2.0 * y).cos() + 0.1 * (5.0 * y + 0.3).sin())
    };
    HeightField::new(Array2::from_shape_fn((ny, nx), height), dx_um, dy_um).unwrap()
}

/// `amplitude_um · sin(2πx/period)` sampled `n` times.
pub(crate) fn sinusoid(n: usize, period_um: f64, amplitude_um: f64) -> HeightField {
    let height = |(_, ix): (usize, usize)| amplitude_um * (TAU * ix as f64 / n as f64).sin();
    HeightField::new(Array2::from_shape_fn((1, n), height), period_um / n as f64, period_um).unwrap()
}

/// `S(f; κ)` in µm² from the table, and its mean over the κ of the outgoing hemisphere.
pub(crate) fn table_density(surface: &Surface, wi: Vec3, wo: Vec3, wavelength_nm: f64) -> (f64, f64) {
    let um = wavelength_nm * 1e-3;
    let f = [(wi[0] + wo[0]) / um, (wi[1] + wo[1]) / um];
    let value = surface.table().density(f, TAU * (wi[2] + wo[2]) / um);
    (value, surface.table().hemisphere_mean(f, wi[2], um))
}

/// Error of the table's S relative to the largest of the oracle's value, the mean over κ, and the density floor.
pub(crate) fn table_error(surface: &Surface, exact: &Exact, wi: Vec3, wo: Vec3, wavelength_nm: f64) -> f64 {
    let um = wavelength_nm * 1e-3;
    let f = [(wi[0] + wo[0]) / um, (wi[1] + wo[1]) / um];
    let (value, mean) = table_density(surface, wi, wo, wavelength_nm);
    let truth = exact.power_density(f, TAU * (wi[2] + wo[2]) / um);
    (value - truth).abs() / truth.max(mean).max(DENSITY_FLOOR_UM2)
}

/// The oracle for a field with the surface's options.
pub(crate) fn oracle(field: &HeightField, surface: &Surface) -> Exact {
    Exact::new(field, surface.options(), surface.albedo_table().cloned())
}

/// Bessel function of the first kind by its integral, `(1/π)∫ cos(mt − x sin t) dt`, exact for the midpoint rule.
pub(crate) fn bessel(m: i32, x: f64) -> f64 {
    let n = 200;
    (0..n).map(|i| (i as f64 + 0.5) * PI / f64::from(n)).map(|t| (f64::from(m) * t - x * t.sin()).cos()).sum::<f64>()
        / f64::from(n)
}
