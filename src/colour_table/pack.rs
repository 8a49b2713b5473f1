//! Packing of a colour table's spline coefficients: the three signed numbers of red, green and blue in a 32-bit word,
//! with mantissas of 9 bits and a shared exponent of 5 bits.
//!
//! Bits from the lowest: red, green, blue, exponent. A number is `m·2^e`. Its mantissa m, from −255 to 255, is stored
//! as `m + 256`. The exponent e is stored as `e + 127 − offset`, from 0 to 31, with one `offset` per table.

/// Number of bits of a mantissa.
pub(super) const MANTISSA_BITS: u32 = 9;
/// Addend to a mantissa that makes it non-negative for storage.
const EXCESS: i32 = 1 << (MANTISSA_BITS - 1);
/// Largest mantissa.
const MANTISSA_MAX: f32 = (EXCESS - 1) as f32;
/// Largest stored exponent.
const STORED_EXPONENT_MAX: i32 = (1 << (u32::BITS - 3 * MANTISSA_BITS)) - 1;
/// Bias of a single-precision exponent, 127.
const BIAS: i32 = f32::MAX_EXP - 1;

/// Exponent offset of a table whose largest absolute value is `table_largest`, a finite number: the offset with which
/// this value gets the largest stored exponent.
pub(super) fn exponent_offset(table_largest: f32) -> u32 {
    // Within these bounds powers of two and their products with a mantissa are normal numbers.
    (exponent(table_largest) + BIAS - STORED_EXPONENT_MAX).clamp(1, 200) as u32
}

/// Packs linear sRGB with the table's exponent `offset`. The error is at most 0.4 % of the largest channel, or of 2⁻³¹
/// times the table's largest value if that is more. Channels below 2⁻³¹/510 of the table's largest value become 0.
pub(super) fn pack(rgb: [f32; 3], offset: u32) -> u32 {
    let largest = rgb.iter().fold(0f32, |a, b| a.max(b.abs()));
    let stored = (exponent(largest) + BIAS - offset as i32).clamp(0, STORED_EXPONENT_MAX) as u32;
    let scale = power_of_two(stored, offset);
    let mantissa = |value: f32| (value / scale).round().clamp(-MANTISSA_MAX, MANTISSA_MAX) as i32 + EXCESS;
    let [r, g, b] = rgb.map(|value| mantissa(value) as u32);
    r | g << MANTISSA_BITS | b << (2 * MANTISSA_BITS) | stored << (3 * MANTISSA_BITS)
}

/// Inverse of [`pack`], up to rounding. Look-ups decode words themselves (`lookup.rs`).
#[cfg(test)]
fn unpack(word: u32, offset: u32) -> [f32; 3] {
    let scale = power_of_two(word >> (3 * MANTISSA_BITS), offset);
    [0, 1, 2].map(|channel| ((word >> (channel * MANTISSA_BITS) & 0x1ff) as i32 - EXCESS) as f32 * scale)
}

/// Exponent e of a non-negative value whose mantissa, `value/2^e`, is more than half of [`MANTISSA_MAX`] and at most
/// [`MANTISSA_MAX`]. Zero is treated as the smallest normal number.
fn exponent(value: f32) -> i32 {
    (value.max(f32::MIN_POSITIVE) / MANTISSA_MAX).log2().ceil() as i32
}

/// `2^e` from a stored exponent: `stored + offset` is the biased exponent of a single-precision number.
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
            let rgb = [0.31 * scale, -0.02 * scale, scale];
            let found = unpack(pack(rgb, offset), offset);
            for (found, expected) in found.iter().zip(rgb) {
                // The mantissa of the largest channel is more than 127.
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
