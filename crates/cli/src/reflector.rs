//! A surface that is evaluated by one of the methods, on the CPU.
//!
//! Symbols, as in docs/model.md: f_r = R·O·M·S/λ² is the reflectance in 1/sr, with the Fresnel factor R, the obliquity
//! factor O, the shadowing factor M, and the power spectral density S of the relief's phase screen.

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
use sunbeam::scattering::{ComplexIndex, Options, Pair, SpectralIndex, Vec3};
use sunbeam::table::{WAVELENGTH_MAX_NM, WAVELENGTH_MIN_NM};

/// Largest tile, in pixels, whose direct sums run concurrently. A direct sum over a larger tile is parallel itself, and
/// each needs memory for the whole tile.
const CONCURRENT_PIXELS_MAX: usize = 1 << 16;

/// The evaluator of a method.
enum Evaluator {
    /// The direct sum over the relief.
    Exact(Box<Exact>),
    /// The spectral tables.
    Table(Arc<Surface>),
    /// A method of colours in single precision.
    Realtime(Box<dyn methods::Method>),
    /// The tables of a grating by Maxwell's equations.
    Grating(Arc<(GratingSurface, Origin)>),
    /// A grating by Maxwell's equations that is solved for each query.
    ExactGrating(Box<ExactGrating>),
}

/// A surface and its method of evaluation.
pub(crate) struct Reflector {
    evaluator: Evaluator,
    /// The tables of the phase screen, which have a sampler; built on request or where the method needs them.
    surface: Option<Arc<Surface>>,
    /// The tables of a grating by Maxwell's equations, which have a sampler.
    grating: Option<Arc<(GratingSurface, Origin)>>,
    options: Options,
    index: Option<ComplexIndex>,
    /// Whether queries run concurrently.
    is_concurrent: bool,
}

impl Reflector {
    /// Builds the data of the method.
    ///
    /// The tables have a sampler, and the exact method takes its albedo from them. The published methods have no
    /// sampler: with `sampler`, the tables are built as well.
    pub(crate) fn new(
        args: &SurfaceArgs,
        method: Method,
        method_options: &MethodOptions,
        sampler: bool,
    ) -> Result<Self, Box<dyn Error>> {
        let config = match method {
            Method::Exact | Method::Table => args.config()?,
            Method::Realtime(kind) => args.realtime_config(kind, method_options)?,
        };
        let (options, index) = (config.options(), config.index());
        let cache = args.cache()?;
        if config.theory == Theory::Rigorous {
            return Self::rigorous(&config, method, method_options, &cache, sampler);
        }
        let field = config.height_field()?;
        let built = || with_bar(BUILDING, |progress| cache.surface(&field, &options, progress));
        let surface = || built().map(|(surface, _)| Arc::new(surface));
        let (nx, ny) = field.size();
        let (evaluator, surface) = match method {
            Method::Exact => {
                let surface = surface()?;
                (
                    Evaluator::Exact(Box::new(Exact::new(&field, &options, surface.albedo_table().cloned()))),
                    Some(surface),
                )
            }
            Method::Table => {
                let surface = surface()?;
                (Evaluator::Table(surface.clone()), Some(surface))
            }
            Method::Realtime(kind) => {
                let index = index.map(SpectralIndex::Constant);
                let method = with_bar(BUILDING, |progress| {
                    config.build_method(kind, method_options, index.as_ref(), &cache, progress)
                })?;
                (Evaluator::Realtime(method), sampler.then(surface).transpose()?)
            }
        };
        let is_concurrent = method != Method::Exact || nx * ny <= CONCURRENT_PIXELS_MAX;
        Ok(Self { evaluator, surface, grating: None, options, index, is_concurrent })
    }

    /// A grating by Maxwell's equations.
    ///
    /// `sampler` is true for the services, which answer query by query; only they may solve each query anew.
    fn rigorous(
        config: &SurfaceConfig,
        method: Method,
        method_options: &MethodOptions,
        cache: &Cache,
        sampler: bool,
    ) -> Result<Self, Box<dyn Error>> {
        let index = config.index().map(SpectralIndex::Constant);
        let tabulated = || with_bar(BUILDING, |progress| config.build_shared_grating(index.as_ref(), cache, progress));
        let (evaluator, grating) = match method {
            Method::Exact if sampler => {
                let exact = ExactGrating::new(config.profile()?, index.clone(), config.coherence_length);
                (Evaluator::ExactGrating(Box::new(exact)), None)
            }
            Method::Exact => {
                let advice = "solves each query anew, which is too slow here: --method must be table";
                return Err(format!("--method exact with --theory rigorous {advice}").into());
            }
            Method::Table => {
                let built = tabulated()?;
                (Evaluator::Grating(built.clone()), Some(built))
            }
            Method::Realtime(kind) => {
                let method = with_bar(BUILDING, |progress| {
                    config.build_method(kind, method_options, index.as_ref(), cache, progress)
                })?;
                (Evaluator::Realtime(method), sampler.then(tabulated).transpose()?)
            }
        };
        let (options, index) = (config.options(), config.index());
        Ok(Self { evaluator, surface: None, grating, options, index, is_concurrent: true })
    }

    /// `f_r` in 1/sr.
    ///
    /// # Errors
    /// The solver's message, for a grating that is solved anew.
    pub(crate) fn try_eval(&self, wi: Vec3, wo: Vec3, wavelength_nm: f64) -> Result<f64, String> {
        match &self.evaluator {
            Evaluator::ExactGrating(exact) => exact.eval(wi, wo, wavelength_nm).map_err(|error| error.to_string()),
            _ => Ok(self.eval(wi, wo, wavelength_nm)),
        }
    }

    /// `f_r` in 1/sr; zero for a grating that is solved anew, which needs [`Reflector::try_eval`].
    pub(crate) fn eval(&self, wi: Vec3, wo: Vec3, wavelength_nm: f64) -> f64 {
        let Some(pair) = Pair::new(wi, wo) else { return 0.0 };
        let relief = match &self.evaluator {
            Evaluator::Exact(exact) => exact.eval(wi, wo, wavelength_nm),
            Evaluator::Table(surface) => surface.eval(wi, wo, wavelength_nm),
            Evaluator::Realtime(method) => {
                let spectral = method.answer_spectral(single(wi), single(wo), wavelength_nm as f32).unwrap_or(0.0);
                self.options.angular_factor(&pair) * f64::from(spectral)
            }
            Evaluator::Grating(built) => return built.0.eval(wi, wo, wavelength_nm),
            Evaluator::ExactGrating(_) => return 0.0,
        };
        self.fresnel(&pair) * relief
    }

    /// `S/λ²` in 1/sr, which is `f_r` without `R·O·M`. Energy conservation, if requested, is included.
    ///
    /// For a grating by Maxwell's equations it is `f_r`: its material and its relief do not separate.
    pub(crate) fn relief_spectral(&self, wi: Vec3, wo: Vec3, wavelength_nm: f64) -> f64 {
        let Some(pair) = Pair::new(wi, wo) else { return 0.0 };
        if self.grating.is_some() {
            return self.eval(wi, wo, wavelength_nm);
        }
        self.eval(wi, wo, wavelength_nm) / (self.fresnel(&pair) * self.options.angular_factor(&pair))
    }

    /// The linear sRGB of `f_r` in 1/sr, by the wavelengths of `spectrum` unless the method has its own.
    pub(crate) fn eval_rgb(&self, wi: Vec3, wo: Vec3, spectrum: &SpectralToRgb) -> [f64; 3] {
        let Evaluator::Realtime(method) = &self.evaluator else { return spectrum.rgb_of(|nm| self.eval(wi, wo, nm)) };
        let Some(pair) = Pair::new(wi, wo) else { return [0.0; 3] };
        let factor = match method.answers() {
            AnswerKind::Relief => self.fresnel(&pair) * self.options.angular_factor(&pair),
            AnswerKind::Reflectance => 1.0,
        };
        method.answer_rgb(single(wi), single(wo)).map(|channel| factor * f64::from(channel))
    }

    /// The Fresnel factor R.
    fn fresnel(&self, pair: &Pair) -> f64 {
        pair.interface(self.index, self.options.obliquity)
    }

    /// Refuses wavelengths outside the method's range.
    pub(crate) fn check_wavelengths(&self, wavelengths_nm: &[f64]) -> Result<(), String> {
        if wavelengths_nm.is_empty() {
            return Err("\"wavelength\" is an empty array; at least one is needed".to_owned());
        }
        let range = match &self.evaluator {
            Evaluator::Exact(_) | Evaluator::ExactGrating(_) => f64::MIN_POSITIVE..=f64::MAX,
            Evaluator::Table(_) | Evaluator::Grating(_) => WAVELENGTH_MIN_NM..=WAVELENGTH_MAX_NM,
            Evaluator::Realtime(_) => VISIBLE_NM,
        };
        match wavelengths_nm.iter().find(|nm| !range.contains(nm)) {
            None => Ok(()),
            Some(nm) if *range.end() == f64::MAX => {
                Err(format!("\"wavelength\" is {nm} nm; it must be finite and positive"))
            }
            Some(nm) => Err(format!("\"wavelength\" is {nm} nm; it must be in [{}, {}]", range.start(), range.end())),
        }
    }

    /// The sampler's density per solid angle, the mean over the wavelengths.
    ///
    /// `None` without a sampler, or for a wavelength outside the tables' range.
    pub(crate) fn pdf(&self, wi: Vec3, wo: Vec3, wavelengths_nm: &[f64]) -> Option<f64> {
        let tabulated = |nm: &f64| (WAVELENGTH_MIN_NM..=WAVELENGTH_MAX_NM).contains(nm);
        if !wavelengths_nm.iter().all(tabulated) {
            return None;
        }
        match (&self.surface, &self.grating) {
            (Some(surface), _) => Some(surface.pdf(wi, wo, wavelengths_nm)),
            (None, grating) => grating.as_ref().map(|built| built.0.pdf(wi, wo, wavelengths_nm)),
        }
    }

    /// A sample by the sampler, if there is one; see [`Surface::sample`].
    pub(crate) fn sample(&self, wi: Vec3, wavelengths_nm: &[f64], u: [f64; 3]) -> Option<Sample> {
        match &self.surface {
            Some(surface) => surface.sample(wi, wavelengths_nm, u),
            None => self.grating.as_ref()?.0.sample(wi, wavelengths_nm, u),
        }
    }

    /// Applies `answer` to every item, concurrently where the method allows it; the order is kept.
    pub(crate) fn map<T: Sync, A: Send>(&self, items: &[T], answer: impl Fn(&T) -> A + Sync + Send) -> Vec<A> {
        if self.is_concurrent {
            items.par_iter().with_min_len(8).map(answer).collect()
        } else {
            items.iter().map(answer).collect()
        }
    }
}

/// A direction in single precision.
pub(crate) fn single(direction: Vec3) -> [f32; 3] {
    direction.map(|component| component as f32)
}
