//! Packing of a colour in 32 bits: three signed mantissas of 9 bits, offset by 256, and a shared exponent of 5 bits.

/// Offset of stored mantissas, which makes them non-negative.
pub(super) const EXCESS: u32 = 256;
/// Largest mantissa; the sign takes the ninth bit.
const MANTISSA_MAX: f32 = 255.0;
/// Largest stored exponent.
const EXPONENT_MAX: i32 = 31;

/// Offset of stored exponents with which the largest one represents `largest`, the largest absolute value of the table.
pub(super) fn exponent_offset(largest: f32) -> u32 {
    // Beyond these bounds powers of two, or their products with a mantissa, would be denormal or infinite.
    (exponent(largest.max(f32::MIN_POSITIVE)) + 127 - EXPONENT_MAX).clamp(1, 200) as u32
}

/// Packs a colour: red in the lowest 9 bits, then green and blue, then the exponent. Off by at most
/// 0.4 % of the largest channel; values below 2⁻³¹ of the largest in the table are lost.
pub(super) fn pack(colour: [f32; 3], offset: u32) -> u32 {
    let largest = colour.iter().fold(0f32, |a, b| a.max(b.abs()));
    let stored = (exponent(largest.max(f32::MIN_POSITIVE)) + 127 - offset as i32).clamp(0, EXPONENT_MAX) as u32;
    let scale = power_of_two(stored, offset);
    let word = |value: f32| (value / scale).round().clamp(-MANTISSA_MAX, MANTISSA_MAX) as i32 + EXCESS as i32;
    let [r, g, b] = colour.map(|value| word(value) as u32);
    r | g << 9 | b << 18 | stored << 27
}

/// The colour of a word.
#[cfg(test)]
fn unpack(word: u32, offset: u32) -> [f32; 3] {
    let scale = power_of_two(word >> 27, offset);
    [0, 9, 18].map(|shift| ((word >> shift & 0x1ff) as i32 - EXCESS as i32) as f32 * scale)
}

/// The exponent that gives `value` a mantissa of at most [`MANTISSA_MAX`] and more than half of it.
fn exponent(value: f32) -> i32 {
    (value / MANTISSA_MAX).log2().ceil() as i32
}

fn power_of_two(stored: u32, offset: u32) -> f32 {
    f32::from_bits((stored + offset) << 23)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn colours_survive_to_half_a_mantissa_step() {
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
