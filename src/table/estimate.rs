//! Predicts memory and time of a build, from sizes alone.
//!
//! The work is a transform of the relief at every knot in κ, and a spline through the knots of every kept node. Both
//! numbers follow from the sizes of the relief and of the lattice. Nothing here transforms anything or allocates more
//! than a few kB, so that a build of years is refused at once.
//!
//! - Knots: intervals of κ, `range of κ / Δ` (build.rs). Screen: pixels of the relief. Nodes: points of the lattice.
//! - Time: `BUILDS · ((knots + 5)·(TRANSFORM_NS·Σ n·log₂n + SCREEN_NS·(screen + window)) + KNOT_NS·nodes·knots)`, with
//!   n the points of each transform.
//! - Peak memory: rows of all knots, plus the larger of the transforms in flight and the finished records.

use super::band::Band;
use super::build::{EXTRA_KNOTS, first_spacing, kappa_range, knot_step, knots_below, record_floats};
use super::lattice::{Lattice, LatticeAxis};
use super::lookup::NodeQuantity;
use super::spectrum::{Model, Tiling, lag_grid, plan_lattice};
use super::{CoherenceWindow, FREQUENCY_MAX_PER_UM, TableError};
use std::ops::RangeInclusive;

/// Memory in bytes that a build may take at a build limit of 1. Chosen; crates/cli/tests/limits.rs compares predictions
/// with builds.
pub const LIMIT_BYTES: f64 = 8e9;
/// Seconds on two cores that a build may take at a build limit of 1. Chosen.
pub const LIMIT_SECONDS: f64 = 120.0;
/// Accepted build limits: factors on [`LIMIT_BYTES`] and [`LIMIT_SECONDS`].
pub const BUILD_LIMIT: RangeInclusive<f64> = 1.0..=1e6;

// Times in ns on two cores, fitted to builds of skins, gratings and scans from 32² to 2048² pixels. The sum is right
// within a factor of two.

/// Time of a sine and a cosine at one pixel of a phase screen, in ns.
const SCREEN_NS: f64 = 9.0;
/// Time of a Fourier transform for each point and each `log₂` of its points, in ns.
const TRANSFORM_NS: f64 = 0.55;
/// Time of one knot of one node in ns: gather, spline, and write.
const KNOT_NS: f64 = 5.0;
/// Transforms besides those of the knots: two near κ = 0, and three for the measurement of the error.
const OTHER_TRANSFORMS: f64 = 5.0;
/// Work of all builds until the tolerance is met, relative to the last one. Each has finer knots than the one before.
const BUILDS: f64 = 1.2;
/// Spacing of the knots that meet the tolerance, relative to the first one tried. A typical value of the same builds.
const LAST_SPACING: f64 = 0.7;

/// Time of the albedo of a grating and of any other relief, in seconds on two cores. It has a grid
/// of its own, so it hardly depends on the relief.
const ENERGY_SECONDS: (f64, f64) = (0.5, 1.3);
/// Additional time of the albedo of a deep relief for each pair of knots, in ns on two cores. Its fringes are as fine
/// over incidences as over wavelengths. An upper bound, since fringes finer than the albedo's grid are skipped. It is
/// what refuses reliefs of a hundred micrometres and more.
const ENERGY_KNOT_PAIR_NS: f64 = 1600.0;
/// Time and memory of the sampler, relative to the table that it is made from.
const SAMPLER_FRACTION: f64 = 0.5;

/// Largest number of samples along one axis of a lattice when its kept nodes are counted. Chosen: exact up to
/// 1025 nodes, and near beyond, since the counts vary smoothly.
const AXIS_SAMPLES_MAX: usize = 512;

/// Least range of heights in µm at which a refusal asks whether nm were meant. Chosen: above most measured reliefs.
const DEEP_UM: f64 = 10.0;
/// Tolerances that a refusal may suggest, ascending.
const TOLERANCES: [f64; 5] = [1e-5, 1e-4, 1e-3, 1e-2, 1e-1];
/// Coherence lengths in µm that a refusal may suggest, descending.
const COHERENCE_LENGTHS_UM: [f64; 10] = [3e4, 1e4, 3e3, 1e3, 300.0, 100.0, 65.0, 30.0, 10.0, 3.0];
/// Fewest pixels along the longer side that a refusal suggests. Chosen.
const PIXELS_MIN: usize = 64;

/// Predicted memory and time of a build.
///
/// ```
/// use sunbeam::table::{Estimate, LIMIT_BYTES};
///
/// let twice = Estimate { bytes: 2.0 * LIMIT_BYTES, seconds: 1.0 };
/// assert_eq!(twice.limit(), 2.0);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Estimate {
    /// Peak of memory in bytes, with as many threads as there are.
    pub bytes: f64,
    /// Seconds on two cores.
    pub seconds: f64,
}

impl Estimate {
    /// Least build limit that allows the build, at least 1; infinite where a number is NaN or infinite.
    pub fn limit(&self) -> f64 {
        let needed = (self.bytes / LIMIT_BYTES).max(self.seconds / LIMIT_SECONDS);
        if self.bytes.is_nan() || self.seconds.is_nan() { f64::INFINITY } else { needed.max(1.0) }
    }

    /// Refuses what takes more than `build_limit` times [`LIMIT_BYTES`] or [`LIMIT_SECONDS`], with advice on what would
    /// not.
    ///
    /// # Errors
    /// As [`BuildDemand::check`].
    pub(crate) fn check(&self, build_limit: f64, advice: impl FnOnce() -> String) -> Result<(), TableError> {
        if !BUILD_LIMIT.contains(&build_limit) {
            let (name, accepted) = ("build_limit", "1 to 1e6");
            return Err(TableError::OutOfRange { name, value: build_limit, accepted });
        }
        if self.limit() <= build_limit {
            return Ok(());
        }
        Err(TableError::TooMuch {
            needed_gb: self.bytes / 1e9,
            needed_minutes: self.seconds / 60.0,
            limit_gb: build_limit * LIMIT_BYTES / 1e9,
            limit_minutes: build_limit * LIMIT_SECONDS / 60.0,
            advice: advice(),
        })
    }
}

/// Purpose of a table, which decides what else is built from it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Purpose {
    /// The table alone.
    Table,
    /// A surface: the sampler, and the albedo where energy is to be conserved.
    Surface {
        /// Whether energy is conserved. The albedo of a patch takes a second table, the ensemble's.
        energy: bool,
    },
}

/// Sizes and options that decide the cost of a build.
///
/// ```
/// use sunbeam::table::{BuildDemand, Model, Purpose, Tiling};
///
/// let demand = BuildDemand {
///     size: (256, 256),
///     pixel_um: (0.1, 0.1),
///     range_um: 0.5,
///     model: Model::Ensemble,
///     tiling: Tiling::Periodic,
///     coherence_length_um: 65.0,
///     tolerance: 1e-3,
///     purpose: Purpose::Table,
/// };
/// assert!(demand.check(1.0).is_ok());
/// // A relief of 1 cm has too many fringes in κ for the limit.
/// assert!(BuildDemand { range_um: 1e4, ..demand }.check(1.0).is_err());
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct BuildDemand {
    /// Pixels along x and y.
    pub size: (usize, usize),
    /// Width of a pixel along x and y in µm.
    pub pixel_um: (f64, f64),
    /// Highest minus lowest height in µm.
    pub range_um: f64,
    /// Coherence model.
    pub model: Model,
    /// Whether the tile repeats.
    pub tiling: Tiling,
    /// Coherence length in µm, four standard deviations of the window.
    pub coherence_length_um: f64,
    /// Relative error of the table.
    pub tolerance: f64,
    /// What else is built from the table.
    pub purpose: Purpose,
}

impl BuildDemand {
    /// Predicted memory and time.
    pub fn estimate(&self) -> Estimate {
        let own = self.table();
        let Purpose::Surface { energy } = self.purpose else {
            return Estimate { bytes: own.peak_bytes, seconds: own.seconds };
        };
        let mut peak_bytes = own.peak_bytes;
        let mut seconds = own.seconds * (1.0 + SAMPLER_FRACTION);
        if energy {
            // A patch is scaled by the albedo of the ensemble, whose table is built while its own is kept.
            let scaled_by = match self.model {
                Model::Ensemble => own,
                Model::Patch => {
                    let ensemble = Self { model: Model::Ensemble, ..self.clone() }.table();
                    peak_bytes = peak_bytes.max(own.kept_bytes + ensemble.peak_bytes);
                    seconds += ensemble.seconds * (1.0 + SAMPLER_FRACTION);
                    ensemble
                }
            };
            let is_grating = self.size.0.min(self.size.1) == 1;
            let grid_seconds = if is_grating { ENERGY_SECONDS.0 } else { ENERGY_SECONDS.1 };
            seconds += grid_seconds + 1e-9 * ENERGY_KNOT_PAIR_NS * scaled_by.knots.powi(2);
        }
        Estimate { bytes: peak_bytes.max(own.kept_bytes * (1.0 + SAMPLER_FRACTION)), seconds }
    }

    /// Size in bytes of the single-precision table; the packed one is made from it and smaller.
    pub fn table_bytes(&self) -> f64 {
        self.table().kept_bytes
    }

    /// Refuses what takes more than `build_limit` times [`LIMIT_BYTES`] or [`LIMIT_SECONDS`].
    ///
    /// # Errors
    /// [`TableError::TooMuch`] with what would do; [`TableError::OutOfRange`] for a limit outside of [`BUILD_LIMIT`].
    pub fn check(&self, build_limit: f64) -> Result<(), TableError> {
        let estimate = self.estimate();
        estimate.check(build_limit, || self.advice(estimate, build_limit))
    }

    /// Changes that each bring the build below the limit, as a sentence.
    fn advice(&self, estimate: Estimate, build_limit: f64) -> String {
        let fits = |changed: &Self| changed.estimate().limit() <= build_limit;
        let mut changes = Vec::new();
        let looser = TOLERANCES.into_iter().filter(|tolerance| *tolerance > self.tolerance);
        let looser = looser.map(|tolerance| Self { tolerance, ..self.clone() }).find(fits);
        changes.extend(looser.map(|changed| format!("a tolerance of {}", changed.tolerance)));
        let shorter = COHERENCE_LENGTHS_UM.into_iter().filter(|length_um| *length_um < self.coherence_length_um);
        let shorter = shorter.map(|coherence_length_um| Self { coherence_length_um, ..self.clone() }).find(fits);
        changes.extend(shorter.map(|changed| format!("a coherence length of {} µm", changed.coherence_length_um)));
        // A grating is one row or column, whose pixels cost little.
        if self.size.0.min(self.size.1) > 1 {
            let coarser = std::iter::successors(Some(self.coarser()), |changed| Some(changed.coarser()))
                .take_while(|changed| changed.size.0.max(changed.size.1) >= PIXELS_MIN)
                .find(fits);
            changes.extend(coarser.map(|changed| format!("{} × {} pixels", changed.size.0, changed.size.1)));
        }
        let limit = estimate.limit();
        if limit <= *BUILD_LIMIT.end() {
            changes.push(format!("a build_limit of {}", rounded_up(limit)));
        }
        let mut advice = match changes.pop() {
            None => "nothing but another relief would do".to_owned(),
            Some(last) if changes.is_empty() => format!("{last} would do"),
            Some(last) => format!("{} or {last} would do", changes.join(", ")),
        };
        let in_nm = Self { range_um: self.range_um * 1e-3, ..self.clone() };
        if self.range_um >= DEEP_UM && fits(&in_nm) {
            let (found, meant) = (four_digits(self.range_um), four_digits(in_nm.range_um));
            advice += &format!(". Is the height in µm? It is {found} µm; {meant} µm would do");
        }
        advice
    }

    /// The demand of the same relief in pixels of twice the width.
    fn coarser(&self) -> Self {
        let halved = |count: usize, pixel_um: f64| {
            let half = count.div_ceil(2);
            (half, pixel_um * count as f64 / half as f64)
        };
        let (x, y) = (halved(self.size.0, self.pixel_um.0), halved(self.size.1, self.pixel_um.1));
        Self { size: (x.0, y.0), pixel_um: (x.1, y.1), ..self.clone() }
    }

    /// Predicted cost of one table.
    fn table(&self) -> TableEstimate {
        let frequency_max = FREQUENCY_MAX_PER_UM;
        let s_um = CoherenceWindow::new(self.coherence_length_um).sigma_um();
        let lattice =
            plan_lattice(self.size, self.pixel_um, self.model, self.tiling, s_um, frequency_max, self.tolerance);
        let quantity = self.model.quantity();
        let spacing = LAST_SPACING * first_spacing(&lattice, self.tolerance);
        let step = knot_step(quantity, 0.5 * self.range_um, spacing);
        let knots = (kappa_range() / step).ceil() + 1.0;
        let nodes_kept = Kept::of(&lattice, frequency_max, |last_knot| floats(quantity, last_knot), step);

        let points = |(x, y): (usize, usize)| x as f64 * y as f64;
        let (screen, nodes) = (points(self.size), points((lattice.x.pixels, lattice.y.pixels)));
        let is_native = lattice.x.cutoff.is_infinite() && lattice.y.cutoff.is_infinite();
        // Grid of lags, and pixels of the autocorrelation that are kept of it.
        let full = if self.tiling == Tiling::Aperiodic { lag_grid(self.size.0, self.size.1) } else { self.size };
        let kept = (
            Band::kept(&lattice.x, full.0 as f64 * self.pixel_um.0),
            Band::kept(&lattice.y, full.1 as f64 * self.pixel_um.1),
        );
        // Points of the transform of the relief to the band: rows, then the band's columns.
        let forward = 0.5 * (points((full.0, self.size.1)) + points((kept.0, full.1)));
        let grids = match (self.model, is_native) {
            (_, true) => vec![screen],
            (Model::Ensemble, false) => vec![forward, points(kept), nodes],
            (Model::Patch, false) => vec![nodes],
        };
        // Multiplying a grid by its window costs about as much as a screen.
        let windowed = if is_native { 0.0 } else { nodes };
        let transforms: f64 = grids.iter().map(|points| points * points.max(2.0).log2()).sum();
        let all_knots = knots + EXTRA_KNOTS as f64;
        let components = quantity.components() as f64;
        let seconds = 1e-9
            * BUILDS
            * ((all_knots + OTHER_TRANSFORMS) * (TRANSFORM_NS * transforms + SCREEN_NS * (screen + windowed))
                + nodes_kept.nodes * components * KNOT_NS * all_knots);

        // Each thread works on one knot: its grids, as much for their transposes, and its nodes.
        let threads = rayon::current_num_threads() as f64;
        let largest = grids.iter().copied().fold(0.0, f64::max);
        let working = threads * 16.0 * (2.0 * largest + screen + nodes_kept.nodes) + 24.0 * screen;
        // Rows of all knots; they exist together with the transforms, and then with the records.
        let knot_bytes = 4.0 * components * nodes_kept.nodes * (all_knots + EXTRA_KNOTS as f64);
        let kept_bytes = 4.0 * (nodes_kept.floats + nodes_kept.lattice_nodes);
        TableEstimate { knots, seconds, kept_bytes, peak_bytes: knot_bytes + working.max(kept_bytes) }
    }
}

/// Predicted cost of one table.
#[derive(Clone, Copy)]
struct TableEstimate {
    knots: f64,
    seconds: f64,
    /// Bytes of the table itself.
    kept_bytes: f64,
    /// Bytes while it is built.
    peak_bytes: f64,
}

/// Counts of the nodes that some pair of directions reaches, from samples along each axis ([`axis_samples`]).
struct Kept {
    nodes: f64,
    /// Nodes of the lattice, reached or not.
    lattice_nodes: f64,
    /// Floats of their records.
    floats: f64,
}

/// Floats of a record, as [`record_floats`]. Proportional to its knots beyond any number that is built.
fn floats(quantity: NodeQuantity, last_knot: f64) -> f64 {
    let capped = last_knot.min(1e9);
    record_floats(quantity, capped as usize) as f64 * (last_knot / capped.max(1.0)).max(1.0)
}

impl Kept {
    fn of(lattice: &Lattice, frequency_max: f64, floats: impl Fn(f64) -> f64, kappa_step: f64) -> Self {
        let (x, y) = (axis_samples(&lattice.x), axis_samples(&lattice.y));
        let mut kept =
            Self { nodes: 0.0, lattice_nodes: lattice.x.nodes() as f64 * lattice.y.nodes() as f64, floats: 0.0 };
        for (fy, wy) in &y {
            for (fx, wx) in &x {
                let rest = frequency_max * frequency_max - fx * fx - fy * fy;
                if rest >= 0.0 {
                    kept.nodes += wx * wy;
                    kept.floats += wx * wy * floats(knots_below(rest, kappa_step));
                }
            }
        }
        kept
    }
}

/// Samples of an axis from the middle outwards: the least frequency in cycles/µm of a look-up that reads the node, and
/// the number of nodes that the sample stands for.
fn axis_samples(axis: &LatticeAxis) -> Vec<(f64, f64)> {
    let frequency = |node: f64| (node - 0.5 * axis.taps as f64).max(0.0) / axis.period_um;
    let reach = axis.reach as f64;
    let count = axis.reach.min(AXIS_SAMPLES_MAX);
    let width = reach / count.max(1) as f64;
    let beside = (0..count).map(|i| (frequency((i as f64 + 0.5) * width + 0.5), 2.0 * width));
    std::iter::once((frequency(0.0), 1.0)).chain(beside).collect()
}

/// `value` rounded up to two digits.
fn rounded_up(value: f64) -> f64 {
    let unit = 10f64.powf(value.log10().floor() - 1.0);
    // Whole numbers from ten on, so that no rounding of the quotient shows.
    if unit >= 1.0 { (value / unit).ceil() * unit } else { (value * 10.0).ceil() / 10.0 }
}

/// A positive number with four significant digits, without trailing zeros.
fn four_digits(value: f64) -> String {
    let decimals = (3.0 - value.log10().floor()).clamp(0.0, 15.0) as usize;
    let text = format!("{value:.decimals$}");
    if decimals == 0 { text } else { text.trim_end_matches('0').trim_end_matches('.').to_owned() }
}

/// A number for a message, with one to a few digits, and at least 0.1.
pub(super) struct Rough(pub f64);

impl std::fmt::Display for Rough {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self.0 {
            value if value.is_nan() || value > 1e15 => f.write_str("more than 1e15"),
            value if value >= 1e5 => write!(f, "{value:.0e}"),
            value if value >= 10.0 => write!(f, "{value:.0}"),
            value => write!(f, "{:.1}", value.max(0.1)),
        }
    }
}
