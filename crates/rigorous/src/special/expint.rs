//! The exponential integral E₁ of a positive real number.

use super::EULER_GAMMA;

/// `E₁(x) = ∫ₓ^∞ e^{−t}/t dt` for x > 0, to about 1e-15 relative.
///
/// It is computed by the power series (Abramowitz & Stegun 5.1.11) for x ≤ 1, and by the continued fraction (5.1.22)
/// for larger x.
pub(crate) fn expint_1(x: f64) -> f64 {
    /// Most steps of the continued fraction, a safeguard: it converges in fewer for every x > 1.
    const STEPS_MAX: usize = 200;
    /// Number of the power series' last term: 1/(29·29!) at x = 1, far below rounding.
    const LAST_TERM: i32 = 29;
    if x <= 1.0 {
        // −γ − ln x − Σ_n (−x)^n/(n·n!); `power` is (−x)^n/n!.
        let (mut power, mut sum) = (1.0, 0.0);
        for n in 1..=LAST_TERM {
            power *= -x / f64::from(n);
            sum -= power / f64::from(n);
        }
        return sum - EULER_GAMMA - x.ln();
    }
    // Lentz' method for e^{−x}/(x+1 − 1/(x+3 − 4/(x+5 − …))). a and b are the partial numerators and denominators; c
    // and d are ratios of consecutive numerators and denominators of the convergents.
    let mut b = x + 1.0;
    // c starts near infinity, so that a/c vanishes in the first step.
    let mut c = f64::MAX;
    let mut d = 1.0 / b;
    let mut value = d;
    for n in 1..STEPS_MAX {
        let a = -((n * n) as f64);
        b += 2.0;
        d = 1.0 / (a * d + b);
        c = b + a / c;
        value *= c * d;
        if (c * d - 1.0).abs() < f64::EPSILON {
            break;
        }
    }
    value * (-x).exp()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Bound on the relative error: double precision, less a factor of ten by cancellation in the series.
    const RELATIVE: f64 = 4e-15;

    /// References: values of mpmath 1.4 (`e1`, 30 digits).
    #[test]
    fn agrees_with_tabulated_values() {
        for (x, expected) in [
            (1e-6, 13.238_295_893_062_49),
            (0.1, 1.822_923_958_419_390_6),
            (0.999, 0.219_752_182_022_944_54),
            (1.001, 0.219_016_422_527_468_9),
            (5.0, 0.001_148_295_591_275_325_8),
            (30.0, 3.021_552_010_688_812_5e-15),
        ] {
            assert!((expint_1(x) / expected - 1.0).abs() < RELATIVE, "{x}: {}", expint_1(x));
        }
    }
}
