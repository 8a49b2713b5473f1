//! Fit of one ring: coefficients of a bicubic B-spline from samples of the colour F over direction and w.
//!
//! F(u, v, w) is the colour at the scattering vector wi + wo = (u, v, w), with w along the normal, from 0 to 2
//! ([module](super)). A ring is a circle in the plane of (u, v). Its *directions* are azimuths, uniformly spaced.
//!
//! Near the horizon, for w → 0, F falls as w² down to a constant: the light in the tails of order zero. For a small
//! relative error there, the spline represents the scaled colour `F·(w² + knee²)/(w² + zero²)`, which changes little
//! with w.
//! `knee` and `zero` are values of w: above `knee` F no longer follows the square law, below `zero` the constant
//! prevails. Evaluators divide by the factor again (`lookup.rs`).

use super::collocation::Collocation;
use super::rings::RingPlan;
use crate::table::POLE;

/// A ring's spline.
pub(super) struct FittedRing {
    /// `knee²` of the formula at the head of this file.
    pub knee_squared: f64,
    /// `zero²` of the same formula.
    pub zero_squared: f64,
    /// Spline coefficients `[direction][w][channel]`, with [`RingPlan::w_count`] of them over w. The first over w
    /// belongs to the knot −1.
    pub coefficients: Vec<f32>,
}

/// Fits the samples `values` of F on a ring: `[direction][w][channel]`, over w at [`RingPlan::sampled_w`]. `knee` > 0
/// belongs to the [module](self)'s formula.
pub(super) fn fit(ring: &RingPlan, mut values: Vec<f32>, knee: f64) -> FittedRing {
    let w_count = ring.w_count();
    // A row has the values of one direction.
    let row_len = 3 * w_count;
    let sampled_w = ring.sampled_w();
    let knee_squared = knee * knee;
    let zero_squared = estimate_zero_squared(&values, &sampled_w, knee);
    for row in values.chunks_exact_mut(row_len) {
        for (sample, w) in row.chunks_exact_mut(3).zip(&sampled_w) {
            // Samples have w > 0, so the divisor is not 0.
            let scale = ((w * w + knee_squared) / (w * w + zero_squared)) as f32;
            sample.iter_mut().for_each(|channel| *channel *= scale);
        }
    }
    // Splines over w.
    let collocation = Collocation::new(ring);
    values.chunks_exact_mut(row_len).for_each(|row| collocation.solve(row));
    // Splines around the ring, through the coefficients over w.
    prefilter_periodic(&mut values, row_len);
    FittedRing { knee_squared, zero_squared, coefficients: values }
}

/// Estimate of `zero²` of the [module](self)'s formula, from the samples `values[direction][w][channel]` of F at
/// `sampled_w`.
///
/// Up to the knee F is proportional to `w² + zero²`. Let w_0 be the first sample, and w_k the first at or beyond the
/// knee, or else the last. For w_k much larger than `zero`, `zero² ≈ w_k²·F(w_0)/F(w_k) − w_0²`.
///
/// Near the knee F falls short of the square law: a sinusoid's first order by a factor of 3 at twice the knee. The
/// formula would then give 2·w_0² where zero² is 0. So 3·w_0² is subtracted in place of w_0².
fn estimate_zero_squared(values: &[f32], sampled_w: &[f64], knee: f64) -> f64 {
    let w_count = sampled_w.len();
    // Sum of |F| over directions and channels at one sample over w.
    let total = |i: usize| -> f64 {
        values.chunks_exact(3 * w_count).flat_map(|row| &row[3 * i..3 * i + 3]).map(|v| f64::from(v.abs())).sum()
    };
    let near_knee = sampled_w.partition_point(|w| *w < knee).min(w_count - 1);
    let fall = total(0) / total(near_knee).max(f64::MIN_POSITIVE);
    (sampled_w[near_knee].powi(2) * fall - 3.0 * sampled_w[0] * sampled_w[0]).clamp(0.0, knee * knee)
}

/// Replaces rows of `row_len` values, one row per direction, by the coefficients of the periodic cubic B-splines
/// through them.
///
/// Each column s is filtered by two recursive passes around the ring, with the pole `z = √3 − 2` ([`POLE`]):
/// `p[i] = s[i] + z·p[i − 1]`, then `q[i] = z·(q[i + 1] − p[i])`. The coefficients are 6·q (`table/spline.rs`).
fn prefilter_periodic(values: &mut [f32], row_len: usize) {
    /// Rows after which a filter has forgotten its start: |pole|²⁴ ≈ 2e-14 is below the rounding of single precision. A
    /// ring may have as few as `DIRECTIONS_MIN` = 16 rows; |pole|¹⁶ ≈ 7e-10 is also below it.
    const WARM_UP: usize = 24;
    let pole = POLE as f32;
    let n = values.len() / row_len;
    let warm_up = WARM_UP.min(n);
    // The first pass. On a ring, the rows before the first are the last rows.
    let mut state = vec![0f32; row_len];
    for row in values.chunks_exact(row_len).skip(n - warm_up) {
        state.iter_mut().zip(row).for_each(|(state, value)| *state = value + pole * *state);
    }
    for row in values.chunks_exact_mut(row_len) {
        for (state, value) in state.iter_mut().zip(row) {
            *state = *value + pole * *state;
            *value = *state;
        }
    }
    // The second pass. The rows after the last are the first rows.
    state.fill(0.0);
    for row in values.chunks_exact(row_len).take(warm_up).rev() {
        state.iter_mut().zip(row).for_each(|(state, value)| *state = pole * (*state - value));
    }
    for row in values.chunks_exact_mut(row_len).rev() {
        for (state, value) in state.iter_mut().zip(row) {
            *state = pole * (*state - *value);
            *value = 6.0 * *state;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn periodic_splines_meet_their_knots() {
        let samples: Vec<f32> = (0..32u8).map(|i| f32::from(i % 7)).collect();
        let mut coefficients = samples.clone();
        prefilter_periodic(&mut coefficients, 1);
        for (i, sample) in samples.iter().enumerate() {
            let coefficient = |j: usize| coefficients[j % 32];
            let value = (coefficient(i + 31) + 4.0 * coefficient(i) + coefficient(i + 1)) / 6.0;
            assert!((value - sample).abs() < 1e-5, "{i}: {value} {sample}");
        }
    }
}
