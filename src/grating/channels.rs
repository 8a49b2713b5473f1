//! Channels of a grating's tables at one wave (symbols: `mod.rs`).
//!
//! A *channel* is an order on one side of the relief. The channels of a cell are numbered: those above come first, then
//! those below, each by ascending order m.

use super::cell_position::CellPosition;
use crate::numeric::{Number, Numbers, Real};

/// Channels at one incident wave, and the position of the wave in the table.
#[derive(Clone, Copy)]
pub(super) struct Channels<N: Numbers> {
    /// Index of the wave's cell in the table.
    pub cell: N::Index,
    /// Coordinates of the wave within its cell ([`CellPosition::coordinates`]).
    pub coordinates: [N::Real; 2],
    /// Number of channels.
    pub count: N::Index,
    /// Numbers of channels above and below.
    side_counts: [N::Double; 2],
    /// Index m of the first order above, and of the first below.
    first_orders: [N::Double; 2],
    /// Bound of propagation below an interface.
    below: Option<BoundBelow<N>>,
}

/// Bound of the waves that propagate below an interface, whose cells have further channels.
#[derive(Clone, Copy)]
pub(super) struct BoundBelow<N: Numbers> {
    /// Wave number `a` of the incident wave along x, in units of 2π/d.
    pub a: N::Double,
    /// Bound of the magnitude of wave numbers along x in the medium, in units of 2π/d.
    pub t: N::Double,
}

impl<N: Numbers> Channels<N> {
    /// Channels in the table's cell `cell`, which has as many orders above as the position's cell. Below there are
    /// `below` times as many orders, 0 or 1.
    #[inline(always)]
    pub(super) fn of_cell(position: &CellPosition<N>, cell: N::Index, below: f64) -> Self {
        let orders = position.cell + N::Double::lit(1.0);
        let first = -position.incident;
        Self::new(position, cell, [orders, orders * N::Double::lit(below)], [first, first], None)
    }

    /// Channels in the table's cell `cell`, with these numbers of orders above and below and these first orders m.
    #[inline(always)]
    pub(super) fn new(
        position: &CellPosition<N>,
        cell: N::Index,
        side_counts: [N::Double; 2],
        first_orders: [N::Double; 2],
        below: Option<BoundBelow<N>>,
    ) -> Self {
        let count = N::index_of_double((side_counts[0] + side_counts[1]).max(N::Double::lit(0.0)));
        Self { cell, coordinates: position.coordinates, count, side_counts, first_orders, below }
    }

    /// Channel of order `m`, below the relief where the mask is true, and whether the order propagates there. The
    /// channel is 0 where the table has none.
    #[inline(always)]
    pub(super) fn of_order(&self, m: N::Double, is_below: N::Mask) -> (N::Index, N::Mask) {
        let (channel, is_tabulated) = self.tabulated(m, is_below);
        match self.below {
            Some(BoundBelow { a, t }) => (channel, is_tabulated & ((a + m).abs().lt(t) | !is_below)),
            None => (channel, is_tabulated),
        }
    }

    /// Channel of order `m` as [`Channels::of_order`], and whether the table has it. Below an interface it also has
    /// orders that do not propagate at this wave, but elsewhere in the cell.
    #[inline(always)]
    pub(super) fn tabulated(&self, m: N::Double, is_below: N::Mask) -> (N::Index, N::Mask) {
        let zero = N::Double::lit(0.0);
        let by_side = |values: [N::Double; 2]| N::Double::select(is_below, values[1], values[0]);
        let number = m - by_side(self.first_orders);
        let is_tabulated = zero.le(number) & number.lt(by_side(self.side_counts));
        let skipped = N::Double::select(is_below, self.side_counts[0], zero);
        (N::index_of_double(N::Double::select(is_tabulated, number + skipped, zero)), is_tabulated)
    }

    /// Order m of a channel, and whether the channel lies below the relief.
    #[inline(always)]
    pub(super) fn order(&self, channel: N::Index) -> (N::Double, N::Mask) {
        let number = N::widen(N::real(channel));
        let [above, _] = self.side_counts;
        let is_below = above.le(number);
        let [first_above, first_below] = self.first_orders;
        (N::Double::select(is_below, number - above + first_below, number + first_above), is_below)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numeric::Plain;

    type Double = Plain<'static, f64>;

    #[test]
    fn orders_propagate_below_t() {
        let (t, a) = (2.7, 0.5);
        let position = CellPosition::<Double>::new(t, a);
        let channels = Channels::of_cell(&position, 5, 1.0);
        for (m, is_below) in (-8..=8).flat_map(|m| [(f64::from(m), false), (f64::from(m), true)]) {
            let (channel, propagates) = channels.of_order(m, is_below);
            assert_eq!(propagates, (a + m).abs() < t, "{m}");
            assert!(!propagates || channels.order(channel) == (m, is_below), "{m}");
        }
        // Orders −3 to 2, on both sides.
        assert_eq!(channels.count, 12);
    }

    #[test]
    fn evanescent_waves_have_no_channel() {
        // Cell 0 with order 1 alone, and cell −1.
        for (t, a) in [(0.3, -1.2), (0.2, 0.4)] {
            let position = CellPosition::<Double>::new(t, a);
            assert!(!Channels::of_cell(&position, 0, 0.0).of_order(0.0, false).1, "{t} {a}");
        }
    }
}
