//! A surface as evaluated by one of the methods.

use super::method_args::Method;
use super::progress::with_bar;
use super::surface_args::SurfaceArgs;
use rayon::prelude::*;
use std::error::Error;
use std::sync::Arc;
use sunbeam::colour::SpectralToRgb;
use sunbeam::methods::{self, MethodOptions};
use sunbeam::reflectance::{ComplexIndex, Exact, Options, Pair, Sample, Surface, Vec3};
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
}

/// A surface and the method that answers for it.
pub struct Reflector {
    evaluator: Evaluator,
    /// The sampler, where it was asked for or is needed anyway.
    surface: Option<Arc<Surface>>,
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
        let field = config.height_field()?;
        let (options, index) = (config.options(), config.index());
        let cache = args.cache()?;
        let built = || with_bar(|progress| cache.surface_watched(&field, &options, progress));
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
                let built = methods::build(kind, &field, &options, method_options)?;
                (Evaluator::Realtime(built), sampler.then(surface).transpose()?)
            }
        };
        let side_by_side = method != Method::Exact || nx * ny <= SIDE_BY_SIDE_PIXELS;
        Ok(Self { evaluator, surface, options, index, side_by_side })
    }

    /// `f_r` in 1/sr, the Fresnel reflectance included.
    pub fn eval(&self, wi: Vec3, wo: Vec3, wavelength_nm: f64) -> f64 {
        let Some(pair) = Pair::new(wi, wo) else { return 0.0 };
        self.fresnel(&pair)
            * match &self.evaluator {
                Evaluator::Exact(exact) => exact.eval(wi, wo, wavelength_nm),
                Evaluator::Table(surface) => surface.eval(wi, wo, wavelength_nm),
                Evaluator::Realtime(method) => {
                    let spectral = method.relief_spectral(sum(&pair), wavelength_nm as f32).unwrap_or(0.0);
                    self.options.angular_factor(&pair) * f64::from(spectral)
                }
            }
    }

    /// What the relief alone answers: `S/λ²` in 1/sr, `f_r` without `R·O·M` (what conserves energy, where it is asked for,
    /// stays in).
    pub fn relief_spectral(&self, wi: Vec3, wo: Vec3, wavelength_nm: f64) -> f64 {
        let Some(pair) = Pair::new(wi, wo) else { return 0.0 };
        self.eval(wi, wo, wavelength_nm) / (self.fresnel(&pair) * self.options.angular_factor(&pair))
    }

    /// The integral of `f_r` over the visible spectrum in linear sRGB, by the method's own wavelengths where it has some,
    /// else by those of `spectrum`.
    pub fn eval_rgb(&self, wi: Vec3, wo: Vec3, spectrum: &SpectralToRgb) -> [f64; 3] {
        let Evaluator::Realtime(method) = &self.evaluator else { return spectrum.rgb_of(|nm| self.eval(wi, wo, nm)) };
        let Some(pair) = Pair::new(wi, wo) else { return [0.0; 3] };
        let factor = if method.is_shown_as_it_is() {
            1.0 / pair.cos_i
        } else {
            self.fresnel(&pair) * self.options.angular_factor(&pair)
        };
        let conserving = method.conserving(wi.map(|c| c as f32), wo.map(|c| c as f32));
        let response = method.relief_rgb(sum(&pair));
        std::array::from_fn(|c| factor * f64::from(response[c] * conserving[c]))
    }

    fn fresnel(&self, pair: &Pair) -> f64 {
        pair.fresnel(self.index)
    }

    /// Refuses wavelengths that the method cannot answer for.
    pub fn check_wavelengths(&self, wavelengths_nm: &[f64]) -> Result<(), String> {
        if wavelengths_nm.is_empty() {
            return Err("\"wavelength\" is an empty array; at least one is needed".to_owned());
        }
        let range = match &self.evaluator {
            Evaluator::Exact(_) => f64::MIN_POSITIVE..=f64::MAX,
            Evaluator::Table(_) => WAVELENGTH_MIN_NM..=WAVELENGTH_MAX_NM,
            Evaluator::Realtime(_) => VISIBLE_NM,
        };
        match wavelengths_nm.iter().find(|nm| !range.contains(nm)) {
            None => Ok(()),
            Some(nm) if matches!(self.evaluator, Evaluator::Exact(_)) => {
                Err(format!("\"wavelength\" is {nm} nm; it must be finite and positive"))
            }
            Some(nm) => Err(format!("\"wavelength\" is {nm} nm; it must be in [{}, {}]", range.start(), range.end())),
        }
    }

    /// The density of the sampler for the wavelengths carried; `None` where there is none or it does not serve one of
    /// them.
    pub fn pdf(&self, wi: Vec3, wo: Vec3, wavelengths_nm: &[f64]) -> Option<f64> {
        let tabulated = |nm: &f64| (WAVELENGTH_MIN_NM..=WAVELENGTH_MAX_NM).contains(nm);
        let surface = self.surface.as_ref().filter(|_| wavelengths_nm.iter().all(tabulated))?;
        Some(surface.pdf(wi, wo, wavelengths_nm))
    }

    /// A direction by the sampler, where there is one; see [`Surface::sample`].
    pub fn sample(&self, wi: Vec3, wavelengths_nm: &[f64], u: [f64; 3]) -> Option<Sample> {
        self.surface.as_ref()?.sample(wi, wavelengths_nm, u)
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

/// `wi + wo` as the methods take it.
fn sum(pair: &Pair) -> [f32; 3] {
    [pair.u, pair.v, pair.w].map(|component| component as f32)
}
