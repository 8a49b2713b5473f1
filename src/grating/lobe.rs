//! The lobe of a grating at wavelengths: orders with efficiencies by Maxwell's equations, each a Gaussian over
//! frequency (docs/model.md#gratings-by-maxwells-equations).
//!
//! The grating of period `d` varies along x; its grooves run along y. At a wavelength λ:
//!
//! ```text
//! f_r    = Σ_m e_m K(f − f_m)/λ²       sum over the orders m; e_m efficiency of order m
//! f      = (wi + wo)_xy / λ            frequency of the pair of directions, in cycles/µm
//! f_m    = (m/d, 0)                    frequency of order m
//! K(f)   = exp(−|f|²/2σ²)/(2πσ²)       Gaussian of the coherence window, of standard deviation σ
//! ```
//!
//! The code has frequencies in units of 1/d, in which order m has the frequency m. `periods` is d/λ. `inverse_sigma` is
//! 1/(dσ), the reciprocal of the Gaussian's standard deviation in this unit. Gaussians are cut off at `GAUSSIAN_REACH`
//! standard deviations. Efficiencies depend on the incident wave: on its wave number `a` along x, and on `t`, the
//! largest wave number along x that propagates, in units of 2π/d (symbols: `mod.rs`). A *channel* is an order on one
//! side of the relief, and a *row* of the table has the efficiencies from one incident channel to every channel.
//!
//! At a body that transmits, both directions may lie on either side, and `f_r` is the power per solid angle and
//! `|cosθo|` of light from `wi` to `wo`. Efficiencies then depend on the sides of both, too. At a film all directions
//! are in air, so the formulas are the same. Below an interface directions lie in the medium of index n: they enter `f`
//! times n, and `f_r` has the factor n² of the outgoing medium, because a solid angle covers `n²|wo.z|/λ²` of the plane
//! of frequencies for each steradian.
//!
//! The code is generic over `N: Numbers`: an `N::Real` is one number, a SIMD vector or a traced variable, and `lit`
//! makes one of a constant. An `N::Double` is the same in double precision. Masks are true in the lanes that count.
//! Loops have a label, such as `c"orders"`, which names them in traced kernels.

use super::channels::Channels;
use super::efficiencies::EfficiencyView;
use super::layout::EfficiencyLayout;
use super::polarisation::JonesView;
use crate::lobe::{PerWavelength, Sides, UNIFORM_FRACTION};
use crate::numeric::math::{GAUSSIAN_REACH, normal_quantile};
use crate::numeric::{Index, Number, Numbers, Real};
use serde::{Deserialize, Serialize};
use std::array;
use std::f64::consts::{LOG2_E, TAU};

/// Parameters of the lobe, without the table data.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub struct GratingLayout {
    /// Layout of the efficiencies.
    pub efficiencies: EfficiencyLayout,
    /// Period d in µm.
    pub period_um: f64,
    /// Standard deviation σ of an order in cycles/µm.
    pub sigma_per_um: f64,
}

/// The lobe of a [`GratingSurface`](super::GratingSurface) over its table data, for any number of wavelengths
/// (see [`Lobe`](crate::lobe::Lobe)). The material's reflectance is included.
#[derive(Clone, Copy)]
pub struct GratingLobe<'a, N: Numbers> {
    /// Layout of the table, period and order width.
    pub layout: &'a GratingLayout,
    /// Table data of the efficiencies.
    pub words: N::Words,
}

/// One order between two directions, which are moved so that they fulfil its grating equation.
struct OrderAt<'a, N: Numbers> {
    /// Channels at the incident wave.
    channels: &'a Channels<N>,
    /// Channels of incident and outgoing light.
    pair: [N::Index; 2],
    /// Fraction of the unpolarised incident power in the order.
    efficiency: N::Real,
}

/// A lobe of a grating, at wavelengths or in colour.
pub(super) trait MayTransmit {
    /// Whether the body transmits light.
    fn transmits(&self) -> bool;
}

/// Sides of a grating's lobe. Samples come from a mixture of `draw` and uniform directions (`lobe/mixture.rs`). At a
/// body that transmits:
///
/// - `draw` decides on the side and the order at once, and returns the side in the sign of z.
/// - `choose` divides the uniform part, `u[0] < UNIFORM_FRACTION`, equally between the sides.
/// - `probability` is ½, by which callers multiply the density of the whole mixture. It is right for the uniform part.
///   For `draw`, which has probabilities of its own, `density` returns twice the density.
impl<N: Numbers, T: MayTransmit> Sides<N> for T {
    #[inline(always)]
    fn accepts(&self, w: [N::Real; 3]) -> N::Mask {
        N::Real::lit(0.0).lt(if self.transmits() { w[2].abs() } else { w[2] })
    }

    #[inline(always)]
    fn choose(&self, _wi: [N::Real; 3], u: [N::Real; 3]) -> (N::Mask, [N::Real; 3]) {
        let is_below = if self.transmits() { u[0].lt(N::Real::lit(0.5 * UNIFORM_FRACTION)) } else { N::mask(false) };
        (is_below, u)
    }

    #[inline(always)]
    fn probability(&self, _wi: [N::Real; 3], _wo: [N::Real; 3]) -> N::Real {
        N::Real::lit(if self.transmits() { 0.5 } else { 1.0 })
    }
}

impl<N: Numbers> MayTransmit for GratingLobe<'_, N> {
    fn transmits(&self) -> bool {
        self.layout.efficiencies.transmits()
    }
}

impl<N: Numbers> PerWavelength<N> for GratingLobe<'_, N> {
    type Pair = [[N::Real; 3]; 2];

    #[inline(always)]
    fn pair(&self, wi: [N::Real; 3], wo: [N::Real; 3]) -> [[N::Real; 3]; 2] {
        [wi, wo]
    }

    #[inline(always)]
    fn value(&self, &[wi, wo]: &[[N::Real; 3]; 2], nm: N::Real, active: N::Mask) -> N::Real {
        let [value] = self.sum_orders(wi, wo, nm, active, |order, _| [order.efficiency]);
        value
    }

    /// Density of `draw` in 1/sr: the mean of the orders' Gaussians over frequency, weighted by the orders'
    /// efficiencies for light from `wi`. At a body that transmits it is doubled, since callers multiply by the side's
    /// probability ½.
    #[inline(always)]
    fn density(&self, &[wi, wo]: &[[N::Real; 3]; 2], nm: N::Real, active: N::Mask) -> N::Real {
        let zero = N::Real::lit(0.0);
        let (channels, incident, active) = self.incident(wi, nm, active);
        let view = self.view();
        let row = view.row(&channels, incident, nm, active);
        let total = view.row_total(&row, &channels, active);
        let is_below = view.is_below(wo);
        let [weighted] = self.sum_kernels(wi, wo, nm, active, |m, active| {
            // `draw` may select a tabulated order that does not propagate, but whose Gaussian reaches directions that
            // do.
            let (channel, is_tabulated) = channels.tabulated(m, is_below);
            [N::Real::select(is_tabulated, view.entry(&row, channel, active & is_tabulated), zero)]
        });
        // |wo.z| is the Jacobian from direction cosines to solid angles.
        let cos_o = if self.transmits() { wo[2].abs() * N::Real::lit(2.0) } else { wo[2] };
        N::Real::select(active & zero.lt(total), weighted / total * cos_o, zero)
    }

    /// Draws an order by its efficiency, then a direction within the order's Gaussian. The result is the zero vector
    /// where the direction falls below the horizon. At a body that transmits, the order's side is drawn with it, and z
    /// has its sign; the side of `choose` is for the uniform part alone.
    #[inline(always)]
    fn draw(
        &self,
        wi: [N::Real; 3],
        _to_below: N::Mask,
        nm: N::Real,
        u: [N::Real; 3],
        active: N::Mask,
    ) -> [N::Real; 3] {
        let (real, index) = (N::Real::lit, N::Index::lit);
        let (channels, incident, active) = self.incident(wi, nm, active);
        let view = self.view();
        let row = view.row(&channels, incident, nm, active);
        let last = channels.count - index(1);
        let target = u[0] * view.row_total(&row, &channels, active);
        // The first channel at which the running sum exceeds the target; the last one if rounding keeps the sum below.
        let (channel, _) = N::while_loop(
            c"order",
            (index(0), view.entry(&row, index(0), active)),
            |(number, sum)| active & sum.le(target) & number.lt(last),
            |(number, sum)| (number + index(1), sum + view.entry(&row, number + index(1), active)),
        );
        let (m, is_below) = channels.order(channel);
        let wavelength_um = nm * real(1e-3);
        // Standard deviation of the tangential part of the wave vector, divided by the wave number in vacuum.
        let sigma = wavelength_um * real(self.layout.sigma_per_um);
        let [offset_x, offset_y] = [1, 2].map(|i| normal_quantile(u[i]) * sigma);
        // Let ki and ko be the tangential parts of wi and wo, times the indices of their media. Order m leaves at
        // ko = (mλ/d − ki.x, −ki.y).
        let [incident_x, incident_y] = self.layout.efficiencies.tangential::<N>(wi);
        let centre_x = N::narrow(m / self.periods(nm) - incident_x);
        let (x, y) = (centre_x + offset_x, offset_y - N::narrow(incident_y));
        self.layout.efficiencies.direction::<N>([x, y], is_below, active)
    }
}

impl<N: Numbers> GratingLobe<'_, N> {
    /// Mueller matrices in 1/sr, without the cosine, for light from `from` to `to`: `[4·row + column][wavelength]`.
    /// Both directions point away from the surface.
    ///
    /// The first axis of the frame of incident and of outgoing light is the grooves' direction, made transverse to the
    /// light.
    #[inline(always)]
    pub fn matrix<const L: usize>(
        &self,
        jones: &JonesView<N>,
        from: [N::Real; 3],
        to: [N::Real; 3],
        wavelengths_nm: [N::Real; L],
        active: N::Mask,
    ) -> [[N::Real; L]; 16] {
        let active = active & Sides::<N>::accepts(self, from) & Sides::<N>::accepts(self, to);
        let ky_over_k = self.layout.efficiencies.ky_over_k::<N>([from, to]);
        N::map_each(c"wavelengths", wavelengths_nm, active, |nm| {
            self.sum_orders(from, to, nm, active, |order, active| {
                jones
                    .matrix(order.channels, order.pair, nm, ky_over_k, active)
                    .map(|element| element * order.efficiency)
            })
        })
    }

    /// The table of efficiencies.
    #[inline(always)]
    fn view(&self) -> EfficiencyView<N> {
        EfficiencyView { layout: self.layout.efficiencies, words: self.words }
    }

    /// `d/λ` at a wavelength in nm.
    #[inline(always)]
    fn periods(&self, nm: N::Real) -> N::Double {
        N::Double::lit(1e3 * self.layout.period_um) / N::widen(nm)
    }

    /// Channels at the wave incident from `wi`, the index of the channel of this wave, and `active` without waves that
    /// rounding moves beyond the horizon.
    #[inline(always)]
    fn incident(&self, wi: [N::Real; 3], nm: N::Real, active: N::Mask) -> (Channels<N>, N::Index, N::Mask) {
        let [x, y] = self.layout.efficiencies.tangential::<N>(wi);
        let periods = self.periods(nm);
        let view = self.view();
        let channels = view.channels(&view.bounds(periods, -y), -(x * periods), active);
        let (incident, propagates) = channels.of_order(N::Double::lit(0.0), view.is_below(wi));
        (channels, incident, active & propagates)
    }

    /// `n²·Σ_m g_m·K(f − f_m)/λ²` for `R` quantities g at once, with the index n of the medium of `wo`. `quantity`
    /// computes the quantities `g_m` of an order.
    ///
    /// For each order m both directions are moved by half of the difference between f and f_m, so that the moved `wo`
    /// is exactly the direction of the order. Exchanging the directions then gives the reversed path, and `f_r/n²` is
    /// reciprocal.
    #[inline(always)]
    fn sum_orders<const R: usize>(
        &self,
        wi: [N::Real; 3],
        wo: [N::Real; 3],
        nm: N::Real,
        active: N::Mask,
        quantity: impl Fn(OrderAt<'_, N>, N::Mask) -> [N::Real; R],
    ) -> [N::Real; R] {
        let half = N::Double::lit(0.5);
        let periods = self.periods(nm);
        let [[in_x, in_y], [out_x, out_y]] = [wi, wo].map(|w| self.layout.efficiencies.tangential::<N>(w));
        // ky/k with the wave number k in vacuum; in a medium its magnitude can exceed 1.
        let ky_over_k = (out_y - in_y) * half;
        // Sum of the wave numbers of incident and outgoing wave, a + (a + m), which is unchanged by the move.
        let sum_of_a = (out_x - in_x) * periods;
        let view = self.view();
        let bounds = view.bounds(periods, ky_over_k);
        let [from_below, to_below] = [wi, wo].map(|w| view.is_below(w));
        self.sum_kernels(wi, wo, nm, active, |m, active| {
            let channels = view.channels(&bounds, (sum_of_a - m) * half, active);
            let (incident, incident_propagates) = channels.of_order(N::Double::lit(0.0), from_below);
            let (outgoing, outgoing_propagates) = channels.of_order(m, to_below);
            let active = active & incident_propagates & outgoing_propagates;
            let row = view.row(&channels, incident, nm, active);
            let efficiency = view.entry(&row, outgoing, active);
            quantity(OrderAt { channels: &channels, pair: [incident, outgoing], efficiency }, active)
                .map(|value| N::Real::select(active, value, N::Real::lit(0.0)))
        })
    }

    /// `n²·Σ_m g_m·K(f − f_m)/λ²` over the orders whose Gaussians reach the pair of directions, with the index n of the
    /// medium of `wo`. `weights(m, active)` returns the `R` factors `g_m`.
    #[inline(always)]
    fn sum_kernels<const R: usize>(
        &self,
        wi: [N::Real; 3],
        wo: [N::Real; 3],
        nm: N::Real,
        active: N::Mask,
        weights: impl Fn(N::Double, N::Mask) -> [N::Real; R],
    ) -> [N::Real; R] {
        let (real, double) = (N::Real::lit, N::Double::lit);
        let periods = self.periods(nm);
        let inverse_sigma = 1.0 / (self.layout.period_um * self.layout.sigma_per_um);
        let [[in_x, in_y], [out_x, out_y]] = [wi, wo].map(|w| self.layout.efficiencies.tangential::<N>(w));
        let frequency_x = (in_x + out_x) * periods;
        // Distance from the orders along y in standard deviations, equal for all of them.
        let offset_y = N::narrow((in_y + out_y) * periods) * real(inverse_sigma);
        let reach = double(GAUSSIAN_REACH / inverse_sigma);
        let first = (frequency_x - reach).ceil();
        let last = (frequency_x + reach).floor();
        let active = active & offset_y.abs().lt(real(GAUSSIAN_REACH));
        let (_, sums) = N::while_loop(
            c"orders",
            (first, [real(0.0); R]),
            |(m, _)| active & m.le(last),
            |(m, sums)| {
                // Distance along x in standard deviations.
                let offset_x = N::narrow(frequency_x - m) * real(inverse_sigma);
                let gauss_x = gaussian(offset_x);
                let weights = weights(m, active);
                (m + double(1.0), array::from_fn(|i| weights[i].fma(gauss_x, sums[i])))
            },
        );
        let gauss_y = gaussian(offset_y);
        // n/(λσ), so that n²K/λ² has the factor scale²/2π.
        let scale = N::narrow(periods) * real(inverse_sigma);
        let scale = self.layout.efficiencies.index_at::<N>(wo).map_or(scale, |index| scale * index);
        sums.map(|sum| sum * gauss_y * scale * scale * real(1.0 / TAU))
    }
}

/// `exp(−x²/2)`.
#[inline(always)]
fn gaussian<R: Real>(x: R) -> R {
    (x * x * R::lit(-0.5 * LOG2_E)).exp2()
}
