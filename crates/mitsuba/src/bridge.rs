//! What C++ asks of a surface. Every function that C++ calls runs inside [`guard()`]: an error or a panic becomes an
//! `Err`, which cxx throws as a C++ exception and the plugin rethrows as one of Mitsuba's.

use super::describe;
use super::log::logged;
use super::scope::{Owned, Scope, TraceError, trace};
use super::traced::{Traced, Var, WordsVar};
use ffi::Question;
pub use ffi::log_info;
use std::any::Any;
use std::array;
use std::f64::consts::TAU;
use std::sync::{Arc, Mutex, PoisonError, Weak};
use sunbeam::cache::{Cache, Origin};
use sunbeam::config::{BuildError, ObliquityChoice, SurfaceConfig, Theory};
use sunbeam::grating::{GratingColourSurface, GratingLobe, GratingSurface, JonesTable};
use sunbeam::numeric::{Lanes, Numbers, Plain, Real};
use sunbeam::reflectance::{
    self, ColourSurface, ComplexIndex, Gamut, SpectralIndex, SpectralIndexError, SpectralLobe, luminance,
};
use sunbeam::table::{WAVELENGTH_MAX_NM, WAVELENGTH_MIN_NM};
use sunbeam_guard::{Panic, guard};

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

/// What a BSDF instance owns on the Rust side.
struct Surface {
    recipe: Recipe,
    tables: Tables,
    /// How the orders of a rigorous surface polarise, where that is carried.
    jones: Option<Arc<(JonesTable, Origin)>>,
    identity: u64,
}

/// What a surface is made from.
#[derive(Clone)]
struct Recipe {
    config: SurfaceConfig,
    /// The index that it was asked for with; `None` reflects everything.
    index: Option<SpectralIndex>,
    /// Whether colours contain what the interface does to light.
    inside: bool,
    /// Whether Stokes vectors are carried.
    polarised: bool,
}

/// Handles of what C++ asks with.
struct Arguments<'s> {
    words: [WordsVar<'s>; 3],
    /// The second are three random numbers where a direction is asked for.
    directions: [[Var<'s, f32>; 3]; 2],
    nm: [Var<'s, f32>; 4],
    active: Var<'s, bool>,
}

enum Tables {
    Spectral(Arc<(reflectance::Surface, Origin)>),
    Colours(Arc<(ColourSurface, Origin)>),
    Grating(Arc<(GratingSurface, Origin)>),
    GratingColours(Arc<(GratingColourSurface, Origin)>),
}

impl Recipe {
    /// What JSON and samples amount to. Whatever becomes of the index later, the obliquity factor is that of the one given here.
    fn new(config_json: &str, samples: &ffi::IndexSamples, polarised: bool) -> Result<Self, PluginError> {
        let mut config = SurfaceConfig::from_json(config_json).map_err(BuildError::from)?;
        let index = spectral_index(samples)?;
        let small_slope = config.obliquity == ObliquityChoice::SmallSlope;
        if !samples.known && config.theory == Theory::Rigorous {
            return Err(PluginError::UnknownIndex { parameter: "theory", value: "rigorous", other: "scalar" });
        }
        if !samples.known && small_slope {
            return Err(PluginError::UnknownIndex { parameter: "obliquity", value: "small_slope", other: "stam" });
        }
        if config.theory == Theory::Scalar {
            config.obliquity = config.obliquity.resolved(index.as_ref()).into();
        }
        Ok(Self { config, index, inside: samples.known, polarised })
    }
}

/// Part of the width of an order and of a knot that derivatives are differences over. The tables are smooth on that scale:
/// this is off by 4e-4 of the slope.
const STEP: f64 = 0.05;

impl Surface {
    /// For variants that carry wavelengths.
    fn spectral(recipe: Recipe) -> Result<Box<Self>, PluginError> {
        let cache = Cache::from_env().map_err(BuildError::from)?;
        let Recipe { config, index, .. } = &recipe;
        let index = index.as_ref();
        let tables = match config.theory {
            Theory::Scalar => Tables::Spectral(logged(|progress| config.build_shared(index, &cache, progress))?),
            Theory::Rigorous => {
                Tables::Grating(logged(|progress| config.build_shared_grating(index, &cache, progress))?)
            }
        };
        Self::with_tables(recipe, tables, &cache)
    }

    /// For variants that carry colours.
    fn colours(recipe: Recipe) -> Result<Box<Self>, PluginError> {
        let cache = Cache::from_env().map_err(BuildError::from)?;
        let Recipe { config, index, inside, .. } = &recipe;
        let (index, inside) = (index.as_ref(), index.as_ref().filter(|_| *inside));
        let tables = match config.theory {
            Theory::Scalar => {
                Tables::Colours(logged(|progress| config.build_shared_colours(index, inside, &cache, progress))?)
            }
            Theory::Rigorous => {
                Tables::GratingColours(logged(|progress| config.build_shared_grating_colours(index, &cache, progress))?)
            }
        };
        Self::with_tables(recipe, tables, &cache)
    }

    fn with_tables(recipe: Recipe, tables: Tables, cache: &Cache) -> Result<Box<Self>, PluginError> {
        let Recipe { config, index, polarised, .. } = &recipe;
        let jones = if *polarised && config.theory == Theory::Rigorous {
            Some(logged(|progress| config.build_shared_jones(index.as_ref(), cache, progress))?)
        } else {
            None
        };
        let shared: Arc<dyn Any + Send + Sync> = match &tables {
            Tables::Spectral(tables) => tables.clone(),
            Tables::Colours(tables) => tables.clone(),
            Tables::Grating(tables) => tables.clone(),
            Tables::GratingColours(tables) => tables.clone(),
        };
        // The same tables go with the same polarisation, if with any.
        let identity = 2 * identity(shared) + u64::from(jones.is_some());
        Ok(Box::new(Self { recipe, tables, jones, identity }))
    }

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

    fn all_words(&self) -> [&[u32]; 3] {
        match &self.tables {
            Tables::Spectral(tables) => tables.0.words(),
            Tables::Colours(tables) => tables.0.words(),
            Tables::Grating(tables) => [tables.0.words(), &[], self.jones_words()],
            Tables::GratingColours(tables) => {
                let [efficiencies, colours] = tables.0.words();
                [efficiencies, colours, self.jones_words()]
            }
        }
    }

    fn jones_words(&self) -> &[u32] {
        self.jones.as_ref().map_or(&[], |jones| jones.0.words())
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

    /// [`Surface::by_value`] compiled for the instructions of AVX2, in which rounding is no call.
    ///
    /// # Safety
    /// Only on processors that have them.
    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2")]
    unsafe fn by_value_avx2(
        &self,
        question: Question,
        directions: [[f32; 3]; 2],
        wavelengths_nm: [f32; 4],
    ) -> [f32; 5] {
        self.by_value(question, directions, wavelengths_nm)
    }

    #[inline(always)]
    fn by_value(&self, question: Question, directions: [[f32; 3]; 2], wavelengths_nm: [f32; 4]) -> [f32; 5] {
        let words = self.all_words();
        if let (Tables::Spectral(tables), true) = (&self.tables, question != Question::Direction) {
            let lobe = SpectralLobe::<Lanes> { layout: tables.0.layout(), words };
            return side_by_side(&lobe, question, directions, wavelengths_nm);
        }
        // Scalar variants of Mitsuba warn of every sample with a negative channel.
        self.answer::<Plain<f32>>(words, Gamut::Desaturate, question, directions, wavelengths_nm, true)
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

    fn jones(&self) -> Result<&JonesTable, PluginError> {
        self.jones.as_ref().map(|jones| &jones.0).ok_or(PluginError::NoMatrix)
    }

    /// Handles of what C++ asks with.
    fn arguments<'s>(&self, scope: Scope<'s>, arguments: &ffi::Traced) -> Arguments<'s> {
        let real = |index| Var::borrowed(scope, index);
        let directions = [arguments.wi.map(real), arguments.other.map(real)];
        let nm = match &self.tables {
            Tables::Spectral(_) | Tables::Grating(_) => arguments.wavelengths_nm.map(real),
            Tables::Colours(_) | Tables::GratingColours(_) => [directions[0][0]; 4],
        };
        let words = arguments.words.map(|index| WordsVar::borrowed(scope, index));
        Arguments { words, directions, nm, active: Var::borrowed(scope, arguments.active) }
    }

    /// Asks the lobe for matrices, as `ask_matrix` says.
    #[inline(always)]
    fn matrix<N: Numbers>(
        &self,
        jones: &JonesTable,
        words: [N::Words; 3],
        [from, to]: [[N::Real; 3]; 2],
        wavelengths_nm: [N::Real; 4],
        active: N::Mask,
    ) -> [N::Real; 64] {
        let view = jones.view::<N>(words[2]);
        let rows = match &self.tables {
            Tables::Grating(tables) => {
                let lobe = GratingLobe::<N> { layout: tables.0.layout(), words: words[0] };
                lobe.matrix(&view, from, to, wavelengths_nm.map(within_range), active)
            }
            Tables::GratingColours(tables) => {
                let lobe = tables.0.lobe_over::<N>([words[0], words[1]]);
                lobe.matrix(&view, from, to, active).map(|element| [element; 4])
            }
            // These have no such table.
            Tables::Spectral(_) | Tables::Colours(_) => [[N::Real::lit(0.0); 4]; 16],
        };
        array::from_fn(|i| rows[i / 4][i % 4])
    }

    /// Asks the lobe.
    #[inline(always)]
    fn answer<N: Numbers>(
        &self,
        words: [N::Words; 3],
        gamut: Gamut,
        question: Question,
        [wi, other]: [[N::Real; 3]; 2],
        wavelengths_nm: [N::Real; 4],
        active: N::Mask,
    ) -> [N::Real; 5] {
        let zero = N::Real::lit(0.0);
        let (values, density) = match &self.tables {
            Tables::Spectral(tables) => {
                let lobe = SpectralLobe::<N> { layout: tables.0.layout(), words };
                let nm = wavelengths_nm.map(within_range);
                match question {
                    Question::Value => (lobe.eval(wi, other, nm, active), zero),
                    Question::Density => ([zero; 4], lobe.pdf(wi, other, nm, active)),
                    Question::Direction => (direction(lobe.sample(wi, nm, other, active)), zero),
                    _ => lobe.eval_pdf(wi, other, nm, active),
                }
            }
            Tables::Grating(tables) => {
                let lobe = GratingLobe::<N> { layout: tables.0.layout(), words: words[0] };
                let nm = wavelengths_nm.map(within_range);
                match question {
                    Question::Value => (lobe.eval(wi, other, nm, active), zero),
                    Question::Density => ([zero; 4], lobe.pdf(wi, other, nm, active)),
                    Question::Direction => (direction(lobe.sample(wi, nm, other, active)), zero),
                    _ => lobe.eval_pdf(wi, other, nm, active),
                }
            }
            Tables::GratingColours(tables) => {
                let mut lobe = tables.0.lobe_over::<N>([words[0], words[1]]);
                lobe.gamut = gamut;
                let four = |[r, g, b]: [N::Real; 3]| [r, g, b, luminance([r, g, b])];
                match question {
                    Question::Value => (four(lobe.eval(wi, other, active)), zero),
                    Question::Density => ([zero; 4], lobe.pdf(wi, other, active)),
                    Question::Direction => (direction(lobe.sample(wi, other, active)), zero),
                    _ => {
                        let (colour, density) = lobe.eval_pdf(wi, other, active);
                        (four(colour), density)
                    }
                }
            }
            Tables::Colours(tables) => {
                let mut lobe = tables.0.lobe_over::<N>(words);
                lobe.factors.gamut = gamut;
                let four = |[r, g, b]: [N::Real; 3]| [r, g, b, luminance([r, g, b])];
                match question {
                    Question::Value => (four(lobe.eval(wi, other, active)), zero),
                    Question::Density => ([zero; 4], lobe.pdf(wi, other, active)),
                    Question::Direction => (direction(lobe.sample(wi, other, active)), zero),
                    _ => {
                        let (colour, density) = lobe.eval_pdf(wi, other, active);
                        (four(colour), density)
                    }
                }
            }
        };
        let [a, b, c, d] = values;
        [a, b, c, d, density]
    }
}

/// The four wavelengths in the four lanes.
#[inline(always)]
fn side_by_side(
    lobe: &SpectralLobe<Lanes>,
    question: Question,
    directions: [[f32; 3]; 2],
    wavelengths_nm: [f32; 4],
) -> [f32; 5] {
    let [wi, wo] = directions.map(|w| w.map(Lanes::all));
    let nm = [within_range(Lanes::each(wavelengths_nm))];
    let active = Lanes::mask(true);
    let zero = Lanes::all(0.0);
    let ([values], densities) = match question {
        Question::Value => (lobe.eval(wi, wo, nm, active), zero),
        Question::Density => ([zero], lobe.pdf(wi, wo, nm, active)),
        _ => lobe.eval_pdf(wi, wo, nm, active),
    };
    let [a, b, c, d] = values.to_array();
    [a, b, c, d, 0.25 * densities.reduce_add()]
}

/// Renderers may round a wavelength to just outside the range.
fn within_range<R: Real>(nm: R) -> R {
    nm.clip(R::lit(WAVELENGTH_MIN_NM), R::lit(WAVELENGTH_MAX_NM))
}

/// A direction in the place of values.
fn direction<R: Real>([x, y, z]: [R; 3]) -> [R; 4] {
    [x, y, z, R::lit(0.0)]
}

/// A number for tables in use, which an address would not be: another's may come to lie there.
fn identity(tables: Arc<dyn Any + Send + Sync>) -> u64 {
    type InUse = (u64, Vec<(u64, Weak<dyn Any + Send + Sync>)>);
    static IN_USE: Mutex<InUse> = Mutex::new((0, Vec::new()));
    let mut guard = IN_USE.lock().unwrap_or_else(PoisonError::into_inner);
    let (last, in_use) = &mut *guard;
    in_use.retain(|(_, weak)| weak.strong_count() > 0);
    if let Some((number, _)) = in_use.iter().find(|(_, weak)| std::ptr::addr_eq(weak.as_ptr(), Arc::as_ptr(&tables))) {
        return *number;
    }
    *last += 1;
    in_use.push((*last, Arc::downgrade(&tables)));
    *last
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

/// The index of both parts, at the wavelengths of either.
fn spectral_index(samples: &ffi::IndexSamples) -> Result<Option<SpectralIndex>, SpectralIndexError> {
    let part = |nm: &[f64], values: &[f64]| -> Vec<(f64, f64)> {
        let all = if nm.is_empty() { &[WAVELENGTH_MIN_NM] } else { nm };
        all.iter().copied().zip(values.iter().copied()).collect()
    };
    let (eta, k) = (part(&samples.eta_nm, &samples.eta), part(&samples.k_nm, &samples.k));
    if let (&[(_, eta)], &[(_, k)]) = (eta.as_slice(), k.as_slice()) {
        return Ok(Some(SpectralIndex::Constant(ComplexIndex { eta, k })));
    }
    if eta.is_empty() || k.is_empty() {
        return Ok(None);
    }
    let mut wavelengths: Vec<f64> = eta.iter().chain(&k).map(|sample| sample.0).collect();
    wavelengths.sort_by(f64::total_cmp);
    wavelengths.dedup();
    let index = |nm| (nm, ComplexIndex { eta: linear(&eta, nm), k: linear(&k, nm) });
    SpectralIndex::sampled(wavelengths.into_iter().map(index).collect()).map(Some)
}

/// The value at `x`, linear between samples in rising order, of which there is at least one, and constant beyond them.
fn linear(samples: &[(f64, f64)], x: f64) -> f64 {
    let above = samples.partition_point(|sample| sample.0 < x).min(samples.len() - 1);
    let (low, high) = (samples[above.saturating_sub(1)], samples[above]);
    let t = if high.0 > low.0 { ((x - low.0) / (high.0 - low.0)).clamp(0.0, 1.0) } else { 1.0 };
    low.1 + t * (high.1 - low.1)
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
