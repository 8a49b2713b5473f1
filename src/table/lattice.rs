//! Choice of the frequency lattice, axis by axis (the Gaussian window separates).

use super::band::{BAND_MARGIN, Band};
use super::joining::{Joining, OVERSAMPLING, semicircle};
use serde::{Deserialize, Serialize};
use std::f64::consts::PI;
use sunbeam_fourier::next_fast_len;

/// Most nodes that a look-up reads along one axis; [`Lattice`]s are planned to stay below at every tolerance.
pub(super) const TAPS_MAX: usize = 40;
/// One axis of the lattice of spatial frequencies, with nodes at `m / period_um`, `|m| ≤ reach`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct LatticeAxis {
    /// Period whose reciprocal is the spacing of nodes, in µm.
    pub period_um: f64,
    /// Pixels in one period, those of the relief or coarser ones (see [`Band`]).
    pub pixels: usize,
    /// How nodes are joined, `e_j`.
    pub joining: Joining,
    /// Standard deviation of that, in nodes.
    pub sigma: f64,
    /// Nodes read by one look-up.
    pub taps: usize,
    /// Largest node number kept.
    pub reach: usize,
    /// Standard deviation in µm of the window that is applied beforehand; `None` on the native lattice of the orders, which the
    /// joining Gaussian itself applies.
    pub window_um: Option<f64>,
    /// Node number beyond which the pixels say nothing, half their rate; nodes further out repeat those within and only
    /// help to join them. Infinite on the native lattice, whose orders end there by themselves.
    pub cutoff: f64,
}

/// Both axes of a lattice.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Lattice {
    /// Along x.
    pub x: LatticeAxis,
    /// Along y.
    pub y: LatticeAxis,
}

impl Lattice {
    /// The share of a tolerance that splines in κ may take: all on the native lattice, where joining the nodes is exact
    /// but for tails far below the tolerance; else a tenth, since that error comes on top, and since a taper leaves deep gaps
    /// in κ, in which a percentile over all κ is no comfort.
    pub(super) fn spline_share(&self) -> f64 {
        let native = |axis: &LatticeAxis| axis.window_um.is_none();
        if native(&self.x) && native(&self.y) { 1.0 } else { 0.1 }
    }
}

/// How much further down the tails of orders are followed where the tile is a grating and look-ups are few.
const GRATING_MARGIN: f64 = 400.0;

/// Tiles in a period from which on the orders' own lattice is taken: other lattices have fewer nodes under a look-up, but more in all.
const NATIVE_PERIODS: f64 = 1.5;

/// Most pixels that an axis is planned with. So many are refused before anything is built; the bound keeps the numbers of
/// the plan within range.
const PIXELS_MAX: f64 = 1e12;

/// What an axis has to serve.
pub(super) struct AxisDemand {
    pub pixels: usize,
    pub pixel_um: f64,
    /// Standard deviation in µm of the Gaussian that multiplies the field or its autocorrelation along this axis.
    pub window_um: f64,
    /// Largest lag in µm that there is, for data that do not repeat; see [`super::spectrum::plan_lattice`].
    pub support_um: Option<f64>,
    /// Relative error aimed at.
    pub tolerance: f64,
    /// Whether the tile is a grating: one row or one column of pixels.
    pub is_grating: bool,
    /// Largest |f| asked for, in cycles/µm.
    pub frequency_max: f64,
    /// Pixels of the grid of lags, where nodes are made of an autocorrelation; see [`Band`].
    pub lags: Option<usize>,
}

impl AxisDemand {
    /// The cheapest lattice for this demand.
    ///
    /// On the native lattice (period = tile) the joining Gaussian is the transform of the window itself, followed to `√(2Λ)`
    /// standard deviations, `Λ = ln(16/tolerance)`. Else the period P is chosen: [`OVERSAMPLING`] times the largest lag that
    /// counts, which is where the data end or where the window has fallen to `e^−Λ`, whichever is nearer.
    pub fn plan(&self) -> LatticeAxis {
        let log_error = (16.0 / self.tolerance).ln();
        let tile_um = self.pixels as f64 * self.pixel_um;
        let lag_um = (2.0 * log_error).sqrt() * self.window_um;
        let period = OVERSAMPLING * self.support_um.map_or(lag_um, |support| lag_um.min(support));
        let native = self.support_um.is_none() && period > NATIVE_PERIODS * tile_um;
        let mut pixel_um = self.pixel_um;
        let (pixels, joining, taps) = if native {
            // Gratings put their power into few orders, whose tails then outshine what lies between them further out.
            let margin = if self.is_grating { GRATING_MARGIN.ln() } else { 0.0 };
            let sigma = tile_um / (2.0 * PI * self.window_um);
            let taps = 2.0 * (2.0 * (log_error + margin)).sqrt() * sigma;
            (self.pixels, Joining::Gaussian { sigma }, taps.ceil() as usize)
        } else {
            let (joining, taps) = semicircle(log_error);
            pixel_um = self.lags.map_or(pixel_um, |lags| {
                let edge = self.frequency_max + BAND_MARGIN * taps as f64 / period;
                pixel_um * lags as f64 / Band::pixels(lags, pixel_um, edge) as f64
            });
            (next_fast_len((period / pixel_um).ceil().clamp(8.0, PIXELS_MAX) as usize), joining, taps)
        };
        let period_um = pixels as f64 * pixel_um;
        // Below the clamp: the tolerance is at least 1e-6, and orders are at most √(2Λ)/π nodes wide where their lattice is taken.
        let taps = taps.clamp(1, TAPS_MAX);
        let wanted = (self.frequency_max * period_um + 0.5 * taps as f64).ceil() as usize;
        let (reach, cutoff) = if native {
            (wanted.min(pixels / 2), f64::INFINITY)
        } else {
            (wanted.min((pixels + taps).div_ceil(2)), 0.5 * pixels as f64)
        };
        let (sigma, taps, window_um) = (joining.sigma(), taps.min(2 * reach + 1), (!native).then_some(self.window_um));
        LatticeAxis { period_um, pixels, joining, sigma, taps, reach, window_um, cutoff }
    }
}

impl LatticeAxis {
    /// Number of nodes, `2·reach + 1`.
    pub fn nodes(&self) -> usize {
        2 * self.reach + 1
    }

    /// First of the `taps` nodes that a look-up at `position` (in nodes) reads: the nearest ones that there are. Those
    /// left out are at least half the taps away, or do not exist.
    pub fn first_tap(&self, position: f64) -> i64 {
        let last = self.reach as i64 + 1 - self.taps as i64;
        ((position - 0.5 * self.taps as f64).ceil() as i64).clamp(-(self.reach as i64), last)
    }

    /// What is applied beforehand at `distance_um` from the window's centre: the window, and what undoes the joining's transform.
    pub(super) fn window(&self, distance_um: f64) -> f64 {
        self.window_um.map_or(1.0, |window_um| {
            let joined = self.joining.transform(distance_um / self.period_um) / self.joining.transform(0.0);
            (-0.5 * (distance_um / window_um).powi(2)).exp() / joined
        })
    }
}
