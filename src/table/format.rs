//! Formats of a packed table: the words of a node's entry, and of its spline's coefficients.
//!
//! A node's power P or amplitude D over the phase rate κ is stored as a *record*: a header of two floats, and the
//! coefficients of a cubic B-spline ([`super::SpectralTable`] has the formulas). The header of a power is P(0) and
//! P'(0) = dP/dκ at κ = 0, that of an amplitude the real and imaginary part of D(0).
//!
//! Words have 32 bits. Each node has an *entry* of two or four words. Coefficients are read in *packets* of one or four
//! words. The first word of an entry is the `start` of the node's coefficients, counted in packets from the table's
//! first word.
//!
//! The fixed-point formats store a coefficient as a 16-bit integer `i` with the value `low + step·i`, two in a word,
//! the first in the lower half. `low` and `step` are bfloat16 numbers in the lower and upper half of the entry's second
//! word, the *scale*.

use super::spectral::{HEADER, NodeQuantity};
use crate::numeric::Plain;
use crate::numeric::math::{bf16_pair, u16_pair};
use serde::{Deserialize, Serialize};

/// Largest integer of a fixed-point coefficient.
const INTEGER_MAX: f32 = u16::MAX as f32;

/// Format of a node's entry and coefficients.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Format {
    /// Powers with 16 bits per coefficient; entry `[start, scale]`. `P(0)` is zero except for order zero, whose power
    /// is in the table's layout, and `P'(0)` is zero.
    Fixed,
    /// Powers with 16 bits per coefficient, of nodes that have power at κ = 0; entry `[start, scale, P(0), P'(0)]`.
    FixedFromZero,
    /// Powers in single precision; entry `[start, P(0), P'(0), 0]`.
    Single,
    /// Amplitudes in single precision, real and imaginary part in turn; entry `[start, Re D(0), Im D(0), 0]`.
    Complex,
}

impl Format {
    /// Quantity of the nodes.
    pub(super) fn quantity(self) -> NodeQuantity {
        if self == Self::Complex { NodeQuantity::Amplitude } else { NodeQuantity::Power }
    }

    /// Number of words of a node's entry.
    pub(super) fn entry_words(self) -> usize {
        if self == Self::Fixed { 2 } else { 4 }
    }

    /// Number of words of a packet of coefficients.
    pub(super) fn packet_words(self) -> usize {
        match self {
            Self::Fixed | Self::FixedFromZero => 1,
            Self::Single | Self::Complex => 4,
        }
    }

    /// Number of coefficients in a packet.
    pub(super) fn packet_coefficients(self) -> usize {
        match self {
            Self::Fixed | Self::FixedFromZero | Self::Complex => 2,
            Self::Single => 4,
        }
    }

    /// Number of packets that a look-up reads of a node: enough for four consecutive coefficients at any position.
    pub(super) fn packets_read(self) -> usize {
        if self == Self::Single { 2 } else { 3 }
    }

    /// Number of words of a record's coefficients.
    pub(super) fn record_words(self, record: &[f32]) -> usize {
        let coefficients = (record.len() - HEADER) / self.quantity().components();
        coefficients.div_ceil(self.packet_coefficients()) * self.packet_words()
    }

    /// Words of a record's coefficients, at least one, not padded to whole packets; and the scale of the fixed-point
    /// formats (0 in the others).
    pub(super) fn pack(self, record: &[f32]) -> (Vec<u32>, u32) {
        let coefficients = &record[HEADER..];
        if matches!(self, Self::Single | Self::Complex) {
            return (coefficients.iter().map(|c| c.to_bits()).collect(), 0);
        }
        let (smallest, largest) =
            coefficients.iter().fold((f32::INFINITY, f32::NEG_INFINITY), |(a, b), &c| (a.min(c), b.max(c)));
        let low = bf16_at_most(smallest);
        // Rounded up, by rounding the opposite number down, so that the largest integer reaches the largest
        // coefficient.
        let step = -bf16_at_most(-(largest - low) / INTEGER_MAX);
        let integer = |c: f32| {
            let steps = if step > 0.0 { ((c - low) / step).round() } else { 0.0 };
            steps.clamp(0.0, INTEGER_MAX) as u32
        };
        let words = coefficients.chunks(2).map(|pair| {
            let upper = pair.get(1).map_or(0, |&c| integer(c));
            integer(pair[0]) | (upper << 16)
        });
        (words.collect(), (low.to_bits() >> 16) | (step.to_bits() & 0xffff_0000))
    }

    /// Record ([`super::SpectralTable`]) from a node's entry and the words of its coefficients, up to rounding. Words
    /// that pad the last packet become coefficients, too. `power_at_zero` is the node's P(0), which only the format
    /// [`Self::Fixed`] needs: its entries leave it out.
    pub(super) fn unpack(self, entry: &[u32], words: &[u32], power_at_zero: f64) -> Vec<f32> {
        let header = match self {
            Self::Fixed => [power_at_zero as f32, 0.0],
            Self::FixedFromZero => [f32::from_bits(entry[2]), f32::from_bits(entry[3])],
            Self::Single | Self::Complex => [f32::from_bits(entry[1]), f32::from_bits(entry[2])],
        };
        let mut record = header.to_vec();
        match self {
            Self::Fixed | Self::FixedFromZero => {
                let [low, step] = bf16_pair::<Plain<f32>>(entry[1]);
                record.extend(words.iter().flat_map(|&word| u16_pair::<Plain<f32>>(word)).map(|i| low + step * i));
            }
            Self::Single | Self::Complex => record.extend(words.iter().map(|&word| f32::from_bits(word))),
        }
        record
    }
}

/// Largest bfloat16 number (the upper 16 bits of a single-precision number) that is at most `x`.
fn bf16_at_most(x: f32) -> f32 {
    let cut = f32::from_bits(x.to_bits() & 0xffff_0000);
    // Dropping bits moves a number towards zero, so a negative number may need the next bfloat16 away from zero, whose
    // upper half is larger by one.
    if cut > x { f32::from_bits(cut.to_bits() + 0x1_0000) } else { cut }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fixed_point_coefficients_are_within_half_a_step() {
        let header = [0.25, -0.5];
        let record: Vec<f32> = header.into_iter().chain((0..40).map(|i| (i as f32 * 0.7).sin() * 1e-3)).collect();
        let format = Format::FixedFromZero;
        let (words, scale) = format.pack(&record);
        let entry = [0, scale, record[0].to_bits(), record[1].to_bits()];
        let [_, step] = bf16_pair::<Plain<f32>>(scale);
        // Rounding to the 8 significant bits of bfloat16 changes a number by up to 2⁻⁷: first `low`, then the step.
        assert!(step < 1.02 * 2e-3 / INTEGER_MAX * 1.02);
        for (found, expected) in format.unpack(&entry, &words, 0.0).iter().zip(&record) {
            assert!((found - expected).abs() <= 0.51 * step, "{found} {expected}");
        }
    }

    #[test]
    fn bfloat16_rounds_down() {
        for x in [1.0f32, 1.003, -1.003, 3e-20, 0.0] {
            let found = bf16_at_most(x);
            assert!(found <= x && x - found <= x.abs() / 128.0, "{x} {found}");
        }
    }
}
