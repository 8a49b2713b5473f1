//! The method `stam` in its form `gems`: Stam's shader as published in GPU Gems, chapter 8 ("Simulating Diffraction").
//!
//! With `q = wi + wo = (u, v, w)`, not normalised, and the spacing d along x, the colour is
//!
//! `highlight·exp(−(r·d·u/w)²) + Σ_n bump(λ_n)`, with `bump(λ) = max(0, 1 − ((λ − centre)/HALF_WIDTH_UM)²)`.
//!
//! The first summand is order 0, a highlight about the mirror direction u = 0, with the sharpness r in 1/µm.
//! `λ_n = d|u|/n`, n = 1 to 7, is the wavelength of order ±n in µm. Each channel has a bump at its own centre, so
//! orders are visible from 0.5 to 1 µm instead of 0.38 to 0.78 µm. (The chapter writes `y = 2λ − 1` and
//! `1 − (4(y − c))²` with c = 0.75, 0.5, 0.25, so the centres are (1 + c)/2 and the half width is 1/8.)
//!
//! The chapter writes this colour to the pixel. The colour contains no Fresnel factor, obliquity factor or cosine, and
//! is not scaled to the incident light. The answer is the whole reflectance `f_r`, the colour over `π cosθi`, where θi
//! is the angle of incidence. A light whose irradiance on a perpendicular plane is π gives a white diffuse surface that
//! faces it the radiance 1. Under this light a picture shows the colour itself at any θi.

use super::stam::spacing_um;
use super::{AnswerKind, DIVISOR_MIN, Method, MethodError, MethodOptions, MethodShader, is_query, sum};
use crate::height_field::HeightField;
use crate::wgsl;
use bytemuck::{Pod, Zeroable};
use std::f32::consts::PI;

/// Source of the shader.
const WGSL: &str = wgsl!("stam_gems.wgsl");

/// Number of orders on each side of order 0; the chapter's value.
pub(super) const GEMS_ORDERS: u32 = 7;
/// Centre of the red bump in µm.
pub(super) const RED_UM: f32 = 0.875;
/// Centre of the green bump in µm.
pub(super) const GREEN_UM: f32 = 0.75;
/// Centre of the blue bump in µm.
pub(super) const BLUE_UM: f32 = 0.625;
/// Half width of a bump in µm.
pub(super) const HALF_WIDTH_UM: f32 = 0.125;

/// The uniform struct of stam_gems.wgsl.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub(super) struct StamGemsUniform {
    /// Colour of the highlight, linear sRGB.
    pub highlight: [f32; 3],
    /// Sharpness r of the highlight in 1/µm.
    pub sharpness: f32,
    /// The spacing d in µm.
    pub period_um: f32,
    pub _pad0: u32,
    pub _pad1: u32,
    pub _pad2: u32,
}

/// The method `stam` in its form `gems`.
pub struct StamGems(StamGemsUniform);

impl StamGems {
    /// Builds the method with the spacing `period_um` of the options, or else the dominant period of `field` along x.
    /// The options also give the highlight's colour and sharpness.
    ///
    /// # Errors
    /// [`MethodError::NoPeriod`] where the options give none and the field has none.
    pub fn new(field: &HeightField, options: &MethodOptions) -> Result<Self, MethodError> {
        Ok(Self(StamGemsUniform {
            highlight: options.gems_highlight.map(|value| value as f32),
            sharpness: options.gems_sharpness as f32,
            period_um: spacing_um(field, options)?,
            _pad0: 0,
            _pad1: 0,
            _pad2: 0,
        }))
    }
}

impl Method for StamGems {
    fn answer_rgb(&self, wi: [f32; 3], wo: [f32; 3]) -> [f32; 3] {
        let q = sum(wi, wo);
        // 0 unless q can be the sum of two unit vectors above the surface.
        if !is_query(q) {
            return [0.0; 3];
        }
        let StamGemsUniform { highlight, sharpness, period_um, .. } = self.0;
        // d·u: its magnitude is n times the wavelength of order n.
        let path_um = period_um * q[0];
        let scaled_slope = sharpness * path_um / q[2];
        let mut rgb = highlight.map(|value| value * (-scaled_slope * scaled_slope).exp());
        for n in 1..=GEMS_ORDERS {
            let wavelength_um = path_um.abs() / n as f32;
            for (value, centre_um) in rgb.iter_mut().zip([RED_UM, GREEN_UM, BLUE_UM]) {
                let x = (wavelength_um - centre_um) / HALF_WIDTH_UM;
                *value += (1.0 - x * x).max(0.0);
            }
        }
        // wi[2] is cosθi; its lower bound keeps the answer finite for light along the surface.
        rgb.map(|value| value / (PI * wi[2].max(DIVISOR_MIN)))
    }

    // The bumps are colours, without a spectrum.
    fn answer_spectral(&self, _: [f32; 3], _: [f32; 3], _: f32) -> Option<f32> {
        None
    }

    fn answers(&self) -> AnswerKind {
        AnswerKind::Reflectance
    }

    fn shader(&self) -> MethodShader<'_> {
        MethodShader {
            name: "stam",
            wgsl: vec![WGSL],
            uniform: bytemuck::bytes_of(&self.0).to_vec(),
            storage: Vec::new(),
        }
    }
}
