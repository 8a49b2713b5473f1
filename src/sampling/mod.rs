//! Samplers: directions drawn in proportion to what a surface reflects, and the densities of the draws.
//!
//! A sampler is built from a table and read by every family of numbers. There are three:
//!
//! | sampler | for | method |
//! | --- | --- | --- |
//! | `orders.rs` | wavelengths, few propagating orders | goes through all orders, then draws from one's Gaussian |
//! | `square.rs` | wavelengths, many orders | draws a node by summed areas over the frequencies |
//! | `colour.rs` | linear sRGB | draws a node by summed areas over `wi + wo` |
//!
//! All lose the draws that fall below the horizon, and none reaches every direction. Lobes therefore mix in a small
//! uniform part (`lobe/mixture.rs`).
//!
//! # Symbols
//!
//! | symbol | meaning |
//! | --- | --- |
//! | q = wi + wo = (u, v, w) | scattering vector; w is the sum of both cosines |
//! | λ | wavelength |
//! | f = (u, v)/λ | frequency in cycles/µm |
//! | κ = 2πw/λ | phase rate in rad/µm |
//! | P(κ) | power of a table's node (an order, where the tile repeats) |
//! | O | obliquity factor (docs/model.md#the-reflectance) |
//! | G = \|q\|⁴/w² | `4·O·cosθi·cosθo` where O is Stam's: a function of q alone |
//!
//! The fraction of power that goes into a node's order is `P·O`. With Stam's factor it is `P·G/(4 cosθi cosθo)`, so
//! that a table of `P·G` over q serves every incidence.

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

/// Most propagating orders, at [`TYPICAL_WAVELENGTH_UM`], of a grating that is sampled order by order. An order costs a
/// tenth of a draw by summed areas, which leave weights with a standard deviation of 2 instead of 0.2.
const GRATING_ORDERS_MAX: f64 = 160.0;
/// Most propagating orders of other surfaces that are sampled order by order. Summed areas leave weights of crossed
/// gratings with a standard deviation of 0.66.
const ORDERS_MAX: f64 = 40.0;
/// Middle of the visible range in µm.
pub(crate) const TYPICAL_WAVELENGTH_UM: f64 = 0.55;
/// Largest single-precision number below one.
pub(crate) const BELOW_ONE: f64 = 1.0 - 1.0 / 16_777_216.0;

/// The sampler of a surface at wavelengths.
///
/// ```
/// use sunbeam::{Options, Preset, Surface};
///
/// let field = Preset::Blazed.build(None, None)?;
/// let options = Options { coherence_length_um: 20.0, conserve_energy: false, ..Options::default() };
/// let surface = Surface::new(&field, &options)?;
/// let sampler = surface.sampler().view::<f64>();
///
/// // Two random numbers draw a direction; its density per solid angle follows.
/// let wi = [0.0, 0.0, 1.0];
/// let wo = sampler.sample(wi, 550.0, [0.3, 0.6], true);
/// assert!(wo[2] > 0.0 && sampler.pdf(wi, wo, 550.0, true) > 0.0);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Sampler {
    layout: SamplerLayout,
    words: Vec<u32>,
}

/// Method of a [`Sampler`], with the layout of its data.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum SamplerLayout {
    /// Order by order.
    Orders(OrdersLayout),
    /// Summed areas over the frequencies.
    Square(SquareLayout),
}

impl Sampler {
    /// Builds the sampler of a table; the obliquity factor is that of the options.
    pub fn new(table: &SpectralTable, options: &Options) -> Self {
        let axes = orders::axes(table);
        let count: f64 = axes.iter().map(|axis| axis.propagating(TYPICAL_WAVELENGTH_UM)).product();
        let is_grating = axes.iter().any(|axis| axis.nodes == 1);
        if count <= if is_grating { GRATING_ORDERS_MAX } else { ORDERS_MAX } {
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

    /// Method and layout.
    pub fn layout(&self) -> SamplerLayout {
        self.layout
    }

    /// Data of the sampler.
    pub fn words(&self) -> &[u32] {
        &self.words
    }

    /// Bytes of the data.
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
    /// Method and layout.
    pub layout: SamplerLayout,
    /// Data of the sampler.
    pub words: N::Words,
}

impl<N: Numbers> SamplerView<N> {
    /// Density of [`SamplerView::sample`] per solid angle, in 1/sr. Both directions must lie above the surface and the
    /// wavelength (nm) within the tables' range. Zero where the mask is false.
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

    /// A direction from two random numbers in [0, 1), for `wi` above the surface and a wavelength (nm) within the
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

/// Unit vector above the surface with the direction cosines (x, y); the zero vector outside the unit disc.
#[inline(always)]
fn direction_above<N: Numbers>([x, y]: [N::Real; 2], active: N::Mask) -> [N::Real; 3] {
    let zero = N::Real::lit(0.0);
    let z_squared = N::Real::lit(1.0) - x * x - y * y;
    let is_above = zero.lt(z_squared) & active;
    [x, y, z_squared.max(zero).sqrt()].map(|c| N::Real::select(is_above, c, zero))
}

/// Quantile of the tent distribution on [−1, 1], whose density is `1 − |x|`.
#[inline(always)]
fn tent_quantile<R: Real>(u: R) -> R {
    let lit = R::lit;
    let is_left = u.lt(lit(0.5));
    let tail = R::select(is_left, u, lit(1.0) - u);
    let magnitude = lit(1.0) - (tail + tail).sqrt();
    R::select(is_left, -magnitude, magnitude)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tent_quantiles_invert_the_distribution() {
        assert_eq!(tent_quantile(0.5f64), 0.0);
        assert!((tent_quantile(0.125f64) + 0.5).abs() < 1e-15 && (tent_quantile(0.875f64) - 0.5).abs() < 1e-15);
    }
}
