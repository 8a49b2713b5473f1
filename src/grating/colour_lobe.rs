//! The orders of a grating in linear sRGB, for renderers that carry colours instead of wavelengths.
//!
//! `f_r = ∫ Σ e_m K(νq − f_m) weight(1/ν) dν` over ν = 1/λ with `q = (wi + wo)_xy`. Along the line νq an order is a Gaussian about
//! `ν = u·m/(d·ρ²)`, `ρ = |q|`, as wide as `σ/ρ`: the few orders of which that lies in the visible range count, each with the
//! weights averaged over its Gaussian, out of a table. An order's efficiency is that at its middle. Order 0 has no wavelength
//! of its own; the colour of its efficiency is tabulated over directions.

use super::GratingLayout;
use super::colour_tables::{ColourTables, NU_HALF, NU_MIDDLE, PROPOSED, SPREADS, TAU_SCALE};
use super::efficiencies::EfficiencyView;
use super::lobe::{REACH, groove_t};
use super::place::Place;
use super::polarisation::JonesView;
use crate::lobe::{Gamut, LinearSrgb, Lobe, are_above, desaturated, luminance, mixture_density, sample_mixture};
use crate::numeric::math::{lerp, normal_quantile};
use crate::numeric::{Index, Number, Numbers, Real};
use crate::table::{WAVELENGTH_MAX_NM, WAVELENGTH_MIN_NM};
use std::array;
use std::f64::consts::{LOG2_E, TAU};

/// The wavelength in nm, in the middle of what is seen, at which order 0 is taken to polarise.
const ORDER_ZERO_NM: f64 = 550.0;

/// A grating's lobe in colours over the words of its tables; as [`GratingLobe`](super::GratingLobe).
#[derive(Clone, Copy)]
pub struct GratingColourLobe<N: Numbers> {
    /// How the words of the efficiencies are to be read.
    pub layout: GratingLayout,
    /// How those of the colours are.
    pub tables: ColourTables,
    /// What becomes of negative channels.
    pub gamut: Gamut,
    /// The words of the efficiencies, and of the colours.
    pub words: [N::Words; 2],
}

/// `wi + wo` in the plane: its length, its direction, and what orders of the grating it meets.
struct Line<N: Numbers> {
    length: N::Real,
    towards: [N::Real; 2],
    /// Frequency of the first order in cycles/µm.
    spacing: f64,
    sigma: f64,
    /// The orders that count, by rising distance from 0 if `sign` is 1; they are these times `sign`.
    first: N::Real,
    last: N::Real,
    sign: N::Real,
}

impl<N: Numbers> GratingColourLobe<N> {
    /// The luminance of [`GratingColourLobe::eval`], whatever the gamut, as a Mueller matrix like that of
    /// [`GratingLobe::matrix`](super::GratingLobe::matrix). An order polarises as it does in the middle of its colours, and order
    /// 0 as at 550 nm.
    #[inline(always)]
    pub fn matrix(&self, jones: &JonesView<N>, from: [N::Real; 3], to: [N::Real; 3], active: N::Mask) -> [N::Real; 16] {
        let along = (to[1] - from[1]) * N::Real::lit(0.5);
        let of = |place: &Place<N>, (at, nm): (N::Index, N::Real), colour: [N::Real; 3], active| {
            let power = luminance(colour);
            jones.matrix(place, at, nm, along, active).map(|element| element * power)
        };
        self.values(from, to, active, of, |colour, active| {
            let nm = N::Real::lit(ORDER_ZERO_NM);
            let periods = N::Double::lit(1e3 * self.layout.period_um / ORDER_ZERO_NM);
            let half = periods * N::Double::lit(0.5);
            let t = groove_t::<N>(periods, (N::widen(from[1]) - N::widen(to[1])) * N::Double::lit(0.5));
            let place = Place::<N>::new(t, (N::widen(to[0]) - N::widen(from[0])) * half);
            of(&place, (place.incident, nm), colour, active & place.propagates)
        })
    }

    /// The sum over orders of what `of` makes of a place, the order that leaves, its wavelength in nm and the colour that it adds
    /// to `f_r`; and of what `of_zero` makes of that of order 0.
    #[inline(always)]
    fn values<const R: usize>(
        &self,
        wi: [N::Real; 3],
        wo: [N::Real; 3],
        active: N::Mask,
        of: impl Fn(&Place<N>, (N::Index, N::Real), [N::Real; 3], N::Mask) -> [N::Real; R],
        of_zero: impl Fn([N::Real; 3], N::Mask) -> [N::Real; R],
    ) -> [N::Real; R] {
        let (real, zero) = (N::Real::lit, N::Real::lit(0.0));
        let active = active & are_above::<N>(wi, wo);
        let line = self.line(wi, wo);
        let tau = real(line.sigma) / line.length.max(real(1e-9));
        let view = EfficiencyView::<N> { layout: self.layout.efficiencies, words: self.words[0] };
        let half = N::Double::lit(0.5);
        let y = (N::widen(wi[1]) - N::widen(wo[1])) * half;
        let x = N::widen(wo[0]) - N::widen(wi[0]);
        let specular = self.weights(zero, tau, active);
        let unscattered = self.order_zero(N::narrow(x * half), N::narrow(y), active);
        let start = of_zero(array::from_fn(|c| specular[c] * unscattered[c]), active);
        let (_, sum) = N::while_loop(
            c"orders",
            (line.first, start),
            |(m, _)| active & m.le(line.last),
            |(m, sum)| {
                let order = m * line.sign;
                let (nu, kernel) = line.met(order);
                let range = [1e3 / WAVELENGTH_MAX_NM, 1e3 / WAVELENGTH_MIN_NM].map(real);
                let periods = N::widen(nu.clip(range[0], range[1]) * real(self.layout.period_um));
                let t = groove_t::<N>(periods, y);
                let place = Place::<N>::new(t, (x * periods - N::widen(order)) * half);
                let (at, there) = place.outgoing(N::widen(order));
                // Order 0 has been counted.
                let counts = active & there & place.propagates & real(0.5).lt(order.abs());
                let nm = real(1e3) / nu.clip(range[0], range[1]);
                let efficiency = view.entry(&view.row(&place, nm, counts), at, counts) * kernel;
                let colour = self.weights(nu, tau, counts).map(|weight| weight * efficiency);
                let add = of(&place, (at, nm), colour, counts);
                (m + real(1.0), array::from_fn(|i| sum[i] + N::Real::select(counts, add[i], zero)))
            },
        );
        let scale = real(1.0 / (TAU * line.sigma * line.sigma));
        sum.map(|value| N::Real::select(active, value * scale, zero))
    }

    /// Density of [`GratingColourLobe::draw`] in 1/sr.
    #[inline(always)]
    fn density(&self, wi: [N::Real; 3], wo: [N::Real; 3], active: N::Mask) -> N::Real {
        let (real, zero) = (N::Real::lit, N::Real::lit(0.0));
        let line = self.line(wi, wo);
        let row = self.tables.shares_row::<N>(wi);
        let total = self.tables.share::<N>(self.words[1], row, real(0.0), true, active);
        let variance = line.sigma * line.sigma;
        let squared = line.length * line.length;
        let (_, sum) = N::while_loop(
            c"orders",
            (line.first, zero),
            |(m, _)| active & m.le(line.last),
            |(m, sum)| {
                let order = m * line.sign;
                let share = self.tables.share::<N>(self.words[1], row, order, false, active);
                let (_, kernel) = line.met(order);
                let frequency = order * real(line.spacing);
                let density = PROPOSED.iter().fold(zero, |density, &(mean, deviation)| {
                    let spread = squared.fma(real(deviation * deviation), real(variance));
                    let off = frequency * line.towards[0] - line.length * real(mean);
                    let centre = (frequency * line.towards[0] * line.length)
                        .fma(real(deviation * deviation), real(mean * variance))
                        / spread;
                    // The mean of ν² over the product of the two Gaussians.
                    let moment = centre.fma(centre, real(deviation * deviation * variance) / spread);
                    let gaussian = (off * off / spread * real(-0.5 * LOG2_E)).exp2() / spread.sqrt();
                    density + gaussian * moment
                });
                (m + real(1.0), (share * kernel).fma(density, sum))
            },
        );
        // √(2π)·σ of the Gaussian along the line, over its two dimensions' 2πσ².
        let scale = real(1.0 / (PROPOSED.len() as f64 * TAU * line.sigma));
        N::Real::select(zero.lt(total), sum * scale * wo[2] / total, zero)
    }

    /// A direction from three random numbers in [0, 1): the first chooses an order, then a wavenumber, the others a frequency
    /// within the order's Gaussian. The zero vector where the direction falls below the horizon.
    #[inline(always)]
    fn draw(&self, wi: [N::Real; 3], u: [N::Real; 3], active: N::Mask) -> [N::Real; 3] {
        let (real, zero, one) = (N::Real::lit, N::Real::lit(0.0), N::Real::lit(1.0));
        let row = self.tables.shares_row::<N>(wi);
        let share = |order: N::Real, total| self.tables.share::<N>(self.words[1], row, order, total, active);
        let wanted = u[0] * share(zero, true);
        let least = real(-f64::from(self.tables.orders));
        // The order whose share of the sum holds `wanted`, what lies before it, and its share.
        let (order, before, own) = N::while_loop(
            c"order",
            (least, zero, share(least, false)),
            |(order, before, own)| active & (before + own).le(wanted) & order.lt(real(f64::from(self.tables.orders))),
            |(order, before, own)| (order + one, before + own, share(order + one, false)),
        );
        let left = ((wanted - before) / own.max(real(1e-20))).clip(zero, real(1.0 - 6e-8));
        let place = left * real(PROPOSED.len() as f64);
        let which = place.floor();
        let quantile = normal_quantile(place - which);
        let nu = PROPOSED.iter().enumerate().fold(one, |nu, (i, &(mean, deviation))| {
            N::Real::select(
                which.le(real(i as f64 + 0.5)) & real(i as f64 - 0.5).lt(which),
                quantile.fma(real(deviation), real(mean)),
                nu,
            )
        });
        let there = active & zero.lt(nu) & zero.lt(own);
        let wavelength = one / nu.max(real(1e-3));
        let [fx, fy] = [1, 2].map(|i| normal_quantile(u[i]) * real(self.layout.sigma_per_um));
        let x = (order * real(1.0 / self.layout.period_um) + fx) * wavelength - wi[0];
        let y = fy * wavelength - wi[1];
        let squared = one - x * x - y * y;
        let there = there & zero.lt(squared);
        let drawn = [x, y, squared.max(zero).sqrt()];
        drawn.map(|c| N::Real::select(there, c, zero))
    }

    /// The line of a pair through the orders' frequencies.
    #[inline(always)]
    fn line(&self, wi: [N::Real; 3], wo: [N::Real; 3]) -> Line<N> {
        let (real, zero, one) = (N::Real::lit, N::Real::lit(0.0), N::Real::lit(1.0));
        let q = [0, 1].map(|c| N::narrow(N::widen(wi[c]) + N::widen(wo[c])));
        let length = q[0].fma(q[0], q[1] * q[1]).sqrt();
        let tiny = length.lt(real(1e-9));
        let inverse = one / length.max(real(1e-9));
        let towards = [N::Real::select(tiny, one, q[0] * inverse), N::Real::select(tiny, zero, q[1] * inverse)];
        let (spacing, sigma) = (1.0 / self.layout.period_um, self.layout.sigma_per_um);
        // Orders whose Gaussian meets the visible range: m·spacing·|u|/ρ within [ν_min·ρ − 5σ, ν_max·ρ + 5σ].
        let per_order = (towards[0].abs() * real(spacing)).max(real(1e-9));
        let reach = real(REACH * sigma);
        let most = real(f64::from(self.tables.orders));
        let low = (length * real(NU_MIDDLE - NU_HALF) - reach) / per_order;
        let high = (length * real(NU_MIDDLE + NU_HALF) + reach) / per_order;
        Line {
            length,
            towards,
            spacing,
            sigma,
            first: low.ceil().clip(-most, most + one),
            last: high.floor().clip(-most - one, most),
            sign: N::Real::select(towards[0].lt(zero), -one, one),
        }
    }

    /// `∫ weight(1/ν) exp(−(ν − nu)²/2τ²) dν` of the three channels, in 1/µm of ν times 1/µm of weight.
    #[inline(always)]
    fn weights(&self, nu: N::Real, tau: N::Real, active: N::Mask) -> [N::Real; 3] {
        let real = N::Real::lit;
        let along = (nu - real(NU_MIDDLE)) / tau.fma(real(SPREADS), real(NU_HALF));
        let widths = tau / (tau + real(TAU_SCALE));
        let inside = active & along.abs().lt(real(1.0));
        let values = self.tables.weights::<N>(self.words[1], (along + real(1.0)) * real(0.5), widths, inside);
        values.map(|value| N::Real::select(inside, value * widths, real(0.0)))
    }

    /// The colour of order 0 between directions whose half difference is (x, y).
    #[inline(always)]
    fn order_zero(&self, x: N::Real, y: N::Real, active: N::Mask) -> [N::Real; 3] {
        let (real, zero, one) = (N::Real::lit, N::Real::lit(0.0), N::Real::lit(1.0));
        let across = (one - y * y).max(zero);
        let within = (one - x * x / across.max(real(1e-12))).max(zero);
        self.tables.order_zero::<N>(self.words[1], within.sqrt(), across.sqrt(), active)
    }
}

impl<N: Numbers> Lobe<N, LinearSrgb> for GratingColourLobe<N> {
    type Value = [N::Real; 3];

    #[inline(always)]
    fn eval(&self, wi: [N::Real; 3], wo: [N::Real; 3], _: LinearSrgb, active: N::Mask) -> [N::Real; 3] {
        let colour = self.values(wi, wo, active, |_, _, colour, _| colour, |colour, _| colour);
        match self.gamut {
            Gamut::Keep => colour,
            Gamut::Desaturate => desaturated(colour),
        }
    }

    #[inline(always)]
    fn pdf(&self, wi: [N::Real; 3], wo: [N::Real; 3], _: LinearSrgb, active: N::Mask) -> N::Real {
        let active = active & are_above::<N>(wi, wo);
        mixture_density::<N, 1>([self.density(wi, wo, active)], active)
    }

    #[inline(always)]
    fn eval_pdf(
        &self,
        wi: [N::Real; 3],
        wo: [N::Real; 3],
        carried: LinearSrgb,
        active: N::Mask,
    ) -> ([N::Real; 3], N::Real) {
        (self.eval(wi, wo, carried, active), self.pdf(wi, wo, carried, active))
    }

    #[inline(always)]
    fn sample(&self, wi: [N::Real; 3], _: LinearSrgb, u: [N::Real; 3], active: N::Mask) -> [N::Real; 3] {
        sample_mixture::<N, 1>(wi, u, active, |_, u, active| self.draw(wi, u, active))
    }
}

impl<N: Numbers> Line<N> {
    /// The inverse wavelength in 1/µm at which the line is nearest to an order, and the order's Gaussian there.
    #[inline(always)]
    fn met(&self, order: N::Real) -> (N::Real, N::Real) {
        let real = N::Real::lit;
        let frequency = order * real(self.spacing);
        let nu = frequency * self.towards[0] / self.length.max(real(1e-9));
        let beside = frequency * self.towards[1] * real(1.0 / self.sigma);
        (nu, (beside * beside * real(-0.5 * LOG2_E)).exp2())
    }
}

/// Bilinear look-up of packets of four words, of which three count: `[first][second]`, places in [0, 1].
#[inline(always)]
pub(super) fn packets<N: Numbers>(
    words: N::Words,
    begin: u32,
    counts: [u32; 2],
    places: [N::Real; 2],
    active: N::Mask,
) -> [N::Real; 3] {
    let real = N::Real::lit;
    let index = |i: u32| N::Index::lit(i);
    let [(i, p), (j, q)] = array::from_fn(|axis| {
        let last = f64::from(counts[axis] - 1);
        let x = places[axis].clip(real(0.0), real(1.0)) * real(last);
        let low = x.floor().min(real(last - 1.0));
        (N::index(low), x - low)
    });
    let at = |di: u32, dj: u32| {
        let packet = index(begin / 4) + (i + index(di)) * index(counts[1]) + j + index(dj);
        N::gather::<4>(words, packet, active).map(N::from_bits)
    };
    let (a, b, c, d) = (at(0, 0), at(0, 1), at(1, 0), at(1, 1));
    array::from_fn(|channel| lerp(lerp(a[channel], b[channel], q), lerp(c[channel], d[channel], q), p))
}
