//! Lattice of a tile's diffraction orders (symbols: orders.rs), in Rust and as the struct `OrderGrid` of orders.wgsl.

use bytemuck::{Pod, Zeroable};

/// Number of terms of the phase screen's series that the shader sums in one iteration of its unrolled loop.
pub(super) const TERMS_MULTIPLE: usize = 8;

/// Lattice of a tile's diffraction orders, as the shaders read it. Distances between positions are in orders: 1 between
/// neighbouring orders.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub(super) struct OrderGrid {
    /// Extent `(Lx, Ly)` of the tile in µm.
    pub extent_um: [f32; 2],
    /// `2π²s²/L²` along x and y, with the standard deviation s of the coherence window and the extent L. The window's
    /// Gaussian is `exp(−sharpness·d²)` at the distance d along the axis.
    pub sharpness: [f32; 2],
    /// Largest |jx| and |jy| of the stored orders; 0 along an axis of one pixel.
    pub reach: [i32; 2],
    /// Number of stored terms, a multiple of [`TERMS_MULTIPLE`]. Terms beyond the required ones are zero.
    pub terms: u32,
    /// Series of the phase screen: 0 for Chebyshev, 1 for Taylor.
    pub series: u32,
    /// Half the range of heights, H, in µm.
    pub half_range_um: f32,
    /// Power spectrum S at the centre of an order with `|c_j|² = 1`, in µm²: `4πs²`, or `Lx·Ly·P·Q` in PQ (pq.rs).
    pub peak_um2: f32,
    /// Orders summed along each axis.
    pub neighbourhood: u32,
    /// Smallest κH, with the phase rate κ in rad/µm, at which every stored term is summed. For each unit of κH below it
    /// the series needs at least one term less, and one less is summed. The number is rounded up, in Rust to an even
    /// one and in the shader to a multiple of [`TERMS_MULTIPLE`]. 0 where the options give the number of terms: all are
    /// then summed at any κH.
    pub full_terms_kappa_h: f32,
}
