//! Sampler for surfaces of few orders: a loop over every order that may propagate, which means leave above the horizon.
//!
//! Orders are the nodes of the spectral table's lattice of frequencies. Of a relief that repeats they are usually its
//! diffraction orders. On a lattice of the periods `(dx, dy)`, order `j = (jx, jy)` is a Gaussian about its centre:
//!
//! ```text
//! λ, wi                                 wavelength; unit vector to the light, at the angle θi from the normal z
//! f_j = (jx/dx, jy/dy)                  frequency, in cycles/µm
//! o_j = λ f_j − wi_xy                   tangential part of the outgoing centre, which has the angle θ_j
//! κ_j = 2π (cosθi + cosθ_j)/λ           phase rate at the centre, in rad/µm; cos²θ_j = 1 − |o_j|²
//! P_j(κ)                                power of the order
//! W_j = P_j(κ_j) · G_j · V_j            weight
//! G_j = (|λf_j|² + w²)²/(w² cosθ_j)     4 O cosθi for Stam's obliquity factor O, with w = cosθi + cosθ_j; 1/w² at a
//!                                       transparent body; 1 for other obliquity factors
//! V_j                                   approximate fraction of the Gaussian above the horizon
//! ```
//!
//! A sample chooses an order with probability `W_j/ΣW`, then a normally distributed offset from its centre along each
//! axis. The offset has a standard deviation of `sigma`, in multiples of the distance between orders. The powers `P_j`
//! are tabulated over uniform intervals in κ and interpolated linearly. In code, an order's *number* along an axis is
//! jx or jy; its *index*, which counts from 0, is the number plus `origin`.
//!
//! A [`Passage`] holds the incident wave vector, `tangential` and `normal`, and the side on which light leaves. At a
//! transparent body w may vanish, and `divisor_min` is the smallest |w| in the divisor w². It is `None` elsewhere.
//! Lengths of wave vectors are in units of the wave number in the tables' medium: air, a cover (a clear layer over the
//! relief) or a transparent body. Tangential parts of light from or to below the relief are negated, by the sign
//! `turn`.
//!
//! A [`Reading`] holds the wavelength. For a resized relief it also holds another wavelength for κ_j, and a factor by
//! which orders are narrower than `sigma`.
//!
//! `N` is a family of numbers (`src/numeric`): an `N::Real` is one number, a SIMD vector or a traced variable, and
//! `lit` makes a constant.

use super::node_power;
use crate::numeric::math::{GAUSSIAN_REACH, NORMAL_QUANTILE_MAX, bf16_pair, normal_quantile};
use crate::numeric::{Index, Number, Numbers, Real};
use crate::scattering::{Obliquity, Passage, Reading};
use crate::table::{LatticeAxis, NodeCurve, SpectralTable};
use serde::{Deserialize, Serialize};
use std::f64::consts::{LOG2_E, TAU};

/// Smallest number of intervals in κ. Between this bound and [`INTERVALS_MAX`] there are as many intervals as between
/// knots of the spectral table's splines. Chosen: without the bound, the standard deviation of sample weights of the
/// preset `lamellar` rises by 7 %. A larger bound takes more memory.
const INTERVALS_MIN: usize = 32;
/// Largest number of intervals in κ. Chosen to bound the size of the table, to 512 bytes per order. A smaller bound
/// blurs the powers of deep reliefs over κ, which adds variance.
const INTERVALS_MAX: usize = 128;
/// Number of quadrature points (midpoints) per interval at which powers are averaged. Chosen; results hardly depend on
/// it. More points lengthen the build.
const POINTS_PER_INTERVAL: usize = 8;
/// Squared width of the smooth step `V_j` across the horizon. The width is that in cos²θ, divided by the standard
/// deviation of the order in direction cosines.
///
/// `V_j` approximates the integral of the order's Gaussian above the horizon by an algebraic function, which is quick
/// enough to be evaluated for every order. With this round number the error is at most 0.018; with the best width it
/// would be 0.016.
const HORIZON_WIDTH_SQUARED: f64 = 12.0;
/// Smallest cos²θ of an order's centre, divided by the order's standard deviation in direction cosines. It keeps
/// weights of grazing orders finite. Chosen to be typical of the directions above the horizon in an order whose centre
/// lies below it. Larger values give grazing orders too few samples, smaller ones too many.
const COS_SQUARED_MIN: f64 = 0.25;

/// Layout of the table data of [`OrdersView`].
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct OrdersLayout {
    /// Orders along x and y.
    pub axes: [OrdersAxis; 2],
    /// Number of intervals in κ, from 0 to the largest κ. The data are `[order along y][order along x][interval]`, one
    /// 32-bit word each. Its low 16 bits are the power at the interval's lower end, its high 16 bits the power at the
    /// upper end, as bfloat16.
    pub intervals: u32,
    /// Intervals per rad/µm of κ.
    pub intervals_per_kappa: f64,
    /// The obliquity factor in the weights of orders.
    pub obliquity: Obliquity,
    /// Largest direction cosine of outgoing light along the surface ([`Options::reach`](crate::Options::reach)): 1, or
    /// less in a cover, which totally reflects the light beyond. Light at this cosine leaves along the horizon.
    pub reach: f64,
}

/// One axis of the lattice of orders.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct OrdersAxis {
    /// Period along the axis in µm.
    pub period_um: f64,
    /// Index of order 0 among the stored orders.
    pub origin: u32,
    /// Number of stored orders along the axis.
    pub nodes: u32,
    /// Standard deviation of an order's Gaussian, in orders.
    pub sigma: f64,
}

impl OrdersAxis {
    fn new(axis: &LatticeAxis, sigma: f64) -> Self {
        Self { period_um: axis.period_um, origin: axis.reach as u32, nodes: axis.nodes() as u32, sigma }
    }

    /// Upper bound of the number of orders in the loop along this axis, at any incidence.
    pub(super) fn propagating(&self, wavelength_um: f64, reach: f64) -> f64 {
        (2.0 * reach * self.period_um / wavelength_um + 2.0 * GAUSSIAN_REACH * self.sigma + 1.0)
            .min(f64::from(self.nodes))
    }
}

/// The axes x and y of a table's lattice.
pub(super) fn axes(table: &SpectralTable) -> [OrdersAxis; 2] {
    let (lattice, (sx, sy)) = (table.lattice(), table.power_sigma());
    [OrdersAxis::new(&lattice.x, sx), OrdersAxis::new(&lattice.y, sy)]
}

/// Tabulates the powers of a table's orders. Returns the layout and the table data.
pub(super) fn build(table: &SpectralTable, obliquity: Obliquity, reach: f64) -> (OrdersLayout, Vec<u32>) {
    let axes = axes(table);
    let intervals = ((table.kappa_max() / table.kappa_step()).ceil() as usize).clamp(INTERVALS_MIN, INTERVALS_MAX);
    let interval_width = table.kappa_max() / intervals as f64;
    // One curve for the κ of each quadrature point, over all intervals. It evaluates the power of any order.
    let curves: Vec<NodeCurve> = (0..intervals * POINTS_PER_INTERVAL)
        .map(|i| NodeCurve::new(table, (i as f64 + 0.5) / POINTS_PER_INTERVAL as f64 * interval_width))
        .collect();
    let mut words = vec![0u32; intervals * (axes[0].nodes * axes[1].nodes) as usize];
    // `record` holds the spline of an order's power or amplitude over κ.
    for (jx, jy, record) in table.kept_nodes() {
        let f = [jx as f64 / axes[0].period_um, jy as f64 / axes[1].period_um];
        // The power is zero where the relief's pixels do not resolve the frequency.
        if !table.is_resolved(f) {
            continue;
        }
        let powers: Vec<f64> = curves.iter().map(|curve| node_power(table, curve, record)).collect();
        let end_powers: Vec<f64> = (0..=intervals).map(|end| power_at_end(&powers, end)).collect();
        let (x, y) = ((jx + i64::from(axes[0].origin)) as usize, (jy + i64::from(axes[1].origin)) as usize);
        let start = intervals * (y * axes[0].nodes as usize + x);
        for (word, ends) in words[start..].iter_mut().zip(end_powers.windows(2)) {
            // Two bfloat16: the upper halves of single-precision numbers.
            *word = ((ends[0] as f32).to_bits() >> 16) | ((ends[1] as f32).to_bits() & 0xffff_0000);
        }
    }
    let intervals_per_kappa = 1.0 / interval_width;
    (OrdersLayout { axes, intervals: intervals as u32, intervals_per_kappa, obliquity, reach }, words)
}

/// Power of an order at the end of an interval, from its powers at the quadrature points of all intervals. `end` counts
/// from 0, the lower end of the first interval. The power is a mean, weighted by a tent that falls to zero one interval
/// away on either side.
///
/// Powers too small to change the sum over all orders, which is near 1, become 0: subnormal numbers would slow
/// processors down.
fn power_at_end(powers: &[f64], end: usize) -> f64 {
    let (mut sum, mut weights) = (0.0, 0.0);
    let middle = end * POINTS_PER_INTERVAL;
    let first = middle.saturating_sub(POINTS_PER_INTERVAL);
    for (i, power) in powers.iter().enumerate().take(middle + POINTS_PER_INTERVAL).skip(first) {
        let weight = 1.0 - ((i as f64 + 0.5 - middle as f64) / POINTS_PER_INTERVAL as f64).abs();
        sum += weight * power;
        weights += weight;
    }
    let mean = sum / weights;
    if mean > f64::EPSILON { mean } else { 0.0 }
}

/// The sampler over the orders, for one family of numbers.
#[derive(Clone, Copy)]
pub(super) struct OrdersView<N: Numbers> {
    pub layout: OrdersLayout,
    /// Table data, in the layout's order.
    pub words: N::Words,
}

/// Quantities of an incidence and a wavelength that all orders share, and the range of the loop over the orders.
#[derive(Clone, Copy)]
struct Incidence<N: Numbers> {
    /// The incident wave vector, and the side on which light leaves.
    passage: Passage<N>,
    /// Phase rate κ per unit of w, in rad/µm.
    kappa_per_w: N::Real,
    /// Spacing of orders in direction cosines along x and y, `λ/d`.
    spacing: [N::Real; 2],
    /// [`HORIZON_WIDTH_SQUARED`] times the variance of an order in direction cosines, along the axis of wider orders.
    width_squared: N::Real,
    /// [`COS_SQUARED_MIN`] times the standard deviation of an order in direction cosines, along the same axis.
    cos_squared_min: N::Real,
    /// Indices of the first orders of the loop along x and y.
    low: [N::Index; 2],
    /// Indices after the last orders of the loop along x and y.
    high: [N::Index; 2],
}

/// Position along an axis, in multiples of the distance between orders from order 0. It has two parts, so that
/// distances from orders keep full precision.
#[derive(Clone, Copy)]
struct Position<N: Numbers> {
    /// Largest whole number that is at most the position.
    whole: N::Real,
    /// The rest, in [0, 1).
    fraction: N::Real,
}

impl<N: Numbers> OrdersView<N> {
    /// Density of [`OrdersView::draw`] over the plane of tangential wave vectors; zero where `active` is false.
    /// `outgoing` is a tangential outgoing wave vector as `draw` returns it.
    #[inline(always)]
    pub(super) fn density(
        &self,
        passage: &Passage<N>,
        outgoing: [N::Double; 2],
        reading: &Reading<N>,
        active: N::Mask,
    ) -> N::Real {
        let lit = N::Real::lit;
        let incidence = self.incidence(passage, reading);
        let position = self.position(passage, outgoing, reading);
        // ΣW over all orders. The text names the loop in the kernels of traced variables (`src/numeric`).
        let (_, total) = N::while_loop(
            c"Sum over orders",
            (incidence.low, lit(0.0)),
            |(j, _)| incidence.has(j, active),
            |(j, total)| {
                (incidence.next(j), total + self.weight(&incidence, j, self.number(j), incidence.has(j, active)))
            },
        );
        // ΣW·Gaussian over the orders near the position.
        let near = incidence.near(&self.layout.axes, position);
        let (_, density) = N::while_loop(
            c"Density of orders",
            (near.low, lit(0.0)),
            |(j, _)| near.has(j, active),
            |(j, density)| {
                let number = self.number(j);
                let weight = self.weight(&near, j, number, near.has(j, active));
                let gaussian = self.gaussian(position, number, reading);
                (near.next(j), weight.fma(gaussian, density))
            },
        );
        // Peak of a normalised Gaussian per area of direction cosines: dx·dy/(2π·σx·σy·λ²), with σ in orders. Where a
        // resized relief narrows σ by a factor, `divisor_um2` includes it.
        let [x, y] = &self.layout.axes;
        let norm = x.period_um * y.period_um / (TAU * x.sigma * y.sigma);
        let peak = lit(norm) / reading.divisor_um2();
        let has_weight = lit(0.0).lt(total) & active;
        let divisor = N::Real::select(has_weight, total, lit(1.0));
        N::Real::select(has_weight, peak * density / divisor, lit(0.0))
    }

    /// Draws the tangential part of an outgoing wave vector, times [`Passage::turn`]. `u` and `v` are random numbers
    /// in [0, 1). The mask is false where no order has a weight, and where `active` is false.
    #[inline(always)]
    pub(super) fn draw(
        &self,
        passage: &Passage<N>,
        reading: &Reading<N>,
        [u, v]: [N::Real; 2],
        active: N::Mask,
    ) -> ([N::Real; 2], N::Mask) {
        let lit = N::Real::lit;
        let incidence = self.incidence(passage, reading);
        // Reservoir sampling in one pass: order j replaces the earlier choice with probability W_j/(W_first + … + W_j),
        // and the random number is rescaled to [0, 1) after each decision. The state is the indices of the next order,
        // those of the choice, the sum of weights, and the random number.
        let start = (incidence.low, incidence.low, [lit(0.0), u]);
        let (_, chosen, [total, u]) = N::while_loop(
            c"Choice of an order",
            start,
            |(j, _, _)| incidence.has(j, active),
            |(j, chosen, [total, u])| {
                let weight = self.weight(&incidence, j, self.number(j), incidence.has(j, active));
                let sum = total + weight;
                let target = u * sum;
                let is_taken = target.lt(weight);
                // Taken: u becomes target/weight. Kept: u becomes (target − weight)/total = u − (1 − u)·weight/total.
                // In this form an order of small weight changes u little, and rounding errors do not add up.
                let divisor = N::Real::select(is_taken, weight, total);
                let dividend = N::Real::select(is_taken, target, (lit(1.0) - u) * weight);
                let quotient = dividend / N::Real::select(lit(0.0).lt(divisor), divisor, lit(1.0));
                let u = N::Real::select(is_taken, quotient, u - quotient).clip(lit(0.0), lit(super::BELOW_ONE));
                let chosen = [0, 1].map(|i| N::Index::select(is_taken, j[i], chosen[i]));
                (incidence.next(j), chosen, [sum, u])
            },
        );
        let has_weight = lit(0.0).lt(total) & active;
        let (number, u) = (self.number(chosen), [u, v]);
        let nm = N::widen(reading.wavelength_nm);
        let outgoing = [0, 1].map(|i| {
            let axis = &self.layout.axes[i];
            let offset = normal_quantile(u[i]) * reading.narrowed(lit(axis.sigma));
            // The sampled frequency in cycles/nm.
            let f = (N::widen(number[i]) + N::widen(offset)) * N::Double::lit(1e-3 / axis.period_um);
            N::narrow(f.fma(nm, -N::widen(passage.tangential[i])))
        });
        (outgoing, has_weight)
    }

    /// Prepares the loop over the orders whose centres lie in the square of half side `reach` about the incident
    /// tangential vector, widened by [`GAUSSIAN_REACH`].
    #[inline(always)]
    fn incidence(&self, passage: &Passage<N>, reading: &Reading<N>) -> Incidence<N> {
        let lit = N::Real::lit;
        let [x, y] = &self.layout.axes;
        let wavenumber = lit(1e3) / reading.wavelength_nm;
        let wavelength_um = reading.wavelength_nm * lit(1e-3);
        // First index at or after the order that leaves at the direction cosine ±reach (`side` is −1 or 1), moved
        // outwards by GAUSSIAN_REACH standard deviations.
        let edge = |i: usize, side: f64| {
            let axis = &self.layout.axes[i];
            let offset = lit(f64::from(axis.origin) + side * GAUSSIAN_REACH * axis.sigma);
            let position =
                (passage.reach.fma(lit(side), passage.tangential[i]) * wavenumber).fma(lit(axis.period_um), offset);
            position.ceil().clip(lit(0.0), lit(f64::from(axis.nodes)))
        };
        let low = [0, 1].map(|i| edge(i, -1.0));
        let high = [0, 1].map(|i| edge(i, 1.0));
        // The loop ends after the last row. Where there is no column, the range of rows is made empty, too.
        let has_orders = low[0].lt(high[0]) & low[1].lt(high[1]);
        let high = [high[0], N::Real::select(has_orders, high[1], low[1])];
        let sigma = reading.narrowed(wavelength_um) * lit((x.sigma / x.period_um).max(y.sigma / y.period_um));
        Incidence {
            passage: *passage,
            kappa_per_w: lit(TAU * 1e3) / reading.for_kappa_nm(),
            spacing: [wavelength_um * lit(1.0 / x.period_um), wavelength_um * lit(1.0 / y.period_um)],
            width_squared: lit(HORIZON_WIDTH_SQUARED) * sigma * sigma,
            cos_squared_min: lit(COS_SQUARED_MIN) * sigma,
            low: low.map(N::index),
            high: high.map(N::index),
        }
    }

    /// Position along x and y of the frequency that belongs to a tangential outgoing wave vector.
    #[inline(always)]
    fn position(&self, passage: &Passage<N>, outgoing: [N::Double; 2], reading: &Reading<N>) -> [Position<N>; 2] {
        let nm = N::widen(reading.wavelength_nm);
        [0, 1].map(|i| {
            let axis = &self.layout.axes[i];
            let f = (N::widen(passage.tangential[i]) + outgoing[i]) / nm;
            let position = f * N::Double::lit(1e3 * axis.period_um);
            let whole = position.floor();
            Position { whole: N::narrow(whole), fraction: N::narrow(position - whole) }
        })
    }

    /// Gaussian of the order with the numbers `number` at a position; 1 at the order's centre.
    #[inline(always)]
    fn gaussian(&self, position: [Position<N>; 2], number: [N::Real; 2], reading: &Reading<N>) -> N::Real {
        let lit = N::Real::lit;
        let squared = [0, 1].map(|i| {
            let Position { whole, fraction } = position[i];
            let distance = (whole - number[i]) + fraction;
            // Distance in standard deviations. A resized relief may multiply the standard deviations by a factor.
            let t = match reading.order_width_factor {
                None => distance * lit(1.0 / self.layout.axes[i].sigma),
                Some(factor) => distance / (factor * lit(self.layout.axes[i].sigma)),
            };
            t * t
        });
        ((squared[0] + squared[1]) * lit(-0.5 * LOG2_E)).exp2()
    }

    /// Numbers `(jx, jy)` of an order from its indices.
    #[inline(always)]
    fn number(&self, j: [N::Index; 2]) -> [N::Real; 2] {
        [0, 1].map(|i| N::real(j[i]) - N::Real::lit(f64::from(self.layout.axes[i].origin)))
    }

    /// Weight `W_j` of the order with indices `j` and numbers `number`. Meaningless where `active` is false.
    #[inline(always)]
    fn weight(&self, incidence: &Incidence<N>, j: [N::Index; 2], number: [N::Real; 2], active: N::Mask) -> N::Real {
        let lit = N::Real::lit;
        let passage = &incidence.passage;
        // λ f_j, and the direction cosines of the centre.
        let [qx, qy] = [0, 1].map(|i| number[i] * incidence.spacing[i]);
        let (x, y) = (qx - passage.tangential[0], qy - passage.tangential[1]);
        // s = reach² − sin²θ of the centre, negative below the horizon; cos²θ if the reach is 1.
        let sin_squared = x * x + y * y;
        let s = passage.reach * passage.reach - sin_squared;
        let visible = visible_fraction(s, incidence.width_squared);
        // Outgoing normal component, from the squared length of outgoing wave vectors (1 in the tables' medium).
        let cos_o = (passage.outgoing_squared - sin_squared).max(incidence.cos_squared_min).sqrt();
        let w = passage.normal + cos_o;
        // In transmission through a body `normal` is negative, so w may vanish.
        let w = passage.divisor_min.map_or(w, |least| w.abs().max(lit(least)));
        // κ_j in intervals.
        let position = w * incidence.kappa_per_w * lit(self.layout.intervals_per_kappa);
        let interval = position.floor().clip(lit(0.0), lit(f64::from(self.layout.intervals) - 1.0));
        let order = j[1] * N::Index::lit(self.layout.axes[0].nodes) + j[0];
        let index = order * N::Index::lit(self.layout.intervals) + N::index(interval);
        let [word] = N::gather::<1>(self.words, index, active);
        let [low, high] = bf16_pair::<N>(word);
        let t = (position - interval).clip(lit(0.0), lit(1.0));
        let visible_power = (high - low).fma(t, low) * visible;
        // A transparent body has 1/w² in place of the obliquity factor.
        if passage.divisor_min.is_some() {
            return visible_power / (w * w);
        }
        match self.layout.obliquity {
            Obliquity::Unit | Obliquity::SmallSlope => visible_power,
            Obliquity::Stam => {
                let w_squared = w * w;
                let q_squared = qx * qx + qy * qy + w_squared;
                visible_power * q_squared * q_squared / (w_squared * cos_o)
            }
        }
    }
}

impl<N: Numbers> Incidence<N> {
    /// The loop over those orders alone whose samples may reach a position along x and y.
    #[inline(always)]
    fn near(&self, axes: &[OrdersAxis; 2], position: [Position<N>; 2]) -> Self {
        let lit = N::Real::lit;
        // First index at or after the position plus `offset` orders.
        let edge = |i: usize, offset: f64| {
            let Position { whole, fraction } = position[i];
            let first = whole + (fraction + lit(offset)).ceil() + lit(f64::from(axes[i].origin));
            N::index(first.clip(lit(0.0), lit(f64::from(axes[i].nodes))))
        };
        // Orders of a resized relief may be narrower than `sigma`; samples then lie well within these bounds.
        let low = [0, 1].map(|i| self.low[i].max(edge(i, -NORMAL_QUANTILE_MAX * axes[i].sigma)));
        let high = [0, 1].map(|i| self.high[i].min(edge(i, NORMAL_QUANTILE_MAX * axes[i].sigma)));
        // Where there is no column, the range of rows is made empty, too.
        let high = [high[0], N::Index::select(low[0].lt(high[0]), high[1], low[1])];
        Self { low, high, ..*self }
    }

    /// Whether the indices are those of an order within the loop: [`Incidence::next`] goes on to the row after the
    /// last.
    #[inline(always)]
    fn has(&self, j: [N::Index; 2], active: N::Mask) -> N::Mask {
        j[1].lt(self.high[1]) & active
    }

    /// Indices of the next order, row by row.
    #[inline(always)]
    fn next(&self, [x, y]: [N::Index; 2]) -> [N::Index; 2] {
        let one = N::Index::lit(1);
        let is_in_row = (x + one).lt(self.high[0]);
        [N::Index::select(is_in_row, x + one, self.low[0]), N::Index::select(is_in_row, y, y + one)]
    }
}

/// The fraction `V_j` of a Gaussian above the horizon: a smooth step from 0 at negative `s` to 1 at positive `s`, with
/// the squared width `r`. `s` is the squared reach minus sin²θ of the centre.
///
/// The step is `a²·(3 − 2a)` with `a = (1 + s/√(s² + r))/2`. The smaller of a and 1 − a is computed as
/// `(r/2)/(√(s² + r)·(√(s² + r) + |s|))`, without a difference of nearly equal numbers.
#[inline(always)]
fn visible_fraction<R: Real>(s: R, r: R) -> R {
    let lit = R::lit;
    let root = s.fma(s, r).sqrt();
    let smaller = lit(0.5) * r / (root * (root + s.abs()));
    let a = R::select(lit(0.0).lt(s), lit(1.0) - smaller, smaller);
    a * a * (lit(3.0) - a - a)
}
