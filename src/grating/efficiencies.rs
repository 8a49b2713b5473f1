//! The table of orders' efficiencies.

use super::place::Place;
use crate::numeric::math::{lerp, u16_pair};
use crate::numeric::{Index, Number, Numbers, Real};
use serde::{Deserialize, Serialize};

/// What one unit of a stored number means: a sum of efficiencies passes one by less than a tenth.
pub(crate) const UNIT: f64 = 1.0 / 60_000.0;

/// How the words of a table are to be read.
///
/// The first `wavelengths · cells` words say where a cell begins, in halves of words. A cell of index `s` has `nodes²`
/// places, the second coordinate the faster; at each there are `s + 1` incident waves, and for each of these the
/// efficiencies of the `s + 1` orders and then their sum, halves of a word in units of 1/60 000.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct EfficiencyLayout {
    /// The first wavelength in nm.
    pub first_nm: f64,
    /// From one wavelength to the next in nm.
    pub step_nm: f64,
    /// Number of wavelengths, at least two.
    pub wavelengths: u32,
    /// Number of cells of the shortest wavelength; longer ones have fewer.
    pub cells: u32,
    /// Nodes along either side of a cell.
    pub nodes: u32,
}

/// A table's layout over its words.
#[derive(Clone, Copy)]
pub(super) struct EfficiencyView<N: Numbers> {
    pub layout: EfficiencyLayout,
    pub words: N::Words,
}

/// The rows of a table about a wavelength and a place: what is left is which order.
pub(super) struct Row<N: Numbers> {
    /// Where the row of the incident wave begins at the four corners, of the shorter and of the longer wavelength.
    begins: [[N::Index; 4]; 2],
    /// Where between the corners and the wavelengths.
    between: [N::Real; 3],
}

impl<N: Numbers> EfficiencyView<N> {
    /// Where a wave at a wavelength in nm lies among the nodes of its cell: of each of the eight about it, those of the shorter
    /// wavelength first, where the cell begins and which node it is; and where between them, along both coordinates and the
    /// wavelength.
    #[inline(always)]
    fn nodes(&self, place: &Place<N>, nm: N::Real, active: N::Mask) -> ([[N::Index; 2]; 8], [N::Real; 3]) {
        let (real, index) = (N::Real::lit, N::Index::lit);
        let EfficiencyLayout { first_nm, step_nm, wavelengths, cells, nodes } = self.layout;
        let along = |x: N::Real, count: u32| {
            let x = x.clip(real(0.0), real(f64::from(count - 1)));
            let low = x.floor().min(real(f64::from(count - 2)));
            (N::index(low), x - low)
        };
        let (shorter, to_longer) = along((nm - real(first_nm)) * real(1.0 / step_nm), wavelengths);
        let [(low_p, p), (low_q, q)] = place.stretched.map(|s| along(s * real(f64::from(nodes - 1)), nodes));
        let cell = place.cell.min(index(cells - 1));
        let begins = [0, 1].map(|j| {
            let [begin] = N::gather::<1>(self.words, (shorter + index(j)) * index(cells) + cell, active);
            begin
        });
        let nodes = std::array::from_fn(|corner| {
            let [j, i, k] = [corner >> 2, corner >> 1 & 1, corner & 1];
            [begins[j], (low_p + index(i as u32)) * index(nodes) + low_q + index(k as u32)]
        });
        (nodes, [p, q, to_longer])
    }

    /// [`EfficiencyView::nodes`] with the weight of each.
    #[inline(always)]
    pub fn weighted(&self, place: &Place<N>, nm: N::Real, active: N::Mask) -> [([N::Index; 2], N::Real); 8] {
        let one = N::Real::lit(1.0);
        let (nodes, between) = self.nodes(place, nm, active);
        let [p, q, to_longer] = between.map(|x| [one - x, x]);
        std::array::from_fn(|corner| (nodes[corner], to_longer[corner >> 2] * p[corner >> 1 & 1] * q[corner & 1]))
    }

    /// The rows of a wave at a wavelength in nm.
    #[inline(always)]
    pub fn row(&self, place: &Place<N>, nm: N::Real, active: N::Mask) -> Row<N> {
        let index = N::Index::lit;
        let (nodes, between) = self.nodes(place, nm, active);
        let cell = place.cell.min(index(self.layout.cells - 1));
        let width = cell + index(1);
        let (row, places) = (width + index(1), width * (width + index(1)));
        let of = |corner: usize| {
            let [begin, node] = nodes[corner];
            begin + node * places + place.incident.min(cell) * row
        };
        Row { begins: [0, 4].map(|j| std::array::from_fn(|corner| of(j + corner))), between }
    }

    /// Sum of all efficiencies of the row: the entry after the last order's.
    #[inline(always)]
    pub fn row_total(&self, row: &Row<N>, place: &Place<N>, active: N::Mask) -> N::Real {
        self.entry(row, place.cell + N::Index::lit(1), active)
    }

    /// Efficiency of an order, by its number among the cell's orders ([`Place::outgoing`]).
    #[inline(always)]
    pub fn entry(&self, row: &Row<N>, at: N::Index, active: N::Mask) -> N::Real {
        let [p, q, to_longer] = row.between;
        let [shorter, longer] = row.begins.map(|corners| {
            let [a, b, c, d] = corners.map(|begin| self.half(begin + at, active));
            lerp(lerp(a, b, q), lerp(c, d, q), p)
        });
        lerp(shorter, longer, to_longer) * N::Real::lit(UNIT)
    }

    #[inline(always)]
    fn half(&self, at: N::Index, active: N::Mask) -> N::Real {
        let [word] = N::gather::<1>(self.words, at >> 1, active);
        let [lower, upper] = u16_pair::<N>(word);
        let odd = N::Index::lit(1).le(at & N::Index::lit(1));
        N::Real::select(odd, upper, lower)
    }
}
