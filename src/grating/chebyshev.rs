//! Chebyshev nodes of a cell, at which orders are solved, and interpolation from them to a table's nodes (symbols:
//! `mod.rs`).
//!
//! Along a side of a cell, efficiencies vary as the square roots of the position p in [0, 1] and of 1 − p. They are
//! smooth in the angle θ in [0, π] with `p = (1 − cos θ)/2 = sin²(θ/2)`. The nodes along a side of the cell are
//! therefore Chebyshev nodes of `x = 2θ/π − 1`: `x_k = cos((k + ½)π/n)`, k from 0 to n − 1. A cell has two sides, over
//! p and q, the fractional parts of t − a and t + a.

use super::cell_position::fraction_at;
use std::f64::consts::PI;

/// Fractional parts, p or q, of `count` Chebyshev nodes, in descending order.
pub(super) fn node_fractions(count: usize) -> Vec<f64> {
    let theta = |k: usize| 0.5 * PI * (1.0 + chebyshev_angle(k, count).cos());
    (0..count).map(|k| (0.5 * theta(k)).sin().powi(2)).collect()
}

/// The angle `(k + ½)π/count`, whose cosine is Chebyshev node k.
fn chebyshev_angle(k: usize, count: usize) -> f64 {
    PI * (k as f64 + 0.5) / count as f64
}

/// Nodes `[i, k]`, i of p and k of q, with `k ≤ i < count`, row by row: those on one side of the diagonal p = q of a
/// cell, and on it. The other side follows by reciprocity.
pub(super) fn triangle_nodes(count: usize) -> Vec<[usize; 2]> {
    (0..count).flat_map(|i| (0..=i).map(move |k| [i, k])).collect()
}

/// Number of [`triangle_nodes`].
pub(super) fn triangle_count(count: usize) -> usize {
    count * (count + 1) / 2
}

/// Position of the node `[i, k]`, or of its mirror image `[k, i]`, in [`triangle_nodes`].
pub(super) fn triangle_index(i: usize, k: usize) -> usize {
    let (high, low) = (i.max(k), i.min(k));
    triangle_count(high) + low
}

/// Matrix from values at `count` Chebyshev nodes to the coefficients of the Chebyshev polynomials T_0 to T_(count−1):
/// `[degree][node]`.
pub(super) fn coefficient_matrix(count: usize) -> Vec<Vec<f64>> {
    matrix_of(count, count, |degree, k| {
        // c_n = 2/count · Σ_k f(x_k)·T_n(x_k), half of it for n = 0, with T_n(cos α) = cos nα.
        let angle = chebyshev_angle(k, count);
        if degree == 0 { 1.0 / count as f64 } else { 2.0 / count as f64 * (degree as f64 * angle).cos() }
    })
}

/// Interpolation matrix from `solved` Chebyshev nodes to the `stored` nodes of a table, at least two, which have equal
/// steps in [`node_coordinate`](super::cell_position::node_coordinate): `[stored node][solved node]`.
pub(super) fn resampling_matrix(solved: usize, stored: usize) -> Vec<Vec<f64>> {
    matrix_of(stored, solved, |g, k| {
        let fraction = fraction_at(g as f64 / (stored - 1) as f64);
        let theta = (1.0 - 2.0 * fraction).acos();
        // Angle arccos(x) of the stored node, and that of the solved node.
        let angle_stored = (theta / PI * 2.0 - 1.0).acos();
        let angle_solved = chebyshev_angle(k, solved);
        // Σ_n c_n T_n(x), with the coefficients c_n of a function that is 1 at node k and 0 at the others.
        let sum: f64 = (1..solved).map(|n| (n as f64 * angle_stored).cos() * (n as f64 * angle_solved).cos()).sum();
        (1.0 + 2.0 * sum) / solved as f64
    })
}

/// The matrix with elements `element(row, column)`: `[row][column]`.
pub(super) fn matrix_of(rows: usize, columns: usize, element: impl Fn(usize, usize) -> f64) -> Vec<Vec<f64>> {
    (0..rows).map(|i| (0..columns).map(|k| element(i, k)).collect()).collect()
}
