//! CIELAB and the colour difference CIEDE2000.

use palette::{Lab, Xyz, color_difference::Ciede2000, convert::FromColorUnclamped, white_point::D65};

use super::linear_srgb_to_xyz;

/// CIELAB `[L*, a*, b*]` of a relative XYZ colour, with the D65 white (Y = 1) as the reference white of L* = 100.
pub fn xyz_to_lab(xyz: [f64; 3]) -> [f64; 3] {
    Lab::<D65, f64>::from_color_unclamped(Xyz::<D65, f64>::from(xyz)).into()
}

/// CIELAB `[L*, a*, b*]` of a linear sRGB colour; (1, 1, 1) is the reference white.
pub fn linear_srgb_to_lab(rgb: [f64; 3]) -> [f64; 3] {
    xyz_to_lab(linear_srgb_to_xyz(rgb))
}

/// CIEDE2000 difference ΔE₂₀₀₀ of two CIELAB colours `[L*, a*, b*]`, with the weights kL = kC = kH = 1. A difference of
/// about 1 is just noticeable.
///
/// ```
/// use sunbeam::colour::{ciede2000, linear_srgb_to_lab};
///
/// let [grey, warmer] = [[0.5, 0.5, 0.5], [0.52, 0.5, 0.48]].map(linear_srgb_to_lab);
/// assert!(ciede2000(grey, warmer) > 1.0);
/// ```
///
/// G. Sharma, W. Wu and E. N. Dalal, *The CIEDE2000 Color-Difference Formula: Implementation Notes,
/// Supplementary Test Data, and Mathematical Observations*, Color Research and Application 30(1), 2005.
pub fn ciede2000(first: [f64; 3], second: [f64; 3]) -> f64 {
    Lab::<D65, f64>::from(first).difference(Lab::<D65, f64>::from(second))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn white_and_black_in_lab() {
        // The matrix of linear sRGB has seven digits, the white point of CIELAB five.
        let white = linear_srgb_to_lab([1.0; 3]);
        assert!((white[0] - 100.0).abs() < 1e-3 && white[1].abs() < 1e-2 && white[2].abs() < 1e-2);
        assert_eq!(linear_srgb_to_lab([0.0; 3])[0], 0.0);
        // Lindbloom's value for the sRGB red primary.
        let red = linear_srgb_to_lab([1.0, 0.0, 0.0]);
        for (found, expected) in red.iter().zip([53.2408, 80.0925, 67.2032]) {
            assert!((found - expected).abs() < 0.01, "{red:?}");
        }
    }

    #[test]
    fn ciede2000_matches_the_published_pairs() {
        // Pairs from table 1 of Sharma, Wu and Dalal that exercise every branch of the formula: the hue rotation in
        // blue, the mean of hues across 0°, opposite hues, near-grey pairs and ordinary colours.
        let pairs = [
            ([50.0, 2.6772, -79.7751], [50.0, 0.0, -82.7485], 2.0425),
            ([50.0, 3.1571, -77.2803], [50.0, 0.0, -82.7485], 2.8615),
            ([50.0, 2.8361, -74.0200], [50.0, 0.0, -82.7485], 3.4412),
            ([50.0, -1.3802, -84.2814], [50.0, 0.0, -82.7485], 1.0000),
            ([50.0, 0.0, 0.0], [50.0, -1.0, 2.0], 2.3669),
            ([50.0, 2.4900, -0.0010], [50.0, -2.4900, 0.0009], 7.1792),
            ([50.0, 2.4900, -0.0010], [50.0, -2.4900, 0.0011], 7.2195),
            ([50.0, -0.0010, 2.4900], [50.0, 0.0009, -2.4900], 4.8045),
            ([50.0, -0.0010, 2.4900], [50.0, 0.0011, -2.4900], 4.7461),
            ([50.0, 2.5, 0.0], [73.0, 25.0, -18.0], 27.1492),
            ([50.0, 2.5, 0.0], [58.0, 24.0, 15.0], 19.4535),
            ([60.2574, -34.0099, 36.2677], [60.4626, -34.1751, 39.4387], 1.2644),
            ([22.7233, 20.0904, -46.6940], [23.0331, 14.9730, -42.5619], 2.0373),
            ([2.0776, 0.0795, -1.1350], [0.9033, -0.0636, -0.5514], 0.9082),
        ];
        for (first, second, expected) in pairs {
            let found = ciede2000(first, second);
            // The table prints four decimals.
            assert!((found - expected).abs() < 1e-4, "{first:?} {second:?}: {found}");
            assert!((ciede2000(second, first) - found).abs() < 1e-9);
        }
        assert_eq!(ciede2000([40.0, 1.0, 2.0], [40.0, 1.0, 2.0]), 0.0);
    }
}
