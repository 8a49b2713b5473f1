//! The lobe of a grating in linear sRGB, for renderers that carry colours instead of wavelengths.
//!
//! ```text
//! f_r = ∫ Σ_m e_m K(νq − f_m) weight(1/ν) dν      ν = 1/λ,  q = (u, v) = (wi + wo)_xy,  ρ = |q|
//! ```
//!
//! Along the line νq, order m is a Gaussian about `ν_m = u·m/(d·ρ²)` of standard deviation `τ = σ/ρ`. The few orders
//! with `ν_m` in the visible range contribute, each with sRGB's weights averaged over its Gaussian (a table) and its
//! efficiency at `ν_m`. Order 0 has no wavelength of its own; the colour of its efficiency is tabulated over
//! directions (further symbols: `mod.rs`).

use super::cell_position::{CellPosition, groove_t};
use super::colour_tables::{ColourTables, NU_HALF, NU_MIDDLE, PROPOSED, TAU_SCALE};
use super::efficiencies::EfficiencyView;
use super::lobe::{GratingLayout, REACH};
use super::polarisation::JonesView;
use crate::lobe::{Gamut, InColour, are_above, luminance};
use crate::numeric::math::normal_quantile;
use crate::numeric::{Number, Numbers, Real};
use crate::sampling::{BELOW_ONE, TYPICAL_WAVELENGTH_UM};
use crate::table::{WAVELENGTH_MAX_NM, WAVELENGTH_MIN_NM};
use std::array;
use std::f64::consts::{LOG2_E, TAU};

/// Wavelength in nm at which order 0 polarises: 550 nm.
const ORDER_ZERO_NM: f64 = 1e3 * TYPICAL_WAVELENGTH_UM;
/// Least length ρ that is divided by, and least number of orders' frequencies in it. The exact mirror direction has ρ =
/// 0.
const LENGTH_MIN: f64 = 1e-9;

/// One order on the line: its incident wave's position, its number among the cell's orders, its wavelength, and its
/// colour in `f_r`.
struct OrderColour<'a, N: Numbers> {
    position: &'a CellPosition<N>,
    outgoing: N::Index,
    nm: N::Real,
    colour: [N::Real; 3],
}

/// The lobe of a [`GratingColourSurface`](super::GratingColourSurface) over its table data (see
/// [`Lobe`](crate::lobe::Lobe)). The
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

/// The line νq over the plane of frequencies, and the orders that it meets.
struct Line<N: Numbers> {
    /// ρ.
    length: N::Real,
    /// Unit vector `q/ρ`.
    direction: [N::Real; 2],
    /// Frequency 1/d of order 1 in cycles/µm.
    spacing: f64,
    /// σ in cycles/µm.
    sigma: f64,
    /// First order whose Gaussian reaches the visible range, times `sign`.
    first: N::Real,
    /// Last such order, times `sign`.
    last: N::Real,
    /// Sign of u, 1 or −1: the orders met are those on the side of q.
    sign: N::Real,
}

impl<N: Numbers> GratingColourLobe<N> {
    /// Mueller matrix of the luminance, whatever the gamut, in the frames of
    /// [`GratingLobe::matrix`](super::GratingLobe::matrix). An order has its polarisation at `ν_m`, order 0 that at 550
    /// nm.
    #[inline(always)]
    pub fn matrix(&self, jones: &JonesView<N>, from: [N::Real; 3], to: [N::Real; 3], active: N::Mask) -> [N::Real; 16] {
        let groove_cosine = (to[1] - from[1]) * N::Real::lit(0.5);
        let polarised = |order: OrderColour<'_, N>, active| {
            let OrderColour { position, outgoing, nm, colour } = order;
            let power = luminance(colour);
            jones.matrix(position, outgoing, nm, groove_cosine, active).map(|element| element * power)
        };
        self.sum_orders(from, to, active, polarised, |colour, active| {
            let nm = N::Real::lit(ORDER_ZERO_NM);
            let periods = N::Double::lit(1e3 * self.layout.period_um / ORDER_ZERO_NM);
            let half = periods * N::Double::lit(0.5);
            let t = groove_t::<N>(periods, (N::widen(from[1]) - N::widen(to[1])) * N::Double::lit(0.5));
            let position = CellPosition::<N>::new(t, (N::widen(to[0]) - N::widen(from[0])) * half);
            let order = OrderColour { position: &position, outgoing: position.incident, nm, colour };
            polarised(order, active & position.propagates)
        })
    }

    /// Sums `R` quantities over the orders. `quantity` computes those of one order, `quantity_zero` those of order 0
    /// from its colour.
    #[inline(always)]
    fn sum_orders<const R: usize>(
        &self,
        wi: [N::Real; 3],
        wo: [N::Real; 3],
        active: N::Mask,
        quantity: impl Fn(OrderColour<'_, N>, N::Mask) -> [N::Real; R],
        quantity_zero: impl Fn([N::Real; 3], N::Mask) -> [N::Real; R],
    ) -> [N::Real; R] {
        let (real, zero) = (N::Real::lit, N::Real::lit(0.0));
        let active = active & are_above::<N>(wi, wo);
        let line = self.line(wi, wo);
        let tau = real(line.sigma) / line.length.max(real(LENGTH_MIN));
        let view = EfficiencyView::<N> { layout: self.layout.efficiencies, words: self.words[0] };
        let half = N::Double::lit(0.5);
        let y = (N::widen(wi[1]) - N::widen(wo[1])) * half;
        let x = N::widen(wo[0]) - N::widen(wi[0]);
        let weights_zero = self.weights(zero, tau, active);
        let colour_zero = self.order_zero(N::narrow(x * half), N::narrow(y), active);
        let start = quantity_zero(array::from_fn(|c| weights_zero[c] * colour_zero[c]), active);
        let (_, sum) = N::while_loop(
            c"orders",
            (line.first, start),
            |(m, _)| active & m.le(line.last),
            |(m, sum)| {
                let order = m * line.sign;
                let (nu, gauss) = line.nearest(order);
                let range = [1e3 / WAVELENGTH_MAX_NM, 1e3 / WAVELENGTH_MIN_NM].map(real);
                let periods = N::widen(nu.clip(range[0], range[1]) * real(self.layout.period_um));
                let t = groove_t::<N>(periods, y);
                let position = CellPosition::<N>::new(t, (x * periods - N::widen(order)) * half);
                let (outgoing, propagates) = position.outgoing(N::widen(order));
                // Order 0 is in the start value.
                let counts = active & propagates & position.propagates & real(0.5).lt(order.abs());
                let nm = real(1e3) / nu.clip(range[0], range[1]);
                let power = view.entry(&view.row(&position, nm, counts), outgoing, counts) * gauss;
                let colour = self.weights(nu, tau, counts).map(|weight| weight * power);
                let terms = quantity(OrderColour { position: &position, outgoing, nm, colour }, counts);
                (m + real(1.0), array::from_fn(|i| sum[i] + N::Real::select(counts, terms[i], zero)))
            },
        );
        let scale = real(1.0 / (TAU * line.sigma * line.sigma));
        sum.map(|value| N::Real::select(active, value * scale, zero))
    }

    /// The line of a pair of directions.
    #[inline(always)]
    fn line(&self, wi: [N::Real; 3], wo: [N::Real; 3]) -> Line<N> {
        let (real, zero, one) = (N::Real::lit, N::Real::lit(0.0), N::Real::lit(1.0));
        let q = [0, 1].map(|c| N::narrow(N::widen(wi[c]) + N::widen(wo[c])));
        let length = q[0].fma(q[0], q[1] * q[1]).sqrt();
        let is_mirror = length.lt(real(LENGTH_MIN));
        let inverse = one / length.max(real(LENGTH_MIN));
        let direction =
            [N::Real::select(is_mirror, one, q[0] * inverse), N::Real::select(is_mirror, zero, q[1] * inverse)];
        let (spacing, sigma) = (1.0 / self.layout.period_um, self.layout.sigma_per_um);
        // Orders with m·spacing·|u|/ρ in [ν_min·ρ − REACH·σ, ν_max·ρ + REACH·σ].
        let per_order = (direction[0].abs() * real(spacing)).max(real(LENGTH_MIN));
        let reach = real(REACH * sigma);
        let most = real(f64::from(self.tables.orders));
        let low = (length * real(NU_MIDDLE - NU_HALF) - reach) / per_order;
        let high = (length * real(NU_MIDDLE + NU_HALF) + reach) / per_order;
        Line {
            length,
            direction,
            spacing,
            sigma,
            first: low.ceil().clip(-most, most + one),
            last: high.floor().clip(-most - one, most),
            sign: N::Real::select(direction[0].lt(zero), -one, one),
        }
    }

    /// `∫ weight(1/ν) exp(−(ν − nu)²/2τ²) dν` for the three channels.
    #[inline(always)]
    fn weights(&self, nu: N::Real, tau: N::Real, active: N::Mask) -> [N::Real; 3] {
        let real = N::Real::lit;
        let centre = (nu - real(NU_MIDDLE)) / tau.fma(real(REACH), real(NU_HALF));
        let width = tau / (tau + real(TAU_SCALE));
        let is_met = active & centre.abs().lt(real(1.0));
        let weights = self.tables.weights::<N>(self.words[1], width, (centre + real(1.0)) * real(0.5), is_met);
        weights.map(|weight| N::Real::select(is_met, weight * width, real(0.0)))
    }

    /// Colour of order 0 between directions whose half difference is (x, y).
    #[inline(always)]
    fn order_zero(&self, x: N::Real, y: N::Real, active: N::Mask) -> [N::Real; 3] {
        let (real, zero, one) = (N::Real::lit, N::Real::lit(0.0), N::Real::lit(1.0));
        let of_plane = (one - y * y).max(zero);
        let in_plane = (one - x * x / of_plane.max(real(1e-12))).max(zero);
        self.tables.order_zero::<N>(self.words[1], in_plane.sqrt(), of_plane.sqrt(), active)
    }
}

impl<N: Numbers> InColour<N> for GratingColourLobe<N> {
    fn gamut(&self) -> Gamut {
        self.gamut
    }

    #[inline(always)]
    fn value(&self, wi: [N::Real; 3], wo: [N::Real; 3], active: N::Mask) -> [N::Real; 3] {
        self.sum_orders(wi, wo, active, |order, _| order.colour, |colour, _| colour)
    }

    #[inline(always)]
    fn density(&self, wi: [N::Real; 3], wo: [N::Real; 3], active: N::Mask) -> N::Real {
        let (real, zero) = (N::Real::lit, N::Real::lit(0.0));
        let line = self.line(wi, wo);
        let row = self.tables.order_weights_row::<N>(wi);
        let total = self.tables.total_weight::<N>(self.words[1], row, active);
        let variance = line.sigma * line.sigma;
        let length_squared = line.length * line.length;
        let (_, sum) = N::while_loop(
            c"orders",
            (line.first, zero),
            |(m, _)| active & m.le(line.last),
            |(m, sum)| {
                let order = m * line.sign;
                let weight = self.tables.order_weight::<N>(self.words[1], row, order, active);
                let (_, gauss) = line.nearest(order);
                let frequency = order * real(line.spacing);
                // ∫ ν² · (Gaussian of ν) · (order's Gaussian along the line at ν) dν: the Gaussian of their sum, times
                // the mean of ν² over their product. ν² is the Jacobian from frequencies to direction cosines.
                let density = PROPOSED.iter().fold(zero, |density, &(mean, sigma)| {
                    let spread = length_squared.fma(real(sigma * sigma), real(variance));
                    let offset = frequency * line.direction[0] - line.length * real(mean);
                    let centre = (frequency * line.direction[0] * line.length)
                        .fma(real(sigma * sigma), real(mean * variance))
                        / spread;
                    let moment = centre.fma(centre, real(sigma * sigma * variance) / spread);
                    let gaussian = (offset * offset / spread * real(-0.5 * LOG2_E)).exp2() / spread.sqrt();
                    density + gaussian * moment
                });
                (m + real(1.0), (weight * gauss).fma(density, sum))
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
        let row = self.tables.order_weights_row::<N>(wi);
        let weight = |order: N::Real| self.tables.order_weight::<N>(self.words[1], row, order, active);
        let target = u[0] * self.tables.total_weight::<N>(self.words[1], row, active);
        let least = real(-f64::from(self.tables.orders));
        // The order at which the running sum passes the target, the sum before it, and its own weight.
        let (order, before, own) = N::while_loop(
            c"order",
            (least, zero, weight(least)),
            |(order, before, own)| active & (before + own).le(target) & order.lt(real(f64::from(self.tables.orders))),
            |(order, before, own)| (order + one, before + own, weight(order + one)),
        );
        // The rest of the random number selects one of the proposed Gaussians, then a quantile of it.
        let rest = ((target - before) / own.max(real(1e-20))).clip(zero, real(BELOW_ONE));
        let scaled = rest * real(PROPOSED.len() as f64);
        let chosen = scaled.floor();
        let quantile = normal_quantile(scaled - chosen);
        let nu = PROPOSED.iter().enumerate().fold(one, |nu, (i, &(mean, sigma))| {
            N::Real::select(
                chosen.le(real(i as f64 + 0.5)) & real(i as f64 - 0.5).lt(chosen),
                quantile.fma(real(sigma), real(mean)),
                nu,
            )
        });
        let is_drawn = active & zero.lt(nu) & zero.lt(own);
        let wavelength_um = one / nu.max(real(1e-3));
        let [offset_x, offset_y] = [1, 2].map(|i| normal_quantile(u[i]) * real(self.layout.sigma_per_um));
        let x = (order * real(1.0 / self.layout.period_um) + offset_x) * wavelength_um - wi[0];
        let y = offset_y * wavelength_um - wi[1];
        let z_squared = one - x * x - y * y;
        let is_above = is_drawn & zero.lt(z_squared);
        [x, y, z_squared.max(zero).sqrt()].map(|c| N::Real::select(is_above, c, zero))
    }
}

impl<N: Numbers> Line<N> {
    /// `ν_m` in 1/µm, where the line is nearest to an order, and the order's Gaussian there.
    #[inline(always)]
    fn nearest(&self, order: N::Real) -> (N::Real, N::Real) {
        let real = N::Real::lit;
        let frequency = order * real(self.spacing);
        let nu = frequency * self.direction[0] / self.length.max(real(LENGTH_MIN));
        let offset = frequency * self.direction[1] * real(1.0 / self.sigma);
        (nu, (offset * offset * real(-0.5 * LOG2_E)).exp2())
    }
}
