//! Directions drawn by what a surface reflects, and their density.
//!
//! Where few orders propagate they are gone through one by one ([`orders`]); else nodes are drawn within a square ([`square`]).
//! Both leave samples below the horizon, which are lost, and neither reaches everywhere: a small share of samples has to be drawn
//! evenly besides.

mod colour;
mod orders;
mod square;
pub mod summed_area;

use crate::numeric::{Number, Numbers, Plain, Real};
use crate::scattering::{Obliquity, Options};
use crate::table::SpectralTable;
pub use colour::{ColourSampler, ColourSamplerLayout, ColourSamplerView};
pub use orders::{OrdersAxis, OrdersLayout};
use serde::{Deserialize, Serialize};
pub use square::{SquareAxis, SquareLayout};

/// Most orders that are gone through one by one, at [`TYPICAL_WAVELENGTH_UM`]: of reliefs along one axis, and of others. Each
/// takes about a tenth of what drawing in squares takes. Squares leave weights of gratings with a standard deviation of 2 in
/// place of 0.2, and those of crossed gratings with 0.66.
const ORDERS_MAX: (f64, f64) = (160.0, 40.0);
const TYPICAL_WAVELENGTH_UM: f64 = 0.55;
/// The largest number of single precision below one.
const BELOW_ONE: f64 = 1.0 - 1.0 / 16_777_216.0;

/// The sampler of one surface.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Sampler {
    layout: SamplerLayout,
    words: Vec<u32>,
}

/// How a surface is sampled, in plain numbers; they say where the sampler's words have what.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum SamplerLayout {
    /// Orders along one axis, each a Gaussian.
    Orders(OrdersLayout),
    /// Summed areas over the square of frequencies.
    Square(SquareLayout),
}

impl Sampler {
    /// The sampler of a table, of which the options say the obliquity factor.
    pub fn new(table: &SpectralTable, options: &Options) -> Self {
        let axes = orders::axes(table);
        let count: f64 = axes.iter().map(|axis| axis.propagating(TYPICAL_WAVELENGTH_UM)).product();
        let is_grating = axes.iter().any(|axis| axis.nodes == 1);
        if count <= if is_grating { ORDERS_MAX.0 } else { ORDERS_MAX.1 } {
            return Self::orders(table, options.proposed());
        }
        Self::square(table, options.proposed())
    }

    fn orders(table: &SpectralTable, obliquity: Obliquity) -> Self {
        let (layout, words) = orders::build(table, obliquity);
        Self { layout: SamplerLayout::Orders(layout), words }
    }

    fn square(table: &SpectralTable, obliquity: Obliquity) -> Self {
        let (layout, words) = square::build(table, obliquity);
        Self { layout: SamplerLayout::Square(layout), words }
    }

    /// Where the words have what.
    pub fn layout(&self) -> SamplerLayout {
        self.layout
    }

    /// The words.
    pub fn words(&self) -> &[u32] {
        &self.words
    }

    /// Bytes held.
    pub fn bytes(&self) -> usize {
        size_of_val(self.words.as_slice())
    }

    /// The sampler by value, in `f32` or `f64`.
    pub fn view<F>(&self) -> SamplerView<Plain<'_, F>>
    where
        for<'a> Plain<'a, F>: Numbers<Words = &'a [u32]>,
    {
        SamplerView { layout: self.layout, words: &self.words }
    }
}

/// A [`Sampler`] to be read by one family of numbers.
#[derive(Clone, Copy)]
pub struct SamplerView<N: Numbers> {
    /// How the words are to be read.
    pub layout: SamplerLayout,
    /// The powers.
    pub words: N::Words,
}

impl<N: Numbers> SamplerView<N> {
    /// Density over solid angle (1/sr) of [`SamplerView::sample`], for directions above the surface and wavelengths of the
    /// tables' range; zero where the mask is false.
    #[inline(always)]
    pub fn pdf(&self, wi: [N::Real; 3], wo: [N::Real; 3], wavelength_nm: N::Real, active: N::Mask) -> N::Real {
        let words = self.words;
        match self.layout {
            SamplerLayout::Orders(layout) => {
                orders::OrdersView::<N> { layout, words }.pdf(wi, wo, wavelength_nm, active)
            }
            SamplerLayout::Square(layout) => {
                square::SquareView::<N> { layout, words }.pdf(wi, wo, wavelength_nm, active)
            }
        }
    }

    /// A direction from two random numbers in [0, 1), for an incidence above the surface and a wavelength of the tables' range.
    /// The zero vector where the direction drawn lies below the horizon, where nothing is reflected, and where the mask is
    /// false.
    #[inline(always)]
    pub fn sample(&self, wi: [N::Real; 3], wavelength_nm: N::Real, u: [N::Real; 2], active: N::Mask) -> [N::Real; 3] {
        let words = self.words;
        match self.layout {
            SamplerLayout::Orders(layout) => {
                orders::OrdersView::<N> { layout, words }.sample(wi, wavelength_nm, u, active)
            }
            SamplerLayout::Square(layout) => {
                square::SquareView::<N> { layout, words }.sample(wi, wavelength_nm, u, active)
            }
        }
    }
}

/// The unit vector above the plane with these direction cosines, or the zero vector.
#[inline(always)]
fn direction_above<N: Numbers>([x, y]: [N::Real; 2], active: N::Mask) -> [N::Real; 3] {
    let zero = N::Real::lit(0.0);
    let squared = N::Real::lit(1.0) - x * x - y * y;
    let there = zero.lt(squared) & active;
    [x, y, squared.max(zero).sqrt()].map(|c| N::Real::select(there, c, zero))
}
