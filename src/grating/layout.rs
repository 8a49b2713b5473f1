//! Layout of a grating's tables: their cells, and the body below the relief.
//!
//! Here k is the wave number in vacuum, 2π/λ, and ky the component of a wave vector along the grooves. The period is
//! d. An order propagates up to a wave number along x, in units of 2π/d, of `t = (d/λ)·√(1 − ky²/k²)` in air and of
//! `tm = (d/λ)·√(n² − ky²/k²)` in a medium of index n. Further symbols are those of `mod.rs`. Directions are unit
//! vectors away from the surface: towards the light or the viewer. Their components are of type `N::Real`: one number,
//! a SIMD vector or a traced variable.

use crate::numeric::{Number, Numbers, Real};
use serde::{Deserialize, Serialize};

/// Layout of a table over wavelengths and cells.
///
/// A cell with the index s is a region of incident waves at which s + 1 orders propagate. Its nodes are spaced equally
/// in coordinates that grow with p and q, the wave's position within the cell (`cell_position.rs`).
///
/// Table data are words of 32 bits. The first `wavelengths · cells` words, `[wavelength][cell]`, are the offsets of the
/// cells, counted in 16-bit halves of words from the beginning of the table. Cell `s` is
/// `[node of p][node of q][incident order][entry]`, with `s + 1` incident orders and `s + 2` entries: the efficiencies
/// of the `s + 1` outgoing orders, by order number, and their sum. An entry is a 16-bit integer in units of 1/40 000
/// (`efficiencies.rs`); two share a word, the lower half first.
///
/// Tables of a film have channels in place of orders: s + 1 orders above, then as many below, so 2(s + 1) rows of
/// 2(s + 1) + 1 entries. Tables of an interface have the cells and channels that [`InterfaceCells`] describes.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct EfficiencyLayout {
    /// First wavelength in nm.
    pub first_nm: f64,
    /// Step between wavelengths in nm.
    pub step_nm: f64,
    /// Number of wavelengths, at least two.
    pub wavelengths: u32,
    /// Number of cells at the shortest wavelength. Longer wavelengths use fewer: the first cells, or, at an interface,
    /// the first cells of the air and the first cells of the medium. Offsets of unused cells have no meaning.
    pub cells: u32,
    /// Nodes along either side of a cell, at least two.
    pub nodes: u32,
    /// Body below the relief.
    pub below: Below,
}

impl EfficiencyLayout {
    /// Layout over equally spaced wavelengths `nm`, at least two, with this number of cells at the shortest, and of
    /// nodes along either side of a cell.
    pub(super) fn new(nm: &[f64], cells: usize, nodes: usize, below: Below) -> Self {
        Self {
            first_nm: nm[0],
            step_nm: nm[1] - nm[0],
            wavelengths: nm.len() as u32,
            cells: cells as u32,
            nodes: nodes as u32,
            below,
        }
    }

    /// Whether light is transmitted, so that there are channels below the relief.
    pub(super) fn transmits(&self) -> bool {
        self.below != Below::Reflector
    }

    /// Refractive index of the medium in which directions below the relief are given: 1 behind a film.
    pub(super) fn eta_below(&self) -> f64 {
        if let Below::Interface(InterfaceCells { eta, .. }) = self.below { eta } else { 1.0 }
    }

    /// Tangential part `[x, y]` of a direction's wave vector over k: the direction's components times the index of its
    /// medium. In double precision, since it is multiplied by d/λ and then split into whole and fractional parts.
    #[inline(always)]
    pub(super) fn tangential<N: Numbers>(&self, w: [N::Real; 3]) -> [N::Double; 2] {
        let index = self.index_at::<N>(w);
        [w[0], w[1]].map(|component| index.map_or(N::widen(component), |index| N::widen(component) * N::widen(index)))
    }

    /// `ky/k` for light that comes from the direction `from` and leaves in the direction `to`: the mean of the ratios
    /// of both waves, which are equal if `to` lies exactly on an order. `from` points against the incident wave, hence
    /// the minus. The magnitude exceeds 1, up to n, where light in the medium is totally reflected.
    #[inline(always)]
    pub(super) fn ky_over_k<N: Numbers>(&self, [from, to]: [[N::Real; 3]; 2]) -> N::Real {
        let [[_, in_y], [_, out_y]] = [from, to].map(|w| self.tangential::<N>(w));
        N::narrow((out_y - in_y) * N::Double::lit(0.5))
    }

    /// Direction whose wave vector has the tangential part `[x, y]`, over k: below the relief where `is_below` is true,
    /// else above it. The zero vector where no order was drawn (`is_drawn` is false) or the wave does not propagate.
    #[inline(always)]
    pub(super) fn direction<N: Numbers>(
        &self,
        [x, y]: [N::Real; 2],
        is_below: N::Mask,
        is_drawn: N::Mask,
    ) -> [N::Real; 3] {
        let (real, zero) = (N::Real::lit, N::Real::lit(0.0));
        let per_index = N::Real::select(is_below, real(1.0 / self.eta_below()), real(1.0));
        // The product is skipped where all directions are in air.
        let [x, y] = if self.eta_below() == 1.0 { [x, y] } else { [x * per_index, y * per_index] };
        let z_squared = real(1.0) - x * x - y * y;
        let exists = is_drawn & zero.lt(z_squared);
        let z = z_squared.max(zero).sqrt();
        let z = if self.transmits() { N::Real::select(is_below, -z, z) } else { z };
        [x, y, z].map(|component| N::Real::select(exists, component, zero))
    }

    /// Refractive index of the medium in which the direction `w` is given; `None` where all directions are in air, so
    /// that callers can skip the product with 1.
    #[inline(always)]
    pub(super) fn index_at<N: Numbers>(&self, w: [N::Real; 3]) -> Option<N::Real> {
        let Below::Interface(InterfaceCells { eta, .. }) = self.below else { return None };
        Some(N::Real::select(w[2].lt(N::Real::lit(0.0)), N::Real::lit(eta), N::Real::lit(1.0)))
    }
}

/// Body below the relief of a table.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum Below {
    /// A body that transmits nothing. Channels lie above the relief only.
    Reflector,
    /// A film with a flat lower side, below which light is in air again.
    Film,
    /// A transparent medium, in which transmitted light propagates on.
    Interface(InterfaceCells),
}

impl Below {
    /// The body below a table whose light is all in air, on this number of sides: 1 or 2.
    pub(super) fn of_sides(sides: usize) -> Self {
        if sides == 1 { Self::Reflector } else { Self::Film }
    }
}

/// Cells of a table of an interface, of two kinds.
///
/// - *Cells of the air*, for `|ky| < k`. Cell s has `s + 1` channels above, which propagate in all of the cell, and
///   `s + 1 + 2·extra` below. As tm > t, the medium has more orders than the air: at most `extra` at either end of
///   their range. Lines at which an order appears in the medium cross these cells; efficiencies have weak singularities
///   there. In cell −1, no order propagates in the air and light is totally reflected.
/// - *Cells of the medium*, for `|ky| ≥ k`. Light in the medium is totally reflected and nothing propagates in the air.
///   Cell s has `s + 1` channels below; tm takes the place of t, and `extra` is 0.
///
/// In the table, cells of the air come first, from cell −1 on, then those of the medium, from cell 0 on. After the
/// offsets of all cells there is one word for each cell, with its `extra`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct InterfaceCells {
    /// Refractive index of the medium, above 1: cells of the medium need total reflection.
    pub eta: f64,
    /// Number of cells of the air, with cell −1.
    pub air_cells: u32,
}
