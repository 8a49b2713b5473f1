//! Power of a diffraction order of a periodic relief at a transparent body, in double precision (symbols and equations:
//! docs/model.md#bodies-that-transmit).
//!
//! ```text
//! n          refractive index of the body, which lies below the relief; air above has the index 1
//! λ          wavelength in vacuum
//! K          wave vector of a direction, away from the relief, in units of 2π/λ. Its length is 1 above and n below.
//!            For a direction in the air behind a film it is the wave vector within the film
//! Ki, Ko     K of the incident and the outgoing direction: incident light travels along −Ki
//! w          component of Ki + Ko along the relief's normal z, which points into the air
//! κ          phase rate 2π|w|/λ in rad per µm of height
//! c_m(κ)     m-th Fourier coefficient of the phase screen: mean over a period d of exp(iκh(x))·exp(+2πi·m·x/d)
//! ```
//!
//! A pair of directions belongs to order m where the tangential part of `Ki + Ko` is m·λ/d along x. If w is negative,
//! the whole vector is negated first. This leaves powers unchanged: the amplitude at −κ of order m is the complex
//! conjugate of that at κ of order −m. The fraction of the incident power of unpolarised light in the order is
//! `|c_m(κ)|²` times [`BodyOrder::unpolarised`].

use super::{BodyWave, TransparentBody, TransparentPair, Vec3};
use crate::numeric::Plain;
use std::f64::consts::TAU;

/// Scattering vector `Ki + Ko` and power factors of a pair of directions at a transparent body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BodyOrder {
    /// Tangential part of `Ki + Ko` in units of 2π/λ; negated if w is negative.
    pub tangential: [f64; 2],
    /// Magnitude of w in units of 2π/λ, at least `n·normal_min` with [`TransparentBody::normal_min`]. The factors
    /// `powers` contain 1/w², and the bound keeps them finite where w vanishes.
    pub normal: f64,
    /// Factors on `|c_m|²` that give the power in an order, as a fraction of the incident power in one polarisation
    /// state. They are those of ss, sp, ps and pp; the first letter is the outgoing state, the second the incident one.
    pub powers: [f64; 4],
}

impl BodyOrder {
    /// The pair of directions of light that arrives from `wi` and leaves along `wo`. Both are unit vectors that point
    /// away from the relief. A direction with z > 0 lies in air. One with z < 0 lies in the medium of an interface, or
    /// in the air behind a film.
    ///
    /// ```
    /// use sunbeam::scattering::{BodyOrder, TransparentBody};
    ///
    /// // Along the normal from air into a half-space of glass, so no film. A flat relief has c_0 = 1, so the factor is
    /// // Fresnel's transmittance. The coherence length bounds w from below, which does not matter here.
    /// let (is_film, coherence_length_um) = (false, 65.0);
    /// let glass = TransparentBody::new(1.5, is_film, coherence_length_um);
    /// let order = BodyOrder::new(glass, [0.0, 0.0, 1.0], [0.0, 0.0, -1.0]);
    /// assert!((order.unpolarised() - 0.96).abs() < 1e-12);
    /// ```
    pub fn new(body: TransparentBody, wi: Vec3, wo: Vec3) -> Self {
        // Plain numbers of double precision. No table is read, so the lifetime of table data is arbitrary.
        type Double = Plain<'static, f64>;
        let wave = |direction: Vec3| -> BodyWave<Double> { body.wave(direction) };
        // The pair's scattering vector is in units of the wave number in the body, which is `eta` times that in vacuum.
        let pair: TransparentPair<Double> = body.pair(&wave(wi), &wave(wo));
        let tangential = pair.tangential().map(|k| k * body.eta);
        Self { tangential, normal: pair.normal() * body.eta, powers: pair.powers }
    }

    /// Phase rate κ at which the order has the amplitude `c_m`, in rad/µm, for a wavelength in vacuum.
    pub fn kappa(&self, wavelength_um: f64) -> f64 {
        TAU * self.normal / wavelength_um
    }

    /// Factor on `|c_m|²` for unpolarised light: the sum over the outgoing states, and the mean over the two incident
    /// ones.
    pub fn unpolarised(&self) -> f64 {
        0.5 * self.powers.iter().sum::<f64>()
    }
}
