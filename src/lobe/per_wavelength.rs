//! Lobes at wavelengths: the loop over the wavelengths that a ray carries, and the mixture of a lobe's own sampler with
//! uniform directions (`mixture.rs`). Both are written once for all lobes. [`Sides`] says which directions a lobe
//! accepts, and on which side of the relief a sample leaves.
//!
//! Directions point away from the relief: z > 0 above it, z < 0 below it. The horizon is z = 0. A wave vector lies
//! *beyond the horizon* if its part along the surface is longer than the wave vector of light; it has no direction.
//!
//! `N` is a family of numbers (`src/numeric`): an `N::Real` is one number, a SIMD vector or a traced variable, whose
//! value is not known while the lobe runs.

use super::{Lobe, Sides, mixture_density, sample_mixture};
use crate::numeric::{Number, Numbers, Real};

/// A lobe's own value, density and draw at one wavelength `nm`, in nm. Every type that implements the trait is a
/// [`Lobe`] for any number of wavelengths.
///
/// Masks of `value` and `density` are true only where the lobe accepts both directions. Where a mask is false, the
/// value must be zero, since callers return it unchanged. The density may be anything there, since the mixture masks
/// it.
pub(crate) trait PerWavelength<N: Numbers>: Sides<N> {
    /// Quantities of a pair of directions that all wavelengths share.
    type Pair;

    /// Prepares a pair of directions.
    fn pair(&self, wi: [N::Real; 3], wo: [N::Real; 3]) -> Self::Pair;

    /// `f_r` in 1/sr; zero where the mask is false.
    fn value(&self, pair: &Self::Pair, nm: N::Real, active: N::Mask) -> N::Real;

    /// Density of [`PerWavelength::draw`] in 1/sr, given the side of `wo`: callers multiply it by
    /// [`Sides::probability`]. Ignored where the mask is false.
    fn density(&self, pair: &Self::Pair, nm: N::Real, active: N::Mask) -> N::Real;

    /// A direction from three random numbers in [0, 1), of which the first may be rounded to 1. The zero vector where
    /// the drawn wave vector lies beyond the horizon. Samplers that need two random numbers ignore the first. Results
    /// are ignored where the mask is false.
    ///
    /// There are three kinds of lobes:
    ///
    /// - A lobe that only reflects: `to_below` is false, and the result lies above the relief.
    /// - A lobe whose [`Sides::choose`] decides on the side: the result lies above the relief. Where `to_below` is
    ///   true, the caller mirrors it to below.
    /// - A grating by Maxwell's equations that transmits: `draw` decides on the side itself, and the result lies on
    ///   that side. `to_below` is true only where the direction is uniform and the mask false.
    fn draw(&self, wi: [N::Real; 3], to_below: N::Mask, nm: N::Real, u: [N::Real; 3], active: N::Mask) -> [N::Real; 3];
}

impl<N: Numbers, T: PerWavelength<N>, const L: usize> Lobe<N, [N::Real; L]> for T {
    type Value = [N::Real; L];

    #[inline(always)]
    fn eval(&self, wi: [N::Real; 3], wo: [N::Real; 3], nm: [N::Real; L], active: N::Mask) -> [N::Real; L] {
        let active = active & self.accepts(wi) & self.accepts(wo);
        let pair = self.pair(wi, wo);
        // `map_each` calls the closure for each wavelength in turn. For each of the closure's results, here one, it
        // returns an array over the wavelengths. The string labels the loop in kernels of traced variables.
        let [values] = N::map_each(c"wavelengths", nm, active, |nm| [self.value(&pair, nm, active)]);
        values
    }

    #[inline(always)]
    fn pdf(&self, wi: [N::Real; 3], wo: [N::Real; 3], nm: [N::Real; L], active: N::Mask) -> N::Real {
        let active = active & self.accepts(wi) & self.accepts(wo);
        let pair = self.pair(wi, wo);
        let [densities] = N::map_each(c"wavelengths", nm, active, |nm| [self.density(&pair, nm, active)]);
        mixture_density::<N, L>(densities, active) * self.probability(wi, wo)
    }

    #[inline(always)]
    fn eval_pdf(
        &self,
        wi: [N::Real; 3],
        wo: [N::Real; 3],
        nm: [N::Real; L],
        active: N::Mask,
    ) -> ([N::Real; L], N::Real) {
        let active = active & self.accepts(wi) & self.accepts(wo);
        let pair = self.pair(wi, wo);
        let [values, densities] = N::map_each(c"wavelengths", nm, active, |nm| {
            [self.value(&pair, nm, active), self.density(&pair, nm, active)]
        });
        (values, mixture_density::<N, L>(densities, active) * self.probability(wi, wo))
    }

    #[inline(always)]
    fn sample(&self, wi: [N::Real; 3], nm: [N::Real; L], u: [N::Real; 3], active: N::Mask) -> [N::Real; 3] {
        let (to_below, u) = self.choose(wi, u);
        let [x, y, z] = sample_mixture::<N, L>(u, active & self.accepts(wi), |choice, u, active| {
            // `choice` is in [0, L]. `chosen` is nm[k] for k ≤ choice < k + 1, and the last wavelength for choice = L.
            // Traced variables have no value yet, so they cannot index an array.
            let chosen =
                (1..L).fold(nm[0], |before, k| N::Real::select(choice.lt(N::Real::lit(k as f64)), before, nm[k]));
            self.draw(wi, to_below, chosen, u, active)
        });
        // Mirrors the direction to below the relief, also a uniform one.
        [x, y, N::Real::select(to_below, -z, z)]
    }
}
