//! Bessel functions of the first kind for a run of orders, in single precision.

/// Most terms of a series that a method holds: its shader keeps their weights in an array of this size.
pub const TERMS_MAX: usize = 256;

/// Below this argument the ascending series is used: J₃ is under 3e-11 there, and the recurrence would overflow.
pub(super) const SMALL_ARGUMENT: f32 = 1e-3;

/// Writes `J_0(x) … J_{count−1}(x)` for each of a few finite arguments, where `values` has `count ≤ TERMS_MAX` rows; absolute
/// error a few 1e-7. Arguments are at least 0, and those of one call at most a factor of four apart: the recurrence is one
/// chain of dependent steps, so several go side by side.
///
/// Miller's algorithm (Abramowitz & Stegun 9.12, example 1): `J_{k−1} = (2k/x)·J_k − J_{k+1}` is stable downwards, so
/// it is started with arbitrary numbers well above x and scaled by `J_0 + 2(J_2 + J_4 + …) = 1` (9.1.46). It starts at
/// `x + 6x^⅓ + 2` with the cube root of the largest argument, where J is below 1e-8 for every x up to TERMS_MAX and never
/// below 1e-30, so nothing overflows; higher orders are written as zero.
pub fn bessel_j<const LANES: usize>(x: [f32; LANES], values: &mut [[f32; LANES]]) {
    let largest = x.into_iter().fold(0.0, f32::max);
    let recurred = x.map(|x| x.max(SMALL_ARGUMENT));
    let above_argument = 6.0 * largest.max(SMALL_ARGUMENT).cbrt() + 2.0;
    let start = recurred.map(|x| 2 * (0.5 * (x + above_argument)) as i32 + 2);
    let first = start.into_iter().fold(0, i32::max);
    let mut put = |k: i32, row: &[f32; LANES]| {
        if let Some(value) = values.get_mut(k as usize) {
            *value = *row;
        }
    };
    let step = recurred.map(|x| 2.0 / x);
    let (mut above, mut here, mut evens) = ([0.0f32; LANES], [0.0f32; LANES], [0.0f32; LANES]);
    for k in (2..=first).rev().step_by(2) {
        let mut odd = [0.0; LANES];
        for lane in 0..LANES {
            // Zero until this lane's own start.
            here[lane] = if start[lane] == k { 1.0 } else { here[lane] };
            evens[lane] += here[lane];
            odd[lane] = k as f32 * step[lane] * here[lane] - above[lane];
        }
        put(k, &here);
        put(k - 1, &odd);
        for lane in 0..LANES {
            here[lane] = (k - 1) as f32 * step[lane] * odd[lane] - here[lane];
        }
        above = odd;
    }
    put(0, &here);
    let scale: [f32; LANES] = std::array::from_fn(|lane| 1.0 / (here[lane] + 2.0 * evens[lane]));
    let held = values.len().min(first as usize + 1);
    for row in &mut values[..held] {
        for lane in 0..LANES {
            row[lane] *= scale[lane];
        }
    }
    values[held..].fill([0.0; LANES]);
    if largest < 4.0 * SMALL_ARGUMENT {
        for (lane, x) in x.into_iter().enumerate().filter(|(_, x)| *x < SMALL_ARGUMENT) {
            let ascending = [1.0 - 0.25 * x * x, 0.5 * x, 0.125 * x * x];
            values.iter_mut().enumerate().for_each(|(n, row)| row[lane] = ascending.get(n).copied().unwrap_or(0.0));
        }
    }
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
            // Side by side with the largest and the least that may stand beside it.
            let beside = [x, 0.25 * x, 0.9 * x];
            for count in [1, 3, 40, TERMS_MAX] {
                let mut values = vec![[f32::NAN; 3]; count];
                bessel_j(beside, &mut values);
                for (n, row) in values.iter().enumerate() {
                    for (x, value) in beside.into_iter().zip(row) {
                        let error = (f64::from(*value) - libm::jn(n as i32, x.into())).abs();
                        assert!(error < ERROR, "J_{n}({x}) of {count}: {value}, off by {error:e}");
                    }
                }
            }
            x += 0.05 * x + 3e-4;
        }
    }
}
