//! Lattice of a tile's wave orders (symbols in orders.rs), shared with the struct `OrderGrid` in orders.wgsl.

use bytemuck::{Pod, Zeroable};

/// Number of terms that the shader sums in one turn of its unrolled loop.
pub(super) const TERMS_MULTIPLE: usize = 8;

/// The lattice of a tile's wave orders, as the shaders read it. s is the standard deviation of the coherence window.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub(super) struct OrderGrid {
    /// Extent `(Lx, Ly)` of the tile in µm.
    pub extent_um: [f32; 2],
    /// `2π²s²/L²` along x and y: the window's Gaussian is `exp(−sharpness·d²)` at a distance of d orders.
    pub sharpness: [f32; 2],
    /// Largest |jx| and |jy| of the stored orders; 0 along an axis of one pixel.
    pub reach: [i32; 2],
    /// Number of terms, a multiple of [`TERMS_MULTIPLE`]. Terms beyond the requested ones are zero.
    pub terms: u32,
    /// 0 for Chebyshev, 1 for Taylor.
    pub series: u32,
    /// Half the range of heights, H, in µm.
    pub half_range_um: f32,
    /// `4πs²` in µm²: the power spectrum S at the centre of an order with `|c_j|² = 1`.
    pub peak_um2: f32,
    /// Orders summed along each axis.
    pub neighbourhood: u32,
    /// The κH from which on every term is summed. Below it, one term less is summed per unit of κH. 0 for a given
    /// number of terms, which are all summed at any κH.
    pub argument_of_terms: f32,
}
