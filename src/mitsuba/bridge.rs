//! What C++ asks of a surface. Every function that C++ calls runs inside [`guard()`]: an error or a panic becomes an
//! `Err`, which cxx throws as a C++ exception and the plugin rethrows as one of Mitsuba's.

use super::describe::describe;
use super::scope::{Owned, TraceError, trace};
use super::traced::{Traced, Var, WordsVar};
use crate::cache::{Cache, Origin};
use crate::config::{BuildError, SurfaceConfig};
use crate::guard::{Panic, guard};
use crate::numeric::{Number, Numbers, Plain, Real};
use crate::reflectance::{
    self, ANYWHERE_SHARE, CellShares, FOLD_COS_MAX, Obliquity, Proposal, Shade, SpectralLayout, SpectralLobe,
    UNIFORM_SHARE, WavelengthWeights,
};
use crate::table::{KernelKind, WAVELENGTH_MAX_NM, WAVELENGTH_MIN_NM};
use ffi::Question;
use std::f64::consts::TAU;
use std::sync::{Arc, Mutex, PoisonError, Weak};

#[cxx::bridge(namespace = "sunbeam")]
mod ffi {
    /// Everything about a surface's tables that is not an array; see `table::SpectralTable`, `table::Leaves`,
    /// `reflectance::Proposal` and `reflectance::AlbedoScale` for the meaning.
    struct Layout {
        period_x_um: f64,
        period_y_um: f64,
        sigma_x: f64,
        sigma_y: f64,
        taps_x: u32,
        taps_y: u32,
        reach_x: u32,
        reach_y: u32,
        cutoff_x: f64,
        cutoff_y: f64,
        /// Complex records whose sum is squared, rather than real ones.
        amplitude: bool,
        norm: f64,
        proposal_norm: f64,
        proposal_sigma_x: f64,
        proposal_sigma_y: f64,
        kappa_max: f64,
        kappa_step: f64,
        kappa_knee: f64,
        /// Nodes of a leaf as a power of two, leaves, leaves of a cell, and most leaves and cells that a look-up meets.
        leaf_shift_x: u32,
        leaf_shift_y: u32,
        leaf_count_x: u32,
        leaf_count_y: u32,
        leaf_in_cell_x: u32,
        leaf_in_cell_y: u32,
        leaf_met_x: u32,
        leaf_met_y: u32,
        cells_met_x: u32,
        cells_met_y: u32,
        /// Farthest that a leaf's Gaussians reach from a node of it, in nodes, and the share of a leaf's weight that takes
        /// its power to be anywhere in it.
        leaf_reach_x: f64,
        leaf_reach_y: f64,
        anywhere_share: f64,
        /// Standard deviation of the widest node in cycles/µm, and the cosine up to which samples are folded.
        fold_sigma: f64,
        fold_cos_max: f64,
        /// Zero where energy is not scaled.
        shade_azimuths: u32,
        shade_cosines: u32,
        /// The grid of incidences, zero where there is one cell, and the most cells at a node of it.
        share_polar: u32,
        share_azimuths: u32,
        share_wavelengths: u32,
        share_cells_max: u32,
        /// Zero where energy is not scaled.
        scale_cosines: u32,
        scale_azimuths: u32,
        scale_wavelengths: u32,
        stam: bool,
        shadowing: bool,
        uniform_share: f64,
        wavelength_min_nm: f64,
        wavelength_max_nm: f64,
    }

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
        words: [u32; 3],
    }

    /// Steps of a difference quotient over which the value changes by little: tangential components of either direction,
    /// along x and y, and their cosines.
    struct Steps {
        across: [f32; 2],
        along: f32,
    }

    extern "Rust" {
        /// A surface with its tables.
        type Surface;

        /// The same number for surfaces that share their tables, and no other in this process.
        fn identity(self: &Surface) -> u64;
        /// Its three arrays of words, of which some may be empty.
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

        fn layout(self: &Surface) -> Result<Layout>;
        fn offsets(self: &Surface) -> &[u32];
        fn records(self: &Surface) -> &[f32];
        /// See `table::Leaves`, `reflectance::Shade` and `reflectance::CellShares`.
        fn leaf_powers(self: &Surface) -> &[f32];
        fn leaf_places(self: &Surface) -> &[f32];
        fn leaf_rows(self: &Surface) -> &[f32];
        fn shade(self: &Surface) -> &[f32];
        fn share_index(self: &Surface) -> &[u32];
        fn share_cumulative(self: &Surface) -> &[u16];
        /// The four corners of each cell of the energy scaling, `[wavelength][azimuth][cosine][4]`.
        fn scale_corners(self: &Surface) -> Result<Vec<f32>>;
        /// Red, green, blue and luminance weights for each whole nm.
        fn wavelength_weights() -> Result<Vec<f32>>;

        /// Integrated over wavelength, as red, green, blue and luminance, with the density.
        fn eval_pdf_integrated(self: &Surface, wi: &[f32; 3], wo: &[f32; 3], values: &mut [f32; 4]) -> Result<f32>;
        /// A direction for a wavelength drawn by its weight. Zero where there is none.
        fn sample_integrated(self: &Surface, wi: &[f32; 3], u: &[f32; 3]) -> Result<[f32; 3]>;

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
    layout: SpectralLayout,
    identity: u64,
}

/// Part of the width of an order and of a knot in κ that derivatives are differences over. The tables are smooth on that scale:
/// this is off by 4e-4 of the slope.
const STEP: f64 = 0.05;

impl Surface {
    fn new(config: SurfaceConfig) -> Result<Box<Self>, PluginError> {
        let tables = config.build_shared(&Cache::from_env().map_err(BuildError::from)?)?;
        let layout = tables.0.spectral_layout();
        Ok(Box::new(Self { config, identity: identity(&tables), tables, layout }))
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

    fn layout(&self) -> Result<ffi::Layout, PluginError> {
        guard(|| {
            let (table, proposal, options) = (self.core().table(), self.core().proposal(), self.core().options());
            let (leaves, shares) = (proposal.leaves(), proposal.shares());
            let [leaf_reach_x, leaf_reach_y] = leaves.reach();
            let shade = if proposal.shade().values().is_empty() { (0, 0) } else { Shade::shape() };
            let grid = if shares.index().is_empty() { (0, 0, 0) } else { CellShares::shape() };
            let (x, y) = (&table.lattice().x, &table.lattice().y);
            let (proposal_sigma_x, proposal_sigma_y) = table.proposal_sigma();
            let scale = self.core().scale().map_or((0, 0, 0), |s| s.shape());
            Ok(ffi::Layout {
                period_x_um: x.period_um,
                period_y_um: y.period_um,
                sigma_x: x.sigma,
                sigma_y: y.sigma,
                taps_x: x.taps as u32,
                taps_y: y.taps as u32,
                reach_x: x.reach as u32,
                reach_y: y.reach as u32,
                cutoff_x: x.cutoff,
                cutoff_y: y.cutoff,
                amplitude: table.kernel() == KernelKind::Amplitude,
                norm: table.norm(),
                proposal_norm: table.proposal_norm(),
                proposal_sigma_x,
                proposal_sigma_y,
                kappa_max: table.kappa_max(),
                kappa_step: table.kappa_step(),
                kappa_knee: table.kappa_knee(),
                leaf_shift_x: leaves.x.len.ilog2(),
                leaf_shift_y: leaves.y.len.ilog2(),
                leaf_count_x: leaves.x.count as u32,
                leaf_count_y: leaves.y.count as u32,
                leaf_in_cell_x: leaves.x.in_cell as u32,
                leaf_in_cell_y: leaves.y.in_cell as u32,
                leaf_met_x: leaves.x.met as u32,
                leaf_met_y: leaves.y.met as u32,
                cells_met_x: leaves.x.cells_met as u32,
                cells_met_y: leaves.y.cells_met as u32,
                leaf_reach_x,
                leaf_reach_y,
                anywhere_share: ANYWHERE_SHARE,
                fold_sigma: Proposal::fold_sigma(table),
                fold_cos_max: FOLD_COS_MAX,
                shade_azimuths: shade.0 as u32,
                shade_cosines: shade.1 as u32,
                share_polar: grid.0 as u32,
                share_azimuths: grid.1 as u32,
                share_wavelengths: grid.2 as u32,
                share_cells_max: shares.cells_max() as u32,
                scale_cosines: scale.0 as u32,
                scale_azimuths: scale.1 as u32,
                scale_wavelengths: scale.2 as u32,
                stam: options.obliquity == Obliquity::Stam,
                shadowing: options.shadowing,
                uniform_share: UNIFORM_SHARE,
                wavelength_min_nm: WAVELENGTH_MIN_NM,
                wavelength_max_nm: WAVELENGTH_MAX_NM,
            })
        })
    }

    fn offsets(&self) -> &[u32] {
        self.core().table().offsets()
    }

    fn records(&self) -> &[f32] {
        self.core().table().records()
    }

    fn leaf_powers(&self) -> &[f32] {
        self.core().proposal().leaves().powers()
    }

    fn leaf_places(&self) -> &[f32] {
        self.core().proposal().leaves().places()
    }

    fn leaf_rows(&self) -> &[f32] {
        self.core().proposal().leaves().rows()
    }

    fn shade(&self) -> &[f32] {
        self.core().proposal().shade().values()
    }

    fn share_index(&self) -> &[u32] {
        self.core().proposal().shares().index()
    }

    fn share_cumulative(&self) -> &[u16] {
        self.core().proposal().shares().cumulative()
    }

    fn scale_corners(&self) -> Result<Vec<f32>, PluginError> {
        guard(|| Ok(self.core().scale().map_or_else(Vec::new, |scale| scale.corners())))
    }

    fn eval_pdf_integrated(&self, wi: &[f32; 3], wo: &[f32; 3], values: &mut [f32; 4]) -> Result<f32, PluginError> {
        guard(|| {
            let answer = self.core().eval_pdf_integrated(wi.map(f64::from), wo.map(f64::from));
            *values = answer.rgb_y.map(|value| value as f32);
            Ok(answer.pdf as f32)
        })
    }

    fn sample_integrated(&self, wi: &[f32; 3], u: &[f32; 3]) -> Result<[f32; 3], PluginError> {
        guard(|| {
            let wo = self.core().sample_integrated(wi.map(f64::from), u.map(f64::from));
            Ok(wo.map_or([0.0; 3], |wo| wo.map(|c| c as f32)))
        })
    }

    fn identity(&self) -> u64 {
        self.identity
    }

    fn words(&self, which: usize) -> &[u32] {
        self.core().words().get(which).copied().unwrap_or_default()
    }

    fn steps(&self) -> ffi::Steps {
        let layout = self.layout.table;
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
        guard(|| {
            let lobe = SpectralLobe::<Plain<f32>> { layout: &self.layout, words: self.core().words() };
            Ok(answer(&lobe, question, *wi, *other, *wavelengths_nm, true))
        })
    }

    fn trace_spectral(&self, question: Question, arguments: &ffi::Traced) -> Result<[u32; 5], PluginError> {
        guard(|| {
            let owned = trace(arguments.backend, |scope| {
                let words = arguments.words.map(|index| WordsVar::borrowed(scope, index));
                let lobe = SpectralLobe::<Traced> { layout: &self.layout, words };
                let real = |index| Var::borrowed(scope, index);
                let (wi, other) = (arguments.wi.map(real), arguments.other.map(real));
                let active = Var::borrowed(scope, arguments.active);
                answer(&lobe, question, wi, other, arguments.wavelengths_nm.map(real), active)
                    .map(|variable| variable.owned(scope))
            })?;
            Ok(owned.map(Owned::into_index))
        })
    }
}

/// Asks the lobe, by value or traced. Renderers may round a wavelength to just outside the range.
fn answer<N: Numbers>(
    lobe: &SpectralLobe<'_, N>,
    question: Question,
    wi: [N::Real; 3],
    other: [N::Real; 3],
    wavelengths_nm: [N::Real; 4],
    active: N::Mask,
) -> [N::Real; 5] {
    let lit = N::Real::lit;
    let nm = wavelengths_nm.map(|nm| nm.clip(lit(WAVELENGTH_MIN_NM), lit(WAVELENGTH_MAX_NM)));
    let (values, density) = match question {
        Question::Value => (lobe.eval(wi, other, nm, active), lit(0.0)),
        Question::Density => ([lit(0.0); 4], lobe.pdf(wi, other, nm, active)),
        Question::Direction => {
            let [x, y, z] = lobe.sample(wi, nm, other, active);
            ([x, y, z, lit(0.0)], lit(0.0))
        }
        _ => lobe.eval_pdf(wi, other, nm, active),
    };
    let [a, b, c, d] = values;
    [a, b, c, d, density]
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

fn wavelength_weights() -> Result<Vec<f32>, PluginError> {
    guard(|| Ok(WavelengthWeights::per_nm().iter().flatten().copied().collect()))
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
