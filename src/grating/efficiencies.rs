//! Layout of the table of efficiencies, and its interpolation.

use super::place::Place;
use crate::numeric::math::{lerp, u16_pair};
use crate::numeric::{Index, Number, Numbers, Real};
use serde::{Deserialize, Serialize};

/// Efficiency of one unit of a stored 16-bit number. Sums of efficiencies up to 1.09 fit, above one by interpolation
/// error.
pub(crate) const UNIT: f64 = 1.0 / 60_000.0;

/// Arrangement of a table of efficiencies in 32-bit words.
///
/// The first `wavelengths · cells` words hold the beginning of each cell, counted in 16-bit halves. Cell `s` has
/// `nodes²` nodes, the second coordinate fastest. Each node has `s + 1` rows, one per incident order, of `s + 2`
/// halves: the efficiencies of the `s + 1` outgoing orders, then their sum, in units of 1/60 000.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct EfficiencyLayout {
    /// First wavelength in nm.
    pub first_nm: f64,
    /// Distance of wavelengths in nm.
    pub step_nm: f64,
    /// Number of wavelengths, at least two.
    pub wavelengths: u32,
    /// Number of cells at the shortest wavelength; longer wavelengths use fewer.
    pub cells: u32,
    /// Number of nodes along each side of a cell.
    pub nodes: u32,
}

/// A table of efficiencies over one family of numbers.
#[derive(Clone, Copy)]
pub(super) struct EfficiencyView<N: Numbers> {
    pub layout: EfficiencyLayout,
    pub words: N::Words,
}

/// Rows of an incident wave at the corners of its grid cell, with the interpolation weights. Indexed by the outgoing
/// order.
pub(super) struct Row<N: Numbers> {
    /// First half of the row at the four corners, `[shorter, longer wavelength]`.
    begins: [[N::Index; 4]; 2],
    /// Fractions along both coordinates and the wavelength.
    between: [N::Real; 3],
}

impl<N: Numbers> EfficiencyView<N> {
    /// The eight nodes around a wave at a wavelength in nm, those of the shorter wavelength first: `[beginning of the
    /// cell, number of the node]`. Then the fractions along both coordinates and the wavelength.
    #[inline(always)]
    fn nodes(&self, place: &Place<N>, nm: N::Real, active: N::Mask) -> ([[N::Index; 2]; 8], [N::Real; 3]) {
        let (real, index) = (N::Real::lit, N::Index::lit);
        let EfficiencyLayout { first_nm, step_nm, wavelengths, cells, nodes } = self.layout;
        // Lower node and fraction along an axis of `count` nodes.
        let between = |x: N::Real, count: u32| {
            let x = x.clip(real(0.0), real(f64::from(count - 1)));
            let low = x.floor().min(real(f64::from(count - 2)));
            (N::index(low), x - low)
        };
        let (shorter, to_longer) = between((nm - real(first_nm)) * real(1.0 / step_nm), wavelengths);
        let [(low_p, p), (low_q, q)] = place.stretched.map(|s| between(s * real(f64::from(nodes - 1)), nodes));
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

    /// [`EfficiencyView::nodes`] with interpolation weights.
    #[inline(always)]
    pub(super) fn weighted(&self, place: &Place<N>, nm: N::Real, active: N::Mask) -> [([N::Index; 2], N::Real); 8] {
        let one = N::Real::lit(1.0);
        let (nodes, between) = self.nodes(place, nm, active);
        let [p, q, to_longer] = between.map(|x| [one - x, x]);
        std::array::from_fn(|corner| (nodes[corner], to_longer[corner >> 2] * p[corner >> 1 & 1] * q[corner & 1]))
    }

    /// The row of a wave at a wavelength in nm.
    #[inline(always)]
    pub(super) fn row(&self, place: &Place<N>, nm: N::Real, active: N::Mask) -> Row<N> {
        let index = N::Index::lit;
        let (nodes, between) = self.nodes(place, nm, active);
        let cell = place.cell.min(index(self.layout.cells - 1));
        let width = cell + index(1);
        let (row, places) = (width + index(1), width * (width + index(1)));
        let begin = |corner: usize| {
            let [cell_begin, node] = nodes[corner];
            cell_begin + node * places + place.incident.min(cell) * row
        };
        Row { begins: [0, 4].map(|j| std::array::from_fn(|corner| begin(j + corner))), between }
    }

    /// Sum of all efficiencies of the row: the entry after the last order's.
    #[inline(always)]
    pub(super) fn row_total(&self, row: &Row<N>, place: &Place<N>, active: N::Mask) -> N::Real {
        self.entry(row, place.cell + N::Index::lit(1), active)
    }

    /// Efficiency of an order, by its number among the cell's orders ([`Place::outgoing`]).
    #[inline(always)]
    pub(super) fn entry(&self, row: &Row<N>, at: N::Index, active: N::Mask) -> N::Real {
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
