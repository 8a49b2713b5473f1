//! Three signed numbers in a 32-bit word: mantissas of 9 bits and a shared exponent of 5 bits.
//!
//! Bits from the lowest: red, green, blue, exponent. A mantissa m in −255 to 255 is stored as `m + 256`. The number is
//! `m·2^(stored + offset − 127)`, with one `offset` per table.

/// Bits of a mantissa.
pub(super) const MANTISSA_BITS: u32 = 9;
/// Number that is added to a mantissa, so that it is stored without a sign.
const EXCESS: i32 = 1 << (MANTISSA_BITS - 1);
/// Largest mantissa.
const MANTISSA_MAX: f32 = (EXCESS - 1) as f32;
/// Largest stored exponent.
const EXPONENT_MAX: i32 = (1 << (u32::BITS - 3 * MANTISSA_BITS)) - 1;
/// Bias of a single-precision exponent.
const BIAS: i32 = f32::MAX_EXP - 1;

/// Exponent offset of a table whose largest absolute value is `largest`: the largest stored exponent just serves it.
pub(super) fn exponent_offset(largest: f32) -> u32 {
    // Within these bounds powers of two and their products with a mantissa are normal numbers.
    (exponent(largest.max(f32::MIN_POSITIVE)) + BIAS - EXPONENT_MAX).clamp(1, 200) as u32
}

/// Packs a colour. The error is at most 0.4 % of the largest channel; values below 2⁻³¹ of the table's largest become
/// 0.
pub(super) fn pack(colour: [f32; 3], offset: u32) -> u32 {
    let largest = colour.iter().fold(0f32, |a, b| a.max(b.abs()));
    let stored = (exponent(largest.max(f32::MIN_POSITIVE)) + BIAS - offset as i32).clamp(0, EXPONENT_MAX) as u32;
    let scale = power_of_two(stored, offset);
    let mantissa = |value: f32| (value / scale).round().clamp(-MANTISSA_MAX, MANTISSA_MAX) as i32 + EXCESS;
    let [r, g, b] = colour.map(|value| mantissa(value) as u32);
    r | g << MANTISSA_BITS | b << (2 * MANTISSA_BITS) | stored << (3 * MANTISSA_BITS)
}

/// Colour of a word.
#[cfg(test)]
fn unpack(word: u32, offset: u32) -> [f32; 3] {
    let scale = power_of_two(word >> 27, offset);
    [0, 9, 18].map(|shift| ((word >> shift & 0x1ff) as i32 - EXCESS) as f32 * scale)
}

/// Exponent with which the mantissa of `value` is at most [`MANTISSA_MAX`] and more than half of it.
fn exponent(value: f32) -> i32 {
    (value / MANTISSA_MAX).log2().ceil() as i32
}

fn power_of_two(stored: u32, offset: u32) -> f32 {
    f32::from_bits((stored + offset) << (f32::MANTISSA_DIGITS - 1))
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
                // The largest mantissa is more than 127.
                assert!((found - expected).abs() <= 0.5 / 127.0 * scale, "{found} {expected}");
            }
        }
    }

    #[test]
    fn values_too_small_to_store_become_zero() {
        let offset = exponent_offset(3e4);
        for value in [0.0, 1e-9] {
            assert_eq!(unpack(pack([value, 0.0, 0.0], offset), offset), [0.0; 3]);
        }
    }
}
