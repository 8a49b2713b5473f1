//! Lattice of spatial frequencies on which a table stores its nodes, planned axis by axis.
//!
//! Symbols, along one axis:
//! - `f`: spatial frequency in cycles/µm. `P`: period of the lattice in µm. Node `m` lies at `f = m/P`, `|m| ≤ M`
//!   (`reach`).
//! - `p = f·P`: position in nodes. A look-up sums `taps` nodes around `p`, weighted by the kernel `e(p − m)`
//!   (kernel.rs).
//! - `x`: lag in µm. Node values are the transform of data over lags: an autocorrelation, or the field itself (a
//!   patch).
//! - `g(x) = exp(−x²/(2σ_w²))`: the coherence window on these data, with `σ_w` = `window_um`.
//! - `ε`: relative error aimed at. `Λ = ln(16/ε)`: the log error; 16 leaves room for both axes and several images.
//! - `x_max`: largest lag that counts, `min(√(2Λ)·σ_w, support)`, where `g` falls to `e^−Λ` or the data end.
//!
//! Lattices come in two kinds; `AxisDemand::plan` takes one for each axis:
//! - *Native*: `P` is the width T of a tile that repeats, so nodes are its diffraction orders. The kernel is the
//!   order's own shape, the transform of `g`: a Gaussian of `σ = T/(2π·σ_w)` nodes. The data take no window.
//!   Taken where the tile repeats and `3·x_max > 1.5·T`.
//! - *Resampled*: `P = 3·x_max` ([`OVERSAMPLING`]). The data are multiplied by `g(x)·ê(0)/ê(x/P)` before their
//!   transform ([`LatticeAxis::window`]), where `ê` is the transform of a semicircle kernel. Interpolation then
//!   restores `g`, up to the kernel's images, which stay below ε. Taken where the scan does not repeat, and for
//!   windows much narrower than the tile.

use super::band::{BAND_MARGIN, Band};
use super::kernel::{InterpolationKernel, OVERSAMPLING, semicircle};
use super::{CoherenceWindow, FREQUENCY_MAX_PER_UM, Model, Tiling};
use crate::numeric::TABULATED_MAX;
use serde::{Deserialize, Serialize};
use std::f64::consts::{PI, SQRT_2};
use sunbeam_fourier::next_fast_len;

/// Upper bound of the nodes that a look-up reads along one axis. Plans stay below it at every accepted tolerance.
pub(super) const TAPS_MAX: usize = TABULATED_MAX;

/// One axis of the lattice of spatial frequencies: nodes at `m / period_um`, `|m| ≤ reach`.
///
/// ```
/// use sunbeam::{Options, Preset, Surface};
///
/// let field = Preset::Blazed.build(None, None)?;
/// let surface = Surface::new(&field, &Options { conserve_energy: false, ..Options::default() })?;
/// // A grating of 2.5 µm: nodes are its orders, and a look-up reads one of them.
/// let x = &surface.table().lattice().x;
/// assert!(x.is_native());
/// assert_eq!((x.period_um, x.taps, x.first_tap(3.2)), (2.5, 1, 3));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct LatticeAxis {
    /// Period P in µm; its reciprocal is the spacing of nodes.
    pub period_um: f64,
    /// Pixels in one period: those of the relief, or coarser ones (`band.rs`).
    pub pixels: usize,
    /// Interpolation kernel.
    pub kernel: InterpolationKernel,
    /// Standard deviation of the kernel in nodes.
    pub sigma: f64,
    /// Number of nodes that a look-up reads.
    pub taps: usize,
    /// Largest node number in the table.
    pub reach: usize,
    /// Standard deviation in µm of the window that multiplies the data before the transform to nodes. `None` on a
    /// native lattice, whose kernel already is the window's transform.
    pub window_um: Option<f64>,
    /// Largest node number that the pixels resolve (half their sampling rate). Nodes beyond it repeat those within and
    /// serve interpolation near the cutoff. Infinite on a native lattice, whose orders end there.
    pub cutoff: f64,
}

impl LatticeAxis {
    /// Number of nodes, `2·reach + 1`.
    pub fn nodes(&self) -> usize {
        2 * self.reach + 1
    }

    /// Whether nodes are the diffraction orders of the tile.
    pub fn is_native(&self) -> bool {
        self.window_um.is_none()
    }

    /// First of the `taps` nodes that a look-up at `position` (in nodes) reads. They are the nearest nodes of the
    /// table.
    pub fn first_tap(&self, position: f64) -> i64 {
        let last = self.reach as i64 + 1 - self.taps as i64;
        ((position - 0.5 * self.taps as f64).ceil() as i64).clamp(-(self.reach as i64), last)
    }

    /// Factor on the data at a lag or offset of `distance_um`: the window over the kernel's normalised transform; 1 on
    /// a native lattice.
    pub(super) fn window(&self, distance_um: f64) -> f64 {
        self.window_um.map_or(1.0, |window_um| {
            let transform = self.kernel.transform(distance_um / self.period_um) / self.kernel.transform(0.0);
            (-0.5 * (distance_um / window_um).powi(2)).exp() / transform
        })
    }
}

/// Both axes of a lattice.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Lattice {
    /// Axis along x.
    pub x: LatticeAxis,
    /// Axis along y.
    pub y: LatticeAxis,
}

impl Lattice {
    /// Whether nodes are the diffraction orders of the tile along both axes.
    pub fn is_native(&self) -> bool {
        self.x.is_native() && self.y.is_native()
    }

    /// Number of nodes, kept or not; saturating.
    pub(super) fn nodes(&self) -> usize {
        self.x.nodes().saturating_mul(self.y.nodes())
    }
}

/// Extent of the patch's data over the width of an aperiodic scan. A field ends at half the width either side, but
/// without the decay of an autocorrelation towards its largest lag; 0.8 instead of 0.5 makes up for it (chosen).
const PATCH_SUPPORT: f64 = 0.8;

/// Factor on the interpolation's tolerance for the ensemble of an aperiodic scan. Its spectrum has gaps between its
/// lobes, where errors of the lobes count fully. Amplitudes of a patch need none: their ratio of lobe to gap is a
/// square root. Chosen; it adds one node per axis to a look-up.
const GAP_FACTOR: f64 = 0.125;

/// Tolerance that interpolation between nodes is planned for.
pub(super) fn interpolation_tolerance(model: Model, tiling: Tiling, tolerance: f64) -> f64 {
    let has_gaps = model == Model::Ensemble && tiling == Tiling::Aperiodic;
    if has_gaps { GAP_FACTOR * tolerance } else { tolerance }
}

/// Grid in pixels on which the autocorrelation of `nx` by `ny` pixels does not wrap onto itself.
pub(crate) fn lag_grid(nx: usize, ny: usize) -> (usize, usize) {
    (next_fast_len(2 * nx), next_fast_len(2 * ny))
}

/// Plans the lattice of a [`super::Spectrum`] from sizes alone: pixels along x and y, their size in µm, the coherence,
/// and the relative error `tolerance` of the table.
pub(super) fn plan_lattice(
    (nx, ny): (usize, usize),
    (dx_um, dy_um): (f64, f64),
    model: Model,
    tiling: Tiling,
    window: CoherenceWindow,
    tolerance: f64,
) -> Lattice {
    let (window_um, support) = match model {
        Model::Ensemble => (SQRT_2 * window.sigma_um(), 1.0),
        Model::Patch => (window.sigma_um(), PATCH_SUPPORT),
    };
    let is_grating = nx == 1 || ny == 1;
    let tolerance = interpolation_tolerance(model, tiling, tolerance);
    let (lags_x, lags_y) = if tiling == Tiling::Aperiodic { lag_grid(nx, ny) } else { (nx, ny) };
    let axis = |pixels: usize, pixel_um: f64, lags: usize| {
        let support_um = (tiling == Tiling::Aperiodic).then_some(support * (pixels as f64 * pixel_um));
        let lags = (model == Model::Ensemble).then_some(lags);
        AxisDemand { pixels, pixel_um, window_um, support_um, tolerance, is_grating, lags }.plan()
    };
    Lattice { x: axis(nx, dx_um, lags_x), y: axis(ny, dy_um, lags_y) }
}

/// Factor between the tolerance and the level `e^−Λ` at which tails and images are neglected: errors of both axes and
/// both sides add up (chosen).
const TAIL_FACTOR: f64 = 16.0;

/// Extra factor between tolerance and tails for a grating. Few orders hold its power, and their tails outshine the gaps
/// between orders. Chosen; a look-up reads one or two nodes either way.
const GRATING_TAIL_FACTOR: f64 = 400.0;

/// Periods P in tiles from which the native lattice is taken. A resampled one would read fewer nodes per look-up, but
/// hold P/tile times as many. Chosen between the two costs.
const NATIVE_PERIODS: f64 = 1.5;

/// Fewest pixels of a resampled axis, so that its kernel does not overlap itself.
const PIXELS_MIN: f64 = 8.0;

/// Most pixels of a resampled axis. The cost estimate refuses far fewer; the bound keeps the plan's numbers in range.
const PIXELS_MAX: f64 = 1e12;

/// Requirements on one axis.
struct AxisDemand {
    pixels: usize,
    pixel_um: f64,
    /// Standard deviation in µm of the Gaussian that multiplies the data along this axis.
    window_um: f64,
    /// Largest lag in µm of an aperiodic tile; `None` where the tile repeats.
    support_um: Option<f64>,
    /// Relative error of interpolation.
    tolerance: f64,
    /// Whether the tile is a grating: one row or one column of pixels.
    is_grating: bool,
    /// Pixels of the grid of lags, where data are an autocorrelation; see [`Band`].
    lags: Option<usize>,
}

impl AxisDemand {
    /// The lattice whose look-up is cheapest; see the [module](self).
    fn plan(&self) -> LatticeAxis {
        let log_error = (TAIL_FACTOR / self.tolerance).ln();
        let tile_um = self.pixels as f64 * self.pixel_um;
        // The window falls to e^−Λ at √(2Λ) standard deviations.
        let lag_um = (2.0 * log_error).sqrt() * self.window_um;
        let period = OVERSAMPLING * self.support_um.map_or(lag_um, |support| lag_um.min(support));
        let native = self.support_um.is_none() && period > NATIVE_PERIODS * tile_um;
        let mut pixel_um = self.pixel_um;
        let (pixels, kernel, taps) = if native {
            let margin = if self.is_grating { GRATING_TAIL_FACTOR.ln() } else { 0.0 };
            let sigma = tile_um / (2.0 * PI * self.window_um);
            let taps = 2.0 * (2.0 * (log_error + margin)).sqrt() * sigma;
            (self.pixels, InterpolationKernel::Gaussian { sigma }, taps.ceil() as usize)
        } else {
            let (kernel, taps) = semicircle(log_error);
            pixel_um = self.lags.map_or(pixel_um, |lags| {
                let edge = FREQUENCY_MAX_PER_UM + BAND_MARGIN * taps as f64 / period;
                pixel_um * lags as f64 / Band::pixels(lags, pixel_um, edge) as f64
            });
            (next_fast_len((period / pixel_um).ceil().clamp(PIXELS_MIN, PIXELS_MAX) as usize), kernel, taps)
        };
        let period_um = pixels as f64 * pixel_um;
        // The clamp never acts from above: a native Gaussian is at most √(2Λ)/π nodes wide, and tolerances are at least
        // 1e-6.
        let taps = taps.clamp(1, TAPS_MAX);
        let wanted = (FREQUENCY_MAX_PER_UM * period_um + 0.5 * taps as f64).ceil() as usize;
        let (reach, cutoff) = if native {
            (wanted.min(pixels / 2), f64::INFINITY)
        } else {
            (wanted.min((pixels + taps).div_ceil(2)), 0.5 * pixels as f64)
        };
        let (sigma, taps, window_um) = (kernel.sigma(), taps.min(2 * reach + 1), (!native).then_some(self.window_um));
        LatticeAxis { period_um, pixels, kernel, sigma, taps, reach, window_um, cutoff }
    }
}
