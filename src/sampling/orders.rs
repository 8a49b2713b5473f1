//! Sampler of few orders: an order by its power, then a direction by the order's Gaussian.
//!
//! ```text
//! w_j = P_j(κ_j)·O·cosθi·above_j      weight of the order j = (jx, jy), at the direction of its centre
//! pdf = cosθo·Σ_j w_j K(f − f_j) / (λ²·Σ_j w_j)
//! ```
//!
//! `P_j(κ)` is the order's power, `f_j = (jx/Lx, jy/Ly)` its frequency, `K` its Gaussian, and `above_j` the part of the
//! Gaussian above the horizon. The density and a sample each loop over all orders that may propagate.

use crate::numeric::math::{bf16_pair, normal_quantile};
use crate::numeric::{Index, Number, Numbers, Real};
use crate::scattering::Obliquity;
use crate::table::{LatticeAxis, NodeCurve, NodeQuantity, SpectralTable};
use serde::{Deserialize, Serialize};
use std::f64::consts::{LOG2_E, TAU};

/// Least and greatest number of intervals in κ; powers are linearly interpolated within one.
const INTERVALS: (usize, usize) = (32, 128);
/// Samples of κ per interval from which the ends' mean powers are taken.
const POINTS: usize = 8;
/// Distance beyond the horizon up to which orders are included, in standard deviations. At two, weights reach 8000.
const REACH: f64 = 5.0;
/// Squared width, in cos²θ over the order's standard deviation, of the smooth step at the horizon. The step is
/// algebraic instead of Gaussian, because it is evaluated for every order.
const ROUNDING: f64 = 12.0;
/// cos²θ assumed for an order whose centre lies below the horizon, in standard deviations of the order.
const HEIGHT: f64 = 0.25;
/// Smallest cosine that Stam's factor is divided by.
const COS_MIN: f64 = 1e-4;
/// Power below which an order counts as zero. Denormal numbers would slow the loops down.
const POWER_MIN: f64 = 1e-15;
/// Radius in standard deviations within which an order is drawn; [`normal_quantile`] ends at 5.4.
const NEAR: f64 = 5.5;

/// Layout of the orders' powers.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct OrdersLayout {
    /// Orders along x and y.
    pub axes: [OrdersAxis; 2],
    /// Number of intervals in κ. A word holds the powers at both ends of an interval as 16-bit floats (bfloat16), the
    /// lower end in the lower half: `[order along y][order along x][interval]`.
    pub intervals: u32,
    /// Intervals per rad/µm of κ.
    pub intervals_per_kappa: f64,
    /// Obliquity factor in the weights.
    pub obliquity: Obliquity,
}

/// One axis of the lattice of orders.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct OrdersAxis {
    /// The period along the axis, in µm.
    pub period_um: f64,
    /// Index of order 0, counted from the first order.
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

    /// Largest number of orders that a loop visits at a wavelength.
    pub(super) fn propagating(&self, wavelength_um: f64) -> f64 {
        (2.0 * self.period_um / wavelength_um + 2.0 * REACH * self.sigma + 1.0).min(f64::from(self.nodes))
    }
}

pub(super) fn axes(table: &SpectralTable) -> [OrdersAxis; 2] {
    let (lattice, (sx, sy)) = (table.lattice(), table.power_sigma());
    [OrdersAxis::new(&lattice.x, sx), OrdersAxis::new(&lattice.y, sy)]
}

/// Builds layout and data for a table's orders.
pub(super) fn build(table: &SpectralTable, obliquity: Obliquity) -> (OrdersLayout, Vec<u32>) {
    let axes = axes(table);
    let intervals = ((table.kappa_max() / table.kappa_step()).ceil() as usize).clamp(INTERVALS.0, INTERVALS.1);
    let step = table.kappa_max() / intervals as f64;
    let curves: Vec<NodeCurve> =
        (0..intervals * POINTS).map(|i| NodeCurve::new(table, (i as f64 + 0.5) / POINTS as f64 * step)).collect();
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
        // Triangularly weighted means around each end of an interval, one interval to each side.
        let ends: Vec<f64> = (0..=intervals)
            .map(|end| {
                let (mut sum, mut weights) = (0.0, 0.0);
                let middle = end * POINTS;
                for (i, power) in powers.iter().enumerate().take(middle + POINTS).skip(middle.saturating_sub(POINTS)) {
                    let weight = 1.0 - ((i as f64 + 0.5 - middle as f64) / POINTS as f64).abs();
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

/// Quantities of an incident direction and wavelength, and the range of orders.
#[derive(Clone, Copy)]
struct Incidence<N: Numbers> {
    wi: [N::Real; 3],
    /// Wave number 1/λ in 1/µm.
    per_um: N::Real,
    /// Difference of direction cosines between neighbouring orders.
    step: [N::Real; 2],
    /// [`ROUNDING`] times the variance of an order in direction cosines.
    rounding: N::Real,
    /// [`HEIGHT`] times the standard deviation of an order in direction cosines.
    least_squared: N::Real,
    /// First order of the loop along each axis.
    low: [N::Index; 2],
    /// Order after the last one along each axis.
    high: [N::Index; 2],
}

impl<N: Numbers> OrdersView<N> {
    /// See [`super::SamplerView::pdf`].
    #[inline(always)]
    pub fn pdf(&self, wi: [N::Real; 3], wo: [N::Real; 3], wavelength_nm: N::Real, active: N::Mask) -> N::Real {
        let lit = N::Real::lit;
        let at = self.incidence(wi, wavelength_nm);
        let nm = N::widen(wavelength_nm);
        // Whole and fractional part of the position in orders, so that distances from orders keep their precision.
        let position = [0, 1].map(|i| {
            let axis = &self.layout.axes[i];
            let f = (N::widen(wi[i]) + N::widen(wo[i])) / nm;
            let position = f * N::Double::lit(1e3 * axis.period_um);
            let whole = position.floor();
            (N::narrow(whole), N::narrow(position - whole))
        });
        let all = (at.low, lit(0.0));
        let (_, total) = N::while_loop(
            c"Sum over orders",
            all,
            |(j, _)| at.more(j, active),
            |(j, total)| (at.next(j), total + self.weight(&at, j, self.about_origin(j), at.more(j, active))),
        );
        let near = at.near(&self.layout.axes, position);
        let (_, hit) = N::while_loop(
            c"Density of orders",
            (near.low, lit(0.0)),
            |(j, _)| near.more(j, active),
            |(j, hit)| {
                let from = self.about_origin(j);
                let weight = self.weight(&near, j, from, near.more(j, active));
                let squared = [0, 1].map(|i| {
                    let (whole, fraction) = position[i];
                    let t = ((whole - from[i]) + fraction) * lit(1.0 / self.layout.axes[i].sigma);
                    t * t
                });
                let exponent = (squared[0] + squared[1]) * lit(-0.5 * LOG2_E);
                (near.next(j), weight.fma(exponent.exp2(), hit))
            },
        );
        let [x, y] = &self.layout.axes;
        let norm = 1e6 * x.period_um * y.period_um / (TAU * x.sigma * y.sigma);
        let some = lit(0.0).lt(total) & active;
        let per_area = lit(norm) / (wavelength_nm * wavelength_nm);
        N::Real::select(some, wo[2] * per_area * hit / N::Real::select(some, total, lit(1.0)), lit(0.0))
    }

    /// See [`super::SamplerView::sample`].
    #[inline(always)]
    pub fn sample(
        &self,
        wi: [N::Real; 3],
        wavelength_nm: N::Real,
        [u, v]: [N::Real; 2],
        active: N::Mask,
    ) -> [N::Real; 3] {
        let lit = N::Real::lit;
        let at = self.incidence(wi, wavelength_nm);
        // Reservoir sampling in one pass: each order replaces the previous choice with the probability of its weight
        // over the running sum. The remainder of the random number stays uniform in [0, 1).
        let start = (at.low, at.low, [lit(0.0), u]);
        let (_, chosen, [total, u]) = N::while_loop(
            c"Choice of an order",
            start,
            |(j, _, _)| at.more(j, active),
            |(j, chosen, [total, u])| {
                let weight = self.weight(&at, j, self.about_origin(j), at.more(j, active));
                let sum = total + weight;
                let place = u * sum;
                let taken = place.lt(weight);
                // An order of little weight changes the number little, so that rounding errors do not accumulate.
                let of = N::Real::select(taken, weight, total);
                let part = N::Real::select(taken, place, (lit(1.0) - u) * weight);
                let quotient = part / N::Real::select(lit(0.0).lt(of), of, lit(1.0));
                let u = N::Real::select(taken, quotient, u - quotient).clip(lit(0.0), lit(super::BELOW_ONE));
                let chosen = [0, 1].map(|i| N::Index::select(taken, j[i], chosen[i]));
                (at.next(j), chosen, [sum, u])
            },
        );
        let some = lit(0.0).lt(total) & active;
        let (from, u) = (self.about_origin(chosen), [u, v]);
        let nm = N::widen(wavelength_nm);
        let place = [0, 1].map(|i| {
            let axis = &self.layout.axes[i];
            let by = normal_quantile(u[i]) * lit(axis.sigma);
            let position = (N::widen(from[i]) + N::widen(by)) * N::Double::lit(1e-3 / axis.period_um);
            N::narrow(position.fma(nm, -N::widen(wi[i])))
        });
        super::direction_above::<N>(place, some)
    }

    #[inline(always)]
    fn incidence(&self, wi: [N::Real; 3], wavelength_nm: N::Real) -> Incidence<N> {
        let lit = N::Real::lit;
        let [x, y] = &self.layout.axes;
        let per_um = lit(1e3) / wavelength_nm;
        let um = wavelength_nm * lit(1e-3);
        let edge = |i: usize, q: f64, by: f64| {
            let axis = &self.layout.axes[i];
            let place =
                ((wi[i] + lit(q)) * per_um).fma(lit(axis.period_um), lit(f64::from(axis.origin) + by * axis.sigma));
            place.ceil().clip(lit(0.0), lit(f64::from(axis.nodes)))
        };
        let low = [0, 1].map(|i| edge(i, -1.0, -REACH));
        let high = [0, 1].map(|i| edge(i, 1.0, REACH));
        // Empty if one axis is empty.
        let any = low[0].lt(high[0]) & low[1].lt(high[1]);
        let high = [high[0], N::Real::select(any, high[1], low[1])];
        let sigma = um * lit((x.sigma / x.period_um).max(y.sigma / y.period_um));
        Incidence {
            wi,
            per_um,
            step: [um * lit(1.0 / x.period_um), um * lit(1.0 / y.period_um)],
            rounding: lit(ROUNDING) * sigma * sigma,
            least_squared: lit(HEIGHT) * sigma,
            low: low.map(N::index),
            high: high.map(N::index),
        }
    }

    #[inline(always)]
    fn about_origin(&self, j: [N::Index; 2]) -> [N::Real; 2] {
        [0, 1].map(|i| N::real(j[i]) - N::Real::lit(f64::from(self.layout.axes[i].origin)))
    }

    /// The weight `w_j` of an order.
    #[inline(always)]
    fn weight(&self, at: &Incidence<N>, j: [N::Index; 2], from: [N::Real; 2], active: N::Mask) -> N::Real {
        let lit = N::Real::lit;
        let [ax, ay] = [0, 1].map(|i| from[i] * at.step[i]);
        let (x, y) = (ax - at.wi[0], ay - at.wi[1]);
        // cos²θo at the order's centre.
        let squared = lit(1.0) - x * x - y * y;
        // Fraction of the order on the other side of the horizon than its centre: `(1 − |s|/√(s² + r))/2` without
        // cancellation.
        let root = squared.fma(squared, at.rounding).sqrt();
        let least = lit(0.5) * at.rounding / (root * (root + squared.abs()));
        let fraction = N::Real::select(lit(0.0).lt(squared), lit(1.0) - least, least);
        let part = fraction * fraction * (lit(3.0) - fraction - fraction);
        let cos_o = squared.max(at.least_squared).sqrt();
        let w = at.wi[2] + cos_o;
        let place = w * at.per_um * lit(TAU * self.layout.intervals_per_kappa);
        let interval = place.floor().clip(lit(0.0), lit(f64::from(self.layout.intervals) - 1.0));
        let row = j[1] * N::Index::lit(self.layout.axes[0].nodes) + j[0];
        let index = row * N::Index::lit(self.layout.intervals) + N::index(interval);
        let [word] = N::gather::<1>(self.words, index, active);
        let [low, high] = bf16_pair::<N>(word);
        let t = (place - interval).clip(lit(0.0), lit(1.0));
        let power = (high - low).fma(t, low) * part;
        match self.layout.obliquity {
            Obliquity::Unit | Obliquity::SmallSlope => power,
            Obliquity::Stam => {
                let w_squared = w * w;
                let sum = ax * ax + ay * ay + w_squared;
                power * sum * sum / (w_squared * cos_o.max(lit(COS_MIN)))
            }
        }
    }
}

impl<N: Numbers> Incidence<N> {
    /// Restricts the loop to orders within [`NEAR`] of a position, given as whole and fractional parts.
    #[inline(always)]
    fn near(&self, axes: &[OrdersAxis; 2], position: [(N::Real, N::Real); 2]) -> Self {
        let lit = N::Real::lit;
        let edge = |i: usize, by: f64| {
            let place = position[i].0 + (position[i].1 + lit(by)).ceil() + lit(f64::from(axes[i].origin));
            N::index(place.clip(lit(0.0), lit(f64::from(axes[i].nodes))))
        };
        let low = [0, 1].map(|i| self.low[i].max(edge(i, -NEAR * axes[i].sigma)));
        let high = [0, 1].map(|i| self.high[i].min(edge(i, NEAR * axes[i].sigma)));
        let high = [high[0], N::Index::select(low[0].lt(high[0]), high[1], low[1])];
        Self { low, high, ..*self }
    }

    /// Whether the loop continues.
    #[inline(always)]
    fn more(&self, j: [N::Index; 2], active: N::Mask) -> N::Mask {
        j[1].lt(self.high[1]) & active
    }

    /// The next order, row by row.
    #[inline(always)]
    fn next(&self, [x, y]: [N::Index; 2]) -> [N::Index; 2] {
        let one = N::Index::lit(1);
        let within = (x + one).lt(self.high[0]);
        [N::Index::select(within, x + one, self.low[0]), N::Index::select(within, y, y + one)]
    }
}
