//! What C++ asks of a surface. Every function that C++ calls runs inside [`guard()`]: an error or a panic becomes an
//! `Err`, which cxx throws as a C++ exception and the plugin rethrows as one of Mitsuba's.

mod answer;
mod index;
mod surface;

use super::describe;
use super::scope::{Owned, TraceError, trace};
use super::traced::Traced;
use answer::Arguments;
use ffi::Question;
pub use ffi::{log_info, log_warn};
use std::f64::consts::TAU;
use sunbeam::config::{BuildError, ObliquityChoice, Theory};
use sunbeam::lobe::Gamut;
use sunbeam::numeric::Plain;
use sunbeam::scattering::SpectralIndexError;
use sunbeam::table::WAVELENGTH_MIN_NM;
use sunbeam_guard::{Panic, guard};
use surface::{Recipe, Surface, Tables};

#[cxx::bridge(namespace = "sunbeam")]
mod ffi {
    /// What of the lobe is asked for. Answers are five numbers: four of value, and the density in 1/sr last.
    enum Question {
        /// `f_r` in 1/sr at each wavelength, or as red, green, blue and luminance.
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
        /// Of surfaces that are not in colours.
        wavelengths_nm: [u32; 4],
        active: u32,
        /// Arrays of `u32`: the surface's words in the backend's memory.
        words: [u32; 3],
    }

    /// Steps of a difference quotient over which the value changes by little: tangential components of either
    /// direction, along x and y, and their cosines.
    struct Steps {
        across: [f32; 2],
        along: f32,
    }

    /// A complex index by wavelength: each part at wavelengths in nm of its own, or one value for all of them. Without values
    /// everything is reflected.
    struct IndexSamples {
        /// False where a texture or a colour gives it, which has no wavelengths.
        known: bool,
        eta_nm: Vec<f64>,
        eta: Vec<f64>,
        k_nm: Vec<f64>,
        k: Vec<f64>,
    }

    extern "Rust" {
        /// A surface with its tables.
        type Surface;

        /// Builds a surface from a JSON object whose keys are the plugin's parameters, for variants that carry wavelengths;
        /// `polarised` where they carry Stokes vectors.
        fn new_surface(config_json: &str, index: &IndexSamples, polarised: bool) -> Result<Box<Surface>>;
        /// The same for variants that carry colours, with what the interface does to light inside if the index is known and has
        /// samples.
        fn new_colour_surface(config_json: &str, index: &IndexSamples, polarised: bool) -> Result<Box<Surface>>;
        /// The same surface with another coherence length.
        fn with_coherence_length(self: &Surface, coherence_length_um: f32) -> Result<Box<Surface>>;
        /// The same surface without what the interface does to light inside.
        fn without_index(self: &Surface) -> Result<Box<Surface>>;

        /// Whether the orders are those of Maxwell's equations, with what the material reflects inside.
        fn is_rigorous(self: &Surface) -> bool;
        /// Whether the interface does to light what the small-slope factor says, in place of the Fresnel reflectance.
        fn is_small_slope(self: &Surface) -> bool;
        /// The coherence length in µm.
        fn coherence_length_um(self: &Surface) -> f32;
        /// One line that tells the surface, its tables and their error, for `str(bsdf)`.
        fn describe(self: &Surface) -> Result<String>;

        /// The same number for surfaces that share their tables, and no other in this process.
        fn identity(self: &Surface) -> u64;
        /// The array of words of that number, below three: table, sampler, albedo; or efficiencies, colours, polarisation. It may
        /// be empty.
        fn words(self: &Surface, which: usize) -> &[u32];
        /// See [`Steps`].
        fn steps(self: &Surface) -> Steps;

        /// Answers by value. The wavelengths do not matter to a surface in colours, whose values are red, green, blue and
        /// luminance.
        fn ask(
            self: &Surface,
            question: Question,
            wi: &[f32; 3],
            other: &[f32; 3],
            wavelengths_nm: &[f32; 4],
        ) -> Result<[f32; 5]>;
        /// Answers by tracing: variables that the caller owns.
        fn trace(self: &Surface, question: Question, arguments: &Traced) -> Result<[u32; 5]>;
        /// `f_r` as Mueller matrices of light from `wi` to `other`, in frames of reference whose first axis is the grooves', made
        /// transverse: an element at four wavelengths, then the next of the row; or of the luminance, four times. Only of rigorous
        /// surfaces that were made polarised.
        fn ask_matrix(self: &Surface, wi: &[f32; 3], other: &[f32; 3], wavelengths_nm: &[f32; 4]) -> Result<[f32; 64]>;
        /// The same by tracing.
        fn trace_matrix(self: &Surface, arguments: &Traced) -> Result<[u32; 64]>;

        /// Refuses to run in a Mitsuba (`running`, empty when unknown) that was not compiled against (`compiled`).
        fn check_version(compiled: &str, running: &str) -> Result<()>;
    }

    // SAFETY: the function takes a line by value and keeps nothing of it.
    unsafe extern "C++" {
        include!("progress.h");

        /// Writes a line to Mitsuba's log at the level Info.
        fn log_info(line: &str) -> Result<()>;
        /// Writes a line to Mitsuba's log at the level Warn.
        fn log_warn(line: &str) -> Result<()>;
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
    #[error("parameters \"eta\" and \"k\": {0}")]
    Index(#[from] SpectralIndexError),
    #[error(
        "parameter {parameter:?} is {value:?}, which needs \"eta\" and \"k\" as numbers or spectra, not as textures or colours, \
         and not changed later; {other:?} does not"
    )]
    UnknownIndex { parameter: &'static str, value: &'static str, other: &'static str },
    #[error("the surface was made without what its orders do to polarised light")]
    NoMatrix,
    #[error(transparent)]
    Trace(#[from] TraceError),
    #[error(transparent)]
    Panic(#[from] Panic),
}

/// Part of the width of an order and of a knot that derivatives are differences over. The tables are smooth on that scale:
/// this is off by 4e-4 of the slope.
const STEP: f64 = 0.05;

impl Surface {
    fn is_rigorous(&self) -> bool {
        self.recipe.config.theory == Theory::Rigorous
    }

    fn is_small_slope(&self) -> bool {
        self.recipe.config.obliquity == ObliquityChoice::SmallSlope
    }

    fn coherence_length_um(&self) -> f32 {
        self.recipe.config.coherence_length as f32
    }

    fn with_coherence_length(&self, coherence_length_um: f32) -> Result<Box<Self>, PluginError> {
        guard(|| {
            // The decimal number that was meant, not the binary neighbour of it.
            let coherence_length = coherence_length_um.to_string().parse().unwrap_or(f64::NAN);
            let mut recipe = self.recipe.clone();
            recipe.config.coherence_length = coherence_length;
            match &self.tables {
                Tables::Spectral(_) | Tables::Grating(_) => Self::spectral(recipe),
                Tables::Colours(_) | Tables::GratingColours(_) => Self::colours(recipe),
            }
        })
    }

    fn without_index(&self) -> Result<Box<Self>, PluginError> {
        let recipe = Recipe { inside: false, ..self.recipe.clone() };
        guard(|| match &self.tables {
            Tables::Spectral(_) => Self::spectral(recipe),
            Tables::Colours(_) => Self::colours(recipe),
            Tables::Grating(_) | Tables::GratingColours(_) => {
                Err(PluginError::UnknownIndex { parameter: "theory", value: "rigorous", other: "scalar" })
            }
        })
    }

    fn describe(&self) -> Result<String, PluginError> {
        guard(|| {
            let tables = match &self.tables {
                Tables::Spectral(tables) => describe::tables(tables.0.report(), &tables.1),
                Tables::Colours(tables) => describe::colours(&tables.0, &tables.1),
                Tables::Grating(tables) => {
                    describe::grating(&tables.0, tables.0.report().bytes + 4 * self.jones_words().len(), &tables.1)
                }
                Tables::GratingColours(tables) => {
                    describe::grating(tables.0.grating(), tables.0.bytes() + 4 * self.jones_words().len(), &tables.1)
                }
            };
            Ok(format!("{}; {tables}", describe::config(&self.recipe.config)))
        })
    }

    fn identity(&self) -> u64 {
        self.identity
    }

    fn words(&self, which: usize) -> &[u32] {
        self.all_words().get(which).copied().unwrap_or_default()
    }

    fn steps(&self) -> ffi::Steps {
        let shortest_um = WAVELENGTH_MIN_NM * 1e-3;
        // The width of an order in direction cosines, and of a knot in a cosine.
        let (across, along) = match &self.tables {
            Tables::Spectral(tables) => {
                let layout = &tables.0.layout().table;
                let across = [0, 1].map(|axis| shortest_um * layout.sigma[axis] / layout.period_um[axis]);
                (across, shortest_um * layout.kappa_step / TAU)
            }
            Tables::Colours(tables) => {
                let table = tables.0.table();
                let knots = table.rings().map(|ring| f64::from(ring.knots_per_w)).fold(1.0, f64::max);
                ([shortest_um * table.report().order_sigma_per_um; 2], 1.0 / knots)
            }
            Tables::Grating(tables) => ([shortest_um * tables.0.layout().sigma_per_um; 2], 1.0),
            Tables::GratingColours(tables) => ([shortest_um * tables.0.grating().layout().sigma_per_um; 2], 1.0),
        };
        ffi::Steps { across: across.map(|width| (STEP * width) as f32), along: (STEP * along.min(1.0)) as f32 }
    }

    fn ask(
        &self,
        question: Question,
        wi: &[f32; 3],
        other: &[f32; 3],
        wavelengths_nm: &[f32; 4],
    ) -> Result<[f32; 5], PluginError> {
        guard(|| {
            #[cfg(target_arch = "x86_64")]
            if is_x86_feature_detected!("avx2") {
                // SAFETY: the processor has what the function is compiled for.
                return Ok(unsafe { self.by_value_avx2(question, [*wi, *other], *wavelengths_nm) });
            }
            Ok(self.by_value(question, [*wi, *other], *wavelengths_nm))
        })
    }

    fn trace(&self, question: Question, arguments: &ffi::Traced) -> Result<[u32; 5], PluginError> {
        guard(|| {
            let owned = trace(arguments.backend, |scope| {
                let Arguments { words, directions, nm, active } = self.arguments(scope, arguments);
                self.answer::<Traced>(words, Gamut::Keep, question, directions, nm, active)
                    .map(|variable| variable.owned(scope))
            })?;
            Ok(owned.map(Owned::into_index))
        })
    }

    fn ask_matrix(&self, wi: &[f32; 3], other: &[f32; 3], wavelengths_nm: &[f32; 4]) -> Result<[f32; 64], PluginError> {
        guard(|| {
            let jones = self.jones()?;
            Ok(self.matrix::<Plain<f32>>(jones, self.all_words(), [*wi, *other], *wavelengths_nm, true))
        })
    }

    fn trace_matrix(&self, arguments: &ffi::Traced) -> Result<[u32; 64], PluginError> {
        guard(|| {
            let jones = self.jones()?;
            let owned = trace(arguments.backend, |scope| {
                let Arguments { words, directions, nm, active } = self.arguments(scope, arguments);
                self.matrix::<Traced>(jones, words, directions, nm, active).map(|variable| variable.owned(scope))
            })?;
            Ok(owned.map(Owned::into_index))
        })
    }
}

fn new_surface(config_json: &str, index: &ffi::IndexSamples, polarised: bool) -> Result<Box<Surface>, PluginError> {
    guard(|| Surface::spectral(Recipe::new(config_json, index, polarised)?))
}

fn new_colour_surface(
    config_json: &str,
    index: &ffi::IndexSamples,
    polarised: bool,
) -> Result<Box<Surface>, PluginError> {
    guard(|| Surface::colours(Recipe::new(config_json, index, polarised)?))
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
