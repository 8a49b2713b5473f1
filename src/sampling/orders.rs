//! Sampler order by order, for surfaces of few orders (symbols: `mod.rs`).
//!
//! ```text
//! W_j = P_j(κ_j)·O·cosθi·A_j                             weight of order j = (jx, jy), at the direction of its centre
//! pdf = cosθo · Σ_j W_j K(f − f_j) / (λ² · Σ_j W_j)
//! ```
//!
//! `P_j` is the order's power, `A_j` the fraction of its Gaussian K above the horizon, and `f_j` its frequency. A sample
//! chooses an order by weight and then a point of its Gaussian. Both go through all orders that may propagate.

use super::{BELOW_ONE, direction_above};
use crate::numeric::math::{bf16_pair, normal_quantile};
use crate::numeric::{Index, Number, Numbers, Real};
use crate::scattering::Obliquity;
use crate::table::{LatticeAxis, NodeCurve, NodeQuantity, SpectralTable};
use serde::{Deserialize, Serialize};
use std::f64::consts::{LOG2_E, TAU};

/// Least number of intervals in κ between which powers are linear.
const INTERVALS_MIN: usize = 32;
/// Most intervals in κ: half a kilobyte an order.
const INTERVALS_MAX: usize = 128;
/// Points of an interval at which its powers are read.
const POINTS_PER_INTERVAL: usize = 8;
/// Standard deviations beyond the horizon up to which orders are drawn. At 2 instead of 5, weights reach 8000.
const REACH: f64 = 5.0;
/// Square of the width of an order's transition through the horizon, in cos²θ, over the variance of the order. The
/// transition is algebraic, since it is evaluated for every order.
const TRANSITION: f64 = 12.0;
/// Least cos²θ of an order's visible part, in standard deviations of the order: that of an order which straddles the
/// horizon.
const COS_SQUARED_MIN: f64 = 0.25;
/// Least outgoing cosine that Stam's factor is divided by.
const COS_MIN: f64 = 1e-4;
/// Least power of an order that is drawn. Chosen: far above subnormal numbers, which slow processors down.
const POWER_MIN: f64 = 1e-15;
/// Standard deviations around an order within which its samples lie: [`normal_quantile`] ends at 5.4.
const NEAR: f64 = 5.5;

/// Layout of the powers of orders.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct OrdersLayout {
    /// The lattice along x and y.
    pub axes: [OrdersAxis; 2],
    /// Number of intervals in κ. The data are `[order along y][order along x][interval]`, a word each: the powers at
    /// both ends of the interval, lower end in the lower half, as the upper 16 bits of single-precision numbers.
    pub intervals: u32,
    /// Intervals per rad/µm of κ.
    pub intervals_per_kappa: f64,
    /// Obliquity factor of the weights.
    pub obliquity: Obliquity,
}

/// One axis of the lattice of orders.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct OrdersAxis {
    /// Period along the axis in µm.
    pub period_um: f64,
    /// Index of order 0.
    pub origin: u32,
    /// Number of orders along the axis.
    pub nodes: u32,
    /// Standard deviation of an order's Gaussian, in orders.
    pub sigma: f64,
}

impl OrdersAxis {
    fn new(axis: &LatticeAxis, sigma: f64) -> Self {
        Self { period_um: axis.period_um, origin: axis.reach as u32, nodes: axis.nodes() as u32, sigma }
    }

    /// Largest number of orders that a query at a wavelength visits.
    pub(super) fn propagating(&self, wavelength_um: f64) -> f64 {
        (2.0 * self.period_um / wavelength_um + 2.0 * REACH * self.sigma + 1.0).min(f64::from(self.nodes))
    }
}

/// Both axes of a table's lattice.
pub(super) fn axes(table: &SpectralTable) -> [OrdersAxis; 2] {
    let (lattice, (sx, sy)) = (table.lattice(), table.power_sigma());
    [OrdersAxis::new(&lattice.x, sx), OrdersAxis::new(&lattice.y, sy)]
}

/// Builds layout and data from a table.
pub(super) fn build(table: &SpectralTable, obliquity: Obliquity) -> (OrdersLayout, Vec<u32>) {
    let axes = axes(table);
    let intervals = ((table.kappa_max() / table.kappa_step()).ceil() as usize).clamp(INTERVALS_MIN, INTERVALS_MAX);
    let step = table.kappa_max() / intervals as f64;
    let points = POINTS_PER_INTERVAL;
    let curves: Vec<NodeCurve> =
        (0..intervals * points).map(|i| NodeCurve::new(table, (i as f64 + 0.5) / points as f64 * step)).collect();
    let mut words = vec![0u32; intervals * (axes[0].nodes * axes[1].nodes) as usize];
    for (jx, jy, record) in table.kept_nodes() {
        let f = [jx as f64 / axes[0].period_um, jy as f64 / axes[1].period_um];
        if !table.is_resolved(f) {
            continue;
        }
        let power = |curve: &NodeCurve| match table.quantity() {
            NodeQuantity::Power => curve.power(record).max(0.0),
            NodeQuantity::Amplitude => curve.amplitude(record).norm_sqr(),
        };
        let powers: Vec<f64> = curves.iter().map(power).collect();
        // The power at an end of an interval is a mean with tent weights over the intervals on both sides.
        let ends: Vec<f64> = (0..=intervals)
            .map(|end| {
                let (mut sum, mut weights) = (0.0, 0.0);
                let middle = end * points;
                for (i, power) in powers.iter().enumerate().take(middle + points).skip(middle.saturating_sub(points)) {
                    let weight = 1.0 - ((i as f64 + 0.5 - middle as f64) / points as f64).abs();
                    sum += weight * power;
                    weights += weight;
                }
                let mean = sum / weights;
                if mean > POWER_MIN { mean } else { 0.0 }
            })
            .collect();
        let (x, y) = ((jx + i64::from(axes[0].origin)) as usize, (jy + i64::from(axes[1].origin)) as usize);
        let start = intervals * (y * axes[0].nodes as usize + x);
        for (word, ends) in words[start..].iter_mut().zip(ends.windows(2)) {
            *word = (ends[0] as f32).to_bits() >> 16 | (ends[1] as f32).to_bits() & 0xffff_0000;
        }
    }
    let intervals_per_kappa = 1.0 / step;
    (OrdersLayout { axes, intervals: intervals as u32, intervals_per_kappa, obliquity }, words)
}

/// The sampler over one family of numbers.
#[derive(Clone, Copy)]
pub(super) struct OrdersView<N: Numbers> {
    pub layout: OrdersLayout,
    pub words: N::Words,
}

/// Quantities of an incidence and wavelength that all orders share, and the range of orders to visit.
#[derive(Clone, Copy)]
struct Incidence<N: Numbers> {
    wi: [N::Real; 3],
    /// 1/λ in 1/µm.
    wavenumber: N::Real,
    /// Direction cosines per order, along x and y.
    step: [N::Real; 2],
    /// [`TRANSITION`] times the variance of an order in direction cosines.
    transition: N::Real,
    /// [`COS_SQUARED_MIN`] times the standard deviation of an order in direction cosines.
    cos_squared_min: N::Real,
    /// Indices of the first orders along x and y.
    low: [N::Index; 2],
    /// Indices after the last orders along x and y.
    high: [N::Index; 2],
}

impl<N: Numbers> OrdersView<N> {
    /// See [`super::SamplerView::pdf`].
    #[inline(always)]
    pub(super) fn pdf(&self, wi: [N::Real; 3], wo: [N::Real; 3], wavelength_nm: N::Real, active: N::Mask) -> N::Real {
        let lit = N::Real::lit;
        let incidence = self.incidence(wi, wavelength_nm);
        let nm = N::widen(wavelength_nm);
        // Frequency of the pair in orders, as integer and fractional part: single precision then resolves the distance
        // from an order of any index.
        let frequency = [0, 1].map(|i| {
            let axis = &self.layout.axes[i];
            let f = (N::widen(wi[i]) + N::widen(wo[i])) / nm;
            let orders = f * N::Double::lit(1e3 * axis.period_um);
            let whole = orders.floor();
            (N::narrow(whole), N::narrow(orders - whole))
        });
        let (_, total) = N::while_loop(
            c"Sum over orders",
            (incidence.low, lit(0.0)),
            |(j, _)| incidence.has(j, active),
            |(j, total)| {
                let weight = self.weight(&incidence, j, self.order(j), incidence.has(j, active));
                (incidence.next(j), total + weight)
            },
        );
        let near = incidence.near(&self.layout.axes, frequency);
        let (_, sum) = N::while_loop(
            c"Density of orders",
            (near.low, lit(0.0)),
            |(j, _)| near.has(j, active),
            |(j, sum)| {
                let order = self.order(j);
                let weight = self.weight(&near, j, order, near.has(j, active));
                let squared = [0, 1].map(|i| {
                    let (whole, fraction) = frequency[i];
                    let t = ((whole - order[i]) + fraction) * lit(1.0 / self.layout.axes[i].sigma);
                    t * t
                });
                let exponent = (squared[0] + squared[1]) * lit(-0.5 * LOG2_E);
                (near.next(j), weight.fma(exponent.exp2(), sum))
            },
        );
        let [x, y] = &self.layout.axes;
        let norm = 1e6 * x.period_um * y.period_um / (TAU * x.sigma * y.sigma);
        let is_lit = lit(0.0).lt(total) & active;
        let per_area = lit(norm) / (wavelength_nm * wavelength_nm);
        N::Real::select(is_lit, wo[2] * per_area * sum / N::Real::select(is_lit, total, lit(1.0)), lit(0.0))
    }

    /// See [`super::SamplerView::sample`].
    #[inline(always)]
    pub(super) fn sample(
        &self,
        wi: [N::Real; 3],
        wavelength_nm: N::Real,
        [u, v]: [N::Real; 2],
        active: N::Mask,
    ) -> [N::Real; 3] {
        let lit = N::Real::lit;
        let incidence = self.incidence(wi, wavelength_nm);
        // Reservoir sampling in one pass: each order replaces the chosen one with the probability of its weight over
        // the sum so far. The random number is rescaled to [0, 1) after each decision.
        let start = (incidence.low, incidence.low, [lit(0.0), u]);
        let (_, chosen, [total, u]) = N::while_loop(
            c"Choice of an order",
            start,
            |(j, _, _)| incidence.has(j, active),
            |(j, chosen, [total, u])| {
                let weight = self.weight(&incidence, j, self.order(j), incidence.has(j, active));
                let sum = total + weight;
                let target = u * sum;
                let is_taken = target.lt(weight);
                // The difference to the old number is computed, so that orders of little weight add little rounding.
                let divisor = N::Real::select(is_taken, weight, total);
                let dividend = N::Real::select(is_taken, target, (lit(1.0) - u) * weight);
                let quotient = dividend / N::Real::select(lit(0.0).lt(divisor), divisor, lit(1.0));
                let u = N::Real::select(is_taken, quotient, u - quotient).clip(lit(0.0), lit(BELOW_ONE));
                let chosen = [0, 1].map(|i| N::Index::select(is_taken, j[i], chosen[i]));
                (incidence.next(j), chosen, [sum, u])
            },
        );
        let is_lit = lit(0.0).lt(total) & active;
        let (order, u) = (self.order(chosen), [u, v]);
        let nm = N::widen(wavelength_nm);
        let cosines = [0, 1].map(|i| {
            let axis = &self.layout.axes[i];
            let offset = normal_quantile(u[i]) * lit(axis.sigma);
            let frequency = (N::widen(order[i]) + N::widen(offset)) * N::Double::lit(1e-3 / axis.period_um);
            N::narrow(frequency.fma(nm, -N::widen(wi[i])))
        });
        direction_above::<N>(cosines, is_lit)
    }

    /// Prepares an incidence and wavelength.
    #[inline(always)]
    fn incidence(&self, wi: [N::Real; 3], wavelength_nm: N::Real) -> Incidence<N> {
        let lit = N::Real::lit;
        let [x, y] = &self.layout.axes;
        let wavenumber = lit(1e3) / wavelength_nm;
        let um = wavelength_nm * lit(1e-3);
        // Index of the first order from the frequency `(wi + cosine)/λ` on, and `sigmas` standard deviations.
        let edge = |i: usize, cosine: f64, sigmas: f64| {
            let axis = &self.layout.axes[i];
            let index = ((wi[i] + lit(cosine)) * wavenumber)
                .fma(lit(axis.period_um), lit(f64::from(axis.origin) + sigmas * axis.sigma));
            index.ceil().clip(lit(0.0), lit(f64::from(axis.nodes)))
        };
        let low = [0, 1].map(|i| edge(i, -1.0, -REACH));
        let high = [0, 1].map(|i| edge(i, 1.0, REACH));
        // An empty range along either axis empties both.
        let has_any = low[0].lt(high[0]) & low[1].lt(high[1]);
        let high = [high[0], N::Real::select(has_any, high[1], low[1])];
        let sigma = um * lit((x.sigma / x.period_um).max(y.sigma / y.period_um));
        Incidence {
            wi,
            wavenumber,
            step: [um * lit(1.0 / x.period_um), um * lit(1.0 / y.period_um)],
            transition: lit(TRANSITION) * sigma * sigma,
            cos_squared_min: lit(COS_SQUARED_MIN) * sigma,
            low: low.map(N::index),
            high: high.map(N::index),
        }
    }

    /// Order along x and y, from its indices.
    #[inline(always)]
    fn order(&self, j: [N::Index; 2]) -> [N::Real; 2] {
        [0, 1].map(|i| N::real(j[i]) - N::Real::lit(f64::from(self.layout.axes[i].origin)))
    }

    /// Weight of an order with the indices `j`; not normalised.
    #[inline(always)]
    fn weight(&self, at: &Incidence<N>, j: [N::Index; 2], order: [N::Real; 2], active: N::Mask) -> N::Real {
        let lit = N::Real::lit;
        let [u, v] = [0, 1].map(|i| order[i] * at.step[i]);
        let (x, y) = (u - at.wi[0], v - at.wi[1]);
        // cos²θo of the order's centre, negative beyond the horizon.
        let cos_squared = lit(1.0) - x * x - y * y;
        // Fraction above the horizon: (1 + s/√(s² + r))/2 for s = cos²θ and r the transition, made steeper by a
        // smoothstep. The smaller of the fractions above and below is computed without cancellation.
        let root = cos_squared.fma(cos_squared, at.transition).sqrt();
        let smaller = lit(0.5) * at.transition / (root * (root + cos_squared.abs()));
        let fraction = N::Real::select(lit(0.0).lt(cos_squared), lit(1.0) - smaller, smaller);
        let visible = fraction * fraction * (lit(3.0) - fraction - fraction);
        let cos_o = cos_squared.max(at.cos_squared_min).sqrt();
        let w = at.wi[2] + cos_o;
        let kappa = w * at.wavenumber * lit(TAU * self.layout.intervals_per_kappa);
        let interval = kappa.floor().clip(lit(0.0), lit(f64::from(self.layout.intervals) - 1.0));
        let row = j[1] * N::Index::lit(self.layout.axes[0].nodes) + j[0];
        let index = row * N::Index::lit(self.layout.intervals) + N::index(interval);
        let [word] = N::gather::<1>(self.words, index, active);
        let [low, high] = bf16_pair::<N>(word);
        let t = (kappa - interval).clip(lit(0.0), lit(1.0));
        let power = (high - low).fma(t, low) * visible;
        match self.layout.obliquity {
            Obliquity::Unit | Obliquity::SmallSlope => power,
            Obliquity::Stam => {
                let w_squared = w * w;
                let q_squared = u * u + v * v + w_squared;
                power * q_squared * q_squared / (w_squared * cos_o.max(lit(COS_MIN)))
            }
        }
    }
}

impl<N: Numbers> Incidence<N> {
    /// The incidence with its range cut to the orders whose Gaussians reach a frequency, given in orders as integer and
    /// fractional part along x and y.
    #[inline(always)]
    fn near(&self, axes: &[OrdersAxis; 2], frequency: [(N::Real, N::Real); 2]) -> Self {
        let lit = N::Real::lit;
        let edge = |i: usize, distance: f64| {
            let (whole, fraction) = frequency[i];
            let index = whole + (fraction + lit(distance)).ceil() + lit(f64::from(axes[i].origin));
            N::index(index.clip(lit(0.0), lit(f64::from(axes[i].nodes))))
        };
        let low = [0, 1].map(|i| self.low[i].max(edge(i, -NEAR * axes[i].sigma)));
        let high = [0, 1].map(|i| self.high[i].min(edge(i, NEAR * axes[i].sigma)));
        let high = [high[0], N::Index::select(low[0].lt(high[0]), high[1], low[1])];
        Self { low, high, ..*self }
    }

    /// Whether the range has the order with the indices `j`, in the sequence of [`Incidence::next`].
    #[inline(always)]
    fn has(&self, j: [N::Index; 2], active: N::Mask) -> N::Mask {
        j[1].lt(self.high[1]) & active
    }

    /// Indices of the next order, row by row.
    #[inline(always)]
    fn next(&self, [x, y]: [N::Index; 2]) -> [N::Index; 2] {
        let one = N::Index::lit(1);
        let is_within_row = (x + one).lt(self.high[0]);
        [N::Index::select(is_within_row, x + one, self.low[0]), N::Index::select(is_within_row, y, y + one)]
    }
}
