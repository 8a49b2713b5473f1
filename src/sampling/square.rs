//! Sampler by summed areas over the frequencies, for surfaces of many orders (symbols: `mod.rs`).
//!
//! A node's mass is the mean of `P·G` over a band of κ. The frequencies `f` of outgoing directions fill a disc around
//! `wi/λ`, which lies in the square `[wi − 1, wi + 1]/λ`. Summed areas ([`SummedArea`]) give the mass of the square and
//! draw a node in it; a point around the node follows. Draws in the corners of the square are lost. Weights keep the
//! factor 1/cosθo, the energy limiter, and the difference of P from its mean.

use super::summed_area::{BANDS, Rectangle, SummedArea, SummedAreaLayout, SummedAreaView};
use super::{BELOW_ONE, direction_above, tent_quantile};
use crate::numeric::math::normal_quantile;
use crate::numeric::{Index, Number, Numbers, Real};
use crate::scattering::Obliquity;
use crate::table::{FREQUENCY_MAX_PER_UM, LatticeAxis, NodeCurve, NodeQuantity, SpectralTable};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::f64::consts::{LOG2_E, TAU};

/// Standard deviation of a node's Gaussian, in nodes, below which the Gaussian itself is drawn. Tents replace wider
/// ones, whose densities then read two nodes along an axis. Just above it they add a variance of 0.12 to the weights
/// (test below).
const TENTS_FROM_SIGMA: f64 = 0.35;
/// Bound of the absolute value of [`normal_quantile`].
const QUANTILE_MAX: f64 = 5.45;
/// Standard deviations up to which tents follow a Gaussian.
const TENT_REACH: f64 = 4.5;
/// Outgoing cosine assumed for the band of κ: `OFFSET + SLOPE·cosθi`. Light leaves around the mirror direction, and the
/// more widely the steeper it comes in.
const OUTGOING_COSINE_OFFSET: f64 = 0.3;
/// See [`OUTGOING_COSINE_OFFSET`].
const OUTGOING_COSINE_SLOPE: f64 = 0.5;
/// Least number of points of a band at which powers are read.
const POINTS_MIN: usize = 4;
/// Most points of a band.
const POINTS_MAX: usize = 64;
/// Most points of all bands and nodes together. Chosen: bounds the build's time.
const POINTS_OF_TABLE: usize = 20_000_000;

/// One axis of the lattice of nodes.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct SquareAxis {
    /// Reciprocal of the distance between nodes, in µm.
    pub period_um: f64,
    /// Index of the node at frequency 0.
    pub origin: u32,
    /// Standard deviation in nodes of the Gaussian that is drawn around a node; `None` for a tent.
    pub sigma: Option<f64>,
    /// Number of nodes that a density reads along the axis: 2, up to 4 for Gaussians, 1 if the axis has one node.
    pub taps: u32,
    /// Largest distance of a sample from its node, in nodes.
    pub reach: f64,
}

/// Layout of the summed areas.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct SquareLayout {
    /// The masses and their sums.
    pub areas: SummedAreaLayout,
    /// The lattice along x and y.
    pub axes: [SquareAxis; 2],
    /// Bands per rad/µm of κ.
    pub bands_per_kappa: f64,
}

impl SquareAxis {
    /// An axis for nodes with a Gaussian of `sigma` nodes, and the weights at the `2n + 1` nodes around one with which
    /// tents follow the Gaussian.
    fn new(axis: &LatticeAxis, sigma: f64) -> (Self, Vec<f32>) {
        let (nodes, is_narrow) = (axis.nodes(), sigma < TENTS_FROM_SIGMA);
        if nodes == 1 || is_narrow {
            let taps = if nodes == 1 { 1 } else { 2 * (QUANTILE_MAX * sigma).ceil() as u32 };
            let (origin, sigma, reach) = (axis.reach as u32, Some(sigma), QUANTILE_MAX * sigma);
            return (Self { period_um: axis.period_um, origin, sigma, taps, reach }, vec![1.0]);
        }
        let tents = tent_weights(sigma);
        // Gaussians spread beyond the lattice, but no further than frequencies propagate.
        let needed = (FREQUENCY_MAX_PER_UM * axis.period_um).ceil() as usize + 1;
        let origin = axis.reach + (tents.len() / 2).min(needed.saturating_sub(axis.reach));
        (Self { period_um: axis.period_um, origin: origin as u32, sigma: None, taps: 2, reach: 1.0 }, tents)
    }

    fn nodes(&self) -> usize {
        2 * self.origin as usize + 1
    }
}

/// Weights of tents at the nodes −n to n whose sum p follows a Gaussian g with a standard deviation of `sigma` nodes.
///
/// They minimise `∫ g²/p`, the second moment of a sample's weight, by multiplicative steps along its gradient. Such
/// steps keep the weights positive.
fn tent_weights(sigma: f64) -> Vec<f32> {
    /// Steps of the integral per node.
    const STEPS: usize = 16;
    /// Number of iterations.
    const ROUNDS: usize = 300;
    /// Least weight that is kept.
    const WEIGHT_MIN: f64 = 1e-12;
    let n = (TENT_REACH * sigma).ceil() as usize;
    let squares: Vec<f64> = (0..2 * n * STEPS)
        .map(|i| ((i as f64 + 0.5) / STEPS as f64 - n as f64) / sigma)
        .map(|t| (-t * t).exp())
        .collect();
    let interval = |i: usize| (i / STEPS, ((i % STEPS) as f64 + 0.5) / STEPS as f64);
    let mut weights: Vec<f64> = (0..=2 * n).map(|k| (-0.5 * ((k as f64 - n as f64) / sigma).powi(2)).exp()).collect();
    for _ in 0..ROUNDS {
        let mut gradient = vec![0.0; weights.len()];
        for (i, square) in squares.iter().enumerate() {
            let (k, t) = interval(i);
            let slope = square / ((1.0 - t) * weights[k] + t * weights[k + 1]).powi(2);
            gradient[k] += (1.0 - t) * slope;
            gradient[k + 1] += t * slope;
        }
        weights.iter_mut().zip(&gradient).for_each(|(weight, slope)| *weight *= slope.sqrt());
        let sum: f64 = weights.iter().sum();
        weights.iter_mut().for_each(|weight| *weight /= sum);
    }
    // The outermost tents may have vanished.
    let vanished = weights.iter().take_while(|weight| **weight < WEIGHT_MIN).count();
    weights[vanished..weights.len() - vanished].iter().map(|weight| *weight as f32).collect()
}

/// Builds layout and data from a table.
pub(super) fn build(table: &SpectralTable, obliquity: Obliquity) -> (SquareLayout, Vec<u32>) {
    let lattice = table.lattice();
    let (sx, sy) = table.power_sigma();
    let ((x, tents_x), (y, tents_y)) = (SquareAxis::new(&lattice.x, sx), SquareAxis::new(&lattice.y, sy));
    let width = x.nodes();
    let mut values = vec![[0f32; BANDS]; width * y.nodes()];
    let index = |jx: i64, jy: i64| (jy + y.origin as i64) as usize * width + (jx + x.origin as i64) as usize;
    for ([jx, jy], means) in band_means(table, obliquity) {
        values[index(jx, jy)] = means;
    }
    let values = convolved(values, width, &tents_x, &tents_y);
    let areas = SummedArea::new([width, y.nodes()], &values);
    let bands_per_kappa = BANDS as f64 / table.kappa_max();
    (SquareLayout { areas: *areas.layout(), axes: [x, y], bands_per_kappa }, areas.into_words())
}

/// Means of `P·G` over each band of κ, up to the largest κ at a node's frequency: nodes `[x, y]` with their bands.
/// Nodes beyond the pixels' sampling rate have no mass.
fn band_means(table: &SpectralTable, obliquity: Obliquity) -> Vec<([i64; 2], [f32; BANDS])> {
    let nodes = table.kept_nodes();
    let width = table.kappa_max() / BANDS as f64;
    let most = (POINTS_OF_TABLE / (BANDS * nodes.len().max(1))).clamp(POINTS_MIN, POINTS_MAX);
    let points = ((2.0 * width / table.kappa_step()).ceil() as usize).clamp(POINTS_MIN, most);
    // `κ/2π` with the spline weights of κ.
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
            let f_squared = f[0] * f[0] + f[1] * f[1];
            let k_squared_max = (table.kappa_max() / TAU).powi(2) - f_squared;
            let mut means = [0f32; BANDS];
            if !table.is_resolved(f) {
                return ([jx, jy], means);
            }
            let mut last = 0.0;
            for (mean, band) in means.iter_mut().zip(curves.chunks(points)) {
                let (mut sum, mut count) = (0.0, 0);
                for (k, curve) in band {
                    // No direction has a larger κ at this frequency. A band that begins there repeats the one below.
                    if k * k > k_squared_max && (count > 0 || last > 0.0) {
                        break;
                    }
                    let power = match table.quantity() {
                        NodeQuantity::Power => curve.power(record).max(0.0),
                        NodeQuantity::Amplitude => curve.amplitude(record).norm_sqr(),
                    };
                    let g = match obliquity {
                        Obliquity::Stam => (f_squared + k * k).powi(2) / (k * k),
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

/// Convolution of the masses `[y][x][band]` with weights along x and along y, each an odd number around the node.
fn convolved(values: Vec<[f32; BANDS]>, width: usize, weights_x: &[f32], weights_y: &[f32]) -> Vec<[f32; BANDS]> {
    let add = |to: &mut [[f32; BANDS]], from: &[[f32; BANDS]], weight: f32| {
        for (to, from) in to.iter_mut().zip(from) {
            *to = std::array::from_fn(|b| to[b] + weight * from[b]);
        }
    };
    let mut rows = vec![[0f32; BANDS]; values.len()];
    rows.par_chunks_mut(width).zip(values.par_chunks(width)).for_each(|(to, from)| {
        for (k, &weight) in weights_x.iter().enumerate() {
            let shift = k as i64 - (weights_x.len() / 2) as i64;
            let (right, left) = (shift.max(0) as usize, (-shift).max(0) as usize);
            if right.max(left) < width {
                add(&mut to[right..], &from[left..], weight);
            }
        }
    });
    let height = values.len() / width;
    let mut both = values;
    both.par_chunks_mut(width).enumerate().for_each(|(row, to)| {
        to.fill([0.0; BANDS]);
        for (k, &weight) in weights_y.iter().enumerate() {
            let from = row as i64 + (weights_y.len() / 2) as i64 - k as i64;
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

/// Quantities of an incidence and wavelength, whatever the outgoing direction.
struct Incidence<N: Numbers> {
    /// Blocks of the square.
    rectangle: Rectangle<N>,
    /// Lower of the two bands that are interpolated.
    band: N::Index,
    /// Interpolation weight of the upper band.
    upper: N::Real,
    /// Mass of the rectangle in each band, in counts.
    mass: [N::Index; BANDS],
}

impl<N: Numbers> SquareView<N> {
    /// See [`super::SamplerView::pdf`].
    #[inline(always)]
    pub(super) fn pdf(&self, wi: [N::Real; 3], wo: [N::Real; 3], wavelength_nm: N::Real, active: N::Mask) -> N::Real {
        let lit = N::Real::lit;
        let incidence = self.incidence(wi, wavelength_nm, active);
        let nm = N::widen(wavelength_nm);
        // Lattice coordinates of the frequency, in nodes from the first.
        let position = [0, 1].map(|i| {
            let axis = &self.layout.axes[i];
            let f = (N::widen(wi[i]) + N::widen(wo[i])) / nm;
            f.fma(N::Double::lit(1e3 * axis.period_um), N::Double::lit(f64::from(axis.origin)))
        });
        let (x, y) = (self.taps(0, position[0]), self.taps(1, position[1]));
        let (x, y) = (&x[..self.layout.axes[0].taps as usize], &y[..self.layout.axes[1].taps as usize]);
        let masses = self.areas().weighted(x, y, &incidence.rectangle, active);
        let [lower, upper] = incidence.interpolated(masses, self.layout.areas.unit);
        let [total_lower, total_upper] = incidence.interpolated(incidence.mass.map(N::real), self.layout.areas.unit);
        let total = total_lower + total_upper;
        let [x, y] = &self.layout.axes;
        let per_node = lit(1e6 * x.period_um * y.period_um) / (wavelength_nm * wavelength_nm);
        let is_lit = lit(0.0).lt(total) & active;
        let density = wo[2] * per_node * (lower + upper) / N::Real::select(is_lit, total, lit(1.0));
        N::Real::select(is_lit, density, lit(0.0))
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
        let incidence = self.incidence(wi, wavelength_nm, active);
        let [lower, upper] = incidence.interpolated(incidence.mass.map(N::real), self.layout.areas.unit);
        let is_lit = lit(0.0).lt(lower + upper) & active;
        // The first random number chooses one of the two bands; its rest draws the column.
        let target = u * (lower + upper);
        let is_upper = lit(0.0).lt(upper) & lower.le(target);
        let rest = N::Real::select(is_upper, target - lower, target);
        let own = N::Real::select(is_lit, N::Real::select(is_upper, upper, lower), lit(1.0));
        let u = (rest / own).clip(lit(0.0), lit(BELOW_ONE));
        let band = incidence.band + N::Index::select(is_upper, N::Index::lit(1), N::Index::lit(0));
        let drawn = self.areas().choose(&incidence.rectangle, band, [u, v], is_lit);
        let nm = N::widen(wavelength_nm);
        let cosines = [0, 1].map(|i| {
            let axis = &self.layout.axes[i];
            let offset = match axis.sigma {
                Some(sigma) => normal_quantile(drawn.u[i]) * lit(sigma),
                None => tent_quantile(drawn.u[i]),
            };
            let node = N::widen(N::real(drawn.node[i])) - N::Double::lit(f64::from(axis.origin));
            let frequency = (node + N::widen(offset)) * N::Double::lit(1e-3 / axis.period_um);
            N::narrow(frequency.fma(nm, -N::widen(wi[i])))
        });
        direction_above::<N>(cosines, is_lit)
    }

    #[inline(always)]
    fn areas(&self) -> SummedAreaView<N> {
        SummedAreaView { layout: self.layout.areas, words: self.words }
    }

    /// Prepares an incidence and wavelength.
    #[inline(always)]
    fn incidence(&self, wi: [N::Real; 3], wavelength_nm: N::Real, active: N::Mask) -> Incidence<N> {
        let lit = N::Real::lit;
        let wavenumber = lit(1e3) / wavelength_nm;
        // Lattice coordinate of a side of the square, moved outwards by the reach of a sample.
        let edge = |i: usize, sign: f64| {
            let axis = &self.layout.axes[i];
            ((wi[i] + lit(sign)) * wavenumber).fma(lit(axis.period_um), lit(f64::from(axis.origin) + sign * axis.reach))
        };
        let rectangle = self.areas().rectangle([0, 1].map(|i| edge(i, -1.0)), [0, 1].map(|i| edge(i, 1.0)));
        let w = wi[2].fma(lit(1.0 + OUTGOING_COSINE_SLOPE), lit(OUTGOING_COSINE_OFFSET));
        let kappa = w * wavenumber * lit(TAU);
        let coordinate = kappa.fma(lit(self.layout.bands_per_kappa), lit(-0.5)).clip(lit(0.0), lit(BANDS as f64 - 1.0));
        let band = coordinate.floor().min(lit(BANDS as f64 - 2.0));
        let mass = self.areas().mass(&rectangle, active);
        Incidence { rectangle, band: N::index(band), upper: coordinate - band, mass }
    }

    /// Nodes around a lattice coordinate along an axis, with the densities of their samples there, per node.
    #[inline(always)]
    fn taps(&self, axis: usize, position: N::Double) -> [(N::Double, N::Real); TAPS_MAX] {
        let axis = &self.layout.axes[axis];
        let first = match axis.taps {
            1 => N::Double::lit(0.0),
            taps => position.floor() - N::Double::lit(f64::from(taps / 2 - 1)),
        };
        std::array::from_fn(|i| {
            let node = first + N::Double::lit(i as f64);
            let offset = N::narrow(position - node);
            let density = match axis.sigma {
                Some(sigma) => {
                    let t = offset * N::Real::lit(1.0 / sigma);
                    (t * t * N::Real::lit(-0.5 * LOG2_E)).exp2() * N::Real::lit(1.0 / (TAU.sqrt() * sigma))
                }
                None => N::Real::lit(1.0) - offset.abs(),
            };
            (node, density)
        })
    }
}

/// Most nodes along an axis that a density reads: `2·⌈QUANTILE_MAX · TENTS_FROM_SIGMA⌉`, two on either side.
const TAPS_MAX: usize = 4;
const _: () = assert!(QUANTILE_MAX * TENTS_FROM_SIGMA <= (TAPS_MAX / 2) as f64);

impl<N: Numbers> Incidence<N> {
    /// Values of the two interpolated bands, each times its weight and the value of a count in it.
    #[inline(always)]
    fn interpolated(&self, values: [N::Real; BANDS], unit: [f32; BANDS]) -> [N::Real; 2] {
        let lit = N::Real::lit;
        let [a, b, c, d] = std::array::from_fn(|i| values[i] * lit(f64::from(unit[i])));
        let (is_first, is_second) = (self.band.lt(N::Index::lit(1)), self.band.lt(N::Index::lit(2)));
        let select = |a, b, c| N::Real::select(is_first, a, N::Real::select(is_second, b, c));
        [select(a, b, c) * (lit(1.0) - self.upper), select(b, c, d) * self.upper]
    }
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
            // Variance of the weight g/p along one axis.
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
    }
}
