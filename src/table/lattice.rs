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
//! Lattices come in two kinds; [`AxisDemand::plan`] takes one for each axis:
//! - *Native*: `P` is the width T of a tile that repeats, so nodes are its diffraction orders. The kernel is the
//!   order's own shape, the transform of `g`: a Gaussian of `σ = T/(2π·σ_w)` nodes. The data take no window.
//!   Taken where the tile repeats and `3·x_max > 1.5·T`.
//! - *Resampled*: `P = 3·x_max` ([`OVERSAMPLING`]). The data are multiplied by `g(x)·ê(0)/ê(x/P)` before their
//!   transform ([`LatticeAxis::window`]), where `ê` is the transform of a semicircle kernel. Interpolation then
//!   restores `g`, up to the kernel's images, which stay below ε. Taken where the scan does not repeat, and for
//!   windows much narrower than the tile.

use super::band::{BAND_MARGIN, Band};
use super::kernel::{InterpolationKernel, OVERSAMPLING, semicircle};
use crate::numeric::TABULATED_MAX;
use serde::{Deserialize, Serialize};
use std::f64::consts::PI;
use sunbeam_fourier::next_fast_len;

/// Largest number of nodes that a look-up reads along one axis: it tabulates their weights. Every accepted tolerance
/// (at least 1e-6) plans fewer, see [`AxisDemand::plan`].
pub(super) const TAPS_MAX: usize = TABULATED_MAX;

/// One axis of a lattice of spatial frequencies, with nodes at `m / period_um`, `|m| ≤ reach`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct LatticeAxis {
    /// Period P in µm; the spacing of nodes is `1/P` cycles/µm.
    pub period_um: f64,
    /// Samples of the data in one period: pixels of the relief, or coarser ones (band.rs).
    pub pixels: usize,
    /// Interpolation kernel `e`, at distances in nodes.
    pub kernel: InterpolationKernel,
    /// Standard deviation of the kernel in nodes.
    pub sigma: f64,
    /// Nodes that one look-up reads along this axis.
    pub taps: usize,
    /// Largest node number M.
    pub reach: usize,
    /// Standard deviation `σ_w` in µm of the window multiplied into the data before their transform. `None` on a native
    /// axis, whose kernel applies the window.
    pub window_um: Option<f64>,
    /// Largest position in nodes with data: half the pixels (Nyquist). Nodes beyond repeat the spectrum and serve the
    /// interpolation up to the cutoff. Infinite on a native axis, whose orders end at `reach`.
    pub cutoff: f64,
}

/// Both axes of a lattice; the window and the kernel are products of a factor along each.
///
/// ```
/// use sunbeam::{Options, Preset, Surface};
///
/// let options = Options { coherence_length_um: 20.0, conserve_energy: false, ..Options::default() };
/// let surface = Surface::new(&Preset::Blazed.build(None, None)?, &options)?;
/// // A grating of 2.5 µm that repeats: nodes along x are its orders, and one node serves the constant direction y.
/// let lattice = surface.table().lattice();
/// assert!((lattice.x.period_um - 2.5).abs() < 1e-9);
/// assert_eq!((lattice.x.window_um, lattice.y.nodes()), (None, 1));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Lattice {
    /// Along x.
    pub x: LatticeAxis,
    /// Along y.
    pub y: LatticeAxis,
}

/// Fraction of the tolerance left to the splines in κ on a resampled lattice. Chosen: the interpolation in frequency
/// takes the rest, and a taper leaves deep gaps in κ, which the percentile over all κ that a build measures hardly
/// sees.
const SPLINE_FRACTION_RESAMPLED: f64 = 0.1;

impl Lattice {
    /// Fraction of a tolerance that the splines in κ may take. All of it on a native lattice, whose interpolation in
    /// frequency is exact but for tails far below the tolerance.
    pub(super) fn spline_fraction(&self) -> f64 {
        let is_native = |axis: &LatticeAxis| axis.window_um.is_none();
        if is_native(&self.x) && is_native(&self.y) { 1.0 } else { SPLINE_FRACTION_RESAMPLED }
    }
}

/// Divisor of the tolerance to which a grating's orders are followed outwards. Chosen: a grating has its power in few
/// orders, whose tails outshine weak orders in between; its look-ups run along one axis only, so more taps are cheap.
const GRATING_MARGIN: f64 = 400.0;

/// Least resampled period, in tiles, at which the native lattice is taken instead. Chosen: a native lattice reads more
/// nodes in each look-up but stores fewer.
const NATIVE_TILES_MIN: f64 = 1.5;

/// Numerator of `Λ = ln(16/ε)`. Chosen: two axes, each with several images of its kernel, together stay below ε.
const ERROR_MARGIN: f64 = 16.0;

/// Least number of pixels of a resampled axis. Chosen: the tightest coherence windows would take fewer than a look-up
/// reads.
const PIXELS_MIN: f64 = 8.0;
/// Largest number of pixels of a resampled axis. A build of this size is refused beforehand (estimate.rs); the bound
/// keeps the plan's integers in range.
const PIXELS_MAX: f64 = 1e12;

/// Requirements on one axis of a lattice.
pub(super) struct AxisDemand {
    /// Pixels of the relief along the axis.
    pub pixels: usize,
    /// Width of a pixel in µm.
    pub pixel_um: f64,
    /// Standard deviation `σ_w` in µm of the Gaussian on the data, an autocorrelation or a field.
    pub window_um: f64,
    /// Largest lag in µm of data that do not repeat, as [`super::spectrum::plan_lattice`] sets it; `None` where they
    /// repeat.
    pub support_um: Option<f64>,
    /// Relative error ε.
    pub tolerance: f64,
    /// Whether the tile is a grating: one row or one column of pixels.
    pub is_grating: bool,
    /// Largest |f| of a look-up, in cycles/µm.
    pub frequency_max: f64,
    /// Pixels of the autocorrelation's grid (band.rs); `None` for a patch, which has no autocorrelation.
    pub lags: Option<usize>,
}

impl AxisDemand {
    /// The cheaper of the two kinds of lattice that meets this demand; the head of the file has the formulas.
    ///
    /// A native axis reads nodes up to `√(2Λ)` standard deviations of its kernel on either side.
    pub fn plan(&self) -> LatticeAxis {
        let log_error = (ERROR_MARGIN / self.tolerance).ln();
        let tile_um = self.pixels as f64 * self.pixel_um;
        let window_end_um = (2.0 * log_error).sqrt() * self.window_um;
        let period = OVERSAMPLING * self.support_um.map_or(window_end_um, |support| window_end_um.min(support));
        let is_native = self.support_um.is_none() && period > NATIVE_TILES_MIN * tile_um;
        let mut pixel_um = self.pixel_um;
        let (pixels, kernel, taps) = if is_native {
            let margin = if self.is_grating { GRATING_MARGIN.ln() } else { 0.0 };
            let sigma = tile_um / (2.0 * PI * self.window_um);
            let taps = 2.0 * (2.0 * (log_error + margin)).sqrt() * sigma;
            (self.pixels, InterpolationKernel::Gaussian { sigma }, taps.ceil() as usize)
        } else {
            let (kernel, taps) = semicircle(log_error);
            pixel_um = self.lags.map_or(pixel_um, |lags| {
                let edge = self.frequency_max + BAND_MARGIN * taps as f64 / period;
                pixel_um * lags as f64 / Band::pixels(lags, pixel_um, edge) as f64
            });
            (next_fast_len((period / pixel_um).ceil().clamp(PIXELS_MIN, PIXELS_MAX) as usize), kernel, taps)
        };
        let period_um = pixels as f64 * pixel_um;
        // The upper bound never acts: ε ≥ 1e-6, and `period > 1.5·tile` bounds σ on a native axis by √(2Λ)/π nodes.
        let taps = taps.clamp(1, TAPS_MAX);
        let wanted = (self.frequency_max * period_um + 0.5 * taps as f64).ceil() as usize;
        let (reach, cutoff) = if is_native {
            (wanted.min(pixels / 2), f64::INFINITY)
        } else {
            (wanted.min((pixels + taps).div_ceil(2)), 0.5 * pixels as f64)
        };
        let (sigma, taps, window_um) =
            (kernel.sigma(), taps.min(2 * reach + 1), (!is_native).then_some(self.window_um));
        LatticeAxis { period_um, pixels, kernel, sigma, taps, reach, window_um, cutoff }
    }
}

impl LatticeAxis {
    /// Number of nodes, `2·reach + 1`.
    pub fn nodes(&self) -> usize {
        2 * self.reach + 1
    }

    /// Number of the first of the `taps` nodes that a look-up at `position` (in nodes) reads: the nearest existing
    /// ones. A node left out is at least `taps/2` away.
    pub fn first_tap(&self, position: f64) -> i64 {
        let last = self.reach as i64 + 1 - self.taps as i64;
        ((position - 0.5 * self.taps as f64).ceil() as i64).clamp(-(self.reach as i64), last)
    }

    /// Factor `g(x)·ê(0)/ê(x/P)` on the data at the lag `x` = `lag_um` before their transform; 1 on a native axis.
    pub(super) fn window(&self, lag_um: f64) -> f64 {
        self.window_um.map_or(1.0, |window_um| {
            let kernel = self.kernel.transform(lag_um / self.period_um) / self.kernel.transform(0.0);
            (-0.5 * (lag_um / window_um).powi(2)).exp() / kernel
        })
    }
}
