//! Sampler for surfaces of many orders: a summed-area table over a square of frequencies.
//!
//! ```text
//! wi, wo                                unit vectors away from the surface, at the angles θi and θo from the normal z
//! λ                                     wavelength
//! f = (wi + wo)_xy/λ                    frequency, in cycles/µm
//! κ = 2πk,  k = (cosθi + cosθo)/λ       phase rate κ in rad/µm; k in cycles/µm
//! P_j(κ), f_j                           power and frequency of node j of the spectral table
//! S                                     power spectrum: sum of the P_j, each times a Gaussian about f_j
//! G(f; k) = (|f|² + k²)²/k²             for Stam's obliquity factor O, where λ²G = 4 O cosθi cosθo
//! G = 1                                 for other obliquity factors
//! M_jb = mean of P_j(κ)·G(f_j; κ/2π) over band b     mass of node j, for BANDS = 4 equal bands of κ
//! M_j  = (1 − t) M_jb + t M_j(b+1)      mass at a typical κ of the incidence, at the fraction t of the way from the
//!                                       centre of band b to that of band b + 1
//! ```
//!
//! The power reflected into `df` is proportional to `S·G/cosθo` at one incidence. The density follows `S·G`. Three
//! sources of variance of the sample weights remain: `1/cosθo`, the variation of `P_j` within a band, and the
//! division of the reflectance by its albedo.
//!
//! Frequencies of outgoing directions fill a disc of radius 1/λ about `wi_xy/λ`. Nodes are drawn from the square
//! around the disc, since a [`SummedArea`] yields the mass of any rectangle in four reads. Samples in the corners of
//! the square belong to no direction and are rejected.
//!
//! A sample is a node plus an offset along each axis. Where the Gaussian of a node is narrow, the offset is normal.
//! Where it is wide, the Gaussian is approximated by a sum of tents at the nodes around. A tent has the density
//! `1 − |x|` of the offset x in nodes, for x in [−1, 1]. Masses are convolved with the tents' weights beforehand, so a
//! sample draws a node and the offset of one tent.
//!
//! In [`SquareView`], masses are whole *counts* times a unit of mass per band (`summed_area`). Densities are zero, and
//! directions not drawn, where the mask `active` is false. A *reach* is a bound: of a [`LatticeAxis`] on node numbers,
//! of a [`SquareAxis`] on offsets in nodes, and of [`SquareLayout`] and [`Passage`] on outgoing direction cosines. A
//! [`Passage`] has the incident wave vector in units of 2π/λ. Its `typical_w` is the sum cosθi + cosθo at an outgoing
//! angle chosen for the incidence; it gives the typical κ. A [`Reading`] has the wavelengths for f and for κ.
//!
//! `N` is a family of numbers (`src/numeric`): an `N::Real` is one number, a SIMD vector or a traced variable, and
//! `lit` makes a constant.

use super::node_power;
use super::summed_area::{BANDS, Rectangle, SummedArea, SummedAreaLayout, SummedAreaView};
use super::tents::{convolved, tent_quantile, tent_weights};
use crate::numeric::math::{NORMAL_QUANTILE_MAX, normal_quantile};
use crate::numeric::{Index, Number, Numbers, Real};
use crate::scattering::{Obliquity, Passage, Reading};
use crate::table::{FREQUENCY_MAX_PER_UM, LatticeAxis, NodeCurve, SpectralTable};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::f64::consts::{LOG2_E, TAU};

/// Smallest standard deviation of a node's Gaussian, in nodes, at which a sum of tents approximates the Gaussian.
///
/// For narrower Gaussians a density reads up to [`TAPS_MAX`] nodes along an axis; with tents it reads two. Tents add a
/// relative variance of sample weights along an axis, 8 % at this width and below 1 % from 0.9 on. Chosen: smaller
/// values save reads; larger ones reduce the variance.
const TENTS_FROM_SIGMA: f64 = 0.35;
/// Largest number of nodes along an axis that a density reads: two to either side, for the widest Gaussian that is not
/// approximated by tents.
const TAPS_MAX: usize = 2 * ((NORMAL_QUANTILE_MAX * TENTS_FROM_SIGMA) as usize + 1);
/// Bound on the quadrature points of a whole table, all nodes and bands together. Chosen to bound the build time; a
/// smaller bound makes the means over bands of large tables less accurate, which adds variance.
const TABLE_POINTS_MAX: usize = 20_000_000;

/// One axis of the lattice of nodes, and the density of a sample's offset from its node along it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct SquareAxis {
    /// Period whose reciprocal is the spacing of nodes, in µm.
    pub period_um: f64,
    /// Index of the node of frequency 0; the axis has `2·origin + 1` nodes.
    pub origin: u32,
    /// Standard deviation of a Gaussian offset in nodes, or `None` for a tent of one node to either side.
    pub sigma: Option<f64>,
    /// Number of nodes that a density reads (taps): 2 with tents, an even number with Gaussians, 1 on an axis of one
    /// node.
    pub taps: u32,
    /// Largest offset of a sample from its node, in nodes.
    pub reach: f64,
}

/// Layout of the table data of [`SquareView`].
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct SquareLayout {
    /// Layout of the summed-area table; its bands are bands of κ.
    pub areas: SummedAreaLayout,
    /// Axes x and y of the lattice.
    pub axes: [SquareAxis; 2],
    /// Bands per rad/µm of κ.
    pub bands_per_kappa: f64,
    /// Largest direction cosine of outgoing light along the surface ([`Options::reach`](crate::Options::reach)): 1, or
    /// less under a clear layer, which totally reflects the light beyond.
    pub reach: f64,
}

impl SquareAxis {
    /// The axis for nodes whose Gaussians have a standard deviation of `sigma` nodes. Also returns the weights of the
    /// tents whose sum approximates a Gaussian, an odd number; a single weight of 1 where the Gaussian itself is drawn.
    fn new(axis: &LatticeAxis, sigma: f64) -> (Self, Vec<f32>) {
        // A single node of any width is read exactly: the Gaussian of one node.
        let has_one_node = axis.nodes() == 1;
        if has_one_node || sigma < TENTS_FROM_SIGMA {
            let reach = NORMAL_QUANTILE_MAX * sigma;
            let taps = if has_one_node { 1 } else { 2 * reach.ceil() as u32 };
            let (origin, sigma) = (axis.reach as u32, Some(sigma));
            return (Self { period_um: axis.period_um, origin, sigma, taps, reach }, vec![1.0]);
        }
        let tents = tent_weights(sigma);
        // Tents extend beyond the last node of the table, up to the first node whose tent no frequency reaches.
        let last_node = (FREQUENCY_MAX_PER_UM * axis.period_um).ceil() as usize + 1;
        let origin = axis.reach + (tents.len() / 2).min(last_node.saturating_sub(axis.reach));
        (Self { period_um: axis.period_um, origin: origin as u32, sigma: None, taps: 2, reach: 1.0 }, tents)
    }

    /// Number of nodes along the axis.
    fn nodes(&self) -> usize {
        2 * self.origin as usize + 1
    }
}

/// Tabulates the masses of a table's nodes. Returns the layout and the table data.
pub(super) fn build(table: &SpectralTable, obliquity: Obliquity, reach: f64) -> (SquareLayout, Vec<u32>) {
    let lattice = table.lattice();
    let (sx, sy) = table.power_sigma();
    let ((x, tents_x), (y, tents_y)) = (SquareAxis::new(&lattice.x, sx), SquareAxis::new(&lattice.y, sy));
    let width = x.nodes();
    let mut masses = vec![[0f32; BANDS]; width * y.nodes()];
    for ([jx, jy], means) in band_means(table, obliquity) {
        let (column, row) = ((jx + x.origin as i64) as usize, (jy + y.origin as i64) as usize);
        masses[row * width + column] = means;
    }
    let masses = convolved(masses, width, &tents_x, &tents_y);
    let areas = SummedArea::new([width, y.nodes()], &masses);
    let bands_per_kappa = BANDS as f64 / table.kappa_max();
    (SquareLayout { areas: *areas.layout(), axes: [x, y], bands_per_kappa, reach }, areas.into_words())
}

/// Means of `P·G` over each band of κ, for every node that is stored, given by its numbers `[jx, jy]`. Zeros for
/// frequencies that the pixels do not resolve.
///
/// Pairs of directions at the frequency `f` of a node have `κ ≤ √(κ_max² − (2π|f|)²)`, since `|wi + wo| ≤ 2`. A mean is
/// over quadrature points with these κ. A band without such points repeats the mean of the band below. If that is zero
/// or missing, the band takes its first point alone.
fn band_means(table: &SpectralTable, obliquity: Obliquity) -> Vec<([i64; 2], [f32; BANDS])> {
    let nodes = table.kept_nodes();
    let band_width = table.kappa_max() / BANDS as f64;
    let points_max = (TABLE_POINTS_MAX / (BANDS * nodes.len().max(1))).max(1);
    // Two quadrature points per knot of the splines over κ, within the bounds.
    let points = ((2.0 * band_width / table.kappa_step()).ceil() as usize).clamp(1, points_max);
    let curves: Vec<(f64, NodeCurve)> = (0..BANDS * points)
        .map(|i| (i as f64 + 0.5) / points as f64 * band_width)
        .map(|kappa| (kappa / TAU, NodeCurve::new(table, kappa)))
        .collect();
    let lattice = table.lattice();
    nodes
        .into_par_iter()
        .map(|(jx, jy, record)| {
            let f = [jx as f64 / lattice.x.period_um, jy as f64 / lattice.y.period_um];
            let means = if table.is_resolved(f) {
                node_means(table, record, f[0] * f[0] + f[1] * f[1], curves.chunks(points), obliquity)
            } else {
                [0.0; BANDS]
            };
            ([jx, jy], means)
        })
        .collect()
}

/// Means of `P·G` over each band of κ for a node of squared frequency `f_squared`. `bands` gives the quadrature points
/// of each band in ascending order: k = κ/2π and the curve at this κ. [`band_means`] describes bands whose κ belong to
/// no pair of directions.
fn node_means<'a>(
    table: &SpectralTable,
    record: &[f32],
    f_squared: f64,
    bands: impl Iterator<Item = &'a [(f64, NodeCurve)]>,
    obliquity: Obliquity,
) -> [f32; BANDS] {
    let k_max_squared = (table.kappa_max() / TAU).powi(2) - f_squared;
    let mut means = [0f32; BANDS];
    let mut last_mean = 0.0;
    for (mean, band) in means.iter_mut().zip(bands) {
        let (mut sum, mut count) = (0.0, 0);
        for (k, curve) in band {
            // No pair of directions has this k or a larger one. The first point is kept if there is no mean yet.
            if k * k > k_max_squared && (count > 0 || last_mean > 0.0) {
                break;
            }
            let g = match obliquity {
                Obliquity::Stam => (f_squared + k * k).powi(2) / (k * k),
                Obliquity::Unit | Obliquity::SmallSlope => 1.0,
            };
            sum += node_power(table, curve, record) * g;
            count += 1;
        }
        if count > 0 {
            last_mean = sum / f64::from(count);
        }
        *mean = last_mean as f32;
    }
    means
}

/// The sampler over the square, for one family of numbers.
#[derive(Clone, Copy)]
pub(super) struct SquareView<N: Numbers> {
    pub layout: SquareLayout,
    /// Table data of the summed-area table.
    pub words: N::Words,
}

/// Quantities of an incidence and a wavelength that all outgoing directions share.
struct Incidence<N: Numbers> {
    /// The square of frequencies, widened to whole blocks of nodes (`summed_area`).
    rectangle: Rectangle<N>,
    /// Index b of the lower of the two bands that are mixed.
    band: N::Index,
    /// Fraction t of the upper band, b + 1.
    upper_fraction: N::Real,
    /// Counts of the rectangle in each band.
    counts: [N::Index; BANDS],
}

impl<N: Numbers> SquareView<N> {
    /// Density of [`Self::draw`] over the plane of outgoing direction cosines, with the arguments of
    /// [`super::SamplerView::density`].
    #[inline(always)]
    pub(super) fn density(
        &self,
        passage: &Passage<N>,
        outgoing: [N::Double; 2],
        reading: &Reading<N>,
        active: N::Mask,
    ) -> N::Real {
        let lit = N::Real::lit;
        let incidence = self.incidence(passage, reading, active);
        let nm = N::widen(reading.wavelength_nm);
        // Position of f in nodes, counted from the first node of the axis.
        let position = [0, 1].map(|i| {
            let axis = &self.layout.axes[i];
            let f = (N::widen(passage.tangential[i]) + outgoing[i]) / nm;
            f.fma(N::Double::lit(1e3 * axis.period_um), N::Double::lit(f64::from(axis.origin)))
        });
        let [x, y] = &self.layout.axes;
        let (taps_x, taps_y) = (self.taps(x, position[0]), self.taps(y, position[1]));
        let (taps_x, taps_y) = (&taps_x[..x.taps as usize], &taps_y[..y.taps as usize]);
        let counts_at_f = self.areas().weighted(taps_x, taps_y, &incidence.rectangle, active);
        let [lower, upper] = incidence.mixed_bands(counts_at_f, self.layout.areas.unit);
        let [total_lower, total_upper] = incidence.mixed_bands(incidence.counts.map(N::real), self.layout.areas.unit);
        let total = total_lower + total_upper;
        // Nodes per area of direction cosines, Px·Py/λ². The factor 10⁶ converts µm² to nm².
        let nodes_per_area = lit(1e6 * x.period_um * y.period_um) / (reading.wavelength_nm * reading.wavelength_nm);
        let has_mass = lit(0.0).lt(total) & active;
        let density = nodes_per_area * (lower + upper) / N::Real::select(has_mass, total, lit(1.0));
        N::Real::select(has_mass, density, lit(0.0))
    }

    /// Draws the direction cosines of outgoing light along x and y from two random numbers, as in
    /// [`super::SamplerView::draw`]. The returned mask is false where nothing is drawn.
    #[inline(always)]
    pub(super) fn draw(
        &self,
        passage: &Passage<N>,
        reading: &Reading<N>,
        [u, v]: [N::Real; 2],
        active: N::Mask,
    ) -> ([N::Real; 2], N::Mask) {
        let lit = N::Real::lit;
        let incidence = self.incidence(passage, reading, active);
        let [lower, upper] = incidence.mixed_bands(incidence.counts.map(N::real), self.layout.areas.unit);
        let has_mass = lit(0.0).lt(lower + upper) & active;
        // Chooses a band by its mass. The random number is rescaled to [0, 1) within the band.
        let target = u * (lower + upper);
        let is_upper = lit(0.0).lt(upper) & lower.le(target);
        let within_band = N::Real::select(is_upper, target - lower, target);
        let mass = N::Real::select(has_mass, N::Real::select(is_upper, upper, lower), lit(1.0));
        let u = (within_band / mass).clip(lit(0.0), lit(super::BELOW_ONE));
        let band = incidence.band + N::Index::select(is_upper, N::Index::lit(1), N::Index::lit(0));
        let drawn = self.areas().choose(&incidence.rectangle, band, [u, v], has_mass);
        let nm = N::widen(reading.wavelength_nm);
        let outgoing = [0, 1].map(|i| {
            let axis = &self.layout.axes[i];
            let offset = match axis.sigma {
                Some(sigma) => normal_quantile(drawn.u[i]) * lit(sigma),
                None => tent_quantile(drawn.u[i]),
            };
            // Position in nodes from frequency 0, and the sampled frequency in cycles/nm.
            let position = N::widen(N::real(drawn.node[i])) - N::Double::lit(f64::from(axis.origin));
            let f = (position + N::widen(offset)) * N::Double::lit(1e-3 / axis.period_um);
            N::narrow(f.fma(nm, -N::widen(passage.tangential[i])))
        });
        (outgoing, has_mass)
    }

    /// The summed-area table.
    #[inline(always)]
    fn areas(&self) -> SummedAreaView<N> {
        SummedAreaView { layout: self.layout.areas, words: self.words }
    }

    /// Prepares the square about the incident tangential vector, and the two bands of κ of an incidence.
    #[inline(always)]
    fn incidence(&self, passage: &Passage<N>, reading: &Reading<N>, active: N::Mask) -> Incidence<N> {
        let lit = N::Real::lit;
        let wavenumber = lit(1e3) / reading.wavelength_nm;
        // Position in nodes of the square's edge: at the outgoing direction cosine ±`passage.reach`, widened by the
        // largest offset `axis.reach`. `side` is −1 or 1.
        let edge = |i: usize, side: f64| {
            let axis = &self.layout.axes[i];
            let cosine = passage.reach.fma(lit(side), passage.tangential[i]);
            (cosine * wavenumber).fma(lit(axis.period_um), lit(f64::from(axis.origin) + side * axis.reach))
        };
        let rectangle = self.areas().rectangle([0, 1].map(|i| edge(i, -1.0)), [0, 1].map(|i| edge(i, 1.0)));
        // A resized relief has one wavelength for κ and another for frequencies.
        let kappa = passage.typical_w * lit(TAU * 1e3) / reading.for_kappa_nm();
        // Position in bands, counted from the centre of the first.
        let position = kappa.fma(lit(self.layout.bands_per_kappa), lit(-0.5)).clip(lit(0.0), lit(BANDS as f64 - 1.0));
        let band = position.floor().min(lit(BANDS as f64 - 2.0));
        let counts = self.areas().counts(&rectangle, active);
        Incidence { rectangle, band: N::index(band), upper_fraction: position - band, counts }
    }

    /// Nodes about a position along an axis (in nodes). Each entry is the index of a node, and the density of a
    /// sample's offset where the offset takes the node to the position. The density is per node spacing. Only the
    /// first `axis.taps` entries count.
    #[inline(always)]
    fn taps(&self, axis: &SquareAxis, position: N::Double) -> [(N::Double, N::Real); TAPS_MAX] {
        // An even number of taps lies half on either side of the position.
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

impl<N: Numbers> Incidence<N> {
    /// Masses in the two bands that are mixed, each times the band's fraction: 1 − t of the lower band, t of the upper
    /// band. `counts` are the counts in all bands, `unit` the mass of one count in each.
    #[inline(always)]
    fn mixed_bands(&self, counts: [N::Real; BANDS], unit: [f32; BANDS]) -> [N::Real; 2] {
        let lit = N::Real::lit;
        let [a, b, c, d] = std::array::from_fn(|i| counts[i] * lit(f64::from(unit[i])));
        // `band` is the lower of two neighbouring bands among four: 0, 1 or 2.
        let (is_first, is_at_most_second) = (self.band.lt(N::Index::lit(1)), self.band.lt(N::Index::lit(2)));
        let pick = |a, b, c| N::Real::select(is_first, a, N::Real::select(is_at_most_second, b, c));
        [pick(a, b, c) * (lit(1.0) - self.upper_fraction), pick(b, c, d) * self.upper_fraction]
    }
}
