//! The table of orders' efficiencies.

use super::place::Place;
use crate::numeric::math::{lerp, u16_pair};
use crate::numeric::{Index, Number, Numbers, Real};
use serde::{Deserialize, Serialize};

/// What one unit of a stored number means: a sum of efficiencies passes one by less than a tenth.
pub(super) const UNIT: f64 = 1.0 / 60_000.0;

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
    /// The rows of a wave at a wavelength in nm.
    #[inline(always)]
    pub fn row(&self, place: &Place<N>, nm: N::Real, active: N::Mask) -> Row<N> {
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
        let width = cell + index(1);
        let (row, places) = (width + index(1), width * (width + index(1)));
        let begins = [0, 1].map(|j| {
            let [begin] = N::gather::<1>(self.words, (shorter + index(j)) * index(cells) + cell, active);
            [[0, 0], [0, 1], [1, 0], [1, 1]].map(|[i, j]| {
                let node = (low_p + index(i)) * index(nodes) + low_q + index(j);
                begin + node * places + place.incident.min(cell) * row
            })
        });
        Row { begins, between: [p, q, to_longer] }
    }

    /// An entry of the row: an order of [`Place::outgoing`], or the sum for one more than the last.
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
