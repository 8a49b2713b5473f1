//! Dense complex linear algebra on the caller's thread, with results that are identical to the bit in every thread.
//! Computations use *planes*, separate matrices of the real and the imaginary parts, for ndarray's fast real products.

mod lu;
mod planes;

use crate::Error;
use ndarray::{Array2, ShapeBuilder};
use num_complex::Complex64;
use planes::Planes;

/// A complex matrix in column-major order, as [`zeros`] and [`from_fn`] create it.
pub(crate) type Matrix = Array2<Complex64>;

/// The zero matrix.
pub(crate) fn zeros(rows: usize, columns: usize) -> Matrix {
    Matrix::zeros((rows, columns).f())
}

/// The matrix with elements `element(row, column)`.
pub(crate) fn from_fn(rows: usize, columns: usize, mut element: impl FnMut(usize, usize) -> Complex64) -> Matrix {
    Matrix::from_shape_fn((rows, columns).f(), |(i, j)| element(i, j))
}

/// `a·b`; `a` has as many columns as `b` has rows.
pub(crate) fn product(a: &Matrix, b: &Matrix) -> Matrix {
    let mut result = Planes::zeros(a.nrows(), b.ncols());
    result.view_mut().add_product(1.0, &Planes::of(a).view(), &Planes::of(b).view());
    result.joined()
}

/// Solves `a·x = right` for a square matrix `a` and every column of `right`, which has as many rows, by LU
/// decomposition with row exchanges. `what` names the solution in the error.
///
/// # Errors
/// [`Error::NotFinite`] for a solution that is not finite: `a` is exactly singular, or an argument is not finite. A
/// matrix that is singular up to rounding may pass.
pub(crate) fn solve(a: &Matrix, right: &Matrix, what: &'static str) -> Result<Matrix, Error> {
    let mut factors = Planes::of(a);
    let pivots = lu::factor(factors.view_mut());
    let mut solution = Planes::of(right);
    lu::solve(&factors.view(), &pivots, solution.view_mut());
    let solution = solution.joined();
    if solution.iter().all(|value| value.is_finite()) { Ok(solution) } else { Err(Error::NotFinite { what }) }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Bound on the rounding of sums of some hundred terms, and on its growth by elimination.
    const ROUNDING: f64 = 1e-11;

    /// Pseudo-random elements with real and imaginary parts in [−½, ½), by Knuth's linear congruential generator.
    fn random_matrix(rows: usize, columns: usize, seed: u64) -> Matrix {
        let mut state = seed;
        let mut part = move || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
        };
        from_fn(rows, columns, |_, _| Complex64::new(part(), part()))
    }

    /// Largest magnitude of an element; all must be finite, since `f64::max` ignores NaN.
    fn largest(matrix: &Matrix) -> f64 {
        assert!(matrix.iter().all(|value| value.is_finite()));
        matrix.iter().map(|value| value.norm()).fold(0.0, f64::max)
    }

    #[test]
    fn product_matches_its_definition() {
        let (a, b) = (random_matrix(37, 50, 1), random_matrix(50, 21, 2));
        let expected = from_fn(37, 21, |i, j| (0..50).map(|k| a[(i, k)] * b[(k, j)]).sum());
        assert!(largest(&(product(&a, &b) - expected)) < ROUNDING);
    }

    #[test]
    fn solutions_satisfy_the_system_within_blocks_and_beyond() {
        // Sizes about BLOCK of `lu.rs`, at which elimination becomes recursive, and several times as large.
        for (n, columns) in [(1, 1), (2, 3), (15, 1), (16, 4), (17, 17), (33, 5), (48, 48), (101, 8), (200, 30)] {
            let (a, right) = (random_matrix(n, n, 1), random_matrix(n, columns, 2));
            let solution = solve(&a, &right, "a test").unwrap();
            let left = from_fn(n, columns, |i, j| (0..n).map(|k| a[(i, k)] * solution[(k, j)]).sum());
            assert!(largest(&(left - &right)) < ROUNDING * (1.0 + largest(&solution)), "{n} × {columns}");
        }
    }

    #[test]
    fn zero_pivots_exchange_rows() {
        // A cyclic shift of the rows: every pivot but the last lies below the diagonal.
        let n = 40;
        let shift = from_fn(n, n, |i, j| Complex64::from(f64::from(u8::from(i == (j + 1) % n))));
        let right = random_matrix(n, 3, 1);
        let expected = from_fn(n, 3, |i, j| right[((i + 1) % n, j)]);
        assert_eq!(solve(&shift, &right, "a test").unwrap(), expected);
    }

    #[test]
    fn singular_matrices_are_an_error() {
        assert!(matches!(
            solve(&zeros(20, 20), &random_matrix(20, 2, 1), "nothing"),
            Err(Error::NotFinite { what: "nothing" })
        ));
    }
}
