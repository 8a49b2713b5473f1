//! The method `table`: the [colour table](crate::colour_table), the relief's factor in linear sRGB tabulated over
//! `q = wi + wo = (u, v, w)`, in rings about (u, v) = (0, 0). The relief's factor is the reflectance without Fresnel
//! factor, obliquity and shadowing ([`Relief`]).
//!
//! A look-up reads 4 × 4 × 4 spline coefficients: on each of four rings, four directions at four knots of w. The shader
//! is table.wgsl. Where energy is conserved, conserving_table.wgsl divides by the albedo.

use super::{AnswerKind, Method, MethodShader, Relief, sum};
use crate::colour_table::{ColourTable, Ring};
use crate::energy::AlbedoTable;
use crate::wgsl;
use bytemuck::{Pod, Zeroable};
use std::array;
use std::borrow::Cow;

/// The uniform struct of table.wgsl. The first five members are those of [`crate::colour_table::ColourLayout`].
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub(super) struct TableUniform {
    /// Spacing of the rings near the centre, in u and v.
    pub inner_spacing: f32,
    /// Spacing of the outer rings over their radius.
    pub growth: f32,
    /// Scale of w above which knots are spaced logarithmically.
    pub w_log: f32,
    /// Addend that makes the stored exponent of a coefficient the biased exponent of a single-precision number.
    pub exponent_offset: u32,
    /// Index of the outermost ring.
    pub last_ring: u32,
    /// Cells along each side of the albedo's grid of directions; 0 where energy is not conserved, so nothing is
    /// divided.
    pub albedo_cells: u32,
    /// Number of wavelengths at which the albedo is tabulated, one grid (plane) each.
    pub albedo_planes: u32,
    /// Wavelength of the first plane in nm.
    pub albedo_min_nm: f32,
    /// Planes per nm of wavelength.
    pub albedo_planes_per_nm: f32,
    /// Refractive index of a film; 0 for a surface that only reflects.
    pub body_eta: f32,
    /// Smallest normal component of the scattering vector of a film, in units of the wave number in the film.
    pub body_normal_min: f32,
    pub _pad1: u32,
    /// Rings from the centre outwards, then zeros.
    pub rings: [TableRing; ColourTable::RINGS_MAX],
}

impl TableUniform {
    /// Sets the members that describe the table of the albedo.
    pub(super) fn set_albedo(&mut self, albedo: &AlbedoTable) {
        let layout = albedo.layout();
        self.albedo_cells = layout.cells;
        self.albedo_planes = layout.planes;
        self.albedo_min_nm = layout.wavelength_min_nm;
        self.albedo_planes_per_nm = layout.planes_per_nm;
    }
}

/// The struct `Ring` of table.wgsl: the members of [`Ring`], which documents them, padded to 32 bytes.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub(super) struct TableRing {
    pub offset: u32,
    pub directions: u32,
    pub w_count: u32,
    pub knots_per_w: f32,
    pub knots_per_efold: f32,
    pub knee_squared: f32,
    pub zero_squared: f32,
    pub _pad: u32,
}

impl From<Ring> for TableRing {
    fn from(ring: Ring) -> Self {
        let Ring { offset, directions, w_count, knots_per_w, knots_per_efold, knee_squared, zero_squared } = ring;
        Self { offset, directions, w_count, knots_per_w, knots_per_efold, knee_squared, zero_squared, _pad: 0 }
    }
}

impl Relief for ColourTable {
    fn relief_rgb(&self, [u, v, w]: [f32; 3]) -> [f32; 3] {
        // `true` is the mask `active`, for SIMD vectors, some of whose lanes may be idle.
        self.view::<f32>().relief_rgb(u, v, w, true)
    }

    fn relief_spectral(&self, _q: [f32; 3], _wavelength_nm: f32) -> Option<f32> {
        // The table has colours, which are integrals over the wavelength.
        None
    }

    fn relief_shader(&self) -> MethodShader<'_> {
        table_shader(self, None, |_| {})
    }
}

/// The colour table divided by tabulated albedos, so that the surface reflects no more energy than it receives.
pub(super) struct ConservingTable {
    /// The relief's factor.
    pub table: ColourTable,
    /// Divisors of the reflectance.
    pub albedo: AlbedoTable,
}

impl Method for ConservingTable {
    fn answer_rgb(&self, wi: [f32; 3], wo: [f32; 3]) -> [f32; 3] {
        let relief = self.table.relief_rgb(sum(wi, wo));
        // The relief has the table's own size, since only textures of the path tracer resize it. The mask `active` is
        // for SIMD vectors, some of whose lanes may be idle.
        let (size, active) = (None, true);
        let factor = self.albedo.view::<f32>().band_factor(wi, wo, size, active);
        array::from_fn(|c| relief[c] * factor[c])
    }

    fn answer_spectral(&self, _wi: [f32; 3], _wo: [f32; 3], _wavelength_nm: f32) -> Option<f32> {
        // The table has colours, which are integrals over the wavelength.
        None
    }

    fn answers(&self) -> AnswerKind {
        AnswerKind::Relief
    }

    fn shader(&self) -> MethodShader<'_> {
        table_shader(&self.table, Some(self.albedo.words()), |uniform| uniform.set_albedo(&self.albedo))
            .and(wgsl!("albedo.wgsl"))
            .and(wgsl!("conserving_table.wgsl"))
    }
}

/// The WGSL that reads the table, with the table's coefficients and, if given, the table data of `albedos`. `complete`
/// sets the members of the uniform struct that do not belong to the colour table; they are zero before. Callers append
/// the source that defines `answer_rgb`: relief.wgsl, conserving_table.wgsl or film.wgsl.
pub(super) fn table_shader<'a>(
    table: &'a ColourTable,
    albedos: Option<&'a [u32]>,
    complete: impl FnOnce(&mut TableUniform),
) -> MethodShader<'a> {
    let layout = table.layout();
    // On the heap, since the struct has 32 KiB.
    let mut uniform = Box::new(TableUniform {
        inner_spacing: layout.inner_spacing,
        growth: layout.growth,
        w_log: layout.w_log,
        exponent_offset: layout.exponent_offset,
        last_ring: layout.last_ring,
        ..Zeroable::zeroed()
    });
    for (slot, ring) in uniform.rings.iter_mut().zip(table.rings()) {
        *slot = ring.into();
    }
    complete(&mut uniform);
    let buffers = [Some(table.coefficients()), albedos];
    let storage = buffers.into_iter().flatten().map(|words| Cow::Borrowed(bytemuck::cast_slice(words))).collect();
    MethodShader {
        name: "table",
        wgsl: vec![wgsl!("table.wgsl")],
        uniform: bytemuck::bytes_of(&*uniform).to_vec(),
        storage,
    }
}
