//! Dense linear algebra, on one thread: the same bytes for any number of callers.

use crate::Error;
use faer::linalg::matmul::matmul;
use faer::linalg::solvers::{PartialPivLu, Solve};
use faer::{Accum, Mat, Par};
use num_complex::Complex64;

pub(crate) type Matrix = Mat<Complex64>;

/// `a·b`.
pub(crate) fn product(a: &Matrix, b: &Matrix) -> Matrix {
    let mut result = Matrix::zeros(a.nrows(), b.ncols());
    matmul(&mut result, Accum::Replace, a, b, Complex64::ONE, Par::Seq);
    result
}

/// Solves `a·x = right` in place.
///
/// # Errors
/// A solution that is not finite, as a singular matrix has.
pub(crate) fn solve(a: &Matrix, mut right: Matrix, what: &'static str) -> Result<Matrix, Error> {
    PartialPivLu::new(a.as_ref()).solve_in_place(right.as_mut());
    let finite = (0..right.ncols()).all(|j| right.col_as_slice(j).iter().all(|value| value.is_finite()));
    if finite { Ok(right) } else { Err(Error::NotFinite { what }) }
}
