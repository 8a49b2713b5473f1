//! The exponential integral E₁ of a positive real number.

use super::EULER_GAMMA;

/// `E₁(x) = ∫ₓ^∞ e^{−t}/t dt` for x > 0, to 4e-15 relative.
///
/// Computed by the power series (Abramowitz & Stegun 5.1.11) for x ≤ 1, and by the even part of the continued fraction
/// (5.1.22) for larger x.
pub(crate) fn expint_1(x: f64) -> f64 {
    /// Depth of the continued fraction. Near x = 1, where it converges slowest, 120 suffice.
    const DEPTH: i32 = 120;
    if x <= 1.0 {
        // E₁(x) = −γ − ln x − Σ_n (−x)^n/(n·n!), up to rounding; `power` is (−x)^n/n!.
        let (mut power, mut sum, mut n) = (1.0_f64, 0.0, 0.0);
        while power.abs() > f64::EPSILON {
            n += 1.0;
            power *= -x / n;
            sum -= power / n;
        }
        return sum - EULER_GAMMA - x.ln();
    }
    // E₁(x) = e^{−x}/(x+1 − 1/(x+3 − 4/(x+5 − …))), with numerators n², from the innermost denominator outwards.
    let mut denominator = x + f64::from(2 * DEPTH + 1);
    for n in (1..=DEPTH).rev().map(f64::from) {
        denominator = x + 2.0 * n - 1.0 - n * n / denominator;
    }
    (-x).exp() / denominator
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Bound on the relative error: some ten roundings, by cancellation in the series just below 1.
    const RELATIVE: f64 = 4e-15;

    /// Expected values are those of mpmath 1.4 (`e1`, 30 digits) and, from 1.0498 to 2.5, of SciPy (`exp1`).
    #[test]
    fn agrees_with_mpmath() {
        for (x, expected) in [
            (1e-6, 13.238_295_893_062_49),
            (0.1, 1.822_923_958_419_390_6),
            (0.999, 0.219_752_182_022_944_54),
            (1.001, 0.219_016_422_527_468_9),
            (1.0498, 0.201_939_481_045_206_34),
            (1.1448, 0.172_994_089_578_449_2),
            (2.5, 0.024_914_917_870_269_736),
            (5.0, 0.001_148_295_591_275_325_8),
            (30.0, 3.021_552_010_688_812_5e-15),
        ] {
            assert!((expint_1(x) / expected - 1.0).abs() < RELATIVE, "{x}: {}", expint_1(x));
        }
    }
}
