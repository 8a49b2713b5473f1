use super::albedo::Place;
use super::cell_shares::Incidence;
use super::lobes::Lobes;
use super::{AlbedoReport, AlbedoTable, AlbedoView, CellShares, Obliquity, Pair, Proposal, Vec3};
use crate::height_field::HeightField;
use crate::numeric::Plain;
use crate::table::{
    Model, SpectralTable, Spectrum, TableError, TableReport, Tiling, WAVELENGTH_MAX_NM, WAVELENGTH_MIN_NM, build,
    estimate_bytes,
};
use serde::{Deserialize, Serialize};
use std::f64::consts::TAU;
use std::sync::Arc;

/// Share of samples drawn uniformly over the hemisphere: it bounds the weight where the orders' own density is far below
/// what is reflected.
pub const UNIFORM_SHARE: f64 = 0.02;

pub(super) const COS_85_DEGREES: f64 = 0.087_155_742_747_658_17;

/// What of the model is asked for (model.md §2); the defaults are those of the plugin for a preset.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Options {
    /// Four standard deviations of the coherence window, in µm.
    pub coherence_length_um: f64,
    pub model: Model,
    pub tiling: Tiling,
    pub obliquity: Obliquity,
    /// Scale so that the albedo is at most one.
    pub conserve_energy: bool,
    /// V-cavity shadowing and masking.
    pub shadowing: bool,
    /// Relative error the tables are built to.
    pub tolerance: f64,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            coherence_length_um: 65.0,
            model: Model::Ensemble,
            tiling: Tiling::Periodic,
            obliquity: Obliquity::Stam,
            conserve_energy: true,
            shadowing: false,
            tolerance: 1e-3,
        }
    }
}

impl Options {
    /// `O·M` of a pair of directions.
    pub fn angular_factor(&self, pair: &Pair) -> f64 {
        pair.obliquity(self.obliquity) * if self.shadowing { pair.shadowing() } else { 1.0 }
    }
}

/// Value and density of one pair of directions at one wavelength.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Answer {
    /// `f_r` in 1/sr, Fresnel reflectance left out.
    pub f: f64,
    /// Density of [`Surface::sample`] per solid angle, 1/sr.
    pub pdf: f64,
}

/// A sampled direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample {
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
    table: SpectralTable,
    proposal: Proposal,
    albedo_table: Option<Arc<AlbedoTable>>,
    report: SurfaceReport,
}

/// What building a surface took and gave.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct SurfaceReport {
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
    /// A coherence length outside [1e-3, 1e5] µm, a tolerance outside [1e-6, 0.1], or tables too large.
    pub fn new(field: &HeightField, options: &Options) -> Result<Self, TableError> {
        let start = std::time::Instant::now();
        in_range("coherence_length", options.coherence_length_um, 1e-3..=1e5, "0.001 to 100000 µm")?;
        in_range("tolerance", options.tolerance, 1e-6..=0.1, "1e-6 to 0.1")?;
        let (table, table_report) = build_table(field, options)?;
        let mut energy = None;
        let mut albedo_table = None;
        if options.conserve_energy {
            // A patch is one member of the ensemble; its albedo is taken to be that of the mean.
            let built = match options.model {
                Model::Ensemble => AlbedoTable::build(&table, options),
                Model::Patch => {
                    let ensemble = Options { model: Model::Ensemble, ..options.clone() };
                    AlbedoTable::build(&build_table(field, &ensemble)?.0, options)
                }
            };
            if let Some((built, report)) = built {
                energy = Some(report);
                albedo_table = (!built.is_one()).then(|| Arc::new(built));
            }
        }
        let proposal = Proposal::new(&table, options);
        let albedo_bytes = albedo_table.as_ref().map_or(0, |table| table.bytes());
        let report = SurfaceReport {
            bytes: table.bytes() + proposal.bytes() + albedo_bytes,
            table: table_report,
            energy,
            build_seconds: start.elapsed().as_secs_f64(),
        };
        Ok(Self { options: options.clone(), table, proposal, albedo_table, report })
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
    pub fn table(&self) -> &SpectralTable {
        &self.table
    }

    /// What orders are drawn from.
    pub fn proposal(&self) -> &Proposal {
        &self.proposal
    }

    /// What the reflectance is divided by to conserve energy, `None` where nothing is.
    pub fn albedo_table(&self) -> Option<&Arc<AlbedoTable>> {
        self.albedo_table.as_ref()
    }

    /// `f_r` of [`Surface::eval_pdf`] alone, in a fraction of the time.
    pub fn f(&self, wi: Vec3, wo: Vec3, wavelength_nm: f64) -> f64 {
        self.pair(wi, wo).map_or(0.0, |pair| pair.f(wavelength_nm))
    }

    /// `f_r` and the density of [`Surface::sample`]; both zero unless the directions lie above the surface and the
    /// wavelength (nm) within the table's range. Never negative, never NaN.
    pub fn eval_pdf(&self, wi: Vec3, wo: Vec3, wavelength_nm: f64) -> Answer {
        self.pair(wi, wo).map_or(Answer::default(), |pair| pair.at(wavelength_nm))
    }

    /// What a pair of directions needs at every wavelength; `None` unless both lie above the surface.
    pub fn pair(&self, wi: Vec3, wo: Vec3) -> Option<SurfacePair<'_>> {
        let pair = Pair::new(wi, wo)?;
        let albedo = self.albedo_table.as_deref().map(|table| {
            let view = table.view::<f64>();
            let places = [view.place(wi), view.place(wo)];
            (view, places)
        });
        Some(SurfacePair {
            surface: self,
            wi,
            wo,
            pair,
            incidence: CellShares::incidence(wi),
            angular_factor: self.options.angular_factor(&pair),
            albedo,
        })
    }

    /// The density of a direction sampled for several wavelengths at once: the mean of each one's (model.md §5.4).
    pub fn pdf(&self, wi: Vec3, wo: Vec3, wavelengths_nm: &[f64]) -> f64 {
        let Some(pair) = self.pair(wi, wo) else { return 0.0 };
        wavelengths_nm.iter().map(|&l| pair.at(l).pdf).sum::<f64>() / wavelengths_nm.len().max(1) as f64
    }

    /// Samples an outgoing direction for the wavelengths carried (at least one, nm), with its density and weight.
    /// `None` as in [`Surface::sample_direction`]; such samples count as zero.
    pub fn sample(&self, wi: Vec3, wavelengths_nm: &[f64], u: [f64; 3]) -> Option<Sample> {
        let wo = self.sample_direction(wi, wavelengths_nm, u)?;
        let pair = self.pair(wi, wo)?;
        let answers = wavelengths_nm.iter().map(|&l| pair.at(l));
        let (mut pdf, mut first) = (0.0, None);
        for answer in answers {
            pdf += answer.pdf / wavelengths_nm.len() as f64;
            first.get_or_insert(answer.f);
        }
        (pdf > 0.0).then(|| Sample { wo, pdf, weight: first.unwrap_or(0.0) * wo[2] / pdf })
    }

    /// A direction from three random numbers in [0, 1): the first picks the uniform lobe or one of the wavelengths (nm),
    /// the others an order by its [`Proposal`] and a place in its Gaussian. `None` where that lies too far beyond the
    /// horizon, or `wi` below it.
    pub fn sample_direction(&self, wi: Vec3, wavelengths_nm: &[f64], u: [f64; 3]) -> Option<Vec3> {
        if wi[2].is_nan() || wi[2] <= 0.0 {
            return None;
        }
        if u[0] < UNIFORM_SHARE {
            let z = 1.0 - u[1];
            let r = (1.0 - z * z).max(0.0).sqrt();
            return Some([r * (TAU * u[2]).cos(), r * (TAU * u[2]).sin(), z]);
        }
        let hero = (u[0] - UNIFORM_SHARE) / (1.0 - UNIFORM_SHARE) * wavelengths_nm.len() as f64;
        let wavelength_nm = *wavelengths_nm.get((hero as usize).min(wavelengths_nm.len().checked_sub(1)?))?;
        self.sample_order(wi, wavelength_nm, [u[1], u[2]])
    }

    /// A direction by the orders of one wavelength alone.
    pub(super) fn sample_order(&self, wi: Vec3, wavelength_nm: f64, u: [f64; 2]) -> Option<Vec3> {
        self.proposal.at(&self.table, &self.options, wi, &CellShares::incidence(wi), wavelength_nm).sample(u)
    }

    /// `∫ f_r cosθo dωo` over the upper hemisphere with the Fresnel reflectance left out, every node of the table
    /// integrated over its Gaussian. `None` for a patch.
    pub fn albedo(&self, wi: Vec3, wavelength_nm: f64) -> Option<f64> {
        let albedo = self.albedo_table.as_ref().map(|table| (table.view::<f64>(), table.view().place(wi)));
        let factor = |wo: Vec3| match &albedo {
            Some((view, place)) => view.factor_at(place, &view.place(wo), wavelength_nm, true),
            None => 1.0,
        };
        Some(Lobes::new(&self.table)?.albedo(wi, wavelength_nm, &self.options, factor))
    }
}

/// What reads the albedo table, and where it does for `wi` and `wo`.
type PairAlbedo<'a> = (AlbedoView<Plain<'a, f64>>, [Place<Plain<'a, f64>>; 2]);

/// A surface and a pair of directions, ready to answer for any wavelength.
pub struct SurfacePair<'a> {
    surface: &'a Surface,
    wi: Vec3,
    wo: Vec3,
    pair: Pair,
    incidence: Incidence,
    angular_factor: f64,
    albedo: Option<PairAlbedo<'a>>,
}

impl SurfacePair<'_> {
    /// What the model takes of the directions.
    pub fn pair(&self) -> &Pair {
        &self.pair
    }

    /// As [`Surface::eval_pdf`].
    pub fn at(&self, wavelength_nm: f64) -> Answer {
        if !(WAVELENGTH_MIN_NM..=WAVELENGTH_MAX_NM).contains(&wavelength_nm) {
            return Answer::default();
        }
        let (surface, pair, q) = (self.surface, &self.pair, [self.wo[0], self.wo[1]]);
        let wavelength_um = wavelength_nm * 1e-3;
        let local = surface.proposal.at(&surface.table, &surface.options, self.wi, &self.incidence, wavelength_nm);
        let density = local.lookup(q, pair.kappa(wavelength_um));
        let proposed = density.proposal * pair.cos_o + local.folded(q, pair.cos_o);
        let per_area = 1.0 / (wavelength_um * wavelength_um);
        Answer {
            f: self.factor(wavelength_nm) * density.value * per_area,
            pdf: (1.0 - UNIFORM_SHARE) * proposed * per_area + UNIFORM_SHARE / TAU,
        }
    }

    /// `f_r` of [`SurfacePair::at`] alone, in a fraction of the time.
    pub fn f(&self, wavelength_nm: f64) -> f64 {
        if !(WAVELENGTH_MIN_NM..=WAVELENGTH_MAX_NM).contains(&wavelength_nm) {
            return 0.0;
        }
        let wavelength_um = wavelength_nm * 1e-3;
        let frequency = [0, 1].map(|c| (self.wi[c] + self.wo[c]) / wavelength_um);
        let density = self.surface.table.density(frequency, self.pair.kappa(wavelength_um));
        let per_area = 1.0 / (wavelength_um * wavelength_um);
        self.factor(wavelength_nm) * density * per_area
    }

    /// `O·M`, and what conserves energy.
    fn factor(&self, wavelength_nm: f64) -> f64 {
        let conserving = match &self.albedo {
            Some((view, [i, o])) => view.factor_at(i, o, wavelength_nm, true),
            None => 1.0,
        };
        self.angular_factor * conserving
    }
}

fn build_table(field: &HeightField, options: &Options) -> Result<(SpectralTable, TableReport), TableError> {
    build(&spectrum(field, options), options.tolerance)
}

/// Size in bytes of the table of `S` that [`Surface::new`] would build first for `field`, which takes no transform to tell;
/// see [`estimate_bytes`]. The sampler and the albedo come on top.
pub fn estimate_table_bytes(field: &HeightField, options: &Options) -> usize {
    estimate_bytes(&spectrum(field, options), options.tolerance)
}

fn spectrum(field: &HeightField, options: &Options) -> Spectrum {
    let frequency_max = 2e3 / WAVELENGTH_MIN_NM;
    let s_um = options.coherence_length_um / 4.0;
    Spectrum::new(field, options.model, options.tiling, s_um, frequency_max, options.tolerance)
}

fn in_range(
    name: &'static str,
    value: f64,
    range: std::ops::RangeInclusive<f64>,
    accepted: &'static str,
) -> Result<(), TableError> {
    if range.contains(&value) { Ok(()) } else { Err(TableError::OutOfRange { name, value, accepted }) }
}
