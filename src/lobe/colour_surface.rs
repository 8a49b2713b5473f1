//! A surface in linear sRGB: its tables and their build.
//!
//! The interface's reflectance depends on the wavelength, so that it belongs into the integral of the colours: gold
//! times a rainbow is not the product of two colours. The table holds it relative to that of one index, the reference,
//! which the lobe multiplies in exactly. A constant index then costs no accuracy, and the ratio of another is smooth up
//! to grazing incidence.

use super::colour_lobe::{ColourFactors, ColourLobe};
use super::{Gamut, LinearSrgb, Lobe};
use crate::clock::Instant;
use crate::colour_table::{ColourTable, ColourTableError, ColourTableOptions, ColourView};
use crate::energy::{ColourAlbedoTable, ColourAlbedoView};
use crate::height_field::HeightField;
use crate::numeric::{Numbers, Plain};
use crate::sampling::{ColourSampler, ColourSamplerView};
use crate::scattering::{
    ComplexIndex, Obliquity, Options, SpectralIndex, Vec3, build_table, fresnel_of_family, fresnel_unpolarised,
};
use crate::table::{Model, Progress};
use serde::{Deserialize, Serialize};

/// Fraction of a build's progress at the end of the colour table. Measured roughly; progress is for display only.
const TABLE_DONE: f64 = 0.8;
/// Fraction of a build's progress at the end of the albedos.
const ALBEDO_DONE: f64 = 0.95;
/// Fraction of the albedos' progress that a patch's ensemble table takes.
const ENSEMBLE_FRACTION: f64 = 0.5;
/// Wavelengths in nm among which the reference is chosen: first and last.
const VISIBLE_NM: (u32, u32) = (400, 700);
/// Step in nm between these wavelengths.
const STEP_NM: usize = 10;

/// A diffracting surface in linear sRGB, from tables.
///
/// ```
/// use sunbeam::lobe::ColourSurface;
/// use sunbeam::{Options, Preset};
///
/// let field = Preset::Blazed.build(None, None)?;
/// let options = Options { coherence_length_um: 5.0, conserve_energy: false, tolerance: 1e-2, ..Options::default() };
/// let surface = ColourSurface::new(&field, &options, None)?;
///
/// // Red leaves at a larger angle than blue: with a period of 2.5 µm at sines of 0.26 and 0.18.
/// let seen = |sine: f64| surface.eval([0.0, 0.0, 1.0], [-sine, 0.0, (1.0 - sine * sine).sqrt()]);
/// assert!(seen(0.26)[0] > seen(0.26)[2] && seen(0.18)[2] > seen(0.18)[0]);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Serialize, Deserialize)]
pub struct ColourSurface {
    options: Options,
    /// Index whose reflectance the lobe multiplies in; `None` for a perfect reflector.
    reference: Option<ComplexIndex>,
    table: ColourTable,
    sampler: ColourSampler,
    /// Albedos that the reflectance is divided by; `None` where it is not limited.
    albedo: Option<ColourAlbedoTable>,
    report: ColourSurfaceReport,
}

/// Size and build time of a colour surface.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ColourSurfaceReport {
    /// Bytes of the colour table.
    pub table_bytes: usize,
    /// Bytes of the sampler.
    pub sampler_bytes: usize,
    /// Bytes of the albedos; zero where the reflectance is not limited.
    pub albedo_bytes: usize,
    /// Coherence length of the table in µm; see [`crate::colour_table::ColourTableReport`].
    pub coherence_length_um: f64,
    /// Build time in seconds of the colour table, with the spectral table that it is integrated from.
    pub table_seconds: f64,
    /// Build time in seconds.
    pub build_seconds: f64,
}

impl ColourSurface {
    /// Builds the tables of `field`, the interface's factor for `index` included; `None` is a perfect reflector.
    ///
    /// # Errors
    /// The errors of [`ColourTable::build`].
    pub fn new(
        field: &HeightField,
        options: &Options,
        index: Option<&SpectralIndex>,
    ) -> Result<Self, ColourTableError> {
        Self::watched(field, options, index, &Progress::none())
    }

    /// [`ColourSurface::new`] with reports of its progress.
    ///
    /// # Errors
    /// The errors of [`ColourTable::build`].
    pub fn watched(
        field: &HeightField,
        options: &Options,
        index: Option<&SpectralIndex>,
        progress: &Progress,
    ) -> Result<Self, ColourTableError> {
        let start = Instant::now();
        options.demand(field).check(options.build_limit)?;
        let reference = index.map(reference);
        let table_options = ColourTableOptions {
            coherence_length_um: options.coherence_length_um,
            model: options.model,
            tiling: options.tiling,
            tolerance: options.tolerance,
            resolution: 1.0,
            build_limit: options.build_limit,
        };
        let relative = |nm: f64, cos: f64| match (index, reference) {
            (Some(index @ SpectralIndex::Sampled(_)), Some(reference)) => {
                let reflected = fresnel_unpolarised(cos, reference);
                // Where the reference reflects nothing, no wavelength reflects.
                if reflected > 0.0 { fresnel_unpolarised(cos, index.at(nm)) / reflected } else { 1.0 }
            }
            _ => 1.0,
        };
        let (table, spectral) =
            ColourTable::build_reflecting(field, &table_options, &relative, &progress.part(0.0, TABLE_DONE))?;
        let table_seconds = start.elapsed().as_secs_f64();
        let rest = progress.part(TABLE_DONE, ALBEDO_DONE);
        let albedo = match (options.conserve_energy, options.model) {
            (false, _) => None,
            (true, Model::Ensemble) => ColourAlbedoTable::build(&spectral, options, &rest),
            (true, Model::Patch) => {
                // A patch is one member of the ensemble, and takes the ensemble's albedo.
                let ensemble = Options { model: Model::Ensemble, ..options.clone() };
                let mean = build_table(field, &ensemble, &rest.part(0.0, ENSEMBLE_FRACTION))?.table;
                ColourAlbedoTable::build(&mean, options, &rest.part(ENSEMBLE_FRACTION, 1.0))
            }
        };
        let albedo = albedo.filter(|albedo| !albedo.is_one());
        drop(spectral);
        progress.report(ALBEDO_DONE);
        let view = table.view::<f32>();
        let is_stam = options.proposed() == Obliquity::Stam;
        let sampler = ColourSampler::new(table.report().order_sigma_per_um, |[u, v, w]| {
            let length_squared = u * u + v * v + w * w;
            let reflected = reference.map_or(1.0, |index| fresnel_of_family(0.5 * length_squared.sqrt(), index));
            let factor = if is_stam { reflected * (length_squared / w).powi(2) } else { reflected };
            view.relief_rgb(u, v, w, true).map(|channel| channel * factor)
        });
        let report = ColourSurfaceReport {
            table_bytes: table.report().bytes,
            sampler_bytes: sampler.bytes(),
            albedo_bytes: albedo.as_ref().map_or(0, ColourAlbedoTable::bytes),
            coherence_length_um: table.report().coherence_length_um,
            table_seconds,
            build_seconds: start.elapsed().as_secs_f64(),
        };
        progress.report(1.0);
        Ok(Self { options: options.clone(), reference, table, sampler, albedo, report })
    }

    /// Options that the surface was built with.
    pub fn options(&self) -> &Options {
        &self.options
    }

    /// Index whose reflectance the lobe multiplies in; `None` for a perfect reflector.
    pub fn reference(&self) -> Option<ComplexIndex> {
        self.reference
    }

    /// Table of colours, relative to the reference.
    pub fn table(&self) -> &ColourTable {
        &self.table
    }

    /// The sampler.
    pub fn sampler(&self) -> &ColourSampler {
        &self.sampler
    }

    /// Albedos that the reflectance is divided by; `None` where it is not limited.
    pub fn albedo(&self) -> Option<&ColourAlbedoTable> {
        self.albedo.as_ref()
    }

    /// Size and build time of a colour surface.
    pub fn report(&self) -> &ColourSurfaceReport {
        &self.report
    }

    /// Table data: colours, sampler, albedos.
    pub fn words(&self) -> [&[u32]; 3] {
        let albedo = self.albedo.as_ref().map_or(&[] as &[u32], ColourAlbedoTable::words);
        [self.table.words(), self.sampler.words(), albedo]
    }

    /// The lobe over plain numbers, in `f32` or `f64`.
    pub fn lobe<F>(&self) -> ColourLobe<Plain<'_, F>>
    where
        for<'a> Plain<'a, F>: Numbers<Words = &'a [u32]>,
    {
        self.lobe_over(self.words())
    }

    /// The lobe over [`ColourSurface::words`] of one family of numbers.
    pub fn lobe_over<N: Numbers>(&self, [table, sampler, albedo]: [N::Words; 3]) -> ColourLobe<N> {
        ColourLobe {
            factors: self.factors(),
            table: ColourView { layout: *self.table.layout(), words: table },
            sampler: ColourSamplerView { layout: self.sampler.layout(), words: sampler },
            albedo: self.albedo.as_ref().map(|table| ColourAlbedoView { layout: *table.layout(), words: albedo }),
        }
    }

    /// Factors of the lobe.
    pub fn factors(&self) -> ColourFactors {
        let Options { obliquity, shadowing, .. } = self.options;
        ColourFactors { reference: self.reference, obliquity, shadowing, gamut: Gamut::Keep }
    }

    /// `f_r` in 1/sr as linear sRGB, the interface's factor included. Otherwise as
    /// [`Surface::eval`](super::Surface::eval).
    pub fn eval(&self, wi: Vec3, wo: Vec3) -> [f64; 3] {
        self.lobe::<f64>().eval(wi, wo, LinearSrgb, true)
    }
}

/// Index at the visible wavelength with the largest reflectance at normal incidence.
fn reference(index: &SpectralIndex) -> ComplexIndex {
    let normal = |index: &ComplexIndex| fresnel_unpolarised(1.0, *index);
    let first = index.at(f64::from(VISIBLE_NM.0));
    (VISIBLE_NM.0..=VISIBLE_NM.1)
        .step_by(STEP_NM)
        .map(|nm| index.at(f64::from(nm)))
        .fold(first, |best, index| if normal(&index) > normal(&best) { index } else { best })
}
