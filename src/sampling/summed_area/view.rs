//! Evaluator of a [`super::SummedArea`] for all families of numbers: sums over rectangles, interpolation, sampling.

use super::{BANDS, BLOCK, BLOCK_PACKETS, BLOCK_SHIFT, EXPONENT_SHIFT, SummedAreaLayout};
use crate::numeric::{Index, Number, Numbers, Real};
use crate::sampling::BELOW_ONE;

/// A half-open range of blocks along x and y.
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

/// A [`SummedArea`](super::SummedArea) for one family of numbers (plain, lanes or traced; see `src/numeric`).
#[derive(Clone, Copy)]
pub struct SummedAreaView<N: Numbers> {
    /// Layout of the table data.
    pub layout: SummedAreaLayout,
    /// Table data, [`SummedArea::words`](super::SummedArea::words).
    pub words: N::Words,
}

impl<N: Numbers> SummedAreaView<N> {
    /// The smallest rectangle of blocks that contains all nodes between two positions, given in nodes along x and y;
    /// empty where there are none.
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

    /// Counts of a rectangle in each band, from the sums at its four corners.
    #[inline(always)]
    pub fn mass(&self, rectangle: &Rectangle<N>, active: N::Mask) -> [N::Index; BANDS] {
        let corner = |x: N::Index, y: N::Index| N::gather::<4>(self.words, self.corner(x, y), active);
        let Rectangle { low, high } = *rectangle;
        let (near, far) =
            ([corner(low[0], low[1]), corner(high[0], low[1])], [low[0], high[0]].map(|x| corner(x, high[1])));
        std::array::from_fn(|b| (far[1][b] - far[0][b]) - (near[1][b] - near[0][b]))
    }

    /// Counts of a node in each band.
    #[inline(always)]
    pub fn node(&self, node: [N::Index; 2], active: N::Mask) -> [N::Real; BANDS] {
        let [block_x, block_y] = node.map(|n| n >> BLOCK_SHIFT);
        let block = block_y * N::Index::lit(self.layout.blocks[0]) + block_x;
        let [x, y] = node.map(|n| n & N::Index::lit(BLOCK as u32 - 1));
        let within = y * N::Index::lit(BLOCK as u32) + x;
        // In units of the two words of a node.
        let index = N::Index::lit(2 * self.layout.masses) + block * N::Index::lit(2 * BLOCK_PACKETS) + within;
        let [a, b] = N::gather::<2>(self.words, index, active);
        let (low, high) = (N::Index::lit(0xffff), N::Index::lit(0xffff_0000));
        let shift = N::Index::lit(EXPONENT_SHIFT);
        [(a & low) << 12, (a & high) >> 4, (b & low) << 12, (b & high) >> 4]
            .map(|bits| N::from_bits(bits + shift).floor())
    }

    /// Counts in each band at a position in nodes, interpolated bilinearly between the four nodes around it. Nodes
    /// outside the rectangle count as zero.
    #[inline(always)]
    pub fn tents(&self, position: [N::Double; 2], rectangle: &Rectangle<N>, active: N::Mask) -> [N::Real; BANDS] {
        let taps = [0, 1].map(|axis| {
            let first = position[axis].floor();
            let t = N::narrow(position[axis] - first);
            [(first, N::Real::lit(1.0) - t), (first + N::Double::lit(1.0), t)]
        });
        self.weighted(&taps[0], &taps[1], rectangle, active)
    }

    /// Weighted sum of counts in each band over the nodes `(index, weight)` along x times those along y. Nodes outside
    /// the rectangle count as zero.
    #[inline(always)]
    pub fn weighted(
        &self,
        x: &[(N::Double, N::Real)],
        y: &[(N::Double, N::Real)],
        rectangle: &Rectangle<N>,
        active: N::Mask,
    ) -> [N::Real; BANDS] {
        let inside = |axis: usize, at: N::Double| {
            let edge = |block: N::Index| N::widen(N::real(block << BLOCK_SHIFT));
            edge(rectangle.low[axis]).le(at) & at.lt(edge(rectangle.high[axis]))
        };
        let index = |axis: usize, at: N::Double| {
            let last = f64::from(self.layout.blocks[axis] * BLOCK as u32 - 1);
            N::index_of_double(at.clip(N::Double::lit(0.0), N::Double::lit(last)))
        };
        let mut sum = [N::Real::lit(0.0); BANDS];
        for &(row, along_y) in y {
            let (inside_y, row) = (inside(1, row), index(1, row));
            for &(column, along_x) in x {
                let node = self.node([index(0, column), row], active & inside_y & inside(0, column));
                let weight = along_x * along_y;
                sum = std::array::from_fn(|b| node[b].fma(weight, sum[b]));
            }
        }
        sum
    }

    /// Draws a node of a rectangle with probability proportional to its count in one band, from two random numbers in
    /// [0, 1). The rectangle's count in the band must be positive.
    #[inline(always)]
    pub fn choose(&self, rectangle: &Rectangle<N>, band: N::Index, u: [N::Real; 2], active: N::Mask) -> Drawn<N> {
        let Rectangle { low, high } = *rectangle;
        let sum = |x: N::Index, y: N::Index, active: N::Mask| {
            let [sum] = N::gather::<1>(self.words, (self.corner(x, y) << 2) + band, active);
            sum
        };
        let one = N::Index::lit(1);
        // Row of blocks: counts of the rectangle's columns in the rows before `row`.
        let before_row = |row: N::Index, active: N::Mask| sum(high[0], row, active) - sum(low[0], row, active);
        let (row, v) = bisect::<N>([low[1], high[1]], u[1], active, before_row);
        // Column of blocks: counts of that row in the columns before `column`.
        let before_column =
            |column: N::Index, active: N::Mask| sum(column, row + one, active) - sum(column, row, active);
        let (column, u) = bisect::<N>([low[0], high[0]], u[0], active, before_column);
        // Node of the block: its row by the rows' totals, then its column.
        let block = row * N::Index::lit(self.layout.blocks[0]) + column;
        let packet = N::Index::lit(self.layout.masses) + block * N::Index::lit(BLOCK_PACKETS);
        let (second_word, second_half) = (one.lt(band), one.le(band & one));
        let mass = |first: N::Index, second: N::Index| {
            let word = N::Index::select(second_word, second, first);
            let code = N::Index::select(second_half, word >> 16, word & N::Index::lit(0xffff));
            N::index(N::from_bits((code << 12) + N::Index::lit(EXPONENT_SHIFT)))
        };
        let rows: [[N::Index; BLOCK]; BLOCK] = std::array::from_fn(|i| {
            let read = |k: u32| N::gather::<4>(self.words, packet + N::Index::lit(2 * i as u32 + k), active);
            let ([a, b, c, d], [e, f, g, h]) = (read(0), read(1));
            [mass(a, b), mass(c, d), mass(e, f), mass(g, h)]
        });
        let (row_within, v) = draw_of_four::<N>(rows.map(|[a, b, c, d]| a + b + (c + d)), v);
        let chosen = std::array::from_fn(|i| element::<N>(rows.map(|row| row[i]), row_within));
        let (column_within, u) = draw_of_four::<N>(chosen, u);
        Drawn { node: [(column << BLOCK_SHIFT) + column_within, (row << BLOCK_SHIFT) + row_within], u: [u, v] }
    }

    /// Index of the sums at the lower corner of a block, in packets of four words.
    #[inline(always)]
    fn corner(&self, x: N::Index, y: N::Index) -> N::Index {
        N::Index::lit(self.layout.sums) + y * N::Index::lit(self.layout.blocks[0] + 1) + x
    }
}

/// Scales a random number to `[0, total)`: the whole number of counts below it, and the fraction of a count beyond.
#[inline(always)]
fn scaled<N: Numbers>(total: N::Index, u: N::Real) -> (N::Index, N::Real) {
    let target = u * N::real(total);
    // Rounding may raise the product to the total.
    let count = N::index(target).min(total.max(N::Index::lit(1)) - N::Index::lit(1));
    (count, (target - N::real(count)).clip(N::Real::lit(0.0), N::Real::lit(1.0)))
}

/// Random number in [0, 1) from the position `count + rest` among `mass` counts.
#[inline(always)]
fn rescaled<N: Numbers>(count: N::Index, rest: N::Real, mass: N::Index) -> N::Real {
    let mass = N::real(mass.max(N::Index::lit(1)));
    ((N::real(count) + rest) / mass).min(N::Real::lit(BELOW_ONE))
}

/// Draws an index from `low` to before `high` by bisection of the cumulative counts `before(index)`; also returns the
/// rescaled random number.
#[inline(always)]
fn bisect<N: Numbers>(
    [low, high]: [N::Index; 2],
    u: N::Real,
    active: N::Mask,
    before: impl Fn(N::Index, N::Mask) -> N::Index,
) -> (N::Index, N::Real) {
    let one = N::Index::lit(1);
    let start = before(low, active);
    let (count, rest) = scaled::<N>(before(high, active) - start, u);
    let target = start + count;
    let more = |[low, high]: [N::Index; 2]| (low + one).lt(high) & active;
    let [found, _] = N::while_loop(c"Bisection", [low, high], more, |[low, high]| {
        let middle = (low + high) >> 1;
        let is_lower = target.lt(before(middle, more([low, high])));
        [N::Index::select(is_lower, low, middle), N::Index::select(is_lower, middle, high)]
    });
    let below = before(found, active);
    (found, rescaled::<N>(target - below, rest, before(found + one, active) - below))
}

/// Element `i` of four.
#[inline(always)]
fn element<N: Numbers>([a, b, c, d]: [N::Index; 4], i: N::Index) -> N::Index {
    let select = |below: u32, yes, no| N::Index::select(i.lt(N::Index::lit(below)), yes, no);
    select(2, select(1, a, b), select(3, c, d))
}

/// Draws one of four indices by their counts; also returns the rescaled random number.
#[inline(always)]
fn draw_of_four<N: Numbers>(masses: [N::Index; 4], u: N::Real) -> (N::Index, N::Real) {
    let [a, b, c, d] = masses;
    let zero = N::Index::lit(0);
    let (first, second) = (a, a + b);
    let third = second + c;
    let (count, rest) = scaled::<N>(third + d, u);
    let step = |edge: N::Index| N::Index::select(count.lt(edge), zero, N::Index::lit(1));
    let i = step(first) + step(second) + step(third);
    (i, rescaled::<N>(count - element::<N>([zero, first, second, third], i), rest, element::<N>(masses, i)))
}
