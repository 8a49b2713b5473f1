//! The mixture that every lobe is sampled from: its own sampler, and for a small fraction of the samples a uniform
//! direction of the hemisphere. The uniform part bounds sample weights where the lobe's own density is too small.
//!
//! The first random number of a sample serves several decisions. Below [`UNIFORM_FRACTION`] the direction is uniform.
//! The rest of [0, 1) is divided into equal parts, one for each wavelength that the ray carries. The position of the
//! random number within its part, rescaled to [0, 1), is the first random number of the lobe's own sampler.
//!
//! [`Sides`] says on which sides of the relief a lobe has light, and draws the side to which a sample leaves.
//!
//! Directions are unit vectors away from the relief, with z > 0 above it. `N` is a family of numbers (`src/numeric`):
//! an `N::Real` is one number, a SIMD vector or a traced variable, and `lit` makes a constant.

use crate::numeric::math::{SQUARE_PDF, square_to_hemisphere};
use crate::numeric::{Number, Numbers, Real};
use std::array;

/// Fraction of samples drawn uniformly over the hemisphere ([`square_to_hemisphere`]). Chosen: larger fractions lower
/// the bound of sample weights, but waste more samples; smaller ones do the opposite.
pub const UNIFORM_FRACTION: f64 = 0.02;

/// Density of the mixture in 1/sr, from the lobe's own density at each of the `L` wavelengths carried. Zero where the
/// mask is false. Callers multiply it by [`Sides::probability`].
#[inline(always)]
pub(crate) fn mixture_density<N: Numbers, const L: usize>(own: [N::Real; L], active: N::Mask) -> N::Real {
    let lit = N::Real::lit;
    let sum = own.into_iter().fold(lit(0.0), |sum, density| sum + density);
    // (1 − UNIFORM_FRACTION)·mean + UNIFORM_FRACTION·SQUARE_PDF, where SQUARE_PDF is the density of uniform directions
    // in 1/sr.
    let density = sum.fma(lit((1.0 - UNIFORM_FRACTION) / L as f64), lit(UNIFORM_FRACTION * SQUARE_PDF));
    N::Real::select(active, density, lit(0.0))
}

/// A direction from the mixture, for `L` wavelengths and three random numbers `u` in [0, 1). The zero vector where the
/// mask is false, and where a draw falls below the horizon, or outside the disc that [`square_to_hemisphere`] maps.
/// Uniform directions lie above the relief; callers mirror them for samples that leave below.
///
/// `draw(choice, u, active)` is the lobe's own sampler. The whole part of `choice` is the index of the chosen
/// wavelength. The argument `u` is three random numbers in [0, 1), independent of the choice. By rounding `choice` may
/// be L, which stands for the last wavelength, and `u[0]` may be 1.
#[inline(always)]
pub(crate) fn sample_mixture<N: Numbers, const L: usize>(
    u: [N::Real; 3],
    active: N::Mask,
    draw: impl FnOnce(N::Real, [N::Real; 3], N::Mask) -> [N::Real; 3],
) -> [N::Real; 3] {
    let lit = N::Real::lit;
    // Each wavelength gets an equal part of [UNIFORM_FRACTION, 1).
    let is_uniform = u[0].lt(lit(UNIFORM_FRACTION));
    let choice = (u[0] - lit(UNIFORM_FRACTION)).max(lit(0.0)) * lit(L as f64 / (1.0 - UNIFORM_FRACTION));
    let fraction = choice - choice.floor().min(lit(L as f64 - 1.0));
    let drawn = draw(choice, [fraction, u[1], u[2]], active & !is_uniform);
    let (uniform, is_direction) = square_to_hemisphere::<N>([u[1], u[2]]);
    let zero = lit(0.0);
    array::from_fn(|c| {
        let wo = N::Real::select(is_uniform, N::Real::select(is_direction, uniform[c], zero), drawn[c]);
        N::Real::select(active, wo, zero)
    })
}

/// Whether a direction lies above the surface.
#[inline(always)]
fn is_above<N: Numbers>(w: [N::Real; 3]) -> N::Mask {
    N::Real::lit(0.0).lt(w[2])
}

/// Whether both directions lie above the surface.
#[inline(always)]
pub(crate) fn are_above<N: Numbers>(wi: [N::Real; 3], wo: [N::Real; 3]) -> N::Mask {
    is_above::<N>(wi) & is_above::<N>(wo)
}

/// Sides of the relief on which a lobe has light. The provided methods are those of a lobe that only reflects, and only
/// light from above.
pub(crate) trait Sides<N: Numbers> {
    /// Whether light may come from, or leave along, a direction.
    #[inline(always)]
    fn accepts(&self, w: [N::Real; 3]) -> N::Mask {
        is_above::<N>(w)
    }

    /// Chooses the side to which a sample leaves: whether it lies below the relief. Also returns three random numbers
    /// in [0, 1) for the draw on this side.
    #[inline(always)]
    fn choose(&self, _wi: [N::Real; 3], u: [N::Real; 3]) -> (N::Mask, [N::Real; 3]) {
        (N::mask(false), u)
    }

    /// Probability that [`Sides::choose`] takes the side of `wo`.
    #[inline(always)]
    fn probability(&self, _wi: [N::Real; 3], _wo: [N::Real; 3]) -> N::Real {
        N::Real::lit(1.0)
    }
}
