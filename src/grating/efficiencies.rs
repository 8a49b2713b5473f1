//! The table of efficiencies: its layout and look-up (symbols: `mod.rs`). The WGSL twin is in
//! `src/methods/grating.wgsl`.

use super::cell_position::CellPosition;
use crate::numeric::math::{lerp, u16_pair};
use crate::numeric::{Index, Number, Numbers, Real};
use serde::{Deserialize, Serialize};

/// Efficiency that one unit of a stored 16-bit integer represents. The largest integer represents 1.09, which leaves
/// room for sums of efficiencies that exceed 1 by the error of the resampling.
pub(crate) const UNIT: f64 = 1.0 / 60_000.0;

/// Layout of a table over wavelengths and cells.
///
/// Table data are words of 32 bits. The first `wavelengths · cells` words, `[wavelength][cell]`, are the offsets of the
/// cells, counted in 16-bit halves of words from the beginning of the table. Cell `s` is
/// `[node of p][node of q][incident order][entry]`, with `s + 1` incident orders and `s + 2` entries: the efficiencies
/// of the `s + 1` outgoing orders, by order number, and their sum. An entry is a 16-bit integer in units of 1/60 000;
/// two share a word, the lower half first.
///
/// Tables of a body that transmits have two sides. A *channel* is an order on a side; those above the relief come
/// first, then those below, each by order number. There, channels take the place of orders.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct EfficiencyLayout {
    /// First wavelength in nm.
    pub first_nm: f64,
    /// Step between wavelengths in nm.
    pub step_nm: f64,
    /// Number of wavelengths, at least two.
    pub wavelengths: u32,
    /// Number of cells at the shortest wavelength. Longer wavelengths use the first of them.
    pub cells: u32,
    /// Nodes along either side of a cell.
    pub nodes: u32,
    /// Sides of the relief that light arrives at and leaves on: 1 or 2.
    pub sides: u32,
}

/// The table as an evaluator over the numbers `N` reads it. The table of Jones matrices (`polarisation.rs`) has the
/// same nodes and is read through [`EfficiencyView::weighted_nodes`].
#[derive(Clone, Copy)]
pub(super) struct EfficiencyView<N: Numbers> {
    pub layout: EfficiencyLayout,
    pub words: N::Words,
}

/// A node of a table.
#[derive(Clone, Copy)]
pub(super) struct Node<N: Numbers> {
    /// Offset of the node's cell, as stored in the table.
    pub cell_offset: N::Index,
    /// Position of the node within the cell: `node of p · nodes + node of q`.
    pub number: N::Index,
}

/// Rows of one incident order at the eight nodes around a position and wavelength.
pub(super) struct Row<N: Numbers> {
    /// Offsets of the row, in halves of words: `[shorter, longer wavelength][node]`, where bit 1 of the node selects
    /// the upper p and bit 0 the upper q.
    offsets: [[N::Index; 4]; 2],
    /// Fractions of a step from the lower node: along p, q and wavelength.
    fractions: [N::Real; 3],
}

impl<N: Numbers> EfficiencyView<N> {
    /// The eight nodes around a position and a wavelength in nm, and the fractions of a step from the lower node along
    /// p, q and wavelength.
    ///
    /// Nodes are in binary order: bit 2 of the index selects the longer wavelength, bit 1 the upper p, bit 0 the upper
    /// q.
    #[inline(always)]
    fn surrounding_nodes(
        &self,
        position: &CellPosition<N>,
        nm: N::Real,
        active: N::Mask,
    ) -> ([Node<N>; 8], [N::Real; 3]) {
        let (real, index) = (N::Real::lit, N::Index::lit);
        let EfficiencyLayout { first_nm, step_nm, wavelengths, cells, nodes, .. } = self.layout;
        // Lower node of the interval around x among `count` nodes, and the fraction of a step from this node.
        let interval = |x: N::Real, count: u32| {
            let x = x.clip(real(0.0), real(f64::from(count - 1)));
            let low = x.floor().min(real(f64::from(count - 2)));
            (N::index(low), x - low)
        };
        let (shorter, to_longer) = interval((nm - real(first_nm)) * real(1.0 / step_nm), wavelengths);
        let [(low_p, p), (low_q, q)] =
            position.coordinates.map(|coordinate| interval(coordinate * real(f64::from(nodes - 1)), nodes));
        let cell = position.cell.min(index(cells - 1));
        let offsets = [0, 1].map(|j| {
            let [offset] = N::gather::<1>(self.words, (shorter + index(j)) * index(cells) + cell, active);
            offset
        });
        let surrounding = std::array::from_fn(|bits| {
            let [longer, upper_p, upper_q] = [bits >> 2, bits >> 1 & 1, bits & 1];
            let number = (low_p + index(upper_p as u32)) * index(nodes) + low_q + index(upper_q as u32);
            Node { cell_offset: offsets[longer], number }
        });
        (surrounding, [p, q, to_longer])
    }

    /// The eight nodes around a position and a wavelength in nm, each with its weight in trilinear interpolation.
    #[inline(always)]
    pub(super) fn weighted_nodes(
        &self,
        position: &CellPosition<N>,
        nm: N::Real,
        active: N::Mask,
    ) -> [(Node<N>, N::Real); 8] {
        let one = N::Real::lit(1.0);
        let (nodes, fractions) = self.surrounding_nodes(position, nm, active);
        // Weights of the lower and of the upper node along each axis.
        let [p, q, wavelength] = fractions.map(|x| [one - x, x]);
        std::array::from_fn(|bits| (nodes[bits], wavelength[bits >> 2] * p[bits >> 1 & 1] * q[bits & 1]))
    }

    /// Rows of an incident channel at a position, for a wavelength in nm. Masked positions may lie outside the table;
    /// the nearest cell and channel are taken.
    #[inline(always)]
    pub(super) fn row(&self, position: &CellPosition<N>, incident: N::Index, nm: N::Real, active: N::Mask) -> Row<N> {
        let index = N::Index::lit;
        let (nodes, fractions) = self.surrounding_nodes(position, nm, active);
        let channels = self.channels(position);
        // In halves of words.
        let row_length = channels + index(1);
        let node_length = channels * row_length;
        let offset = |bits: usize| {
            let Node { cell_offset, number } = nodes[bits];
            cell_offset + number * node_length + incident.min(channels - index(1)) * row_length
        };
        Row { offsets: [0, 4].map(|first| std::array::from_fn(|bits| offset(first + bits))), fractions }
    }

    /// Number of orders on one side at a position.
    #[inline(always)]
    fn orders(&self, position: &CellPosition<N>) -> N::Index {
        position.cell.min(N::Index::lit(self.layout.cells - 1)) + N::Index::lit(1)
    }

    /// Number of channels at a position.
    #[inline(always)]
    pub(super) fn channels(&self, position: &CellPosition<N>) -> N::Index {
        let orders = self.orders(position);
        if self.layout.sides == 1 { orders } else { orders + orders }
    }

    /// Channel of an order number on the side below the relief where the mask is true, else above.
    #[inline(always)]
    pub(super) fn channel(&self, position: &CellPosition<N>, number: N::Index, is_below: N::Mask) -> N::Index {
        if self.layout.sides == 1 {
            return number;
        }
        N::Index::select(is_below, number + self.orders(position), number)
    }

    /// Channel of light from `wi`, at its position.
    #[inline(always)]
    pub(super) fn incident_channel(&self, position: &CellPosition<N>, wi: [N::Real; 3]) -> N::Index {
        self.channel(position, position.incident, self.is_below(wi))
    }

    /// Whether a direction lies below a relief with two sides.
    #[inline(always)]
    pub(super) fn is_below(&self, w: [N::Real; 3]) -> N::Mask {
        if self.layout.sides == 1 { N::mask(false) } else { w[2].lt(N::Real::lit(0.0)) }
    }

    /// Side and order number of a channel: whether it lies below the relief.
    #[inline(always)]
    pub(super) fn side_and_number(&self, position: &CellPosition<N>, channel: N::Index) -> (N::Mask, N::Index) {
        let orders = self.orders(position);
        if self.layout.sides == 1 {
            return (N::mask(false), channel);
        }
        let is_below = orders.le(channel);
        (is_below, N::Index::select(is_below, channel - orders.min(channel), channel))
    }

    /// Sum of all efficiencies of the row: the entry after that of the last channel.
    #[inline(always)]
    pub(super) fn row_total(&self, row: &Row<N>, position: &CellPosition<N>, active: N::Mask) -> N::Real {
        self.entry(row, self.channels(position), active)
    }

    /// Efficiency of an outgoing channel, or order by its number ([`CellPosition::order_number`]).
    #[inline(always)]
    pub(super) fn entry(&self, row: &Row<N>, number: N::Index, active: N::Mask) -> N::Real {
        let [p, q, to_longer] = row.fractions;
        let [shorter, longer] = row.offsets.map(|nodes| {
            let [low, upper_q, upper_p, both] = nodes.map(|offset| self.half_word(offset + number, active));
            lerp(lerp(low, upper_q, q), lerp(upper_p, both, q), p)
        });
        lerp(shorter, longer, to_longer) * N::Real::lit(UNIT)
    }

    /// The 16-bit integer at an offset in halves of words, as a real number.
    #[inline(always)]
    fn half_word(&self, offset: N::Index, active: N::Mask) -> N::Real {
        let [word] = N::gather::<1>(self.words, offset >> 1, active);
        let [lower, upper] = u16_pair::<N>(word);
        let is_odd = N::Index::lit(1).le(offset & N::Index::lit(1));
        N::Real::select(is_odd, upper, lower)
    }
}
