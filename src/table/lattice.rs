//! Choice of the frequency lattice, axis by axis (the Gaussian window separates).

use super::lookup::TAPS_MAX;
use serde::{Deserialize, Serialize};
use std::f64::consts::PI;

/// One axis of the lattice of spatial frequencies, with nodes at `m / period_um`, `|m| ≤ reach`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct LatticeAxis {
    /// Period whose reciprocal is the spacing of nodes, in µm.
    pub period_um: f64,
    /// Pixels in one period.
    pub pixels: usize,
    /// Standard deviation of the joining Gaussian `e_j`, in nodes.
    pub sigma: f64,
    /// Nodes read by one look-up.
    pub taps: usize,
    /// Largest node number kept.
    pub reach: usize,
    /// Standard deviation in µm of the part of the window that is applied beforehand, as `1/b²` (µm⁻², negative where
    /// the joining Gaussian alone narrows too much and has to be undone); zero on the native lattice of the orders.
    pub inverse_variance: f64,
    /// Node number beyond which the pixels say nothing, half their rate; nodes further out repeat those within and only
    /// help to join them. Infinite on the native lattice, whose orders end there by themselves.
    pub cutoff: f64,
}

/// Both axes of a lattice.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Lattice {
    pub x: LatticeAxis,
    pub y: LatticeAxis,
}

impl Lattice {
    /// The share of a tolerance that splines in κ may take: all on the native lattice, where joining the nodes is exact
    /// but for tails far below the tolerance; else a tenth, since that error comes on top, and since a taper leaves deep gaps
    /// in κ, in which a percentile over all κ is no comfort.
    pub(super) fn spline_share(&self) -> f64 {
        let native = |axis: &LatticeAxis| axis.inverse_variance == 0.0;
        if native(&self.x) && native(&self.y) { 1.0 } else { 0.1 }
    }
}

/// How much further down the tails of orders are followed where the tile is a grating and look-ups are few.
const GRATING_MARGIN: f64 = 400.0;

/// Most pixels that an axis is planned with. So many are refused before anything is built; the bound keeps the numbers of
/// the plan within range.
const PIXELS_MAX: f64 = 1e12;

/// What an axis has to serve.
pub(super) struct AxisDemand {
    pub pixels: usize,
    pub pixel_um: f64,
    /// Standard deviation in µm of the Gaussian that multiplies the field or its autocorrelation along this axis.
    pub window_um: f64,
    /// Distance in µm from the origin beyond which what is windowed counts little, for data that do not repeat.
    pub support_um: Option<f64>,
    /// Relative error aimed at.
    pub tolerance: f64,
    /// Whether the tile is a grating: one row or one column of pixels.
    pub is_grating: bool,
    /// Largest |f| asked for, in cycles/µm.
    pub frequency_max: f64,
}

impl AxisDemand {
    /// The cheapest lattice for this demand.
    ///
    /// On the native lattice (period = tile) the joining Gaussian is the transform of the window itself. Else the
    /// period P is chosen and the window is split in two: a joining Gaussian of `c` nodes, whose images a period away
    /// have to be suppressed, and the rest, applied beforehand. With `Λ = ln(16/tolerance)` the taps reach to
    /// `√(2Λ)` standard deviations; balancing taps against period at `Λ = 0.6·2π²c²` needs `P = 5 × support` or
    /// `P = 2πc·√2.5 × window`, whichever is less (maximum of the image term over the lag).
    pub fn plan(&self) -> LatticeAxis {
        let log_error = (16.0 / self.tolerance).ln();
        // Gratings put their power into few orders, whose tails then outshine what lies between them further out.
        let margin = if self.is_grating { GRATING_MARGIN.ln() } else { 0.0 };
        let cut = (2.0 * (log_error + margin)).sqrt();
        let tile_um = self.pixels as f64 * self.pixel_um;
        let gridded_sigma = (log_error / (1.2 * PI * PI)).sqrt();
        let window_period = 2.0 * PI * gridded_sigma * 2.5f64.sqrt() * self.window_um;
        let period = self.support_um.map_or(window_period, |support| window_period.min(5.0 * support));
        let native = self.support_um.is_none() && period > 0.8 * tile_um;
        let (pixels, sigma, inverse_variance) = if native {
            (self.pixels, tile_um / (2.0 * PI * self.window_um), 0.0)
        } else {
            let pixels = smooth_size((period / self.pixel_um).ceil().clamp(8.0, PIXELS_MAX) as usize);
            let joining_um = pixels as f64 * self.pixel_um / (2.0 * PI * gridded_sigma);
            (pixels, gridded_sigma, self.window_um.powi(-2) - joining_um.powi(-2))
        };
        let period_um = pixels as f64 * self.pixel_um;
        // Below the clamp: sigma is below 2 × gridded_sigma on either lattice, and the tolerance at least 1e-6.
        let taps = ((2.0 * cut * sigma).ceil() as usize).clamp(1, TAPS_MAX);
        let wanted = (self.frequency_max * period_um + 0.5 * taps as f64).ceil() as usize;
        let (reach, cutoff) = if native {
            (wanted.min(pixels / 2), f64::INFINITY)
        } else {
            (wanted.min((pixels + taps).div_ceil(2)), 0.5 * pixels as f64)
        };
        LatticeAxis { period_um, pixels, sigma, taps: taps.min(2 * reach + 1), reach, inverse_variance, cutoff }
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

    /// The part of the window applied beforehand, at `distance_um` from its centre.
    pub(super) fn window(&self, distance_um: f64) -> f64 {
        (-0.5 * self.inverse_variance * distance_um * distance_um).exp()
    }
}

/// The least size of at least `minimum` with no prime factor above 5, for which transforms are fast; `minimum` itself where
/// that is beyond what counts.
pub(super) fn smooth_size(minimum: usize) -> usize {
    let powers = |base: usize| std::iter::successors(Some(1_usize), move |power| power.checked_mul(base));
    let mut least = minimum.checked_next_power_of_two().unwrap_or(minimum);
    for five in powers(5).take_while(|power| *power < minimum) {
        for three in powers(3).map_while(|power| power.checked_mul(five)).take_while(|product| *product < minimum) {
            // The power of two that fills the rest.
            let size = minimum.div_ceil(three).checked_next_power_of_two().and_then(|two| two.checked_mul(three));
            least = size.map_or(least, |size| size.min(least));
        }
    }
    // Products of threes and fives alone, and those that reach the minimum without a two.
    for five in powers(5) {
        if let Some(product) = powers(3).map_while(|power| power.checked_mul(five)).find(|p| *p >= minimum) {
            least = least.min(product);
        }
        if five >= minimum {
            break;
        }
    }
    least.max(1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn smooth_sizes_are_the_least_there_are() {
        let smooth = |mut n: usize| {
            for p in [2, 3, 5] {
                while n % p == 0 {
                    n /= p;
                }
            }
            n == 1
        };
        for minimum in (0..3000).chain([16_385, 65_537, 1_000_001]) {
            let expected = (minimum.max(1)..).find(|&n| smooth(n)).unwrap();
            assert_eq!(smooth_size(minimum), expected, "{minimum}");
        }
        // No search: the next one to 10¹² + 1 is 4 ‰ further on, and nothing is beyond the largest number.
        assert_eq!(smooth_size(1_000_000_000_001), 1004193907488);
        assert_eq!(smooth_size(usize::MAX), usize::MAX);
    }
}
