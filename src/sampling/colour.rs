//! Sampler of a surface in colours (symbols: `mod.rs`).
//!
//! The colour F that a relief reflects is a function of q, and so is F·G. A lattice over (u, v) holds the sum of its
//! positive channels in four bands of w, and tents interpolate between the nodes. For one incidence, `wo` lies in the
//! square `[wi − 1, wi + 1]` of (u, v), whose mass comes from summed areas ([`SummedArea`]) exactly. No table over `wi`
//! is needed. Draws in the corners of the square, outside the unit disc of `wo`, are lost.

use super::summed_area::{BANDS, Rectangle, SummedArea, SummedAreaLayout, SummedAreaView};
use super::{BELOW_ONE, tent_quantile};
use crate::numeric::{Index, Number, Numbers, Plain, Real};
use crate::scattering::Vec3;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::array;

/// Wavelength in µm at which a tent has the variance of an order. Chosen: green, where luminance lies.
const TENT_WAVELENGTH_UM: f64 = 0.53;
/// Most nodes along either axis: 8 MB of data.
const NODES_MAX: usize = 937;
/// Most points along either axis of a node at which the colour is read. More than one are needed where [`NODES_MAX`]
/// leaves nodes wider than orders.
const POINTS_MAX: usize = 4;
/// Heights w within a band at which the colour is read.
const HEIGHTS_PER_BAND: usize = 2;
/// Outgoing cosine assumed when weighting bands. 0.6 minimises the variance of weights (`sunbeam bench`, sampler).
const OUTGOING_COSINE: f64 = 0.6;
/// Largest w that is read, as a fraction of the largest w at a given (u, v), `√(4 − u² − v²)`. Heights of a band beyond
/// it are read there instead. Chosen: off the limit, where both directions coincide.
const HEIGHT_MAX: f64 = 0.97;

/// Layout of a [`ColourSampler`].
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ColourSamplerLayout {
    /// The lattice over (u, v), `[v][u]`; its bands are those of w, a quarter of [0, 2] each.
    pub areas: SummedAreaLayout,
    /// Nodes per unit of u and of v.
    pub per_unit: f32,
    /// Index along either axis of the node at the origin.
    pub middle: u32,
}

/// The sampler of a [`ColourSurface`](crate::lobe::ColourSurface).
///
/// ```
/// use sunbeam::sampling::ColourSampler;
///
/// // A surface that reflects grey around the mirror direction, in orders of 0.2 cycles/µm.
/// let sampler = ColourSampler::new(0.2, |[u, v, _]| [(-4.0 * (u * u + v * v)).exp(); 3]);
/// let wi = [0.0, 0.0, 1.0];
/// let wo = sampler.sample(wi, [0.4, 0.6]).expect("far from the horizon");
/// assert!(wo[2] > 0.5 && sampler.pdf(wi, wo) > 0.0);
/// ```
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct ColourSampler {
    areas: SummedArea,
    per_unit: f32,
}

impl ColourSampler {
    /// Builds the sampler of the colour `reflected([u, v, w])`, in linear sRGB and times G where the obliquity factor
    /// is Stam's. `sigma` is the standard deviation of an order in cycles/µm.
    pub fn new(sigma: f64, reflected: impl Fn([f32; 3]) -> [f32; 3] + Sync) -> Self {
        // A tent of half width h has the variance h²/6.
        let order_width = 6f64.sqrt() * sigma * TENT_WAVELENGTH_UM;
        let half = ((2.0 / order_width).ceil() as usize).clamp(8, (NODES_MAX - 1) / 2);
        let (nodes, spacing) = (2 * half + 1, 2.0 / half as f64);
        let points = ((spacing / order_width).ceil() as usize).clamp(1, POINTS_MAX);
        let coordinate =
            |i: usize, point: usize| (i as f64 - half as f64 + (point as f64 + 0.5) / points as f64 - 0.5) * spacing;
        let values: Vec<[f32; BANDS]> = (0..nodes * nodes)
            .into_par_iter()
            .with_min_len(256)
            .map(|i| {
                let mut sums = [0.0; BANDS];
                for point in 0..points * points {
                    let (u, v) = (coordinate(i % nodes, point % points), coordinate(i / nodes, point / points));
                    let w_max_squared = 4.0 - u * u - v * v;
                    if w_max_squared <= 0.0 {
                        continue;
                    }
                    let w_max = HEIGHT_MAX * w_max_squared.sqrt();
                    for (band, sum) in sums.iter_mut().enumerate() {
                        for height in 0..HEIGHTS_PER_BAND {
                            let within_band = (height as f64 + 0.5) / HEIGHTS_PER_BAND as f64;
                            let w = (2.0 * (band as f64 + within_band) / BANDS as f64).min(w_max);
                            let colour = reflected([u as f32, v as f32, w as f32]);
                            *sum += colour.iter().map(|c| c.max(0.0)).sum::<f32>();
                        }
                    }
                }
                // An infinite mass would take all samples.
                sums.map(|sum| if sum.is_finite() { sum } else { 0.0 })
            })
            .collect();
        Self { areas: SummedArea::new([nodes; 2], &values), per_unit: (1.0 / spacing) as f32 }
    }

    /// Layout of the data.
    pub fn layout(&self) -> ColourSamplerLayout {
        let areas = *self.areas.layout();
        ColourSamplerLayout { areas, per_unit: self.per_unit, middle: areas.nodes[0] / 2 }
    }

    /// Data of the summed areas.
    pub fn words(&self) -> &[u32] {
        self.areas.words()
    }

    /// Bytes of the data.
    pub fn bytes(&self) -> usize {
        size_of_val(self.words())
    }

    /// The sampler over plain numbers, in `f32` or `f64`.
    pub fn view<F>(&self) -> ColourSamplerView<Plain<'_, F>>
    where
        for<'a> Plain<'a, F>: Numbers<Words = &'a [u32]>,
    {
        ColourSamplerView { layout: self.layout(), words: self.words() }
    }

    /// Density of [`ColourSampler::sample`] in 1/sr; zero unless both directions lie above the surface.
    pub fn pdf(&self, wi: Vec3, wo: Vec3) -> f64 {
        self.view::<f64>().pdf(wi, wo, true)
    }

    /// A direction from two random numbers in [0, 1); `None` where the draw falls below the horizon.
    pub fn sample(&self, wi: Vec3, u: [f64; 2]) -> Option<Vec3> {
        let wo = self.view::<f64>().sample(wi, u, true);
        (wo[2] > 0.0).then_some(wo)
    }
}

/// A [`ColourSampler`] over one family of numbers.
#[derive(Clone, Copy)]
pub struct ColourSamplerView<N: Numbers> {
    /// Layout of the data.
    pub layout: ColourSamplerLayout,
    /// [`ColourSampler::words`].
    pub words: N::Words,
}

impl<N: Numbers> ColourSamplerView<N> {
    fn areas(&self) -> SummedAreaView<N> {
        SummedAreaView { layout: self.layout.areas, words: self.words }
    }

    /// Lattice coordinate of a `u` or `v`, in nodes from the first.
    #[inline(always)]
    fn lattice_coordinate(&self, u: N::Real) -> N::Real {
        u.fma(N::Real::lit(self.layout.per_unit.into()), N::Real::lit(self.layout.middle.into()))
    }

    /// Weights of the bands for an incidence: linear interpolation at the assumed w, times the value of a count.
    #[inline(always)]
    fn band_weights(&self, cos_i: N::Real) -> [N::Real; BANDS] {
        let lit = N::Real::lit;
        let coordinate = ((cos_i + lit(OUTGOING_COSINE)) * lit(0.5 * BANDS as f64) - lit(0.5))
            .clip(lit(0.0), lit(BANDS as f64 - 1.0));
        array::from_fn(|b| {
            let tent = (lit(1.0) - (coordinate - lit(b as f64)).abs()).max(lit(0.0));
            tent * lit(self.layout.areas.unit[b].into())
        })
    }

    /// Blocks of the square `[wi − 1, wi + 1]`, and the weighted mass of each band in it.
    #[inline(always)]
    fn square(&self, wi: [N::Real; 3], active: N::Mask) -> (Rectangle<N>, [N::Real; BANDS]) {
        let one = N::Real::lit(1.0);
        let areas = self.areas();
        let low = [0, 1].map(|axis| self.lattice_coordinate(wi[axis] - one));
        let high = [0, 1].map(|axis| self.lattice_coordinate(wi[axis] + one));
        let rectangle = areas.rectangle(low, high);
        let (weights, counts) = (self.band_weights(wi[2]), areas.mass(&rectangle, active));
        (rectangle, array::from_fn(|b| weights[b] * N::real(counts[b])))
    }

    /// Density of [`ColourSamplerView::sample`] per solid angle, in 1/sr; zero unless both directions lie above the
    /// surface.
    #[inline(always)]
    pub fn pdf(&self, wi: [N::Real; 3], wo: [N::Real; 3], active: N::Mask) -> N::Real {
        let lit = N::Real::lit;
        let active = active & lit(0.0).lt(wi[2]) & lit(0.0).lt(wo[2]);
        let (rectangle, masses) = self.square(wi, active);
        let total = masses.into_iter().fold(lit(0.0), |sum, mass| sum + mass);
        let position = [0, 1].map(|axis| N::widen(self.lattice_coordinate(wi[axis] + wo[axis])));
        let tents = self.areas().tents(position, &rectangle, active);
        let weights = self.band_weights(wi[2]);
        let mass = (0..BANDS).fold(lit(0.0), |sum, b| weights[b].fma(tents[b], sum));
        let per_area = lit(f64::from(self.layout.per_unit).powi(2));
        let is_lit = active & lit(0.0).lt(total);
        let total = N::Real::select(is_lit, total, lit(1.0));
        N::Real::select(is_lit, mass / total * per_area * wo[2], lit(0.0))
    }

    /// A direction from two random numbers in [0, 1). The zero vector where the draw falls below the horizon.
    #[inline(always)]
    pub fn sample(&self, wi: [N::Real; 3], u: [N::Real; 2], active: N::Mask) -> [N::Real; 3] {
        let lit = N::Real::lit;
        let active = active & lit(0.0).lt(wi[2]);
        let (rectangle, masses) = self.square(wi, active);
        let total = masses.into_iter().fold(lit(0.0), |sum, mass| sum + mass);
        let is_lit = active & lit(0.0).lt(total);
        // The band whose interval of the running sum holds the target. Where rounding puts the target beyond the end,
        // the last band that has mass.
        let target = u[0] * total;
        let (mut band, mut before, mut own) = (N::Index::lit(0), lit(0.0), masses[0]);
        let mut running = lit(0.0);
        for (b, &mass) in masses.iter().enumerate() {
            let is_reached = running.le(target) & lit(0.0).lt(mass);
            band = N::Index::select(is_reached, N::Index::lit(b as u32), band);
            before = N::Real::select(is_reached, running, before);
            own = N::Real::select(is_reached, mass, own);
            running = running + mass;
        }
        let own = N::Real::select(is_lit, own, lit(1.0));
        let rest = ((target - before) / own).clip(lit(0.0), lit(BELOW_ONE));
        let drawn = self.areas().choose(&rectangle, band, [rest, u[1]], is_lit);
        let per_node = lit(1.0 / f64::from(self.layout.per_unit));
        let [x, y]: [N::Real; 2] = array::from_fn(|axis| {
            let node = N::real(drawn.node[axis]) - lit(self.layout.middle.into());
            (node + tent_quantile(drawn.u[axis])) * per_node - wi[axis]
        });
        let squared = x.fma(x, y * y);
        let is_above = is_lit & squared.lt(lit(1.0));
        let z = (lit(1.0) - squared).max(lit(0.0)).sqrt();
        [x, y, z].map(|c| N::Real::select(is_above, c, lit(0.0)))
    }
}
