//! A [`SpectralTable`] in the form that evaluators read.

use super::kernel::InterpolationKernel;
use super::lattice::Lattice;
use super::lookup::{HEADER, NodeQuantity, SpectralTable};
use super::view::TableView;
use crate::numeric::Plain;
use crate::numeric::math::{bf16_pair, u16_pair};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::f64::consts::TAU;

/// Tolerance from which splines are kept in 16 bits, and nodes above which: their steps, a 65 535th of a record's
/// range, are then well below it. Few nodes are small anyway, and those of a grating cancel against what they are at κ
/// = 0.
const FIXED_TOLERANCE: f64 = 1e-4;
const FIXED_NODES: usize = 4096;
/// Places of a mean over κ.
const MEAN_POINTS: usize = 24;

/// How a node's spline is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Format {
    /// Of a power, 16 bits a coefficient: the node's entry is `[start, low | step]`, the two being upper halves of
    /// single-precision numbers, and a coefficient is `low + step·integer`. What powers have at κ = 0 is order zero's
    /// alone.
    Fixed,
    /// The same where every node has something at κ = 0: the entry goes on with `P(0)` and `P'(0)`.
    FixedFromZero,
    /// Of a power in single precision. The entry is `[start, P(0), P'(0), 0]`.
    Single,
    /// Of an amplitude in single precision, real and imaginary part in turn. The entry is `[start, Re D(0), Im D(0),
    /// 0]`.
    Complex,
}

impl Format {
    /// Words of a node's entry.
    fn entry(self) -> usize {
        if self == Self::Fixed { 2 } else { 4 }
    }

    /// Words of a packet of coefficients, and the coefficients in it.
    pub(super) fn packet(self) -> (usize, usize) {
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
    pub kernel: [InterpolationKernel; 2],
    /// Standard deviations along x and y, in cells.
    pub sigma: [f64; 2],
    /// Nodes read by one look-up.
    pub taps: [u32; 2],
    /// Largest node number.
    pub reach: [u32; 2],
    /// Node number beyond which the pixels say nothing; infinite where the tile repeats.
    pub cutoff: [f64; 2],
    /// Normalisation, µm².
    pub norm: f64,
    /// Largest κ, in rad/µm.
    pub kappa_max: f64,
    /// Spacing of the spline's knots in κ, in rad/µm.
    pub kappa_step: f64,
    /// κ₀ of [`SpectralTable`]'s formulae, in rad/µm: the reciprocal of half the range of heights.
    pub kappa_knee: f64,
    /// Power of order zero at κ = 0, where the format leaves it out of the entries.
    pub zero: f64,
    /// How entries are packed.
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
        let format = match table.quantity {
            NodeQuantity::Amplitude => Format::Complex,
            NodeQuantity::Power if tolerance < FIXED_TOLERANCE || nodes.len() <= FIXED_NODES => Format::Single,
            NodeQuantity::Power => {
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
        let coefficients = |record: &[f32]| (record.len() - HEADER) / table.quantity.components();
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
            kernel: [x.kernel, y.kernel],
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
        let quantity = if format == Format::Complex { NodeQuantity::Amplitude } else { NodeQuantity::Power };
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
            quantity,
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

    /// Standard deviation of what a node's power is spread by, in nodes, along x and y. Amplitudes are squared, so
    /// theirs is narrower than what joins them by √2.
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

    /// Mean of `S(f; κ)` in µm² over the κ that outgoing directions span, `[2π cosθi/λ, 2π(cosθi + 1)/λ]`: what an
    /// error of `S` is small or large against. `f` in cycles/µm, the wavelength in µm.
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
