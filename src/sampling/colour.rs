//! Sampler by reflected colour, without a wavelength: a summed-area table over sums of direction cosines.
//!
//! ```text
//! wi, wo                                unit vectors away from the surface, at the angles θi and θo from the normal z
//! (u, v, w) = wi + wo                   scattering vector, w = cosθi + cosθo
//! slice b                               one of BANDS equal intervals of w, which lies in [0, 2]
//! node                                  point of a square lattice over (u, v), whose coordinates lie in [−2, 2]
//! F(u, v, w)                            colour in linear sRGB: reflectance integrated over wavelength, without its
//!                                       angular factors (src/colour_table)
//! G = (u² + v² + w²)²/w²                4 O cosθi cosθo for Stam's obliquity factor O; 1 for other factors
//! M_b(u, v) = Σ_channels max(F·G, 0)    mass of a node, summed over quadrature points in slice b
//! count, unit                           stored masses are whole numbers of counts; a slice's unit is the mass of one
//! block                                 4 × 4 nodes, for which sums are stored; squares are widened to whole blocks
//! M(u, v)                               mix of the M_b of two neighbouring slices, about a typical w of the incidence
//! passage                               incident wave vector, and largest tangential length (reach) of outgoing waves
//! turn                                  sign of (u, v) in look-ups: −1 for light from or to below a transparent body's
//!                                       relief, else 1
//! pdf(wo) = M(u, v) cosθo / ∬M du dv    density in 1/sr; the integral is over the widened square wi_xy ± reach
//! ```
//!
//! The power scattered into `du dv = cosθo dωo` is proportional to F·O. The density follows F·G, which lacks only
//! Stam's 1/(cosθi cosθo). F and G depend on `wi + wo` alone, so nothing is tabulated over `wi`. Masses are
//! interpolated bilinearly: every node contributes a tent, the density `1 − |t|` at the distance t in nodes along
//! either axis. Directions `wo` that leave lie in the square `wi_xy ± reach` of `(u, v)`, whose mass is an exact sum
//! ([`SummedArea`]). Samples in the square's corners are no directions and are rejected.
//!
//! `N` is a family of numbers (`src/numeric`): an `N::Real` is one number, a SIMD vector or a traced variable, and
//! `lit` makes a constant.

use super::summed_area::{BANDS, Rectangle, SummedArea, SummedAreaLayout, SummedAreaView};
use super::tents::tent_quantile;
use super::{BELOW_ONE, direction_above};
use crate::numeric::{Index, Number, Numbers, Plain, Real};
use crate::scattering::{Passage, RelativeSize, Vec3};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::array;

/// Wavelength in µm at which tents are as wide as orders. Chosen in the green, where the eye is most sensitive. The
/// width of an order in direction cosines is proportional to the wavelength, so one spacing fits one wavelength only.
const WAVELENGTH_UM: f64 = 0.53;
/// Largest number of nodes from the middle of an axis to its end. Chosen: the table then has (2·468 + 1)² nodes of 9
/// bytes (`summed_area/mod.rs`), 8 MB. More nodes resolve narrower orders; fewer save memory.
const HALF_NODES_MAX: usize = 468;
/// Largest number of quadrature points of a node along an axis. Several are used where nodes are further apart than
/// orders are wide. Chosen: more points miss fewer orders but lengthen the build.
const POINTS_MAX: usize = 4;
/// Largest w at which colours are read, as a fraction of the largest possible w, `√(4 − u² − v²)`, which only `wi = wo`
/// has. Quadrature points of larger w are read at this bound. With a fraction of 1, the largest sample weight of the
/// preset `cd` at 60° is twice as large.
const W_FRACTION_MAX: f64 = 0.97;
/// Quadrature points of a slice of w, as fractions of its width: the midpoint rule with two points.
const SLICE_POINTS: [f64; 2] = [0.25, 0.75];

/// Layout of a colour sampler's table data.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ColourSamplerLayout {
    /// Layout of the summed-area table over `(u, v)`, with u along x and v along y; its bands are the slices of w.
    pub areas: SummedAreaLayout,
    /// Nodes per unit of u and of v.
    pub per_unit: f32,
    /// Index of the middle node along either axis, which lies at u = 0 or v = 0.
    pub middle: u32,
    /// Largest direction cosine of outgoing light along the surface ([`Options::reach`](crate::Options::reach)).
    pub reach: f32,
}

/// A sampler of directions by reflected colour.
///
/// ```
/// use sunbeam::sampling::ColourSampler;
///
/// // A colour that falls off from the mirror direction, u = v = 0.
/// let grey = |[u, v, _]: [f32; 3]| [(-8.0 * (u * u + v * v)).exp(); 3];
/// let sampler = ColourSampler::new(0.1, 1.0, grey);
///
/// let wi = [0.0, 0.0, 1.0];
/// let wo = sampler.sample(wi, [0.4, 0.6]).expect("above the horizon");
/// assert!(sampler.pdf(wi, wo) > sampler.pdf(wi, [0.8, 0.0, 0.6]));
/// ```
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct ColourSampler {
    areas: SummedArea,
    per_unit: f32,
    reach: f32,
}

impl ColourSampler {
    /// Tabulates `reflected`, a colour in linear sRGB at `(u, v, w)`. Directions are drawn in proportion to the sum of
    /// its channels. It is `F·G` (src/sampling/colour.rs), with any further factors that depend on `(u, v, w)` only.
    ///
    /// `order_sigma_per_um` is the standard deviation of an order in cycles/µm; it sets the spacing of nodes. Channels
    /// that are negative or NaN count as zero, and an infinite sum as no mass. `reach` is the largest direction cosine
    /// of outgoing light along the surface, 1 without a cover.
    pub fn new(order_sigma_per_um: f64, reach: f64, reflected: impl Fn([f32; 3]) -> [f32; 3] + Sync) -> Self {
        // A tent that reaches zero at the distance s has the variance s²/6. It is set to that of an order in direction
        // cosines.
        let wanted_spacing = 6f64.sqrt() * order_sigma_per_um * WAVELENGTH_UM;
        // Nodes extend over u and v from −2 to 2.
        let half = ((2.0 / wanted_spacing).ceil() as usize).clamp(1, HALF_NODES_MAX);
        let (nodes, spacing) = (2 * half + 1, 2.0 / half as f64);
        let points = ((spacing / wanted_spacing).ceil() as usize).clamp(1, POINTS_MAX);
        // u or v of a quadrature point of a node: midpoints of `points` parts of the spacing about the node.
        let coordinate = |node: usize, point: usize| {
            (node as f64 - half as f64 + (point as f64 + 0.5) / points as f64 - 0.5) * spacing
        };
        // Masses [v][u][slice].
        let masses: Vec<[f32; BANDS]> = (0..nodes * nodes)
            .into_par_iter()
            .map(|i| {
                let mut sums = [0.0; BANDS];
                for point in 0..points * points {
                    let u = coordinate(i % nodes, point % points);
                    let v = coordinate(i / nodes, point / points);
                    add_point(&mut sums, [u, v], &reflected);
                }
                // A node whose sum overflowed must not take all samples.
                sums.map(|sum| if sum.is_finite() { sum } else { 0.0 })
            })
            .collect();
        Self { areas: SummedArea::new([nodes; 2], &masses), per_unit: (1.0 / spacing) as f32, reach: reach as f32 }
    }

    /// Layout of the table data.
    pub fn layout(&self) -> ColourSamplerLayout {
        let areas = *self.areas.layout();
        ColourSamplerLayout { areas, per_unit: self.per_unit, middle: areas.nodes[0] / 2, reach: self.reach }
    }

    /// Table data, described by [`ColourSampler::layout`].
    pub fn words(&self) -> &[u32] {
        self.areas.words()
    }

    /// Size of the table data in bytes.
    pub fn bytes(&self) -> usize {
        size_of_val(self.words())
    }

    /// The sampler over plain numbers, `f32` or `f64`.
    pub fn view<F>(&self) -> ColourSamplerView<Plain<'_, F>>
    where
        for<'a> Plain<'a, F>: Numbers<Words = &'a [u32]>,
    {
        ColourSamplerView { layout: self.layout(), words: self.words(), size: None }
    }

    /// Density of [`ColourSampler::sample`] over solid angle, in 1/sr; zero unless both directions lie above the
    /// surface.
    pub fn pdf(&self, wi: Vec3, wo: Vec3) -> f64 {
        self.view::<f64>().pdf(wi, wo, true)
    }

    /// Draws a unit vector from two random numbers in [0, 1); `None` where it or `wi` would lie below the horizon, and
    /// where nothing is reflected.
    pub fn sample(&self, wi: Vec3, random: [f64; 2]) -> Option<Vec3> {
        let wo = self.view::<f64>().sample(wi, random, true);
        (wo[2] > 0.0).then_some(wo)
    }
}

/// Adds the mass of a quadrature point `(u, v)` to the sum of each slice of w. Points to which no pair of directions
/// belongs have no mass.
fn add_point(sums: &mut [f32; BANDS], [u, v]: [f64; 2], reflected: &impl Fn([f32; 3]) -> [f32; 3]) {
    // Square of the largest w, from |wi + wo| ≤ 2.
    let w_squared = 4.0 - u * u - v * v;
    if w_squared <= 0.0 {
        return;
    }
    let w_max = W_FRACTION_MAX * w_squared.sqrt();
    for (slice, sum) in sums.iter_mut().enumerate() {
        for fraction in SLICE_POINTS {
            // w extends from 0 to 2 over all slices.
            let w = (2.0 * (slice as f64 + fraction) / BANDS as f64).min(w_max);
            let colour = reflected([u as f32, v as f32, w as f32]);
            *sum += colour.iter().map(|c| c.max(0.0)).sum::<f32>();
        }
    }
}

/// A [`ColourSampler`] for one family of numbers: single values, four lanes, or variables of a recorded kernel
/// (`src/numeric`).
#[derive(Clone, Copy)]
pub struct ColourSamplerView<N: Numbers> {
    /// Layout of the table data.
    pub layout: ColourSamplerLayout,
    /// Table data, [`ColourSampler::words`].
    pub words: N::Words,
    /// Size of the relief at the shaded point, relative to that of the table; `None` for the same size. The table is
    /// read at `(s u, s v, d w)`, with the size's `scale` s and `depth` d.
    pub size: Option<RelativeSize<N::Real>>,
}

impl<N: Numbers> ColourSamplerView<N> {
    /// The summed-area table.
    fn areas(&self) -> SummedAreaView<N> {
        SummedAreaView { layout: self.layout.areas, words: self.words }
    }

    /// Coordinate at which the table is read for the coordinate `u` or `v` of a pair of directions.
    #[inline(always)]
    fn scaled(&self, coordinate: N::Real) -> N::Real {
        self.size.map_or(coordinate, |size| coordinate * size.scale)
    }

    /// Position in nodes, from the first of the axis, of the coordinate `u` or `v` of a pair of directions.
    #[inline(always)]
    fn position(&self, coordinate: N::Real) -> N::Real {
        let lit = |value: f64| N::Real::lit(value);
        self.scaled(coordinate).fma(lit(self.layout.per_unit.into()), lit(self.layout.middle.into()))
    }

    /// Weighted mass of one count in each slice: the slice's unit times the slice's weight at the typical w of the
    /// incidence. Weights interpolate linearly between the centres of slices.
    #[inline(always)]
    fn mass_per_count(&self, passage: &Passage<N>) -> [N::Real; BANDS] {
        let lit = N::Real::lit;
        // Position of the typical w in slices, counted from the centre of the first slice; w extends from 0 to 2.
        let typical_w = passage.typical_w;
        let typical_w = self.size.map_or(typical_w, |size| typical_w * size.depth);
        let position = (typical_w * lit(0.5 * BANDS as f64) - lit(0.5)).clip(lit(0.0), lit(BANDS as f64 - 1.0));
        array::from_fn(|b| {
            let tent = (lit(1.0) - (position - lit(b as f64)).abs()).max(lit(0.0));
            tent * lit(self.layout.areas.unit[b].into())
        })
    }

    /// Square of half side `reach` about the incident tangential vector, which contains all outgoing directions. It is
    /// widened to whole blocks. Also returns its weighted mass in each slice, and the sum of these masses.
    #[inline(always)]
    fn outgoing_square(&self, passage: &Passage<N>, active: N::Mask) -> (Rectangle<N>, [N::Real; BANDS], N::Real) {
        let areas = self.areas();
        let low = passage.tangential.map(|k| self.position(k - passage.reach));
        let high = passage.tangential.map(|k| self.position(k + passage.reach));
        let rectangle = areas.rectangle(low, high);
        let (mass_per_count, counts) = (self.mass_per_count(passage), areas.counts(&rectangle, active));
        let masses: [_; BANDS] = array::from_fn(|b| mass_per_count[b] * N::real(counts[b]));
        (rectangle, masses, masses.into_iter().fold(N::Real::lit(0.0), |sum, mass| sum + mass))
    }

    /// Density of [`ColourSamplerView::sample`] over solid angle, in 1/sr; zero unless both directions lie above the
    /// surface.
    #[inline(always)]
    pub fn pdf(&self, wi: [N::Real; 3], wo: [N::Real; 3], active: N::Mask) -> N::Real {
        let zero = N::Real::lit(0.0);
        let active = active & zero.lt(wi[2]) & zero.lt(wo[2]);
        wo[2] * self.density(&Passage::reflection(wi, self.layout.reach.into()), [wo[0], wo[1]], active)
    }

    /// Draws a unit vector from two random numbers in [0, 1). The zero vector where it or `wi` would lie below the
    /// horizon, where nothing is reflected, and where the mask is false.
    #[inline(always)]
    pub fn sample(&self, wi: [N::Real; 3], random: [N::Real; 2], active: N::Mask) -> [N::Real; 3] {
        let passage = Passage::reflection(wi, self.layout.reach.into());
        let (outgoing, is_drawn) = self.draw(&passage, random, active & N::Real::lit(0.0).lt(wi[2]));
        direction_above::<N>(outgoing, is_drawn)
    }

    /// Density of [`ColourSamplerView::draw`] over the plane of tangential wave vectors; zero where the mask is false.
    /// `outgoing` is the tangential part of the outgoing wave vector, which the caller multiplied by [`Passage::turn`].
    #[inline(always)]
    pub(crate) fn density(&self, passage: &Passage<N>, outgoing: [N::Real; 2], active: N::Mask) -> N::Real {
        let lit = N::Real::lit;
        let (rectangle, _, total) = self.outgoing_square(passage, active);
        // In double precision: a position in single precision has few digits left after the number of its node, too few
        // where the density falls to zero between two nodes.
        let position = [0, 1].map(|axis| {
            let coordinate = N::widen(self.scaled(passage.tangential[axis] + outgoing[axis]));
            let double = |value: f64| N::Double::lit(value);
            coordinate * double(self.layout.per_unit.into()) + double(self.layout.middle.into())
        });
        // Counts of each slice at the position, interpolated between nodes.
        let counts = self.areas().tents(position, &rectangle, active);
        let mass_per_count = self.mass_per_count(passage);
        let mass = (0..BANDS).fold(lit(0.0), |sum, b| mass_per_count[b].fma(counts[b], sum));
        // Nodes per unit of area in (u, v). The integral of M over (u, v) is the total mass, divided by this.
        let nodes_per_area = lit(f64::from(self.layout.per_unit).powi(2));
        // A resized relief reads the table at s·u and s·v, so its nodes are denser by s along either axis.
        let nodes_per_area = self.size.map_or(nodes_per_area, |size| nodes_per_area * size.scale * size.scale);
        let has_mass = active & lit(0.0).lt(total);
        let total = N::Real::select(has_mass, total, lit(1.0));
        N::Real::select(has_mass, mass / total * nodes_per_area, lit(0.0))
    }

    /// Draws the tangential part of an outgoing wave vector from two random numbers in [0, 1). The caller multiplies it
    /// by [`Passage::turn`]. It may lie beyond the passage's reach. The mask is false where nothing is scattered.
    #[inline(always)]
    pub(crate) fn draw(&self, passage: &Passage<N>, random: [N::Real; 2], active: N::Mask) -> ([N::Real; 2], N::Mask) {
        let lit = N::Real::lit;
        let (rectangle, masses, total) = self.outgoing_square(passage, active);
        let has_mass = active & lit(0.0).lt(total);
        // The masses of the slices in turn fill an interval from 0 to the total. The slice that contains the target is
        // the last one with a mass that starts at or before the target. If rounding takes the target to the total,
        // this is the last slice with a mass.
        let target = random[0] * total;
        let (mut slice, mut slice_start, mut slice_mass) = (N::Index::lit(0), lit(0.0), masses[0]);
        let mut start = lit(0.0);
        for (b, &mass) in masses.iter().enumerate() {
            let is_reached = start.le(target) & lit(0.0).lt(mass);
            slice = N::Index::select(is_reached, N::Index::lit(b as u32), slice);
            slice_start = N::Real::select(is_reached, start, slice_start);
            slice_mass = N::Real::select(is_reached, mass, slice_mass);
            start = start + mass;
        }
        // Position of the target within the slice: a random number in [0, 1) that is independent of the choice.
        let divisor = N::Real::select(has_mass, slice_mass, lit(1.0));
        let rescaled = ((target - slice_start) / divisor).clip(lit(0.0), lit(BELOW_ONE));
        let drawn = self.areas().choose(&rectangle, slice, [rescaled, random[1]], has_mass);
        let spacing = lit(1.0 / f64::from(self.layout.per_unit));
        let outgoing = array::from_fn(|axis| {
            let node = N::real(drawn.node[axis]) - lit(self.layout.middle.into());
            let coordinate = (node + tent_quantile(drawn.u[axis])) * spacing;
            self.size.map_or(coordinate, |size| coordinate / size.scale) - passage.tangential[axis]
        });
        (outgoing, has_mass)
    }
}
