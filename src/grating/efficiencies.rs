//! Look-up in the table of efficiencies: trilinear interpolation in the wavelength and in a wave's position within its
//! cell. The WGSL twin is in `src/methods/grating.wgsl`.
//!
//! - A *cell* is a region of incident waves in which the same orders propagate (`layout.rs`). (p, q) is the position in
//!   it, 0 to 1 each (`cell_position.rs`).
//! - A *channel* is an order on one side of the relief (`channels.rs`).
//! - Other symbols are those of `mod.rs`.
//!
//! The code is generic over `N: Numbers`: an `N::Real` is one number, a SIMD vector or a traced variable, an
//! `N::Double` the same in double precision. Data are read only in the lanes in which the mask `active` is true.

use super::cell_position::{CellPosition, groove_t};
use super::channels::{BoundBelow, Channels};
use super::layout::{Below, EfficiencyLayout, InterfaceCells};
use crate::numeric::math::{lerp, u16_pair};
use crate::numeric::{Index, Number, Numbers, Real};

/// Efficiency that one unit of a stored 16-bit integer represents. The largest integer represents 1.64, above 1, since
/// the sum of a row may exceed 1: by errors of the resampling, and at an interface by stored channels that do not
/// propagate at a node. A larger unit would round more.
pub(crate) const UNIT: f64 = 1.0 / 40_000.0;

/// A table of efficiencies as an evaluator over the numbers `N` reads it. The table of Jones matrices
/// (`polarisation.rs`) has the same nodes and is read through [`EfficiencyView::weighted_nodes`].
#[derive(Clone, Copy)]
pub(super) struct EfficiencyView<N: Numbers> {
    pub layout: EfficiencyLayout,
    /// Table data, arranged as [`EfficiencyLayout`] describes.
    pub words: N::Words,
}

/// Upper bounds of `|a + m|` at which order m propagates. `a + m` is its wave number along x in units of 2π/d, where a
/// is the incident wave's. The bounds are `t = (d/λ)·√(1 − ky²/k²)` in the air and `tm = (d/λ)·√(n² − ky²/k²)` in a
/// medium of index n.
pub(super) struct Bounds<N: Numbers> {
    /// Bound over which the wave's cells are defined: t, or tm where no order propagates in the air.
    of_cells: N::Double,
    /// At an interface: whether `|ky| ≥ k`, so that no order propagates in the air, and tm. `None` elsewhere.
    at_interface: Option<(N::Mask, N::Double)>,
}

/// A node of a table: a position (p, q) in a cell at one of the table's wavelengths.
#[derive(Clone, Copy)]
pub(super) struct Node<N: Numbers> {
    /// Offset of the node's cell as stored in the table: in halves of words for efficiencies, in packets for matrices.
    pub cell_offset: N::Index,
    /// Index of the node in the cell, `[index along p][index along q]`.
    pub index: N::Index,
}

/// Rows of one incident channel at the eight nodes around a position and wavelength. A node's row has an entry for each
/// outgoing channel, then the sum of these entries ([`EfficiencyLayout`]).
pub(super) struct Row<N: Numbers> {
    /// Offsets of the row at each node, in halves of words: `[shorter, longer wavelength][node]`, where bit 1 of the
    /// node selects the upper p and bit 0 the upper q.
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
    fn surrounding_nodes(&self, channels: &Channels<N>, nm: N::Real, active: N::Mask) -> ([Node<N>; 8], [N::Real; 3]) {
        let (real, index) = (N::Real::lit, N::Index::lit);
        let EfficiencyLayout { first_nm, step_nm, wavelengths, cells, nodes, .. } = self.layout;
        // Lower node of the interval around x among `count` nodes (at least two), and the fraction of a step from it.
        let interval = |x: N::Real, count: u32| {
            let x = x.clip(real(0.0), real(f64::from(count - 1)));
            let low = x.floor().min(real(f64::from(count - 2)));
            (N::index(low), x - low)
        };
        let (shorter, to_longer) = interval((nm - real(first_nm)) * real(1.0 / step_nm), wavelengths);
        let [(low_p, p), (low_q, q)] =
            channels.coordinates.map(|coordinate| interval(coordinate * real(f64::from(nodes - 1)), nodes));
        let offsets = [0, 1].map(|j| {
            let [offset] = N::gather::<1>(self.words, (shorter + index(j)) * index(cells) + channels.cell, active);
            offset
        });
        let surrounding = std::array::from_fn(|bits| {
            let [longer, upper_p, upper_q] = [bits >> 2, bits >> 1 & 1, bits & 1];
            let in_cell = (low_p + index(upper_p as u32)) * index(nodes) + low_q + index(upper_q as u32);
            Node { cell_offset: offsets[longer], index: in_cell }
        });
        (surrounding, [p, q, to_longer])
    }

    /// The eight nodes around a position and a wavelength in nm, each with its weight in trilinear interpolation.
    #[inline(always)]
    pub(super) fn weighted_nodes(
        &self,
        channels: &Channels<N>,
        nm: N::Real,
        active: N::Mask,
    ) -> [(Node<N>, N::Real); 8] {
        let one = N::Real::lit(1.0);
        let (nodes, fractions) = self.surrounding_nodes(channels, nm, active);
        // Weights of the lower and of the upper node along each axis.
        let [p, q, wavelength] = fractions.map(|x| [one - x, x]);
        std::array::from_fn(|bits| (nodes[bits], wavelength[bits >> 2] * p[bits >> 1 & 1] * q[bits & 1]))
    }

    /// Row of the channel `incident`, for a wavelength in nm.
    #[inline(always)]
    pub(super) fn row(&self, channels: &Channels<N>, incident: N::Index, nm: N::Real, active: N::Mask) -> Row<N> {
        let one = N::Index::lit(1);
        let (nodes, fractions) = self.surrounding_nodes(channels, nm, active);
        // Lengths in entries, each half a word. A node has a row for each incident channel.
        let row_length = channels.count + one;
        let node_length = channels.count * row_length;
        let offset = |bits: usize| {
            let Node { cell_offset, index } = nodes[bits];
            cell_offset + index * node_length + incident * row_length
        };
        Row { offsets: [0, 4].map(|first| std::array::from_fn(|bits| offset(first + bits))), fractions }
    }

    /// Bounds of propagation at a ratio ky/k; they do not depend on the wave number along x. `periods` is d/λ. The
    /// ratio may exceed 1 in magnitude in the medium, since k is the wave number in air.
    #[inline(always)]
    pub(super) fn bounds(&self, periods: N::Double, ky_over_k: N::Double) -> Bounds<N> {
        let Below::Interface(InterfaceCells { eta, .. }) = self.layout.below else {
            return Bounds { of_cells: groove_t::<N>(periods, ky_over_k), at_interface: None };
        };
        let double = N::Double::lit;
        // t or tm: bound of |a + m| in a medium of this index.
        let ratio_squared = ky_over_k * ky_over_k;
        let bound = |index: f64| periods * (double(index * index) - ratio_squared).max(double(0.0)).sqrt();
        let (t, tm) = (bound(1.0), bound(eta));
        let is_beyond_air = double(1.0).le(ratio_squared);
        Bounds { of_cells: N::Double::select(is_beyond_air, tm, t), at_interface: Some((is_beyond_air, tm)) }
    }

    /// Channels at the incident wave with the wave number `a` along x, in units of 2π/d. A wave outside the table,
    /// which does not propagate, gets the nearest cell.
    #[inline(always)]
    pub(super) fn channels(&self, bounds: &Bounds<N>, a: N::Double, active: N::Mask) -> Channels<N> {
        let double = N::Double::lit;
        // Index of a cell, clipped to `count` cells.
        let cell_among =
            |cell: N::Double, count: u32| N::index_of_double(cell.clip(double(0.0), double(f64::from(count - 1))));
        let cells = self.layout.cells;
        let position = CellPosition::<N>::new(bounds.of_cells, a);
        let (Below::Interface(InterfaceCells { air_cells, .. }), Some((is_beyond_air, tm))) =
            (self.layout.below, bounds.at_interface)
        else {
            // 1 if the cell's orders also exist below the relief.
            let sides_below = if self.layout.transmits() { 1.0 } else { 0.0 };
            return Channels::of_cell(&position, cell_among(position.cell, cells), sides_below);
        };
        // Cells of the air come first. They begin with cell −1, in which no order propagates in the air.
        let in_air = cell_among(position.cell + double(1.0), air_cells);
        let in_medium = cell_among(position.cell, cells - air_cells) + N::Index::lit(air_cells);
        let cell = N::Index::select(is_beyond_air, in_medium, in_air);
        // The words after the offsets of all cells have each cell's `extra`, the number of further orders that
        // propagate in the medium at either end of the range ([`InterfaceCells`]).
        let first_extra = N::Index::lit(self.layout.wavelengths * cells);
        let [extra] = N::gather::<1>(self.words, first_extra + cell, active);
        let extra = N::widen(N::real(extra));
        // Number of orders within the bound that defines the cell. They propagate below, with `extra` more at either
        // end, and above unless the cell lies beyond the air.
        let orders = position.cell + double(1.0);
        let side_counts = [N::Double::select(is_beyond_air, double(0.0), orders), orders + extra * double(2.0)];
        // The incident wave, m = 0, is number `incident` of these orders, counted from the lowest.
        let first = -position.incident;
        Channels::new(&position, cell, side_counts, [first, first - extra], Some(BoundBelow { a, tm }))
    }

    /// Whether a direction, which points away from the surface, lies below the relief. False for a reflector.
    #[inline(always)]
    pub(super) fn is_below(&self, w: [N::Real; 3]) -> N::Mask {
        match self.layout.below {
            Below::Reflector => N::mask(false),
            Below::Film | Below::Interface(_) => w[2].lt(N::Real::lit(0.0)),
        }
    }

    /// Sum of all efficiencies of the row: the entry after the last channel's.
    #[inline(always)]
    pub(super) fn row_total(&self, row: &Row<N>, channels: &Channels<N>, active: N::Mask) -> N::Real {
        self.entry(row, channels.count, active)
    }

    /// Efficiency of an outgoing channel, interpolated.
    #[inline(always)]
    pub(super) fn entry(&self, row: &Row<N>, channel: N::Index, active: N::Mask) -> N::Real {
        let [p, q, to_longer] = row.fractions;
        let [shorter, longer] = row.offsets.map(|nodes| {
            let [low, upper_q, upper_p, both] = nodes.map(|offset| self.half_word(offset + channel, active));
            lerp(lerp(low, upper_q, q), lerp(upper_p, both, q), p)
        });
        lerp(shorter, longer, to_longer) * N::Real::lit(UNIT)
    }

    /// The 16-bit integer at an offset in halves of words, as a real number. The lower half of a word comes first.
    #[inline(always)]
    fn half_word(&self, offset: N::Index, active: N::Mask) -> N::Real {
        let [word] = N::gather::<1>(self.words, offset >> 1, active);
        let [lower, upper] = u16_pair::<N>(word);
        let is_odd = N::Index::lit(1).le(offset & N::Index::lit(1));
        N::Real::select(is_odd, upper, lower)
    }
}
