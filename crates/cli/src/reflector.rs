//! A surface as evaluated by one of the methods.

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

/// Largest tile for which direct sums run side by side; those of larger ones are parallel within, and side by side
/// would need a lot of memory.
const SIDE_BY_SIDE_PIXELS: usize = 1 << 16;

/// Wavelengths in nm that the methods of colours answer for.
const VISIBLE_NM: std::ops::RangeInclusive<f64> = 380.0..=780.0;

/// What answers.
enum Evaluator {
    Exact(Box<Exact>),
    Table(Arc<Surface>),
    Realtime(Box<dyn methods::Method>),
    Grating(Arc<(GratingSurface, Origin)>),
    ExactGrating(Box<ExactGrating>),
}

/// A surface and the method that answers for it.
pub struct Reflector {
    evaluator: Evaluator,
    /// The sampler, where it was asked for or is needed anyway.
    surface: Option<Arc<Surface>>,
    /// The same of a grating by Maxwell's equations.
    grating: Option<Arc<(GratingSurface, Origin)>>,
    options: Options,
    index: Option<ComplexIndex>,
    side_by_side: bool,
}

impl Reflector {
    /// Builds what the method needs: the tables, which the exact method takes its albedo from, or the orders of
    /// one of the published methods. The latter have no sampler of their own; `sampler` builds the tables too.
    pub fn new(
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
        let side_by_side = method != Method::Exact || nx * ny <= SIDE_BY_SIDE_PIXELS;
        Ok(Self { evaluator, surface, grating: None, options, index, side_by_side })
    }

    /// A grating by Maxwell's equations; `one_by_one` where a question at a time is asked.
    fn rigorous(
        config: &SurfaceConfig,
        method: Method,
        method_options: &MethodOptions,
        cache: &Cache,
        one_by_one: bool,
    ) -> Result<Self, Box<dyn Error>> {
        let index = config.index().map(SpectralIndex::Constant);
        let tabulated = || with_bar(BUILDING, |progress| config.build_shared_grating(index.as_ref(), cache, progress));
        let (evaluator, grating) = match method {
            Method::Exact if one_by_one => {
                let exact = ExactGrating::new(config.profile()?, index.clone(), config.coherence_length);
                (Evaluator::ExactGrating(Box::new(exact)), None)
            }
            Method::Exact => {
                let advice = "solves each question anew: here --method must be table";
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
                (Evaluator::Realtime(method), one_by_one.then(tabulated).transpose()?)
            }
        };
        let (options, index) = (config.options(), config.index());
        Ok(Self { evaluator, surface: None, grating, options, index, side_by_side: true })
    }

    /// `f_r` in 1/sr, the interface's factor included.
    ///
    /// # Errors
    /// Of a grating that is solved anew, what the solver refuses.
    pub fn try_eval(&self, wi: Vec3, wo: Vec3, wavelength_nm: f64) -> Result<f64, String> {
        match &self.evaluator {
            Evaluator::ExactGrating(exact) => exact.eval(wi, wo, wavelength_nm).map_err(|error| error.to_string()),
            _ => Ok(self.eval(wi, wo, wavelength_nm)),
        }
    }

    /// [`Reflector::try_eval`] of what cannot be refused; zero of a grating that is solved anew.
    pub fn eval(&self, wi: Vec3, wo: Vec3, wavelength_nm: f64) -> f64 {
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
        self.interface(&pair) * relief
    }

    /// What the relief alone answers: `S/λ²` in 1/sr, `f_r` without `R·O·M` (what conserves energy, where it is asked for,
    /// stays in).
    pub fn relief_spectral(&self, wi: Vec3, wo: Vec3, wavelength_nm: f64) -> f64 {
        let Some(pair) = Pair::new(wi, wo) else { return 0.0 };
        if self.grating.is_some() {
            // What the material reflects cannot be told from what the relief does.
            return self.eval(wi, wo, wavelength_nm);
        }
        self.eval(wi, wo, wavelength_nm) / (self.interface(&pair) * self.options.angular_factor(&pair))
    }

    /// The integral of `f_r` over the visible spectrum in linear sRGB, by the method's own wavelengths where it has some,
    /// else by those of `spectrum`.
    pub fn eval_rgb(&self, wi: Vec3, wo: Vec3, spectrum: &SpectralToRgb) -> [f64; 3] {
        let Evaluator::Realtime(method) = &self.evaluator else { return spectrum.rgb_of(|nm| self.eval(wi, wo, nm)) };
        let Some(pair) = Pair::new(wi, wo) else { return [0.0; 3] };
        let factor = match method.answers() {
            AnswerKind::Relief => self.interface(&pair) * self.options.angular_factor(&pair),
            AnswerKind::Reflectance => 1.0,
        };
        method.answer_rgb(single(wi), single(wo)).map(|channel| factor * f64::from(channel))
    }

    fn interface(&self, pair: &Pair) -> f64 {
        pair.interface(self.index, self.options.obliquity)
    }

    /// Refuses wavelengths that the method cannot answer for.
    pub fn check_wavelengths(&self, wavelengths_nm: &[f64]) -> Result<(), String> {
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

    /// The density of the sampler for the wavelengths carried; `None` where there is none or it does not serve one of
    /// them.
    pub fn pdf(&self, wi: Vec3, wo: Vec3, wavelengths_nm: &[f64]) -> Option<f64> {
        let tabulated = |nm: &f64| (WAVELENGTH_MIN_NM..=WAVELENGTH_MAX_NM).contains(nm);
        if !wavelengths_nm.iter().all(tabulated) {
            return None;
        }
        match (&self.surface, &self.grating) {
            (Some(surface), _) => Some(surface.pdf(wi, wo, wavelengths_nm)),
            (None, grating) => grating.as_ref().map(|built| built.0.pdf(wi, wo, wavelengths_nm)),
        }
    }

    /// A direction by the sampler, where there is one; see [`Surface::sample`].
    pub fn sample(&self, wi: Vec3, wavelengths_nm: &[f64], u: [f64; 3]) -> Option<Sample> {
        match &self.surface {
            Some(surface) => surface.sample(wi, wavelengths_nm, u),
            None => self.grating.as_ref()?.0.sample(wi, wavelengths_nm, u),
        }
    }

    /// `answer` of every item in order, computed side by side where that is sensible.
    pub fn map<T: Sync, A: Send>(&self, items: &[T], answer: impl Fn(&T) -> A + Sync + Send) -> Vec<A> {
        if self.side_by_side {
            items.par_iter().with_min_len(8).map(answer).collect()
        } else {
            items.iter().map(answer).collect()
        }
    }
}

/// A direction as the methods take it.
fn single(direction: Vec3) -> [f32; 3] {
    direction.map(|component| component as f32)
}
