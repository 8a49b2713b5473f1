//! Importance sampling of outgoing directions, with the density of each over solid angle (docs/model.md#sampling).
//!
//! Directions are drawn approximately in proportion to `O·S(f; κ)/λ²`. O is the obliquity factor, and the relief's
//! power spectrum `S` a sum of Gaussians about the nodes of a lattice of frequencies. The other factors of the
//! reflectance f_r (Fresnel factor, shadowing, division by the albedo) are left to the sample weight, `f_r·cosθo/pdf`.
//!
//! ```text
//! wi, wo                                unit vectors away from the surface, at the angles θi and θo from the normal z
//! f       = (wi + wo)_xy / λ            spatial frequency of a pair of directions, in cycles/µm
//! κ       = 2π (cosθi + cosθo) / λ      phase rate, in rad per µm of height
//! W_j, f_j                              weight and frequency of node j; W_j is about the node's power times O
//! g(f)                                  Gaussian of a node, with the integral 1
//! p_s(f)  = Σ_j W_j g(f − f_j) / Σ_j W_j     density over frequencies, in µm²
//! pdf(wo) = p_s(f) cosθo / λ²           density over solid angle, in 1/sr: df = cosθo dωo / λ²
//! ```
//!
//! There are two samplers of one wavelength, for few and for many orders, and one sampler of colours. *Orders* are the
//! nodes whose centres belong to outgoing directions:
//!
//! - few orders: a loop over all orders, each with its own weight at the given incidence ([`orders`]);
//! - many orders: weights averaged over bands of κ, in a summed-area table over a square of frequencies ([`square`]);
//! - colours: a summed-area table over a square of direction cosines, without a wavelength ([`ColourSampler`]).
//!
//! All three return the zero vector for a sample below the horizon. None reaches every direction, so the lobes draw a
//! small fraction of the samples uniformly over the hemisphere (`src/lobe/mixture.rs`).
//!
//! Evaluators are generic over a family of numbers `N` (`src/numeric`). An `N::Real` is one number, a SIMD vector or a
//! traced variable; `N::Double` has double precision. Results are zero where the mask `active` is false.

mod colour;
mod orders;
mod square;
pub mod summed_area;
mod tents;

pub(crate) use crate::numeric::math::BELOW_ONE;
use crate::numeric::{Number, Numbers, Plain, Real};
use crate::scattering::{Options, Passage, Reading, TYPICAL_WAVELENGTH_UM};
use crate::table::{NodeCurve, NodeQuantity, SpectralTable};
pub use colour::{ColourSampler, ColourSamplerLayout, ColourSamplerView};
pub use orders::{OrdersAxis, OrdersLayout};
use serde::{Deserialize, Serialize};
pub use square::{SquareAxis, SquareLayout};

/// Largest number of propagating orders for which a relief that varies along one axis only is sampled by [`orders`].
///
/// A loop over ten orders takes about as long as a sample from a [`square`]. But sample weights of gratings have a
/// relative standard deviation of 2 with a square, 0.2 with orders. Larger values reduce the variance of gratings with
/// more orders, at the cost of time; smaller ones do the opposite.
const GRATING_ORDERS_MAX: f64 = 160.0;
/// Largest number of propagating orders for which any other relief is sampled by [`orders`].
///
/// Smaller than [`GRATING_ORDERS_MAX`], because sample weights of reliefs that vary along both axes have a relative
/// standard deviation of only 0.66 with a square, so that orders gain less.
const CROSSED_ORDERS_MAX: f64 = 40.0;

/// The sampler of one surface at single wavelengths: a layout and its table data.
///
/// ```
/// use sunbeam::scattering::Reading;
/// use sunbeam::{Options, Preset, Surface};
///
/// let field = Preset::Blazed.build(None, None)?;
/// let options = Options { coherence_length_um: 20.0, conserve_energy: false, ..Options::default() };
/// let surface = Surface::new(&field, &options)?;
///
/// let sampler = surface.sampler().view::<f64>();
/// let (wi, reading) = ([0.0, 0.0, 1.0], Reading::at(550.0));
/// let wo = sampler.sample(wi, &reading, [0.3, 0.6], true);
/// assert!(wo[2] > 0.0 && sampler.pdf(wi, wo, &reading, true) > 0.0);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Sampler {
    layout: SamplerLayout,
    words: Vec<u32>,
}

/// Layout of a sampler's table data, by the kind of the sampler.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum SamplerLayout {
    /// For few orders: a loop over the orders, each a Gaussian.
    Orders(OrdersLayout),
    /// For many orders: a summed-area table over a square of frequencies.
    Square(SquareLayout),
}

impl Sampler {
    /// Builds the sampler of a table. The options give the obliquity factor and the largest tangential length of
    /// outgoing directions ([`Options::reach`]).
    pub fn new(table: &SpectralTable, options: &Options) -> Self {
        let axes = orders::axes(table);
        let count: f64 = axes.iter().map(|axis| axis.propagating(TYPICAL_WAVELENGTH_UM, options.reach)).product();
        // A grating varies along one axis only.
        let is_grating = axes.iter().any(|axis| axis.nodes == 1);
        let count_max = if is_grating { GRATING_ORDERS_MAX } else { CROSSED_ORDERS_MAX };
        let obliquity = options.sampling_obliquity();
        if count <= count_max {
            let (layout, words) = orders::build(table, obliquity, options.reach);
            Self { layout: SamplerLayout::Orders(layout), words }
        } else {
            let (layout, words) = square::build(table, obliquity, options.reach);
            Self { layout: SamplerLayout::Square(layout), words }
        }
    }

    /// Layout of the table data.
    pub fn layout(&self) -> SamplerLayout {
        self.layout
    }

    /// Table data, described by [`Sampler::layout`].
    pub fn words(&self) -> &[u32] {
        &self.words
    }

    /// Size of the table data in bytes.
    pub fn bytes(&self) -> usize {
        size_of_val(self.words.as_slice())
    }

    /// The sampler over plain numbers, `f32` or `f64`.
    pub fn view<F>(&self) -> SamplerView<Plain<'_, F>>
    where
        for<'a> Plain<'a, F>: Numbers<Words = &'a [u32]>,
    {
        SamplerView { layout: self.layout, words: &self.words }
    }
}

/// A [`Sampler`] for one family of numbers: single values, four lanes, or variables of a recorded kernel
/// (`src/numeric`).
#[derive(Clone, Copy)]
pub struct SamplerView<N: Numbers> {
    /// Layout of the table data.
    pub layout: SamplerLayout,
    /// Table data, [`Sampler::words`].
    pub words: N::Words,
}

impl<N: Numbers> SamplerView<N> {
    /// Density of [`SamplerView::sample`] over solid angle, in 1/sr; zero where the mask is false. `reading` gives the
    /// wavelength.
    ///
    /// Callers make the mask true only for directions above the surface and a wavelength within the table's range.
    #[inline(always)]
    pub fn pdf(&self, wi: [N::Real; 3], wo: [N::Real; 3], reading: &Reading<N>, active: N::Mask) -> N::Real {
        let outgoing = [0, 1].map(|i| N::widen(wo[i]));
        wo[2] * self.density(&Passage::reflection(wi, self.layout.reach()), outgoing, reading, active)
    }

    /// Draws a unit vector `wo` from two random numbers in [0, 1). The zero vector where the drawn direction lies below
    /// the horizon, where nothing is reflected, and where the mask is false.
    ///
    /// Callers make the mask true only for a `wi` above the surface and a wavelength within the table's range.
    #[inline(always)]
    pub fn sample(&self, wi: [N::Real; 3], reading: &Reading<N>, u: [N::Real; 2], active: N::Mask) -> [N::Real; 3] {
        let (outgoing, is_drawn) = self.draw(&Passage::reflection(wi, self.layout.reach()), reading, u, active);
        direction_above::<N>(outgoing, is_drawn)
    }

    /// Density of [`SamplerView::draw`] over the plane of tangential wave vectors; zero where the mask is false.
    /// `outgoing` is the tangential part of the outgoing wave vector, times the sign [`Passage::turn`]. Its unit is the
    /// wave number, that in the medium at a transparent body.
    #[inline(always)]
    pub(crate) fn density(
        &self,
        passage: &Passage<N>,
        outgoing: [N::Double; 2],
        reading: &Reading<N>,
        active: N::Mask,
    ) -> N::Real {
        let words = self.words;
        match self.layout {
            SamplerLayout::Orders(layout) => {
                orders::OrdersView::<N> { layout, words }.density(passage, outgoing, reading, active)
            }
            SamplerLayout::Square(layout) => {
                square::SquareView::<N> { layout, words }.density(passage, outgoing, reading, active)
            }
        }
    }

    /// Draws the tangential part of an outgoing wave vector, times [`Passage::turn`], from two random numbers in [0,
    /// 1). It may lie beyond the passage's reach. The mask is false where nothing is scattered.
    #[inline(always)]
    pub(crate) fn draw(
        &self,
        passage: &Passage<N>,
        reading: &Reading<N>,
        u: [N::Real; 2],
        active: N::Mask,
    ) -> ([N::Real; 2], N::Mask) {
        let words = self.words;
        match self.layout {
            SamplerLayout::Orders(layout) => {
                orders::OrdersView::<N> { layout, words }.draw(passage, reading, u, active)
            }
            SamplerLayout::Square(layout) => {
                square::SquareView::<N> { layout, words }.draw(passage, reading, u, active)
            }
        }
    }
}

impl SamplerLayout {
    /// Largest tangential length of outgoing directions ([`Options::reach`]): 1, or less under a clear layer, which
    /// totally reflects the light beyond.
    fn reach(&self) -> f64 {
        match self {
            Self::Orders(layout) => layout.reach,
            Self::Square(layout) => layout.reach,
        }
    }
}

/// Power of a node at one κ, for which `curve` was prepared. `record` holds the node's power or amplitude over κ
/// ([`SpectralTable`]). Negative powers, where a spline undershoots, become 0.
fn node_power(table: &SpectralTable, curve: &NodeCurve, record: &[f32]) -> f64 {
    match table.quantity() {
        NodeQuantity::Power => curve.power(record).max(0.0),
        NodeQuantity::Amplitude => curve.amplitude(record).norm_sqr(),
    }
}

/// The unit vector above the surface with direction cosines `x` and `y`; the zero vector where `x² + y² ≥ 1` or where
/// the mask is false.
#[inline(always)]
pub(crate) fn direction_above<N: Numbers>([x, y]: [N::Real; 2], active: N::Mask) -> [N::Real; 3] {
    let zero = N::Real::lit(0.0);
    let squared = N::Real::lit(1.0) - x * x - y * y;
    let is_above = zero.lt(squared) & active;
    [x, y, squared.max(zero).sqrt()].map(|c| N::Real::select(is_above, c, zero))
}
