//! Summed-area table: masses on a rectangular lattice that are summed over, and sampled within, any rectangle.
//!
//! A mass is a non-negative weight: nodes are drawn in proportion to their masses. Each node holds a mass in each of
//! [`BANDS`] *bands*, which are several tables over one lattice. A mass is rounded to a whole number of *counts* with
//! 12 significant bits ([`encode`]). Sums of counts are exact, so the density that is computed for a sample is exactly
//! the probability with which the sample is drawn.
//!
//! ```text
//! T[y][x][b] = Σ counts in band b of all blocks in block columns before x, block rows before y    table of sums
//! counts(rectangle) = T[top][right] − T[top][left] − T[bottom][right] + T[bottom][left]     left ≤ right, bottom ≤ top
//! ```
//!
//! To save memory, sums are stored for blocks of 4 × 4 nodes, and rectangles consist of whole blocks. A sample is drawn
//! in two steps: bisection of the sums finds a block, and the counts of its 16 nodes give a node. A node takes 8 bytes
//! for its counts and about one for its part of the sums.

mod view;

use rayon::prelude::*;
use serde::{Deserialize, Serialize};
pub use view::{Drawn, Rectangle, SummedAreaView};

/// Masses per node: bands of the phase rate κ in the sampler of one wavelength, slices of w = cosθi + cosθo in the
/// sampler of colours. Four, since the encoded counts of a node then fill two words of 32 bits, and the four sums at a
/// block's corner one packet.
pub const BANDS: usize = 4;
/// Nodes of a block along either axis, a power of two. Chosen: larger blocks need less memory for the sums, but widen
/// rectangles more, so more samples fall outside the wanted range.
const BLOCK: usize = 4;
/// Binary logarithm of [`BLOCK`].
const BLOCK_SHIFT: u32 = BLOCK.ilog2();
/// 32-bit words per packet, the unit of one gather.
const PACKET_WORDS: u32 = 4;
/// Packets of a block's counts: 16 nodes of two words each.
const BLOCK_PACKETS: u32 = (BLOCK * BLOCK) as u32 * 2 / PACKET_WORDS;
/// Words of a block's counts.
const BLOCK_WORDS: usize = (PACKET_WORDS * BLOCK_PACKETS) as usize;
/// Largest sum of counts in a band. Codes have five bits of exponent, enough for counts below 2³¹. The margin of 1e-3
/// is chosen, larger than the fraction 2⁻¹² by which encoding may raise a count.
const TOTAL_MAX: f64 = 0.999 * (1u64 << 31) as f64;
/// Bits of an encoded count after the leading one.
const MANTISSA_BITS: u32 = 11;
/// Difference of the exponent biases of single precision (127) and of an encoded count (1), in the exponent's place
/// above the 23 bits of mantissa.
///
/// `(code << 12) + EXPONENT_SHIFT`, with 12 = 23 − [`MANTISSA_BITS`], are the bits of the count as a number of single
/// precision. The code 0 reads as ½, which rounds down to 0.
const EXPONENT_SHIFT: u32 = 126 << (f32::MANTISSA_DIGITS - 1);

/// Layout of the table data of a [`SummedArea`].
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct SummedAreaLayout {
    /// Nodes along x and y.
    pub nodes: [u32; 2],
    /// Blocks along x and y; the padding nodes of the last blocks have no mass.
    pub blocks: [u32; 2],
    /// Start of the counts, in packets of four words. Counts are in the order of
    /// `[block along y][block along x][node along y][node along x]`, two words per node. The halves of the words are
    /// the codes of the four bands, the lower half first.
    pub counts_start: u32,
    /// Start of the sums T, in packets of four words. Sums are in the order of `[block along y][block along x][band]`,
    /// with one more row and column than there are blocks.
    pub sums_start: u32,
    /// Mass of one count in each band.
    pub unit: [f32; BANDS],
}

/// Masses on a lattice, with their sums.
///
/// ```
/// use sunbeam::sampling::summed_area::{BANDS, SummedArea};
///
/// // Equal masses on 8 × 4 nodes.
/// let areas = SummedArea::new([8, 4], &[[1.0; BANDS]; 32]);
/// assert_eq!(areas.layout().blocks, [2, 1]);
/// ```
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct SummedArea {
    layout: SummedAreaLayout,
    words: Vec<u32>,
}

impl SummedArea {
    /// Rounds `masses`, `[node along y][node along x][band]`, to counts and sums them. `nodes` are the numbers of nodes
    /// along x and y.
    ///
    /// There is one mass for each node and band, and none is infinite. A positive mass becomes at least one count; a
    /// negative one or NaN becomes none.
    pub fn new(nodes: [usize; 2], masses: &[[f32; BANDS]]) -> Self {
        let blocks = nodes.map(|n| n.div_ceil(BLOCK));
        // Each positive mass may gain a count by rounding up.
        let counts_max = TOTAL_MAX - masses.len() as f64;
        let counts_per_mass = totals(masses).map(|total| if total > 0.0 { counts_max / total } else { 0.0 });
        let mut words = encoded(nodes, blocks, masses, counts_per_mass);
        let sums_start = words.len();
        let sums = sums_of_blocks(&words, blocks);
        words.extend(sums);
        let layout = SummedAreaLayout {
            nodes: nodes.map(|n| n as u32),
            blocks: blocks.map(|n| n as u32),
            counts_start: 0,
            sums_start: (sums_start / PACKET_WORDS as usize) as u32,
            unit: counts_per_mass.map(|scale| if scale > 0.0 { (1.0 / scale) as f32 } else { 0.0 }),
        };
        Self { layout, words }
    }

    /// Layout of the table data.
    pub fn layout(&self) -> &SummedAreaLayout {
        &self.layout
    }

    /// Table data, described by [`SummedArea::layout`]: 32-bit words, a multiple of four.
    pub fn words(&self) -> &[u32] {
        &self.words
    }

    /// Converts into the table data.
    pub fn into_words(self) -> Vec<u32> {
        self.words
    }
}

/// A mass in double precision; zero for a negative one or NaN.
fn positive(mass: f32) -> f64 {
    if mass > 0.0 { f64::from(mass) } else { 0.0 }
}

/// Sum of the positive masses of all nodes in each band.
fn totals(masses: &[[f32; BANDS]]) -> [f64; BANDS] {
    masses.iter().fold([0.0; BANDS], |sum, mass| std::array::from_fn(|b| sum[b] + positive(mass[b])))
}

/// Encoded counts of all nodes, in the order of [`SummedAreaLayout::counts_start`]. `nodes` and `blocks` are numbers
/// along x and y.
fn encoded(nodes: [usize; 2], blocks: [usize; 2], masses: &[[f32; BANDS]], counts_per_mass: [f64; BANDS]) -> Vec<u32> {
    let mut words = vec![0u32; blocks[0] * blocks[1] * BLOCK_WORDS];
    // One row of blocks at a time.
    words.par_chunks_mut((blocks[0] * BLOCK_WORDS).max(1)).enumerate().for_each(|(block_row, words)| {
        for row in block_row * BLOCK..((block_row + 1) * BLOCK).min(nodes[1]) {
            for column in 0..nodes[0] {
                let mass = &masses[row * nodes[0] + column];
                let code: [u32; BANDS] = std::array::from_fn(|b| {
                    let counts = positive(mass[b]) * counts_per_mass[b];
                    if counts > 0.0 { encode(counts.round().max(1.0) as u32) } else { 0 }
                });
                // The blocks to the left, then two words per node within the block.
                let at = column / BLOCK * BLOCK_WORDS + 2 * (row % BLOCK * BLOCK + column % BLOCK);
                words[at] = code[0] | (code[1] << 16);
                words[at + 1] = code[2] | (code[3] << 16);
            }
        }
    });
    words
}

/// The sums T of the counts that [`encoded`] returns, in the order of [`SummedAreaLayout::sums_start`]. The first row
/// and column are zeros.
fn sums_of_blocks(codes: &[u32], blocks: [usize; 2]) -> Vec<u32> {
    let stride = BANDS * (blocks[0] + 1);
    let mut sums = vec![0u32; stride * (blocks[1] + 1)];
    for by in 0..blocks[1] {
        // Counts of this row of blocks, up to and including block bx.
        let mut in_row = [0u32; BANDS];
        for bx in 0..blocks[0] {
            let block = &codes[(by * blocks[0] + bx) * BLOCK_WORDS..][..BLOCK_WORDS];
            for node in block.chunks_exact(2) {
                for (b, sum) in in_row.iter_mut().enumerate() {
                    *sum += decode((node[b / 2] >> (16 * (b % 2))) & 0xffff);
                }
            }
            for (b, sum) in in_row.iter().enumerate() {
                // T[by + 1][bx + 1] = T[by][bx + 1] + counts of the row.
                let before = by * stride + BANDS * (bx + 1) + b;
                sums[before + stride] = sums[before] + sum;
            }
        }
    }
    sums
}

/// Code of a positive count, in 16 bits: the count is rounded to 12 significant bits. The upper 5 bits are its binary
/// exponent plus one, the lower 11 the bits after the leading one. No positive count has the code 0, which stands for
/// zero.
fn encode(count: u32) -> u32 {
    let exponent = count.ilog2();
    let mantissa = if exponent > MANTISSA_BITS {
        let shift = exponent - MANTISSA_BITS;
        (count + (1 << (shift - 1))) >> shift
    } else {
        count << (MANTISSA_BITS - exponent)
    };
    // `mantissa` includes the leading one, which adds one to the exponent. If rounding carries to the next power of
    // two, it adds another one, as it must.
    (exponent << MANTISSA_BITS) + mantissa
}

/// Decodes the count of a 16-bit code.
fn decode(code: u32) -> u32 {
    f32::from_bits((code << 12) + EXPONENT_SHIFT) as u32
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numeric::{Numbers, Plain};
    use rand::{RngExt, SeedableRng};
    use rand_pcg::Pcg64;

    const NODES: [usize; 2] = [13, 10];

    /// Random masses, a seventh of them zero; one node is much heavier than the others.
    fn random_masses() -> Vec<[f32; BANDS]> {
        let mut random = Pcg64::seed_from_u64(7);
        (0..NODES[0] * NODES[1])
            .map(|i| {
                let strong = if i == 57 { 1e4 } else { 1.0 };
                std::array::from_fn(|b| if (i + b) % 7 == 0 { 0.0 } else { strong * random.random::<f32>().powi(3) })
            })
            .collect()
    }

    fn view_of<F>(areas: &SummedArea) -> SummedAreaView<Plain<'_, F>>
    where
        for<'a> Plain<'a, F>: Numbers<Words = &'a [u32]>,
    {
        SummedAreaView { layout: *areas.layout(), words: areas.words() }
    }

    #[test]
    fn counts_keep_twelve_bits() {
        // Counts below and above 2¹², and three large ones.
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
    fn rectangle_mass_is_the_sum_of_its_nodes() {
        // Half a unit of the twelfth bit. The smallest masses are rounded to whole counts.
        const RELATIVE: f64 = 1.0 / 4096.0;
        let masses = random_masses();
        let areas = SummedArea::new(NODES, &masses);
        let view = view_of::<f32>(&areas);
        for (low, high) in [([0.0, 0.0], [12.0, 9.0]), ([3.2, 4.0], [8.0, 6.5]), ([-9.0, 2.0], [2.0, 30.0])] {
            let rectangle = view.rectangle(low, high);
            let counts = view.counts(&rectangle, true);
            let (mut exact, mut rounded) = ([0.0; BANDS], [0u32; BANDS]);
            for row in 0..NODES[1] {
                for column in 0..NODES[0] {
                    let (at, axes) = ([column, row], [0, 1]);
                    let inside = axes.iter().all(|&axis| {
                        let block = at[axis] as u32 / BLOCK as u32;
                        (rectangle.low[axis]..rectangle.high[axis]).contains(&block)
                    });
                    let between = axes.iter().all(|&axis| (low[axis]..=high[axis]).contains(&(at[axis] as f32)));
                    assert!(inside || !between);
                    if inside {
                        let node = view.node_counts([column as u32, row as u32], true);
                        for b in 0..BANDS {
                            let mass = f64::from(masses[row * NODES[0] + column][b]);
                            let counted = f64::from(node[b] * areas.layout().unit[b]);
                            assert!((counted - mass).abs() <= RELATIVE * mass + f64::from(areas.layout().unit[b]));
                            exact[b] += mass;
                            rounded[b] += node[b] as u32;
                        }
                    }
                }
            }
            assert_eq!(counts, rounded);
            for b in 0..BANDS {
                assert!((f64::from(counts[b]) * f64::from(areas.layout().unit[b]) / exact[b] - 1.0).abs() < RELATIVE);
            }
        }
        let nothing = view.rectangle([40.0, 2.0], [50.0, 3.0]);
        assert_eq!(view.counts(&nothing, true), [0; BANDS]);
    }

    /// Compares the frequencies of drawn nodes with their counts, in the precision `F` that `from` and `to` convert.
    fn check_draws<F: Copy>(from: impl Fn(f64) -> F, to: impl Fn(F) -> f64)
    where
        for<'a> Plain<'a, F>: Numbers<Words = &'a [u32], Real = F, Index = u32, Mask = bool>,
    {
        // The random numbers are stratified. Only strata that straddle two nodes cause errors.
        const STEPS: usize = 1000;
        let areas = SummedArea::new(NODES, &random_masses());
        let view = view_of::<F>(&areas);
        for band in 0..BANDS as u32 {
            let rectangle = view.rectangle([from(1.0), from(5.0)], [from(9.0), from(9.0)]);
            let total = f64::from(view.counts(&rectangle, true)[band as usize]);
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
                // The rectangle consists of the blocks 0 to 2 along x and 1 to 2 along y.
                let inside = node[0] / BLOCK as u32 <= 2 && node[1] / BLOCK as u32 >= 1;
                let expected = if inside { to(view.node_counts(node, true)[band as usize]) / total } else { 0.0 };
                // A node is drawn in an interval of u and one of v. Each may be wrong by one stratum, 1/STEPS.
                let fraction = found / (STEPS * STEPS) as f64;
                assert!((fraction - expected).abs() <= 2e-3, "{band} {node:?}: {fraction} {expected}");
                assert!(expected > 0.0 || fraction == 0.0);
            }
            // Rescaled random numbers are uniform in [0, 1), but for the strata that straddle two nodes.
            for sum in left {
                assert!((sum / (STEPS * STEPS) as f64 - 0.5).abs() < 1e-2, "{left:?}");
            }
        }
    }

    #[test]
    fn nodes_are_drawn_in_proportion_to_their_counts() {
        check_draws::<f32>(|x| x as f32, f64::from);
        check_draws::<f64>(|x| x, |x| x);
    }

    #[test]
    fn tents_interpolate_within_the_rectangle() {
        let areas = SummedArea::new(NODES, &random_masses());
        let view = view_of::<f64>(&areas);
        let rectangle = view.rectangle([4.0, 0.0], [12.0, 9.0]);
        let node = |x: u32, y: u32| view.node_counts([x, y], true);
        let between = view.tents([5.25, 3.5], &rectangle, true);
        let outside = view.tents([3.75, 2.0], &rectangle, true);
        for b in 0..BANDS {
            let exact = 0.5 * (0.75 * (node(5, 3)[b] + node(5, 4)[b]) + 0.25 * (node(6, 3)[b] + node(6, 4)[b]));
            assert!((between[b] - exact).abs() <= 1e-12 * exact);
            // A quarter of the tent at 3.75 belongs to node 3, which lies outside.
            assert_eq!(outside[b], 0.75 * node(4, 2)[b]);
        }
        assert_eq!(view.tents([-1.5, 2.0], &rectangle, true), [0.0; BANDS]);
        assert_eq!(view.tents([4.0, 40.0], &rectangle, true), [0.0; BANDS]);
    }
}
