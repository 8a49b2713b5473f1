//! Channels of a grating's tables at one incident wave.
//!
//! A *channel* is an order on one side of the relief: above it, in the air, or below it. Tables store efficiencies
//! between channels. In each cell of a table channels have consecutive indices from 0: those above come first, then
//! those below, each by ascending order m. Which orders propagate is constant within a cell, except below an interface.
//!
//! Wave numbers along x are in units of 2π/d, with the period d. The incident wave has the wave number `a`, and order m
//! has `a + m`. Order m propagates in air where `|a + m| < t` and in a medium where `|a + m| < tm` (further symbols:
//! `mod.rs`). Indices m and numbers of orders are whole numbers in double precision (`N::Double`), the type in which
//! they are computed. The code is generic over `N: Numbers`: one number, a SIMD vector or a traced variable.

use super::cell_position::CellPosition;
use crate::numeric::{Number, Numbers, Real};

/// Channels of the cell that has a given incident wave, and the position of the wave in the table.
#[derive(Clone, Copy)]
pub(super) struct Channels<N: Numbers> {
    /// Index of the wave's cell in the table.
    pub cell: N::Index,
    /// Coordinates of the wave within its cell, in [0, 1] ([`CellPosition::coordinates`]).
    pub coordinates: [N::Real; 2],
    /// Number of channels.
    pub count: N::Index,
    /// Numbers of channels above and below.
    side_counts: [N::Double; 2],
    /// Index m of the first order above, and of the first below.
    first_orders: [N::Double; 2],
    /// Bound of propagation below an interface; `None` where every channel of the cell propagates.
    bound_below: Option<BoundBelow<N>>,
}

/// Bound of the orders that propagate below an interface, where a cell also has channels that do not.
#[derive(Clone, Copy)]
pub(super) struct BoundBelow<N: Numbers> {
    /// Wave number `a` of the incident wave along x, in units of 2π/d.
    pub a: N::Double,
    /// Bound of `|a + m|` in the medium.
    pub tm: N::Double,
}

impl<N: Numbers> Channels<N> {
    /// Channels at a position in the cells of a reflector or film. `cell` is the index of the position's cell, clipped
    /// to the table. `sides_below` is 1 at a film, below which the same orders propagate as above, and 0 at a
    /// reflector.
    #[inline(always)]
    pub(super) fn of_cell(position: &CellPosition<N>, cell: N::Index, sides_below: f64) -> Self {
        // Orders −⌊t + a⌋ to ⌊t − a⌋ propagate; `position.incident` is ⌊t + a⌋, `position.cell` their number minus 1.
        let orders = position.cell + N::Double::lit(1.0);
        let first = -position.incident;
        Self::new(position, cell, [orders, orders * N::Double::lit(sides_below)], [first, first], None)
    }

    /// Channels at a position, in the table's cell with the index `cell`. `side_counts` and `first_orders` are the
    /// numbers of orders and the first orders m, each `[above, below]`.
    #[inline(always)]
    pub(super) fn new(
        position: &CellPosition<N>,
        cell: N::Index,
        side_counts: [N::Double; 2],
        first_orders: [N::Double; 2],
        bound_below: Option<BoundBelow<N>>,
    ) -> Self {
        // Not negative for t ≥ 0; the bound keeps the argument of the conversion in its range in inactive lanes.
        let count = N::index_of_double((side_counts[0] + side_counts[1]).max(N::Double::lit(0.0)));
        Self { cell, coordinates: position.coordinates, count, side_counts, first_orders, bound_below }
    }

    /// Index of the channel of order `m` below the relief where the mask is true, else above it; and whether the order
    /// propagates on that side. The index is 0 where the cell has no such channel.
    #[inline(always)]
    pub(super) fn of_order(&self, m: N::Double, is_below: N::Mask) -> (N::Index, N::Mask) {
        let (channel, is_tabulated) = self.tabulated(m, is_below);
        match self.bound_below {
            Some(BoundBelow { a, tm }) => (channel, is_tabulated & ((a + m).abs().lt(tm) | !is_below)),
            None => (channel, is_tabulated),
        }
    }

    /// Index of the channel of order `m`, like [`Channels::of_order`], and whether the cell has this channel. Below an
    /// interface a cell also has orders that propagate elsewhere in the cell, but not at this wave.
    #[inline(always)]
    pub(super) fn tabulated(&self, m: N::Double, is_below: N::Mask) -> (N::Index, N::Mask) {
        let zero = N::Double::lit(0.0);
        let by_side = |values: [N::Double; 2]| N::Double::select(is_below, values[1], values[0]);
        let place_on_side = m - by_side(self.first_orders);
        let is_tabulated = zero.le(place_on_side) & place_on_side.lt(by_side(self.side_counts));
        // All channels above precede those below.
        let skipped = N::Double::select(is_below, self.side_counts[0], zero);
        (N::index_of_double(N::Double::select(is_tabulated, place_on_side + skipped, zero)), is_tabulated)
    }

    /// Order m of the channel with this index, and whether the channel lies below the relief. Inverse of
    /// [`Channels::tabulated`].
    #[inline(always)]
    pub(super) fn order(&self, channel: N::Index) -> (N::Double, N::Mask) {
        let place = N::widen(N::real(channel));
        let [count_above, _] = self.side_counts;
        let is_below = count_above.le(place);
        let [first_above, first_below] = self.first_orders;
        (N::Double::select(is_below, place - count_above + first_below, place + first_above), is_below)
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
        // Cell ⌊2.7 − 0.5⌋ + ⌊2.7 + 0.5⌋ = 5, of a film.
        let channels = Channels::of_cell(&position, 5, 1.0);
        for (m, is_below) in (-8..=8).flat_map(|m| [(f64::from(m), false), (f64::from(m), true)]) {
            let (channel, propagates) = channels.of_order(m, is_below);
            assert_eq!(propagates, (a + m).abs() < t, "{m}");
            assert!(!propagates || channels.order(channel) == (m, is_below), "{m}");
        }
        // |m + 0.5| < 2.7: orders −3 to 2, on both sides.
        assert_eq!(channels.count, 12);
    }

    #[test]
    fn evanescent_waves_have_no_channel() {
        // (t, a): cell 0, in which only order 1 propagates, and cell −1, in which none does.
        for (t, a) in [(0.3, -1.2), (0.2, 0.4)] {
            let position = CellPosition::<Double>::new(t, a);
            assert!(!Channels::of_cell(&position, 0, 0.0).of_order(0.0, false).1, "{t} {a}");
        }
    }
}
