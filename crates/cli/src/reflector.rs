//! A surface that is evaluated by one of the methods, on the CPU.
//!
//! A [`Reflector`] has an [`Evaluator`], which computes reflectances, and a [`Sampler`] where the command or the method
//! needs one. Under a cover, a flat clear layer over the relief, both take directions inside the cover. [`Inside`]
//! converts directions, and gives the factors on the reflectance and on the density.
//!
//! Evaluators differ in the factors of f_r that their values contain. [`Reflector::eval`] and [`Reflector::eval_rgb`]
//! multiply the values by the missing factors and by the cover's factor. Where energy is conserved, the values are
//! already divided by the albedo, the reflected fraction of the light from one direction.
//!
//! A surface *transmits* if a transparent body lies below its relief, a film or a half-space (`--transmission`). Light
//! may then arrive and leave on either side, and the surface has no cover.
//!
//! Symbols, as in docs/model.md:
//!
//! - f_r: the reflectance in 1/sr, R·O·M·S/λ² without a cover and without energy conservation;
//! - R: the Fresnel factor;
//! - O: the obliquity factor; the small-slope factor replaces R·O, and then counts as R with O = 1;
//! - M: the shadowing factor;
//! - S: the power spectral density of the relief's phase screen in µm²;
//! - λ: the wavelength in µm;
//! - wi, wo, θo: the directions to light and viewer, and the angle of wo with the normal.

use super::arguments::VISIBLE_NM;
use super::method_args::Method;
use super::progress::{BUILDING, with_bar};
use super::surface_args::SurfaceArgs;
use rayon::prelude::*;
use std::error::Error;
use std::sync::Arc;
use sunbeam::cache::{Cache, Origin};
use sunbeam::colour::SpectralToRgb;
use sunbeam::config::{SurfaceConfig, Theory};
use sunbeam::grating::{ExactGrating, GratingSurface};
use sunbeam::lobe::{Exact, Sample, Surface};
use sunbeam::methods::{self, AnswerKind, MethodOptions};
use sunbeam::scattering::{ComplexIndex, Cover, Inside, Options, Pair, SpectralIndex, Vec3};
use sunbeam::table::{WAVELENGTH_MAX_NM, WAVELENGTH_MIN_NM};

/// Largest number of pixels of a tile whose direct sums run concurrently. A direct sum over a larger tile is parallel
/// by itself, and each sum needs memory for the whole tile. Smaller values would leave cores idle on small tiles.
const CONCURRENT_PIXELS_MAX: usize = 1 << 16;
/// Smallest number of items that share a task in [`Reflector::map`]. A single look-up is too short for a task of its
/// own; larger numbers would leave cores idle on short lists.
const ITEMS_PER_TASK: usize = 8;

/// The tables of a grating by Maxwell's equations, as the cache returns them.
type CachedGrating = Arc<(GratingSurface, Origin)>;

/// The use that a command makes of a [`Reflector`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Purpose {
    /// Answers to single queries, with sampling densities and samples. Only tables have a sampler, so for methods
    /// without tables they are built in addition to the method's data.
    Service,
    /// Reflectances of very many pairs of directions.
    Map,
}

/// The evaluator of a method, with the factors of f_r that its values contain. For a surface that transmits, the values
/// of every evaluator are the whole scattering function instead.
enum Evaluator {
    /// The direct sum over the relief, `O·M·S/λ²`.
    Exact(Box<Exact>),
    /// The spectral tables, `O·M·S/λ²`.
    Table(Arc<Surface>),
    /// A method that computes colours in single precision. Its spectral answer is `S/λ²`; its [`AnswerKind`] tells the
    /// factors that its colours contain.
    Colour(Box<dyn methods::Method>),
    /// The tables of a grating by Maxwell's equations, `f_r`.
    Grating(CachedGrating),
    /// A grating by Maxwell's equations that is solved for each query, `f_r`. Queries can fail, see
    /// [`Reflector::try_eval`].
    ExactGrating(Box<ExactGrating>),
}

/// The tables from which directions are sampled.
enum Sampler {
    /// The spectral tables of a phase screen.
    PhaseScreen(Arc<Surface>),
    /// The tables of a grating by Maxwell's equations.
    Grating(CachedGrating),
}

impl Sampler {
    /// Density of `wo` in 1/sr, the mean over the wavelengths. Both directions are inside the cover.
    fn pdf(&self, wi: Vec3, wo: Vec3, wavelengths_nm: &[f64]) -> f64 {
        match self {
            Self::PhaseScreen(surface) => surface.pdf(wi, wo, wavelengths_nm),
            Self::Grating(grating) => grating.0.pdf(wi, wo, wavelengths_nm),
        }
    }

    /// A direction drawn for `wi`, both inside the cover; `None` below the horizon.
    fn sample(&self, wi: Vec3, wavelengths_nm: &[f64], u: [f64; 3]) -> Option<Sample> {
        match self {
            Self::PhaseScreen(surface) => surface.sample(wi, wavelengths_nm, u),
            Self::Grating(grating) => grating.0.sample(wi, wavelengths_nm, u),
        }
    }
}

/// A surface and its method of evaluation.
pub(crate) struct Reflector {
    evaluator: Evaluator,
    /// `None` where neither the method nor the command needs the sampler's tables, and for a grating that is solved for
    /// each query.
    sampler: Option<Sampler>,
    /// Options of the tables, for the relief inside the cover.
    options: Options,
    /// Index of the material, relative to the cover's; `None` for a perfect conductor.
    index: Option<ComplexIndex>,
    /// Cover over the relief; evaluator and sampler take directions inside it.
    cover: Option<Cover>,
    /// Whether [`Reflector::map`] evaluates items concurrently.
    is_concurrent: bool,
}

impl Reflector {
    /// Builds the data of the method. The exact method takes its albedo from the tables, so they are built for it, too.
    ///
    /// # Errors
    /// Arguments of the surface that are wrong or contradict the method, or data that cannot be built.
    pub(crate) fn new(
        args: &SurfaceArgs,
        method: Method,
        method_options: &MethodOptions,
        purpose: Purpose,
    ) -> Result<Self, Box<dyn Error>> {
        let config = match method {
            Method::Exact | Method::Table => args.config()?,
            Method::Colour(kind) => args.colour_config(kind, method_options)?,
        };
        if purpose == Purpose::Map {
            config.refuse_transmission("maps and peaks")?;
        }
        let (options, cover) = (config.options(), config.cover());
        let index = config.index_inside();
        let cache = args.cache()?;
        if config.theory == Theory::Rigorous {
            return Self::rigorous(&config, method, method_options, &cache, purpose);
        }
        let field = config.height_field_inside()?;
        let build_surface = || {
            let built = with_bar(BUILDING, |progress| cache.surface(&field, &options, progress));
            built.map(|(surface, _)| Arc::new(surface))
        };
        let (nx, ny) = field.size();
        // The second value has the tables from which directions are sampled.
        let (evaluator, sampled) = match method {
            Method::Exact => {
                let surface = build_surface()?;
                // Without a table of albedos nothing is divided: energy is not conserved, or no albedo exceeds 1.
                let exact = Exact::new(&field, &options, surface.albedo_table().cloned());
                (Evaluator::Exact(Box::new(exact)), Some(surface))
            }
            Method::Table => {
                let surface = build_surface()?;
                (Evaluator::Table(surface.clone()), Some(surface))
            }
            Method::Colour(kind) => {
                // Index of the material in air; `index` is relative to the cover's.
                let material = config.index().map(SpectralIndex::Constant);
                let method = with_bar(BUILDING, |progress| {
                    config.build_method(kind, method_options, material.as_ref(), &cache, progress)
                })?;
                (Evaluator::Colour(method), (purpose == Purpose::Service).then(build_surface).transpose()?)
            }
        };
        let is_concurrent = method != Method::Exact || nx * ny <= CONCURRENT_PIXELS_MAX;
        Ok(Self { evaluator, sampler: sampled.map(Sampler::PhaseScreen), options, index, cover, is_concurrent })
    }

    /// [`Reflector::new`] for a grating by Maxwell's equations.
    ///
    /// The exact method solves each query anew, which is too slow for the many queries of maps. It has no sampler.
    fn rigorous(
        config: &SurfaceConfig,
        method: Method,
        method_options: &MethodOptions,
        cache: &Cache,
        purpose: Purpose,
    ) -> Result<Self, Box<dyn Error>> {
        // Index of the material in air; `index_inside` is relative to the cover's.
        let material = config.index().map(SpectralIndex::Constant);
        let build_tables =
            || with_bar(BUILDING, |progress| config.build_shared_grating(material.as_ref(), cache, progress));
        let (evaluator, sampled) = match method {
            Method::Exact if purpose == Purpose::Service => {
                let relative = config.index_inside().map(SpectralIndex::Constant);
                let (profile, coherence_um) = (config.profile_inside()?, config.grating_coherence_um());
                let exact = match config.body() {
                    Some(body) => ExactGrating::of_body(profile, body, coherence_um),
                    None => ExactGrating::new(profile, relative, coherence_um),
                };
                (Evaluator::ExactGrating(Box::new(exact)), None)
            }
            Method::Exact => {
                let advice = "solves each query anew, which is too slow here: --method must be table";
                return Err(format!("--method exact with --theory rigorous {advice}").into());
            }
            Method::Table => {
                let grating = build_tables()?;
                (Evaluator::Grating(grating.clone()), Some(grating))
            }
            Method::Colour(kind) => {
                let method = with_bar(BUILDING, |progress| {
                    config.build_method(kind, method_options, material.as_ref(), cache, progress)
                })?;
                (Evaluator::Colour(method), (purpose == Purpose::Service).then(build_tables).transpose()?)
            }
        };
        let (options, index, cover) = (config.options(), config.index_inside(), config.cover());
        // A look-up is short, and the solver of a single query uses one core.
        let is_concurrent = true;
        Ok(Self { evaluator, sampler: sampled.map(Sampler::Grating), options, index, cover, is_concurrent })
    }

    /// `f_r` in 1/sr, by every evaluator; zero unless both directions are above the surface, or the surface transmits.
    ///
    /// # Errors
    /// The solver's message, for a grating that is solved for each query.
    pub(crate) fn try_eval(&self, wi: Vec3, wo: Vec3, wavelength_nm: f64) -> Result<f64, String> {
        match &self.evaluator {
            Evaluator::ExactGrating(exact) => {
                let Some(Inside { wi, wo, factor, .. }) = self.inside(wi, wo) else { return Ok(0.0) };
                exact.eval(wi, wo, wavelength_nm).map(|f| factor * f).map_err(|error| error.to_string())
            }
            _ => Ok(self.eval(wi, wo, wavelength_nm)),
        }
    }

    /// `f_r` in 1/sr; zero unless both directions are above the surface, or the surface transmits. A grating that is
    /// solved for each query needs [`Reflector::try_eval`]: this function returns zero for it.
    pub(crate) fn eval(&self, wi: Vec3, wo: Vec3, wavelength_nm: f64) -> f64 {
        if self.options.body.is_some() {
            // There is no cover, and directions below the surface count.
            return self.relief(wi, wo, wavelength_nm);
        }
        let Some(Inside { wi, wo, factor, .. }) = Inside::new(self.cover, wi, wo) else { return 0.0 };
        let Some(pair) = Pair::new(wi, wo) else { return 0.0 };
        let reflectance = match &self.evaluator {
            // The tables of a grating contain the Fresnel factor.
            Evaluator::Grating(grating) => grating.0.eval(wi, wo, wavelength_nm),
            _ => self.fresnel(&pair) * self.relief(wi, wo, wavelength_nm),
        };
        factor * reflectance
    }

    /// `S/λ²` in 1/sr, which is `f_r` without `R·O·M` and cover, divided by the albedo where energy is conserved. Where
    /// the material has the index of the medium above it, `R` and `f_r` are 0, while `S/λ²` does not depend on the
    /// index.
    ///
    /// For a grating by Maxwell's equations it is `f_r`, since its material and its relief do not separate. Surfaces
    /// that transmit have none; [`Purpose::Map`] refuses them.
    pub(crate) fn relief_spectral(&self, wi: Vec3, wo: Vec3, wavelength_nm: f64) -> f64 {
        if matches!(self.evaluator, Evaluator::Grating(_)) {
            return self.eval(wi, wo, wavelength_nm);
        }
        let Some(Inside { wi, wo, .. }) = Inside::new(self.cover, wi, wo) else { return 0.0 };
        let Some(pair) = Pair::new(wi, wo) else { return 0.0 };
        self.relief(wi, wo, wavelength_nm) / self.options.angular_factor(&pair)
    }

    /// `O·M·S/λ²` in 1/sr of a pair inside the cover, divided by the albedo where energy is conserved. Zero unless both
    /// directions are above the surface.
    ///
    /// For a surface that transmits it is the whole scattering function. Tables of a grating that does not transmit
    /// have `f_r` alone, and callers evaluate them directly. A grating that is solved for each query gives zero.
    fn relief(&self, wi: Vec3, wo: Vec3, wavelength_nm: f64) -> f64 {
        match &self.evaluator {
            Evaluator::Exact(exact) => exact.eval(wi, wo, wavelength_nm),
            Evaluator::Table(surface) => surface.eval(wi, wo, wavelength_nm),
            Evaluator::Colour(method) => {
                let Some(pair) = Pair::new(wi, wo) else { return 0.0 };
                // Methods without values by wavelength are refused for spectra (`Quantity::Spectrum`).
                let spectral = method.answer_spectral(single(wi), single(wo), wavelength_nm as f32).unwrap_or(0.0);
                self.options.angular_factor(&pair) * f64::from(spectral)
            }
            // Only gratings on a body that transmits come here.
            Evaluator::Grating(grating) => grating.0.eval(wi, wo, wavelength_nm),
            Evaluator::ExactGrating(_) => 0.0,
        }
    }

    /// The linear sRGB of `f_r` in 1/sr. Spectral evaluators are summed over the wavelengths of `to_rgb`; methods that
    /// compute colours choose their own wavelengths.
    pub(crate) fn eval_rgb(&self, wi: Vec3, wo: Vec3, to_rgb: &SpectralToRgb) -> [f64; 3] {
        let Evaluator::Colour(method) = &self.evaluator else { return to_rgb.rgb_of(|nm| self.eval(wi, wo, nm)) };
        let Some(Inside { wi, wo, factor, .. }) = Inside::new(self.cover, wi, wo) else { return [0.0; 3] };
        let Some(pair) = Pair::new(wi, wo) else { return [0.0; 3] };
        // All answers lack the cover's factor, and answers of the kind `Relief` lack R·O·M, too. Colours of films are
        // not computed here: `new` refuses transmission for maps.
        let factor = match method.answers() {
            AnswerKind::Relief => factor * self.fresnel(&pair) * self.options.angular_factor(&pair),
            AnswerKind::Reflectance | AnswerKind::Film { .. } => factor,
        };
        method.answer_rgb(single(wi), single(wo)).map(|channel| factor * f64::from(channel))
    }

    /// The directions inside the cover, with the factors of the cover; `None` unless both directions are above the
    /// surface, or the surface transmits. A surface that transmits has no cover.
    fn inside(&self, wi: Vec3, wo: Vec3) -> Option<Inside> {
        match self.options.body {
            Some(_) => Some(Inside::bare(wi, wo)),
            None => Inside::new(self.cover, wi, wo),
        }
    }

    /// The Fresnel factor R, or the small-slope factor in its place. [`Options::angular_factor`] has O·M.
    fn fresnel(&self, pair: &Pair) -> f64 {
        pair.interface(self.index, self.options.obliquity)
    }

    /// Refuses an empty list of wavelengths, and wavelengths outside the method's range.
    pub(crate) fn check_wavelengths(&self, wavelengths_nm: &[f64]) -> Result<(), String> {
        if wavelengths_nm.is_empty() {
            return Err("\"wavelength\" is an empty array; at least one is needed".to_owned());
        }
        let range = match &self.evaluator {
            Evaluator::Exact(_) | Evaluator::ExactGrating(_) => f64::MIN_POSITIVE..=f64::MAX,
            Evaluator::Table(_) | Evaluator::Grating(_) => WAVELENGTH_MIN_NM..=WAVELENGTH_MAX_NM,
            Evaluator::Colour(_) => VISIBLE_NM,
        };
        match wavelengths_nm.iter().find(|nm| !range.contains(nm)) {
            None => Ok(()),
            // The exact methods take every positive wavelength, so the message names no limits.
            Some(nm) if *range.end() == f64::MAX => {
                Err(format!("\"wavelength\" is {nm} nm; it must be finite and positive"))
            }
            Some(nm) => Err(format!("\"wavelength\" is {nm} nm; it must be in [{}, {}]", range.start(), range.end())),
        }
    }

    /// The sampler's density in 1/sr, the mean over the wavelengths. The first case that applies decides:
    ///
    /// - `None` for a wavelength outside the tables' range;
    /// - zero unless both directions are above the surface, or the surface transmits;
    /// - `None` without a sampler.
    pub(crate) fn pdf(&self, wi: Vec3, wo: Vec3, wavelengths_nm: &[f64]) -> Option<f64> {
        let tabulated = |nm: &f64| (WAVELENGTH_MIN_NM..=WAVELENGTH_MAX_NM).contains(nm);
        if !wavelengths_nm.iter().all(tabulated) {
            return None;
        }
        let Some(Inside { wi, wo, density, .. }) = self.inside(wi, wo) else { return Some(0.0) };
        Some(density * self.sampler.as_ref()?.pdf(wi, wo, wavelengths_nm))
    }

    /// A direction drawn by the sampler from the random numbers `u` in [0, 1); see [`Surface::sample`].
    ///
    /// `None` for a sample below the horizon or one that the cover reflects totally, and without a sampler.
    pub(crate) fn sample(&self, wi: Vec3, wavelengths_nm: &[f64], u: [f64; 3]) -> Option<Sample> {
        let sampler = self.sampler.as_ref()?;
        let Some(cover) = self.cover else { return sampler.sample(wi, wavelengths_nm, u) };
        // The outgoing direction is not known yet, so `wi` stands in for it. Only `wi` inside the cover is used.
        let drawn = sampler.sample(Inside::new(self.cover, wi, wi)?.wi, wavelengths_nm, u)?;
        let wo = cover.outside(drawn.wo)?;
        let Inside { factor, density, .. } = Inside::new(self.cover, wi, wo)?;
        // The weight is the value of the sampler's tables times cosθo over the density. Each of the three is converted
        // from inside the cover to outside.
        let weight = drawn.weight * factor * wo[2] / (density * drawn.wo[2]);
        Some(Sample { wo, pdf: density * drawn.pdf, weight })
    }

    /// Applies `answer` to every item as [`Reflector::map_indices`] does.
    pub(crate) fn map<T: Sync, A: Send>(&self, items: &[T], answer: impl Fn(&T) -> A + Sync + Send) -> Vec<A> {
        self.map_indices(items.len(), |i| answer(&items[i]))
    }

    /// Applies `answer` to the indices below `count`, concurrently where the method allows it; the order is kept.
    pub(crate) fn map_indices<A: Send>(&self, count: usize, answer: impl Fn(usize) -> A + Sync + Send) -> Vec<A> {
        if self.is_concurrent {
            (0..count).into_par_iter().with_min_len(ITEMS_PER_TASK).map(answer).collect()
        } else {
            (0..count).map(answer).collect()
        }
    }
}

/// A direction in single precision.
pub(crate) fn single(direction: Vec3) -> [f32; 3] {
    direction.map(|component| component as f32)
}
