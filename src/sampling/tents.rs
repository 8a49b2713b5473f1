//! Sums of tents that replace Gaussians about the nodes of a uniform lattice, where the Gaussians are wide compared
//! with the spacing of nodes (`square.rs`).
//!
//! A tent at a node has the density `1 − |t|` of the offset t in node spacings, for t in [−1, 1]. A sum of tents is
//! linear between nodes, so its value at any position needs two nodes per axis.

use super::summed_area::BANDS;
use crate::numeric::Real;
use crate::numeric::math::GAUSSIAN_REACH;
use rayon::prelude::*;

/// Weights of tents at the nodes from −m to m, for some m, whose sum `p` approximates the Gaussian `g` of standard
/// deviation `sigma` in nodes. They sum to 1.
///
/// They minimise `∫ g²/p`, which is one more than the variance of `g/p`, the weight of a sample drawn from p. Each step
/// multiplies the weights by a function of the gradient, which keeps them positive. `sigma` is positive.
pub(super) fn tent_weights(sigma: f64) -> Vec<f32> {
    /// Midpoints per node of the integral. Chosen: with 64, weights change by up to 1.5e-3, and the build takes longer.
    const STEPS: usize = 16;
    /// Number of gradient steps. Chosen: from the 21st on, no weight changes by more than 1e-7. The further steps take
    /// those outer weights that tend to zero below [`NEGLIGIBLE_WEIGHT`], so that they are dropped.
    const ROUNDS: usize = 300;
    /// Weight below which an outer tent is dropped. Weights of the minimum are above 1e-8; others fall towards zero.
    const NEGLIGIBLE_WEIGHT: f64 = 1e-12;
    // Tents at first: from −n to n, where samplers cut the Gaussian off.
    let n = (GAUSSIAN_REACH * sigma).ceil() as usize;
    // g² at the midpoints, up to a constant factor.
    let squares: Vec<f64> = (0..2 * n * STEPS)
        .map(|i| ((i as f64 + 0.5) / STEPS as f64 - n as f64) / sigma)
        .map(|t| (-t * t).exp())
        .collect();
    // Index k of the tent before a midpoint, and the fraction towards the next one.
    let split = |i: usize| (i / STEPS, ((i % STEPS) as f64 + 0.5) / STEPS as f64);
    let mut weights: Vec<f64> = (0..=2 * n).map(|k| (-0.5 * ((k as f64 - n as f64) / sigma).powi(2)).exp()).collect();
    for _ in 0..ROUNDS {
        // −∂/∂weight of the integral, ∫ tent·g²/p², up to a constant factor.
        let mut gradient = vec![0.0; weights.len()];
        for (i, square) in squares.iter().enumerate() {
            let (k, t) = split(i);
            let ratio = square / ((1.0 - t) * weights[k] + t * weights[k + 1]).powi(2);
            gradient[k] += (1.0 - t) * ratio;
            gradient[k + 1] += t * ratio;
        }
        // The root makes each step minimise an upper bound of the integral that equals it at the previous weights, so
        // no step raises the integral.
        weights.iter_mut().zip(&gradient).for_each(|(weight, slope)| *weight *= slope.sqrt());
        let sum: f64 = weights.iter().sum();
        weights.iter_mut().for_each(|weight| *weight /= sum);
    }
    // Weights are symmetric: equally many are dropped at either end.
    let dropped = weights.iter().take_while(|weight| **weight < NEGLIGIBLE_WEIGHT).count();
    weights[dropped..weights.len() - dropped].iter().map(|weight| *weight as f32).collect()
}

/// Convolves masses `[node along y][node along x][band of κ]`, `width` nodes along x, with the weights of tents along x
/// and y. Each list has an odd number of weights, and the middle one belongs to the node itself. Mass beyond the ends
/// is lost. The result reuses the memory of `masses`.
pub(super) fn convolved(
    masses: Vec<[f32; BANDS]>,
    width: usize,
    tents_x: &[f32],
    tents_y: &[f32],
) -> Vec<[f32; BANDS]> {
    let add = |to: &mut [[f32; BANDS]], from: &[[f32; BANDS]], weight: f32| {
        for (to, from) in to.iter_mut().zip(from) {
            *to = std::array::from_fn(|b| to[b] + weight * from[b]);
        }
    };
    let mut along_x = vec![[0f32; BANDS]; masses.len()];
    along_x.par_chunks_mut(width).zip(masses.par_chunks(width)).for_each(|(to, from)| {
        for (k, &weight) in tents_x.iter().enumerate() {
            // Adds the masses of a row, shifted by this number of nodes.
            let shift = k as i64 - (tents_x.len() / 2) as i64;
            let (to_start, from_start) = (shift.max(0) as usize, (-shift).max(0) as usize);
            if to_start.max(from_start) < width {
                add(&mut to[to_start..], &from[from_start..], weight);
            }
        }
    });
    let height = masses.len() / width;
    let mut along_both = masses;
    along_both.par_chunks_mut(width).enumerate().for_each(|(row, to)| {
        to.fill([0.0; BANDS]);
        for (k, &weight) in tents_y.iter().enumerate() {
            let from = row as i64 + (tents_y.len() / 2) as i64 - k as i64;
            if (0..height as i64).contains(&from) {
                add(to, &along_x[from as usize * width..][..width], weight);
            }
        }
    });
    along_both
}

/// Quantile of the tent density `1 − |t|` on [−1, 1], for `u` in [0, 1).
#[inline(always)]
pub(super) fn tent_quantile<R: Real>(u: R) -> R {
    let lit = R::lit;
    let is_left = u.lt(lit(0.5));
    let tail = R::select(is_left, u, lit(1.0) - u);
    let distance = lit(1.0) - (tail + tail).sqrt();
    R::select(is_left, -distance, distance)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::TAU;

    #[test]
    fn tent_quantile_inverts_the_distribution() {
        assert_eq!(tent_quantile(0.5f64), 0.0);
        assert!((tent_quantile(0.125f64) + 0.5).abs() < 1e-15);
        assert!((tent_quantile(0.875f64) - 0.5).abs() < 1e-15);
    }

    #[test]
    fn tents_follow_a_gaussian() {
        // Bounds above the variances that are found: 0.053, 0.022, 0.0063 and 0.0003.
        for (sigma, variance_max) in [(0.36, 0.06), (0.45, 0.03), (0.9, 0.01), (1.8, 0.001)] {
            let weights = tent_weights(sigma);
            // Rounding of each weight to single precision.
            let sum: f64 = weights.iter().map(|&w| f64::from(w)).sum();
            assert!((sum - 1.0).abs() < 1e-6, "{sigma}: {sum}");
            assert!(weights.iter().all(|&w| w > 0.0), "{sigma}: {weights:?}");
            let n = (weights.len() / 2) as f64;
            // Second moment of the weight g/p along one axis, ∫ g²/p from the first node to the last.
            let (steps, mut second) = (100, 0.0);
            for i in 0..steps * (weights.len() - 1) {
                let x = (i as f64 + 0.5) / steps as f64;
                let (k, t) = (x as usize, x.fract());
                let p = (1.0 - t) * f64::from(weights[k]) + t * f64::from(weights[k + 1]);
                let g = (-0.5 * ((x - n) / sigma).powi(2)).exp() / (TAU.sqrt() * sigma);
                second += g * g / p / steps as f64;
            }
            assert!(second - 1.0 < variance_max, "{sigma}: {second}");
        }
    }
}
