//! Coherence of the light on the surface: the window, its model, and the continuation of the relief beyond the tile.

use serde::{Deserialize, Serialize};
use std::f64::consts::{PI, SQRT_2, TAU};

/// Coherence length over the window's standard deviation, by the definition of the parameter `coherence_length`.
const LENGTH_SIGMAS: f64 = 4.0;

/// Gaussian window `exp(−|x|²/(2s²))` over positions x on the surface, within which light interferes
/// (docs/model.md#coherence).
///
/// Users of the library give the coherence length `4s`. Formulas need `s`, or the width of a diffraction order, which
/// is proportional to 1/s.
///
/// ```
/// use sunbeam::table::CoherenceWindow;
/// use std::f64::consts::TAU;
///
/// let window = CoherenceWindow::new(65.0);
/// assert_eq!(window.sigma_um(), 16.25);
/// // The power density of an order is a Gaussian over both components of frequency. Its integral is 1.
/// let (peak, sigma) = (window.order_peak_um2(), window.order_sigma_per_um());
/// assert!((TAU * sigma * sigma * peak - 1.0).abs() < 1e-12);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CoherenceWindow {
    sigma_um: f64,
}

impl CoherenceWindow {
    /// Window with the coherence length `4s` in µm, positive.
    pub fn new(length_um: f64) -> Self {
        Self { sigma_um: length_um / LENGTH_SIGMAS }
    }

    /// Window with the standard deviation `s` in µm.
    pub fn from_sigma_um(sigma_um: f64) -> Self {
        Self { sigma_um }
    }

    /// Standard deviation `s` of the window in µm.
    pub fn sigma_um(self) -> f64 {
        self.sigma_um
    }

    /// Standard deviation in cycles/µm, along either axis, of an order's power density: `1/(2π√2·s)`. The density is
    /// `K(f) = 4πs²·exp(−4π²s²|f|²)`, the squared transform of the window, scaled to the integral 1.
    pub fn order_sigma_per_um(self) -> f64 {
        1.0 / (TAU * self.sigma_um * SQRT_2)
    }

    /// Peak of an order's power density, `K(0) = 4πs²`, in µm².
    pub fn order_peak_um2(self) -> f64 {
        4.0 * PI * self.sigma_um * self.sigma_um
    }
}

/// Coherence model: the position of the window (docs/model.md#coherence).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Model {
    /// Mean over all positions of the window: orders add by power.
    #[default]
    Ensemble,
    /// One window at a fixed position: orders add by amplitude.
    Patch,
}

/// Continuation of the relief beyond the tile, the known rectangle of relief (docs/model.md#coherence).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Tiling {
    /// The tile repeats without end.
    Periodic,
    /// The relief beyond the tile is unknown. The tile is a single scan, tapered at its edges.
    Aperiodic,
}
