//! Lagrange interpolation from coarse to fine nodes, for functions with a Bloch phase b in turns: they change by the
//! factor e^{2πib} from one period to the next.
//!
//! Interpolation is local, by polynomials of degree 16 in the curve's parameter τ (`nodes.rs`), in which nodes have
//! equal steps. The response of a metal then couples near nodes only, as [`MetalTable`](crate::MetalTable) requires;
//! trigonometric functions of the whole period would couple all nodes. A value at a node beyond either end of the
//! period is the value one period away, times the Bloch factor e^{±2πib}.

use crate::linear::{Matrix, zeros};
use num_complex::Complex64;
use std::f64::consts::TAU;

/// Number of coarse nodes on either side of the nearest one from which a value is interpolated. Larger values take more
/// time; smaller ones raise the error of interpolation, which is far below that of the quadrature (`layers.rs`).
const REACH: usize = 8;
/// Number of coarse nodes from which a value is interpolated.
pub(crate) const WIDTH: usize = 2 * REACH + 1;

/// Lagrange interpolation from coarse nodes to fine nodes. Each coarse node is the middle one of `factor` fine nodes,
/// an odd number, which `Discretisation::new` checks.
pub(crate) struct Interpolation {
    /// Number of coarse nodes on one period, at least [`WIDTH`].
    nodes: usize,
    /// For each of the `factor` fine nodes around a coarse node: weights of the coarse nodes from [`REACH`] before it
    /// to [`REACH`] after it.
    weights: Vec<[f64; WIDTH]>,
}

impl Interpolation {
    /// Computes the weights for `nodes` coarse nodes on one period and `factor` fine nodes around each: the Lagrange
    /// polynomials at the fine nodes.
    pub(crate) fn new(nodes: usize, factor: usize) -> Self {
        let weights = (0..factor)
            .map(|i| {
                // Distance of the fine node from its coarse node, in steps of the coarse nodes.
                let offset = (i as f64 - (factor / 2) as f64) / factor as f64;
                let mut weights = [1.0; WIDTH];
                for (j, weight) in weights.iter_mut().enumerate() {
                    for other in (0..WIDTH).filter(|&other| other != j) {
                        *weight *= (offset + REACH as f64 - other as f64) / (j as f64 - other as f64);
                    }
                }
                weights
            })
            .collect();
        Self { nodes, weights }
    }

    /// The product `layer·B`, with B the matrix of the interpolation (fine × coarse nodes) at a Bloch phase in turns.
    /// Columns of `layer` are the fine nodes: fine node f belongs to coarse node ⌊f/factor⌋.
    pub(crate) fn apply(&self, layer: &Matrix, bloch: f64) -> Matrix {
        let (factor, n) = (self.weights.len(), self.nodes);
        let mut result = zeros(layer.nrows(), n);
        for fine in 0..layer.ncols() {
            let from = layer.column(fine);
            // At the middle fine node all weights but one vanish.
            for (j, &weight) in self.weights[fine % factor].iter().enumerate().filter(|(_, weight)| **weight != 0.0) {
                // Index of the coarse node plus n, so that it is never negative.
                let shifted = fine / factor + j + n - REACH;
                // Period of this coarse node: −1, 0 or 1.
                let periods = (shifted / n) as f64 - 1.0;
                let node = shifted % n;
                let mut into = result.column_mut(node);
                // Within the period the weight is real, which halves the multiplications.
                if periods == 0.0 {
                    into.zip_mut_with(&from, |into, from| *into += from * weight);
                } else {
                    let weight = weight * Complex64::cis(TAU * bloch * periods);
                    into.zip_mut_with(&from, |into, from| *into += from * weight);
                }
            }
        }
        result
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::linear::from_fn;

    #[test]
    fn interpolation_of_a_wave_crosses_the_period() {
        let (n, factor, bloch) = (32, 5, 0.3);
        let wave = |t: f64| Complex64::cis((2.0 + bloch) * TAU * t);
        let identity = from_fn(n * factor, n * factor, |i, j| Complex64::from(f64::from(i == j)));
        let interpolation = Interpolation::new(n, factor).apply(&identity, bloch);
        for i in 0..n * factor {
            let sum: Complex64 = (0..n).map(|j| interpolation[(i, j)] * wave((j as f64 + 0.5) / n as f64)).sum();
            let exact = wave((i as f64 + 0.5) / (n * factor) as f64);
            // The remainder of the Lagrange polynomial, at most (8!)²/17! times the 17th power of the phase between
            // nodes, is 6e-12: the wave has 2.3 periods on 32 nodes. The smallest weight exceeds 1e-6, so the bound
            // also detects a missing weight.
            assert!((sum - exact).norm() < 1e-9, "{i}: {sum}, not {exact}");
        }
    }
}
