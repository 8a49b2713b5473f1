//! A grating's reflectance in linear sRGB, from its tables: the surface that owns them. `colour_lobe.rs` evaluates
//! them, `colour_tables.rs` describes those that are added to the efficiencies.

use super::GratingColourLobe;
use super::colour_tables::ColourTables;
use super::surface::GratingSurface;
use crate::lobe::{Gamut, LinearSrgb, Lobe};
use crate::numeric::{Numbers, Plain};
use crate::scattering::Vec3;
use serde::{Deserialize, Serialize};

/// The surface of a grating by Maxwell's equations in linear sRGB, with its tables.
///
/// ```
/// use sunbeam::grating::{GratingColourSurface, GratingSurface, Profile};
/// use sunbeam::table::Progress;
///
/// // A sinusoid of period 0.6 µm and height 0.1 µm; without an index it is a perfect conductor. The build limit is a
/// // factor on the default limits of a table's time and memory.
/// let profile = Profile::sinusoid(0.6, 0.1)?;
/// let (coherence_length_um, build_limit) = (20.0, 1.0);
/// let grating = GratingSurface::new(&profile, None, coherence_length_um, build_limit, &Progress::none())?;
/// let colours = GratingColourSurface::new(grating);
///
/// // At normal incidence, order 1 of 450 nm leaves at a sine of 0.75.
/// let [red, _, blue] = colours.eval([0.0, 0.0, 1.0], [0.75, 0.0, (1.0_f64 - 0.75 * 0.75).sqrt()]);
/// assert!(blue > red);
/// # Ok::<(), sunbeam::grating::GratingError>(())
/// ```
#[derive(Debug, Serialize, Deserialize)]
pub struct GratingColourSurface {
    /// The surface at wavelengths, with the table of efficiencies.
    grating: GratingSurface,
    /// Layout of the colour tables.
    tables: ColourTables,
    /// Data of the colour tables.
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

    /// Table data in 32-bit words: of the efficiencies, then of the colour tables.
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

    /// The surface with another coherence length in µm, four standard deviations of the window. The tables are kept,
    /// since they do not depend on it.
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

    /// The lobe over the numbers `N`: plain numbers, SIMD vectors or traced variables. `words` are
    /// [`GratingColourSurface::words`] in this form. Negative channels are kept ([`Gamut::Keep`]).
    pub fn lobe_over<N: Numbers>(&self, words: [N::Words; 2]) -> GratingColourLobe<N> {
        GratingColourLobe { layout: *self.grating.layout(), tables: self.tables, gamut: Gamut::Keep, words }
    }

    /// `f_r` in 1/sr as linear sRGB, between unit vectors that point away from the surface: [`GratingSurface::eval`]
    /// integrated over the visible wavelengths with D65 and the CIE 1931 functions. The material's reflectance is
    /// included, the cosine is not. Colours outside sRGB have negative channels.
    pub fn eval(&self, wi: Vec3, wo: Vec3) -> [f64; 3] {
        // The last argument masks the lanes of a SIMD vector. A plain number has a single lane.
        self.lobe::<f64>().eval(wi, wo, LinearSrgb, true)
    }
}
