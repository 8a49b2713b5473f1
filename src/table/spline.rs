//! Uniform cubic B-splines: coefficients from values at the knots.
//!
//! A cubic B-spline is a sum of bells, one about each knot, with the coefficients c. Its value at knot i is
//! `s[i] = (c[i − 1] + 4·c[i] + c[i + 1])/6`. Two recursive filters with the pole p, a constant, compute c from s:
//!
//! - forward: `u[i] = s[i] + p·u[i − 1]`,
//! - backward: `b[i] = p·(b[i + 1] − u[i])`, and `c = 6·b`.
//!
//! To check, insert u from the backward filter into the forward one: `s[i] = b[i − 1] − (p + 1/p)·b[i] + b[i + 1]`.
//! With this p, `−(p + 1/p)` is 4.

/// Pole p of both filters, `√3 − 2`: the root of `p² + 4p + 1` whose magnitude is below 1. The influence of a
/// value on coefficients falls by |p| with each knot of distance.
pub(crate) const POLE: f64 = -0.267_949_192_431_122_7;

/// Replaces uniformly spaced `values` by the coefficients of the cubic B-spline through them. The forward filter
/// starts as if all values before the first knot were equal to the first one, the backward filter as if all u after
/// the last knot were equal to the last one.
pub(super) fn prefilter(values: &mut [f64]) {
    let n = values.len();
    // The coefficient of a constant is its value.
    if n < 2 {
        return;
    }
    // Forward filter. Where s is constant, u = s/(1 − p).
    values[0] /= 1.0 - POLE;
    for i in 1..n {
        values[i] += POLE * values[i - 1];
    }
    // Backward filter. Where u is constant, b = −p·u/(1 − p).
    values[n - 1] *= -POLE / (1.0 - POLE);
    for i in (0..n - 1).rev() {
        values[i] = POLE * (values[i + 1] - values[i]);
    }
    values.iter_mut().for_each(|v| *v *= 6.0);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numeric::math::cubic_b_spline;

    /// Sum of two waves, of 0.4 and 0.9 rad per knot, at `x` in knots.
    fn waves(x: f64) -> f64 {
        (0.4 * x).sin() + 0.2 * (0.9 * x).cos()
    }

    /// Coefficients of the spline through the waves at the knots 0 to 59.
    fn coefficients() -> Vec<f64> {
        let mut coefficients: Vec<f64> = (0..60).map(|i| waves(f64::from(i))).collect();
        prefilter(&mut coefficients);
        coefficients
    }

    #[test]
    fn the_spline_meets_its_knots() {
        let c = coefficients();
        for i in 20..40 {
            let knot = (c[i - 1] + 4.0 * c[i] + c[i + 1]) / 6.0;
            // The filters' identity holds at every inner knot, so only rounding remains.
            assert!((knot - waves(i as f64)).abs() < 1e-11);
        }
    }

    #[test]
    fn the_spline_follows_waves_between_knots() {
        let c = coefficients();
        for i in 20..40 {
            let x = i as f64 + 0.4;
            let value: f64 = (i - 1..i + 3).map(|k| c[k] * cubic_b_spline(x - k as f64)).sum();
            // The ends, 20 knots away, have an influence of 0.27²⁰ ≈ 4e-12. A cubic B-spline errs on a wave of ω rad
            // per knot by at most about 4ζ(4)·(ω/2π)⁴ of its amplitude: by 7e-5 on the first wave, by 0.2 · 1.8e-3 on
            // the second.
            assert!((value - waves(x)).abs() < 5e-4);
        }
    }
}
