//! sRGB: Rec. 709 primaries and the D65 white (IEC 61966-2-1), linear and encoded.

use palette::{
    LinSrgb, Xyz,
    convert::FromColorUnclamped,
    encoding::{FromLinear, IntoLinear, Srgb},
    white_point::D65,
};

/// Linear sRGB of a relative XYZ colour (D65 white: Y = 1), not clamped: colours outside the gamut have negative
/// components. The matrix has seven digits.
pub fn xyz_to_linear_srgb(xyz: [f64; 3]) -> [f64; 3] {
    LinSrgb::from_color_unclamped(Xyz::<D65, f64>::from(xyz)).into()
}

/// Relative XYZ (D65 white: Y = 1) of a linear sRGB colour. Inverse of [`xyz_to_linear_srgb`] to 1e-6 of the largest
/// component.
pub fn linear_srgb_to_xyz(rgb: [f64; 3]) -> [f64; 3] {
    Xyz::<D65, f64>::from_color_unclamped(LinSrgb::from(rgb)).into()
}

/// The sRGB transfer function of each channel: linear in, encoded out. Inputs are clamped to [0, 1]; NaN becomes 0.
///
/// ```
/// use sunbeam::colour::{srgb_decode, srgb_encode};
///
/// let linear = [0.2, 0.5, 0.9];
/// let back = srgb_decode(srgb_encode(linear));
/// assert!(linear.iter().zip(back).all(|(a, b)| (a - b).abs() < 1e-6));
/// ```
pub fn srgb_encode(linear: [f64; 3]) -> [f64; 3] {
    linear.map(|value| Srgb::from_linear(unit(value)))
}

/// [`srgb_encode`] as bytes, within 0.6 of `255·srgb_encode`: the crate `palette` interpolates in a table of the
/// encoding.
pub fn srgb_bytes(linear: [f64; 3]) -> [u8; 3] {
    // The type of the result, a byte, selects the table.
    linear.map(|value| Srgb::from_linear(unit(value)))
}

/// The inverse of [`srgb_encode`]: encoded in, linear out. Inputs are clamped to [0, 1]; NaN becomes 0.
pub fn srgb_decode(encoded: [f64; 3]) -> [f64; 3] {
    encoded.map(|value| Srgb::into_linear(unit(value)))
}

/// Clamps to [0, 1]; NaN becomes 0.
fn unit(value: f64) -> f64 {
    if value.is_nan() { 0.0 } else { value.clamp(0.0, 1.0) }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rounding of the matrices, which have seven digits and entries of up to 3.2, over the largest component.
    const MATRIX_TOLERANCE: f64 = 1e-6;

    #[test]
    fn primary_and_white_are_those_of_the_standard() {
        // IEC 61966-2-1 prints XYZ of the red primary and of white with four digits.
        let red = linear_srgb_to_xyz([1.0, 0.0, 0.0]);
        let white = linear_srgb_to_xyz([1.0; 3]);
        for (found, expected) in red.iter().zip([0.4124, 0.2126, 0.0193]) {
            assert!((found - expected).abs() < 1e-4);
        }
        for (found, expected) in white.iter().zip([0.9505, 1.0, 1.089]) {
            assert!((found - expected).abs() < 2e-4);
        }
    }

    #[test]
    fn colours_round_trip_through_xyz_even_out_of_gamut() {
        for rgb in [[0.2, 0.5, 0.9], [-0.3, 1.7, 0.0], [4.0, -1.0, 12.0]] {
            let back = xyz_to_linear_srgb(linear_srgb_to_xyz(rgb));
            // The largest component is 12.
            for c in 0..3 {
                assert!((back[c] - rgb[c]).abs() < 12.0 * MATRIX_TOLERANCE, "{rgb:?} {back:?}");
            }
        }
    }

    #[test]
    fn encoding_has_the_published_values() {
        let encoded = srgb_encode([0.0, 0.0031308, 0.5]);
        assert_eq!(encoded[0], 0.0);
        assert!((encoded[1] - 0.04045).abs() < 1e-5);
        assert!((encoded[2] - 0.735357).abs() < 1e-5);
        let extremes = srgb_encode([-1.0, 7.0, f64::NAN]);
        assert!(extremes[0] == 0.0 && (extremes[1] - 1.0).abs() < 1e-12 && extremes[2] == 0.0);
        let back = srgb_decode(encoded);
        assert!((back[2] - 0.5).abs() < 1e-6);
    }

    #[test]
    fn bytes_are_within_0_6_of_the_encoding() {
        for i in 0..=100_000 {
            let linear = [f64::from(i) / 1e5; 3];
            let (byte, exact) = (f64::from(srgb_bytes(linear)[0]), 255.0 * srgb_encode(linear)[0]);
            assert!((byte - exact).abs() < 0.6, "{byte} for {exact}");
        }
        assert_eq!(srgb_bytes([-1.0, 7.0, f64::NAN]), [0, 255, 0]);
    }
}
