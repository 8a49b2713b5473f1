//! Sampler of colours: directions drawn in proportion to the reflected colour, integrated over wavelength.
//!
//! With Stam's obliquity factor, `O·cosθi·cosθo = G/4` with `G = (u² + v² + w²)²/w²`. Both `G` and the colour `F`
//! depend on the scattering vector `(u, v, w) = wi + wo` alone. A lattice over `(u, v)` holds the sum of the positive
//! channels of `F·G` in four slices of w; tents interpolate between its nodes. The hemisphere of `wo` lies within the
//! square `[wi − 1, wi + 1]` of `(u, v)`, whose mass a [`SummedArea`] gives exactly, so nothing is tabulated over `wi`.
//! Draws in the square's corners are lost.

use super::summed_area::{BANDS, SummedArea, SummedAreaLayout, SummedAreaView};
use crate::numeric::{Index, Number, Numbers, Plain, Real};
use crate::scattering::Vec3;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::array;

/// Wavelength in µm at which a tent has the variance of an order: the eye's most sensitive.
const WAVELENGTH_UM: f64 = 0.53;
/// Largest number of nodes along each axis; they take 8 MB.
const NODES_MAX: usize = 937;
/// Largest number of samples of the colour per node and axis, for nodes further apart than an order's width.
const SAMPLES_MAX: usize = 4;
/// Positions within a slice of w, in its width, at which the colour is sampled.
const HEIGHTS: [f64; 2] = [0.25, 0.75];
/// Outgoing cosine assumed when slices are weighted; 0.6 minimises the weights' variance (bench sampler).
const MEAN_COSINE: f64 = 0.6;
/// Largest sampled w, as a fraction of the largest possible one at `(u, v)`. Beyond it `wo` grazes the surface.
const HEIGHT_MAX: f64 = 0.97;

/// Layout of the sampler's table data.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ColourSamplerLayout {
    /// Summed areas over `(u, v)`, `[v][u]`; the bands are slices of w.
    pub areas: SummedAreaLayout,
    /// Nodes per unit of u and v.
    pub per_unit: f32,
    /// Index of the node at 0 along each axis.
    pub middle: u32,
}

/// Sampler of one surface in colours.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct ColourSampler {
    areas: SummedArea,
    per_unit: f32,
}

impl ColourSampler {
    /// Builds the sampler from `reflected(u, v, w)`: the colour, times `G` for Stam's obliquity. `sigma` is the
    /// standard deviation of an order in cycles/µm.
    pub fn new(sigma: f64, reflected: impl Fn([f32; 3]) -> [f32; 3] + Sync) -> Self {
        // A tent of this spacing has the variance of an order.
        let wanted = 6f64.sqrt() * sigma * WAVELENGTH_UM;
        let half = ((2.0 / wanted).ceil() as usize).clamp(8, (NODES_MAX - 1) / 2);
        let (nodes, spacing) = (2 * half + 1, 2.0 / half as f64);
        let samples = ((spacing / wanted).ceil() as usize).clamp(1, SAMPLES_MAX);
        let at =
            |i: usize, sample: usize| (i as f64 - half as f64 + (sample as f64 + 0.5) / samples as f64 - 0.5) * spacing;
        let values: Vec<[f32; BANDS]> = (0..nodes * nodes)
            .into_par_iter()
            .with_min_len(256)
            .map(|i| {
                let mut sums = [0.0; BANDS];
                for sample in 0..samples * samples {
                    let (u, v) = (at(i % nodes, sample % samples), at(i / nodes, sample / samples));
                    let rest = 4.0 - u * u - v * v;
                    if rest <= 0.0 {
                        continue;
                    }
                    let largest = HEIGHT_MAX * rest.sqrt();
                    for (band, sum) in sums.iter_mut().enumerate() {
                        for height in HEIGHTS {
                            let w = (2.0 * (band as f64 + height) / BANDS as f64).min(largest);
                            let colour = reflected([u as f32, v as f32, w as f32]);
                            *sum += colour.iter().map(|c| c.max(0.0)).sum::<f32>();
                        }
                    }
                }
                // An overflow or NaN would attract every sample.
                sums.map(|sum| if sum.is_finite() { sum } else { 0.0 })
            })
            .collect();
        Self { areas: SummedArea::new([nodes; 2], &values), per_unit: (1.0 / spacing) as f32 }
    }

    /// Layout of the sampler's table data.
    pub fn layout(&self) -> ColourSamplerLayout {
        let areas = *self.areas.layout();
        ColourSamplerLayout { areas, per_unit: self.per_unit, middle: areas.nodes[0] / 2 }
    }

    /// Table data.
    pub fn words(&self) -> &[u32] {
        self.areas.words()
    }

    /// Bytes held.
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

    /// Density of [`ColourSampler::sample`] in 1/sr.
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
    /// Layout.
    pub layout: ColourSamplerLayout,
    /// Table data.
    pub words: N::Words,
}

impl<N: Numbers> ColourSamplerView<N> {
    fn areas(&self) -> SummedAreaView<N> {
        SummedAreaView { layout: self.layout.areas, words: self.words }
    }

    /// Position of a `u` or `v`, in nodes.
    #[inline(always)]
    fn position(&self, u: N::Real) -> N::Real {
        u.fma(N::Real::lit(self.layout.per_unit.into()), N::Real::lit(self.layout.middle.into()))
    }

    /// Interpolation weights of the slices for an incidence, times the units of their counts.
    #[inline(always)]
    fn slices(&self, cos_i: N::Real) -> [N::Real; BANDS] {
        let lit = N::Real::lit;
        let at =
            ((cos_i + lit(MEAN_COSINE)) * lit(0.5 * BANDS as f64) - lit(0.5)).clip(lit(0.0), lit(BANDS as f64 - 1.0));
        array::from_fn(|b| {
            let tent = (lit(1.0) - (at - lit(b as f64)).abs()).max(lit(0.0));
            tent * lit(self.layout.areas.unit[b].into())
        })
    }

    /// Blocks that cover the square, and the weighted mass of each slice.
    #[inline(always)]
    fn square(&self, wi: [N::Real; 3], active: N::Mask) -> (super::summed_area::Rectangle<N>, [N::Real; BANDS]) {
        let one = N::Real::lit(1.0);
        let areas = self.areas();
        let low = [0, 1].map(|axis| self.position(wi[axis] - one));
        let high = [0, 1].map(|axis| self.position(wi[axis] + one));
        let rectangle = areas.rectangle(low, high);
        let (weights, counts) = (self.slices(wi[2]), areas.mass(&rectangle, active));
        (rectangle, array::from_fn(|b| weights[b] * N::real(counts[b])))
    }

    /// Density of [`ColourSamplerView::sample`] in 1/sr; zero unless both directions lie above the surface.
    #[inline(always)]
    pub fn pdf(&self, wi: [N::Real; 3], wo: [N::Real; 3], active: N::Mask) -> N::Real {
        let lit = N::Real::lit;
        let active = active & lit(0.0).lt(wi[2]) & lit(0.0).lt(wo[2]);
        let (rectangle, masses) = self.square(wi, active);
        let total = masses.into_iter().fold(lit(0.0), |sum, mass| sum + mass);
        let position = [0, 1].map(|axis| N::widen(self.position(wi[axis] + wo[axis])));
        let tents = self.areas().tents(position, &rectangle, active);
        let weights = self.slices(wi[2]);
        let here = (0..BANDS).fold(lit(0.0), |sum, b| weights[b].fma(tents[b], sum));
        let per_area = lit(f64::from(self.layout.per_unit).powi(2));
        let some = active & lit(0.0).lt(total);
        let total = N::Real::select(some, total, lit(1.0));
        N::Real::select(some, here / total * per_area * wo[2], lit(0.0))
    }

    /// A direction from two random numbers in [0, 1); the zero vector where the draw falls below the horizon.
    #[inline(always)]
    pub fn sample(&self, wi: [N::Real; 3], u: [N::Real; 2], active: N::Mask) -> [N::Real; 3] {
        let lit = N::Real::lit;
        let active = active & lit(0.0).lt(wi[2]);
        let (rectangle, masses) = self.square(wi, active);
        let total = masses.into_iter().fold(lit(0.0), |sum, mass| sum + mass);
        let some = active & lit(0.0).lt(total);
        // Chooses a slice and rescales the random number.
        let target = u[0] * total;
        let (mut band, mut below, mut mass) = (N::Index::lit(0), lit(0.0), masses[0]);
        let mut passed = lit(0.0);
        for (b, &of_band) in masses.iter().enumerate() {
            // If rounding leaves the target beyond the end, the last slice with any mass stays chosen.
            let here = passed.le(target) & lit(0.0).lt(of_band);
            band = N::Index::select(here, N::Index::lit(b as u32), band);
            below = N::Real::select(here, passed, below);
            mass = N::Real::select(here, of_band, mass);
            passed = passed + of_band;
        }
        let positive = N::Real::select(some, mass, lit(1.0));
        let rest = ((target - below) / positive).clip(lit(0.0), lit(1.0 - 1.0 / 16_777_216.0));
        let drawn = self.areas().choose(&rectangle, band, [rest, u[1]], some);
        let per_node = lit(1.0 / f64::from(self.layout.per_unit));
        let [x, y]: [N::Real; 2] = array::from_fn(|axis| {
            let node = N::real(drawn.node[axis]) - lit(self.layout.middle.into());
            (node + tent(drawn.u[axis])) * per_node - wi[axis]
        });
        let squared = x.fma(x, y * y);
        let above = some & squared.lt(lit(1.0));
        let z = (lit(1.0) - squared).max(lit(0.0)).sqrt();
        [x, y, z].map(|c| N::Real::select(above, c, lit(0.0)))
    }
}

/// Quantile function of a tent on (−1, 1).
#[inline(always)]
fn tent<R: Real>(u: R) -> R {
    let lit = R::lit;
    let twice = u + u;
    let left = twice.sqrt() - lit(1.0);
    let right = lit(1.0) - (lit(2.0) - twice).max(lit(0.0)).sqrt();
    R::select(u.lt(lit(0.5)), left, right)
}
