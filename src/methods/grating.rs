//! `table` of a grating by Maxwell's equations: the orders' [colours](crate::grating::GratingColourLobe), read for a pair of
//! directions.

use super::{AnswerKind, Method, MethodShader};
use crate::grating::GratingColourSurface;
use crate::lobe::{LinearSrgb, Lobe};
use bytemuck::{Pod, Zeroable};
use std::borrow::Cow;

/// The uniform struct of `grating.wgsl`: of [`crate::grating::GratingLayout`] what a value is computed with.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub(super) struct GratingUniform {
    pub first_nm: f32,
    pub steps_per_nm: f32,
    pub wavelengths: u32,
    pub cells: u32,
    pub nodes: u32,
    pub orders: f32,
    /// Packets of four words before those of order 0.
    pub order_zero: u32,
    pub period_um: f32,
    /// Frequency of the first order in cycles/µm, and its standard deviation.
    pub spacing: f32,
    pub sigma: f32,
    pub _pad0: u32,
    pub _pad1: u32,
}

impl Method for GratingColourSurface {
    fn answer_rgb(&self, wi: [f32; 3], wo: [f32; 3]) -> [f32; 3] {
        self.lobe::<f32>().eval(wi, wo, LinearSrgb, true)
    }

    fn answer_spectral(&self, _wi: [f32; 3], _wo: [f32; 3], _wavelength_nm: f32) -> Option<f32> {
        None
    }

    fn answers(&self) -> AnswerKind {
        AnswerKind::Reflectance
    }

    fn shader(&self) -> MethodShader<'_> {
        let layout = self.grating().layout();
        let [efficiencies, colours] = self.words();
        let (packets, order_zero) = self.tables().packets(colours);
        let uniform = GratingUniform {
            first_nm: layout.efficiencies.first_nm as f32,
            steps_per_nm: (1.0 / layout.efficiencies.step_nm) as f32,
            wavelengths: layout.efficiencies.wavelengths,
            cells: layout.efficiencies.cells,
            nodes: layout.efficiencies.nodes,
            orders: self.tables().orders as f32,
            order_zero,
            period_um: layout.period_um as f32,
            spacing: (1.0 / layout.period_um) as f32,
            sigma: layout.sigma_per_um as f32,
            _pad0: 0,
            _pad1: 0,
        };
        MethodShader {
            name: "table",
            wgsl: vec![include_str!("grating.wgsl")],
            uniform: bytemuck::bytes_of(&uniform).to_vec(),
            storage: [efficiencies, packets].map(|words| Cow::Borrowed(bytemuck::cast_slice(words))).to_vec(),
        }
    }
}
