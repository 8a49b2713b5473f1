use super::albedo::{AlbedoReport, AlbedoTable};
use super::geometry::{obliquity, shadowing};
use super::lobes::Lobes;
use super::sampler::Sampler;
use super::small_slope::small_slope;
use super::spectral_lobe::{SpectralLayout, SpectralLobe};
use super::{ComplexIndex, Obliquity, Pair, SpectralIndex, Vec3};
use crate::height_field::HeightField;
use crate::numeric::{Numbers, Plain, Real};
use crate::table::{
    BuildDemand, Built, Model, PackedTable, Progress, Purpose, SpectralTable, Spectrum, TableError, TableReport,
    Tiling, WAVELENGTH_MAX_NM, WAVELENGTH_MIN_NM, build,
};
use serde::{Deserialize, Serialize};
use std::sync::{Arc, OnceLock};

/// Share of samples drawn evenly over the hemisphere ([`crate::numeric::math::square_to_hemisphere`]): it bounds the weight
/// where the sampler's own density is far below what is reflected.
pub const UNIFORM_SHARE: f64 = 0.02;

/// Share of a build that is taken to be its first table's.
const TABLE_SHARE: f64 = 0.5;

pub(super) const COS_85_DEGREES: f64 = 0.087_155_742_747_658_17;

/// What of the model is asked for (docs/model.md#the-reflectance); the defaults are those of the plugin for a preset.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Options {
    /// Four standard deviations of the coherence window, in µm.
    pub coherence_length_um: f64,
    /// The coherence model.
    pub model: Model,
    /// Whether the tile repeats.
    pub tiling: Tiling,
    /// The obliquity factor.
    pub obliquity: Obliquity,
    /// The index that the small-slope factor of the albedo is taken for, `None` for a perfect conductor's. Other obliquity
    /// factors leave it out: their albedo knows no index.
    pub index: Option<SpectralIndex>,
    /// Scale so that the albedo is at most one.
    pub conserve_energy: bool,
    /// V-cavity shadowing and masking.
    pub shadowing: bool,
    /// Relative error the tables are built to.
    pub tolerance: f64,
    /// Factor on what building may take in memory and time, at least 1; no part of what is built.
    #[serde(skip, default = "one")]
    pub build_limit: f64,
}

fn one() -> f64 {
    1.0
}

impl Default for Options {
    fn default() -> Self {
        Self {
            coherence_length_um: 65.0,
            model: Model::Ensemble,
            tiling: Tiling::Periodic,
            obliquity: Obliquity::Stam,
            index: None,
            conserve_energy: true,
            shadowing: false,
            tolerance: 1e-3,
            build_limit: one(),
        }
    }
}

impl Options {
    /// What building a surface of `field` with these options takes, told without doing any of it.
    pub fn demand(&self, field: &HeightField) -> BuildDemand {
        let (low, high) = field.range_um();
        BuildDemand {
            size: field.size(),
            pixel_um: (field.dx_um(), field.dy_um()),
            range_um: high - low,
            model: self.model,
            tiling: self.tiling,
            coherence_length_um: self.coherence_length_um,
            tolerance: self.tolerance,
            purpose: Purpose::Surface { energy: self.conserve_energy },
        }
    }

    /// `O·M` of a pair of directions.
    pub fn angular_factor(&self, pair: &Pair) -> f64 {
        self.angular([pair.u, pair.v, pair.w], [pair.cos_i, pair.cos_o])
    }

    /// What the albedo weighs the relief's power with, of `wi + wo` and the cosines: `O·M`, or `Q·M` of the small slope of an index.
    #[inline(always)]
    pub(super) fn albedo_factor<R: Real>(&self, q: [R; 3], cosines: [R; 2], index: Option<ComplexIndex>) -> R {
        match self.obliquity {
            Obliquity::SmallSlope => small_slope(q, cosines, index) * self.angular(q, cosines),
            Obliquity::Stam | Obliquity::Unit => self.angular(q, cosines),
        }
    }

    #[inline(always)]
    fn angular<R: Real>(&self, q: [R; 3], cosines: [R; 2]) -> R {
        let factor = obliquity(self.obliquity, q, cosines);
        if self.shadowing { factor * shadowing(q, cosines) } else { factor }
    }

    /// The obliquity factor that samplers weigh directions with. The small slope's is bounded for dielectrics, and grows
    /// towards the horizon as Stam's does for conductors.
    pub(super) fn proposed(&self) -> Obliquity {
        match (self.obliquity, &self.index) {
            (Obliquity::SmallSlope, Some(index)) if index.is_dielectric() => Obliquity::Unit,
            (Obliquity::SmallSlope, _) => Obliquity::Stam,
            (given, _) => given,
        }
    }
}

/// Value and density of one pair of directions at one wavelength.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Answer {
    /// `f_r` in 1/sr, without the interface's factor ([`Pair::interface`]).
    pub f: f64,
    /// Density of [`Surface::sample`] per solid angle, 1/sr.
    pub pdf: f64,
}

/// A sampled direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample {
    /// The direction, of unit length.
    pub wo: Vec3,
    /// Density per solid angle, the mean over the wavelengths carried.
    pub pdf: f64,
    /// `f_r cosθo / pdf` at the first wavelength.
    pub weight: f64,
}

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
    /// A coherence length outside [1e-3, 1e5] µm, a tolerance outside [1e-6, 0.1], or a build that would take more than its
    /// limit allows ([`BuildDemand::check`]), which is told at once.
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

    /// `f_r` in 1/sr: obliquity, shadowing and what conserves energy are in it, the interface's factor
    /// ([`Pair::interface`]: the Fresnel reflectance, or the small slope's factor) and the cosine are not. Zero unless both
    /// directions lie above the surface and the wavelength (nm) within the tables' range. Never negative, never NaN.
    pub fn eval(&self, wi: Vec3, wo: Vec3, wavelength_nm: f64) -> f64 {
        if !answers(wi, wo, wavelength_nm) {
            return 0.0;
        }
        let [f] = self.lobe::<f64>().eval(wi, wo, [wavelength_nm], true);
        f
    }

    /// [`Surface::eval`] and the density of [`Surface::sample`], zero where that is.
    pub fn eval_pdf(&self, wi: Vec3, wo: Vec3, wavelength_nm: f64) -> Answer {
        if !answers(wi, wo, wavelength_nm) {
            return Answer::default();
        }
        let ([f], pdf) = self.lobe::<f64>().eval_pdf(wi, wo, [wavelength_nm], true);
        Answer { f, pdf }
    }

    /// The density of a direction sampled for several wavelengths at once: the mean of each one's.
    pub fn pdf(&self, wi: Vec3, wo: Vec3, wavelengths_nm: &[f64]) -> f64 {
        let density = |&nm: &f64| match answers(wi, wo, nm) {
            true => self.lobe::<f64>().pdf(wi, wo, [nm], true),
            false => 0.0,
        };
        wavelengths_nm.iter().map(density).sum::<f64>() / wavelengths_nm.len().max(1) as f64
    }

    /// Samples an outgoing direction for the wavelengths carried (at least one, nm), with its density and weight.
    /// `None` as in [`Surface::sample_direction`]; such samples count as zero.
    pub fn sample(&self, wi: Vec3, wavelengths_nm: &[f64], u: [f64; 3]) -> Option<Sample> {
        let wo = self.sample_direction(wi, wavelengths_nm, u)?;
        let pdf = self.pdf(wi, wo, wavelengths_nm);
        (pdf > 0.0).then(|| Sample { wo, pdf, weight: self.eval(wi, wo, wavelengths_nm[0]) * wo[2] / pdf })
    }

    /// A direction from three random numbers in [0, 1): the first picks the even share or one of the wavelengths (nm), the
    /// others a direction. `None` where that lies below the horizon, or `wi` does.
    pub fn sample_direction(&self, wi: Vec3, wavelengths_nm: &[f64], u: [f64; 3]) -> Option<Vec3> {
        // The even share comes first, so that one wavelength, drawn by what is left of `u`, does for all.
        let drawn = (u[0] - UNIFORM_SHARE) / (1.0 - UNIFORM_SHARE);
        let hero = ((drawn.max(0.0) * wavelengths_nm.len() as f64) as usize).min(wavelengths_nm.len().checked_sub(1)?);
        let wo = self.lobe::<f64>().sample(wi, [wavelengths_nm[hero]], u, wi[2] > 0.0);
        (wo[2] > 0.0).then_some(wo)
    }

    /// `∫ f_r cosθo dωo` over the upper hemisphere with the Fresnel reflectance left out (the small slope's factor is in it),
    /// every node of the table integrated over its Gaussian. `None` for a patch.
    pub fn albedo(&self, wi: Vec3, wavelength_nm: f64) -> Option<f64> {
        let factor = |wo: Vec3| self.albedo_table.as_ref().map_or(1.0, |table| table.factor(wi, wo, wavelength_nm));
        let table = self.unpacked.get_or_init(|| self.table.unpacked());
        let mut albedo = 0.0;
        let lobes = Lobes::fine(table, &self.options)?;
        lobes.visit::<Plain<f64>>(wi, wavelength_nm, |wo, part| albedo += part * factor(wo));
        Some(albedo)
    }
}

/// Whether the tables answer for such a question.
fn answers(wi: Vec3, wo: Vec3, wavelength_nm: f64) -> bool {
    Pair::new(wi, wo).is_some() && (WAVELENGTH_MIN_NM..=WAVELENGTH_MAX_NM).contains(&wavelength_nm)
}

pub(super) fn build_table(field: &HeightField, options: &Options, progress: &Progress) -> Result<Built, TableError> {
    let frequency_max = 2e3 / WAVELENGTH_MIN_NM;
    let s_um = options.coherence_length_um / 4.0;
    let spectrum = Spectrum::new(field, options.model, options.tiling, s_um, frequency_max, options.tolerance);
    build(&spectrum, options.tolerance, progress)
}
