//! Bessel functions of the first kind for a run of orders, in single precision.

/// Most terms of a series that a method holds: its shader keeps their weights in an array of this size.
pub const TERMS_MAX: usize = 256;

/// Below this argument the ascending series is used: J₃ is under 3e-11 there, and the recurrence would overflow.
pub(super) const SMALL_ARGUMENT: f32 = 1e-3;

/// Writes `J_0(x) … J_{count−1}(x)` for finite `x ≥ 0` and `count ≤ TERMS_MAX`; absolute error a few 1e-7.
///
/// Miller's algorithm (Abramowitz & Stegun 9.12, example 1): `J_{k−1} = (2k/x)·J_k − J_{k+1}` is stable downwards, so
/// it is started with arbitrary numbers well above x and scaled by `J_0 + 2(J_2 + J_4 + …) = 1` (9.1.46). It starts at
/// `x + 8x^⅓ + 4`, where J is below 1e-11 for every x up to TERMS_MAX and never below 1e-23, so nothing overflows; higher
/// orders are written as zero.
pub fn bessel_j(x: f32, count: usize, values: &mut [f32; TERMS_MAX]) {
    if x < SMALL_ARGUMENT {
        values[3..count.max(3)].fill(0.0);
        values[0] = 1.0 - 0.25 * x * x;
        values[1] = 0.5 * x;
        values[2] = 0.125 * x * x;
        return;
    }
    let start = 2 * (0.5 * (x + 8.0 * x.cbrt() + 4.0)).ceil() as usize;
    values[(start + 1).min(count)..count].fill(0.0);
    let step = 2.0 / x;
    let (mut above, mut here, mut evens) = (0.0f32, 1.0f32, 0.0f32);
    for k in (2..=start).rev().step_by(2) {
        if k < count {
            values[k] = here;
        }
        evens += here;
        let odd = k as f32 * step * here - above;
        if k - 1 < count {
            values[k - 1] = odd;
        }
        let below = (k - 1) as f32 * step * odd - here;
        (above, here) = (odd, below);
    }
    values[0] = here;
    let scale = 1.0 / (here + 2.0 * evens);
    values[..count.min(start + 1)].iter_mut().for_each(|value| *value *= scale);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn agrees_with_double_precision() {
        // Rounding of up to 250 steps of the recurrence: a random walk of single-precision steps on values below 1.
        const ERROR: f64 = 1e-6;
        let mut x = 0.0;
        while x < TERMS_MAX as f32 {
            for count in [1, 3, 40, TERMS_MAX] {
                let mut values = [f32::NAN; TERMS_MAX];
                bessel_j(x, count, &mut values);
                for (n, value) in values[..count].iter().enumerate() {
                    let error = (f64::from(*value) - libm::jn(n as i32, x.into())).abs();
                    assert!(error < ERROR, "J_{n}({x}) of {count}: {value}, off by {error:e}");
                }
            }
            x += 0.05 * x + 3e-4;
        }
    }
}
