//! The defensive mixture: a small uniform part beside each lobe's own density.

use crate::numeric::math::SQUARE_PDF;
use crate::numeric::{Number, Numbers, Real};

/// Fraction of samples drawn uniformly over the hemisphere ([`crate::numeric::math::square_to_hemisphere`]). It bounds the
/// weight where the lobe's own density is far below the reflectance.
pub const UNIFORM_SHARE: f64 = 0.02;

/// The mean of the wavelengths' densities with the even share.
#[inline(always)]
pub(crate) fn mixed<N: Numbers, const L: usize>(densities: [N::Real; L], active: N::Mask) -> N::Real {
    let lit = N::Real::lit;
    let sum = densities.into_iter().fold(lit(0.0), |sum, density| sum + density);
    let density = sum.fma(lit((1.0 - UNIFORM_SHARE) / L as f64), lit(UNIFORM_SHARE * SQUARE_PDF));
    N::Real::select(active, density, lit(0.0))
}

/// Whether a direction lies above the surface.
#[inline(always)]
pub(crate) fn above<N: Numbers>(w: [N::Real; 3]) -> N::Mask {
    N::Real::lit(0.0).lt(w[2])
}
