//! A [`SpectralTable`] packed in 32-bit words, the form that evaluators read.
//!
//! The table is the power spectrum S over the frequency f and the phase rate κ ([module](super)). A *record* is the
//! power or amplitude of one node of the frequency lattice over κ: a header and spline coefficients. A node's *entry*
//! has the start of the coefficients, counted in *packets*, the words that a look-up reads at once. Depending on the
//! format, the entry also has the header, and a scale of the coefficients (`format.rs`). The order of the words:
//!
//! 1. An entry for every node of the lattice, row by row from node `(−reach, −reach)`.
//! 2. The coefficients of a record of zeros, which stands for all nodes without a record.
//! 3. The coefficients of each node with a record, in the order of the nodes.
//! 4. Zeros, since a look-up may read packets beyond the last record.

use super::format::Format;
use super::kernel::InterpolationKernel;
use super::knots::FEW_NODES;
use super::lattice::Lattice;
use super::spectral::{NodeQuantity, SpectralTable};
use super::view::TableView;
use crate::numeric::Plain;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::f64::consts::{FRAC_1_SQRT_2, TAU};

/// Smallest tolerance of tables whose spline coefficients are stored in 16 bits. A step of the integers, 1/65 535 of
/// the range of a record's coefficients, is then well below the tolerance. Smaller values save memory in more tables,
/// at the cost of rounding errors.
const FIXED_TOLERANCE: f64 = 1e-4;

/// Number of midpoints of a mean over κ. The mean is the scale of relative errors, so a few per cent of error in it do
/// not matter. More midpoints take longer.
const MEAN_POINTS: usize = 24;

/// Layout of a [`PackedTable`]; see [`SpectralTable`] for the formulas. Pairs are along x and y.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct PackedLayout {
    /// Periods in µm; their reciprocals are the spacings of nodes.
    pub period_um: [f64; 2],
    /// Interpolation kernels.
    pub kernel: [InterpolationKernel; 2],
    /// Standard deviations of the kernels in nodes.
    pub sigma: [f64; 2],
    /// Numbers of nodes that a look-up reads.
    pub taps: [u32; 2],
    /// Largest node numbers.
    pub reach: [u32; 2],
    /// Largest positions in nodes that the pixels resolve; infinite on a native lattice.
    pub cutoff: [f64; 2],
    /// Factor `norm` of `S` in µm².
    pub norm: f64,
    /// Largest κ in rad/µm.
    pub kappa_max: f64,
    /// Distance between the spline's knots in κ, in rad/µm.
    pub kappa_step: f64,
    /// κ₀ of [`SpectralTable`]'s formulas in rad/µm: the reciprocal of half the range of heights.
    pub kappa_knee: f64,
    /// Power P(0) of node (0, 0), order zero, at κ = 0. [`Format::Fixed`] reads it here, since its entries leave it
    /// out.
    pub zero: f64,
    /// Format of entries and coefficients.
    pub format: Format,
}

/// Power density `S(f; κ)` of one surface in 32-bit words: entries of all nodes, then coefficients ([`Format`]).
///
/// ```
/// use sunbeam::{Options, Preset, Surface};
///
/// let field = Preset::Sinusoidal.build(Some(2.0), Some(0.2))?;
/// let surface = Surface::new(&field, &Options { conserve_energy: false, ..Options::default() })?;
/// let table = surface.table();
///
/// // Orders of a period of 2 µm lie at multiples of 0.5 cycles/µm, with nothing between them.
/// let kappa = 15.0;
/// assert!(table.density([0.5, 0.0], kappa) > 1e6 * table.density([0.25, 0.0], kappa));
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
        let (x, y) = (&table.lattice.x, &table.lattice.y);
        let nodes = table.kept_nodes();
        let format = format_of(table, nodes.len(), tolerance);
        let (entry_words, packet_words) = (format.entry_words(), format.packet_words());
        let entries_end = entry_words * table.offsets.len();
        // The record of zeros, for nodes without a record, is as long as the longest record. It starts and ends at a
        // multiple of four words, the size of the largest packet.
        let zeros_start = entries_end.next_multiple_of(4);
        let longest = nodes.iter().map(|(_, _, record)| format.record_words(record)).max().unwrap_or(0);
        // Start of each node's coefficients, in words.
        let mut starts = Vec::with_capacity(nodes.len());
        let mut end = zeros_start + longest.next_multiple_of(4);
        for (_, _, record) in &nodes {
            starts.push(end);
            end += format.record_words(record);
        }
        // A look-up near the end of a record also reads packets beyond it, with weights of zero. After the last record
        // such packets have to exist.
        let mut words = vec![0u32; end + format.packets_read() * packet_words];
        for entry in words[..entries_end].chunks_exact_mut(entry_words) {
            entry[0] = (zeros_start / packet_words) as u32;
        }
        let packed: Vec<(Vec<u32>, u32)> = nodes.par_iter().map(|(_, _, record)| format.pack(record)).collect();
        for (((jx, jy, record), start), (coefficients, scale)) in nodes.iter().zip(&starts).zip(&packed) {
            words[*start..start + coefficients.len()].copy_from_slice(coefficients);
            // Row-major index from node (−reach, −reach).
            let node = (jy + y.reach as i64) as usize * x.nodes() + (jx + x.reach as i64) as usize;
            let entry = &mut words[entry_words * node..][..entry_words];
            // P(0) and P'(0), or the real and imaginary part of D(0).
            let header = [record[0].to_bits(), record[1].to_bits()];
            entry[0] = (*start / packet_words) as u32;
            match format {
                Format::Fixed => entry[1] = *scale,
                Format::FixedFromZero => entry[1..].copy_from_slice(&[*scale, header[0], header[1]]),
                Format::Single | Format::Complex => entry[1..3].copy_from_slice(&header),
            }
        }
        let order_zero = nodes.iter().find(|(jx, jy, _)| (*jx, *jy) == (0, 0));
        let zero = order_zero.map_or(0.0, |(_, _, record)| f64::from(record[0]));
        Self { lattice: table.lattice.clone(), layout: layout_of(table, format, zero), words }
    }

    /// Lattice of the nodes.
    pub fn lattice(&self) -> &Lattice {
        &self.lattice
    }

    /// The [`SpectralTable`] that was packed, up to rounding.
    pub fn unpacked(&self) -> SpectralTable {
        let (format, layout) = (self.layout.format, &self.layout);
        let (entry_words, packet_words) = (format.entry_words(), format.packet_words());
        let nodes = self.lattice.nodes();
        let entries: Vec<&[u32]> = self.words[..entry_words * nodes].chunks_exact(entry_words).collect();
        // Starts of coefficients in packets, as in the entries. A record ends where the next begins.
        let zeros_start = (entry_words * nodes).next_multiple_of(4) / packet_words;
        let kept: Vec<usize> = (0..nodes).filter(|&node| entries[node][0] as usize != zeros_start).collect();
        let end = self.words.len() / packet_words - format.packets_read();
        let starts: Vec<usize> = kept.iter().map(|&node| entries[node][0] as usize).chain([end]).collect();
        // Offset 0 stands for no record, so float 0 is unused.
        let mut records = vec![0f32; 1];
        let mut offsets = vec![0; nodes];
        // Both axes are symmetric about order zero, so it is the middle node.
        let order_zero = nodes / 2;
        for (&node, pair) in kept.iter().zip(starts.windows(2)) {
            let power_at_zero = if node == order_zero { layout.zero } else { 0.0 };
            let words = &self.words[packet_words * pair[0]..packet_words * pair[1]];
            offsets[node] = records.len() as u32;
            records.extend(format.unpack(entries[node], words, power_at_zero));
        }
        SpectralTable {
            lattice: self.lattice.clone(),
            quantity: format.quantity(),
            norm: layout.norm,
            kappa_max: layout.kappa_max,
            kappa_step: layout.kappa_step,
            kappa_knee: layout.kappa_knee,
            offsets,
            records,
        }
    }

    /// Layout of the words.
    pub fn layout(&self) -> &PackedLayout {
        &self.layout
    }

    /// Standard deviations in nodes, along x and y, of the peak about a node that interpolation makes of its power:
    /// those of the kernel. Amplitudes are squared after interpolation, so their peaks are narrower by √2.
    pub fn power_sigma(&self) -> [f64; 2] {
        let factor = if self.layout.format == Format::Complex { FRAC_1_SQRT_2 } else { 1.0 };
        self.layout.sigma.map(|sigma| sigma * factor)
    }

    /// All words: entries of all nodes, then coefficients ([`Format`]).
    pub fn words(&self) -> &[u32] {
        &self.words
    }

    /// Size of the words in bytes.
    pub fn bytes(&self) -> usize {
        size_of_val(self.words.as_slice())
    }

    /// Evaluator in double precision.
    pub fn view(&self) -> TableView<Plain<'_, f64>> {
        TableView { layout: self.layout, words: &self.words }
    }

    /// `S(f; κ)` in µm² at a frequency in cycles/µm and κ in rad/µm.
    pub fn density(&self, f: [f64; 2], kappa: f64) -> f64 {
        // The mask `true` asks for the value; where a SIMD lane's mask is false, the result is meaningless.
        self.view().density(f, kappa, true)
    }

    /// Mean of `S(f; κ)` in µm² over the κ of all outgoing directions, `[2π cosθi/λ, 2π(cosθi + 1)/λ]`: a scale for
    /// errors of `S`. `f` is in cycles/µm, the wavelength in µm.
    pub fn hemisphere_mean(&self, f: [f64; 2], cos_i: f64, wavelength_um: f64) -> f64 {
        let wavenumber = TAU / wavelength_um;
        self.mean(f, [wavenumber * cos_i, wavenumber * (cos_i + 1.0)])
    }

    /// Mean of `S(f; κ)` in µm² over a range of κ in rad/µm.
    pub(super) fn mean(&self, f: [f64; 2], [low, high]: [f64; 2]) -> f64 {
        let at = |i: usize| low + (high - low) * (i as f64 + 0.5) / MEAN_POINTS as f64;
        (0..MEAN_POINTS).map(|i| self.density(f, at(i))).sum::<f64>() / MEAN_POINTS as f64
    }
}

/// Format in which a table of a relative error of `tolerance` is packed, with records for `nodes` nodes.
fn format_of(table: &SpectralTable, nodes: usize, tolerance: f64) -> Format {
    match table.quantity {
        NodeQuantity::Amplitude => Format::Complex,
        // Small tables gain little from 16 bits. In a grating's powers the spline may also nearly cancel the terms of
        // the header, and 16 bits would not resolve the difference.
        NodeQuantity::Power if tolerance < FIXED_TOLERANCE || nodes <= FEW_NODES => Format::Single,
        // At κ = 0 all light of a tile that repeats is in order zero, so the other entries need no P(0).
        NodeQuantity::Power if table.lattice.is_native() => Format::Fixed,
        NodeQuantity::Power => Format::FixedFromZero,
    }
}

/// Layout of a packed table; `zero` is [`PackedLayout::zero`].
fn layout_of(table: &SpectralTable, format: Format, zero: f64) -> PackedLayout {
    let (x, y) = (&table.lattice.x, &table.lattice.y);
    PackedLayout {
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
    }
}
