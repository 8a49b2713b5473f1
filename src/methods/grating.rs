//! The method `table` for gratings by Maxwell's equations: [`crate::grating::GratingColourLobe`] as a [`Method`].
//!
//! The shader is grating.wgsl, which defines the symbols. The answer is the whole reflectance, since efficiencies
//! include the material.

use super::{AnswerKind, Method, MethodShader};
use crate::grating::GratingColourSurface;
use crate::lobe::{LinearSrgb, Lobe};
use crate::wgsl;
use bytemuck::{Pod, Zeroable};
use std::borrow::Cow;

/// The uniform struct of grating.wgsl: the numbers of [`crate::grating::GratingLayout`] and
/// [`crate::grating::ColourTables`] that the shader needs.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub(super) struct GratingUniform {
    /// First wavelength of the efficiencies in nm.
    pub first_nm: f32,
    /// Wavelengths of the efficiencies per nm.
    pub steps_per_nm: f32,
    /// Number of wavelengths of the efficiencies.
    pub wavelengths: u32,
    /// Number of cells at the shortest wavelength. A cell is a region of incidences with the same propagating orders
    /// (src/grating/cell_position.rs).
    pub cells: u32,
    /// Nodes along each side of a cell.
    pub nodes: u32,
    /// Highest order that propagates at any incidence and wavelength; a float, since the shader compares it with
    /// floats.
    pub order_max: f32,
    /// Index of the first packet of order 0's colours. A packet is four words: red, green, blue, and zero.
    pub order_zero_start: u32,
    /// Period d in µm.
    pub period_um: f32,
    /// Frequency of order 1, 1/d, in cycles/µm.
    pub spacing_per_um: f32,
    /// Standard deviation of an order's Gaussian in cycles/µm.
    pub sigma_per_um: f32,
    /// The size of a uniform struct is a multiple of 16 bytes.
    pub _pad0: u32,
    pub _pad1: u32,
}

impl Method for GratingColourSurface {
    fn answer_rgb(&self, wi: [f32; 3], wo: [f32; 3]) -> [f32; 3] {
        // A mask, for SIMD vectors, some of whose lanes may be idle.
        let is_active = true;
        self.lobe::<f32>().eval(wi, wo, LinearSrgb, is_active)
    }

    // The method gives colours alone; `GratingSurface` has the values by wavelength.
    fn answer_spectral(&self, _wi: [f32; 3], _wo: [f32; 3], _wavelength_nm: f32) -> Option<f32> {
        None
    }

    fn answers(&self) -> AnswerKind {
        AnswerKind::Reflectance
    }

    fn shader(&self) -> MethodShader<'_> {
        let layout = self.grating().layout();
        let [efficiencies, colours] = self.words();
        let (packets, order_zero_start) = self.tables().packets(colours);
        let uniform = GratingUniform {
            first_nm: layout.efficiencies.first_nm as f32,
            steps_per_nm: (1.0 / layout.efficiencies.step_nm) as f32,
            wavelengths: layout.efficiencies.wavelengths,
            cells: layout.efficiencies.cells,
            nodes: layout.efficiencies.nodes,
            order_max: self.tables().orders as f32,
            order_zero_start,
            period_um: layout.period_um as f32,
            spacing_per_um: (1.0 / layout.period_um) as f32,
            sigma_per_um: layout.sigma_per_um as f32,
            _pad0: 0,
            _pad1: 0,
        };
        MethodShader {
            name: "table",
            wgsl: vec![wgsl!("grating.wgsl")],
            uniform: bytemuck::bytes_of(&uniform).to_vec(),
            storage: [efficiencies, packets].map(|words| Cow::Borrowed(bytemuck::cast_slice(words))).to_vec(),
        }
    }
}
