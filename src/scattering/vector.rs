//! The scattering vector `q = wi + wo = (u, v, w)`, by which the relief's power spectrum `S(f; κ)` is read.
//!
//! `wi` and `wo` are unit vectors from the surface to the light and the viewer; w is along the normal, λ the
//! wavelength. The arguments of S are the spatial frequency `f = (u, v)/λ` in cycles/µm and the phase rate `κ = 2πw/λ`
//! in rad per µm of height. The reflectance is `R·O·M·S/λ²`: Fresnel reflectance, obliquity and shadowing
//! (docs/model.md#the-reflectance). An [`Obliquity`] is a choice of factors: Stam's O, an O of 1 (`Unit`), or an O of 1
//! with the small-slope factor Q in place of R.
//!
//! `N` is a family of numbers (`src/numeric`). An `N::Real` is one number, a SIMD vector or a traced variable; `lit`
//! makes a constant, and `widen` converts to double precision, `N::Double`.

use super::{ComplexIndex, Obliquity, Reading, angular_factor, floored_cosines, fresnel_of_family, small_slope};
use crate::numeric::{Numbers, Real};

/// Wavelength in µm in the middle of the visible range. It stands for all wavelengths where one must do: to count the
/// orders of a surface, or to turn the width of an order in frequency into one in direction cosines.
pub(crate) const TYPICAL_WAVELENGTH_UM: f64 = 0.55;

/// Scattering vector `q` of a pair of directions, with the factors that depend on directions only.
pub(crate) struct Scattering<N: Numbers> {
    /// `(u, v)` in double precision: an order may be narrower than single precision resolves.
    tangential: [N::Double; 2],
    /// Exact w, from which κ follows.
    exact_w: N::Real,
    /// Cosines of `wi` and `wo` with the normal, at least [`COSINE_MIN`](super::COSINE_MIN).
    cosines: [N::Real; 2],
    /// `q` with the sum of `cosines` as w, which is therefore positive: the factors divide by it. Tables of colours are
    /// read with this vector, spectral tables with [`Scattering::at`].
    pub bounded_q: [N::Real; 3],
    /// `O·M`: obliquity and shadowing, without the interface's factor.
    pub factor: N::Real,
}

impl<N: Numbers> Scattering<N> {
    /// Reflection between two unit vectors above the surface. `kind` and `shadowing` select the factors O and M.
    #[inline(always)]
    pub(crate) fn reflection(wi: [N::Real; 3], wo: [N::Real; 3], kind: Obliquity, shadowing: bool) -> Self {
        let cosines = floored_cosines(wi, wo);
        let bounded_q = [wi[0] + wo[0], wi[1] + wo[1], cosines[0] + cosines[1]];
        Self {
            tangential: [0, 1].map(|axis| N::widen(wi[axis]) + N::widen(wo[axis])),
            exact_w: wi[2] + wo[2],
            cosines,
            bounded_q,
            factor: angular_factor(kind, shadowing, bounded_q, cosines),
        }
    }

    /// Arguments of a table's look-up: f in cycles/µm and κ in rad/µm ([`Reading::arguments`]). `reading` gives the
    /// wavelength λ. For a relief of another size than the tables' it gives two, one that replaces λ in f and one in κ.
    #[inline(always)]
    pub(crate) fn at(&self, reading: &Reading<N>) -> ([N::Double; 2], N::Real) {
        reading.arguments(self.tangential, self.exact_w)
    }

    /// `|q|²`, at most 4 up to rounding.
    #[inline(always)]
    pub(crate) fn length_squared(&self) -> N::Real {
        let [u, v, w] = self.bounded_q;
        w.fma(w, u.fma(u, v * v))
    }

    /// The interface's factor for unpolarised light: the Fresnel reflectance R at the half vector, or the small-slope
    /// factor Q for [`Obliquity::SmallSlope`]. `index` is that of the medium below the surface.
    #[inline(always)]
    pub(crate) fn interface(&self, index: ComplexIndex, kind: Obliquity) -> N::Real {
        match kind {
            // `None` in place of the index would mean a perfect conductor.
            Obliquity::SmallSlope => small_slope(self.bounded_q, self.cosines, Some(index)),
            // The cosine at the half vector is |q|/2.
            Obliquity::Stam | Obliquity::Unit => {
                fresnel_of_family(self.length_squared().sqrt() * N::Real::lit(0.5), index)
            }
        }
    }
}
