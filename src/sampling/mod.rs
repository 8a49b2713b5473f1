//! Samplers: directions drawn in proportion to the relief's power, and their density.
//!
//! | file | draws | for |
//! | --- | --- | --- |
//! | `orders.rs` | one of all propagating orders, then a point of its Gaussian | few orders: gratings, coarse lattices |
//! | `square.rs` | a node within a square of frequencies, by summed areas | many orders: skins, scans |
//! | `colour.rs` | a node over `(u, v)` by its colour | renderers that carry colours |
//! | `summed_area/` | the summed-area table of the latter two | |
//!
//! Some draws fall below the horizon and are lost, and no sampler covers every direction. Lobes therefore mix in a
//! uniform part (src/lobe/mixture.rs).

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

/// Largest number of orders at [`TYPICAL_WAVELENGTH_UM`] that `orders.rs` serves: for reliefs along one axis, and for
/// others. An order costs about a tenth of a draw in a square. Squares leave weights of gratings a standard deviation
/// of 2 instead of 0.2, and those of crossed gratings 0.66 (bench sampler).
const ORDERS_MAX: (f64, f64) = (160.0, 40.0);
/// Wavelength in µm at which orders are counted, in the middle of the visible range.
const TYPICAL_WAVELENGTH_UM: f64 = 0.55;
/// Largest number of single precision below one.
const BELOW_ONE: f64 = 1.0 - 1.0 / 16_777_216.0;

/// Sampler of one surface at wavelengths.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Sampler {
    layout: SamplerLayout,
    words: Vec<u32>,
}

/// Kind of a sampler, and the layout of its table data.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum SamplerLayout {
    /// Orders, each a Gaussian.
    Orders(OrdersLayout),
    /// Summed areas over a square of frequencies.
    Square(SquareLayout),
}

impl Sampler {
    /// Builds the sampler of a table, weighted with the options' obliquity factor.
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

    /// Kind and layout.
    pub fn layout(&self) -> SamplerLayout {
        self.layout
    }

    /// Table data.
    pub fn words(&self) -> &[u32] {
        &self.words
    }

    /// Bytes held.
    pub fn bytes(&self) -> usize {
        size_of_val(self.words.as_slice())
    }

    /// The sampler over plain numbers, in `f32` or `f64`.
    pub fn view<F>(&self) -> SamplerView<Plain<'_, F>>
    where
        for<'a> Plain<'a, F>: Numbers<Words = &'a [u32]>,
    {
        SamplerView { layout: self.layout, words: &self.words }
    }
}

/// A [`Sampler`] over one family of numbers.
#[derive(Clone, Copy)]
pub struct SamplerView<N: Numbers> {
    /// Kind and layout.
    pub layout: SamplerLayout,
    /// Table data.
    pub words: N::Words,
}

impl<N: Numbers> SamplerView<N> {
    /// Density of [`SamplerView::sample`] per solid angle, in 1/sr, for directions above the surface and wavelengths
    /// within the tables' range. Zero where the mask is false.
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

    /// A direction from two random numbers in [0, 1), for an incidence above the surface and a wavelength within the
    /// tables' range. The zero vector where the draw falls below the horizon, where nothing is reflected, and where the
    /// mask is false.
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
