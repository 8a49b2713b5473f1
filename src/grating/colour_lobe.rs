//! The lobe of a grating in linear sRGB, for renderers that carry colours instead of wavelengths.
//!
//! Each component of the colour is the lobe at wavelengths (`lobe.rs`), integrated over λ with the component's weight:
//!
//! ```text
//! f_r = ∫ Σ_m e_m K(νq − f_m)/λ² weight(λ) dλ
//!     = ∫ Σ_m e_m K(νq − f_m) weight(1/ν) dν          by dν = dλ/λ²
//!     ≈ Σ_m e_m exp(−b_m²/2) W(ν_m, τ) / (2πσ²)       with e_m at the visible wavelength nearest to 1/ν_m
//!
//! W(ν_m, τ) = ∫ weight(1/ν) exp(−(ν − ν_m)²/2τ²) dν   tabulated (`colour_tables.rs`)
//! ```
//!
//! | symbol | meaning |
//! | --- | --- |
//! | λ, ν = 1/λ | wavelength in µm, wavenumber in 1/µm |
//! | q = (u, v) = (wi + wo)_xy, ρ = \|q\| | sum of the unit vectors to light and viewer, across and along the grooves |
//! | d, m, f_m = (m/d, 0) | period in µm, index of an order, frequency of the order in cycles/µm |
//! | e_m | efficiency: fraction of the unpolarised incident power in order m |
//! | K, σ | Gaussian of integral 1 over frequencies; its standard deviation in cycles/µm |
//! | weight(λ) | density of linear sRGB over λ in 1/µm, of integral 1: the CIE 1931 observer under D65 |
//! | ν_m = u·m/(d·ρ²), τ = σ/ρ | mean and standard deviation over ν of an order's Gaussian along the line νq |
//! | b_m = v·m/(d·ρ·σ) | distance of order m from the line νq, in units of σ |
//!
//! For all ν, the frequencies νq of a pair of directions form a line through the origin, and
//! `|νq − f_m|²/σ² = b_m² + (ν − ν_m)²/τ²`. Only orders with ν_m in or near the visible range contribute. Order 0 has
//! ν_m = 0 and no wavelength of its own. In place of e_0 stands the *colour* of order 0's efficiency: a mean over the
//! visible wavelengths for each component, tabulated over directions.
//!
//! A *channel* of a table is an order on one side of the relief. In a medium of index n below the relief, a direction's
//! components enter q times n, and f_r has the factor n² of the medium of `wo`; `lobe.rs` gives the reason. Each order
//! has an *order weight*, tabulated over directions, by which `draw` selects it. `draw` takes ν from the `PROPOSED`
//! Gaussians, one for each component of linear sRGB (`colour_tables.rs`). Other symbols are those of `mod.rs`. The code
//! is generic over `N: Numbers`: an `N::Real` is one number, a SIMD vector or a traced variable, and an `N::Double` is
//! the same in double precision. Loops have a label, such as `c"orders"`, which names them in traced kernels.
//!
//! The WGSL twin is `src/methods/grating.wgsl`.

use super::channels::Channels;
use super::colour_tables::{
    ColourTables, DIVISOR_MIN, NU_HALF, NU_MIDDLE, OrderZero, PROPOSED, TAU_SCALE, flat_reflectance,
};
use super::efficiencies::EfficiencyView;
use super::layout::Below;
use super::lobe::{GratingLayout, MayTransmit};
use super::polarisation::JonesView;
use crate::lobe::{Gamut, InColour, Sides, luminance};
use crate::numeric::math::{GAUSSIAN_REACH, normal_quantile};
use crate::numeric::{Index, Number, Numbers, Real};
use crate::sampling::BELOW_ONE;
use crate::scattering::TYPICAL_WAVELENGTH_UM;
use crate::table::{WAVELENGTH_MAX_NM, WAVELENGTH_MIN_NM};
use std::array;
use std::f64::consts::{LOG2_E, PI};

/// Wavelength in nm at which order 0 takes its polarisation: 550 nm, in the middle of the visible range.
const ORDER_ZERO_NM: f64 = 1e3 * TYPICAL_WAVELENGTH_UM;

/// One order on the line of a pair of directions.
struct OrderColour<'a, N: Numbers> {
    /// All channels for the incident wave.
    channels: &'a Channels<N>,
    /// Indices of the channels of incident and outgoing light.
    pair: [N::Index; 2],
    /// Wavelength `1/ν_m` in nm, clipped to the visible range; [`ORDER_ZERO_NM`] for order 0.
    nm: N::Real,
    /// Contribution to `f_r·2πσ²`, linear sRGB.
    colour: [N::Real; 3],
}

/// The lobe of a [`GratingColourSurface`](super::GratingColourSurface) over its table data (see
/// [`Lobe`](crate::lobe::Lobe)). The material's reflectance is included.
#[derive(Clone, Copy)]
pub struct GratingColourLobe<N: Numbers> {
    /// Layout of the efficiencies, period and order width.
    pub layout: GratingLayout,
    /// Layout of the colour tables.
    pub tables: ColourTables,
    /// Treatment of negative components of linear sRGB.
    pub gamut: Gamut,
    /// Table data of the efficiencies, then of the colour tables.
    pub words: [N::Words; 2],
}

/// The line νq in the plane of frequencies, and the orders whose Gaussians reach its visible part: `sign·n` for the
/// whole numbers n from `first` to `last`.
struct Line<N: Numbers> {
    /// Length ρ of q.
    length: N::Real,
    /// Unit vector `q/ρ`; (1, 0) for ρ below [`DIVISOR_MIN`], as in the mirror direction.
    direction: [N::Real; 2],
    /// Distance 1/d between neighbouring orders in cycles/µm.
    spacing_per_um: f64,
    /// Standard deviation σ of an order in cycles/µm.
    sigma_per_um: f64,
    /// Sign of u, 1 or −1, so that ν_m of the order `sign·n` grows with n.
    sign: N::Real,
    /// First n.
    first: N::Real,
    /// Last n; below `first` if there are no orders.
    last: N::Real,
}

impl<N: Numbers> GratingColourLobe<N> {
    /// Mueller matrix of the luminance in 1/sr, without the cosine, for light from `from` to `to`, before `gamut`
    /// applies: `[4·row + column]`. The frames are those of [`GratingLobe::matrix`](super::GratingLobe::matrix).
    ///
    /// Each order has its polarisation at the wavelength 1/ν_m; order 0 has that at 550 nm. `jones` is the table of
    /// polarisation.
    #[inline(always)]
    pub fn matrix(&self, jones: &JonesView<N>, from: [N::Real; 3], to: [N::Real; 3], active: N::Mask) -> [N::Real; 16] {
        let half = N::Double::lit(0.5);
        let [[in_x, in_y], [out_x, out_y]] = self.tangential([from, to]);
        // Components of the incident wave vector over k = 2π/λ, for directions moved onto order 0. ky is the same for
        // all orders.
        let (kx_over_k, ky_over_k) = ((out_x - in_x) * half, (out_y - in_y) * half);
        let polarised = |order: OrderColour<'_, N>, active| {
            let OrderColour { channels, pair, nm, colour } = order;
            let power = luminance(colour);
            jones.matrix(channels, pair, nm, N::narrow(ky_over_k), active).map(|element| element * power)
        };
        self.sum_orders(from, to, active, polarised, |colour, active| {
            // d/λ.
            let periods = N::Double::lit(1e3 * self.layout.period_um / ORDER_ZERO_NM);
            let view = self.view();
            let bounds = view.bounds(periods, ky_over_k);
            let channels = view.channels(&bounds, kx_over_k * periods, active);
            let [(incident, incident_propagates), (outgoing, outgoing_propagates)] =
                [from, to].map(|w| channels.of_order(N::Double::lit(0.0), view.is_below(w)));
            let nm = N::Real::lit(ORDER_ZERO_NM);
            let order = OrderColour { channels: &channels, pair: [incident, outgoing], nm, colour };
            // Where either wave does not propagate, `order_zero` has made the colour 0, and with it every element.
            polarised(order, active & incident_propagates & outgoing_propagates)
        })
    }

    /// Sums `R` quantities over the orders, times n²/2πσ² with the index n of the medium of `wo`. `quantity` computes
    /// the quantities of one order other than 0. `quantity_zero` computes those of order 0 from its contribution to
    /// `f_r·2πσ²`.
    ///
    /// Efficiencies are those of directions that fulfil the grating equation. For each order, both directions are moved
    /// by half of the distance to the order, so that `wo` is exactly the order's direction (`lobe.rs`).
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
        // Directions must lie above the relief or, at a body that transmits, on either side of it.
        let active = active & Sides::<N>::accepts(self, wi) & Sides::<N>::accepts(self, wo);
        let line = self.line(wi, wo);
        let tau = real(line.sigma_per_um) / line.length.max(real(DIVISOR_MIN));
        let view = self.view();
        let [from_below, to_below] = [wi, wo].map(|w| view.is_below(w));
        let half = N::Double::lit(0.5);
        let [[in_x, in_y], [out_x, out_y]] = self.tangential([wi, wo]);
        let (x_difference, ky_over_k) = (out_x - in_x, (out_y - in_y) * half);
        let weights_zero = self.spectral_weights(zero, tau, active);
        let colour_zero = self.order_zero([wi, wo], [x_difference * half, ky_over_k].map(N::narrow), active);
        let start = quantity_zero(array::from_fn(|c| weights_zero[c] * colour_zero[c]), active);
        let [nu_min, nu_max] = [1e3 / WAVELENGTH_MAX_NM, 1e3 / WAVELENGTH_MIN_NM].map(real);
        let (_, sum) = N::while_loop(
            c"orders",
            (line.first, start),
            |(n, _)| active & n.le(line.last),
            |(n, sum)| {
                let order = n * line.sign;
                let (nu_m, gauss) = line.nearest(order);
                let visible_nu = nu_m.clip(nu_min, nu_max);
                // d/λ.
                let periods = N::widen(visible_nu * real(self.layout.period_um));
                let m = N::widen(order);
                // Largest |a + m| of waves that propagate (`efficiencies.rs`).
                let bounds = view.bounds(periods, ky_over_k);
                // Wave number along x of the moved incident wave, in units of 2π/d.
                let a = (x_difference * periods - m) * half;
                let channels = view.channels(&bounds, a, active);
                let (incident, incident_propagates) = channels.of_order(N::Double::lit(0.0), from_below);
                let (outgoing, outgoing_propagates) = channels.of_order(m, to_below);
                // Order 0 is in the start value.
                let counts = active & incident_propagates & outgoing_propagates & real(0.5).lt(order.abs());
                let nm = real(1e3) / visible_nu;
                let efficiency = view.entry(&view.row(&channels, incident, nm, counts), outgoing, counts);
                let power = efficiency * gauss;
                let colour = self.spectral_weights(nu_m, tau, counts).map(|weight| weight * power);
                let at_order = OrderColour { channels: &channels, pair: [incident, outgoing], nm, colour };
                let terms = quantity(at_order, counts);
                (n + real(1.0), array::from_fn(|i| sum[i] + N::Real::select(counts, terms[i], zero)))
            },
        );
        let scale = real(1.0 / (2.0 * PI * line.sigma_per_um * line.sigma_per_um));
        // The factor n² of the outgoing medium (`lobe.rs`).
        let scale = self.layout.efficiencies.index_at::<N>(wo).map_or(scale, |index| scale * index * index);
        sum.map(|value| N::Real::select(active, value * scale, zero))
    }

    /// Tangential parts of the wave vectors of two directions over the wave number in vacuum.
    #[inline(always)]
    fn tangential(&self, directions: [[N::Real; 3]; 2]) -> [[N::Double; 2]; 2] {
        directions.map(|w| self.layout.efficiencies.tangential::<N>(w))
    }

    /// The table of efficiencies.
    #[inline(always)]
    fn view(&self) -> EfficiencyView<N> {
        EfficiencyView { layout: self.layout.efficiencies, words: self.words[0] }
    }

    /// The line of a pair of directions.
    #[inline(always)]
    fn line(&self, wi: [N::Real; 3], wo: [N::Real; 3]) -> Line<N> {
        let (real, zero, one) = (N::Real::lit, N::Real::lit(0.0), N::Real::lit(1.0));
        let [from, to] = self.tangential([wi, wo]);
        let q = [0, 1].map(|c| N::narrow(from[c] + to[c]));
        let length = q[0].fma(q[0], q[1] * q[1]).sqrt();
        let is_mirror = length.lt(real(DIVISOR_MIN));
        let inverse = one / length.max(real(DIVISOR_MIN));
        let direction =
            [N::Real::select(is_mirror, one, q[0] * inverse), N::Real::select(is_mirror, zero, q[1] * inverse)];
        let (spacing_per_um, sigma_per_um) = (1.0 / self.layout.period_um, self.layout.sigma_per_um);
        // Order n·sign has the component n·per_order along q. The visible part of the line extends from ν_min·ρ to
        // ν_max·ρ. Gaussians reach it from up to GAUSSIAN_REACH·σ beyond its ends.
        let per_order = (direction[0].abs() * real(spacing_per_um)).max(real(DIVISOR_MIN));
        let reach = real(GAUSSIAN_REACH * sigma_per_um);
        let most = real(f64::from(self.tables.orders));
        let low = (length * real(NU_MIDDLE - NU_HALF) - reach) / per_order;
        let high = (length * real(NU_MIDDLE + NU_HALF) + reach) / per_order;
        Line {
            length,
            direction,
            spacing_per_um,
            sigma_per_um,
            sign: N::Real::select(direction[0].lt(zero), -one, one),
            // Orders beyond ±`most` never propagate. Where the range has no other orders, first exceeds last.
            first: low.ceil().clip(-most, most + one),
            last: high.floor().clip(-most - one, most),
        }
    }

    /// `W(ν_m, τ)` of red, green and blue; 0 where the visible range is more than `GAUSSIAN_REACH·τ` away.
    #[inline(always)]
    fn spectral_weights(&self, nu_m: N::Real, tau: N::Real, active: N::Mask) -> [N::Real; 3] {
        let real = N::Real::lit;
        // −1 and 1 where ν_m lies GAUSSIAN_REACH·τ below and above the visible range.
        let centre = (nu_m - real(NU_MIDDLE)) / tau.fma(real(GAUSSIAN_REACH), real(NU_HALF));
        // Coordinate of the table along τ. Its entries are W/width: W is proportional to τ for small τ, so the
        // quotient is finite there.
        let width = tau / (tau + real(TAU_SCALE));
        let reaches = active & centre.abs().lt(real(1.0));
        let entry = self.tables.spectral_weights::<N>(self.words[1], width, (centre + real(1.0)) * real(0.5), reaches);
        entry.map(|weight| N::Real::select(reaches, weight * width, real(0.0)))
    }

    /// Colour of order 0's efficiency between the directions wi and wo. `[x, y]` is the half difference of their
    /// tangential parts, across and along the grooves: up to the sign, the tangential part of both directions after
    /// they are moved onto order 0. Tables are over directions in the medium of the incident light; for transmitted
    /// light, over directions in the air.
    #[inline(always)]
    fn order_zero(&self, [wi, wo]: [[N::Real; 3]; 2], [x, y]: [N::Real; 2], active: N::Mask) -> [N::Real; 3] {
        let (real, zero, one) = (N::Real::lit, N::Real::lit(0.0), N::Real::lit(1.0));
        let kind = self.order_zero_kind([wi, wo], x);
        let [from_below, to_below] = [wi, wo].map(|w| self.view().is_below(w));
        let both_below = from_below & to_below;
        let per_index = N::Real::select(both_below, real(1.0 / self.layout.efficiencies.eta_below()), one);
        let [x, y] = [x * per_index, y * per_index];
        // The projection of the moved direction onto the xz plane: the square of its length, and the squared cosine of
        // the angle between it and the normal.
        let squared_length = (one - y * y).max(zero);
        let squared_cosine = (one - x * x / squared_length.max(real(DIVISOR_MIN))).max(zero);
        let colour =
            self.tables.order_zero::<N>(self.words[1], kind, squared_cosine.sqrt(), squared_length.sqrt(), active);
        let Below::Interface(interface) = self.layout.efficiencies.below else { return colour };
        // The entries of `ReflectedBelow`, and only these, are efficiencies over the reflectance of a flat interface at
        // the cosine with the normal. The factor `flat` undoes this division.
        let flat = flat_reflectance::<N>(interface, (squared_cosine * squared_length).sqrt());
        // Light whose moved direction lies beyond the horizon of the air is not transmitted. `is_trapped` applies to
        // transmitted pairs only: rounding at the horizon must not darken reflected ones.
        let is_trapped = squared_length.le(x * x);
        let of_transmission = N::Real::select(is_trapped, zero, one);
        let both_above = !(from_below | to_below);
        let factor = N::Real::select(both_below, flat, N::Real::select(both_above, one, of_transmission));
        colour.map(|component| component * factor)
    }

    /// Index of the table of order 0 for light from wi to wo, an [`OrderZero`] as a number. `x` is the half difference
    /// `(wo − wi)/2` of the tangential parts, across the grooves.
    #[inline(always)]
    fn order_zero_kind(&self, [wi, wo]: [[N::Real; 3]; 2], x: N::Real) -> N::Index {
        let table = |kind: OrderZero| N::Index::lit(kind as u32);
        if !self.transmits() {
            return table(OrderZero::ReflectedAbove);
        }
        let zero = N::Real::lit(0.0);
        let (from_below, to_below) = (wi[2].lt(zero), wo[2].lt(zero));
        let reflected =
            N::Index::select(from_below, table(OrderZero::ReflectedBelow), table(OrderZero::ReflectedAbove));
        // The tables of transmitted light are for either sign of (w_above − w_below)/2, the x component of the moved
        // direction above the relief. It is x where `wo` lies above, and −x where `wo` lies below.
        let across = N::Real::select(to_below, -x, x);
        let [negative, positive] = [OrderZero::TransmittedNegative, OrderZero::TransmittedPositive].map(table);
        let transmitted = N::Index::select(across.lt(zero), negative, positive);
        N::Index::select((from_below & to_below) | !(from_below | to_below), reflected, transmitted)
    }
}

impl<N: Numbers> MayTransmit for GratingColourLobe<N> {
    fn transmits(&self) -> bool {
        self.layout.efficiencies.transmits()
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

    /// Density of `draw` in 1/sr: `wo.z · Σ_m (weight_m/total) · mean over P of ∫ ν² P(ν) K(νq − f_m) dν`.
    ///
    /// `weight_m` are the order weights, and P the `PROPOSED` Gaussians over ν. ν² is the Jacobian from frequencies to
    /// direction cosines, and wo.z that to solid angles. The density is multiplied by n² where `wo` lies in a medium of
    /// index n, and by 2 at a body that transmits. The sum leaves out orders from which `draw` reaches `wo` only by a ν
    /// outside the visible range or beyond `GAUSSIAN_REACH`: fewer than 3e-5 of the draws. Most of these are from the
    /// Gaussian of red, whose mean lies 3.9 of its standard deviations from 830 nm.
    #[inline(always)]
    fn density(&self, wi: [N::Real; 3], wo: [N::Real; 3], active: N::Mask) -> N::Real {
        let (real, zero) = (N::Real::lit, N::Real::lit(0.0));
        let line = self.line(wi, wo);
        let view = self.view();
        let row = self.tables.order_weights_row::<N>(wi, view.is_below(wi));
        let total = self.tables.total_weight::<N>(self.words[1], row, active);
        let is_below = view.is_below(wo);
        let variance = line.sigma_per_um * line.sigma_per_um;
        let length_squared = line.length * line.length;
        let (_, sum) = N::while_loop(
            c"orders",
            (line.first, zero),
            |(n, _)| active & n.le(line.last),
            |(n, sum)| {
                let order = n * line.sign;
                let entry = self.tables.row_entry::<N>(order, is_below);
                let order_weight = self.tables.order_weight::<N>(self.words[1], row, entry, active);
                let (_, gauss) = line.nearest(order);
                // Component of the order's frequency along q. Over the position νρ on the line, K is a Gaussian about
                // `along_q` of standard deviation σ.
                let along_q = order * real(line.spacing_per_um) * line.direction[0];
                // P has the mean µ and the standard deviation s over ν. The integral of K·P over ν is a Gaussian in
                // `along_q` about µρ, of variance `spread` = σ² + ρ²s². With the weight K·P, ν has the mean
                // `centre`, and ν² the mean `second_moment`.
                let integrals = PROPOSED.iter().fold(zero, |integrals, &(mean, s)| {
                    let spread = length_squared.fma(real(s * s), real(variance));
                    let offset = along_q - line.length * real(mean);
                    let centre = (along_q * line.length).fma(real(s * s), real(mean * variance)) / spread;
                    let second_moment = centre.fma(centre, real(s * s * variance) / spread);
                    let gaussian = (offset * offset / spread * real(-0.5 * LOG2_E)).exp2() / spread.sqrt();
                    integrals + gaussian * second_moment
                });
                (n + real(1.0), (order_weight * gauss).fma(integrals, sum))
            },
        );
        // 1/√(2π) of the Gaussian in `along_q`, times 1/(√(2π)·σ) of K across the line, in the mean over P.
        let scale = real(1.0 / (PROPOSED.len() as f64 * (2.0 * PI) * line.sigma_per_um));
        // The factor 2: at a body that transmits, callers multiply by the side's probability ½ (`lobe.rs`).
        let cos_o = if self.transmits() { wo[2].abs() * real(2.0) } else { wo[2] };
        let scale = self.layout.efficiencies.index_at::<N>(wo).map_or(scale, |index| scale * index * index);
        N::Real::select(zero.lt(total), sum * scale * cos_o / total, zero)
    }

    /// A direction from three random numbers in [0, 1). The first selects an order by the order weights, then a
    /// wavenumber ν from one of the `PROPOSED` Gaussians. The others select a frequency within the order's Gaussian.
    /// The result is the zero vector where the direction falls below the horizon. At a body that transmits, order and
    /// side are drawn together, and z has the sign of the side. `_to_below` is the side of uniform samples alone.
    #[inline(always)]
    fn draw(&self, wi: [N::Real; 3], _to_below: N::Mask, u: [N::Real; 3], active: N::Mask) -> [N::Real; 3] {
        let (real, zero, one) = (N::Real::lit, N::Real::lit(0.0), N::Real::lit(1.0));
        let index = N::Index::lit;
        let row = self.tables.order_weights_row::<N>(wi, self.view().is_below(wi));
        let order_weight = |entry: N::Index| self.tables.order_weight::<N>(self.words[1], row, entry, active);
        let target = u[0] * self.tables.total_weight::<N>(self.words[1], row, active);
        let last = index(self.tables.row_entries() - 1);
        // The entry at which the running sum exceeds the target, the sum before this entry, and the entry's own weight.
        let (entry, before, own) = N::while_loop(
            c"order",
            (index(0), zero, order_weight(index(0))),
            |(entry, before, own)| active & (before + own).le(target) & entry.lt(last),
            |(entry, before, own)| (entry + index(1), before + own, order_weight(entry + index(1))),
        );
        let (order, is_below) = self.tables.order_and_side::<N>(entry);
        // `rest`, the position of the target within the order's own weight, is uniform in [0, 1). It selects one of the
        // proposed Gaussians, then a quantile of this Gaussian. The bound on the divisor avoids 0/0 for a weight of 0.
        let rest = ((target - before) / own.max(real(DIVISOR_MIN))).clip(zero, real(BELOW_ONE));
        let scaled = rest * real(PROPOSED.len() as f64);
        let selected = scaled.floor();
        let quantile = normal_quantile(scaled - selected);
        // The draw from the selected Gaussian. The fold replaces an index, which differs between lanes.
        let nu = PROPOSED.iter().enumerate().fold(one, |nu, (i, &(mean, s))| {
            let is_selected = selected.le(real(i as f64 + 0.5)) & real(i as f64 - 0.5).lt(selected);
            N::Real::select(is_selected, quantile.fma(real(s), real(mean)), nu)
        });
        // A quantile far below the mean may give a negative ν.
        let is_drawn = active & zero.lt(nu) & zero.lt(own);
        let wavelength_um = one / nu.max(real(DIVISOR_MIN));
        // Offset from the order's frequency, in cycles/µm.
        let [offset_x, offset_y] = [1, 2].map(|i| normal_quantile(u[i]) * real(self.layout.sigma_per_um));
        // Let ki and ko be the tangential parts of wi and wo, times the indices of their media. Order m leaves at
        // ko = (mλ/d − ki.x, −ki.y).
        let [incident_x, incident_y] = self.layout.efficiencies.tangential::<N>(wi).map(N::narrow);
        let x = (order * real(1.0 / self.layout.period_um) + offset_x) * wavelength_um - incident_x;
        let y = offset_y * wavelength_um - incident_y;
        self.layout.efficiencies.direction::<N>([x, y], is_below, is_drawn)
    }
}

impl<N: Numbers> Line<N> {
    /// `ν_m` in 1/µm, where the line is nearest to an order, and the factor `exp(−b_m²/2)` of the order's Gaussian
    /// there.
    #[inline(always)]
    fn nearest(&self, order: N::Real) -> (N::Real, N::Real) {
        let real = N::Real::lit;
        let frequency = order * real(self.spacing_per_um);
        let nu_m = frequency * self.direction[0] / self.length.max(real(DIVISOR_MIN));
        let b_m = frequency * self.direction[1] * real(1.0 / self.sigma_per_um);
        (nu_m, (b_m * b_m * real(-0.5 * LOG2_E)).exp2())
    }
}
