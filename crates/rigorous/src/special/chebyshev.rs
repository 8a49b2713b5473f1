//! Chebyshev nodes, and coefficients of a Chebyshev series from its values at the nodes.

use std::f64::consts::PI;
use std::ops::{AddAssign, Mul};

/// The n Chebyshev nodes of the first kind in (−1, 1), in descending order.
pub(crate) fn chebyshev_nodes(n: usize) -> Vec<f64> {
    (0..n).map(|i| (PI * (i as f64 + 0.5) / n as f64).cos()).collect()
}

/// Coefficients c of `Σ c[k] T_k(x)`, k from 0 to n − 1, from the values at the n [`chebyshev_nodes`]. T_k is the
/// Chebyshev polynomial cos(k arccos x). Values are real or complex; `T::default()` must be 0.
pub(crate) fn chebyshev_coefficients<T>(values: &[T]) -> Vec<T>
where
    T: Copy + Default + AddAssign + Mul<f64, Output = T>,
{
    let n = values.len();
    // cos(jπ/(2n)) for one turn.
    let cosines: Vec<f64> = (0..4 * n).map(|j| (PI * j as f64 / (2 * n) as f64).cos()).collect();
    (0..n)
        .map(|k| {
            let mut sum = T::default();
            for (i, &value) in values.iter().enumerate() {
                // T_k(x_i) = cos(k(i + ½)π/n), with the angle reduced to one turn in integers.
                sum += value * cosines[k * (2 * i + 1) % (4 * n)];
            }
            // The discrete orthogonality of T_k at the nodes: Σ T_k² is n for k = 0 and n/2 for the others.
            let factor = if k == 0 { 1.0 } else { 2.0 };
            sum * (factor / n as f64)
        })
        .collect()
}
