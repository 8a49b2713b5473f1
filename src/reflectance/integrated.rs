//! The reflectance integrated over wavelength, for renderers that carry colours instead of wavelengths.

use super::{Surface, Vec3};
use crate::colour::{cie_xyz, d65, xyz_to_linear_srgb};
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

/// What the integral over wavelength answers.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct IntegratedAnswer {
    /// `f_r` weighted by D65 and the CIE 1931 functions as linear sRGB, then luminance: 1 for a reflectance of 1.
    pub rgb_y: [f64; 4],
    /// Density of [`Surface::sample_integrated`], 1/sr.
    pub pdf: f64,
}

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
    pub(super) fn at(wavelength_nm: f64) -> [f64; 4] {
        let t = (wavelength_nm - WAVELENGTH_MIN_NM).clamp(0.0, (WEIGHTS.len() - 1) as f64);
        let i = (t as usize).min(WEIGHTS.len() - 2);
        let fraction = t - i as f64;
        std::array::from_fn(|c| (1.0 - fraction) * WEIGHTS[i][c] as f64 + fraction * WEIGHTS[i + 1][c] as f64)
    }
}

/// Centre and inverse width of the density of sampled wavelengths, a squared hyperbolic secant as is common in
/// spectral renderers (Radziszewski et al. 2009), per nm.
const SECH_CENTRE_NM: f64 = 538.0;
const SECH_PER_NM: f64 = 0.0072;

fn tanh_span() -> (f64, f64) {
    let at = |nm: f64| (SECH_PER_NM * (nm - SECH_CENTRE_NM)).tanh();
    (at(WAVELENGTH_MIN_NM), at(WAVELENGTH_MAX_NM))
}

/// A wavelength in nm from a random number in [0, 1), with the density [`wavelength_pdf`].
pub fn sample_wavelength(u: f64) -> f64 {
    let (low, high) = tanh_span();
    let nm = SECH_CENTRE_NM + (low + u * (high - low)).atanh() / SECH_PER_NM;
    nm.clamp(WAVELENGTH_MIN_NM, WAVELENGTH_MAX_NM)
}

/// Density of [`sample_wavelength`] per nm.
pub fn wavelength_pdf(wavelength_nm: f64) -> f64 {
    let (low, high) = tanh_span();
    SECH_PER_NM / ((high - low) * (SECH_PER_NM * (wavelength_nm - SECH_CENTRE_NM)).cosh().powi(2))
}

impl Surface {
    /// The integrals over wavelength of the weighted reflectance and of the sampler's density, by the midpoint rule in
    /// the wavenumber: there, frequency and κ are linear, so steps follow the widths of orders and splines.
    pub fn eval_pdf_integrated(&self, wi: Vec3, wo: Vec3) -> IntegratedAnswer {
        let Some(pair) = self.pair(wi, wo) else { return IntegratedAnswer::default() };
        let (first, last) = (1.0 / WAVELENGTH_MAX_NM, 1.0 / WAVELENGTH_MIN_NM);
        let steps = self.integration_steps([wi[0] + wo[0], wi[1] + wo[1], wi[2] + wo[2]]);
        let step = (last - first) / steps as f64;
        let mut sum = IntegratedAnswer::default();
        for k in 0..steps {
            let wavelength_nm = 1.0 / (first + (k as f64 + 0.5) * step);
            let width_nm = step * wavelength_nm * wavelength_nm;
            let answer = pair.at(wavelength_nm);
            for (total, weight) in sum.rgb_y.iter_mut().zip(WavelengthWeights::at(wavelength_nm)) {
                *total += answer.f * weight * width_nm;
            }
            sum.pdf += answer.pdf * wavelength_pdf(wavelength_nm) * width_nm;
        }
        // Wavelengths at which nothing is red or blue make those weights negative.
        sum.rgb_y = sum.rgb_y.map(|value| value.max(0.0));
        sum
    }

    /// A direction for a wavelength drawn by [`sample_wavelength`]; arguments as in [`Surface::sample_direction`].
    pub fn sample_integrated(&self, wi: Vec3, u: [f64; 3]) -> Option<Vec3> {
        if u[0] < super::UNIFORM_SHARE {
            return self.sample_direction(wi, &[], u);
        }
        let left = (u[0] - super::UNIFORM_SHARE) / (1.0 - super::UNIFORM_SHARE);
        (wi[2] > 0.0).then(|| self.sample_order(wi, sample_wavelength(left), [u[1], u[2]]))?
    }

    fn integration_steps(&self, [u, v, w]: [f64; 3]) -> usize {
        let wavenumbers = 1e3 / WAVELENGTH_MIN_NM - 1e3 / WAVELENGTH_MAX_NM;
        let (x, y) = (&self.table().lattice().x, &self.table().lattice().y);
        let orders = (u * x.period_um / x.sigma).hypot(v * y.period_um / y.sigma) / STEP_SIGMAS;
        let knots = TAU * w / self.table().kappa_step();
        (wavenumbers * orders.max(knots)).clamp(STEPS_MIN, STEPS_MAX) as usize
    }
}
