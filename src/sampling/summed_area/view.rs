//! Evaluator of a [`super::SummedArea`] for all families of numbers: sums over rectangles, interpolation, sampling.
//!
//! Nodes of a grid have masses in [`BANDS`] bands, stored as whole counts in blocks of [`BLOCK`] × [`BLOCK`] nodes. A
//! node has two words, of two 16-bit codes each: the counts of bands 0 to 3 ([`EXPONENT_SHIFT`]). Words are read in
//! packets: `gather::<W>(words, i)` reads the words W·i to W·i + W − 1. All sums are counts;
//! [`SummedAreaLayout::unit`] is the mass of one count in each band.
//!
//! `N` is a family of numbers (`src/numeric`). An `N::Real` is one number, a SIMD vector or a traced variable, and an
//! `N::Index` likewise an unsigned integer; `lit` makes constants. Results are zero where the mask `active` is false,
//! unless a comment says otherwise.

use super::{BANDS, BLOCK, BLOCK_PACKETS, BLOCK_SHIFT, EXPONENT_SHIFT, SummedAreaLayout};
use crate::numeric::{Index, Number, Numbers, Real};
use crate::sampling::BELOW_ONE;

/// A half-open range of blocks along x and y. Rectangles consist of whole blocks of nodes, in which sums are stored.
#[derive(Clone, Copy)]
pub struct Rectangle<N: Numbers> {
    /// First column and row of blocks.
    pub low: [N::Index; 2],
    /// Column and row after the last blocks.
    pub high: [N::Index; 2],
}

/// A sampled node.
pub struct Drawn<N: Numbers> {
    /// Column and row of the node.
    pub node: [N::Index; 2],
    /// Fresh random numbers in [0, 1), rescaled from those that chose the node.
    pub u: [N::Real; 2],
}

/// A [`SummedArea`](super::SummedArea) for one family of numbers: single values, four lanes, or variables of a recorded
/// kernel (`src/numeric`).
#[derive(Clone, Copy)]
pub struct SummedAreaView<N: Numbers> {
    /// Layout of the table data.
    pub layout: SummedAreaLayout,
    /// Table data, [`SummedArea::words`](super::SummedArea::words).
    pub words: N::Words,
}

impl<N: Numbers> SummedAreaView<N> {
    /// Rectangle of the blocks that contain all nodes between the positions `low` and `high`, in nodes along x and y,
    /// cut to the grid. Along an axis without a node between both positions, the rectangle has one block or none.
    #[inline(always)]
    pub fn rectangle(&self, low: [N::Real; 2], high: [N::Real; 2]) -> Rectangle<N> {
        let lit = N::Real::lit;
        let range = |axis: usize| {
            let blocks = f64::from(self.layout.blocks[axis]);
            let block = |x: N::Real| (x * lit(1.0 / BLOCK as f64)).floor();
            let low = block(low[axis].ceil()).clip(lit(0.0), lit(blocks));
            let high = (block(high[axis]) + lit(1.0)).clip(low, lit(blocks).max(low));
            [N::index(low), N::index(high)]
        };
        let [[left, right], [bottom, top]] = [range(0), range(1)];
        Rectangle { low: [left, bottom], high: [right, top] }
    }

    /// Total counts of a rectangle in each band, from the sums at its four corners.
    #[inline(always)]
    pub fn counts(&self, rectangle: &Rectangle<N>, active: N::Mask) -> [N::Index; BANDS] {
        let sums = |x: N::Index, y: N::Index| N::gather::<4>(self.words, self.corner(x, y), active);
        let Rectangle { low: [left, bottom], high: [right, top] } = *rectangle;
        let (bottom_left, bottom_right) = (sums(left, bottom), sums(right, bottom));
        let (top_left, top_right) = (sums(left, top), sums(right, top));
        // Indices are unsigned: in this order no difference is negative.
        std::array::from_fn(|b| (top_right[b] - top_left[b]) - (bottom_right[b] - bottom_left[b]))
    }

    /// Counts of a node in each band, from its column and row.
    #[inline(always)]
    pub fn node_counts(&self, node: [N::Index; 2], active: N::Mask) -> [N::Real; BANDS] {
        let [block_x, block_y] = node.map(|n| n >> BLOCK_SHIFT);
        let block = block_y * N::Index::lit(self.layout.blocks[0]) + block_x;
        let [x, y] = node.map(|n| n & N::Index::lit(BLOCK as u32 - 1));
        let within = y * N::Index::lit(BLOCK as u32) + x;
        // Index in pairs of words, one pair per node. `counts_start` is in packets of two pairs.
        let index = N::Index::lit(2 * self.layout.counts_start) + block * N::Index::lit(2 * BLOCK_PACKETS) + within;
        let [a, b] = N::gather::<2>(self.words, index, active);
        let (low, high) = (N::Index::lit(0xffff), N::Index::lit(0xffff_0000));
        let shift = N::Index::lit(EXPONENT_SHIFT);
        // The four codes times 2¹², so that adding `shift` gives the bits of the count in single precision
        // ([`EXPONENT_SHIFT`]). Rounding down takes code 0, which reads as ½, to 0.
        [(a & low) << 12, (a & high) >> 4, (b & low) << 12, (b & high) >> 4]
            .map(|bits| N::from_bits(bits + shift).floor())
    }

    /// Counts in each band at a position in nodes along x and y, interpolated bilinearly between the four nodes around
    /// it. Nodes outside the rectangle count as zero.
    #[inline(always)]
    pub fn tents(&self, position: [N::Double; 2], rectangle: &Rectangle<N>, active: N::Mask) -> [N::Real; BANDS] {
        let taps = [0, 1].map(|axis| {
            let first = position[axis].floor();
            let t = N::narrow(position[axis] - first);
            [(first, N::Real::lit(1.0) - t), (first + N::Double::lit(1.0), t)]
        });
        self.weighted(&taps[0], &taps[1], rectangle, active)
    }

    /// Weighted sum of counts in each band over the nodes of all columns and rows given. Each column and row is a pair:
    /// its number, a whole one, and its weight. A node's weight is the product of those of its column and its row.
    /// Nodes outside the rectangle count as zero.
    #[inline(always)]
    pub fn weighted(
        &self,
        columns: &[(N::Double, N::Real)],
        rows: &[(N::Double, N::Real)],
        rectangle: &Rectangle<N>,
        active: N::Mask,
    ) -> [N::Real; BANDS] {
        let is_inside = |axis: usize, at: N::Double| {
            let edge = |block: N::Index| N::widen(N::real(block << BLOCK_SHIFT));
            edge(rectangle.low[axis]).le(at) & at.lt(edge(rectangle.high[axis]))
        };
        // Clamped to the table: the conversion of a negative number to an index is arbitrary.
        let index = |axis: usize, at: N::Double| {
            let last = f64::from(self.layout.blocks[axis] * BLOCK as u32 - 1);
            N::index_of_double(at.clip(N::Double::lit(0.0), N::Double::lit(last)))
        };
        let mut sum = [N::Real::lit(0.0); BANDS];
        for &(row, row_weight) in rows {
            let (is_row_inside, y) = (is_inside(1, row), index(1, row));
            for &(column, column_weight) in columns {
                let counts = self.node_counts([index(0, column), y], active & is_row_inside & is_inside(0, column));
                let weight = column_weight * row_weight;
                sum = std::array::from_fn(|b| counts[b].fma(weight, sum[b]));
            }
        }
        sum
    }

    /// Draws a node of a rectangle with probability proportional to its count in one band, from two random numbers in
    /// [0, 1). Callers activate only lanes where the rectangle's count in the band is positive; the result in others is
    /// arbitrary.
    #[inline(always)]
    pub fn choose(&self, rectangle: &Rectangle<N>, band: N::Index, u: [N::Real; 2], active: N::Mask) -> Drawn<N> {
        let Rectangle { low: [left, bottom], high: [right, top] } = *rectangle;
        let sum = |x: N::Index, y: N::Index, active: N::Mask| {
            // The packet of a corner has four words, one for each band.
            let [sum] = N::gather::<1>(self.words, (self.corner(x, y) << 2) + band, active);
            sum
        };
        let one = N::Index::lit(1);
        // Draws the row of blocks by the counts, in the rectangle's columns, of all rows before `row`.
        let before_row = |row: N::Index, active: N::Mask| sum(right, row, active) - sum(left, row, active);
        let (row, v) = bisect::<N>([bottom, top], u[1], active, before_row);
        // Draws the column of blocks by the counts, in that row, of all columns before `column`.
        let before_column =
            |column: N::Index, active: N::Mask| sum(column, row + one, active) - sum(column, row, active);
        let (column, u) = bisect::<N>([left, right], u[0], active, before_column);
        // Counts of the block's nodes, [node along y][node along x], in the band. A packet holds two nodes, so the four
        // nodes of a row fill two packets.
        let block = row * N::Index::lit(self.layout.blocks[0]) + column;
        let packet = N::Index::lit(self.layout.counts_start) + block * N::Index::lit(BLOCK_PACKETS);
        // Bands 0 and 1 are the halves of a node's first word, 2 and 3 those of its second.
        let (is_second_word, is_upper_half) = (one.lt(band), one.le(band & one));
        let count = |first: N::Index, second: N::Index| {
            let word = N::Index::select(is_second_word, second, first);
            let code = N::Index::select(is_upper_half, word >> 16, word & N::Index::lit(0xffff));
            N::index(N::from_bits((code << 12) + N::Index::lit(EXPONENT_SHIFT)))
        };
        let counts: [[N::Index; BLOCK]; BLOCK] = std::array::from_fn(|y| {
            let read = |k: u32| N::gather::<4>(self.words, packet + N::Index::lit(2 * y as u32 + k), active);
            let ([a, b, c, d], [e, f, g, h]) = (read(0), read(1));
            [count(a, b), count(c, d), count(e, f), count(g, h)]
        });
        // Draws the node's row within the block by the totals of the rows, then its column within the row.
        let (y, v) = draw_of_four::<N>(counts.map(|[a, b, c, d]| a + b + (c + d)), v);
        let chosen_row = std::array::from_fn(|x| element::<N>(counts.map(|row| row[x]), y));
        let (x, u) = draw_of_four::<N>(chosen_row, u);
        Drawn { node: [(column << BLOCK_SHIFT) + x, (row << BLOCK_SHIFT) + y], u: [u, v] }
    }

    /// Index, in packets of four words, of the sums in each band of all blocks before block column `x` and block row
    /// `y`.
    #[inline(always)]
    fn corner(&self, x: N::Index, y: N::Index) -> N::Index {
        N::Index::lit(self.layout.sums_start) + y * N::Index::lit(self.layout.blocks[0] + 1) + x
    }
}

/// Scales a random number to `[0, total)`. Returns the whole part, below `total`, and the fraction.
#[inline(always)]
fn scaled<N: Numbers>(total: N::Index, u: N::Real) -> (N::Index, N::Real) {
    let target = u * N::real(total);
    // Rounding may raise the product to the total. A total of 0, in lanes that are masked, must not underflow.
    let whole = N::index(target).min(total.max(N::Index::lit(1)) - N::Index::lit(1));
    (whole, (target - N::real(whole)).clip(N::Real::lit(0.0), N::Real::lit(1.0)))
}

/// Random number in [0, 1) from the position `whole + fraction` among `count` counts, the inverse of [`scaled`].
/// [`BELOW_ONE`] is the largest number of single precision below 1.
#[inline(always)]
fn rescaled<N: Numbers>(whole: N::Index, fraction: N::Real, count: N::Index) -> N::Real {
    let count = N::real(count.max(N::Index::lit(1)));
    ((N::real(whole) + fraction) / count).min(N::Real::lit(BELOW_ONE))
}

/// Draws an index in `low..high` in proportion to its counts, by bisection of the cumulative counts `before(index)`.
/// Also returns a random number in [0, 1), rescaled from `u`, that is independent of the index.
#[inline(always)]
fn bisect<N: Numbers>(
    [low, high]: [N::Index; 2],
    u: N::Real,
    active: N::Mask,
    before: impl Fn(N::Index, N::Mask) -> N::Index,
) -> (N::Index, N::Real) {
    let one = N::Index::lit(1);
    let start = before(low, active);
    let (whole, fraction) = scaled::<N>(before(high, active) - start, u);
    let target = start + whole;
    let has_several = |[low, high]: [N::Index; 2]| (low + one).lt(high) & active;
    // Keeps before(low) ≤ target < before(high). The text labels the loop in the kernels of traced variables.
    let [found, _] = N::while_loop(c"Bisection", [low, high], has_several, |[low, high]| {
        let middle = (low + high) >> 1;
        let is_lower = target.lt(before(middle, has_several([low, high])));
        [N::Index::select(is_lower, low, middle), N::Index::select(is_lower, middle, high)]
    });
    let below = before(found, active);
    (found, rescaled::<N>(target - below, fraction, before(found + one, active) - below))
}

/// Element `i` of four, `i` in 0 to 3.
#[inline(always)]
fn element<N: Numbers>([a, b, c, d]: [N::Index; 4], i: N::Index) -> N::Index {
    let select = |below: u32, yes, no| N::Index::select(i.lt(N::Index::lit(below)), yes, no);
    select(2, select(1, a, b), select(3, c, d))
}

/// Draws one of four indices in proportion to their counts. Also returns a random number in [0, 1), rescaled from `u`,
/// that is independent of the index.
#[inline(always)]
fn draw_of_four<N: Numbers>(counts: [N::Index; 4], u: N::Real) -> (N::Index, N::Real) {
    let [a, b, c, d] = counts;
    let zero = N::Index::lit(0);
    // Cumulative counts before the indices 1, 2 and 3.
    let (before_1, before_2) = (a, a + b);
    let before_3 = before_2 + c;
    let (whole, fraction) = scaled::<N>(before_3 + d, u);
    let step = |edge: N::Index| N::Index::select(whole.lt(edge), zero, N::Index::lit(1));
    let i = step(before_1) + step(before_2) + step(before_3);
    let before_i = element::<N>([zero, before_1, before_2, before_3], i);
    (i, rescaled::<N>(whole - before_i, fraction, element::<N>(counts, i)))
}
