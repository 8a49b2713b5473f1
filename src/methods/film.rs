//! The method `table` of a film, which reflects and transmits.
//!
//! The answer is a colour table times the film's angular factor F (scattering/transparent.rs). The table is that of the
//! relief magnified n times in pattern and heights, with the film's refractive index n. Where energy is conserved, the
//! product is divided by tabulated albedos (src/energy). The shader consists of table.wgsl, transparent.wgsl,
//! albedo.wgsl and film.wgsl.

use super::table::table_shader;
use super::{AnswerKind, Method, MethodShader};
use crate::colour_table::ColourTable;
use crate::energy::AlbedoTable;
use crate::lobe::colour_at_body;
use crate::scattering::TransparentBody;
use crate::wgsl;

/// Contents of the albedos' buffer where nothing is divided. The shader declares the buffer, so it must not be empty,
/// but does not read it where `albedo_cells` is 0.
const NO_ALBEDO: [u32; 4] = [0; 4];

/// The colour table of a film.
pub(super) struct FilmTable {
    /// The film.
    pub body: TransparentBody,
    /// Table of the magnified relief.
    pub table: ColourTable,
    /// Albedos by which the scattering function is divided; `None` where nothing is divided.
    pub albedo: Option<AlbedoTable>,
}

impl Method for FilmTable {
    fn answer_rgb(&self, wi: [f32; 3], wo: [f32; 3]) -> [f32; 3] {
        let albedo = self.albedo.as_ref().map(AlbedoTable::view::<f32>);
        // No texture resizes the relief. A plain number is a single lane, which is active.
        let (size, active) = (None, true);
        colour_at_body(self.body, &self.table.view::<f32>(), albedo.as_ref(), size, [wi, wo], active)
    }

    fn answer_spectral(&self, _wi: [f32; 3], _wo: [f32; 3], _wavelength_nm: f32) -> Option<f32> {
        None
    }

    fn answers(&self) -> AnswerKind {
        AnswerKind::Film { eta: self.body.eta as f32 }
    }

    fn shader(&self) -> MethodShader<'_> {
        let words = self.albedo.as_ref().map_or(&NO_ALBEDO[..], AlbedoTable::words);
        table_shader(&self.table, Some(words), |uniform| {
            uniform.body_eta = self.body.eta as f32;
            uniform.body_normal_min = self.body.normal_min as f32;
            if let Some(albedo) = &self.albedo {
                uniform.set_albedo(albedo);
            }
        })
        .and(wgsl!("transparent.wgsl"))
        .and(wgsl!("albedo.wgsl"))
        .and(wgsl!("film.wgsl"))
    }
}
