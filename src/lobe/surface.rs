use super::spectral::{SpectralLayout, SpectralLobe};
use super::{Answer, Sample};
use crate::energy::{AlbedoIntegral, AlbedoReport, AlbedoTable};
use crate::height_field::HeightField;
use crate::numeric::{Numbers, Plain};
use crate::sampling::Sampler;
use crate::scattering::{Options, Vec3, build_table};
use crate::table::{Built, Model, PackedTable, Progress, SpectralTable, TableError, TableReport};
use serde::{Deserialize, Serialize};
use std::sync::{Arc, OnceLock};

/// Share of a build that is taken to be its first table's.
const TABLE_SHARE: f64 = 0.5;

/// A diffracting surface that answers from tables.
#[derive(Serialize, Deserialize)]
pub struct Surface {
    options: Options,
    layout: SpectralLayout,
    table: PackedTable,
    sampler: Sampler,
    albedo_table: Option<Arc<AlbedoTable>>,
    report: SurfaceReport,
    /// For [`Surface::albedo`] alone.
    #[serde(skip)]
    unpacked: OnceLock<SpectralTable>,
}

/// What building a surface took and gave.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct SurfaceReport {
    /// Of the power spectrum.
    pub table: TableReport,
    /// Bytes of all tables: spectrum, sampler and albedo.
    pub bytes: usize,
    /// How much conserving energy changes, where that is asked for.
    pub energy: Option<AlbedoReport>,
    /// Seconds for everything.
    pub build_seconds: f64,
}

impl Surface {
    /// Builds the tables of `field`.
    ///
    /// # Errors
    /// A coherence length outside [1e-3, 1e5] µm, a tolerance outside [1e-6, 0.1], or a build that would take more than
    /// its limit allows ([`BuildDemand::check`]), which is told at once.
    pub fn new(field: &HeightField, options: &Options) -> Result<Self, TableError> {
        Self::watched(field, options, &Progress::none())
    }

    /// As [`Surface::new`], telling `progress` how far it has come.
    ///
    /// # Errors
    /// As [`Surface::new`].
    pub fn watched(field: &HeightField, options: &Options, progress: &Progress) -> Result<Self, TableError> {
        let start = crate::clock::Instant::now();
        TableError::unless_in("coherence_length", options.coherence_length_um, 1e-3..=1e5, "0.001 to 100000 µm")?;
        TableError::unless_in("tolerance", options.tolerance, 1e-6..=0.1, "1e-6 to 0.1")?;
        options.demand(field).check(options.build_limit)?;
        let Built { table, packed, report: table_report } =
            build_table(field, options, &progress.part(0.0, TABLE_SHARE))?;
        let sampler = Sampler::new(&table, options);
        let rest = progress.part(TABLE_SHARE, 1.0);
        let albedo = match (options.conserve_energy, options.model) {
            (false, _) => None,
            (true, Model::Ensemble) => AlbedoTable::build(&table, options, &rest),
            // A patch is one member of the ensemble; its albedo is taken to be that of the mean.
            (true, Model::Patch) => {
                let ensemble = Options { model: Model::Ensemble, ..options.clone() };
                let mean = build_table(field, &ensemble, &rest.part(0.0, TABLE_SHARE))?.table;
                AlbedoTable::build(&mean, options, &rest.part(TABLE_SHARE, 1.0))
            }
        };
        let (albedo_table, energy) = albedo.unzip();
        let albedo_table = albedo_table.filter(|table| !table.is_one()).map(Arc::new);
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
        let unpacked = OnceLock::new();
        progress.report(1.0);
        Ok(Self { options: options.clone(), layout, table: packed, sampler, albedo_table, report, unpacked })
    }

    /// The options it was built with.
    pub fn options(&self) -> &Options {
        &self.options
    }

    /// What building took and gave.
    pub fn report(&self) -> &SurfaceReport {
        &self.report
    }

    /// The table of `S`.
    pub fn table(&self) -> &PackedTable {
        &self.table
    }

    /// What directions are drawn from.
    pub fn sampler(&self) -> &Sampler {
        &self.sampler
    }

    /// What the reflectance is divided by to conserve energy, `None` where nothing is.
    pub fn albedo_table(&self) -> Option<&Arc<AlbedoTable>> {
        self.albedo_table.as_ref()
    }

    /// Everything about the lobe but the words of its tables.
    pub fn layout(&self) -> &SpectralLayout {
        &self.layout
    }

    /// The words of the tables, in the order of the layout.
    pub fn words(&self) -> [&[u32]; 3] {
        let albedo = self.albedo_table.as_ref().map_or(&[] as &[u32], |table| table.words());
        [self.table.words(), self.sampler.words(), albedo]
    }

    /// The lobe by value, in `f32` or `f64`.
    pub fn lobe<F>(&self) -> SpectralLobe<'_, Plain<'_, F>>
    where
        for<'a> Plain<'a, F>: Numbers<Words = &'a [u32]>,
    {
        SpectralLobe { layout: &self.layout, words: self.words() }
    }

    /// `f_r` in 1/sr, divided by the albedo where energy is conserved.
    ///
    /// Obliquity and shadowing are included. The interface's factor
    /// ([`Pair::interface`](crate::scattering::Pair::interface): Fresnel reflectance or small-slope factor) and the
    /// cosine are not. Zero unless both directions lie above the surface and the wavelength (nm) within the tables'
    /// range. Never negative, never NaN.
    pub fn eval(&self, wi: Vec3, wo: Vec3, wavelength_nm: f64) -> f64 {
        super::eval(&self.lobe::<f64>(), wi, wo, wavelength_nm)
    }

    /// [`Surface::eval`] and the density of [`Surface::sample`], in 1/sr.
    pub fn eval_pdf(&self, wi: Vec3, wo: Vec3, wavelength_nm: f64) -> Answer {
        super::eval_pdf(&self.lobe::<f64>(), wi, wo, wavelength_nm)
    }

    /// Density in 1/sr of a direction sampled for several wavelengths (nm): the mean of their densities.
    pub fn pdf(&self, wi: Vec3, wo: Vec3, wavelengths_nm: &[f64]) -> f64 {
        super::pdf(&self.lobe::<f64>(), wi, wo, wavelengths_nm)
    }

    /// Samples a direction for at least one wavelength (nm) from three random numbers in [0, 1), with density and
    /// weight. `None` as in [`Surface::sample_direction`]; such samples count as zero.
    pub fn sample(&self, wi: Vec3, wavelengths_nm: &[f64], u: [f64; 3]) -> Option<Sample> {
        super::sample(&self.lobe::<f64>(), wi, wavelengths_nm, u)
    }

    /// A direction from three random numbers in [0, 1); `None` where it falls below the horizon, or `wi` lies there.
    /// The first number chooses the uniform part or one of the wavelengths (nm).
    pub fn sample_direction(&self, wi: Vec3, wavelengths_nm: &[f64], u: [f64; 3]) -> Option<Vec3> {
        super::sample_direction(&self.lobe::<f64>(), wi, wavelengths_nm, u)
    }

    /// `∫ f_r cosθo dωo` over the upper hemisphere with the Fresnel reflectance left out (the small slope's factor is
    /// in it), every node of the table integrated over its Gaussian. `None` for a patch.
    pub fn albedo(&self, wi: Vec3, wavelength_nm: f64) -> Option<f64> {
        let factor = |wo: Vec3| self.albedo_table.as_ref().map_or(1.0, |table| table.factor(wi, wo, wavelength_nm));
        let table = self.unpacked.get_or_init(|| self.table.unpacked());
        let mut albedo = 0.0;
        let integral = AlbedoIntegral::accurate(table, &self.options)?;
        integral.visit::<Plain<f64>>(wi, wavelength_nm, None, |wo, part| albedo += part * factor(wo));
        Some(albedo)
    }
}
