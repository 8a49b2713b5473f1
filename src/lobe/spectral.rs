//! The diffracted lobe at given wavelengths: value, density and sampling, written once for all families of numbers.

use super::mixture::{UNIFORM_SHARE, above, mixed};
use crate::energy::{AlbedoLayout, AlbedoView, GridPlace};
use crate::numeric::math::square_to_hemisphere;
use crate::numeric::{Number, Numbers, Real};
use crate::sampling::{SamplerLayout, SamplerView};
use crate::scattering::{COSINE_MIN, Obliquity, obliquity, shadowing};
use crate::table::{PackedLayout, TableView};
use serde::{Deserialize, Serialize};

/// Everything about a surface's lobe but the words of its tables.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub struct SpectralLayout {
    /// Of the power spectrum.
    pub table: PackedLayout,
    /// Of the sampler.
    pub sampler: SamplerLayout,
    /// `None` where energy is not kept, or keeps itself.
    pub albedo: Option<AlbedoLayout>,
    /// The obliquity factor.
    pub obliquity: Obliquity,
    /// Whether V-cavities shadow and mask.
    pub shadowing: bool,
}

/// A surface's lobe over the words of its tables, in the order of the layout. Directions are unit vectors in the
/// grating's frame; wherever one of them lies below the surface the answers are zero. `L` wavelengths in nm are carried at
/// once.
#[derive(Clone, Copy)]
pub struct SpectralLobe<'a, N: Numbers> {
    /// How the words are to be read.
    pub layout: &'a SpectralLayout,
    /// The table's words, the sampler's and the albedo's.
    pub words: [N::Words; 3],
}

/// What a pair of directions is to all wavelengths.
struct Directions<N: Numbers> {
    /// `wi + wo`: tangential components, and the normal one.
    across: [N::Double; 2],
    along: N::Real,
    /// `O·M`.
    factor: N::Real,
    /// What conserves energy, and where either direction lies in it.
    albedo: Option<(AlbedoView<N>, GridPlace<N>, GridPlace<N>)>,
}

impl<N: Numbers> SpectralLobe<'_, N> {
    /// `f_r` in 1/sr at each wavelength, without cosine and the interface's factor ([`Pair::interface`](crate::scattering::Pair::interface)).
    #[inline(always)]
    pub fn eval<const L: usize>(
        &self,
        wi: [N::Real; 3],
        wo: [N::Real; 3],
        wavelengths_nm: [N::Real; L],
        active: N::Mask,
    ) -> [N::Real; L] {
        let active = active & above::<N>(wi) & above::<N>(wo);
        let pair = self.pair(wi, wo);
        let [values] = N::each_lane(c"wavelengths", wavelengths_nm, active, |nm| [self.value(&pair, nm, active)]);
        values
    }

    /// Density of [`SpectralLobe::sample`] in 1/sr: the mean over the wavelengths carried.
    #[inline(always)]
    pub fn pdf<const L: usize>(
        &self,
        wi: [N::Real; 3],
        wo: [N::Real; 3],
        wavelengths_nm: [N::Real; L],
        active: N::Mask,
    ) -> N::Real {
        let active = active & above::<N>(wi) & above::<N>(wo);
        let sampler = self.sampler();
        let [densities] = N::each_lane(c"wavelengths", wavelengths_nm, active, |nm| [sampler.pdf(wi, wo, nm, active)]);
        mixed::<N, L>(densities, active)
    }

    /// [`SpectralLobe::eval`] and [`SpectralLobe::pdf`] together.
    #[inline(always)]
    pub fn eval_pdf<const L: usize>(
        &self,
        wi: [N::Real; 3],
        wo: [N::Real; 3],
        wavelengths_nm: [N::Real; L],
        active: N::Mask,
    ) -> ([N::Real; L], N::Real) {
        let active = active & above::<N>(wi) & above::<N>(wo);
        let (pair, sampler) = (self.pair(wi, wo), self.sampler());
        let [values, densities] = N::each_lane(c"wavelengths", wavelengths_nm, active, |nm| {
            [self.value(&pair, nm, active), sampler.pdf(wi, wo, nm, active)]
        });
        (values, mixed::<N, L>(densities, active))
    }

    /// A direction for the wavelengths carried, from three numbers in [0, 1): the first picks the even share or one of the
    /// wavelengths. The zero vector where there is none.
    #[inline(always)]
    pub fn sample<const L: usize>(
        &self,
        wi: [N::Real; 3],
        wavelengths_nm: [N::Real; L],
        u: [N::Real; 3],
        active: N::Mask,
    ) -> [N::Real; 3] {
        let lit = N::Real::lit;
        let active = active & above::<N>(wi);
        let even = u[0].lt(lit(UNIFORM_SHARE));
        let rest = (u[0] - lit(UNIFORM_SHARE)) * lit(L as f64 / (1.0 - UNIFORM_SHARE));
        let hero =
            (1..L).fold(wavelengths_nm[0], |nm, k| N::Real::select(rest.lt(lit(k as f64)), nm, wavelengths_nm[k]));
        let drawn = self.sampler().sample(wi, hero, [u[1], u[2]], active & !even);
        let (evenly, there) = square_to_hemisphere::<N>([u[1], u[2]]);
        let zero = lit(0.0);
        std::array::from_fn(|c| {
            let wo = N::Real::select(even, N::Real::select(there, evenly[c], zero), drawn[c]);
            N::Real::select(active, wo, zero)
        })
    }

    /// What all wavelengths have in common.
    #[inline(always)]
    fn pair(&self, wi: [N::Real; 3], wo: [N::Real; 3]) -> Directions<N> {
        let least = N::Real::lit(COSINE_MIN);
        let cosines = [wi[2].max(least), wo[2].max(least)];
        let q = [wi[0] + wo[0], wi[1] + wo[1], cosines[0] + cosines[1]];
        let factor = obliquity(self.layout.obliquity, q, cosines);
        Directions {
            across: [0, 1].map(|axis| N::widen(wi[axis]) + N::widen(wo[axis])),
            along: wi[2] + wo[2],
            factor: if self.layout.shadowing { factor * shadowing(q, cosines) } else { factor },
            albedo: self.layout.albedo.as_ref().map(|layout| {
                let view = AlbedoView::<N> { layout: *layout, words: self.words[2] };
                (view, view.place(wi), view.place(wo))
            }),
        }
    }

    /// `f_r` at a wavelength.
    #[inline(always)]
    fn value(&self, pair: &Directions<N>, nm: N::Real, active: N::Mask) -> N::Real {
        let wavelength_um = nm * N::Real::lit(1e-3);
        let wavenumber = N::Double::lit(1e3) / N::widen(nm);
        let kappa = pair.along * N::Real::lit(std::f64::consts::TAU) / wavelength_um;
        let table = TableView::<N> { layout: self.layout.table, words: self.words[0] };
        let density = table.density(pair.across.map(|q| q * wavenumber), kappa, active);
        let value = pair.factor * density / (wavelength_um * wavelength_um);
        let value = match &pair.albedo {
            None => value,
            Some((albedo, i, o)) => value * albedo.factor_at(i, o, nm, active),
        };
        N::Real::select(active, value, N::Real::lit(0.0))
    }

    #[inline(always)]
    fn sampler(&self) -> SamplerView<N> {
        SamplerView { layout: self.layout.sampler, words: self.words[1] }
    }
}
