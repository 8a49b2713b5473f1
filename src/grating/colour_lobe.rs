//! The lobe of a grating in linear sRGB, for renderers that carry colours instead of wavelengths.
//!
//! ```text
//! f_r = ∫ Σ_m e_m K(νq − f_m) weight(1/ν) dν      ν = 1/λ,  q = (u, v) = (wi + wo)_xy,  ρ = |q|
//! ```
//!
//! Along the line νq, order m is a Gaussian about `ν_m = u·m/(d·ρ²)` of standard deviation `τ = σ/ρ`. The few orders
//! with `ν_m` in the visible range contribute, each with sRGB's weights averaged over its Gaussian (a table) and its
//! efficiency at `ν_m`. Order 0 has no wavelength of its own; the colour of its efficiency is tabulated over
//! directions. d is the period, σ the standard deviation of an order in cycles/µm (`lobe.rs`).

use super::GratingLayout;
use super::colour_tables::{ColourTables, NU_HALF, NU_MIDDLE, PROPOSED, SPREADS, TAU_SCALE};
use super::efficiencies::EfficiencyView;
use super::lobe::{REACH, groove_t};
use super::place::Place;
use super::polarisation::JonesView;
use crate::lobe::{Gamut, LinearSrgb, Lobe, are_above, desaturated, luminance, mixture_density, sample_mixture};
use crate::numeric::math::normal_quantile;
use crate::numeric::{Number, Numbers, Real};
use crate::table::{WAVELENGTH_MAX_NM, WAVELENGTH_MIN_NM};
use std::array;
use std::f64::consts::{LOG2_E, TAU};

/// Wavelength in nm of order 0's polarisation, in the middle of the visible range.
const ORDER_ZERO_NM: f64 = 550.0;

/// The lobe of a [`GratingColourSurface`](super::GratingColourSurface) over its table data (see [`Lobe`]). The
/// material's reflectance is included.
#[derive(Clone, Copy)]
pub struct GratingColourLobe<N: Numbers> {
    /// Layout of the efficiencies, period and order width.
    pub layout: GratingLayout,
    /// Layout of the colour tables.
    pub tables: ColourTables,
    /// Treatment of negative channels.
    pub gamut: Gamut,
    /// Data of the efficiencies and of the colour tables.
    pub words: [N::Words; 2],
}

/// The line νq through the orders' frequencies.
struct Line<N: Numbers> {
    /// ρ.
    length: N::Real,
    /// `q/ρ`.
    towards: [N::Real; 2],
    /// Frequency 1/d of the first order in cycles/µm.
    spacing: f64,
    /// σ in cycles/µm.
    sigma: f64,
    /// First and last order whose Gaussian reaches the visible range, times `sign`.
    first: N::Real,
    last: N::Real,
    sign: N::Real,
}

impl<N: Numbers> GratingColourLobe<N> {
    /// Mueller matrix of the luminance, whatever the gamut, in the frames of
    /// [`GratingLobe::matrix`](super::GratingLobe::matrix). An order has its polarisation at `ν_m`, order 0 that at 550
    /// nm.
    #[inline(always)]
    pub fn matrix(&self, jones: &JonesView<N>, from: [N::Real; 3], to: [N::Real; 3], active: N::Mask) -> [N::Real; 16] {
        let groove_cosine = (to[1] - from[1]) * N::Real::lit(0.5);
        let polarised = |place: &Place<N>, (at, nm): (N::Index, N::Real), colour: [N::Real; 3], active| {
            let power = luminance(colour);
            jones.matrix(place, at, nm, groove_cosine, active).map(|element| element * power)
        };
        self.sum_orders(from, to, active, polarised, |colour, active| {
            let nm = N::Real::lit(ORDER_ZERO_NM);
            let periods = N::Double::lit(1e3 * self.layout.period_um / ORDER_ZERO_NM);
            let half = periods * N::Double::lit(0.5);
            let t = groove_t::<N>(periods, (N::widen(from[1]) - N::widen(to[1])) * N::Double::lit(0.5));
            let place = Place::<N>::new(t, (N::widen(to[0]) - N::widen(from[0])) * half);
            polarised(&place, (place.incident, nm), colour, active & place.propagates)
        })
    }

    /// Sums `R` quantities over the orders. `quantity` gets an order's place, `(outgoing number, wavelength in nm)` and
    /// its colour in `f_r`; `quantity_zero` gets the colour of order 0.
    #[inline(always)]
    fn sum_orders<const R: usize>(
        &self,
        wi: [N::Real; 3],
        wo: [N::Real; 3],
        active: N::Mask,
        quantity: impl Fn(&Place<N>, (N::Index, N::Real), [N::Real; 3], N::Mask) -> [N::Real; R],
        quantity_zero: impl Fn([N::Real; 3], N::Mask) -> [N::Real; R],
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
        let start = quantity_zero(array::from_fn(|c| specular[c] * unscattered[c]), active);
        let (_, sum) = N::while_loop(
            c"orders",
            (line.first, start),
            |(m, _)| active & m.le(line.last),
            |(m, sum)| {
                let order = m * line.sign;
                let (nu, kernel) = line.nearest(order);
                let range = [1e3 / WAVELENGTH_MAX_NM, 1e3 / WAVELENGTH_MIN_NM].map(real);
                let periods = N::widen(nu.clip(range[0], range[1]) * real(self.layout.period_um));
                let t = groove_t::<N>(periods, y);
                let place = Place::<N>::new(t, (x * periods - N::widen(order)) * half);
                let (at, there) = place.outgoing(N::widen(order));
                // Order 0 is in the start value.
                let counts = active & there & place.propagates & real(0.5).lt(order.abs());
                let nm = real(1e3) / nu.clip(range[0], range[1]);
                let efficiency = view.entry(&view.row(&place, nm, counts), at, counts) * kernel;
                let colour = self.weights(nu, tau, counts).map(|weight| weight * efficiency);
                let add = quantity(&place, (at, nm), colour, counts);
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
        let row = self.tables.sampling_row::<N>(wi);
        let total = self.tables.order_weight::<N>(self.words[1], row, real(0.0), true, active);
        let variance = line.sigma * line.sigma;
        let squared = line.length * line.length;
        let (_, sum) = N::while_loop(
            c"orders",
            (line.first, zero),
            |(m, _)| active & m.le(line.last),
            |(m, sum)| {
                let order = m * line.sign;
                let weight = self.tables.order_weight::<N>(self.words[1], row, order, false, active);
                let (_, kernel) = line.nearest(order);
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
                (m + real(1.0), (weight * kernel).fma(density, sum))
            },
        );
        // √(2π)·σ of the Gaussian along the line, over 2πσ² of the two-dimensional one.
        let scale = real(1.0 / (PROPOSED.len() as f64 * TAU * line.sigma));
        N::Real::select(zero.lt(total), sum * scale * wo[2] / total, zero)
    }

    /// A direction from three random numbers in [0, 1): the first chooses an order, then a wavenumber, the others a
    /// frequency within the order's Gaussian. The zero vector where the direction falls below the horizon.
    #[inline(always)]
    fn draw(&self, wi: [N::Real; 3], u: [N::Real; 3], active: N::Mask) -> [N::Real; 3] {
        let (real, zero, one) = (N::Real::lit, N::Real::lit(0.0), N::Real::lit(1.0));
        let row = self.tables.sampling_row::<N>(wi);
        let weight = |order: N::Real, total| self.tables.order_weight::<N>(self.words[1], row, order, total, active);
        let target = u[0] * weight(zero, true);
        let least = real(-f64::from(self.tables.orders));
        // The order at which the running sum passes the target, the sum before it, and its own weight.
        let (order, before, own) = N::while_loop(
            c"order",
            (least, zero, weight(least, false)),
            |(order, before, own)| active & (before + own).le(target) & order.lt(real(f64::from(self.tables.orders))),
            |(order, before, own)| (order + one, before + own, weight(order + one, false)),
        );
        let left = ((target - before) / own.max(real(1e-20))).clip(zero, real(1.0 - 6e-8));
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

    /// The line of a pair of directions.
    #[inline(always)]
    fn line(&self, wi: [N::Real; 3], wo: [N::Real; 3]) -> Line<N> {
        let (real, zero, one) = (N::Real::lit, N::Real::lit(0.0), N::Real::lit(1.0));
        let q = [0, 1].map(|c| N::narrow(N::widen(wi[c]) + N::widen(wo[c])));
        let length = q[0].fma(q[0], q[1] * q[1]).sqrt();
        let tiny = length.lt(real(1e-9));
        let inverse = one / length.max(real(1e-9));
        let towards = [N::Real::select(tiny, one, q[0] * inverse), N::Real::select(tiny, zero, q[1] * inverse)];
        let (spacing, sigma) = (1.0 / self.layout.period_um, self.layout.sigma_per_um);
        // m·spacing·|u|/ρ within [ν_min·ρ − 5σ, ν_max·ρ + 5σ].
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

    /// `∫ weight(1/ν) exp(−(ν − nu)²/2τ²) dν` for the three channels.
    #[inline(always)]
    fn weights(&self, nu: N::Real, tau: N::Real, active: N::Mask) -> [N::Real; 3] {
        let real = N::Real::lit;
        let along = (nu - real(NU_MIDDLE)) / tau.fma(real(SPREADS), real(NU_HALF));
        let widths = tau / (tau + real(TAU_SCALE));
        let inside = active & along.abs().lt(real(1.0));
        let values = self.tables.weights::<N>(self.words[1], (along + real(1.0)) * real(0.5), widths, inside);
        values.map(|value| N::Real::select(inside, value * widths, real(0.0)))
    }

    /// Colour of order 0 between directions whose half difference is (x, y).
    #[inline(always)]
    fn order_zero(&self, x: N::Real, y: N::Real, active: N::Mask) -> [N::Real; 3] {
        let (real, zero, one) = (N::Real::lit, N::Real::lit(0.0), N::Real::lit(1.0));
        let plane = (one - y * y).max(zero);
        let within = (one - x * x / plane.max(real(1e-12))).max(zero);
        self.tables.order_zero::<N>(self.words[1], within.sqrt(), plane.sqrt(), active)
    }
}

impl<N: Numbers> Lobe<N, LinearSrgb> for GratingColourLobe<N> {
    type Value = [N::Real; 3];

    #[inline(always)]
    fn eval(&self, wi: [N::Real; 3], wo: [N::Real; 3], _: LinearSrgb, active: N::Mask) -> [N::Real; 3] {
        let colour = self.sum_orders(wi, wo, active, |_, _, colour, _| colour, |colour, _| colour);
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
    /// `ν_m` in 1/µm, where the line is nearest to an order, and the order's Gaussian there.
    #[inline(always)]
    fn nearest(&self, order: N::Real) -> (N::Real, N::Real) {
        let real = N::Real::lit;
        let frequency = order * real(self.spacing);
        let nu = frequency * self.towards[0] / self.length.max(real(1e-9));
        let offset = frequency * self.towards[1] * real(1.0 / self.sigma);
        (nu, (offset * offset * real(-0.5 * LOG2_E)).exp2())
    }
}
