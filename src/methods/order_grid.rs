//! How the orders of a tile lie; twin of the struct in orders.wgsl.

use bytemuck::{Pod, Zeroable};

/// Terms that the shader sums in one pass of its loop.
pub(super) const TERMS_MULTIPLE: usize = 8;

/// How the orders lie, for the shaders.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub(super) struct OrderGrid {
    /// Extent `(Lx, Ly)` of the tile.
    pub extent_um: [f32; 2],
    /// The Gaussian of the window falls as `exp(−sharpness·d²)` with the distance d in orders: `2π²s²/L²`.
    pub sharpness: [f32; 2],
    /// Largest |jx| and |jy| that are held; 0 along an axis of one pixel, where there are no others.
    pub reach: [i32; 2],
    /// Number of terms, a multiple of [`TERMS_MULTIPLE`]; those past the ones asked for are zero.
    pub terms: u32,
    /// 0 for Chebyshev, 1 for Taylor.
    pub series: u32,
    /// Half the range of heights, H.
    pub half_range_um: f32,
    /// `4πs²`: S of an order of power 1 at its middle.
    pub peak_um2: f32,
    /// Orders summed along each axis.
    pub neighbourhood: u32,
    /// κH at which every term is needed; 0 where all are asked for at any.
    pub argument_of_terms: f32,
}
