//! Lobes at single wavelengths: the loop over the wavelengths that a ray carries and the defensive mixture, written
//! once for all of them.

use super::{Lobe, Sides, mixture_density, sample_mixture};
use crate::numeric::{Number, Numbers, Real};

/// A lobe's own value, density and draw at one wavelength `nm`, in nm. Every type that implements the trait is a
/// [`Lobe`] for any number of wavelengths.
///
/// Masks of `value` and `density` are true only where the lobe accepts both directions.
pub(crate) trait PerWavelength<N: Numbers>: Sides<N> {
    /// Quantities of a pair of directions that all wavelengths share.
    type Pair;

    /// Prepares a pair of directions.
    fn pair(&self, wi: [N::Real; 3], wo: [N::Real; 3]) -> Self::Pair;

    /// `f_r` in 1/sr, zero where the mask is false.
    fn value(&self, pair: &Self::Pair, nm: N::Real, active: N::Mask) -> N::Real;

    /// Density of [`PerWavelength::draw`] in 1/sr; ignored where the mask is false.
    fn density(&self, pair: &Self::Pair, nm: N::Real, active: N::Mask) -> N::Real;

    /// A direction from three random numbers in [0, 1); the zero vector where it falls below the horizon. Samplers that
    /// need two random numbers ignore the first.
    ///
    /// Where `to_below` is true, the result is the mirror image above the relief of a direction below it. Elsewhere the
    /// result is the direction itself, which may lie below the relief if the lobe draws the side here and not in
    /// [`Sides::choose`].
    fn draw(&self, wi: [N::Real; 3], to_below: N::Mask, nm: N::Real, u: [N::Real; 3], active: N::Mask) -> [N::Real; 3];
}

impl<N: Numbers, T: PerWavelength<N>, const L: usize> Lobe<N, [N::Real; L]> for T {
    type Value = [N::Real; L];

    #[inline(always)]
    fn eval(&self, wi: [N::Real; 3], wo: [N::Real; 3], nm: [N::Real; L], active: N::Mask) -> [N::Real; L] {
        let active = active & self.accepts(wi) & self.accepts(wo);
        let pair = self.pair(wi, wo);
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
            // nm[k] for the whole part k of the choice. Traced numbers cannot index an array.
            let chosen =
                (1..L).fold(nm[0], |before, k| N::Real::select(choice.lt(N::Real::lit(k as f64)), before, nm[k]));
            self.draw(wi, to_below, chosen, u, active)
        });
        [x, y, N::Real::select(to_below, -z, z)]
    }
}
