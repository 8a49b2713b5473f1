//! A [`SpectralTable`] in the form that evaluators read, and the look-up itself, written once for all families of numbers.

use super::joining::Joining;
use super::lattice::Lattice;
use super::lookup::{HEADER, KernelKind, SpectralTable};
use crate::numeric::math::{bf16_pair, cubic_b_spline, u16_pair};
use crate::numeric::{Index, Number, Numbers, Plain, Real};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::f64::consts::{LOG2_E, TAU};

/// Tolerance from which splines are kept in 16 bits, and nodes above which: their steps, a 65 535th of a record's range, are
/// then well below it. Few nodes are small anyway, and those of a grating cancel against what they are at κ = 0.
const FIXED_TOLERANCE: f64 = 1e-4;
const FIXED_NODES: usize = 4096;
/// Nodes along x up to which a look-up visits those of a row without a loop.
const UNROLLED_TAPS: u32 = 8;
/// Places of a mean over κ.
const MEAN_POINTS: usize = 24;

/// How a node's spline is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Format {
    /// Of a power, 16 bits a coefficient: the node's entry is `[start, low | step]`, the two being upper halves of
    /// single-precision numbers, and a coefficient is `low + step·integer`. What powers have at κ = 0 is order zero's alone.
    Fixed,
    /// The same where every node has something at κ = 0: the entry goes on with `P(0)` and `P'(0)`.
    FixedFromZero,
    /// Of a power in single precision. The entry is `[start, P(0), P'(0), 0]`.
    Single,
    /// Of an amplitude in single precision, real and imaginary part in turn. The entry is `[start, Re D(0), Im D(0), 0]`.
    Complex,
}

impl Format {
    /// Words of a node's entry.
    fn entry(self) -> usize {
        if self == Self::Fixed { 2 } else { 4 }
    }

    /// Words of a packet of coefficients, and the coefficients in it.
    fn packet(self) -> (usize, usize) {
        match self {
            Self::Fixed | Self::FixedFromZero => (1, 2),
            Self::Single => (4, 4),
            Self::Complex => (4, 2),
        }
    }

    /// Packets that hold four coefficients wherever they begin.
    fn packets(self) -> usize {
        if self == Self::Single { 2 } else { 3 }
    }
}

/// Everything about a [`PackedTable`] but its words; see [`SpectralTable`] for the formula.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct PackedLayout {
    /// Period whose reciprocal is the spacing of nodes, in µm, along x and y, and so on below.
    pub period_um: [f64; 2],
    /// How nodes are joined, and the standard deviation of that in nodes.
    pub joining: [Joining; 2],
    pub sigma: [f64; 2],
    /// Nodes read by one look-up.
    pub taps: [u32; 2],
    /// Largest node number.
    pub reach: [u32; 2],
    /// Node number beyond which the pixels say nothing; infinite where the tile repeats.
    pub cutoff: [f64; 2],
    /// Normalisation, µm².
    pub norm: f64,
    /// Largest κ, spacing of knots and κ₀, rad/µm.
    pub kappa_max: f64,
    pub kappa_step: f64,
    pub kappa_knee: f64,
    /// Power of order zero at κ = 0, where the format leaves it out of the entries.
    pub zero: f64,
    pub format: Format,
}

/// The power density `S(f; κ)` of one surface in words of 32 bits: an entry for every node, row by row from node
/// `(−reach, −reach)`, then the coefficients that entries point to, from the knot −1 on.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct PackedTable {
    lattice: Lattice,
    layout: PackedLayout,
    words: Vec<u32>,
}

impl PackedTable {
    /// Packs a table that was built to a relative error of `tolerance`.
    pub fn new(table: &SpectralTable, tolerance: f64) -> Self {
        let columns = table.lattice.x.nodes();
        let nodes = table.kept_nodes();
        let format = match table.kernel {
            KernelKind::Amplitude => Format::Complex,
            KernelKind::Power if tolerance < FIXED_TOLERANCE || nodes.len() <= FIXED_NODES => Format::Single,
            KernelKind::Power => {
                // A tile that repeats sends all its light into order zero at κ = 0.
                let native = [&table.lattice.x, &table.lattice.y].iter().all(|axis| axis.cutoff.is_infinite());
                if native { Format::Fixed } else { Format::FixedFromZero }
            }
        };
        let (reach_x, reach_y) = (table.lattice.x.reach as i64, table.lattice.y.reach as i64);
        let centre = nodes.iter().find(|(jx, jy, _)| (*jx, *jy) == (0, 0));
        let zero = centre.map_or(0.0, |(_, _, record)| f64::from(record[0]));
        let (packet, _) = format.packet();
        // The record of zeros, for nodes out of reach: as long as the longest.
        let coefficients = |record: &[f32]| (record.len() - HEADER) / table.kernel.components();
        let length = |coefficients: usize| coefficients.div_ceil(format.packet().1) * packet;
        let longest = nodes.iter().map(|(_, _, record)| length(coefficients(record))).max().unwrap_or(0);
        let entries = (format.entry() * table.offsets.len()).next_multiple_of(4);
        let first = entries as u32;
        let mut starts = Vec::with_capacity(nodes.len());
        let mut end = entries + longest.next_multiple_of(4);
        for (_, _, record) in &nodes {
            starts.push(end);
            end += length(coefficients(record));
        }
        // Packets beyond a record are read with weights of zero, those beyond the last one too.
        let mut words = vec![0u32; end + format.packets() * packet];
        for entry in words[..format.entry() * table.offsets.len()].chunks_exact_mut(format.entry()) {
            entry[0] = first / packet as u32;
        }
        let packed: Vec<(Vec<u32>, u32)> = nodes.par_iter().map(|(_, _, record)| format.write(record)).collect();
        for (((jx, jy, record), start), (coefficients, scale)) in nodes.iter().zip(&starts).zip(&packed) {
            words[*start..start + coefficients.len()].copy_from_slice(coefficients);
            let node = (jy + reach_y) as usize * columns + (jx + reach_x) as usize;
            let entry = &mut words[format.entry() * node..][..format.entry()];
            let zero = [record[0].to_bits(), record[1].to_bits()];
            entry[0] = (*start / packet) as u32;
            match format {
                Format::Fixed => entry[1] = *scale,
                Format::FixedFromZero => entry[1..].copy_from_slice(&[*scale, zero[0], zero[1]]),
                Format::Single | Format::Complex => entry[1..3].copy_from_slice(&zero),
            }
        }
        let (x, y) = (&table.lattice.x, &table.lattice.y);
        let layout = PackedLayout {
            period_um: [x.period_um, y.period_um],
            joining: [x.joining, y.joining],
            sigma: [x.sigma, y.sigma],
            taps: [x.taps as u32, y.taps as u32],
            reach: [x.reach as u32, y.reach as u32],
            cutoff: [x.cutoff, y.cutoff],
            norm: table.norm,
            kappa_max: table.kappa_max,
            kappa_step: table.kappa_step,
            kappa_knee: table.kappa_knee,
            zero,
            format,
        };
        Self { lattice: table.lattice.clone(), layout, words }
    }

    /// The lattice of nodes.
    pub fn lattice(&self) -> &Lattice {
        &self.lattice
    }

    /// The table as it was before it was packed, but for the rounding.
    pub fn unpacked(&self) -> SpectralTable {
        let (format, layout) = (self.layout.format, &self.layout);
        let (packet, _) = format.packet();
        let kernel = if format == Format::Complex { KernelKind::Amplitude } else { KernelKind::Power };
        let nodes = self.lattice.x.nodes() * self.lattice.y.nodes();
        let entries: Vec<&[u32]> = self.words[..format.entry() * nodes].chunks_exact(format.entry()).collect();
        let nothing = (format.entry() * nodes).next_multiple_of(4) / packet;
        let kept: Vec<usize> = (0..nodes).filter(|&node| entries[node][0] as usize != nothing).collect();
        let end = self.words.len() / packet - format.packets();
        let starts = kept.iter().map(|&node| entries[node][0] as usize).chain([end]);
        let starts: Vec<usize> = starts.collect();
        // A start of 0 means no record.
        let mut records = vec![0f32; 1];
        let mut offsets = vec![0; nodes];
        let zero_node = nodes / 2;
        for (&node, pair) in kept.iter().zip(starts.windows(2)) {
            let entry = entries[node];
            let words = &self.words[packet * pair[0]..packet * pair[1]];
            let at_zero = match format {
                Format::Fixed => [if node == zero_node { layout.zero as f32 } else { 0.0 }, 0.0],
                Format::FixedFromZero => [f32::from_bits(entry[2]), f32::from_bits(entry[3])],
                Format::Single | Format::Complex => [f32::from_bits(entry[1]), f32::from_bits(entry[2])],
            };
            offsets[node] = records.len() as u32;
            records.extend(at_zero);
            match format {
                Format::Fixed | Format::FixedFromZero => {
                    let [low, step] = bf16_pair::<Plain<f32>>(entry[1]);
                    records.extend(words.iter().flat_map(|&word| u16_pair::<Plain<f32>>(word)).map(|i| low + step * i));
                }
                Format::Single | Format::Complex => records.extend(words.iter().map(|&word| f32::from_bits(word))),
            }
        }
        SpectralTable {
            lattice: self.lattice.clone(),
            kernel,
            norm: layout.norm,
            kappa_max: layout.kappa_max,
            kappa_step: layout.kappa_step,
            kappa_knee: layout.kappa_knee,
            offsets,
            records,
        }
    }

    /// Everything but the words.
    pub fn layout(&self) -> &PackedLayout {
        &self.layout
    }

    /// Standard deviation of the Gaussian of a node's power, in nodes, along x and y. Amplitudes are squared, so theirs is
    /// narrower than the joining Gaussian by √2.
    pub fn power_sigma(&self) -> [f64; 2] {
        let narrower = if self.layout.format == Format::Complex { 0.5f64.sqrt() } else { 1.0 };
        self.layout.sigma.map(|sigma| sigma * narrower)
    }

    /// The words.
    pub fn words(&self) -> &[u32] {
        &self.words
    }

    /// Bytes held.
    pub fn bytes(&self) -> usize {
        size_of_val(self.words.as_slice())
    }

    /// The table over its own words.
    pub fn view(&self) -> TableView<Plain<'_, f64>> {
        TableView { layout: self.layout, words: &self.words }
    }

    /// `S(f; κ)` in µm² at a frequency in cycles/µm and κ in rad/µm.
    pub fn density(&self, f: [f64; 2], kappa: f64) -> f64 {
        self.view().density(f, kappa, true)
    }

    /// Mean of `S(f; κ)` in µm² over the κ that outgoing directions span, `[2π cosθi/λ, 2π(cosθi + 1)/λ]`: what an error
    /// of `S` is small or large against. `f` in cycles/µm, the wavelength in µm.
    pub fn hemisphere_mean(&self, f: [f64; 2], cos_i: f64, wavelength_um: f64) -> f64 {
        let unit = TAU / wavelength_um;
        self.mean(f, [unit * cos_i, unit * (cos_i + 1.0)])
    }

    /// Mean of `S(f; κ)` in µm² over a range of κ in rad/µm.
    pub(super) fn mean(&self, f: [f64; 2], [low, high]: [f64; 2]) -> f64 {
        let at = |i: usize| low + (high - low) * (i as f64 + 0.5) / MEAN_POINTS as f64;
        (0..MEAN_POINTS).map(|i| self.density(f, at(i))).sum::<f64>() / MEAN_POINTS as f64
    }
}

impl Format {
    /// A record's coefficients in words, and the word of `low` and `step` where there is one.
    fn write(self, record: &[f32]) -> (Vec<u32>, u32) {
        let coefficients = &record[HEADER..];
        if matches!(self, Self::Single | Self::Complex) {
            return (coefficients.iter().map(|c| c.to_bits()).collect(), 0);
        }
        let (least, most) =
            coefficients.iter().fold((f32::INFINITY, f32::NEG_INFINITY), |(a, b), &c| (a.min(c), b.max(c)));
        let low = bf16_at_most(least);
        let step = -bf16_at_most(-(most - low) / 65535.0);
        let integer = |c: f32| {
            let steps = if step > 0.0 { ((c - low) / step).round() } else { 0.0 };
            steps.clamp(0.0, 65535.0) as u32
        };
        let words = coefficients.chunks(2).map(|pair| {
            let upper = pair.get(1).map_or(0, |&c| integer(c));
            integer(pair[0]) | (upper << 16)
        });
        (words.collect(), (low.to_bits() >> 16) | (step.to_bits() & 0xffff_0000))
    }
}

/// The largest number with the upper 16 bits of a single-precision one alone that is at most `x`.
fn bf16_at_most(x: f32) -> f32 {
    let cut = f32::from_bits(x.to_bits() & 0xffff_0000);
    // Cutting bits off brings a number nearer to zero.
    if cut > x { f32::from_bits((x.to_bits() & 0xffff_0000) + 0x1_0000) } else { cut }
}

/// A [`PackedTable`] whose words are read by a family of numbers.
#[derive(Clone, Copy)]
pub struct TableView<N: Numbers> {
    pub layout: PackedLayout,
    pub words: N::Words,
}

impl<N: Numbers> TableView<N> {
    /// The power density `S(f; κ)` in µm², never negative, at the frequency `f` (cycles/µm) and `kappa` (rad/µm).
    #[inline(always)]
    pub fn density(&self, f: [N::Double; 2], kappa: N::Real, active: N::Mask) -> N::Real {
        let layout = &self.layout;
        let (lit, int) = (N::Real::lit, N::Index::lit);
        let position: [N::Double; 2] = std::array::from_fn(|axis| f[axis] * N::Double::lit(layout.period_um[axis]));
        let [(column, from_x), (row, from_y)] = std::array::from_fn(|axis| self.first_tap(position[axis], axis));
        let curve = Curve::<N>::new(layout, kappa);
        let [taps_x, taps_y] = layout.taps;
        let columns = int(2 * layout.reach[0] + 1);
        let ex = N::tabulated(taps_x, |i| joined(layout.joining[0], from_x - N::real(i)));
        let tap = |node: N::Index, e: N::Real, [re, im]: [N::Real; 2]| {
            let [a, b] = self.node(&curve, node, active);
            [e.fma(a, re), e.fma(b, im)]
        };
        let in_row = |iy: N::Index, sum: [N::Real; 2]| {
            let first = (row + iy) * columns + column;
            let row_sum = if taps_x <= UNROLLED_TAPS {
                (0..taps_x).fold([lit(0.0); 2], |sum, ix| tap(first + int(ix), ex(int(ix)), sum))
            } else {
                let start = (int(0), [lit(0.0); 2]);
                let go_on = |(ix, _): (N::Index, [N::Real; 2])| active & ix.lt(int(taps_x));
                N::while_loop(c"orders of a row", start, go_on, |(ix, sum)| (ix + int(1), tap(first + ix, ex(ix), sum)))
                    .1
            };
            let ey = joined(layout.joining[1], from_y - N::real(iy));
            std::array::from_fn(|part| ey.fma(row_sum[part], sum[part]))
        };
        let [re, im] = if taps_y == 1 {
            in_row(int(0), [lit(0.0); 2])
        } else {
            let start = (int(0), [lit(0.0); 2]);
            let go_on = |(iy, _): (N::Index, [N::Real; 2])| active & iy.lt(int(taps_y));
            N::while_loop(c"diffraction orders", start, go_on, |(iy, sum)| (iy + int(1), in_row(iy, sum))).1
        };
        let value = match layout.format {
            Format::Complex => re * re + im * im,
            Format::Fixed => {
                // Where order zero is among the nodes read.
                let zero = |first: N::Index, axis: usize| {
                    let number = int(layout.reach[axis]);
                    first.le(number) & number.lt(first + int(layout.taps[axis]))
                };
                let [x, y] = position.map(N::narrow);
                let e = joined(layout.joining[0], x) * joined(layout.joining[1], y);
                let value = e * curve.from_zero[0] * lit(layout.zero);
                let at_zero = N::Real::select(zero(column, 0) & zero(row, 1), value, lit(0.0));
                // A spline may undershoot a zero of the power by the tolerance.
                (re + at_zero).max(lit(0.0))
            }
            Format::Single | Format::FixedFromZero => re.max(lit(0.0)),
        } * lit(layout.norm);
        if layout.cutoff.iter().all(|cutoff| cutoff.is_infinite()) {
            return value;
        }
        let [x, y]: [N::Mask; 2] =
            std::array::from_fn(|axis| position[axis].abs().le(N::Double::lit(layout.cutoff[axis])));
        N::Real::select(x & y, value, lit(0.0))
    }

    /// The first node that a look-up at `position` (in nodes) reads along an axis, counted from the lattice's first, and
    /// how far behind the position it lies: the nearest ones that there are.
    #[inline(always)]
    fn first_tap(&self, position: N::Double, axis: usize) -> (N::Index, N::Real) {
        let lit = N::Double::lit;
        let (taps, reach) = (f64::from(self.layout.taps[axis]), f64::from(self.layout.reach[axis]));
        let first = (position - lit(0.5 * taps)).ceil().clip(lit(-reach), lit(reach + 1.0 - taps));
        (N::index_of_double(first + lit(reach)), N::narrow(position - first))
    }

    /// A node's power, or the real and the imaginary part of its amplitude.
    #[inline(always)]
    fn node(&self, curve: &Curve<N>, node: N::Index, active: N::Mask) -> [N::Real; 2] {
        let lit = N::Real::lit;
        let packet = |start: N::Index, number: u32| start + curve.packet + N::Index::lit(number);
        match self.layout.format {
            Format::Fixed => {
                let [start, scale] = N::gather::<2>(self.words, node, active);
                [curve.factor[0] * self.fixed(curve, scale, |i| packet(start, i), active), lit(0.0)]
            }
            Format::FixedFromZero => {
                let [start, scale, zero, slope] = N::gather::<4>(self.words, node, active);
                let spline = self.fixed(curve, scale, |i| packet(start, i), active);
                let at_zero = curve.at_zero(N::from_bits(zero), N::from_bits(slope));
                [curve.factor[0].fma(spline, at_zero), lit(0.0)]
            }
            Format::Single => {
                let [start, zero, slope, _] = N::gather::<4>(self.words, node, active);
                let mut spline = lit(0.0);
                for i in 0..2 {
                    let words = N::gather::<4>(self.words, packet(start, i as u32), active);
                    for (word, weight) in words.into_iter().zip(&curve.weights[4 * i..]) {
                        spline = weight.fma(N::from_bits(word), spline);
                    }
                }
                let at_zero = curve.at_zero(N::from_bits(zero), N::from_bits(slope));
                [curve.factor[0].fma(spline, at_zero), lit(0.0)]
            }
            Format::Complex => {
                let [start, re, im, _] = N::gather::<4>(self.words, node, active);
                let mut spline = [lit(0.0); 2];
                for i in 0..3 {
                    let words = N::gather::<4>(self.words, packet(start, i as u32), active);
                    for (pair, weight) in words.chunks_exact(2).zip(&curve.weights[2 * i..]) {
                        spline = std::array::from_fn(|part| weight.fma(N::from_bits(pair[part]), spline[part]));
                    }
                }
                let [a, b] = curve.factor;
                [N::from_bits(re) + a * spline[0] - b * spline[1], N::from_bits(im) + a * spline[1] + b * spline[0]]
            }
        }
    }

    /// A spline of 16 bits a coefficient. The weights of a B-spline sum to one, so `low` comes once.
    #[inline(always)]
    fn fixed(&self, curve: &Curve<N>, scale: N::Index, packet: impl Fn(u32) -> N::Index, active: N::Mask) -> N::Real {
        let mut steps = N::Real::lit(0.0);
        for i in 0..3 {
            let [word] = N::gather::<1>(self.words, packet(i as u32), active);
            let [a, b] = u16_pair::<N>(word);
            steps = curve.weights[2 * i + 1].fma(b, curve.weights[2 * i].fma(a, steps));
        }
        let [low, step] = bf16_pair::<N>(scale);
        step.fma(steps, low)
    }
}

/// Twin of [`Joining::weight`] within its reach.
#[inline(always)]
fn joined<R: Real>(joining: Joining, distance: R) -> R {
    let lit = R::lit;
    match joining {
        Joining::Gaussian { sigma } => (distance * distance * lit(-0.5 * LOG2_E / (sigma * sigma))).exp2(),
        Joining::Semicircle { beta, radius } => {
            let rest = (distance * distance).fma(lit(-1.0 / (radius * radius)), lit(1.0)).max(lit(0.0));
            rest.sqrt().fma(lit(beta * LOG2_E), lit(-beta * LOG2_E)).exp2()
        }
    }
}

/// Where a look-up reads the splines in κ.
struct Curve<N: Numbers> {
    /// First packet of a record.
    packet: N::Index,
    /// Of the coefficients from that packet's first on.
    weights: [N::Real; 8],
    /// `κ²/(κ²+κ₀²)` of powers, `κ/(κ + iκ₀)` of amplitudes, which undoes the scaling of the records.
    factor: [N::Real; 2],
    /// Of a power and its slope at κ = 0: `κ₀²/(κ²+κ₀²)` and `κκ₀²/(κ²+κ₀²)`.
    from_zero: [N::Real; 2],
}

impl<N: Numbers> Curve<N> {
    #[inline(always)]
    fn new(layout: &PackedLayout, kappa: N::Real) -> Self {
        let lit = N::Real::lit;
        let shift = layout.format.packet().1.ilog2();
        let kappa = kappa.clip(lit(0.0), lit(layout.kappa_max));
        let t = kappa / lit(layout.kappa_step);
        let packet = N::index(t) >> shift;
        // Coefficient i belongs to the knot i − 1.
        let offset = t - N::real(packet << shift) + lit(1.0);
        let knee = lit(layout.kappa_knee * layout.kappa_knee);
        let squares = kappa.fma(kappa, knee);
        let per_squares = kappa / squares;
        Self {
            packet,
            weights: std::array::from_fn(|i| cubic_b_spline(offset - lit(i as f64))),
            factor: match layout.format {
                Format::Complex => [kappa * per_squares, -per_squares * lit(layout.kappa_knee)],
                _ => [kappa * per_squares, lit(0.0)],
            },
            from_zero: [knee / squares, knee * per_squares],
        }
    }

    /// What a power and its slope at κ = 0 make of the power here.
    #[inline(always)]
    fn at_zero(&self, power: N::Real, slope: N::Real) -> N::Real {
        self.from_zero[1].fma(slope, self.from_zero[0] * power)
    }
}
