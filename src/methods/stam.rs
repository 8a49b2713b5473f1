//! The method `stam` in its default form `spacing`: gratings of one groove spacing, as a reflectance. This form of
//! Stam's model (docs/model.md#sources) is the library's own; the shader that Stam published in GPU Gems is
//! [`super::StamGems`].
//!
//! `q = wi + wo = (u, v, w)` is the scattering vector, and the spacing d lies along x. Each of the orders ±1 to ±8 gets
//! a sixteenth of the light, for any relief. Order 0, which GPU Gems draws as a highlight, is left out. The grooves are
//! assumed to scatter along y, which spreads each order uniformly over v from −1 to 1. The power spectrum in µm² is
//! therefore
//!
//! `S = Σ_n δ(u/λ − n/d) · 1/16 · λ/2`, n = ±1 to ±8, and `∫∫ S/λ² du dv = 1`.
//!
//! The factor 1/16 is the fraction of an order, and 1/2 the density over v. `∫ δ(u/λ − n/d) dλ` is `λ_n²/|u|`, with the
//! wavelength `λ_n = d|u|/|n|` of order n at u. Only the eight orders with the sign of u contribute. The integral of
//! `S/λ²` over the wavelength is therefore `relief_rgb = Σ_n weight(λ_n)·d/(32n)`, n = 1 to 8, with the colour weights
//! per µm. The same value is used at every v, also beyond ±1, which oblique light can reach.
//!
//! A value at a single wavelength has the Gaussian of the coherence window, of standard deviation s, in place of δ:
//! `2√π·s·exp(−(2πs·x)²)` for δ(x).

use super::colours::{self, Colours, colour_density};
use super::{
    MethodError, MethodOptions, MethodShader, Relief, WAVELENGTH_MAX_UM, WAVELENGTH_MIN_UM, is_query, visible_um,
};
use crate::height_field::HeightField;
use crate::table::CoherenceWindow;
use crate::transform::periods;
use crate::wgsl;
use bytemuck::{Pod, Zeroable};
use std::borrow::Cow;
use std::f32::consts::PI;

/// Sources of the shader.
const WGSL: [&str; 2] = [wgsl!("colours.wgsl"), wgsl!("stam.wgsl")];

/// Number of orders on each side of order 0. Larger values spread the light over more orders; the fractions sum to 1
/// for any number. GPU Gems has 7.
pub(super) const ORDERS: u32 = 8;
/// Length of the interval of v over which an order spreads: that of the outgoing hemisphere at normal incidence.
pub(super) const V_RANGE: f32 = 2.0;

/// The uniform struct of stam.wgsl.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub(super) struct StamUniform {
    /// The spacing d in µm.
    pub period_um: f32,
    pub _pad0: u32,
    pub _pad1: u32,
    pub _pad2: u32,
}

/// The method `stam` in its form `spacing`.
pub struct Stam {
    /// The spacing d in µm.
    period_um: f32,
    /// Standard deviation of the coherence window in µm.
    window_um: f32,
    /// Density of the colour weights over the wavelength, per µm.
    colours: Colours,
}

impl Stam {
    /// Builds the method with the spacing `period_um` of the options, or else the dominant period of `field` along x.
    /// The coherence length in µm is four standard deviations of the window.
    ///
    /// # Errors
    /// [`MethodError::NoPeriod`] where the options give none and the field has none.
    pub fn new(field: &HeightField, coherence_length_um: f64, options: &MethodOptions) -> Result<Self, MethodError> {
        Ok(Self {
            period_um: spacing_um(field, options)?,
            window_um: CoherenceWindow::new(coherence_length_um).sigma_um() as f32,
            colours: colours::density()?,
        })
    }
}

/// The spacing in µm: `period_um` of the options, or else the dominant period along x of `field`, a tile that repeats.
///
/// # Errors
/// [`MethodError::NoPeriod`] where the options give none and the field has none; the errors of
/// [`MethodOptions::validate`].
pub(super) fn spacing_um(field: &HeightField, options: &MethodOptions) -> Result<f32, MethodError> {
    options.validate()?;
    let repeats = true;
    let found = || periods(field, repeats).x.map(|period| period.period_um);
    options.period_um.or_else(found).map(|period_um| period_um as f32).ok_or(MethodError::NoPeriod)
}

impl Relief for Stam {
    fn relief_rgb(&self, q: [f32; 3]) -> [f32; 3] {
        let mut rgb = [0.0; 3];
        // 0 unless q can be the sum of two unit vectors above the surface.
        if is_query(q) {
            for n in 1..=ORDERS {
                let wavelength_um = self.period_um * q[0].abs() / n as f32;
                if (WAVELENGTH_MIN_UM..=WAVELENGTH_MAX_UM).contains(&wavelength_um) {
                    let colour = colour_density(&self.colours, wavelength_um);
                    rgb = [0, 1, 2].map(|c| rgb[c] + self.period_um / n as f32 * colour[c]);
                }
            }
        }
        // The fraction of an order, times the density over v.
        rgb.map(|value| value / (2.0 * ORDERS as f32 * V_RANGE))
    }

    fn relief_spectral(&self, q: [f32; 3], wavelength_nm: f32) -> Option<f32> {
        let Some(um) = visible_um(wavelength_nm).filter(|_| is_query(q)) else { return Some(0.0) };
        // Orders of the other sign are at least 1/d away from u/λ, and are left out.
        let gaussian = |n: u32| {
            let distance_per_um = q[0].abs() / um - n as f32 / self.period_um;
            (-(2.0 * PI * self.window_um * distance_per_um).powi(2)).exp()
        };
        let sum: f32 = (1..=ORDERS).map(gaussian).sum();
        Some(2.0 * PI.sqrt() * self.window_um * sum / (2.0 * ORDERS as f32 * V_RANGE * um))
    }

    fn relief_shader(&self) -> MethodShader<'_> {
        let uniform = StamUniform { period_um: self.period_um, _pad0: 0, _pad1: 0, _pad2: 0 };
        MethodShader {
            name: "stam",
            wgsl: WGSL.to_vec(),
            uniform: bytemuck::bytes_of(&uniform).to_vec(),
            storage: vec![Cow::Borrowed(bytemuck::cast_slice(&self.colours))],
        }
    }
}
