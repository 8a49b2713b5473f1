//! The CIE 1931 2° colour matching functions and the illuminant D65, interpolated linearly between whole nm.

use super::cie::{D65, OBSERVER_1931, RANGE_NM};

/// First and last wavelength of the tables in nm, 380 and 780. Beyond them the matching functions are taken as 0 and
/// D65 as constant.
pub const OBSERVER_RANGE_NM: (f64, f64) = (RANGE_NM.0 as f64, RANGE_NM.1 as f64);

/// Index of the table entry at or below a wavelength and the fraction in [0, 1] towards the next entry. The last entry
/// is the fraction 1 after the last but one. Both tables have an entry for each nm. Wavelengths outside are clamped.
fn locate(wavelength_nm: f64) -> (usize, f64) {
    let position = (wavelength_nm - OBSERVER_RANGE_NM.0).clamp(0.0, (D65.len() - 1) as f64);
    let index = (position as usize).min(D65.len() - 2);
    (index, position - index as f64)
}

/// The CIE 1931 2° colour matching functions `[x̄, ȳ, z̄]` at a wavelength in nm.
///
/// Exactly `[0, 0, 0]` outside [`OBSERVER_RANGE_NM`] and for NaN. The range leaves out less than 2e-5 of the luminance
/// of white.
pub fn cie_xyz(wavelength_nm: f64) -> [f64; 3] {
    if !(OBSERVER_RANGE_NM.0..=OBSERVER_RANGE_NM.1).contains(&wavelength_nm) {
        return [0.0; 3];
    }
    let (index, fraction) = locate(wavelength_nm);
    let (below, above) = (OBSERVER_1931[index], OBSERVER_1931[index + 1]);
    std::array::from_fn(|c| below[c] + fraction * (above[c] - below[c]))
}

/// Relative spectral power of the CIE standard illuminant D65 at a wavelength in nm, 100 at 560 nm.
///
/// Constant outside [`OBSERVER_RANGE_NM`], where the observer's response is 0. (The published curve falls by 7 % from
/// 380 to 360 nm.)
pub fn d65(wavelength_nm: f64) -> f64 {
    let (index, fraction) = locate(wavelength_nm);
    let (below, above) = (D65[index], D65[index + 1]);
    below + fraction * (above - below)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// CIE 15 prints the matching functions with six decimals.
    const TABLE_TOLERANCE: f64 = 1e-6;

    #[test]
    fn observer_has_the_published_values() {
        // CIE 15, colour matching functions of the 2° observer.
        for (nm, expected) in [
            (380.0, [0.001368, 0.000039, 0.006450]),
            (450.0, [0.33620, 0.03800, 1.77211]),
            (555.0, [0.512050, 1.0, 0.005750]),
            (600.0, [1.0622, 0.6310, 0.0008]),
        ] {
            let found = cie_xyz(nm);
            for c in 0..3 {
                assert!((found[c] - expected[c]).abs() < TABLE_TOLERANCE, "{nm} nm: {found:?}");
            }
        }
    }

    #[test]
    fn observer_integrals_are_equal() {
        // Published for equal-energy white: ∫x̄ = ∫ȳ = ∫z̄ = 106.86 nm over 360 to 830 nm. The tables have less, since
        // they leave out the ends.
        let mut sum = [0.0; 3];
        for nm in 360..=830 {
            for (total, value) in sum.iter_mut().zip(cie_xyz(f64::from(nm))) {
                *total += value;
            }
        }
        for total in sum {
            assert!((total - 106.86).abs() < 0.05, "{sum:?}");
        }
    }

    #[test]
    fn d65_has_the_published_values_and_white() {
        // CIE 15, relative spectral power of D65.
        for (nm, expected) in [(380.0, 49.9755), (400.0, 82.7549), (560.0, 100.0), (700.0, 71.6091)] {
            assert!((d65(nm) - expected).abs() < 1e-3, "{nm} nm: {}", d65(nm));
        }
        let mut white = [0.0; 3];
        for nm in 360..=830 {
            let nm = f64::from(nm);
            for (total, value) in white.iter_mut().zip(cie_xyz(nm)) {
                *total += value * d65(nm);
            }
        }
        let sum: f64 = white.iter().sum();
        // The published chromaticity has four digits.
        assert!((white[0] / sum - 0.3127).abs() < 1e-4, "{}", white[0] / sum);
        assert!((white[1] / sum - 0.3290).abs() < 1e-4, "{}", white[1] / sum);
    }

    #[test]
    fn values_outside_the_table_are_zero_or_constant() {
        for nm in [f64::NEG_INFINITY, 0.0, 360.0, 379.999, 780.001, 830.0, f64::INFINITY, f64::NAN] {
            assert_eq!(cie_xyz(nm), [0.0; 3]);
        }
        assert_eq!(d65(360.0), d65(380.0));
        assert_eq!(d65(830.0), d65(780.0));
        assert!((d65(380.5) - 0.5 * (d65(380.0) + d65(381.0))).abs() < 1e-12);
    }
}
