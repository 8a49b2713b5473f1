//! Packed form of a [`SpectralTable`] in words of 32 bits, which evaluators read, on the CPU and in recorded kernels.
//!
//! - Entry: the words of one node, row by row from node `(−reach, −reach)`; 2 or 4 words (`[start, …]`, [`Format`]).
//! - Packet: the words that one read fetches, of 1 or 4. `start` counts packets from the beginning of the table data.
//! - Coefficients: from the knot −1 on, after all entries. A record of zeros comes first, for the nodes out of reach.
//! - `bf16`: upper 16 bits of a single-precision number.

use super::kernel::InterpolationKernel;
use super::lattice::Lattice;
use super::lookup::{HEADER, NodeQuantity, SpectralTable};
use super::view::TableView;
use crate::numeric::Plain;
use crate::numeric::math::{bf16_pair, u16_pair};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::f64::consts::TAU;

/// Least tolerance at which splines are stored in 16 bits. Chosen: a step is a 65 535th of a record's range, well below
/// such a tolerance.
const FIXED_TOLERANCE: f64 = 1e-4;
/// Largest number of nodes whose splines stay in single precision. Chosen: so few take little memory, and the splines
/// of a grating cancel against their values at κ = 0.
const FIXED_NODES: usize = 4096;
/// Quadrature nodes of a mean over κ. Chosen: the mean is only a scale for errors.
const MEAN_POINTS: usize = 24;

/// Encoding of the nodes' records.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Format {
    /// Powers, coefficients of 16 bits. Entry `[start, low | step]`, with `low` and `step` as bf16; a coefficient is
    /// `low + step·integer`. At κ = 0 only order zero has power, [`PackedLayout::zero`].
    Fixed,
    /// As [`Format::Fixed`], with values at κ = 0 for every node: `[start, low | step, P(0), P'(0)]`.
    FixedFromZero,
    /// Powers in single precision. Entry `[start, P(0), P'(0), 0]`.
    Single,
    /// Amplitudes in single precision, real and imaginary part in turn. Entry `[start, Re D(0), Im D(0), 0]`.
    Complex,
}

impl Format {
    /// Words of a node's entry.
    fn entry(self) -> usize {
        if self == Self::Fixed { 2 } else { 4 }
    }

    /// Words of a packet, and the coefficients in it.
    pub(super) fn packet(self) -> (usize, usize) {
        match self {
            Self::Fixed | Self::FixedFromZero => (1, 2),
            Self::Single => (4, 4),
            Self::Complex => (4, 2),
        }
    }

    /// Packets that hold any four consecutive coefficients.
    fn packets(self) -> usize {
        if self == Self::Single { 2 } else { 3 }
    }
}

/// Sizes and constants of a [`PackedTable`]; pairs are along x and y. The formulas are those of [`SpectralTable`].
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct PackedLayout {
    /// Period of the lattice in µm; the spacing of nodes is its reciprocal.
    pub period_um: [f64; 2],
    /// Interpolation kernels, at distances in nodes.
    pub kernel: [InterpolationKernel; 2],
    /// Standard deviations of the kernels in nodes.
    pub sigma: [f64; 2],
    /// Nodes read by one look-up.
    pub taps: [u32; 2],
    /// Largest node numbers.
    pub reach: [u32; 2],
    /// Largest positions in nodes with data; infinite on a native lattice (lattice.rs).
    pub cutoff: [f64; 2],
    /// Factor `norm` of the table's formula, in µm².
    pub norm: f64,
    /// Largest tabulated κ in rad/µm.
    pub kappa_max: f64,
    /// Distance of the knots in rad/µm.
    pub kappa_step: f64,
    /// κ₀ in rad/µm, the reciprocal of half the range of heights.
    pub kappa_knee: f64,
    /// Power of order zero at κ = 0, for [`Format::Fixed`].
    pub zero: f64,
    /// Encoding of the records.
    pub format: Format,
}

/// Power density `S(f; κ)` of one surface in words of 32 bits; the head of the file has their order.
///
/// ```
/// use sunbeam::{Options, Preset, Surface};
///
/// let options = Options { coherence_length_um: 20.0, conserve_energy: false, ..Options::default() };
/// let surface = Surface::new(&Preset::Blazed.build(None, None)?, &options)?;
/// // In µm², at order −1 of the period 2.5 µm and between orders; κ = 20 rad/µm.
/// let [order, between] = [-0.4, -0.6].map(|f| surface.table().density([f, 0.0], 20.0));
/// assert!(order > 100.0 * between);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
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
                // At κ = 0 a tile that repeats is a mirror: all power is in order zero.
                let native = [&table.lattice.x, &table.lattice.y].iter().all(|axis| axis.cutoff.is_infinite());
                if native { Format::Fixed } else { Format::FixedFromZero }
            }
        };
        let (reach_x, reach_y) = (table.lattice.x.reach as i64, table.lattice.y.reach as i64);
        let centre = nodes.iter().find(|(jx, jy, _)| (*jx, *jy) == (0, 0));
        let zero = centre.map_or(0.0, |(_, _, record)| f64::from(record[0]));
        let (packet, _) = format.packet();
        // The record of zeros is as long as the longest record.
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
        // A look-up reads whole packets, some beyond the record with weights of zero. The last record needs room for
        // them.
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

    /// Lattice of the nodes.
    pub fn lattice(&self) -> &Lattice {
        &self.lattice
    }

    /// The table in single precision, up to the rounding of its format.
    pub fn unpacked(&self) -> SpectralTable {
        let (format, layout) = (self.layout.format, &self.layout);
        let (packet, _) = format.packet();
        let quantity = if format == Format::Complex { NodeQuantity::Amplitude } else { NodeQuantity::Power };
        let nodes = self.lattice.x.nodes() * self.lattice.y.nodes();
        let entries: Vec<&[u32]> = self.words[..format.entry() * nodes].chunks_exact(format.entry()).collect();
        let zero_record = (format.entry() * nodes).next_multiple_of(4) / packet;
        let kept: Vec<usize> = (0..nodes).filter(|&node| entries[node][0] as usize != zero_record).collect();
        let end = self.words.len() / packet - format.packets();
        let starts = kept.iter().map(|&node| entries[node][0] as usize).chain([end]);
        let starts: Vec<usize> = starts.collect();
        // Offset 0 marks a node without a record.
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

    /// Sizes and constants of the table.
    pub fn layout(&self) -> &PackedLayout {
        &self.layout
    }

    /// Standard deviation in nodes of the power of one node, as [`SpectralTable::power_sigma`].
    pub fn power_sigma(&self) -> [f64; 2] {
        let narrower = if self.layout.format == Format::Complex { 0.5f64.sqrt() } else { 1.0 };
        self.layout.sigma.map(|sigma| sigma * narrower)
    }

    /// Table data: words of 32 bits.
    pub fn words(&self) -> &[u32] {
        &self.words
    }

    /// Size in bytes.
    pub fn bytes(&self) -> usize {
        size_of_val(self.words.as_slice())
    }

    /// View of the table for evaluation in double precision.
    pub fn view(&self) -> TableView<Plain<'_, f64>> {
        TableView { layout: self.layout, words: &self.words }
    }

    /// `S(f; κ)` in µm² at a frequency in cycles/µm and κ in rad/µm.
    pub fn density(&self, f: [f64; 2], kappa: f64) -> f64 {
        self.view().density(f, kappa, true)
    }

    /// Mean of `S(f; κ)` in µm² over the κ of all outgoing directions, `[2π cosθi/λ, 2π(cosθi + 1)/λ]`: the scale that
    /// errors of `S` are compared with. `f` in cycles/µm, `cos_i` the cosine of the incidence, the wavelength in µm.
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
    /// A record's coefficients as words, and the word `low | step`, which is 0 in single precision.
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

/// Largest bf16 number that is at most `x`.
fn bf16_at_most(x: f32) -> f32 {
    let cut = f32::from_bits(x.to_bits() & 0xffff_0000);
    // Cutting bits off brings a number nearer to zero, so a negative number takes the next lower one.
    if cut > x { f32::from_bits((x.to_bits() & 0xffff_0000) + 0x1_0000) } else { cut }
}
