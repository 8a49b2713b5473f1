//! The propagating orders of one medium.
//!
//! Symbols (`lib.rs`): x is across the grooves, y along them, z upwards. m is the index of an order, d the period, and
//! b the Bloch phase from one period to the next in turns. κ is the length of the wave vector's part in the xz plane,
//! and t = κd/2π the period in wavelengths 2π/κ. Order m has the wave numbers αm = 2π(b + m)/d along x and
//! βm = √(κ² − αm²) along z.

use std::f64::consts::TAU;

/// Smallest distance of t from the cut-off of an order (βm = 0), where the solver's sum over periods has a pole.
///
/// Amplitudes vary as the square root of the distance, so moving t by twice this distance changes them by up to about
/// 1e-5. Larger values change amplitudes more; smaller ones approach the pole to within rounding.
const CUTOFF_DISTANCE: f64 = 1e-11;

/// The propagating orders of one medium.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Waves {
    /// Indices m, ascending.
    pub(crate) orders: Vec<i32>,
    /// αm of each order, in rad/µm.
    pub(crate) alpha: Vec<f64>,
    /// βm of each order, in rad/µm; positive.
    pub(crate) beta: Vec<f64>,
}

impl Waves {
    /// The orders with |b + m| < t, for a period in µm.
    pub(crate) fn propagating(period: f64, t: f64, b: f64) -> Self {
        // αm in units of 2π/d, with the period d.
        let turns = |m: i32| b + f64::from(m);
        // The filter leaves out orders at the cut-off, and those that rounding of the bounds adds.
        let orders: Vec<i32> =
            ((-t - b).ceil() as i32..=(t - b).floor() as i32).filter(|&m| turns(m).abs() < t).collect();
        let grating_wave_number = TAU / period;
        let alpha = orders.iter().map(|&m| grating_wave_number * turns(m)).collect();
        // βm = (2π/d)·√(t² − (b + m)²), with the difference as a product, which keeps its digits near a cut-off.
        let beta = orders.iter().map(|&m| grating_wave_number * ((t - turns(m)) * (t + turns(m))).sqrt()).collect();
        Self { orders, alpha, beta }
    }
}

/// t, raised by twice [`CUTOFF_DISTANCE`] where it lies within [`CUTOFF_DISTANCE`] of a cut-off, |b + m| = t.
pub(crate) fn away_from_cutoffs(t: f64, b: f64) -> f64 {
    // At a cut-off, t − b or t + b is the integer m or −m.
    let distance_to_integer = |x: f64| (x - x.round()).abs();
    let distance = distance_to_integer(t - b).min(distance_to_integer(t + b));
    if distance < CUTOFF_DISTANCE { t + 2.0 * CUTOFF_DISTANCE } else { t }
}
