//! Uniform cubic B-splines: values at knots to coefficients.

/// Pole `√3 − 2` of the inverse of the kernel `[1, 4, 1]/6`, which takes a cubic B-spline's coefficients to its values
/// at the knots.
const POLE: f64 = -0.267_949_192_431_122_7;

/// Replaces values at equally spaced knots by the coefficients of the cubic B-spline through them, by a recursive
/// filter in both directions (Unser, Aldroubi, Eden, *B-spline signal processing*, IEEE Trans. Signal Process. 41,
/// 1993). Values are taken as constant beyond both ends; the influence of an end falls by 0.27 a knot.
pub(super) fn prefilter(values: &mut [f64]) {
    let n = values.len();
    if n < 2 {
        return;
    }
    let gain = (1.0 - POLE) * (1.0 - 1.0 / POLE);
    values[0] /= 1.0 - POLE;
    for i in 1..n {
        values[i] += POLE * values[i - 1];
    }
    values[n - 1] *= -POLE / (1.0 - POLE);
    for i in (0..n - 1).rev() {
        values[i] = POLE * (values[i + 1] - values[i]);
    }
    values.iter_mut().for_each(|v| *v *= gain);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numeric::math::cubic_b_spline;

    #[test]
    fn interpolates_the_knots_away_from_the_ends() {
        let f = |x: f64| (0.4 * x).sin() + 0.2 * (0.9 * x).cos();
        let mut c: Vec<f64> = (0..60).map(|i| f(i as f64)).collect();
        prefilter(&mut c);
        for i in 20..40 {
            let knot = (c[i - 1] + 4.0 * c[i] + c[i + 1]) / 6.0;
            // Ends 20 knots away have decayed to 0.27²⁰ ≈ 4e-12.
            assert!((knot - f(i as f64)).abs() < 1e-11);
            let x = i as f64 + 0.4;
            let value: f64 = (i - 1..i + 3).map(|k| c[k] * cubic_b_spline(x - k as f64)).sum();
            // A cubic B-spline errs on a wave of ω rad a knot by at most about 4ζ(4)·(ω/2π)⁴ of it (its own deviation
            // and that of its images): 7e-5 of the first wave and 3.7e-4 of the second.
            assert!((value - f(x)).abs() < 5e-4);
        }
    }
}
