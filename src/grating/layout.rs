//! Layout of a grating's tables: their cells, and the body below the relief (symbols: `mod.rs`).

use crate::numeric::{Number, Numbers, Real};
use serde::{Deserialize, Serialize};

/// Layout of a table over wavelengths and cells.
///
/// Table data are words of 32 bits. The first `wavelengths · cells` words, `[wavelength][cell]`, are the offsets of the
/// cells, counted in 16-bit halves of words from the beginning of the table. Cell `s` is
/// `[node of p][node of q][incident order][entry]`, with `s + 1` incident orders and `s + 2` entries: the efficiencies
/// of the `s + 1` outgoing orders, by order number, and their sum. An entry is a 16-bit integer in units of 1/40 000;
/// two share a word, the lower half first.
///
/// Tables of a film have channels on both sides (`channels.rs`) in place of orders, and the same number on either side.
/// Tables of an interface have the cells and channels that [`InterfaceCells`] describes.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct EfficiencyLayout {
    /// First wavelength in nm.
    pub first_nm: f64,
    /// Step between wavelengths in nm.
    pub step_nm: f64,
    /// Number of wavelengths, at least two.
    pub wavelengths: u32,
    /// Number of cells at the shortest wavelength. Longer wavelengths use the first of them; at an interface, the first
    /// of those in the air and of those in the medium.
    pub cells: u32,
    /// Nodes along either side of a cell.
    pub nodes: u32,
    /// Body below the relief.
    pub below: Below,
}

impl EfficiencyLayout {
    /// Whether there are channels below the relief.
    pub(super) fn transmits(&self) -> bool {
        self.below != Below::Reflector
    }

    /// Refractive index in which directions below the relief are given: 1 behind a film.
    pub(super) fn eta_below(&self) -> f64 {
        if let Below::Interface(InterfaceCells { eta, .. }) = self.below { eta } else { 1.0 }
    }

    /// Tangential part of the wave vector of a direction over the wave number in vacuum.
    #[inline(always)]
    pub(super) fn tangential<N: Numbers>(&self, w: [N::Real; 3]) -> [N::Double; 2] {
        let index = self.index_at::<N>(w);
        [w[0], w[1]].map(|component| index.map_or(N::widen(component), |index| N::widen(component) * N::widen(index)))
    }

    /// `ky/k` of the wave between two directions: the mean of those of incident and outgoing light.
    #[inline(always)]
    pub(super) fn groove_cosine<N: Numbers>(&self, [from, to]: [[N::Real; 3]; 2]) -> N::Real {
        let [[_, in_y], [_, out_y]] = [from, to].map(|w| self.tangential::<N>(w));
        N::narrow((out_y - in_y) * N::Double::lit(0.5))
    }

    /// Direction with the tangential part `[x, y]` of the wave vector over the wave number in vacuum, below the relief
    /// where the mask is true. The zero vector where `is_drawn` is false or the wave does not propagate.
    #[inline(always)]
    pub(super) fn direction<N: Numbers>(
        &self,
        [x, y]: [N::Real; 2],
        is_below: N::Mask,
        is_drawn: N::Mask,
    ) -> [N::Real; 3] {
        let (real, zero) = (N::Real::lit, N::Real::lit(0.0));
        let per_index = N::Real::select(is_below, real(1.0 / self.eta_below()), real(1.0));
        let [x, y] = if self.eta_below() == 1.0 { [x, y] } else { [x * per_index, y * per_index] };
        let z_squared = real(1.0) - x * x - y * y;
        let is_off_horizon = is_drawn & zero.lt(z_squared);
        let z = z_squared.max(zero).sqrt();
        let z = if self.transmits() { N::Real::select(is_below, -z, z) } else { z };
        [x, y, z].map(|component| N::Real::select(is_off_horizon, component, zero))
    }

    /// Refractive index in which a direction is given; `None` where all directions are in air.
    #[inline(always)]
    pub(super) fn index_at<N: Numbers>(&self, w: [N::Real; 3]) -> Option<N::Real> {
        let Below::Interface(InterfaceCells { eta, .. }) = self.below else { return None };
        Some(N::Real::select(w[2].lt(N::Real::lit(0.0)), N::Real::lit(eta), N::Real::lit(1.0)))
    }
}

/// Body below the relief of a table.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum Below {
    /// A body that absorbs what it does not reflect: channels above the relief alone.
    Reflector,
    /// A film, behind which light is in air again.
    Film,
    /// A medium in which light goes on.
    Interface(InterfaceCells),
}

/// Cells of a table of an interface.
///
/// Where light propagates in the air, `|ky| < k`, cells are those of the air. The medium has further orders there: cell
/// s has `s + 1` channels above and `s + 1 + 2·extra` below. Lines at which an order appears in the medium cross these
/// cells; efficiencies have weak singularities there. Light in the medium with `|ky| > k` is totally reflected and has
/// channels below alone. Cells are then those of the medium, with tm, its bound of propagation, in place of t.
///
/// Cells of the air come first, from cell −1 without orders above, then those of the medium, from cell 0. Each cell has
/// a word with its `extra`. These words follow the offsets of all cells.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct InterfaceCells {
    /// Index of the medium.
    pub eta: f64,
    /// Number of cells of the air.
    pub air_cells: u32,
}
