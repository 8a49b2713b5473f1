//! The lobe of scalar theory in linear sRGB.
//!
//! `f_r = ∫ R·O·M·S/λ² · weight(λ) dλ = R0·O·M·F`: the table of colours holds `F = ∫ (R/R0)·S/λ² · weight(λ) dλ` over
//! the scattering vector, with the reflectance R0 of the reference index.

use super::{Gamut, InColour, are_above};
use crate::colour_table::{ColourView, SUM_SQUARED_MAX};
use crate::energy::ColourAlbedoView;
use crate::numeric::{Number, Numbers, Real};
use crate::sampling::ColourSamplerView;
use crate::scattering::{ComplexIndex, Obliquity, Scattering};
use std::array;

/// Factors that a lobe multiplies the table's colours by.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ColourFactors {
    /// Index whose reflectance is multiplied in; `None` for a perfect reflector.
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
    /// Table of colours.
    pub table: ColourView<N>,
    /// The sampler.
    pub sampler: ColourSamplerView<N>,
    /// Albedos that the reflectance is divided by; `None` where it is not limited.
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
        // False for NaN and infinities.
        let active = active & are_above::<N>(wi, wo) & scattering.length_squared().le(lit(SUM_SQUARED_MAX.into()));
        let [u, v, w] = scattering.q;
        let colour = self.table.relief_rgb(u, v, w, active);
        let mut factor = scattering.factor;
        if let Some(index) = reference {
            factor = factor * scattering.interface(index, obliquity);
        }
        let limiter = match &self.albedo {
            Some(albedo) => albedo.factor(wi, wo, active),
            None => [lit(1.0); 3],
        };
        array::from_fn(|c| N::Real::select(active, colour[c] * factor * limiter[c], lit(0.0)))
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
