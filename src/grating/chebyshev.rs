//! Chebyshev nodes of a cell, at which orders are solved, and interpolation from them to a table's nodes.
//!
//! Along either side of a cell the nodes are those of an angle θ in [0, π], with the fractional part `(1 − cos θ)/2`:
//! the square roots at both ends of a fraction are smooth in θ.

use super::cell_position::fraction_at;
use std::f64::consts::PI;

/// Fractional parts p (or q) of `count` Chebyshev nodes.
pub(super) fn node_fractions(count: usize) -> Vec<f64> {
    let angle = |k: usize| 0.5 * PI * (1.0 + (PI * (k as f64 + 0.5) / count as f64).cos());
    (0..count).map(|k| (0.5 * angle(k)).sin().powi(2)).collect()
}

/// Index pairs `[i, k]` with `k ≤ i < count`, row by row: one side of a cell's diagonal. The other side follows by
/// reciprocity.
pub(super) fn triangle(count: usize) -> Vec<[usize; 2]> {
    (0..count).flat_map(|i| (0..=i).map(move |k| [i, k])).collect()
}

/// Position of `[i, k]`, in either order, in [`triangle`].
pub(super) fn triangle_index(i: usize, k: usize) -> usize {
    let (high, low) = (i.max(k), i.min(k));
    high * (high + 1) / 2 + low
}

/// Matrix from values at `count` Chebyshev nodes to the coefficients of Chebyshev polynomials: `[degree][node]`.
pub(super) fn coefficients(count: usize) -> Vec<Vec<f64>> {
    matrix(count, count, |degree, k| {
        let angle = PI * (k as f64 + 0.5) / count as f64;
        if degree == 0 { 1.0 / count as f64 } else { 2.0 / count as f64 * (degree as f64 * angle).cos() }
    })
}

/// Interpolation matrix from `solved` Chebyshev nodes to the `stored` nodes of a table, which have equal steps in
/// [`node_coordinate`](super::cell_position::node_coordinate): `[stored][solved]`.
pub(super) fn resampling(solved: usize, stored: usize) -> Vec<Vec<f64>> {
    matrix(stored, solved, |g, k| {
        let fraction = fraction_at(g as f64 / (stored - 1) as f64);
        // θ of the stored node mapped to [−1, 1], and the Chebyshev angle there.
        let angle_stored = ((1.0 - 2.0 * fraction).acos() / PI * 2.0 - 1.0).clamp(-1.0, 1.0).acos();
        let angle_solved = PI * (k as f64 + 0.5) / solved as f64;
        let sum: f64 = (1..solved).map(|n| (n as f64 * angle_stored).cos() * (n as f64 * angle_solved).cos()).sum();
        (1.0 + 2.0 * sum) / solved as f64
    })
}

/// A matrix by its elements: `[row][column]`.
pub(super) fn matrix(rows: usize, columns: usize, element: impl Fn(usize, usize) -> f64) -> Vec<Vec<f64>> {
    (0..rows).map(|i| (0..columns).map(|k| element(i, k)).collect()).collect()
}
