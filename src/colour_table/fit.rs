//! Fit of one ring: samples of the colour over direction and w to coefficients of a bicubic B-spline.
//!
//! Near the horizon F falls as w², except where order zero leaks in. So that relative accuracy survives, the spline
//! goes through `F·(w² + knee²)/(w² + zero²)`: `knee` is the w where the square law ends, `zero` the one where order
//! zero takes over.

use super::rings::RingPlan;
use crate::numeric::math::cubic_b_spline;
use crate::table::POLE;
use nalgebra::DMatrix;

/// A ring's spline over `[direction][height][channel]`.
pub(super) struct FittedRing {
    /// `knee²` of the module's formula.
    pub knee_squared: f64,
    /// `zero²` of the module's formula.
    pub zero_squared: f64,
    pub coefficients: Vec<f32>,
}

/// Fits a ring's samples, `[direction][height][channel]`; `knee` as in the [module](self).
pub(super) fn fit(ring: &RingPlan, mut values: Vec<f32>, knee: f64) -> FittedRing {
    let (heights, numbers) = (ring.heights(), 3 * ring.heights());
    let samples = ring.samples();
    let total = |height: usize| -> f64 {
        values.chunks_exact(numbers).flat_map(|v| &v[3 * height..3 * height + 3]).map(|v| f64::from(v.abs())).sum()
    };
    let knee_squared = knee * knee;
    // F at the first sample beyond its square law, which bends by less than a factor of three up to the knee.
    let near_knee = samples.partition_point(|w| *w < knee).min(heights - 1);
    let fall = total(0) / total(near_knee).max(f64::MIN_POSITIVE);
    let zero_squared = (samples[near_knee].powi(2) * fall - 3.0 * samples[0] * samples[0]).clamp(0.0, knee_squared);
    for value in values.chunks_exact_mut(numbers) {
        for (sample, w) in value.chunks_exact_mut(3).zip(&samples) {
            let scale = ((w * w + knee_squared) / (w * w + zero_squared)) as f32;
            sample.iter_mut().for_each(|channel| *channel *= scale);
        }
    }
    let inverse = collocation_inverse(ring);
    let mut fitted = vec![0f32; numbers];
    for value in values.chunks_exact_mut(numbers) {
        for (weights, fitted) in inverse.chunks_exact(heights).zip(fitted.chunks_exact_mut(3)) {
            let mut sums = [0f32; 3];
            for (weight, sample) in weights.iter().zip(value.chunks_exact(3)) {
                sums.iter_mut().zip(sample).for_each(|(sum, sample)| *sum += weight * sample);
            }
            fitted.copy_from_slice(&sums);
        }
        value.copy_from_slice(&fitted);
    }
    prefilter_periodic(&mut values, numbers);
    FittedRing { knee_squared, zero_squared, coefficients: values }
}

/// Matrix from samples at [`RingPlan::samples`] to the coefficients of the cubic B-spline through them, row-major.
fn collocation_inverse(ring: &RingPlan) -> Vec<f32> {
    let n = ring.heights();
    let samples = ring.samples();
    let basis = DMatrix::from_fn(n, n, |sample, coefficient| {
        let y = ring.knot_position(samples[sample]);
        cubic_b_spline(y - (coefficient as f64 - 1.0))
    });
    // Schoenberg and Whitney: the inverse exists, since each basis function has a sample of its own.
    let inverse = basis.try_inverse().unwrap_or_else(|| DMatrix::identity(n, n));
    (0..n * n).map(|i| inverse[(i / n, i % n)] as f32).collect()
}

/// Replaces values around a ring, rows of `numbers`, by the coefficients of the periodic cubic B-spline through them.
fn prefilter_periodic(values: &mut [f32], numbers: usize) {
    /// Rows after which a filter has forgotten its start: |pole|²⁴ ≈ 2e-14 is below the rounding of single precision.
    const WARM_UP: usize = 24;
    let pole = POLE as f32;
    let n = values.len() / numbers;
    let warm_up = WARM_UP.min(n);
    let mut state = vec![0f32; numbers];
    for row in values.chunks_exact(numbers).skip(n - warm_up) {
        state.iter_mut().zip(row).for_each(|(state, value)| *state = value + pole * *state);
    }
    for row in values.chunks_exact_mut(numbers) {
        for (state, value) in state.iter_mut().zip(row) {
            *state = *value + pole * *state;
            *value = *state;
        }
    }
    // The backward pass begins with its state after one turn.
    state.fill(0.0);
    for row in values.chunks_exact(numbers).take(warm_up).rev() {
        state.iter_mut().zip(row).for_each(|(state, value)| *state = pole * (*state - value));
    }
    for row in values.chunks_exact_mut(numbers).rev() {
        for (state, value) in state.iter_mut().zip(row) {
            *state = pole * (*state - *value);
            *value = 6.0 * *state;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::rings::Rings;
    use super::*;

    #[test]
    fn periodic_splines_meet_their_knots() {
        let samples: Vec<f32> = (0..32u8).map(|i| f32::from(i % 7)).collect();
        let mut coefficients = samples.clone();
        prefilter_periodic(&mut coefficients, 1);
        for (i, sample) in samples.iter().enumerate() {
            let at = |offset: usize| coefficients[(i + 31 + offset) % 32];
            let value = (at(0) + 4.0 * at(1) + at(2)) / 6.0;
            assert!((value - sample).abs() < 1e-5, "{i}: {value} {sample}");
        }
    }

    #[test]
    fn collocation_gives_splines_through_the_samples() {
        let plan = Rings::plan(0.01, 0.8, true, 1.0);
        let ring = &plan.rings[3];
        let (n, inverse) = (ring.heights(), collocation_inverse(ring));
        for (sample, w) in ring.samples().into_iter().enumerate() {
            let basis = |c: usize| cubic_b_spline(ring.knot_position(w) - (c as f64 - 1.0));
            for other in 0..n {
                let value: f64 = (0..n).map(|c| basis(c) * f64::from(inverse[c * n + other])).sum();
                assert!((value - f64::from(u8::from(sample == other))).abs() < 1e-4, "{sample} {other}: {value}");
            }
        }
    }
}
