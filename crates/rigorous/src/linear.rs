//! Dense linear algebra, on one thread: the same bytes for any number of callers.

use crate::Error;
use faer::linalg::matmul::matmul;
use faer::linalg::solvers::{PartialPivLu, Solve};
use faer::{Accum, Mat, Par, Scale};
use num_complex::Complex64;

pub(crate) type Matrix = Mat<Complex64>;

/// `a·b`.
pub(crate) fn product(a: &Matrix, b: &Matrix) -> Matrix {
    let mut result = Matrix::zeros(a.nrows(), b.ncols());
    matmul(&mut result, Accum::Replace, a, b, Complex64::ONE, Par::Seq);
    result
}

/// A power of two that no pivot of a matrix of ours undoes.
///
/// faer inverts a pivot whose parts are at most 1 by way of a subnormal number if its magnitude is above 1. Renderers have their
/// threads flush these to zero, and threads started there inherit it: the inverse would be zero, and the solution wrong.
/// Multiplied by this, pivots of all sizes that matter are above 1, and take another way.
const SCALE: f64 = (1_u128 << 127) as f64;

/// Solves `a·x = right` in place.
///
/// # Errors
/// A solution that is not finite, as a singular matrix has.
pub(crate) fn solve(a: &Matrix, mut right: Matrix, what: &'static str) -> Result<Matrix, Error> {
    PartialPivLu::new((a * Scale(Complex64::from(SCALE))).as_ref()).solve_in_place(right.as_mut());
    right *= Scale(Complex64::from(SCALE));
    let finite = (0..right.ncols()).all(|j| right.col_as_slice(j).iter().all(|value| value.is_finite()));
    if finite { Ok(right) } else { Err(Error::NotFinite { what }) }
}
