//! The method `table` of a film, which reflects and transmits.
//!
//! The answer is a colour table times the film's angular factor F (scattering/transparent.rs). Where energy is
//! conserved, the product is divided by tabulated albedos (src/energy). The shader consists of table.wgsl,
//! transparent.wgsl, albedo.wgsl and film.wgsl.
//!
//! The film has the refractive index n, so wavelengths in it are 1/n of those in air. The table is therefore that of
//! the relief magnified n times in pattern and heights, for wavelengths in air.

use super::table::table_shader;
use super::{AnswerKind, Method, MethodShader};
use crate::colour_table::ColourTable;
use crate::energy::AlbedoTable;
use crate::lobe::colour_at_body;
use crate::scattering::TransparentBody;
use crate::wgsl;

/// Contents of the albedos' buffer where nothing is divided. The shader declares the buffer, so it must not be empty.
/// It is not read where `albedo_cells` of the uniform struct is 0.
const NO_ALBEDO: [u32; 4] = [0; 4];

/// The colour table of a film.
pub(super) struct FilmTable {
    /// The film.
    pub body: TransparentBody,
    /// Table of the magnified relief. Callers of [`super::build`] magnify it.
    pub table: ColourTable,
    /// Albedos by which the scattering function is divided; `None` where nothing is divided.
    pub albedo: Option<AlbedoTable>,
}

impl Method for FilmTable {
    fn answer_rgb(&self, wi: [f32; 3], wo: [f32; 3]) -> [f32; 3] {
        let albedo = self.albedo.as_ref().map(AlbedoTable::view::<f32>);
        // The relief has the table's own size, since only textures of the path tracer resize it. The mask `active` is
        // for SIMD vectors, some of whose lanes may be idle.
        let (size, active) = (None, true);
        colour_at_body(self.body, &self.table.view::<f32>(), albedo.as_ref(), size, [wi, wo], active)
    }

    fn answer_spectral(&self, _wi: [f32; 3], _wo: [f32; 3], _wavelength_nm: f32) -> Option<f32> {
        // The table has colours, which are integrals over the wavelength.
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
