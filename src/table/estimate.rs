//! Cost of building tables, from sizes alone.
//!
//! A build computes the phase screen of the relief and its Fourier transform at every *knot*: one value of the phase
//! rate κ. Then it computes a spline over κ through the values of every *kept* node, a node of the frequency lattice
//! (mod.rs) that the look-up of some pair of directions reads. A header and the coefficients of the spline are the
//! node's *record* in the table. If the tolerance is not met, the build starts again with finer knots (`build.rs`).
//!
//! An estimate is for all these builds together, with the knots of the last one. The numbers of knots and nodes follow
//! from sizes and options. An estimate transforms nothing and allocates at most 20 kB, so that an endless build is
//! refused at once.
//!
//! - `knots`: number of knots in the range of κ. Knots beyond its upper end are computed as well:
//!   `computed_knots = knots + EXTRA_KNOTS`. Values at knots below κ = 0 are copies of those above, which take memory
//!   but no time.
//! - `kept`: number of kept nodes. `components`: numbers per node value, 1 for a power, 2 for an amplitude.
//! - Time in ns: `(computed_knots + OTHER_KAPPAS)·at_one_kappa + KNOT_NS·kept·components·computed_knots`.
//! - Time at one κ: `at_one_kappa = TRANSFORM_NS·Σ n·log₂n + SCREEN_NS·(screen + windowed)`. Here n is the number of
//!   points of each transform, `screen` that of the phase screen, and `windowed` that of the lattice's pixels if a
//!   window multiplies them.
//! - Peak memory: the values at all knots, and the larger of the transforms in progress and the finished records.

use super::band::Band;
use super::build::ERROR_KAPPAS;
use super::knots::{EXTRA_KNOTS, KAPPA_MAX, first_spacing, kappa_reached, knot_step, nearest_frequency, record_floats};
use super::lattice::{Lattice, LatticeAxis, lag_grid, plan_lattice};
use super::spectral::NodeQuantity;
use super::{CoherenceWindow, Model, TableError, Tiling};
use std::ops::RangeInclusive;

/// Memory limit of a build in bytes, if the parameter `build_limit` is 1: half the memory of a common machine.
pub const LIMIT_BYTES: f64 = 8e9;
/// Time limit of a build in seconds on two cores, if `build_limit` is 1. All presets and scans take far less. Users can
/// raise the limit for larger reliefs; a larger default would let mistaken sizes occupy a machine for longer.
pub const LIMIT_SECONDS: f64 = 120.0;
/// Accepted build limits: factors on [`LIMIT_BYTES`] and [`LIMIT_SECONDS`].
pub const BUILD_LIMIT: RangeInclusive<f64> = 1.0..=1e6;

// The constants of time were measured on two cores for animal skins, gratings and scans of 32² to 2048² pixels.
// Estimates are within a factor of two of the time on an idle machine; `crates/cli/tests/limits.rs` checks a factor of
// five. SCREEN_NS, TRANSFORM_NS and KNOT_NS contain a factor of 1.2 for earlier builds of the same table, which have
// fewer knots (`build.rs`).

/// Nanoseconds per pixel of a phase screen, which takes a sine and a cosine.
const SCREEN_NS: f64 = 10.8;
/// Nanoseconds per point of a transform, for each doubling of its size.
const TRANSFORM_NS: f64 = 0.66;
/// Nanoseconds per knot of a node, to gather its value, filter it and write its coefficient.
const KNOT_NS: f64 = 6.0;
/// Number of κ besides the knots at which node values are computed: two near zero for the headers of records, and
/// `ERROR_KAPPAS` at which the error is measured.
const OTHER_KAPPAS: f64 = 2.0 + ERROR_KAPPAS as f64;
/// Typical knot spacing of the last build over that of the first, by which estimates follow builds that start again.
const LAST_SPACING: f64 = 0.7;

/// Shortest time in seconds for the albedo table of a grating.
const GRATING_ENERGY_SECONDS: f64 = 0.5;
/// Shortest time in seconds for the albedo table of any other relief.
const ENERGY_SECONDS: f64 = 1.3;
/// Nanoseconds for the albedo table per square of the number of knots. The reflectance of a deep relief has fringes
/// over wavelength and over incidence, both about as fine as the knots are dense. The table follows them along both,
/// hence the square. The value is an upper bound, since fringes finer than the table's grid are not followed. Larger
/// values refuse shallower reliefs.
const ENERGY_KNOT_PAIR_NS: f64 = 1600.0;
/// Time and memory of the sampler over those of the table from which it is computed.
const SAMPLER_FRACTION: f64 = 0.5;

/// Largest number of samples of an axis's nodes on one side of node 0 (`axis_samples`). Counts of kept nodes are exact
/// on axes of up to 1025 nodes, which are all samples. On longer axes they are close, since whether a node is kept
/// varies smoothly along the axis. More samples make the estimate slower.
const AXIS_SAMPLES_MAX: usize = 512;

/// Cost of a build.
///
/// ```
/// use sunbeam::table::{Estimate, LIMIT_BYTES};
///
/// let twice = Estimate { bytes: 2.0 * LIMIT_BYTES, seconds: 1.0 };
/// assert_eq!(twice.limit(), 2.0);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Estimate {
    /// Peak memory in bytes, with the current number of threads.
    pub bytes: f64,
    /// Time in seconds on two cores.
    pub seconds: f64,
}

impl Estimate {
    /// Smallest build limit that allows the build, at least 1; infinite if the cost is NaN.
    pub fn limit(&self) -> f64 {
        let needed = (self.bytes / LIMIT_BYTES).max(self.seconds / LIMIT_SECONDS);
        if self.bytes.is_nan() || self.seconds.is_nan() { f64::INFINITY } else { needed.max(1.0) }
    }

    /// Refuses a cost above `build_limit` times [`LIMIT_BYTES`] or [`LIMIT_SECONDS`]. `advice` is the text on changes
    /// that would be allowed.
    ///
    /// # Errors
    /// The errors of [`BuildDemand::check`].
    pub(crate) fn check(&self, build_limit: f64, advice: impl FnOnce() -> String) -> Result<(), TableError> {
        TableError::unless_in("build_limit", build_limit, BUILD_LIMIT, "1 to 1e6")?;
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

/// Use of the table of `S`, which determines what else is built.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Purpose {
    /// The table alone.
    Table,
    /// A surface: also the sampler, and the albedo table where energy is conserved.
    Surface {
        /// Factor on the time to build the albedo table: 1 for a relief of fixed size, more for a range of relative
        /// sizes (`scattering::SizeRange`), 0 where energy is not conserved.
        energy: f64,
    },
}

/// Sizes and options that determine the cost of a build.
///
/// ```
/// use sunbeam::table::{BuildDemand, Model, Purpose, TableError, Tiling};
///
/// let scan = BuildDemand {
///     size: (512, 512),
///     pixel_um: (0.1, 0.1),
///     range_um: 0.8,
///     model: Model::Ensemble,
///     tiling: Tiling::Aperiodic,
///     coherence_length_um: 65.0,
///     magnification: 1.0,
///     tolerance: 1e-3,
///     purpose: Purpose::Table,
/// };
/// assert_eq!(scan.check(1.0), Ok(()));
///
/// // Heights in nm by mistake.
/// let error = BuildDemand { range_um: 800.0, ..scan }.check(1.0);
/// assert!(error.is_err_and(|error| error.to_string().contains("Is the height in µm?")));
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct BuildDemand {
    /// Numbers of pixels along x and y.
    pub size: (usize, usize),
    /// Pixel sizes along x and y in µm.
    pub pixel_um: (f64, f64),
    /// Range of heights, highest minus lowest, in µm.
    pub range_um: f64,
    /// Coherence model.
    pub model: Model,
    /// Continuation of the relief beyond the tile.
    pub tiling: Tiling,
    /// Coherence length in µm: four standard deviations of the window.
    pub coherence_length_um: f64,
    /// Ratio of the lengths above to those that the user gave: the index of a cover or of a transparent body. Advice
    /// states the user's lengths.
    pub magnification: f64,
    /// Largest relative error of the table.
    pub tolerance: f64,
    /// Use of the table.
    pub purpose: Purpose,
}

impl BuildDemand {
    /// Cost of the build with the current number of threads.
    pub fn estimate(&self) -> Estimate {
        let table = self.table();
        let Purpose::Surface { energy } = self.purpose else {
            return Estimate { bytes: table.peak_bytes, seconds: table.seconds };
        };
        let with_sampler_bytes = table.table_bytes * (1.0 + SAMPLER_FRACTION);
        let mut peak_bytes = table.peak_bytes.max(with_sampler_bytes);
        let mut seconds = table.seconds * (1.0 + SAMPLER_FRACTION);
        if energy > 0.0 {
            // A patch is divided by the albedo of its ensemble, which needs a second table, without a sampler. It is
            // built while the table and the sampler of the patch are in memory.
            let albedo_source = match self.model {
                Model::Ensemble => table,
                Model::Patch => {
                    let ensemble = Self { model: Model::Ensemble, ..self.clone() }.table();
                    peak_bytes = peak_bytes.max(with_sampler_bytes + ensemble.peak_bytes);
                    seconds += ensemble.seconds;
                    ensemble
                }
            };
            let is_grating = self.size.0.min(self.size.1) == 1;
            let shortest_seconds = if is_grating { GRATING_ENERGY_SECONDS } else { ENERGY_SECONDS };
            seconds += energy * (shortest_seconds + 1e-9 * ENERGY_KNOT_PAIR_NS * albedo_source.knots.powi(2));
        }
        Estimate { bytes: peak_bytes, seconds }
    }

    /// Size in bytes of the [`super::SpectralTable`] alone.
    pub fn table_bytes(&self) -> f64 {
        self.table().table_bytes
    }

    /// Refuses a build that costs more than `build_limit` times [`LIMIT_BYTES`] or [`LIMIT_SECONDS`].
    ///
    /// # Errors
    /// [`TableError::TooMuch`] with advice on changes that would be allowed; [`TableError::OutOfRange`] for a limit
    /// outside [`BUILD_LIMIT`].
    pub fn check(&self, build_limit: f64) -> Result<(), TableError> {
        let estimate = self.estimate();
        estimate.check(build_limit, || self.advice(estimate, build_limit))
    }

    /// Cost of the table alone.
    fn table(&self) -> TableEstimate {
        let window = CoherenceWindow::new(self.coherence_length_um);
        let lattice = plan_lattice(self.size, self.pixel_um, self.model, self.tiling, window, self.tolerance);
        let quantity = self.model.quantity();
        let spacing = LAST_SPACING * first_spacing(&lattice, self.tolerance);
        // `knot_step` takes half the range of heights.
        let step = knot_step(quantity, 0.5 * self.range_um, spacing);
        let knots = (KAPPA_MAX / step).ceil() + 1.0;
        let kept = KeptCount::of(&lattice, quantity, step);

        let (screen, lattice_pixels) = (points(self.size), points((lattice.x.pixels, lattice.y.pixels)));
        let transforms = self.transforms(&lattice);
        // Σ n·log₂n, with a logarithm of at least 1: the transform of a single point also takes time.
        let transformed: f64 = transforms.iter().map(|n| n * n.max(2.0).log2()).sum();
        // A native lattice, whose nodes are the orders of the tile, needs no window (lattice.rs). Elsewhere the window
        // costs about as much per pixel as a screen.
        let windowed = if lattice.is_native() { 0.0 } else { lattice_pixels };
        let computed_knots = knots + EXTRA_KNOTS as f64;
        let components = quantity.components() as f64;
        let seconds = 1e-9
            * ((computed_knots + OTHER_KAPPAS) * (TRANSFORM_NS * transformed + SCREEN_NS * (screen + windowed))
                + kept.nodes * components * KNOT_NS * computed_knots);

        // Each thread works on one knot. It holds the grid of a transform and its transpose, the screen, and the kept
        // nodes, all complex numbers of 16 bytes. The threads share the relief and copies of the relief, together
        // 24 bytes a pixel.
        let threads = rayon::current_num_threads() as f64;
        let largest = transforms.into_iter().fold(0.0, f64::max);
        let working_bytes = threads * 16.0 * (2.0 * largest + screen + kept.nodes) + 24.0 * screen;
        // Values at all knots in single precision, with the copies below κ = 0. They are in memory first beside the
        // transforms, then beside the records. Transforms have ended before records are written.
        let knot_bytes = 4.0 * components * kept.nodes * (computed_knots + EXTRA_KNOTS as f64);
        // Records, and a 32-bit offset for each node of the lattice.
        let table_bytes = 4.0 * (kept.floats + kept.lattice_nodes);
        TableEstimate { knots, seconds, table_bytes, peak_bytes: knot_bytes + working_bytes.max(table_bytes) }
    }

    /// Number of points of each transform at one κ, in the order in which `spectrum.rs` computes them. A transform that
    /// skips rows or columns counts as a full transform of as many points as have equal work.
    ///
    /// - native lattice: the tile,
    /// - patch: the lattice's pixels,
    /// - ensemble: the screen, the band of its power spectrum back to the autocorrelation, the lattice's pixels.
    fn transforms(&self, lattice: &Lattice) -> Vec<f64> {
        if lattice.is_native() {
            return vec![points(self.size)];
        }
        let lattice_pixels = points((lattice.x.pixels, lattice.y.pixels));
        if self.model == Model::Patch {
            return vec![lattice_pixels];
        }
        // Sizes of the grid of the screen, padded for an aperiodic scan, and of the kept band of its frequencies.
        let screen_grid = if self.tiling == Tiling::Aperiodic { lag_grid(self.size.0, self.size.1) } else { self.size };
        let band = (
            Band::kept_pixels(&lattice.x, screen_grid.0 as f64 * self.pixel_um.0),
            Band::kept_pixels(&lattice.y, screen_grid.1 as f64 * self.pixel_um.1),
        );
        // The forward transform takes the rows of the relief alone, then the columns of the band alone. Rows and
        // columns are half of the work of a transform each, hence the factor 0.5.
        let forward = 0.5 * (points((screen_grid.0, self.size.1)) + points((band.0, screen_grid.1)));
        vec![forward, points(band), lattice_pixels]
    }
}

/// Number of points of a grid with these numbers along x and y.
fn points((x, y): (usize, usize)) -> f64 {
    x as f64 * y as f64
}

/// Cost of one table.
#[derive(Clone, Copy)]
struct TableEstimate {
    /// Number of knots in κ.
    knots: f64,
    /// Time in seconds on two cores.
    seconds: f64,
    /// Size of the table in bytes.
    table_bytes: f64,
    /// Peak memory in bytes while it is built.
    peak_bytes: f64,
}

/// Numbers of nodes and floats of a table, counted from samples of the nodes along each axis.
struct KeptCount {
    /// Nodes that some pair of directions reads.
    nodes: f64,
    /// Nodes of the lattice, kept or not.
    lattice_nodes: f64,
    /// Floats of the kept nodes' records.
    floats: f64,
}

impl KeptCount {
    /// Counts the kept nodes of a lattice, and the floats of their records for knots `kappa_step` rad/µm apart.
    fn of(lattice: &Lattice, quantity: NodeQuantity, kappa_step: f64) -> Self {
        let (x, y) = (axis_samples(&lattice.x), axis_samples(&lattice.y));
        let lattice_nodes = lattice.x.nodes() as f64 * lattice.y.nodes() as f64;
        let mut kept = Self { nodes: 0.0, lattice_nodes, floats: 0.0 };
        for y in &y {
            for x in &x {
                // A record extends to the largest κ of look-ups that read its node. Nodes that no pair of directions
                // reads have no record.
                if let Some(kappa) = kappa_reached([x.frequency_per_um, y.frequency_per_um]) {
                    let (nodes, last_knot) = (x.nodes * y.nodes, (kappa / kappa_step).floor());
                    kept.nodes += nodes;
                    kept.floats += nodes * record_floats(quantity, last_knot);
                }
            }
        }
        kept
    }
}

/// Node of an axis that represents the nodes around it.
struct AxisSample {
    /// Smallest frequency in cycles/µm whose look-up reads the node.
    frequency_per_um: f64,
    /// Number of nodes that the sample represents, both signs included.
    nodes: f64,
}

/// Samples of an axis's nodes, whose numbers are −reach to reach; the first is node 0 alone.
fn axis_samples(axis: &LatticeAxis) -> Vec<AxisSample> {
    let reach = axis.reach as f64;
    let count = axis.reach.min(AXIS_SAMPLES_MAX);
    // Node m occupies the interval m ± ½. Equal intervals [i·width + ½, (i + 1)·width + ½] cover the nodes 1 to reach.
    // The middle of each is a sample. It also stands for the nodes of the opposite numbers, hence the factor 2.
    let width = reach / count.max(1) as f64;
    let sample = |node: f64, nodes: f64| AxisSample { frequency_per_um: nearest_frequency(axis, node), nodes };
    let others = (0..count).map(|i| sample((i as f64 + 0.5) * width + 0.5, 2.0 * width));
    std::iter::once(sample(0.0, 1.0)).chain(others).collect()
}
