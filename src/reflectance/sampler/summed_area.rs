//! Masses on a rectangular lattice that can be summed over, and drawn from, within any rectangle.
//!
//! A lattice node holds a mass in each of four bands. Masses are whole counts with 12 significant bits, so a node takes 8 bytes
//! and every sum of them is exact: what a density says is what is drawn. Sums are kept for blocks of 4 × 4 nodes
//! (a summed-area table), so rectangles consist of whole blocks. Within a block the 16 masses are read.

use crate::numeric::{Index, Number, Numbers, Real};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

/// Bands of a node.
pub const BANDS: usize = 4;
/// Nodes of a block along either axis, and as a power of two.
const BLOCK: usize = 4;
const BLOCK_SHIFT: u32 = 2;
/// Packets of four words that a block's masses take: 16 nodes of two words.
const BLOCK_PACKETS: u32 = 8;
/// What all masses of a band may sum to. A mass has five bits for its exponent, so it stays below 2³¹.
const TOTAL_MAX: f64 = 0.999 * 2_147_483_648.0;
/// Bits of a mass after the leading one.
const MANTISSA_BITS: u32 = 11;
/// Added to a mass' 16 bits, shifted to the mantissa's place, it makes the number of single precision: the exponent of single
/// precision is 126 more. A mass of zero then reads as a half, which rounds down to zero.
const EXPONENT_SHIFT: u32 = 126 << 23;
/// The largest number of single precision below one.
const BELOW_ONE: f64 = 1.0 - 1.0 / 16_777_216.0;

/// Where a [`SummedArea`] has what, in plain numbers.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct SummedAreaLayout {
    /// Nodes along x and y.
    pub nodes: [u32; 2],
    /// Blocks along x and y; nodes that complete the last ones have no mass.
    pub blocks: [u32; 2],
    /// Start of the masses, in units of four words: `[block along y][block along x][node along y][node along x]`, two words a node.
    pub masses: u32,
    /// Start of the sums, in units of four words: `[block along y][block along x][band]`, one more than there are blocks along
    /// either axis. They count what lies before a block's corner along both axes.
    pub sums: u32,
    /// What one count stands for, by band.
    pub unit: [f32; BANDS],
}

/// Masses on a lattice, with their sums.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct SummedArea {
    layout: SummedAreaLayout,
    words: Vec<u32>,
}

impl SummedArea {
    /// Rounds `values`, `[node along y][node along x][band]`, to counts. What is positive has at least one; what is negative
    /// or not a number has none.
    pub fn new(nodes: [usize; 2], values: &[[f32; BANDS]]) -> Self {
        let blocks = nodes.map(|n| n.div_ceil(BLOCK));
        let positive = |value: f32| if value > 0.0 { f64::from(value) } else { 0.0 };
        let total = values
            .par_chunks(4096)
            .map(|chunk| {
                chunk.iter().fold([0.0; BANDS], |sum, value| std::array::from_fn(|b| sum[b] + positive(value[b])))
            })
            .reduce(|| [0.0; BANDS], |a, b| std::array::from_fn(|i| a[i] + b[i]));
        // Each positive mass may gain a count by rounding up.
        let counts = TOTAL_MAX - values.len() as f64;
        let scale = total.map(|total: f64| if total > 0.0 { counts / total } else { 0.0 });
        let mut words = vec![0u32; blocks[0] * blocks[1] * 4 * BLOCK_PACKETS as usize];
        let block_words = 4 * BLOCK_PACKETS as usize;
        words.par_chunks_mut((blocks[0] * block_words).max(1)).enumerate().for_each(|(block_row, words)| {
            for row in block_row * BLOCK..((block_row + 1) * BLOCK).min(nodes[1]) {
                for column in 0..nodes[0] {
                    let value = &values[row * nodes[0] + column];
                    let code: [u32; BANDS] = std::array::from_fn(|b| {
                        let mass = positive(value[b]) * scale[b];
                        if mass > 0.0 { encode(mass.round().max(1.0) as u32) } else { 0 }
                    });
                    let at = column / BLOCK * block_words + 2 * (row % BLOCK * BLOCK + column % BLOCK);
                    words[at] = code[0] | code[1] << 16;
                    words[at + 1] = code[2] | code[3] << 16;
                }
            }
        });
        let sums = words.len();
        let stride = BANDS * (blocks[0] + 1);
        words.resize(sums + stride * (blocks[1] + 1), 0);
        let (masses, sums_to) = words.split_at_mut(sums);
        for by in 0..blocks[1] {
            let mut before = [0u32; BANDS];
            for bx in 0..blocks[0] {
                let block = &masses[(by * blocks[0] + bx) * block_words..][..block_words];
                for node in block.chunks_exact(2) {
                    for (b, sum) in before.iter_mut().enumerate() {
                        *sum += decode(node[b / 2] >> (16 * (b % 2)) & 0xffff);
                    }
                }
                for (b, sum) in before.iter().enumerate() {
                    let at = by * stride + BANDS * (bx + 1) + b;
                    sums_to[at + stride] = sums_to[at] + sum;
                }
            }
        }
        let layout = SummedAreaLayout {
            nodes: nodes.map(|n| n as u32),
            blocks: blocks.map(|n| n as u32),
            masses: 0,
            sums: (sums / 4) as u32,
            unit: scale.map(|scale| if scale > 0.0 { (1.0 / scale) as f32 } else { 0.0 }),
        };
        Self { layout, words }
    }

    /// Where the words have what.
    pub fn layout(&self) -> &SummedAreaLayout {
        &self.layout
    }

    /// The words, a multiple of four.
    pub fn words(&self) -> &[u32] {
        &self.words
    }

    /// The words, to be kept elsewhere.
    pub fn into_words(self) -> Vec<u32> {
        self.words
    }
}

/// A count, rounded to 12 significant bits, as 16 bits: one more than its exponent, then what follows the leading bit.
fn encode(count: u32) -> u32 {
    // Rounds to the nearest; a carry goes on into the exponent, as it should.
    let exponent = count.ilog2();
    let mantissa = if exponent > MANTISSA_BITS {
        let shift = exponent - MANTISSA_BITS;
        (count + (1 << (shift - 1))) >> shift
    } else {
        count << (MANTISSA_BITS - exponent)
    };
    (exponent << MANTISSA_BITS) + mantissa
}

/// The count of 16 bits.
fn decode(code: u32) -> u32 {
    f32::from_bits((code << 12) + EXPONENT_SHIFT) as u32
}

/// Whole blocks, from the `low` ones to those before the `high` ones along x and y.
#[derive(Clone, Copy)]
pub struct Rectangle<N: Numbers> {
    pub low: [N::Index; 2],
    pub high: [N::Index; 2],
}

/// A node that was drawn.
pub struct Drawn<N: Numbers> {
    /// Column and row.
    pub node: [N::Index; 2],
    /// The random numbers, stretched to [0, 1) again.
    pub u: [N::Real; 2],
}

/// A [`SummedArea`] to be read by one family of numbers.
#[derive(Clone, Copy)]
pub struct SummedAreaView<N: Numbers> {
    pub layout: SummedAreaLayout,
    pub words: N::Words,
}

impl<N: Numbers> SummedAreaView<N> {
    /// The least rectangle that has all nodes between two positions, in nodes from the first along x and y. It is empty where
    /// there are none.
    #[inline(always)]
    pub fn rectangle(&self, low: [N::Real; 2], high: [N::Real; 2]) -> Rectangle<N> {
        let lit = N::Real::lit;
        let of = |axis: usize| {
            let blocks = f64::from(self.layout.blocks[axis]);
            let block = |x: N::Real| (x * lit(1.0 / BLOCK as f64)).floor();
            let low = block(low[axis].ceil()).clip(lit(0.0), lit(blocks));
            let high = (block(high[axis]) + lit(1.0)).clip(low, lit(blocks).max(low));
            [N::index(low), N::index(high)]
        };
        let [[left, right], [bottom, top]] = [of(0), of(1)];
        Rectangle { low: [left, bottom], high: [right, top] }
    }

    /// Counts of a rectangle in each band, in four reads.
    #[inline(always)]
    pub fn mass(&self, rectangle: &Rectangle<N>, active: N::Mask) -> [N::Index; BANDS] {
        let corner = |x: N::Index, y: N::Index| N::gather::<4>(self.words, self.corner(x, y), active);
        let Rectangle { low, high } = *rectangle;
        let (near, far) =
            ([corner(low[0], low[1]), corner(high[0], low[1])], [low[0], high[0]].map(|x| corner(x, high[1])));
        std::array::from_fn(|b| (far[1][b] - far[0][b]) - (near[1][b] - near[0][b]))
    }

    /// Counts of a node of the lattice in each band.
    #[inline(always)]
    pub fn node(&self, node: [N::Index; 2], active: N::Mask) -> [N::Real; BANDS] {
        let [block_x, block_y] = node.map(|n| n >> BLOCK_SHIFT);
        let block = block_y * N::Index::lit(self.layout.blocks[0]) + block_x;
        let [x, y] = node.map(|n| n & N::Index::lit(BLOCK as u32 - 1));
        let within = y * N::Index::lit(BLOCK as u32) + x;
        let at = N::Index::lit(2 * self.layout.masses) + block * N::Index::lit(2 * BLOCK_PACKETS) + within;
        let [a, b] = N::gather::<2>(self.words, at, active);
        let (low, high) = (N::Index::lit(0xffff), N::Index::lit(0xffff_0000));
        let shift = N::Index::lit(EXPONENT_SHIFT);
        [(a & low) << 12, (a & high) >> 4, (b & low) << 12, (b & high) >> 4]
            .map(|bits| N::from_bits(bits + shift).floor())
    }

    /// Sum over the four nodes about a position, in nodes from the first, of their counts in each band times their tents. Nodes
    /// outside of the rectangle do not count.
    #[inline(always)]
    pub fn tents(&self, position: [N::Double; 2], rectangle: &Rectangle<N>, active: N::Mask) -> [N::Real; BANDS] {
        let taps = [0, 1].map(|axis| {
            let first = position[axis].floor();
            let t = N::narrow(position[axis] - first);
            [(first, N::Real::lit(1.0) - t), (first + N::Double::lit(1.0), t)]
        });
        self.weighted(&taps[0], &taps[1], rectangle, active)
    }

    /// Sum over the nodes with these numbers along x and y of their counts in each band times their weights along x and y. Nodes
    /// outside of the rectangle do not count.
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

    /// Draws a node of a rectangle by its count in one band, from two random numbers in [0, 1). There has to be any.
    #[inline(always)]
    pub fn choose(&self, rectangle: &Rectangle<N>, band: N::Index, u: [N::Real; 2], active: N::Mask) -> Drawn<N> {
        let Rectangle { low, high } = *rectangle;
        let sum = |x: N::Index, y: N::Index, active: N::Mask| {
            let [sum] = N::gather::<1>(self.words, (self.corner(x, y) << 2) + band, active);
            sum
        };
        let one = N::Index::lit(1);
        // Before a row of blocks, between the rectangle's sides.
        let before_row = |row: N::Index, active: N::Mask| sum(high[0], row, active) - sum(low[0], row, active);
        let (row, v) = bisect::<N>([low[1], high[1]], u[1], active, before_row);
        let before_column =
            |column: N::Index, active: N::Mask| sum(column, row + one, active) - sum(column, row, active);
        let (column, u) = bisect::<N>([low[0], high[0]], u[0], active, before_column);
        // The masses of the block.
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
        let (row_within, v) = one_of_four::<N>(rows.map(|[a, b, c, d]| a + b + (c + d)), v);
        let chosen = std::array::from_fn(|i| of_four::<N>(rows.map(|row| row[i]), row_within));
        let (column_within, u) = one_of_four::<N>(chosen, u);
        Drawn { node: [(column << BLOCK_SHIFT) + column_within, (row << BLOCK_SHIFT) + row_within], u: [u, v] }
    }

    /// Place of the sums before a block's corner, in units of four words.
    #[inline(always)]
    fn corner(&self, x: N::Index, y: N::Index) -> N::Index {
        N::Index::lit(self.layout.sums) + y * N::Index::lit(self.layout.blocks[0] + 1) + x
    }
}

/// A place in `[0, total)` drawn by a random number: its count and what is left of the number beyond that.
#[inline(always)]
fn place<N: Numbers>(total: N::Index, u: N::Real) -> (N::Index, N::Real) {
    let place = u * N::real(total);
    // Rounding may have made the product the total itself.
    let count = N::index(place).min(total.max(N::Index::lit(1)) - N::Index::lit(1));
    (count, (place - N::real(count)).clip(N::Real::lit(0.0), N::Real::lit(1.0)))
}

/// Where among `mass` counts a place lies, in [0, 1).
#[inline(always)]
fn stretched<N: Numbers>(count: N::Index, rest: N::Real, mass: N::Index) -> N::Real {
    let mass = N::real(mass.max(N::Index::lit(1)));
    ((N::real(count) + rest) / mass).min(N::Real::lit(BELOW_ONE))
}

/// One of the numbers from `low` on, before `high`, by the differences of what `before` counts, with the rest of a random number.
#[inline(always)]
fn bisect<N: Numbers>(
    [low, high]: [N::Index; 2],
    u: N::Real,
    active: N::Mask,
    before: impl Fn(N::Index, N::Mask) -> N::Index,
) -> (N::Index, N::Real) {
    let one = N::Index::lit(1);
    let start = before(low, active);
    let (count, rest) = place::<N>(before(high, active) - start, u);
    let target = start + count;
    let more = |[low, high]: [N::Index; 2]| (low + one).lt(high) & active;
    let [found, _] = N::while_loop(c"Bisection", [low, high], more, |[low, high]| {
        let middle = (low + high) >> 1;
        let beyond = target.lt(before(middle, more([low, high])));
        [N::Index::select(beyond, low, middle), N::Index::select(beyond, middle, high)]
    });
    let below = before(found, active);
    (found, stretched::<N>(target - below, rest, before(found + one, active) - below))
}

/// The element of that number.
#[inline(always)]
fn of_four<N: Numbers>([a, b, c, d]: [N::Index; 4], i: N::Index) -> N::Index {
    let select = |below: u32, yes, no| N::Index::select(i.lt(N::Index::lit(below)), yes, no);
    select(2, select(1, a, b), select(3, c, d))
}

/// One of four by their counts, with the rest of a random number.
#[inline(always)]
fn one_of_four<N: Numbers>(masses: [N::Index; 4], u: N::Real) -> (N::Index, N::Real) {
    let [a, b, c, d] = masses;
    let zero = N::Index::lit(0);
    let (first, second) = (a, a + b);
    let third = second + c;
    let (count, rest) = place::<N>(third + d, u);
    let step = |edge: N::Index| N::Index::select(count.lt(edge), zero, N::Index::lit(1));
    let i = step(first) + step(second) + step(third);
    (i, stretched::<N>(count - of_four::<N>([zero, first, second, third], i), rest, of_four::<N>(masses, i)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numeric::Plain;
    use rand::{RngExt, SeedableRng};
    use rand_pcg::Pcg64;

    const NODES: [usize; 2] = [13, 10];

    fn values() -> Vec<[f32; BANDS]> {
        let mut random = Pcg64::seed_from_u64(7);
        (0..NODES[0] * NODES[1])
            .map(|i| {
                let strong = if i == 57 { 1e4 } else { 1.0 };
                std::array::from_fn(|b| if (i + b) % 7 == 0 { 0.0 } else { strong * random.random::<f32>().powi(3) })
            })
            .collect()
    }

    fn view<F>(areas: &SummedArea) -> SummedAreaView<Plain<'_, F>>
    where
        for<'a> Plain<'a, F>: Numbers<Words = &'a [u32]>,
    {
        SummedAreaView { layout: *areas.layout(), words: areas.words() }
    }

    #[test]
    fn counts_keep_twelve_bits() {
        for count in (1..5000).chain([TOTAL_MAX as u32, 0x7fd0_ffff, 123_456_789]) {
            let code = encode(count);
            assert!(code < 1 << 16);
            let back = decode(code);
            // Half a unit of the twelfth bit.
            assert!((f64::from(back) / f64::from(count) - 1.0).abs() <= 1.0 / 4096.0, "{count} {back}");
            assert!(count >= 4096 || back == count, "{count} {back}");
        }
        assert_eq!(decode(0), 0);
    }

    #[test]
    fn rectangles_sum_their_nodes() {
        // Half a unit of the twelfth bit; the weakest are rounded to whole counts.
        const RELATIVE: f64 = 1.0 / 4096.0;
        let (values, areas) = (values(), SummedArea::new(NODES, &values()));
        let view = view::<f32>(&areas);
        for (low, high) in [([0.0, 0.0], [12.0, 9.0]), ([3.2, 4.0], [8.0, 6.5]), ([-9.0, 2.0], [2.0, 30.0])] {
            let rectangle = view.rectangle(low, high);
            let mass = view.mass(&rectangle, true);
            let (mut exact, mut rounded) = ([0.0; BANDS], [0u32; BANDS]);
            for row in 0..NODES[1] {
                for column in 0..NODES[0] {
                    let (at, nodes) = ([column, row], [0, 1]);
                    let inside = nodes.iter().all(|&axis| {
                        let block = at[axis] as u32 / BLOCK as u32;
                        (rectangle.low[axis]..rectangle.high[axis]).contains(&block)
                    });
                    let between = nodes.iter().all(|&axis| (low[axis]..=high[axis]).contains(&(at[axis] as f32)));
                    assert!(inside || !between);
                    if inside {
                        let node = view.node([column as u32, row as u32], true);
                        for b in 0..BANDS {
                            let value = f64::from(values[row * NODES[0] + column][b]);
                            let counted = f64::from(node[b] * areas.layout().unit[b]);
                            assert!((counted - value).abs() <= RELATIVE * value + f64::from(areas.layout().unit[b]));
                            exact[b] += value;
                            rounded[b] += node[b] as u32;
                        }
                    }
                }
            }
            assert_eq!(mass, rounded);
            for b in 0..BANDS {
                assert!((f64::from(mass[b]) * f64::from(areas.layout().unit[b]) / exact[b] - 1.0).abs() < RELATIVE);
            }
        }
        let nothing = view.rectangle([40.0, 2.0], [50.0, 3.0]);
        assert_eq!(view.mass(&nothing, true), [0; BANDS]);
    }

    fn check_draws<F: Copy>(from: impl Fn(f64) -> F, to: impl Fn(F) -> f64)
    where
        for<'a> Plain<'a, F>: Numbers<Words = &'a [u32], Real = F, Index = u32, Mask = bool>,
    {
        // Stratified numbers: no random error, but that of strata that straddle two nodes.
        const STEPS: usize = 1000;
        let areas = SummedArea::new(NODES, &values());
        let view = view::<F>(&areas);
        for band in 0..BANDS as u32 {
            let rectangle = view.rectangle([from(1.0), from(5.0)], [from(9.0), from(9.0)]);
            let total = f64::from(view.mass(&rectangle, true)[band as usize]);
            let (mut found, mut left) = (vec![0.0; NODES[0] * NODES[1]], [0.0; 2]);
            for i in 0..STEPS * STEPS {
                let u = [i % STEPS, i / STEPS].map(|k| from((k as f64 + 0.5) / STEPS as f64));
                let drawn = view.choose(&rectangle, band, u, true);
                found[(drawn.node[1] as usize) * NODES[0] + drawn.node[0] as usize] += 1.0;
                for (sum, u) in left.iter_mut().zip(drawn.u) {
                    assert!((0.0..1.0).contains(&to(u)));
                    *sum += to(u);
                }
            }
            for (i, found) in found.iter().enumerate() {
                let node = [(i % NODES[0]) as u32, (i / NODES[0]) as u32];
                let inside = node[0] / 4 <= 2 && node[1] / 4 >= 1;
                let expected = if inside { to(view.node(node, true)[band as usize]) / total } else { 0.0 };
                let share = found / (STEPS * STEPS) as f64;
                assert!((share - expected).abs() <= 2e-3, "{band} {node:?}: {share} {expected}");
                assert!(expected > 0.0 || share == 0.0);
            }
            for sum in left {
                assert!((sum / (STEPS * STEPS) as f64 - 0.5).abs() < 1e-2, "{left:?}");
            }
        }
    }

    #[test]
    fn nodes_are_drawn_by_their_counts() {
        check_draws::<f32>(|x| x as f32, f64::from);
        check_draws::<f64>(|x| x, |x| x);
    }

    #[test]
    fn tents_join_the_nodes_of_the_rectangle() {
        let areas = SummedArea::new(NODES, &values());
        let view = view::<f64>(&areas);
        let rectangle = view.rectangle([4.0, 0.0], [12.0, 9.0]);
        let node = |x: u32, y: u32| view.node([x, y], true);
        let between = view.tents([5.25, 3.5], &rectangle, true);
        let outside = view.tents([3.75, 2.0], &rectangle, true);
        for b in 0..BANDS {
            let exact = 0.5 * (0.75 * (node(5, 3)[b] + node(5, 4)[b]) + 0.25 * (node(6, 3)[b] + node(6, 4)[b]));
            assert!((between[b] - exact).abs() <= 1e-12 * exact);
            assert_eq!(outside[b], 0.75 * node(4, 2)[b]);
        }
        assert_eq!(view.tents([-1.5, 2.0], &rectangle, true), [0.0; BANDS]);
        assert_eq!(view.tents([4.0, 40.0], &rectangle, true), [0.0; BANDS]);
    }
}
