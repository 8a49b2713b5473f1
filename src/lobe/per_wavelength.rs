//! Lobes that answer wavelength by wavelength: the loop over the wavelengths carried, written once.

use super::{Lobe, are_above, mixture_density, sample_mixture};
use crate::numeric::{Number, Numbers, Real};

/// A lobe's answers at one wavelength. Implementing it makes a type a [`Lobe`] for any number of wavelengths.
pub(crate) trait PerWavelength<N: Numbers> {
    /// Quantities of a pair of directions that all wavelengths share.
    type Pair;

    /// Prepares a pair of directions.
    fn pair(&self, wi: [N::Real; 3], wo: [N::Real; 3]) -> Self::Pair;

    /// `f_r` in 1/sr at the wavelength `nm`, zero where the mask is false.
    fn value(&self, pair: &Self::Pair, nm: N::Real, active: N::Mask) -> N::Real;

    /// Density of [`PerWavelength::draw`] in 1/sr.
    fn density(&self, wi: [N::Real; 3], wo: [N::Real; 3], nm: N::Real, active: N::Mask) -> N::Real;

    /// A direction from three random numbers in [0, 1), the zero vector where it falls below the horizon. Samplers that
    /// need two random numbers ignore the first.
    fn draw(&self, wi: [N::Real; 3], nm: N::Real, u: [N::Real; 3], active: N::Mask) -> [N::Real; 3];
}

impl<N: Numbers, T: PerWavelength<N>, const L: usize> Lobe<N, [N::Real; L]> for T {
    type Value = [N::Real; L];

    #[inline(always)]
    fn eval(&self, wi: [N::Real; 3], wo: [N::Real; 3], nm: [N::Real; L], active: N::Mask) -> [N::Real; L] {
        let active = active & are_above::<N>(wi, wo);
        let pair = self.pair(wi, wo);
        let [values] = N::map_each(c"wavelengths", nm, active, |nm| [self.value(&pair, nm, active)]);
        values
    }

    #[inline(always)]
    fn pdf(&self, wi: [N::Real; 3], wo: [N::Real; 3], nm: [N::Real; L], active: N::Mask) -> N::Real {
        let active = active & are_above::<N>(wi, wo);
        let [densities] = N::map_each(c"wavelengths", nm, active, |nm| [self.density(wi, wo, nm, active)]);
        mixture_density::<N, L>(densities, active)
    }

    #[inline(always)]
    fn eval_pdf(
        &self,
        wi: [N::Real; 3],
        wo: [N::Real; 3],
        nm: [N::Real; L],
        active: N::Mask,
    ) -> ([N::Real; L], N::Real) {
        let active = active & are_above::<N>(wi, wo);
        let pair = self.pair(wi, wo);
        let [values, densities] = N::map_each(c"wavelengths", nm, active, |nm| {
            [self.value(&pair, nm, active), self.density(wi, wo, nm, active)]
        });
        (values, mixture_density::<N, L>(densities, active))
    }

    #[inline(always)]
    fn sample(&self, wi: [N::Real; 3], nm: [N::Real; L], u: [N::Real; 3], active: N::Mask) -> [N::Real; 3] {
        sample_mixture::<N, L>(wi, u, active, |choice, u, active| {
            let at = |k: usize| N::Real::lit(k as f64);
            let chosen = (1..L).fold(nm[0], |chosen, k| N::Real::select(choice.lt(at(k)), chosen, nm[k]));
            self.draw(wi, chosen, u, active)
        })
    }
}
