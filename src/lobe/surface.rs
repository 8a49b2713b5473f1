//! A surface at wavelengths: the tables of its power spectrum, its sampler and its albedos.
//!
//! [`Surface`] builds the tables from a height field, owns them, and evaluates them in double precision. Renderers
//! read the same tables through lobes ([`Surface::lobe`], [`Surface::transmissive_lobe`]), which are generic over the
//! type of numbers: single ones, SIMD vectors or traced variables (`src/numeric`).
//!
//! The power spectrum `S(f; κ)` depends on the spatial frequency f and the phase rate κ of a pair of directions
//! (docs/model.md#the-reflectance). The *albedo* of a direction is the reflected fraction of the light from it. A
//! *patch* is the model with one coherence window at a fixed position, the *ensemble* the mean over all positions
//! (docs/model.md#coherence).

use super::spectral::{SpectralLayout, SpectralLobe};
use super::{Answer, Sample, TransmissiveLobe};
use crate::energy::{AlbedoIntegral, AlbedoReport, AlbedoTable, integrated_albedos};
use crate::height_field::HeightField;
use crate::numeric::{Numbers, Plain};
use crate::sampling::Sampler;
use crate::scattering::{Options, RelativeSize, Vec3, build_table};
use crate::table::{
    Built, COHERENCE_LENGTH_UM, Model, PackedTable, Progress, SpectralTable, TOLERANCE, TableError, TableReport,
};
use serde::{Deserialize, Serialize};
use std::sync::{Arc, OnceLock};

/// A diffracting surface at wavelengths, from tables.
///
/// ```
/// use sunbeam::{Options, Preset, Surface};
///
/// let field = Preset::Blazed.build(None, None)?;
/// let options = Options { coherence_length_um: 20.0, conserve_energy: false, ..Options::default() };
/// let surface = Surface::new(&field, &options)?;
///
/// // Swapping the directions changes nothing.
/// let (a, b) = ([0.6, 0.0, 0.8], [-0.36, 0.48, 0.8]);
/// let (there, back) = (surface.eval(a, b, 550.0), surface.eval(b, a, 550.0));
/// assert!((there - back).abs() <= 1e-9 * there.max(back));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Serialize, Deserialize)]
pub struct Surface {
    options: Options,
    layout: SpectralLayout,
    table: PackedTable,
    sampler: Sampler,
    /// Albedos by which the reflectance is divided; `None` where nothing is divided.
    albedo_table: Option<Arc<AlbedoTable>>,
    report: SurfaceReport,
    /// `table` in the form that [`Surface::albedo`] integrates, unpacked at its first call.
    #[serde(skip)]
    unpacked: OnceLock<SpectralTable>,
}

/// Size, build time and measured error of a surface's tables.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct SurfaceReport {
    /// Report of the power spectrum's table.
    pub table: TableReport,
    /// Bytes of all tables: spectrum, sampler and albedo.
    pub bytes: usize,
    /// Albedos before and after the division; `None` where energy is not conserved, and for a transparent body.
    pub energy: Option<AlbedoReport>,
    /// Build time of the whole surface in seconds.
    pub build_seconds: f64,
}

/// Calls a function of `by_value.rs` with the lobe of the surface: that of its transparent body, or without a body the
/// lobe that only reflects. A macro, since the two lobes have different types.
macro_rules! by_kind {
    ($surface:ident, $function:ident, $($argument:ident),+) => {
        match $surface.transmissive_lobe::<f64>() {
            Some(lobe) => super::$function(&lobe, $($argument),+),
            None => super::$function(&$surface.lobe::<f64>(), $($argument),+),
        }
    };
}

impl Surface {
    /// Builds the tables of `field`.
    ///
    /// # Errors
    /// A coherence length outside [`COHERENCE_LENGTH_UM`], a tolerance outside [`TOLERANCE`], or a build that would
    /// take more than `options.build_limit` allows ([`BuildDemand::check`](crate::table::BuildDemand::check)). Nothing
    /// is built before these checks.
    pub fn new(field: &HeightField, options: &Options) -> Result<Self, TableError> {
        Self::watched(field, options, &Progress::none())
    }

    /// [`Surface::new`] with reports to `progress`.
    ///
    /// # Errors
    /// The errors of [`Surface::new`].
    pub fn watched(field: &HeightField, options: &Options, progress: &Progress) -> Result<Self, TableError> {
        let start = crate::clock::Instant::now();
        let length_um = options.coherence_length_um;
        TableError::unless_in("coherence_length", length_um, COHERENCE_LENGTH_UM, "0.001 to 100000 µm")?;
        TableError::unless_in("tolerance", options.tolerance, TOLERANCE, "1e-6 to 0.1")?;
        options.demand(field).check(options.build_limit)?;
        let (table_progress, albedo_progress) = progress.halves();
        // `table` has one record per node, for the build of sampler and albedos; `packed` is the form for look-ups.
        let Built { table, packed, report: table_report } = build_table(field, options, &table_progress)?;
        let sampler = Sampler::new(&table, options);
        let (albedo_table, energy) = albedos(field, &table, options, &albedo_progress)?;
        let albedo_table = albedo_table.map(Arc::new);
        let report = SurfaceReport {
            bytes: packed.bytes() + sampler.bytes() + albedo_table.as_ref().map_or(0, |table| table.bytes()),
            table: table_report,
            energy,
            build_seconds: start.elapsed().as_secs_f64(),
        };
        let layout = SpectralLayout {
            table: *packed.layout(),
            sampler: sampler.layout(),
            albedo: albedo_table.as_ref().map(|table| *table.layout()),
            obliquity: options.obliquity,
            shadowing: options.shadowing,
        };
        progress.report(1.0);
        Ok(Self {
            options: options.clone(),
            layout,
            table: packed,
            sampler,
            albedo_table,
            report,
            unpacked: OnceLock::new(),
        })
    }

    /// Options that the surface was built with.
    pub fn options(&self) -> &Options {
        &self.options
    }

    /// Size, build time and measured error of the tables.
    pub fn report(&self) -> &SurfaceReport {
        &self.report
    }

    /// Table of the power spectrum `S(f; κ)`.
    pub fn table(&self) -> &PackedTable {
        &self.table
    }

    /// The sampler.
    pub fn sampler(&self) -> &Sampler {
        &self.sampler
    }

    /// Albedos by which the reflectance is divided; `None` where nothing is divided.
    pub fn albedo_table(&self) -> Option<&Arc<AlbedoTable>> {
        self.albedo_table.as_ref()
    }

    /// Layout of [`Surface::words`], and the factors of the lobe.
    pub fn layout(&self) -> &SpectralLayout {
        &self.layout
    }

    /// Table data: power spectrum, sampler, albedos. The last is empty where nothing is divided.
    pub fn words(&self) -> [&[u32]; 3] {
        let albedo = self.albedo_table.as_ref().map_or(&[] as &[u32], |table| table.words());
        [self.table.words(), self.sampler.words(), albedo]
    }

    /// The lobe over plain numbers, in `f32` or `f64`.
    pub fn lobe<F>(&self) -> SpectralLobe<'_, Plain<'_, F>>
    where
        for<'a> Plain<'a, F>: Numbers<Words = &'a [u32]>,
    {
        SpectralLobe { layout: &self.layout, words: self.words(), size: None }
    }

    /// [`Surface::lobe`] for a relief of another size ([`Reading`](crate::scattering::Reading)). Where energy is
    /// conserved, the size has to lie within [`Options::sizes`].
    pub fn lobe_of_size<F>(&self, size: RelativeSize<F>) -> SpectralLobe<'_, Plain<'_, F>>
    where
        for<'a> Plain<'a, F>: Numbers<Words = &'a [u32], Real = F>,
    {
        SpectralLobe { layout: &self.layout, words: self.words(), size: Some(size) }
    }

    /// The lobe of the transparent body over plain numbers, in `f32` or `f64`; `None` without a body.
    pub fn transmissive_lobe<F>(&self) -> Option<TransmissiveLobe<'_, Plain<'_, F>>>
    where
        for<'a> Plain<'a, F>: Numbers<Words = &'a [u32]>,
    {
        self.options.body.map(|body| TransmissiveLobe { body, relief: self.lobe() })
    }

    /// `f_r` in 1/sr between two unit vectors that point away from the surface, divided by the albedo where energy is
    /// conserved.
    ///
    /// Obliquity and shadowing are included. The interface's factor
    /// ([`Pair::interface`](crate::scattering::Pair::interface): Fresnel reflectance or small-slope factor) and the
    /// cosine are not. Zero unless both directions lie above the surface and the wavelength lies within
    /// [`WAVELENGTH_MIN_NM`](crate::table::WAVELENGTH_MIN_NM) to
    /// [`WAVELENGTH_MAX_NM`](crate::table::WAVELENGTH_MAX_NM). Never negative, never NaN.
    ///
    /// With a transparent body ([`Options::body`]), directions may lie on either side of the relief, and values include
    /// the interface's factor.
    pub fn eval(&self, wi: Vec3, wo: Vec3, wavelength_nm: f64) -> f64 {
        by_kind!(self, eval, wi, wo, wavelength_nm)
    }

    /// [`Surface::eval`] and the density of [`Surface::sample`], in 1/sr.
    pub fn eval_pdf(&self, wi: Vec3, wo: Vec3, wavelength_nm: f64) -> Answer {
        by_kind!(self, eval_pdf, wi, wo, wavelength_nm)
    }

    /// Density of [`Surface::sample`] over solid angle, in 1/sr: the mean over the wavelengths.
    pub fn pdf(&self, wi: Vec3, wo: Vec3, wavelengths_nm: &[f64]) -> f64 {
        by_kind!(self, pdf, wi, wo, wavelengths_nm)
    }

    /// Samples a direction for at least one wavelength from three random numbers in [0, 1), with density and weight.
    /// `None` where [`Surface::sample_direction`] has no direction; such samples count as zero.
    pub fn sample(&self, wi: Vec3, wavelengths_nm: &[f64], u: [f64; 3]) -> Option<Sample> {
        by_kind!(self, sample, wi, wavelengths_nm, u)
    }

    /// A direction from three random numbers in [0, 1); `None` where it falls below the horizon, where `wi` lies below
    /// the surface of a relief that only reflects, and without a wavelength.
    ///
    /// The first number chooses the side of a transparent body, then the uniform part of the density or one of the
    /// wavelengths.
    pub fn sample_direction(&self, wi: Vec3, wavelengths_nm: &[f64], u: [f64; 3]) -> Option<Vec3> {
        by_kind!(self, sample_direction, wi, wavelengths_nm, u)
    }

    /// Albedo `∫ f_r cosθo dωo` over the upper hemisphere, after the division that conserves energy. The integral is a
    /// sum over the nodes of the table, and errs by 0.2 %, or 1 % on a relief of one row of pixels. The small-slope
    /// factor is included, the Fresnel reflectance is not. `None` for a patch and for a transparent body.
    pub fn albedo(&self, wi: Vec3, wavelength_nm: f64) -> Option<f64> {
        if self.options.body.is_some() {
            return None;
        }
        let table = self.unpacked.get_or_init(|| self.table.unpacked());
        let integral = AlbedoIntegral::accurate(table, &self.options)?;
        let [_, divided] = integrated_albedos(&integral, self.albedo_table.as_deref(), wi, wavelength_nm);
        Some(divided)
    }
}

/// Albedo table of a surface with the spectral table `table`, and a report on it. Both are `None` where energy is not
/// conserved. The table is also `None` where every divisor is 1. A transparent body has no report.
///
/// # Errors
/// The errors of building a spectral table: a patch needs a second one, that of its ensemble.
pub(super) fn albedos(
    field: &HeightField,
    table: &SpectralTable,
    options: &Options,
    progress: &Progress,
) -> Result<(Option<AlbedoTable>, Option<AlbedoReport>), TableError> {
    if !options.conserve_energy {
        return Ok((None, None));
    }
    let build_albedos = |table: &SpectralTable, progress: &Progress| match options.body {
        Some(body) => (AlbedoTable::build_of_body(table, body, options.sizes.as_ref(), progress), None),
        None => AlbedoTable::build(table, options, progress).unzip(),
    };
    let (albedos, report) = match options.model {
        Model::Ensemble => build_albedos(table, progress),
        // A patch is divided by the albedo of its ensemble, the mean over all patches.
        Model::Patch => {
            let ensemble = Options { model: Model::Ensemble, ..options.clone() };
            let (table_progress, albedo_progress) = progress.halves();
            let ensemble_table = build_table(field, &ensemble, &table_progress)?.table;
            build_albedos(&ensemble_table, &albedo_progress)
        }
    };
    // Lobes without an albedo table skip the division.
    Ok((albedos.filter(|table| !table.is_one()), report))
}
