//! What C++ asks of a surface. Every function that C++ calls runs inside [`guard()`]: an error or a panic becomes an
//! `Err`, which cxx throws as a C++ exception and the plugin rethrows as one of Mitsuba's.

use super::describe::describe;
use super::integrated::IntegratedLobe;
use super::scope::{Owned, TraceError, trace};
use super::traced::{Traced, Var, WordsVar};
use crate::cache::{Cache, Origin};
use crate::config::{BuildError, SurfaceConfig};
use crate::guard::{Panic, guard};
use crate::numeric::{Numbers, Plain, Real};
use crate::reflectance::{self, SpectralLayout, SpectralLobe, UNIFORM_SHARE, WavelengthWeights};
use crate::table::{WAVELENGTH_MAX_NM, WAVELENGTH_MIN_NM};
use ffi::Question;
use std::f64::consts::TAU;
use std::sync::{Arc, LazyLock, Mutex, PoisonError, Weak};

#[cxx::bridge(namespace = "sunbeam")]
mod ffi {
    /// What of the lobe is asked for. Answers are five numbers: four of value, and the density in 1/sr last.
    enum Question {
        /// `f_r` in 1/sr at each wavelength.
        Value,
        /// The density of sampled directions, the mean over the wavelengths carried.
        Density,
        /// Both.
        ValueAndDensity,
        /// A direction, whose components come first; the zero vector where there is none.
        Direction,
    }

    /// Dr.Jit variables, borrowed, of a question to a traced evaluator. The first three arrays are of `f32`.
    struct Traced {
        /// A `JitBackend`.
        backend: u32,
        wi: [u32; 3],
        /// `wo`, or three random numbers where a direction is asked for.
        other: [u32; 3],
        wavelengths_nm: [u32; 4],
        active: u32,
        /// Arrays of `u32`: the surface's words in the backend's memory.
        words: [u32; 4],
    }

    /// Steps of a difference quotient over which the value changes by little: tangential components of either
    /// direction, along x and y, and their cosines.
    struct Steps {
        across: [f32; 2],
        along: f32,
    }

    extern "Rust" {
        /// A surface with its tables.
        type Surface;

        /// The same number for surfaces that share their tables, and no other in this process.
        fn identity(self: &Surface) -> u64;
        /// The array of words of that number, below four: table, sampler, albedo, and weights of wavelengths. It may
        /// be empty.
        fn words(self: &Surface, which: usize) -> &[u32];
        /// See [`Steps`].
        fn steps(self: &Surface) -> Steps;
        /// Answers by value, for a direction above the surface.
        fn ask_spectral(
            self: &Surface,
            question: Question,
            wi: &[f32; 3],
            other: &[f32; 3],
            wavelengths_nm: &[f32; 4],
        ) -> Result<[f32; 5]>;
        /// Answers by tracing: variables that the caller owns.
        fn trace_spectral(self: &Surface, question: Question, arguments: &Traced) -> Result<[u32; 5]>;

        /// Builds a surface from a JSON object whose keys are the plugin's parameters.
        fn new_surface(config_json: &str) -> Result<Box<Surface>>;

        /// The coherence length in µm.
        fn coherence_length_um(self: &Surface) -> f32;

        /// The same surface with another coherence length.
        fn with_coherence_length(self: &Surface, coherence_length_um: f32) -> Result<Box<Surface>>;

        /// One line that tells the surface, its tables and their error, for `str(bsdf)`.
        fn describe(self: &Surface) -> Result<String>;

        /// As the two above, integrated over wavelength: values are red, green, blue and luminance.
        fn ask_colour(self: &Surface, question: Question, wi: &[f32; 3], other: &[f32; 3]) -> Result<[f32; 5]>;
        fn trace_colour(self: &Surface, question: Question, arguments: &Traced) -> Result<[u32; 5]>;

        /// Refuses to run in a Mitsuba (`running`, empty when unknown) that was not compiled against (`compiled`).
        fn check_version(compiled: &str, running: &str) -> Result<()>;
    }
}

/// Why a call across the boundary failed.
#[derive(Debug, thiserror::Error)]
enum PluginError {
    #[error(transparent)]
    Build(#[from] BuildError),
    #[error(
        "the diffraction plugin was compiled for Mitsuba {compiled}, but is being loaded into {running}; their memory \
         layouts differ, so it would render garbage. Install mitsuba=={compiled}, or rebuild with `make plugin`"
    )]
    Version { compiled: String, running: String },
    #[error(transparent)]
    Trace(#[from] TraceError),
    #[error(transparent)]
    Panic(#[from] Panic),
}

/// What a BSDF instance owns on the Rust side.
struct Surface {
    config: SurfaceConfig,
    tables: Arc<(reflectance::Surface, Origin)>,
    identity: u64,
}

/// Part of the width of an order and of a knot in κ that derivatives are differences over. The tables are smooth on
/// that scale: this is off by 4e-4 of the slope.
const STEP: f64 = 0.05;

impl Surface {
    fn new(config: SurfaceConfig) -> Result<Box<Self>, PluginError> {
        let tables = config.build_shared(&Cache::from_env().map_err(BuildError::from)?)?;
        Ok(Box::new(Self { config, identity: identity(&tables), tables }))
    }

    fn core(&self) -> &reflectance::Surface {
        &self.tables.0
    }

    fn coherence_length_um(&self) -> f32 {
        self.config.coherence_length as f32
    }

    fn with_coherence_length(&self, coherence_length_um: f32) -> Result<Box<Self>, PluginError> {
        guard(|| {
            // The decimal number that was meant, not the binary neighbour of it.
            let coherence_length = coherence_length_um.to_string().parse().unwrap_or(f64::NAN);
            Self::new(SurfaceConfig { coherence_length, ..self.config.clone() })
        })
    }

    fn describe(&self) -> Result<String, PluginError> {
        guard(|| Ok(describe(&self.config, self.core().report(), &self.tables.1)))
    }

    fn identity(&self) -> u64 {
        self.identity
    }

    fn words(&self, which: usize) -> &[u32] {
        self.all_words().get(which).copied().unwrap_or_default()
    }

    fn all_words(&self) -> [&[u32]; 4] {
        let [table, sampler, albedo] = self.core().words();
        [table, sampler, albedo, weights()]
    }

    fn steps(&self) -> ffi::Steps {
        let layout = &self.core().layout().table;
        let shortest_um = WAVELENGTH_MIN_NM * 1e-3;
        let along = (shortest_um * layout.kappa_step / TAU).min(1.0);
        ffi::Steps {
            across: [0, 1].map(|axis| (STEP * shortest_um * layout.sigma[axis] / layout.period_um[axis]) as f32),
            along: (STEP * along) as f32,
        }
    }

    fn ask_spectral(
        &self,
        question: Question,
        wi: &[f32; 3],
        other: &[f32; 3],
        wavelengths_nm: &[f32; 4],
    ) -> Result<[f32; 5], PluginError> {
        guard(|| Ok(self.by_value(question, wi, other, Some(wavelengths_nm))))
    }

    fn ask_colour(&self, question: Question, wi: &[f32; 3], other: &[f32; 3]) -> Result<[f32; 5], PluginError> {
        guard(|| Ok(self.by_value(question, wi, other, None)))
    }

    fn trace_spectral(&self, question: Question, arguments: &ffi::Traced) -> Result<[u32; 5], PluginError> {
        guard(|| self.traced(question, arguments, Some(&arguments.wavelengths_nm)))
    }

    fn trace_colour(&self, question: Question, arguments: &ffi::Traced) -> Result<[u32; 5], PluginError> {
        guard(|| self.traced(question, arguments, None))
    }

    fn by_value(&self, question: Question, wi: &[f32; 3], other: &[f32; 3], nm: Option<&[f32; 4]>) -> [f32; 5] {
        answer::<Plain<f32>>(self.core().layout(), self.all_words(), question, *wi, *other, nm.copied(), true)
    }

    fn traced(
        &self,
        question: Question,
        arguments: &ffi::Traced,
        nm: Option<&[u32; 4]>,
    ) -> Result<[u32; 5], PluginError> {
        let owned = trace(arguments.backend, |scope| {
            let words = arguments.words.map(|index| WordsVar::borrowed(scope, index));
            let real = |index| Var::borrowed(scope, index);
            let (wi, other) = (arguments.wi.map(real), arguments.other.map(real));
            let active = Var::borrowed(scope, arguments.active);
            answer::<Traced>(self.core().layout(), words, question, wi, other, nm.map(|nm| nm.map(real)), active)
                .map(|variable| variable.owned(scope))
        })?;
        Ok(owned.map(Owned::into_index))
    }
}

/// Asks the lobe, by value or traced, at the wavelengths (nm) or integrated over them. Renderers may round a
/// wavelength to just outside the range.
fn answer<N: Numbers>(
    layout: &SpectralLayout,
    [table, sampler, albedo, weights]: [N::Words; 4],
    question: Question,
    wi: [N::Real; 3],
    other: [N::Real; 3],
    wavelengths_nm: Option<[N::Real; 4]>,
    active: N::Mask,
) -> [N::Real; 5] {
    let lit = N::Real::lit;
    let lobe = SpectralLobe::<N> { layout, words: [table, sampler, albedo] };
    let (values, density) = if question == Question::Direction {
        let [x, y, z] = match wavelengths_nm {
            Some(nm) => lobe.sample(wi, in_range(nm), other, active),
            None => IntegratedLobe { lobe, weights }.sample(wi, other, UNIFORM_SHARE, active),
        };
        ([x, y, z, lit(0.0)], lit(0.0))
    } else if let Some(nm) = wavelengths_nm.map(in_range) {
        match question {
            Question::Value => (lobe.eval(wi, other, nm, active), lit(0.0)),
            Question::Density => ([lit(0.0); 4], lobe.pdf(wi, other, nm, active)),
            _ => lobe.eval_pdf(wi, other, nm, active),
        }
    } else {
        let wanted = (question != Question::Density, question != Question::Value);
        IntegratedLobe { lobe, weights }.eval_pdf(wanted, wi, other, active)
    };
    let [a, b, c, d] = values;
    [a, b, c, d, density]
}

fn in_range<R: Real>(wavelengths_nm: [R; 4]) -> [R; 4] {
    wavelengths_nm.map(|nm| nm.clip(R::lit(WAVELENGTH_MIN_NM), R::lit(WAVELENGTH_MAX_NM)))
}

/// The weights of wavelengths as words.
fn weights() -> &'static [u32] {
    static WORDS: LazyLock<Vec<u32>> =
        LazyLock::new(|| WavelengthWeights::per_nm().iter().flatten().map(|weight| weight.to_bits()).collect());
    &WORDS
}

/// A number for tables in use, which an address would not be: another's may come to lie there.
fn identity(tables: &Arc<(reflectance::Surface, Origin)>) -> u64 {
    type InUse = (u64, Vec<(u64, Weak<(reflectance::Surface, Origin)>)>);
    static IN_USE: Mutex<InUse> = Mutex::new((0, Vec::new()));
    let mut guard = IN_USE.lock().unwrap_or_else(PoisonError::into_inner);
    let (last, in_use) = &mut *guard;
    in_use.retain(|(_, weak)| weak.strong_count() > 0);
    if let Some((number, _)) = in_use.iter().find(|(_, weak)| weak.as_ptr() == Arc::as_ptr(tables)) {
        return *number;
    }
    *last += 1;
    in_use.push((*last, Arc::downgrade(tables)));
    *last
}

fn new_surface(config_json: &str) -> Result<Box<Surface>, PluginError> {
    guard(|| Surface::new(SurfaceConfig::from_json(config_json).map_err(BuildError::from)?))
}

fn check_version(compiled: &str, running: &str) -> Result<(), PluginError> {
    guard(|| {
        if compiled == running {
            return Ok(());
        }
        let running =
            if running.is_empty() { "a Mitsuba of unknown version".into() } else { format!("Mitsuba {running}") };
        Err(PluginError::Version { compiled: compiled.into(), running })
    })
}
