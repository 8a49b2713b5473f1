//! The orders of a grating as a reflectance at given wavelengths: value, density and sampling, written once for all families
//! of numbers (docs/model.md#gratings-by-maxwells-equations).

use super::efficiencies::{EfficiencyLayout, EfficiencyView};
use super::place::Place;
use super::polarisation::JonesView;
use crate::lobe::{UNIFORM_SHARE, above, mixed};
use crate::numeric::math::{normal_quantile, square_to_hemisphere};
use crate::numeric::{Index, Number, Numbers, Real};
use serde::{Deserialize, Serialize};
use std::array;
use std::f64::consts::{LOG2_E, TAU};

/// Standard deviations beyond which nothing of an order counts.
pub(crate) const REACH: f64 = 5.0;

/// Everything about a grating's lobe but the words of its table.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub struct GratingLayout {
    /// Of the efficiencies.
    pub efficiencies: EfficiencyLayout,
    /// The period in µm.
    pub period_um: f64,
    /// Standard deviation of an order in cycles/µm: `1/(2π√2·s)` with four `s` in a coherence length.
    pub sigma_per_um: f64,
}

/// A grating's lobe over the words of its table. Directions are unit vectors in the grating's frame; wherever one of them lies
/// below the surface the answers are zero. `L` wavelengths in nm are carried at once. What the material reflects is inside.
#[derive(Clone, Copy)]
pub struct GratingLobe<'a, N: Numbers> {
    /// How the words are to be read.
    pub layout: &'a GratingLayout,
    /// The words of the efficiencies.
    pub words: N::Words,
}

impl<N: Numbers> GratingLobe<'_, N> {
    /// `f_r = Σ e_m K(f − f_m)/λ²` in 1/sr at each wavelength, without the cosine.
    #[inline(always)]
    pub fn eval<const L: usize>(
        &self,
        wi: [N::Real; 3],
        wo: [N::Real; 3],
        wavelengths_nm: [N::Real; L],
        active: N::Mask,
    ) -> [N::Real; L] {
        let active = active & above::<N>(wi) & above::<N>(wo);
        let [values] = N::each_lane(c"wavelengths", wavelengths_nm, active, |nm| [self.value(wi, wo, nm, active)]);
        values
    }

    /// Density of [`GratingLobe::sample`] in 1/sr: the mean over the wavelengths carried.
    #[inline(always)]
    pub fn pdf<const L: usize>(
        &self,
        wi: [N::Real; 3],
        wo: [N::Real; 3],
        wavelengths_nm: [N::Real; L],
        active: N::Mask,
    ) -> N::Real {
        let active = active & above::<N>(wi) & above::<N>(wo);
        let [densities] = N::each_lane(c"wavelengths", wavelengths_nm, active, |nm| [self.drawn(wi, wo, nm, active)]);
        mixed::<N, L>(densities, active)
    }

    /// [`GratingLobe::eval`] as a Mueller matrix, row by row, of light from `from` to `to`, in frames of reference whose first axis
    /// is the grooves', made transverse to the light.
    #[inline(always)]
    pub fn matrix<const L: usize>(
        &self,
        jones: &JonesView<N>,
        from: [N::Real; 3],
        to: [N::Real; 3],
        wavelengths_nm: [N::Real; L],
        active: N::Mask,
    ) -> [[N::Real; L]; 16] {
        let active = active & above::<N>(from) & above::<N>(to);
        let along = (to[1] - from[1]) * N::Real::lit(0.5);
        N::each_lane(c"wavelengths", wavelengths_nm, active, |nm| {
            self.values(from, to, nm, active, |place, at, efficiency, active| {
                jones.matrix(place, at, nm, along, active).map(|element| element * efficiency)
            })
        })
    }

    /// [`GratingLobe::eval`] and [`GratingLobe::pdf`] together.
    #[inline(always)]
    pub fn eval_pdf<const L: usize>(
        &self,
        wi: [N::Real; 3],
        wo: [N::Real; 3],
        wavelengths_nm: [N::Real; L],
        active: N::Mask,
    ) -> ([N::Real; L], N::Real) {
        let active = active & above::<N>(wi) & above::<N>(wo);
        let [values, densities] = N::each_lane(c"wavelengths", wavelengths_nm, active, |nm| {
            [self.value(wi, wo, nm, active), self.drawn(wi, wo, nm, active)]
        });
        (values, mixed::<N, L>(densities, active))
    }

    /// A direction for the wavelengths carried, from three numbers in [0, 1): the first picks the even share or one of the
    /// wavelengths, then the order. The zero vector where there is none.
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
        let rest = (u[0] - lit(UNIFORM_SHARE)).max(lit(0.0)) * lit(L as f64 / (1.0 - UNIFORM_SHARE));
        let hero =
            (1..L).fold(wavelengths_nm[0], |nm, k| N::Real::select(rest.lt(lit(k as f64)), nm, wavelengths_nm[k]));
        let chosen = rest - rest.floor().min(lit(L as f64 - 1.0));
        let drawn = self.direction(wi, hero, [chosen, u[1], u[2]], active & !even);
        let (evenly, there) = square_to_hemisphere::<N>([u[1], u[2]]);
        let zero = lit(0.0);
        array::from_fn(|c| {
            let wo = N::Real::select(even, N::Real::select(there, evenly[c], zero), drawn[c]);
            N::Real::select(active, wo, zero)
        })
    }

    #[inline(always)]
    fn view(&self) -> EfficiencyView<N> {
        EfficiencyView { layout: self.layout.efficiencies, words: self.words }
    }

    /// Periods in a wavelength's length.
    #[inline(always)]
    fn periods(&self, nm: N::Real) -> N::Double {
        N::Double::lit(1e3 * self.layout.period_um) / N::widen(nm)
    }

    /// Sums `shares(m)` times the density of the order m where a pair lies, over the direction cosines: `K/λ²`.
    #[inline(always)]
    fn over_orders<const R: usize>(
        &self,
        wi: [N::Real; 3],
        wo: [N::Real; 3],
        nm: N::Real,
        active: N::Mask,
        shares: impl Fn(N::Double, N::Mask) -> [N::Real; R],
    ) -> [N::Real; R] {
        let (real, double) = (N::Real::lit, N::Double::lit);
        let periods = self.periods(nm);
        // Reciprocal of the standard deviation of an order's density, counted in orders.
        let deviations = 1.0 / (self.layout.period_um * self.layout.sigma_per_um);
        let centre = (N::widen(wi[0]) + N::widen(wo[0])) * periods;
        let along = N::narrow((N::widen(wi[1]) + N::widen(wo[1])) * periods) * real(deviations);
        let reach = double(REACH / deviations);
        let first = (centre - reach).ceil();
        let last = (centre + reach).floor();
        let active = active & along.abs().lt(real(REACH));
        let (_, sums) = N::while_loop(
            c"orders",
            (first, [real(0.0); R]),
            |(m, _)| active & m.le(last),
            |(m, sums)| {
                let off = N::narrow(centre - m) * real(deviations);
                let density = (off * off * real(-0.5 * LOG2_E)).exp2();
                let shares = shares(m, active);
                (m + double(1.0), array::from_fn(|i| shares[i].fma(density, sums[i])))
            },
        );
        let across = (along * along * real(-0.5 * LOG2_E)).exp2();
        let scale = N::narrow(periods) * real(deviations);
        sums.map(|sum| sum * across * scale * scale * real(1.0 / TAU))
    }

    /// `f_r` at a wavelength.
    #[inline(always)]
    fn value(&self, wi: [N::Real; 3], wo: [N::Real; 3], nm: N::Real, active: N::Mask) -> N::Real {
        let [value] = self.values(wi, wo, nm, active, |_, _, efficiency, _| [efficiency]);
        value
    }

    /// The sum over orders of what `of` makes of a place, the order that leaves and its efficiency there. Efficiencies are those at
    /// the pair moved onto the order, either direction by half of what is missing: so swapping them changes nothing.
    #[inline(always)]
    fn values<const R: usize>(
        &self,
        wi: [N::Real; 3],
        wo: [N::Real; 3],
        nm: N::Real,
        active: N::Mask,
        of: impl Fn(&Place<N>, N::Index, N::Real, N::Mask) -> [N::Real; R],
    ) -> [N::Real; R] {
        let half = N::Double::lit(0.5);
        let periods = self.periods(nm);
        let t = across::<N>(periods, (N::widen(wi[1]) - N::widen(wo[1])) * half);
        let between = (N::widen(wo[0]) - N::widen(wi[0])) * periods;
        let view = self.view();
        self.over_orders(wi, wo, nm, active, |m, active| {
            let place = Place::<N>::new(t, (between - m) * half);
            let (at, there) = place.outgoing(m);
            let active = active & there & place.propagates;
            let efficiency = view.entry(&view.row(&place, nm, active), at, active);
            of(&place, at, efficiency, active).map(|value| N::Real::select(active, value, N::Real::lit(0.0)))
        })
    }

    /// The density of directions drawn at a wavelength, in 1/sr, the even share left out.
    #[inline(always)]
    fn drawn(&self, wi: [N::Real; 3], wo: [N::Real; 3], nm: N::Real, active: N::Mask) -> N::Real {
        let zero = N::Real::lit(0.0);
        let (place, active) = self.arriving(wi, nm, active);
        let view = self.view();
        let row = view.row(&place, nm, active);
        let total = view.entry(&row, place.cell + N::Index::lit(1), active);
        let [density] = self.over_orders(wi, wo, nm, active, |m, active| {
            let (at, there) = place.outgoing(m);
            [N::Real::select(there, view.entry(&row, at, active & there), zero)]
        });
        N::Real::select(active & zero.lt(total), density / total * wo[2], zero)
    }

    /// Where the wave from `wi` lies. At the horizon rounding might have it not propagate.
    #[inline(always)]
    fn arriving(&self, wi: [N::Real; 3], nm: N::Real, active: N::Mask) -> (Place<N>, N::Mask) {
        let periods = self.periods(nm);
        let t = across::<N>(periods, N::widen(wi[1]));
        let place = Place::<N>::new(t, -(N::widen(wi[0]) * periods));
        (place, active & place.propagates)
    }

    /// A direction at one wavelength: an order by its share, then a place in its Gaussian.
    #[inline(always)]
    fn direction(&self, wi: [N::Real; 3], nm: N::Real, u: [N::Real; 3], active: N::Mask) -> [N::Real; 3] {
        let (real, index) = (N::Real::lit, N::Index::lit);
        let (place, active) = self.arriving(wi, nm, active);
        let view = self.view();
        let row = view.row(&place, nm, active);
        let wanted = u[0] * view.entry(&row, place.cell + index(1), active);
        // The order whose share of the sum holds `wanted`; the last, should rounding have left something beyond all.
        let (chosen, _) = N::while_loop(
            c"order",
            (index(0), view.entry(&row, index(0), active)),
            |(at, sum)| active & sum.le(wanted) & at.lt(place.cell),
            |(at, sum)| (at + index(1), sum + view.entry(&row, at + index(1), active)),
        );
        let order = N::widen(N::real(chosen)) - N::widen(N::real(place.incident));
        let wavelength_um = nm * real(1e-3);
        let spread = wavelength_um * real(self.layout.sigma_per_um);
        let [x, y] = [1, 2].map(|i| normal_quantile(u[i]) * spread);
        let to = N::narrow(order / self.periods(nm) - N::widen(wi[0]));
        let (x, y) = (to + x, y - wi[1]);
        let squared = real(1.0) - x * x - y * y;
        let there = active & real(0.0).lt(squared);
        [x, y, squared.max(real(0.0)).sqrt()].map(|c| N::Real::select(there, c, real(0.0)))
    }
}

/// `t` of a wave with this direction cosine along the grooves, where so many wavelengths are in a period.
#[inline(always)]
pub(super) fn across<N: Numbers>(periods: N::Double, y: N::Double) -> N::Double {
    let one = N::Double::lit(1.0);
    periods * ((one - y) * (one + y)).max(N::Double::lit(0.0)).sqrt()
}
