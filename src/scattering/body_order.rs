//! Diffraction order of a periodic relief at a transparent body, in double precision.
//!
//! The fraction of the incident power in order m is `|c_m(κ)|²` times [`BodyOrder::unpolarised`], with the amplitude
//! c_m of the phase screen at the phase rate [`BodyOrder::kappa`].

use super::{BodyWave, TransparentBody, TransparentPair, Vec3};
use crate::numeric::Plain;
use std::f64::consts::TAU;

/// Scattering vector and powers of a pair of directions at a transparent body.
///
/// `Ki` and `Ko` are the wave vectors of incidence and exit, both pointing away from the relief, and w is the normal
/// component of their sum.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BodyOrder {
    /// Tangential part of `Ki + Ko` in wave numbers in vacuum, with the sign that makes the normal part positive.
    pub tangential: [f64; 2],
    /// Magnitude of the normal part, |w|, in wave numbers in vacuum, at least [`TransparentBody::normal_min`] times the
    /// body's index.
    pub normal: f64,
    /// Factors on `|c_m|²` in the power of an order, for the pairs of polarisation states ss, sp, ps and pp, the
    /// outgoing one first.
    pub powers: [f64; 4],
}

impl BodyOrder {
    /// The pair of light from `wi` that leaves along `wo`. Both are unit vectors away from the relief, each in the
    /// medium of its side.
    ///
    /// ```
    /// use sunbeam::scattering::{BodyOrder, TransparentBody};
    ///
    /// // Straight through a flat interface to glass: Fresnel's transmittance.
    /// let (is_film, coherence_length_um) = (false, 65.0);
    /// let glass = TransparentBody::new(1.5, is_film, coherence_length_um);
    /// let order = BodyOrder::new(glass, [0.0, 0.0, 1.0], [0.0, 0.0, -1.0]);
    /// assert!((order.unpolarised() - 0.96).abs() < 1e-12);
    /// ```
    pub fn new(body: TransparentBody, wi: Vec3, wo: Vec3) -> Self {
        // One lane in double precision.
        type Double = Plain<'static, f64>;
        let wave = |w: Vec3| -> BodyWave<Double> { body.wave(w) };
        // The pair's scattering vector is in wave numbers in the body, `eta` times those in vacuum.
        let pair: TransparentPair<Double> = body.pair(&wave(wi), &wave(wo));
        let tangential = pair.tangential().map(|k| k * body.eta);
        Self { tangential, normal: pair.normal() * body.eta, powers: pair.powers }
    }

    /// Phase rate κ of the order's amplitude `c_m`, in rad/µm.
    pub fn kappa(&self, wavelength_um: f64) -> f64 {
        TAU * self.normal / wavelength_um
    }

    /// Factor on `|c_m|²` for unpolarised light: the sum over outgoing states, the mean over incident ones.
    pub fn unpolarised(&self) -> f64 {
        0.5 * self.powers.iter().sum::<f64>()
    }
}
