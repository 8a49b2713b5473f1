//! The Rust side of a BSDF instance: parameters, tables, and their construction.
//!
//! Tables are read from the cache (in memory or on disk) or built. Instances with equal parameters share one copy. The
//! parameter `theory` and the kind of variant (spectral, or in colours) choose among the four kinds of [`Tables`].
//! `logged` (log.rs) writes the progress of a build to Mitsuba's log. bridge.rs explains the interface's factor.

use super::super::log::logged;
use super::index::spectral_index;
use super::{PluginError, ffi};
use std::any::Any;
use std::sync::{Arc, Mutex, PoisonError, Weak};
use sunbeam::cache::{Cache, Origin};
use sunbeam::config::{BuildError, ObliquityChoice, SurfaceConfig, Theory};
use sunbeam::grating::{GratingColourSurface, GratingSurface, JonesTable};
use sunbeam::lobe::{self, ColourSurface};
use sunbeam::scattering::{RELATIVE_SIZE, SizeRange, SpectralIndex};

/// Excess over 1 that is accepted for sizes in textures (factors `scale` and `depth`): rounding in single precision,
/// about 100 times its step.
const SIZE_ROUNDING: f32 = 1e-5;

/// The Rust side of a BSDF instance.
pub(crate) struct Surface {
    pub(super) recipe: Recipe,
    pub(super) tables: Tables,
    /// Jones matrices of the diffraction orders; `None` unless the theory is rigorous and the variant polarised.
    pub(super) jones: Option<Arc<(JonesTable, Origin)>>,
    /// Number of the tables, the cover and the presence of Jones matrices within this process ([`number_of`]). Surfaces
    /// with equal numbers share one copy of the tables in Dr.Jit, and the kernels of frozen functions.
    pub(super) identity: u64,
}

/// Parameters that a surface is built from.
#[derive(Clone)]
pub(super) struct Recipe {
    pub(super) config: SurfaceConfig,
    /// Index at construction; `None` for a perfect reflector, and where the index is not known.
    pub(super) index: Option<SpectralIndex>,
    /// Whether colours include the interface's factor of this index: true at first if the index is known. Spectral
    /// tables never include it.
    pub(super) includes_interface: bool,
    /// Whether the variant carries Stokes vectors.
    pub(super) polarised: bool,
}

/// Tables of a surface, each with its origin: built or read from the cache.
pub(super) enum Tables {
    /// Scalar theory, spectral variants.
    Spectral(Arc<(lobe::Surface, Origin)>),
    /// Scalar theory, RGB and mono variants.
    Colours(Arc<(ColourSurface, Origin)>),
    /// Rigorous theory, spectral variants.
    Grating(Arc<(GratingSurface, Origin)>),
    /// Rigorous theory, RGB and mono variants.
    GratingColours(Arc<(GratingColourSurface, Origin)>),
}

impl Recipe {
    /// Parses the JSON parameters and checks them against the index, which is not known if it comes from a texture or a
    /// colour. In scalar theory, `obliquity` = `auto` is replaced by the choice for this index, which stays even if
    /// `eta` and `k` change later. The rigorous theory has no obliquity factor.
    pub(super) fn new(
        config_json: &str,
        samples: &ffi::IndexSamples,
        sizes: &ffi::TextureSizes,
        polarised: bool,
    ) -> Result<Self, PluginError> {
        let mut config = SurfaceConfig::from_json(config_json).map_err(BuildError::from)?;
        let index = spectral_index(samples)?;
        config.sizes = size_range(sizes)?;
        if config.theory == Theory::Rigorous && config.sizes.is_some() {
            return Err(PluginError::RigorousSizes);
        }
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
        Ok(Self { config, index, includes_interface: samples.known, polarised })
    }
}

/// Range of sizes for which tables are built, from the ranges of the textures' values; `None` without textures.
///
/// # Errors
/// A texture with a negative value, one above 1, or none above 0.
fn size_range(sizes: &ffi::TextureSizes) -> Result<Option<SizeRange>, PluginError> {
    if !sizes.given {
        return Ok(None);
    }
    for (parameter, [low, high]) in [("scale", sizes.scale), ("depth", sizes.depth)] {
        // A smallest value of 0 is accepted, because rounding in a bitmap may make small sizes zero.
        if !(low >= 0.0 && high <= 1.0 + SIZE_ROUNDING && high > 0.0) {
            return Err(PluginError::TextureSize { parameter, low, high });
        }
    }
    // Limited to the sizes that tables accept, then widened to powers of √2, so that similar textures share tables.
    let range = |ends: [f32; 2]| ends.map(|end| f64::from(end).clamp(*RELATIVE_SIZE.start(), *RELATIVE_SIZE.end()));
    Ok(Some(SizeRange { scale: range(sizes.scale), depth: range(sizes.depth) }.rounded()))
}

impl Surface {
    /// Builds a surface for spectral variants, or reads its tables.
    pub(super) fn spectral(recipe: Recipe) -> Result<Box<Self>, PluginError> {
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

    /// Builds a surface for RGB and mono variants, or reads its tables.
    pub(super) fn colours(recipe: Recipe) -> Result<Box<Self>, PluginError> {
        let cache = Cache::from_env().map_err(BuildError::from)?;
        let Recipe { config, index, includes_interface, .. } = &recipe;
        let index = index.as_ref();
        let included = index.filter(|_| *includes_interface);
        let tables = match config.theory {
            Theory::Scalar => {
                Tables::Colours(logged(|progress| config.build_shared_colours(index, included, &cache, progress))?)
            }
            Theory::Rigorous => {
                Tables::GratingColours(logged(|progress| config.build_shared_grating_colours(index, &cache, progress))?)
            }
        };
        Self::with_tables(recipe, tables, &cache)
    }

    /// The surface with these tables, and with Jones matrices if the theory is rigorous and the variant polarised.
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
        // The last bit tells whether there are Jones matrices. Surfaces with the same tables have the same matrices, if
        // any.
        let identity = 2 * number_of(shared, config.cover_eta) + u64::from(jones.is_some());
        Ok(Box::new(Self { recipe, tables, jones, identity }))
    }

    /// Table data as the lobes read it. Scalar theory: spectrum (or colours), sampler, albedo. Rigorous theory:
    /// efficiencies, colours, Jones matrices. Empty where the surface lacks the table.
    pub(super) fn all_words(&self) -> [&[u32]; 3] {
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

    /// Data of the Jones matrices; empty without them.
    pub(super) fn jones_words(&self) -> &[u32] {
        self.jones.as_ref().map_or(&[], |jones| jones.0.words())
    }

    /// The Jones matrices, or the error that there are none.
    pub(super) fn jones(&self) -> Result<&JonesTable, PluginError> {
        self.jones.as_ref().map(|jones| &jones.0).ok_or(PluginError::NoMatrix)
    }
}

/// Number of these tables under a cover of index `cover_eta`, from 1 on. No others in this process ever get it. The
/// tables' address would not do, since it may be reused after they are freed. The cover counts because gratings that
/// differ in their covers alone can share tables, while the cover's index is a constant of the traced code.
fn number_of(tables: Arc<dyn Any + Send + Sync>, cover_eta: Option<f64>) -> u64 {
    /// Tables that have a number.
    struct Numbered {
        /// Number given last; 0 before the first.
        last: u64,
        /// Numbers of tables that may still exist, with their covers.
        in_use: Vec<(u64, Option<f64>, Weak<dyn Any + Send + Sync>)>,
    }
    static NUMBERED: Mutex<Numbered> = Mutex::new(Numbered { last: 0, in_use: Vec::new() });
    let mut numbered = NUMBERED.lock().unwrap_or_else(PoisonError::into_inner);
    let Numbered { last, in_use } = &mut *numbered;
    in_use.retain(|(.., weak)| weak.strong_count() > 0);
    let mut known = in_use.iter().filter(|(_, cover, _)| *cover == cover_eta);
    if let Some((number, ..)) = known.find(|(.., weak)| std::ptr::addr_eq(weak.as_ptr(), Arc::as_ptr(&tables))) {
        return *number;
    }
    *last += 1;
    in_use.push((*last, cover_eta, Arc::downgrade(&tables)));
    *last
}
