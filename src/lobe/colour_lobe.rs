//! The lobe of scalar theory in linear sRGB.
//!
//! ```text
//! f_r    = ∫ R·O·M·S/λ² · weight(λ) dλ = R0·O·M·F     before the division by the albedo
//! F(q)   = ∫ (R/R0)·S/λ² · weight(λ) dλ               table of colours over the scattering vector q = wi + wo
//! R, R0  reflectance of the material at λ, and that of one index for all λ, the reference
//! ```
//!
//! O, M and S are those of docs/model.md#the-reflectance. The small-slope factor Q of the reference replaces R0·O.

use super::{Gamut, InColour, are_above};
use crate::colour_table::{ColourView, SUM_SQUARED_MAX};
use crate::energy::ColourAlbedoView;
use crate::numeric::{Number, Numbers, Real};
use crate::sampling::ColourSamplerView;
use crate::scattering::{ComplexIndex, Obliquity, Scattering};
use std::array;

/// Factors that a lobe multiplies the table's colours by, and the treatment of the result.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ColourFactors {
    /// Index of the reference; `None` leaves the interface's factor (R0 or Q) out.
    pub reference: Option<ComplexIndex>,
    /// The obliquity factor.
    pub obliquity: Obliquity,
    /// Whether the V-cavity factor M applies.
    pub shadowing: bool,
    /// Treatment of negative channels.
    pub gamut: Gamut,
}

/// The lobe of a [`ColourSurface`](super::ColourSurface) over its table data (see [`Lobe`](super::Lobe)).
pub struct ColourLobe<N: Numbers> {
    /// Factors of the table's colours.
    pub factors: ColourFactors,
    /// Table of F.
    pub table: ColourView<N>,
    /// The sampler.
    pub sampler: ColourSamplerView<N>,
    /// Albedos by which the reflectance is divided; `None` where nothing is divided.
    pub albedo: Option<ColourAlbedoView<N>>,
}

impl<N: Numbers> InColour<N> for ColourLobe<N> {
    fn gamut(&self) -> Gamut {
        self.factors.gamut
    }

    #[inline(always)]
    fn value(&self, wi: [N::Real; 3], wo: [N::Real; 3], active: N::Mask) -> [N::Real; 3] {
        let lit = N::Real::lit;
        let ColourFactors { reference, obliquity, shadowing, .. } = self.factors;
        let scattering = Scattering::<N>::reflection(wi, wo, obliquity, shadowing);
        // The comparison of the length is false for NaN and infinities.
        let active = active & are_above::<N>(wi, wo) & scattering.length_squared().le(lit(SUM_SQUARED_MAX.into()));
        let [u, v, w] = scattering.q;
        let colour = self.table.relief_rgb(u, v, w, active);
        let mut factor = scattering.factor;
        if let Some(index) = reference {
            factor = factor * scattering.interface(index, obliquity);
        }
        // 1/max(1, A(wi), A(wo)) of each channel, with its albedo A.
        let per_albedo = match &self.albedo {
            Some(albedo) => albedo.factor(wi, wo, active),
            None => [lit(1.0); 3],
        };
        array::from_fn(|c| N::Real::select(active, colour[c] * factor * per_albedo[c], lit(0.0)))
    }

    #[inline(always)]
    fn density(&self, wi: [N::Real; 3], wo: [N::Real; 3], active: N::Mask) -> N::Real {
        self.sampler.pdf(wi, wo, active)
    }

    #[inline(always)]
    fn draw(&self, wi: [N::Real; 3], u: [N::Real; 3], active: N::Mask) -> [N::Real; 3] {
        self.sampler.sample(wi, [u[1], u[2]], active)
    }
}
