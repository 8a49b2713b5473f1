//! One spacing and nothing else, as a reflectance: our form of Stam's model, the default form `spacing` of the method `stam`.
//! The shader that Stam published in GPU Gems is [`super::StamGems`].
//!
//! Light goes to the orders ±1 … ±8 of the spacing d along x, a sixteenth to each whatever the relief, so that
//! `λ = d|u|/n`; the orders 0, which GPU Gems draws as a highlight of its own, are left out. The grooves are taken to be
//! scattered along y, which spreads each order evenly over the two units of v that a hemisphere spans:
//! `S = Σ_n δ(u/λ − n/d)/16 · λ/2`. Its total over (u, v) is 1. With the δ, the sum over wavelengths is
//! `relief_rgb = Σ_n weight(λ_n) · d/(32 n)`, weight the colours per µm. A value at a single wavelength has the Gaussian of the
//! coherence window in place of the δ.

use super::colours::{self, Colours, colour_density};
use super::{
    MethodError, MethodOptions, MethodShader, Relief, WAVELENGTH_MAX_UM, WAVELENGTH_MIN_UM, is_query, spectral_range_um,
};
use crate::height_field::HeightField;
use crate::table::CoherenceWindow;
use crate::transform::periods;
use bytemuck::{Pod, Zeroable};
use std::borrow::Cow;
use std::f32::consts::PI;

const WGSL: &str = concat!(include_str!("colours.wgsl"), include_str!("stam.wgsl"));

/// Orders on either side.
pub(super) const ORDERS: u32 = 8;
/// Range of v over the outgoing hemisphere.
pub(super) const V_RANGE: f32 = 2.0;

#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub(super) struct StamUniform {
    pub period_um: f32,
    pub _pad0: u32,
    pub _pad1: u32,
    pub _pad2: u32,
}

/// One spacing.
pub struct Stam {
    period_um: f32,
    /// Standard deviation s of the coherence window.
    window_um: f32,
    colours: Colours,
}

impl Stam {
    /// Takes `period_um` of the options, or the dominant period of `field` along x.
    ///
    /// # Errors
    /// [`MethodError::NoPeriod`] where there is none.
    pub fn new(field: &HeightField, coherence_length_um: f64, options: &MethodOptions) -> Result<Self, MethodError> {
        Ok(Self {
            period_um: spacing_um(field, options)?,
            window_um: CoherenceWindow::from_length_um(coherence_length_um).sigma_um() as f32,
            colours: colours::density()?,
        })
    }
}

/// `period_um` of the options, or the dominant period of `field` along x; [`MethodError::NoPeriod`] where there is none.
pub(super) fn spacing_um(field: &HeightField, options: &MethodOptions) -> Result<f32, MethodError> {
    let found = || periods(field, true).x.map(|period| period.period_um);
    options.period_um.or_else(found).map(|period_um| period_um as f32).ok_or(MethodError::NoPeriod)
}

impl Relief for Stam {
    fn relief_rgb(&self, q: [f32; 3]) -> [f32; 3] {
        let mut rgb = [0.0; 3];
        if is_query(q) {
            for n in 1..=ORDERS {
                let wavelength_um = self.period_um * q[0].abs() / n as f32;
                if (WAVELENGTH_MIN_UM..=WAVELENGTH_MAX_UM).contains(&wavelength_um) {
                    let colour = colour_density(&self.colours, wavelength_um);
                    rgb = [0, 1, 2].map(|c| rgb[c] + self.period_um / n as f32 * colour[c]);
                }
            }
        }
        rgb.map(|value| value / (2.0 * ORDERS as f32 * V_RANGE))
    }

    fn relief_spectral(&self, q: [f32; 3], wavelength_nm: f32) -> Option<f32> {
        let Some(um) = spectral_range_um(wavelength_nm).filter(|_| is_query(q)) else { return Some(0.0) };
        let line = |n: u32| {
            let distance = q[0].abs() / um - n as f32 / self.period_um;
            (-(2.0 * PI * self.window_um * distance).powi(2)).exp()
        };
        let lines: f32 = (1..=ORDERS).map(line).sum();
        Some(2.0 * PI.sqrt() * self.window_um * lines / (2.0 * ORDERS as f32 * V_RANGE * um))
    }

    fn relief_shader(&self) -> MethodShader<'_> {
        let uniform = StamUniform { period_um: self.period_um, _pad0: 0, _pad1: 0, _pad2: 0 };
        MethodShader {
            name: "stam",
            wgsl: vec![WGSL],
            uniform: bytemuck::bytes_of(&uniform).to_vec(),
            storage: vec![Cow::Borrowed(bytemuck::cast_slice(&self.colours))],
        }
    }
}
