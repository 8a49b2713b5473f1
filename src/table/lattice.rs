//! Lattice of spatial frequencies on which a table stores its nodes, planned axis by axis.
//!
//! Symbols, along one axis:
//!
//! - `f`: spatial frequency in cycles/µm.
//! - `P`: period of the lattice in µm. Node `m` lies at `f = m/P`, with `|m| ≤ reach`.
//! - `p = f·P`: position in nodes. A look-up sums `taps` nodes around `p`, weighted by the kernel `e(p − m)`
//!   (`kernel.rs`).
//! - `x`: lag, a shift in µm. Node values are the Fourier transform of data over lags. In an *ensemble*, the mean over
//!   all positions of the coherence window, the data are the autocorrelation of the phase screen. In a *patch*, one
//!   fixed window, they are the phase screen itself (`coherence.rs`).
//! - `g(x) = exp(−x²/(2σ_w²))`: coherence window on these data, with `σ_w` = `window_um`.
//! - `ε`: relative error of the interpolation. `Λ = ln(16/ε)`: its log error (`log_error`). The 16 is [`TAIL_FACTOR`],
//!   for the errors of both axes and several images.
//! - *Images*: copies of the data at lags beyond the period, which interpolation adds (`kernel.rs`).
//! - `x_max`: largest lag that counts (`lag_max_um`), `min(√(2Λ)·σ_w, support)`: there `g` has fallen to `e^−Λ`, or the
//!   data end.
//!
//! An axis has one of two kinds of lattice (`AxisDemand::plan`):
//!
//! - *Native*: `P` is the width T of a tile that repeats, so nodes are its diffraction orders. The kernel is the
//!   shape of an order, the transform of `g`: a Gaussian of `σ = T/(2π·σ_w)` nodes. The data are not multiplied by `g`.
//!   This lattice is used where the tile repeats and `3·x_max > 1.5·T` ([`OVERSAMPLING`], [`NATIVE_RATIO`]).
//! - *Resampled*: `P = 3·x_max`, rounded up to a number of pixels that is quick to transform. The data are multiplied
//!   by `g(x)·ê(0)/ê(x/P)` before their transform ([`LatticeAxis::window`]), where `ê` is the transform of a
//!   semicircle kernel. Interpolation multiplies them by `ê(x/P)` again, so the result has the window `g`, up to
//!   images, which stay below ε. This lattice is used where the scan does not repeat, and for windows much narrower
//!   than the tile.

use super::band::{BAND_MARGIN, Band};
use super::kernel::{InterpolationKernel, OVERSAMPLING, semicircle};
use super::{CoherenceWindow, FREQUENCY_MAX_PER_UM, Model, Tiling};
use crate::numeric::TABULATED_MAX;
use serde::{Deserialize, Serialize};
use std::f64::consts::{PI, SQRT_2};
use sunbeam_fourier::next_fast_len;

/// Upper bound of the nodes that a look-up reads along one axis. Plans need fewer at every accepted tolerance.
pub(super) const TAPS_MAX: usize = TABULATED_MAX;

/// One axis of the lattice of spatial frequencies: nodes at `m / period_um` cycles/µm, `|m| ≤ reach`.
///
/// ```
/// use sunbeam::{Options, Preset, Surface};
///
/// let field = Preset::Blazed.build(None, None)?;
/// let surface = Surface::new(&field, &Options { conserve_energy: false, ..Options::default() })?;
/// // A grating of 2.5 µm: nodes are its orders. A look-up reads one of them, here order 3 at the position 3.2.
/// let x = &surface.table().lattice().x;
/// assert!(x.is_native());
/// assert_eq!((x.period_um, x.taps, x.first_tap(3.2)), (2.5, 1, 3));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct LatticeAxis {
    /// Period P in µm; its reciprocal is the spacing of nodes.
    pub period_um: f64,
    /// Number of pixels in one period. They are as large as those of the relief, or larger after a band limit
    /// (`band.rs`).
    pub pixels: usize,
    /// Interpolation kernel.
    pub kernel: InterpolationKernel,
    /// Standard deviation of the kernel in nodes.
    pub sigma: f64,
    /// Number of nodes that a look-up reads.
    pub taps: usize,
    /// Largest node number; nodes have the numbers −reach to reach.
    pub reach: usize,
    /// Standard deviation σ_w in µm of the window that multiplies the data before the transform to nodes. `None` on a
    /// native lattice, whose kernel already is the window's transform.
    pub window_um: Option<f64>,
    /// Largest position in nodes that the pixels resolve: half their sampling rate. `S` is defined as zero at larger
    /// positions. Nodes beyond the cutoff are copies of nodes within, for interpolation up to the cutoff. Infinite on a
    /// native lattice, which has no nodes beyond half the sampling rate.
    pub cutoff: f64,
}

impl LatticeAxis {
    /// Number of nodes, `2·reach + 1`.
    pub fn nodes(&self) -> usize {
        2 * self.reach + 1
    }

    /// Standard deviation of the kernel in cycles/µm.
    pub(crate) fn sigma_per_um(&self) -> f64 {
        self.sigma / self.period_um
    }

    /// Whether nodes are the diffraction orders of the tile.
    pub fn is_native(&self) -> bool {
        self.window_um.is_none()
    }

    /// Number of the first of the `taps` nodes that a look-up at `position` (in nodes) reads. They are the nodes of the
    /// table nearest to the position.
    pub fn first_tap(&self, position: f64) -> i64 {
        let largest = self.reach as i64 + 1 - self.taps as i64;
        ((position - 0.5 * self.taps as f64).ceil() as i64).clamp(-(self.reach as i64), largest)
    }

    /// Factor on the data at the lag `lag_um`, `g(x)·ê(0)/ê(x/P)` in the [module](self)'s symbols; 1 on a native
    /// lattice.
    pub(super) fn window(&self, lag_um: f64) -> f64 {
        self.window_um.map_or(1.0, |window_um| {
            let transform = self.kernel.transform(lag_um / self.period_um) / self.kernel.transform(0.0);
            (-0.5 * (lag_um / window_um).powi(2)).exp() / transform
        })
    }
}

/// Lattice of spatial frequencies: the product of two axes.
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

    /// Number of nodes, with or without a record in the table; `usize::MAX` if it is larger.
    pub(super) fn nodes(&self) -> usize {
        self.x.nodes().saturating_mul(self.y.nodes())
    }
}

/// Support of a patch's data, the largest lag from the middle, over the width of an aperiodic scan. The phase screen
/// ends at 0.5 on either side. But it does not decay towards its ends as an autocorrelation does, for which
/// [`OVERSAMPLING`] was chosen. A larger support makes the period longer, which compensates for this.
const PATCH_SUPPORT: f64 = 0.8;

/// Fraction of the tolerance that is left to a table whose power has deep gaps: ranges of frequency between bright
/// lobes here, ranges of κ in `knots.rs`. An error of the power beside a gap would fill the gap. Larger values take
/// fewer taps and knots; smaller ones fill the gaps less.
pub(super) const GAP_FRACTION: f64 = 0.1;

/// Tolerance of the interpolation between nodes, for a table of the relative error `tolerance`.
///
/// It is smaller for the ensemble of an aperiodic scan, whose spectrum has gaps between its lobes. Patches need no
/// smaller one: the ratio of lobe to gap in amplitudes is only the square root of that in powers.
pub(super) fn interpolation_tolerance(model: Model, tiling: Tiling, tolerance: f64) -> f64 {
    let has_gaps = model == Model::Ensemble && tiling == Tiling::Aperiodic;
    if has_gaps { GAP_FRACTION * tolerance } else { tolerance }
}

/// Numbers of pixels along x and y of a grid for the autocorrelation of `nx` by `ny` pixels. It is at least twice as
/// large along each axis, so that a cyclic transform does not add lags of opposite sign.
pub(crate) fn lag_grid(nx: usize, ny: usize) -> (usize, usize) {
    (next_fast_len(2 * nx), next_fast_len(2 * ny))
}

/// Plans the lattice of a [`super::Spectrum`] from sizes alone: numbers of pixels along x and y, pixel sizes in µm,
/// coherence, and the relative error `tolerance` of the table.
pub(super) fn plan_lattice(
    (nx, ny): (usize, usize),
    (dx_um, dy_um): (f64, f64),
    model: Model,
    tiling: Tiling,
    window: CoherenceWindow,
    tolerance: f64,
) -> Lattice {
    // Standard deviation of the window on the data, and support of the data over the width of a scan. The
    // autocorrelation of a Gaussian window is √2 times as wide as the window.
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

/// Tolerance over `e^−Λ`, the relative level at which tails of kernels and images are neglected. Larger values take
/// more taps; smaller ones leave less room for the errors of both axes and both sides of each, which add up.
const TAIL_FACTOR: f64 = 16.0;

/// Further factor between tolerance and neglected tails for a grating. Few orders have all the power of a grating, and
/// their tails are brighter than the gaps between orders. A large factor costs nothing: a look-up reads one or two
/// nodes with or without it.
const GRATING_TAIL_FACTOR: f64 = 400.0;

/// Period of a resampled lattice over the width of the tile, above which the native lattice is used instead. A
/// resampled lattice stores more nodes by this ratio, a native lattice reads more nodes per look-up. So larger values
/// save time of look-ups, smaller ones memory.
const NATIVE_RATIO: f64 = 1.5;

/// Smallest number of pixels of a resampled axis, so that kernels of up to eight taps do not overlap themselves.
const PIXELS_MIN: f64 = 8.0;

/// Largest number of pixels of a resampled axis, so that sums of a plan's numbers stay in range where `usize` has 32
/// bits. The cost estimate refuses far fewer pixels.
const PIXELS_MAX: f64 = (u32::MAX / 2) as f64;

/// Requirements on one axis.
struct AxisDemand {
    /// Number of pixels of the relief.
    pixels: usize,
    /// Size of a pixel in µm.
    pixel_um: f64,
    /// Standard deviation σ_w in µm of the Gaussian that multiplies the data along this axis.
    window_um: f64,
    /// Largest lag of the data in µm for an aperiodic tile; `None` where the tile repeats.
    support_um: Option<f64>,
    /// Relative error of the interpolation.
    tolerance: f64,
    /// Whether the tile is a grating: one row or one column of pixels.
    is_grating: bool,
    /// Number of pixels of the autocorrelation before its band limit ([`Band`]); `None` for a patch.
    lags: Option<usize>,
}

/// Pixels and kernel of an axis, planned for one kind of lattice.
struct AxisPlan {
    /// Number of pixels in one period.
    pixels: usize,
    /// Size of a pixel in µm.
    pixel_um: f64,
    /// Interpolation kernel.
    kernel: InterpolationKernel,
    /// Number of nodes that a look-up reads, before bounds.
    taps: usize,
}

impl AxisDemand {
    /// Plans the axis; see the [module](self).
    fn plan(&self) -> LatticeAxis {
        let log_error = (TAIL_FACTOR / self.tolerance).ln();
        let tile_um = self.pixels as f64 * self.pixel_um;
        // The window falls to e^−Λ at √(2Λ) standard deviations.
        let window_end_um = (2.0 * log_error).sqrt() * self.window_um;
        let lag_max_um = self.support_um.map_or(window_end_um, |support_um| window_end_um.min(support_um));
        let resampled_um = OVERSAMPLING * lag_max_um;
        let is_native = self.support_um.is_none() && resampled_um > NATIVE_RATIO * tile_um;
        let AxisPlan { pixels, pixel_um, kernel, taps } =
            if is_native { self.native(log_error) } else { self.resampled(log_error, resampled_um) };
        let period_um = pixels as f64 * pixel_um;
        // The upper bound never acts at tolerances of at least 1e-6, for which at most 25 taps are planned: native
        // periods are below 2·x_max, so the σ of their Gaussian is at most √(2Λ)/π nodes.
        let taps = taps.clamp(1, TAPS_MAX);
        // Largest node that look-ups up to the largest frequency read. A native lattice has no nodes beyond half the
        // number of its pixels. A resampled lattice has copies of nodes there, on a margin of half the taps.
        let reach_wanted = (FREQUENCY_MAX_PER_UM * period_um + 0.5 * taps as f64).ceil() as usize;
        let (reach, cutoff) = if is_native {
            (reach_wanted.min(pixels / 2), f64::INFINITY)
        } else {
            (reach_wanted.min((pixels + taps).div_ceil(2)), 0.5 * pixels as f64)
        };
        LatticeAxis {
            period_um,
            pixels,
            kernel,
            sigma: kernel.sigma(),
            taps: taps.min(2 * reach + 1),
            reach,
            window_um: (!is_native).then_some(self.window_um),
            cutoff,
        }
    }

    /// Plan of a native lattice: the pixels of the tile, and the shape of an order as the kernel. `log_error` is Λ.
    fn native(&self, log_error: f64) -> AxisPlan {
        let margin = if self.is_grating { GRATING_TAIL_FACTOR.ln() } else { 0.0 };
        let sigma = self.pixels as f64 * self.pixel_um / (2.0 * PI * self.window_um);
        // The kernel falls to e^−(Λ + margin) at √(2(Λ + margin)) standard deviations on either side.
        let taps = 2.0 * (2.0 * (log_error + margin)).sqrt() * sigma;
        let kernel = InterpolationKernel::Gaussian { sigma };
        AxisPlan { pixels: self.pixels, pixel_um: self.pixel_um, kernel, taps: taps.ceil() as usize }
    }

    /// Plan of a resampled lattice with a period of at least `resampled_um`. `log_error` is Λ. Pixels of an ensemble
    /// are those of the band-limited autocorrelation.
    fn resampled(&self, log_error: f64, resampled_um: f64) -> AxisPlan {
        let (kernel, taps) = semicircle(log_error);
        let pixel_um = self.lags.map_or(self.pixel_um, |lags| {
            // End of the band-limited spectrum in cycles/µm.
            let edge_per_um = FREQUENCY_MAX_PER_UM + BAND_MARGIN * taps as f64 / resampled_um;
            self.pixel_um * lags as f64 / Band::planned_pixels(lags, self.pixel_um, edge_per_um) as f64
        });
        let pixels = (resampled_um / pixel_um).ceil().clamp(PIXELS_MIN, PIXELS_MAX) as usize;
        AxisPlan { pixels: next_fast_len(pixels), pixel_um, kernel, taps }
    }
}
