//! The reflectance integrated over wavelength, for renderers that carry colours instead of wavelengths.

use super::Surface;
use crate::colour::{cie_xyz, d65, xyz_to_linear_srgb};
use crate::scattering::Vec3;
use crate::table::{WAVELENGTH_MAX_NM, WAVELENGTH_MIN_NM};
use std::f64::consts::TAU;
use std::sync::LazyLock;

/// Fewest wavelengths of the integral: the colour matching functions are wider than the steps.
const STEPS_MIN: f64 = 64.0;
/// Most wavelengths of the integral. Orders narrower than the steps are then met by chance.
const STEPS_MAX: f64 = 1024.0;
/// Step in standard deviations of an order's Gaussian along the path that the frequency takes with the wavelength; the
/// midpoint rule errs by `exp(−2π²/1.5²)` ≈ 2e-4 there.
const STEP_SIGMAS: f64 = 1.5;

/// Weights of wavelengths at every whole nm of the tables' range, per nm: linear sRGB and luminance under D65, each
/// with an integral of one.
pub struct WavelengthWeights;

static WEIGHTS: LazyLock<Vec<[f32; 4]>> = LazyLock::new(|| {
    let count = (WAVELENGTH_MAX_NM - WAVELENGTH_MIN_NM) as usize + 1;
    let raw: Vec<[f64; 4]> = (0..count)
        .map(|i| {
            let nm = WAVELENGTH_MIN_NM + i as f64;
            let xyz = cie_xyz(nm).map(|value| value * d65(nm));
            let [r, g, b] = xyz_to_linear_srgb(xyz);
            [r, g, b, xyz[1]]
        })
        .collect();
    let total: [f64; 4] = std::array::from_fn(|c| raw.iter().map(|w| w[c]).sum());
    raw.iter().map(|w| std::array::from_fn(|c| (w[c] / total[c]) as f32)).collect()
});

impl WavelengthWeights {
    /// Red, green, blue and luminance for each whole nm from [`WAVELENGTH_MIN_NM`].
    pub fn per_nm() -> &'static [[f32; 4]] {
        &WEIGHTS
    }

    /// Weights at a wavelength in the tables' range, linear between whole nm.
    pub(crate) fn at(wavelength_nm: f64) -> [f64; 4] {
        let t = (wavelength_nm - WAVELENGTH_MIN_NM).clamp(0.0, (WEIGHTS.len() - 1) as f64);
        let i = (t as usize).min(WEIGHTS.len() - 2);
        let fraction = t - i as f64;
        std::array::from_fn(|c| (1.0 - fraction) * WEIGHTS[i][c] as f64 + fraction * WEIGHTS[i + 1][c] as f64)
    }
}

impl Surface {
    /// `f_r` weighted by D65 and the CIE 1931 functions as linear sRGB, then luminance, Fresnel reflectance left out: 1 for a
    /// reflectance of 1. By the midpoint rule in the wavenumber: there, frequency and κ are linear, so steps follow the
    /// widths of orders and splines.
    pub fn integrated(&self, wi: Vec3, wo: Vec3) -> [f64; 4] {
        let (first, last) = (1.0 / WAVELENGTH_MAX_NM, 1.0 / WAVELENGTH_MIN_NM);
        let steps = self.integration_steps([wi[0] + wo[0], wi[1] + wo[1], wi[2] + wo[2]]);
        let step = (last - first) / steps as f64;
        let mut sum = [0.0; 4];
        for k in 0..steps {
            let wavelength_nm = 1.0 / (first + (k as f64 + 0.5) * step);
            let width_nm = step * wavelength_nm * wavelength_nm;
            let value = self.eval(wi, wo, wavelength_nm) * width_nm;
            for (total, weight) in sum.iter_mut().zip(WavelengthWeights::at(wavelength_nm)) {
                *total += value * weight;
            }
        }
        sum
    }

    fn integration_steps(&self, [u, v, w]: [f64; 3]) -> usize {
        let wavenumbers = 1e3 / WAVELENGTH_MIN_NM - 1e3 / WAVELENGTH_MAX_NM;
        let layout = self.table().layout();
        let along = |axis: usize, q: f64| q * layout.period_um[axis] / layout.sigma[axis];
        let orders = along(0, u).hypot(along(1, v)) / STEP_SIGMAS;
        let knots = TAU * w / layout.kappa_step;
        (wavenumbers * orders.max(knots)).clamp(STEPS_MIN, STEPS_MAX) as usize
    }
}
