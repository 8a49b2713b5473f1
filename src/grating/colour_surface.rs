//! A grating in linear sRGB.

use super::GratingColourLobe;
use super::colour_tables::ColourTables;
use super::surface::GratingSurface;
use crate::lobe::{Gamut, LinearSrgb, Lobe};
use crate::numeric::{Numbers, Plain};
use crate::scattering::Vec3;
use serde::{Deserialize, Serialize};

/// A grating of the rigorous theory in linear sRGB, from tables.
#[derive(Debug, Serialize, Deserialize)]
pub struct GratingColourSurface {
    grating: GratingSurface,
    tables: ColourTables,
    words: Vec<u32>,
}

impl GratingColourSurface {
    /// Builds the colour tables of a grating.
    pub fn new(grating: GratingSurface) -> Self {
        let (tables, words) = ColourTables::build(&grating);
        Self { grating, tables, words }
    }

    /// The grating's surface at wavelengths.
    pub fn grating(&self) -> &GratingSurface {
        &self.grating
    }

    /// Table data: efficiencies, colours.
    pub fn words(&self) -> [&[u32]; 2] {
        [self.grating.words(), &self.words]
    }

    /// Layout of the colour tables.
    pub(crate) fn tables(&self) -> &ColourTables {
        &self.tables
    }

    /// Bytes of all tables.
    pub fn bytes(&self) -> usize {
        4 * self.words().map(<[u32]>::len).iter().sum::<usize>()
    }

    /// A copy with another coherence length in µm.
    #[must_use]
    pub fn with_coherence_length(self, coherence_length_um: f64) -> Self {
        Self { grating: self.grating.with_coherence_length(coherence_length_um), ..self }
    }

    /// The lobe over plain numbers, in `f32` or `f64`.
    pub fn lobe<F>(&self) -> GratingColourLobe<Plain<'_, F>>
    where
        for<'a> Plain<'a, F>: Numbers<Words = &'a [u32]>,
    {
        self.lobe_over(self.words())
    }

    /// The lobe over [`GratingColourSurface::words`] of one family of numbers.
    pub fn lobe_over<N: Numbers>(&self, words: [N::Words; 2]) -> GratingColourLobe<N> {
        GratingColourLobe { layout: *self.grating.layout(), tables: self.tables, gamut: Gamut::Keep, words }
    }

    /// `f_r` in 1/sr as linear sRGB, the material's reflectance included: [`GratingSurface::eval`] weighted by D65 and
    /// the CIE 1931 functions.
    pub fn eval(&self, wi: Vec3, wo: Vec3) -> [f64; 3] {
        self.lobe::<f64>().eval(wi, wo, LinearSrgb, true)
    }
}
