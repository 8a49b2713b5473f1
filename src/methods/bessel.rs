//! Bessel functions of the first kind, `J_0` to `J_{count−1}`, in single precision.
//!
//! Up to constant factors they are the coefficients of the Chebyshev series of the phase screen (term_weights.rs).
//! bessel.wgsl is the counterpart on the GPU.
//!
//! Miller's algorithm (Abramowitz & Stegun 9.12, example 1): the recurrence `J_{k−1} = (2k/x)·J_k − J_{k+1}` is stable
//! for decreasing k. It starts with an arbitrary number at an even k well above x. The identity
//! `J_0 + 2(J_2 + J_4 + …) = 1` (9.1.46) then gives the scale.

use super::DIVISOR_MIN;

/// Largest number of terms of a series of the phase screen. Every invocation of a shader keeps the weights of all terms
/// in an array of this size. Larger values allow deeper reliefs and need more memory.
pub const TERMS_MAX: usize = 256;

/// Writes `J_0(x)` to `J_{count−1}(x)` for several arguments: `values[order][lane]` for the argument `x[lane]`.
/// `values` has `count ≤ TERMS_MAX` rows. The absolute error is a few 1e-7.
///
/// Arguments lie between 0 and [`TERMS_MAX`] and are at most a factor of four apart. Callers pass arguments
/// proportional to 1/λ at visible wavelengths λ, which differ by a factor of at most 2.1. Lanes are computed side by
/// side, because the recurrence of a single argument is one chain of dependent steps.
///
/// Arguments below [`DIVISOR_MIN`] are raised to it. The recurrence starts with 1 at the order of about
/// `x + 6·∛x + 2`, with the cube root of the largest argument. There J is below 2e-8 for every x up to [`TERMS_MAX`],
/// so higher orders are written as zero. At the accepted ratios J is above 1e-31 there, so the recurrence grows to
/// about 1e31 at most and does not overflow.
pub(super) fn bessel_j<const LANES: usize>(x: [f32; LANES], values: &mut [[f32; LANES]]) {
    let x = x.map(|x| x.max(DIVISOR_MIN));
    let above_argument = 6.0 * x.into_iter().fold(0.0f32, f32::max).cbrt() + 2.0;
    // Even k at which the recurrence of each lane starts.
    let start = x.map(|x| 2 * (0.5 * (x + above_argument)) as i32 + 2);
    let largest_start = start.into_iter().fold(0, i32::max);
    let mut write = |k: i32, row: &[f32; LANES]| {
        if let Some(value) = values.get_mut(k as usize) {
            *value = *row;
        }
    };
    let two_over_x = x.map(|x| 2.0 / x);
    // J_{k+1} and J_k without the scale, and the sum of J_k over even k without J_0.
    let (mut above, mut here, mut evens) = ([0.0f32; LANES], [0.0f32; LANES], [0.0f32; LANES]);
    for k in (2..=largest_start).rev().step_by(2) {
        // J_{k−1}.
        let mut odd = [0.0; LANES];
        for lane in 0..LANES {
            // A lane is zero until its own start.
            here[lane] = if start[lane] == k { 1.0 } else { here[lane] };
            evens[lane] += here[lane];
            odd[lane] = k as f32 * two_over_x[lane] * here[lane] - above[lane];
        }
        write(k, &here);
        write(k - 1, &odd);
        for lane in 0..LANES {
            here[lane] = (k - 1) as f32 * two_over_x[lane] * odd[lane] - here[lane];
        }
        above = odd;
    }
    write(0, &here);
    let scale: [f32; LANES] = std::array::from_fn(|lane| 1.0 / (here[lane] + 2.0 * evens[lane]));
    let computed = values.len().min(largest_start as usize + 1);
    for row in &mut values[..computed] {
        for lane in 0..LANES {
            row[lane] *= scale[lane];
        }
    }
    values[computed..].fill([0.0; LANES]);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn single_precision_agrees_with_double() {
        // Bound on the rounding of up to 300 steps of the recurrence, on values below 1.
        const ERROR: f64 = 1e-6;
        let mut x = 0.0;
        while x < TERMS_MAX as f32 {
            // The first two have the largest ratio that one call accepts.
            let arguments = [x, 0.25 * x, 0.9 * x];
            for count in [1, 3, 40, TERMS_MAX] {
                let mut values = vec![[f32::NAN; 3]; count];
                bessel_j(arguments, &mut values);
                for (n, row) in values.iter().enumerate() {
                    for (x, value) in arguments.into_iter().zip(row) {
                        let error = (f64::from(*value) - libm::jn(n as i32, x.into())).abs();
                        assert!(error < ERROR, "J_{n}({x}) of {count}: {value}, off by {error:e}");
                    }
                }
            }
            x += 0.05 * x + 3e-4;
        }
    }
}
