//! The scattering vector: how directions and wavelength ask the relief's power spectrum.
//!
//! Every kind of scattering reads one spectrum `S(f; κ)`. With `q = (u, v, w)` in units of the vacuum wave number,
//! `f = (u, v)/λ` in cycles/µm and `κ = 2πw/λ` in rad/µm. Kinds differ in `q` and in the factor before `S/λ²`:
//! reflection by a bare relief has `q = wi + wo` and `R·O·M` (docs/model.md#the-reflectance).

use super::{Obliquity, angular_factor, floored_cosines};
use crate::numeric::{Numbers, Real};
use std::f64::consts::TAU;

/// Scattering vector `q`, with the factor that depends on directions alone.
pub(crate) struct Scattering<N: Numbers> {
    /// `(u, v)`. In double precision, since an order may be narrower than single precision resolves.
    pub tangential: [N::Double; 2],
    /// `w`.
    pub normal: N::Real,
    /// `O·M`: obliquity and shadowing, without the interface's factor.
    pub factor: N::Real,
}

impl<N: Numbers> Scattering<N> {
    /// Reflection by a bare relief, between two unit vectors above the surface.
    #[inline(always)]
    pub(crate) fn reflection(wi: [N::Real; 3], wo: [N::Real; 3], kind: Obliquity, shadowing: bool) -> Self {
        let cosines = floored_cosines(wi, wo);
        let q = [wi[0] + wo[0], wi[1] + wo[1], cosines[0] + cosines[1]];
        Self {
            tangential: [0, 1].map(|axis| N::widen(wi[axis]) + N::widen(wo[axis])),
            normal: wi[2] + wo[2],
            factor: angular_factor(kind, shadowing, q, cosines),
        }
    }

    /// Frequency `f = (u, v)/λ` in cycles/µm and phase rate `κ = 2πw/λ` in rad/µm at a wavelength in nm.
    #[inline(always)]
    pub(crate) fn at(&self, nm: N::Real) -> ([N::Double; 2], N::Real) {
        let wavelength_um = nm * N::Real::lit(1e-3);
        let wavenumber = N::Double::lit(1e3) / N::widen(nm);
        (self.tangential.map(|q| q * wavenumber), self.normal * N::Real::lit(TAU) / wavelength_um)
    }
}
