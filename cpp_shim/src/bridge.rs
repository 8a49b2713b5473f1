//! The functions that C++ calls on a surface: construction, values, densities, samples and Mueller matrices.
//!
//! - A call *by value* passes plain numbers and serves scalar variants. A *traced* call passes indices of Dr.Jit
//!   variables (lib.rs).
//! - *Spectral* surfaces have values at four wavelengths in nm. Surfaces *in colours*, for RGB and mono variants, have
//!   red, green, blue and luminance in linear sRGB.
//! - The *interface's factor* is the Fresnel reflectance or the small-slope factor (docs/model.md#the-reflectance).
//! - The *coherence length* is the width in µm over which light interferes. *Scale* and *depth* are the sizes of the
//!   pattern and of the heights relative to the given relief, in [1e-3, 1].
//! - `wi`, `wo`, `from` and `to` are unit vectors that point away from the surface, in the relief's frame: z is the
//!   normal, x the relief's x.
//! - Values are `f_r` in 1/sr, without the cosine. They are zero if a direction is below a surface that does not
//!   transmit.
//!
//! Every function that can fail runs inside [`guard()`]. An error or a panic becomes an `Err`, which cxx throws as a
//! C++ exception and the plugin rethrows as Mitsuba's.

mod answer;
mod error;
mod index;
mod steps;
mod surface;

use super::describe;
use super::scope::{Owned, Scope, trace};
use super::traced::Var;
use error::PluginError;
use ffi::Part;
use sunbeam::config::{ObliquityChoice, Theory};
use sunbeam::lobe::Gamut;
use sunbeam_guard::guard;
use surface::{Recipe, Surface, Tables};

#[allow(unreachable_pub, reason = "cxx declares all functions public")]
#[cxx::bridge(namespace = "sunbeam")]
mod ffi {
    /// Part of an evaluation to compute; parts that are not computed are zero.
    enum Part {
        /// `f_r` in 1/sr at each of four wavelengths, or as red, green, blue and luminance.
        Value,
        /// Density of samples in 1/sr, the mean over the ray's wavelengths.
        Density,
        /// Both.
        ValueAndDensity,
    }

    /// Arguments of a traced call: indices of Dr.Jit variables, which the call borrows. Vectors and wavelengths are
    /// variables of `f32`.
    struct TracedQuery {
        /// A `JitBackend`.
        backend: u32,
        wi: [u32; 3],
        /// Wavelengths in nm; not read for surfaces in colours.
        wavelengths_nm: [u32; 4],
        /// Scale and depth. Not read unless the surface has sizes.
        size: [u32; 2],
        /// Mask of the lanes to compute.
        active: u32,
        /// Arrays of `u32`: the table data of [`Surface::words`] in the backend's memory.
        words: [u32; 3],
    }

    /// Steps of difference quotients in direction cosines, small against the distances over which values change.
    struct Steps {
        /// Steps of the components along x and y.
        tangential: [f32; 2],
        /// Step of the component along the normal.
        normal: f32,
    }

    /// Ranges of the relative sizes in textures, each `[smallest, largest]`.
    struct TextureSizes {
        /// False if both `scale` and `depth` are numbers; the ranges are then ignored. If only one is a number, its
        /// range is [1, 1].
        given: bool,
        scale: [f32; 2],
        depth: [f32; 2],
    }

    /// Complex refractive index eta + ik. Each part has either values at rising wavelengths in nm, or one value and no
    /// wavelengths: a constant. An index that is known and has no values stands for a perfect reflector.
    struct IndexSamples {
        /// False if `eta` or `k` is a texture or a colour, which have no wavelengths. The lists are then empty.
        known: bool,
        eta_nm: Vec<f64>,
        eta: Vec<f64>,
        k_nm: Vec<f64>,
        k: Vec<f64>,
    }

    extern "Rust" {
        /// A surface with its tables.
        type Surface;

        /// Builds a spectral surface from a JSON object of the plugin's parameters. `polarised` is set for variants
        /// that carry Stokes vectors.
        fn new_surface(
            config_json: &str,
            index: &IndexSamples,
            sizes: &TextureSizes,
            polarised: bool,
        ) -> Result<Box<Surface>>;
        /// Builds a surface in colours. Its colours include the interface's factor if the index is known and has
        /// values.
        fn new_colour_surface(
            config_json: &str,
            index: &IndexSamples,
            sizes: &TextureSizes,
            polarised: bool,
        ) -> Result<Box<Surface>>;
        /// A copy with other numbers, whose tables are built anew: coherence length in µm, scale, and depth.
        fn with_numbers(self: &Surface, numbers: &[f32; 3]) -> Result<Box<Surface>>;
        /// A copy whose colours leave out the interface's factor. Fails for a rigorous surface.
        fn without_index(self: &Surface) -> Result<Box<Surface>>;

        /// Whether the theory is rigorous: Maxwell's equations give the power of each diffraction order, which includes
        /// the material's reflectance.
        fn is_rigorous(self: &Surface) -> bool;
        /// Whether the interface's factor is the small-slope factor instead of the Fresnel reflectance.
        fn is_small_slope(self: &Surface) -> bool;
        /// Coherence length in µm, scale and depth: the numbers of [`Surface::with_numbers`].
        fn numbers(self: &Surface) -> [f32; 3];
        /// Whether evaluations take relative sizes.
        fn has_sizes(self: &Surface) -> bool;
        /// One line on the surface, its tables and their error, for `str(bsdf)`.
        fn describe(self: &Surface) -> Result<String>;

        /// A number that identifies the tables and the cover within this process; copies that share both share it.
        fn identity(self: &Surface) -> u64;
        /// Table data number `which`, below three, as words: integers, or the bits of single-precision numbers. Scalar
        /// theory: spectrum (or colours), sampler, albedo. Rigorous theory: efficiencies, colours, Jones matrices.
        /// Empty where the surface lacks the table.
        fn words(self: &Surface, which: usize) -> &[u32];
        /// Steps of difference quotients for derivatives by the components of directions.
        fn steps(self: &Surface) -> Steps;

        /// Evaluates by value: the value at four wavelengths or as red, green, blue and luminance, then the density of
        /// samples. Surfaces in colours ignore the wavelengths, and surfaces without sizes ignore `size`, the scale and
        /// depth at the point of the surface.
        fn evaluate(
            self: &Surface,
            part: Part,
            wi: &[f32; 3],
            wo: &[f32; 3],
            wavelengths_nm: &[f32; 4],
            size: &[f32; 2],
        ) -> Result<[f32; 5]>;
        /// Samples by value: the direction `wo` for three random numbers in [0, 1). The zero vector if it falls beyond
        /// the horizon of its side.
        fn sample(
            self: &Surface,
            wi: &[f32; 3],
            u: &[f32; 3],
            wavelengths_nm: &[f32; 4],
            size: &[f32; 2],
        ) -> Result<[f32; 3]>;
        /// Mueller matrices in 1/sr, by value, of light that comes from the direction `from` and leaves towards `to`.
        /// Element (row, column) at wavelength `l` is number `4 (4 row + column) + l`. For surfaces in colours the four
        /// are equal and hold the luminance. The first axis of each frame of reference is the grooves' direction made
        /// orthogonal to the ray. Fails unless the surface is rigorous and was built with `polarised`.
        fn evaluate_matrix(
            self: &Surface,
            from: &[f32; 3],
            to: &[f32; 3],
            wavelengths_nm: &[f32; 4],
        ) -> Result<[f32; 64]>;

        /// Traces [`Surface::evaluate`]. The caller owns the variables returned, here and below.
        fn trace_evaluate(self: &Surface, part: Part, query: &TracedQuery, wo: &[u32; 3]) -> Result<[u32; 5]>;
        /// Traces [`Surface::sample`].
        fn trace_sample(self: &Surface, query: &TracedQuery, u: &[u32; 3]) -> Result<[u32; 3]>;
        /// Traces [`Surface::evaluate_matrix`], with `from` as the query's `wi`.
        fn trace_matrix(self: &Surface, query: &TracedQuery, to: &[u32; 3]) -> Result<[u32; 64]>;

        /// Fails unless the version of the running Mitsuba (`running`, empty if unknown) is the one that the plugin was
        /// compiled against.
        fn check_version(compiled: &str, running: &str) -> Result<()>;
    }
}

// Functions that the module `ffi` declares and documents, except `steps` (steps.rs). They call the generic code of
// answer.rs (`answer`, `direction`, `matrix`).
impl Surface {
    fn is_rigorous(&self) -> bool {
        self.recipe.config.theory == Theory::Rigorous
    }

    fn is_small_slope(&self) -> bool {
        // The recipe has replaced the choice `auto`.
        self.recipe.config.obliquity == ObliquityChoice::SmallSlope
    }

    fn numbers(&self) -> [f32; 3] {
        let config = &self.recipe.config;
        [config.coherence_length, config.scale, config.depth].map(|number| number as f32)
    }

    fn has_sizes(&self) -> bool {
        self.recipe.config.sizes.is_some()
    }

    fn with_numbers(&self, numbers: &[f32; 3]) -> Result<Box<Self>, PluginError> {
        guard(|| {
            let mut recipe = self.recipe.clone();
            let config = &mut recipe.config;
            let targets = [&mut config.coherence_length, &mut config.scale, &mut config.depth];
            for (target, number) in targets.into_iter().zip(numbers) {
                // An unchanged number keeps its double precision. For a changed one, Mitsuba rounded the user's decimal
                // to single precision: the shortest decimal that rounds to the same single recovers it. The text of a
                // number always parses.
                if *target as f32 != *number {
                    *target = number.to_string().parse().unwrap_or(f64::NAN);
                }
            }
            match &self.tables {
                Tables::Spectral(_) | Tables::Grating(_) => Self::spectral(recipe),
                Tables::Colours(_) | Tables::GratingColours(_) => Self::colours(recipe),
            }
        })
    }

    fn without_index(&self) -> Result<Box<Self>, PluginError> {
        let recipe = Recipe { includes_interface: false, ..self.recipe.clone() };
        guard(|| match &self.tables {
            // Spectral tables never include the interface's factor. Scalar theory has no Jones matrices.
            Tables::Spectral(tables) => Ok(Box::new(Self {
                recipe,
                tables: Tables::Spectral(tables.clone()),
                jones: None,
                identity: self.identity,
            })),
            Tables::Colours(_) => Self::colours(recipe),
            Tables::Grating(_) | Tables::GratingColours(_) => {
                Err(PluginError::UnknownIndex { parameter: "theory", value: "rigorous", other: "scalar" })
            }
        })
    }

    fn describe(&self) -> Result<String, PluginError> {
        guard(|| {
            let jones_bytes = size_of_val(self.jones_words());
            // Element 0 of each pair is the surface with its tables, element 1 their origin.
            let tables = match &self.tables {
                Tables::Spectral(tables) => describe::tables(tables.0.report(), &tables.1),
                Tables::Colours(tables) => describe::colours(&tables.0, &tables.1),
                Tables::Grating(tables) => {
                    describe::grating(&tables.0, tables.0.report().bytes + jones_bytes, &tables.1)
                }
                Tables::GratingColours(tables) => {
                    describe::grating(tables.0.grating(), tables.0.bytes() + jones_bytes, &tables.1)
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

    fn evaluate(
        &self,
        part: Part,
        wi: &[f32; 3],
        wo: &[f32; 3],
        wavelengths_nm: &[f32; 4],
        size: &[f32; 2],
    ) -> Result<[f32; 5], PluginError> {
        guard(|| Ok(with_avx2(|| self.answer_by_value(part, self.plain_query(*wi, *wo, *wavelengths_nm, *size)))))
    }

    fn sample(
        &self,
        wi: &[f32; 3],
        u: &[f32; 3],
        wavelengths_nm: &[f32; 4],
        size: &[f32; 2],
    ) -> Result<[f32; 3], PluginError> {
        guard(|| Ok(with_avx2(|| self.direction(self.plain_query(*wi, *u, *wavelengths_nm, *size)))))
    }

    fn evaluate_matrix(
        &self,
        from: &[f32; 3],
        to: &[f32; 3],
        wavelengths_nm: &[f32; 4],
    ) -> Result<[f32; 64], PluginError> {
        guard(|| {
            let jones = self.jones()?;
            // Rigorous surfaces do not read the size.
            Ok(with_avx2(|| self.matrix(jones, self.plain_query(*from, *to, *wavelengths_nm, [1.0; 2]))))
        })
    }

    fn trace_evaluate(&self, part: Part, query: &ffi::TracedQuery, wo: &[u32; 3]) -> Result<[u32; 5], PluginError> {
        // Negative red, green or blue is kept. By value, such colours are desaturated, since scalar variants of Mitsuba
        // warn of them.
        traced(query.backend, |scope| self.answer(part, Gamut::Keep, self.traced_query(scope, query, *wo)))
    }

    fn trace_sample(&self, query: &ffi::TracedQuery, u: &[u32; 3]) -> Result<[u32; 3], PluginError> {
        traced(query.backend, |scope| self.direction(self.traced_query(scope, query, *u)))
    }

    fn trace_matrix(&self, query: &ffi::TracedQuery, to: &[u32; 3]) -> Result<[u32; 64], PluginError> {
        let jones = self.jones()?;
        traced(query.backend, |scope| self.matrix(jones, self.traced_query(scope, query, *to)))
    }
}

/// Traces `body` for a backend (a `JitBackend`) and returns the indices of its variables, which the caller owns.
fn traced<const K: usize>(
    backend: u32,
    body: impl for<'s> FnOnce(Scope<'s>) -> [Var<'s, f32>; K],
) -> Result<[u32; K], PluginError> {
    guard(|| {
        let owned = trace(backend, |scope| body(scope).map(|variable| variable.owned(scope)))?;
        Ok(owned.map(Owned::into_index))
    })
}

/// Runs `body`, compiled for AVX2 if the processor has it. Rounding to whole numbers is then one instruction instead of
/// a function call.
#[inline(always)]
fn with_avx2<R>(body: impl FnOnce() -> R) -> R {
    #[cfg(target_arch = "x86_64")]
    {
        #[target_feature(enable = "avx2")]
        fn compiled<R>(body: impl FnOnce() -> R) -> R {
            body()
        }
        if is_x86_feature_detected!("avx2") {
            // SAFETY: the processor has AVX2.
            return unsafe { compiled(body) };
        }
    }
    body()
}

fn new_surface(
    config_json: &str,
    index: &ffi::IndexSamples,
    sizes: &ffi::TextureSizes,
    polarised: bool,
) -> Result<Box<Surface>, PluginError> {
    guard(|| Surface::spectral(Recipe::new(config_json, index, sizes, polarised)?))
}

fn new_colour_surface(
    config_json: &str,
    index: &ffi::IndexSamples,
    sizes: &ffi::TextureSizes,
    polarised: bool,
) -> Result<Box<Surface>, PluginError> {
    guard(|| Surface::colours(Recipe::new(config_json, index, sizes, polarised)?))
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
