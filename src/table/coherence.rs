//! Coherence window of the illumination and the width that it gives to a diffraction order.
//!
//! - `L`: coherence length in µm, the one parameter a user sets; `L = 4s`.
//! - `s`: standard deviation in µm of the Gaussian window `exp(−|x|²/(2s²))` that multiplies the field on the surface.
//! - `σ = 1/(2√2·π·s)`: standard deviation in cycles/µm of an order's power along x and along y. The field of an order
//!   is the window's transform `exp(−2π²s²|f|²)`; its square has this standard deviation.

use std::f64::consts::{SQRT_2, TAU};

/// Gaussian coherence window of a given coherence length (docs/model.md#coherence).
///
/// ```
/// use sunbeam::table::CoherenceWindow;
///
/// let window = CoherenceWindow::new(65.0);
/// assert_eq!(window.sigma_um(), 16.25);
/// assert!((window.order_sigma_per_um() - 0.00693).abs() < 1e-5);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CoherenceWindow {
    sigma_um: f64,
}

impl CoherenceWindow {
    /// Standard deviations of the window in one coherence length. A convention of the model.
    const SIGMAS_PER_LENGTH: f64 = 4.0;

    /// Window of `coherence_length_um`, four standard deviations in µm.
    pub const fn new(coherence_length_um: f64) -> Self {
        Self { sigma_um: coherence_length_um / Self::SIGMAS_PER_LENGTH }
    }

    /// Window of standard deviation `sigma_um`, for an effective window that is narrower than the illumination's.
    pub const fn from_sigma_um(sigma_um: f64) -> Self {
        Self { sigma_um }
    }

    /// Standard deviation `s` in µm.
    pub const fn sigma_um(self) -> f64 {
        self.sigma_um
    }

    /// Standard deviation `1/(2√2·π·s)` in cycles/µm of an order's power along one axis.
    pub const fn order_sigma_per_um(self) -> f64 {
        1.0 / (TAU * self.sigma_um * SQRT_2)
    }
}
