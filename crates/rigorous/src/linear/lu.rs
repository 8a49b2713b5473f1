//! LU decomposition with partial pivoting, P·A = L·U, recursive over halves of the columns: Toledo, SIAM J. Matrix
//! Anal. Appl. 18 (1997). The recursion turns nearly all of the work into matrix products, which are fast.
//!
//! A matrix, which has at least as many rows as columns, is split after half of its columns and equally many rows:
//!
//! ```text
//! [ corner  beside ]      1. factor the left half [corner; below]
//! [ below   rest   ]      2. beside ← L(corner)⁻¹·beside
//!                         3. rest ← rest − below·beside, and factor it
//! ```
//!
//! L and U overwrite the matrix; the unit diagonal of L is not stored. Rows are exchanged as in Gaussian elimination,
//! and the exchanges of one half of the columns are applied to the other half. A view has the real and the imaginary
//! parts as two matrices, `re` and `im`; `add_product(f, a, b)` adds f·a·b (planes.rs).

use super::planes::{View, ViewMut};
use ndarray::Axis;
use num_complex::Complex64;
use std::array;

/// Number of columns, or of rows of a triangular system, at which the recursion ends in plain elimination. Larger
/// blocks leave more work to elimination, smaller ones to the recursion. Another number changes the rounding of
/// results.
const BLOCK: usize = 16;

/// A column of at most [`BLOCK`] rows, in its first elements.
type BlockColumn = [Complex64; BLOCK];

/// Overwrites a matrix of at least as many rows as columns with its factors L and U.
///
/// Returns the pivots: step k exchanged row k with row `pivots[k]`, which is at least k.
pub(super) fn factor(mut a: ViewMut<'_>) -> Vec<usize> {
    let columns = a.re.ncols();
    if columns <= BLOCK {
        return (0..columns).map(|k| eliminate(&mut a, k)).collect();
    }
    let half = columns / 2;
    let (mut left, mut right) = a.split_at(Axis(1), half);
    let mut pivots = factor(left.reborrow());
    exchange(&mut right, &pivots);
    let (corner, mut below) = left.split_at(Axis(0), half);
    let (mut beside, mut rest) = right.split_at(Axis(0), half);
    solve_lower(&corner.view(), beside.reborrow());
    rest.add_product(-1.0, &below.view(), &beside.view());
    // Pivots of `rest` count from its first row, that of index `half`; `below` has the same rows.
    let rest_pivots = factor(rest);
    exchange(&mut below, &rest_pivots);
    pivots.extend(rest_pivots.iter().map(|row| half + row));
    pivots
}

/// Solves A·x = right for every column of `right`, in place, from the factors and pivots of [`factor`].
pub(super) fn solve(factors: &View<'_>, pivots: &[usize], mut right: ViewMut<'_>) {
    exchange(&mut right, pivots);
    solve_lower(factors, right.reborrow());
    solve_upper(factors, right);
}

/// Step k of Gaussian elimination: exchanges row k with the pivot row, subtracts multiples of row k from the rows
/// below, and stores the multipliers, a column of L, below the diagonal.
///
/// Returns the pivot row: the row from k on with the largest element in column k. If all are zero, the solution is
/// not finite, which `solve` of `mod.rs` reports.
fn eliminate(a: &mut ViewMut<'_>, k: usize) -> usize {
    // The sum is within a factor √2 of the modulus, which suffices to choose a pivot, and takes no square root.
    let magnitude = |row: usize| a.re[(row, k)].abs() + a.im[(row, k)].abs();
    let mut pivot = k;
    for row in k + 1..a.re.nrows() {
        if magnitude(row) > magnitude(pivot) {
            pivot = row;
        }
    }
    for plane in [&mut a.re, &mut a.im] {
        for mut column in plane.columns_mut() {
            column.swap(k, pivot);
        }
    }
    let (mut left, mut right) = a.reborrow().split_at(Axis(1), k + 1);
    let column = left.column(k);
    let inverse = column.at(k).inv();
    let (_, mut multipliers) = column.split_at(Axis(0), k + 1);
    multipliers.scale(inverse);
    for j in 0..right.re.ncols() {
        let column = right.column(j);
        let in_pivot_row = column.at(k);
        column.split_at(Axis(0), k + 1).1.subtract(in_pivot_row, &multipliers);
    }
    pivot
}

/// Exchanges row k of every column with row `pivots[k]`, for k from 0 on.
fn exchange(rows: &mut ViewMut<'_>, pivots: &[usize]) {
    for plane in [&mut rows.re, &mut rows.im] {
        for mut column in plane.columns_mut() {
            for (row, &pivot) in pivots.iter().enumerate() {
                column.swap(row, pivot);
            }
        }
    }
}

/// Solves `L·x = right` in place, with L (unit diagonal) below the diagonal of the square matrix `l`.
fn solve_lower(l: &View<'_>, right: ViewMut<'_>) {
    let n = right.re.nrows();
    if n <= BLOCK {
        return substitute(l, right, |columns, x| {
            for k in 0..n {
                let from = x[k];
                for i in k + 1..n {
                    x[i] -= columns[k][i] * from;
                }
            }
        });
    }
    let half = n / 2;
    let [[corner, _], [below, rest]] = l.quadrants(half);
    let (mut upper, mut lower) = right.split_at(Axis(0), half);
    solve_lower(&corner, upper.reborrow());
    lower.add_product(-1.0, &below, &upper.view());
    solve_lower(&rest, lower);
}

/// Solves `U·x = right` in place, with U on and above the diagonal of the square matrix `u`.
fn solve_upper(u: &View<'_>, right: ViewMut<'_>) {
    let n = right.re.nrows();
    if n <= BLOCK {
        return substitute(u, right, |columns, x| {
            for k in (0..n).rev() {
                x[k] /= columns[k][k];
                let from = x[k];
                for i in 0..k {
                    x[i] -= columns[k][i] * from;
                }
            }
        });
    }
    let half = n / 2;
    let [[corner, beside], [_, rest]] = u.quadrants(half);
    let (mut upper, mut lower) = right.split_at(Axis(0), half);
    solve_upper(&rest, lower.reborrow());
    upper.add_product(-1.0, &beside, &lower.view());
    solve_upper(&corner, upper);
}

/// Solves a triangular system of at most [`BLOCK`] rows in place. `solve_column(columns, x)` gets the triangle,
/// `columns[column][row]`, and replaces one column x of `right` by its solution.
fn substitute(
    triangle: &View<'_>,
    mut right: ViewMut<'_>,
    mut solve_column: impl FnMut(&[BlockColumn], &mut [Complex64]),
) {
    let n = right.re.nrows();
    let mut columns = [[Complex64::ZERO; BLOCK]; BLOCK];
    for (j, column) in columns[..n].iter_mut().enumerate() {
        for (i, element) in column[..n].iter_mut().enumerate() {
            *element = triangle.at(i, j);
        }
    }
    for j in 0..right.re.ncols() {
        let mut column = right.column(j);
        let mut x: BlockColumn = array::from_fn(|i| if i < n { column.at(i) } else { Complex64::ZERO });
        solve_column(&columns[..n], &mut x[..n]);
        for (i, &value) in x[..n].iter().enumerate() {
            column.set(i, value);
        }
    }
}
