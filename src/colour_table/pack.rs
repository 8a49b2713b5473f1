//! Packing of a colour in 32 bits: three signed mantissas of 9 bits and a shared exponent of 5 bits.
//!
//! ```text
//! word    = (red + 256) | (green + 256) << 9 | (blue + 256) << 18 | exponent << 27
//! channel = mantissa · 2^(exponent + offset − 127)       mantissas −255 … 255; one offset for the whole table
//! ```

/// Offset of stored mantissas, which makes them non-negative.
pub(super) const EXCESS: u32 = 256;
/// Largest mantissa; its range is symmetric.
const MANTISSA_MAX: f32 = EXCESS as f32 - 1.0;
/// Largest stored exponent, of 5 bits.
const EXPONENT_MAX: i32 = 31;
/// Exponent bias of single precision.
const BIAS: i32 = 127;

/// Offset of stored exponents at which the largest of them just represents `largest`, the largest absolute value of a
/// table.
pub(super) fn exponent_offset(largest: f32) -> u32 {
    // Beyond these bounds powers of two, or their products with a mantissa, would be denormal or infinite.
    (exponent(largest.max(f32::MIN_POSITIVE)) + BIAS - EXPONENT_MAX).clamp(1, 200) as u32
}

/// Packs a colour. The error is at most 0.4 % of its largest channel. Values below 2⁻³¹ of the largest in the table
/// become zero.
pub(super) fn pack(colour: [f32; 3], offset: u32) -> u32 {
    let largest = colour.iter().fold(0f32, |a, b| a.max(b.abs()));
    let stored = (exponent(largest.max(f32::MIN_POSITIVE)) + BIAS - offset as i32).clamp(0, EXPONENT_MAX) as u32;
    let scale = power_of_two(stored, offset);
    let mantissa = |value: f32| (value / scale).round().clamp(-MANTISSA_MAX, MANTISSA_MAX) as i32;
    let [r, g, b] = colour.map(|value| (mantissa(value) + EXCESS as i32) as u32);
    r | g << 9 | b << 18 | stored << 27
}

/// Unpacks the colour of a word.
#[cfg(test)]
fn unpack(word: u32, offset: u32) -> [f32; 3] {
    let scale = power_of_two(word >> 27, offset);
    [0, 9, 18].map(|shift| ((word >> shift & 0x1ff) as i32 - EXCESS as i32) as f32 * scale)
}

/// The exponent that gives `value` a mantissa of at most [`MANTISSA_MAX`] and more than half of it.
fn exponent(value: f32) -> i32 {
    (value / MANTISSA_MAX).log2().ceil() as i32
}

/// Scale of the mantissas at a stored exponent.
fn power_of_two(stored: u32, offset: u32) -> f32 {
    f32::from_bits((stored + offset) << 23)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn unpacked_colours_are_within_half_a_mantissa_step() {
        let offset = exponent_offset(3e4);
        for scale in [3e4, 1.0, 1e-3, 7.77e-5] {
            let colour = [0.31 * scale, -0.02 * scale, scale];
            let found = unpack(pack(colour, offset), offset);
            for (found, expected) in found.iter().zip(colour) {
                // The largest mantissa lies in (127, 255].
                assert!((found - expected).abs() <= 0.5 / 127.0 * scale, "{found} {expected}");
            }
        }
        assert_eq!(unpack(pack([0.0; 3], offset), offset), [0.0; 3]);
        // Values too small become zero.
        assert_eq!(unpack(pack([1e-9, 0.0, 0.0], offset), offset), [0.0; 3]);
    }
}
