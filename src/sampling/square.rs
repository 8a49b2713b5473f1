//! Sampler of many orders: nodes of the table within a square of frequencies.
//!
//! With Stam's obliquity factor, the power reflected into `df` is `S(f; κ)·G/(4 cosθi cosθo)`, where
//!
//! ```text
//! G = (|f|² + k²)²/k²,  k = κ/2π          λ²G = 4·O·cosθi·cosθo at every incidence
//! ```
//!
//! A node's mass is therefore the mean of `P·G` over a band of κ, and independent of the incidence. Propagating
//! frequencies form a disc within the square `[wi − 1, wi + 1]/λ`, whose mass a [`SummedArea`] gives; draws in the
//! square's corners are lost. The sample's weight varies by the albedo's divisor, by `1/cosθo`, and by the deviation of
//! `P` from its mean.

use super::summed_area::{BANDS, Rectangle, SummedArea, SummedAreaLayout, SummedAreaView};
use crate::numeric::math::normal_quantile;
use crate::numeric::{Index, Number, Numbers, Real};
use crate::scattering::Obliquity;
use crate::table::{FREQUENCY_MAX_PER_UM, LatticeAxis, NodeCurve, NodeQuantity, SpectralTable};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::f64::consts::{LOG2_E, TAU};

/// Standard deviation of a node's Gaussian, in nodes, below which the Gaussian itself is drawn. Wider Gaussians are
/// approximated by tents (linear interpolation kernels), which need fewer nodes.
const TENTS_FROM_SIGMA: f64 = 0.35;
/// Range of [`normal_quantile`] in standard deviations.
const QUANTILE_MAX: f64 = 5.45;
/// Standard deviations up to which tents approximate a Gaussian.
const TENT_REACH: f64 = 4.5;
/// Outgoing cosine assumed when a band of κ is chosen: at grazing incidence, and per incident cosine. Reflected light
/// surrounds the mirror direction, more widely at steeper incidence.
const TYPICAL_COS: (f64, f64) = (0.3, 0.5);
/// Least and greatest number of samples of κ per band.
const POINTS: (usize, usize) = (4, 64);
/// Largest number of samples of a whole table, which bounds the build's time.
const POINTS_OF_TABLE: usize = 20_000_000;

/// One axis of the lattice of nodes.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct SquareAxis {
    /// Period whose reciprocal is the spacing of nodes, in µm.
    pub period_um: f64,
    /// Index of the node at frequency 0.
    pub origin: u32,
    /// Standard deviation in nodes of the Gaussian drawn about a node, `None` for a tent.
    pub sigma: Option<f64>,
    /// Number of nodes that a density reads: 2, more for wider Gaussians, 1 for a single node.
    pub taps: u32,
    /// Largest distance of a sample from its node, in nodes.
    pub reach: f64,
}

/// Layout of the sampler's table data.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct SquareLayout {
    /// Summed-area table of the masses.
    pub areas: SummedAreaLayout,
    /// Frequencies along x and y.
    pub axes: [SquareAxis; 2],
    /// Bands per rad/µm of κ.
    pub bands_per_kappa: f64,
}

impl SquareAxis {
    /// The axis, and the 2n + 1 weights of tents around a node that approximate its Gaussian.
    fn new(axis: &LatticeAxis, sigma: f64) -> (Self, Vec<f32>) {
        let (nodes, gaussian) = (axis.nodes(), sigma < TENTS_FROM_SIGMA);
        if nodes == 1 || gaussian {
            let taps = if nodes == 1 { 1 } else { 2 * (QUANTILE_MAX * sigma).ceil() as u32 };
            let (origin, sigma, reach) = (axis.reach as u32, Some(sigma), QUANTILE_MAX * sigma);
            return (Self { period_um: axis.period_um, origin, sigma, taps, reach }, vec![1.0]);
        }
        let tents = tent_weights(sigma);
        // The lattice may end before the propagating frequencies do; tents extend beyond it.
        let wanted = (FREQUENCY_MAX_PER_UM * axis.period_um).ceil() as usize + 1;
        let origin = axis.reach + (tents.len() / 2).min(wanted.saturating_sub(axis.reach));
        (Self { period_um: axis.period_um, origin: origin as u32, sigma: None, taps: 2, reach: 1.0 }, tents)
    }

    fn nodes(&self) -> usize {
        2 * self.origin as usize + 1
    }
}

/// Weights of tents at the nodes from −n to n whose sum `p` approximates the Gaussian `g` of standard deviation `sigma`
/// (in nodes). They minimise `∫ g²/p`, the variance of sample weights, by multiplicative gradient steps that keep
/// weights positive.
fn tent_weights(sigma: f64) -> Vec<f32> {
    const STEPS: usize = 16;
    const ROUNDS: usize = 300;
    const IDLE_WEIGHT: f64 = 1e-12;
    let n = (TENT_REACH * sigma).ceil() as usize;
    let squares: Vec<f64> = (0..2 * n * STEPS)
        .map(|i| ((i as f64 + 0.5) / STEPS as f64 - n as f64) / sigma)
        .map(|t| (-t * t).exp())
        .collect();
    let part = |i: usize| (i / STEPS, ((i % STEPS) as f64 + 0.5) / STEPS as f64);
    let mut weights: Vec<f64> = (0..=2 * n).map(|k| (-0.5 * ((k as f64 - n as f64) / sigma).powi(2)).exp()).collect();
    for _ in 0..ROUNDS {
        let mut pulls = vec![0.0; weights.len()];
        for (i, square) in squares.iter().enumerate() {
            let (k, t) = part(i);
            let pull = square / ((1.0 - t) * weights[k] + t * weights[k + 1]).powi(2);
            pulls[k] += (1.0 - t) * pull;
            pulls[k + 1] += t * pull;
        }
        weights.iter_mut().zip(&pulls).for_each(|(weight, pull)| *weight *= pull.sqrt());
        let sum: f64 = weights.iter().sum();
        weights.iter_mut().for_each(|weight| *weight /= sum);
    }
    // Drops outer tents that have vanished.
    let idle = weights.iter().take_while(|weight| **weight < IDLE_WEIGHT).count();
    weights[idle..weights.len() - idle].iter().map(|weight| *weight as f32).collect()
}

/// Builds layout and data from a table.
pub(super) fn build(table: &SpectralTable, obliquity: Obliquity) -> (SquareLayout, Vec<u32>) {
    let lattice = table.lattice();
    let (sx, sy) = table.power_sigma();
    let ((x, along_x), (y, along_y)) = (SquareAxis::new(&lattice.x, sx), SquareAxis::new(&lattice.y, sy));
    let width = x.nodes();
    let mut values = vec![[0f32; BANDS]; width * y.nodes()];
    let place = |jx: i64, jy: i64| (jy + y.origin as i64) as usize * width + (jx + x.origin as i64) as usize;
    for (index, means) in band_means(table, obliquity) {
        values[place(index[0], index[1])] = means;
    }
    let values = blurred(values, width, &along_x, &along_y);
    let areas = SummedArea::new([width, y.nodes()], &values);
    let bands_per_kappa = BANDS as f64 / table.kappa_max();
    (SquareLayout { areas: *areas.layout(), axes: [x, y], bands_per_kappa }, areas.into_words())
}

/// Means of `P·G` over each band of κ, up to the largest κ of each node, for nodes within the pixels' cutoff frequency.
fn band_means(table: &SpectralTable, obliquity: Obliquity) -> Vec<([i64; 2], [f32; BANDS])> {
    let nodes = table.kept_nodes();
    let width = table.kappa_max() / BANDS as f64;
    let most = (POINTS_OF_TABLE / (BANDS * nodes.len().max(1))).clamp(POINTS.0, POINTS.1);
    let points = ((2.0 * width / table.kappa_step()).ceil() as usize).clamp(POINTS.0, most);
    let curves: Vec<(f64, NodeCurve)> = (0..BANDS * points)
        .map(|i| (i as f64 + 0.5) / points as f64 * width)
        .map(|kappa| (kappa / TAU, NodeCurve::new(table, kappa)))
        .collect();
    let lattice = table.lattice();
    nodes
        .into_par_iter()
        .with_min_len(1024)
        .map(|(jx, jy, record)| {
            let f = [jx as f64 / lattice.x.period_um, jy as f64 / lattice.y.period_um];
            let squared = f[0] * f[0] + f[1] * f[1];
            let k_max = (table.kappa_max() / TAU).powi(2) - squared;
            let mut means = [0f32; BANDS];
            if !table.is_resolved(f) {
                return ([jx, jy], means);
            }
            let mut last = 0.0;
            for (mean, band) in means.iter_mut().zip(curves.chunks(points)) {
                let (mut sum, mut count) = (0.0, 0);
                for (k, curve) in band {
                    if k * k > k_max && (count > 0 || last > 0.0) {
                        break;
                    }
                    let power = match table.quantity() {
                        NodeQuantity::Power => curve.power(record).max(0.0),
                        NodeQuantity::Amplitude => curve.amplitude(record).norm_sqr(),
                    };
                    let g = match obliquity {
                        Obliquity::Stam => (squared + k * k).powi(2) / (k * k),
                        Obliquity::Unit | Obliquity::SmallSlope => 1.0,
                    };
                    sum += power * g;
                    count += 1;
                }
                if count > 0 {
                    last = sum / f64::from(count);
                }
                *mean = last as f32;
            }
            ([jx, jy], means)
        })
        .collect()
}

/// Convolves the masses with weights along x and along y.
fn blurred(values: Vec<[f32; BANDS]>, width: usize, along_x: &[f32], along_y: &[f32]) -> Vec<[f32; BANDS]> {
    let add = |to: &mut [[f32; BANDS]], from: &[[f32; BANDS]], weight: f32| {
        for (to, from) in to.iter_mut().zip(from) {
            *to = std::array::from_fn(|b| to[b] + weight * from[b]);
        }
    };
    let mut rows = vec![[0f32; BANDS]; values.len()];
    rows.par_chunks_mut(width).zip(values.par_chunks(width)).for_each(|(to, from)| {
        for (k, &weight) in along_x.iter().enumerate() {
            let by = k as i64 - (along_x.len() / 2) as i64;
            let (start, back) = (by.max(0) as usize, (-by).max(0) as usize);
            if start.max(back) < width {
                add(&mut to[start..], &from[back..], weight);
            }
        }
    });
    let height = values.len() / width;
    let mut both = values;
    both.par_chunks_mut(width).enumerate().for_each(|(row, to)| {
        to.fill([0.0; BANDS]);
        for (k, &weight) in along_y.iter().enumerate() {
            let from = row as i64 + (along_y.len() / 2) as i64 - k as i64;
            if (0..height as i64).contains(&from) {
                add(to, &rows[from as usize * width..][..width], weight);
            }
        }
    });
    both
}

/// The sampler over one family of numbers.
#[derive(Clone, Copy)]
pub(super) struct SquareView<N: Numbers> {
    pub layout: SquareLayout,
    pub words: N::Words,
}

/// Quantities of an incident direction and wavelength.
struct Incidence<N: Numbers> {
    /// Blocks that cover the square of frequencies.
    rectangle: Rectangle<N>,
    /// The lower of the two interpolated bands.
    band: N::Index,
    /// Weight of the upper band.
    upper: N::Real,
    /// Counts of the rectangle in each band.
    mass: [N::Index; BANDS],
}

impl<N: Numbers> SquareView<N> {
    /// See [`super::SamplerView::pdf`].
    #[inline(always)]
    pub fn pdf(&self, wi: [N::Real; 3], wo: [N::Real; 3], wavelength_nm: N::Real, active: N::Mask) -> N::Real {
        let lit = N::Real::lit;
        let at = self.incidence(wi, wavelength_nm, active);
        let nm = N::widen(wavelength_nm);
        let position = [0, 1].map(|i| {
            let axis = &self.layout.axes[i];
            let f = (N::widen(wi[i]) + N::widen(wo[i])) / nm;
            f.fma(N::Double::lit(1e3 * axis.period_um), N::Double::lit(f64::from(axis.origin)))
        });
        let (x, y) = (self.taps(0, position[0]), self.taps(1, position[1]));
        let (x, y) = (&x[..self.layout.axes[0].taps as usize], &y[..self.layout.axes[1].taps as usize]);
        let [lower, upper] = at.pair(self.areas().weighted(x, y, &at.rectangle, active), self.layout.areas.unit);
        let [mass_lower, mass_upper] = at.pair(at.mass.map(N::real), self.layout.areas.unit);
        let mass = mass_lower + mass_upper;
        let [x, y] = &self.layout.axes;
        let per_node = lit(1e6 * x.period_um * y.period_um) / (wavelength_nm * wavelength_nm);
        let some = lit(0.0).lt(mass) & active;
        let density = wo[2] * per_node * (lower + upper) / N::Real::select(some, mass, lit(1.0));
        N::Real::select(some, density, lit(0.0))
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
        let at = self.incidence(wi, wavelength_nm, active);
        let [lower, upper] = at.pair(at.mass.map(N::real), self.layout.areas.unit);
        let some = lit(0.0).lt(lower + upper) & active;
        let place = u * (lower + upper);
        let is_upper = lit(0.0).lt(upper) & lower.le(place);
        let rest = N::Real::select(is_upper, place - lower, place);
        let of = N::Real::select(some, N::Real::select(is_upper, upper, lower), lit(1.0));
        let u = (rest / of).clip(lit(0.0), lit(super::BELOW_ONE));
        let band = at.band + N::Index::select(is_upper, N::Index::lit(1), N::Index::lit(0));
        let drawn = self.areas().choose(&at.rectangle, band, [u, v], some);
        let nm = N::widen(wavelength_nm);
        let [x, y] = [0, 1].map(|i| {
            let axis = &self.layout.axes[i];
            let by = match axis.sigma {
                Some(sigma) => normal_quantile(drawn.u[i]) * lit(sigma),
                None => tent(drawn.u[i]),
            };
            let from_origin = N::widen(N::real(drawn.node[i])) - N::Double::lit(f64::from(axis.origin));
            let position = (from_origin + N::widen(by)) * N::Double::lit(1e-3 / axis.period_um);
            N::narrow(position.fma(nm, -N::widen(wi[i])))
        });
        super::direction_above::<N>([x, y], some)
    }

    #[inline(always)]
    fn areas(&self) -> SummedAreaView<N> {
        SummedAreaView { layout: self.layout.areas, words: self.words }
    }

    #[inline(always)]
    fn incidence(&self, wi: [N::Real; 3], wavelength_nm: N::Real, active: N::Mask) -> Incidence<N> {
        let lit = N::Real::lit;
        let per_um = lit(1e3) / wavelength_nm;
        let edge = |i: usize, q: f64, by: f64| {
            let axis = &self.layout.axes[i];
            ((wi[i] + lit(q)) * per_um).fma(lit(axis.period_um), lit(f64::from(axis.origin) + by * axis.reach))
        };
        let rectangle = self.areas().rectangle([0, 1].map(|i| edge(i, -1.0, -1.0)), [0, 1].map(|i| edge(i, 1.0, 1.0)));
        let kappa = wi[2].fma(lit(1.0 + TYPICAL_COS.1), lit(TYPICAL_COS.0)) * per_um * lit(TAU);
        let position = kappa.fma(lit(self.layout.bands_per_kappa), lit(-0.5)).clip(lit(0.0), lit(BANDS as f64 - 1.0));
        let band = position.floor().min(lit(BANDS as f64 - 2.0));
        let mass = self.areas().mass(&rectangle, active);
        Incidence { rectangle, band: N::index(band), upper: position - band, mass }
    }

    /// Nodes around a position along an axis, with the density of their kernels there.
    #[inline(always)]
    fn taps(&self, axis: usize, position: N::Double) -> [(N::Double, N::Real); TAPS_MAX] {
        let axis = &self.layout.axes[axis];
        let first = match axis.taps {
            1 => N::Double::lit(0.0),
            taps => position.floor() - N::Double::lit(f64::from(taps / 2 - 1)),
        };
        std::array::from_fn(|i| {
            let at = first + N::Double::lit(i as f64);
            let by = N::narrow(position - at);
            let weight = match axis.sigma {
                Some(sigma) => {
                    let t = by * N::Real::lit(1.0 / sigma);
                    (t * t * N::Real::lit(-0.5 * LOG2_E)).exp2() * N::Real::lit(1.0 / (TAU.sqrt() * sigma))
                }
                None => N::Real::lit(1.0) - by.abs(),
            };
            (at, weight)
        })
    }
}

/// Largest number of nodes along an axis that a density reads: two Gaussians of [`TENTS_FROM_SIGMA`] to each side.
const TAPS_MAX: usize = 4;

impl<N: Numbers> Incidence<N> {
    /// Values of the two interpolated bands, times their weight and the unit of their counts.
    #[inline(always)]
    fn pair(&self, values: [N::Real; BANDS], unit: [f32; BANDS]) -> [N::Real; 2] {
        let lit = N::Real::lit;
        let [a, b, c, d] = std::array::from_fn(|i| values[i] * lit(f64::from(unit[i])));
        let (first, second) = (self.band.lt(N::Index::lit(1)), self.band.lt(N::Index::lit(2)));
        let of = |a, b, c| N::Real::select(first, a, N::Real::select(second, b, c));
        [of(a, b, c) * (lit(1.0) - self.upper), of(b, c, d) * self.upper]
    }
}

/// Quantile function of a tent on [−1, 1].
#[inline(always)]
fn tent<R: Real>(u: R) -> R {
    let lit = R::lit;
    let low = u.lt(lit(0.5));
    let rest = R::select(low, u, lit(1.0) - u);
    let by = lit(1.0) - (rest + rest).sqrt();
    R::select(low, -by, by)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tents_follow_a_gaussian() {
        for (sigma, most) in [(0.36, 0.12), (0.45, 0.07), (0.9, 0.02), (1.8, 0.02)] {
            let weights = tent_weights(sigma);
            // Rounding of each weight to single precision.
            let sum: f64 = weights.iter().map(|&w| f64::from(w)).sum();
            assert!((sum - 1.0).abs() < 1e-6, "{sigma}: {sum}");
            assert!(weights.iter().all(|&w| w > 0.0), "{sigma}: {weights:?}");
            let n = (weights.len() / 2) as f64;
            // The variance of the weight g/p along one axis.
            let (steps, mut second) = (100, 0.0);
            for i in 0..2 * steps * weights.len() / 2 - 2 * steps {
                let x = (i as f64 + 0.5) / steps as f64;
                let (k, t) = (x as usize, x.fract());
                let p = (1.0 - t) * f64::from(weights[k]) + t * f64::from(weights[k + 1]);
                let g = (-0.5 * ((x - n) / sigma).powi(2)).exp() / (TAU.sqrt() * sigma);
                second += g * g / p / steps as f64;
            }
            println!("{sigma}: {}", second - 1.0);
            assert!(second - 1.0 < most, "{sigma}: {second}");
        }
        assert_eq!(tent(0.5f64), 0.0);
        assert!((tent(0.125f64) + 0.5).abs() < 1e-15 && (tent(0.875f64) - 0.5).abs() < 1e-15);
    }
}
