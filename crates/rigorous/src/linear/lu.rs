//! LU decomposition with row exchanges, by halves of the columns, so that nearly all of it is products: Toledo, SIAM J. Matrix
//! Anal. Appl. 18 (1997).

use super::planes::{View, ViewMut};
use ndarray::Axis;
use num_complex::Complex64;
use std::array;

/// So many columns, or rows of a triangle, are not halved.
const FEW: usize = 16;

/// A column of so many rows, or fewer.
type Few = [Complex64; FEW];

/// Puts L, of which the diagonal is one, and U in the place of a matrix with no more columns than rows. Gives the row that each of
/// the first ones was exchanged with, one after the other.
pub(super) fn factor(mut a: ViewMut<'_>) -> Vec<usize> {
    let columns = a.re.ncols();
    if columns <= FEW {
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
    let others = factor(rest);
    exchange(&mut below, &others);
    pivots.extend(others.iter().map(|row| half + row));
    pivots
}

/// Solves for the columns of `right`, in place.
pub(super) fn solve(factors: &View<'_>, pivots: &[usize], mut right: ViewMut<'_>) {
    exchange(&mut right, pivots);
    solve_lower(factors, right.reborrow());
    solve_upper(factors, right);
}

/// Exchanges row k with the one below that has the largest element in column k, and takes multiples of it from the rows below.
/// Gives the other row.
fn eliminate(a: &mut ViewMut<'_>, k: usize) -> usize {
    let size = |row: usize| a.re[(row, k)].abs() + a.im[(row, k)].abs();
    let mut pivot = k;
    for row in k + 1..a.re.nrows() {
        if size(row) > size(pivot) {
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
    let (_, mut multiples) = column.split_at(Axis(0), k + 1);
    multiples.scale(inverse);
    for j in 0..right.re.ncols() {
        let column = right.column(j);
        let factor = column.at(k);
        column.split_at(Axis(0), k + 1).1.subtract(factor, &multiples);
    }
    pivot
}

/// Exchanges each row with the one that is given for it, one after the other.
fn exchange(rows: &mut ViewMut<'_>, pivots: &[usize]) {
    for plane in [&mut rows.re, &mut rows.im] {
        for mut column in plane.columns_mut() {
            for (row, &pivot) in pivots.iter().enumerate() {
                column.swap(row, pivot);
            }
        }
    }
}

/// Solves `L·x = right` in place, with L below the diagonal of `l`.
fn solve_lower(l: &View<'_>, right: ViewMut<'_>) {
    let n = right.re.nrows();
    if n <= FEW {
        return substitute(l, right, |l, x| {
            for k in 0..n {
                let from = x[k];
                for i in k + 1..n {
                    x[i] -= l[k][i] * from;
                }
            }
        });
    }
    let half = n / 2;
    let [[above, _], [beside, below]] = l.quarters(half);
    let (mut upper, mut lower) = right.split_at(Axis(0), half);
    solve_lower(&above, upper.reborrow());
    lower.add_product(-1.0, &beside, &upper.view());
    solve_lower(&below, lower);
}

/// Solves `U·x = right` in place, with U on and above the diagonal of `u`.
fn solve_upper(u: &View<'_>, right: ViewMut<'_>) {
    let n = right.re.nrows();
    if n <= FEW {
        return substitute(u, right, |u, x| {
            for k in (0..n).rev() {
                x[k] /= u[k][k];
                let from = x[k];
                for i in 0..k {
                    x[i] -= u[k][i] * from;
                }
            }
        });
    }
    let half = n / 2;
    let [[above, beside], [_, below]] = u.quarters(half);
    let (mut upper, mut lower) = right.split_at(Axis(0), half);
    solve_upper(&below, lower.reborrow());
    upper.add_product(-1.0, &beside, &lower.view());
    solve_upper(&above, upper);
}

/// Solves a few rows by substitution, which a function does with the columns of the triangle and one of `right`.
fn substitute(triangle: &View<'_>, mut right: ViewMut<'_>, mut solve: impl FnMut(&[Few], &mut [Complex64])) {
    let n = right.re.nrows();
    let mut columns = [[Complex64::ZERO; FEW]; FEW];
    for (j, column) in columns[..n].iter_mut().enumerate() {
        for (i, element) in column[..n].iter_mut().enumerate() {
            *element = triangle.at(i, j);
        }
    }
    for j in 0..right.re.ncols() {
        let mut column = right.column(j);
        let mut x: Few = array::from_fn(|i| if i < n { column.at(i) } else { Complex64::ZERO });
        solve(&columns[..n], &mut x[..n]);
        for (i, &value) in x[..n].iter().enumerate() {
            column.set(i, value);
        }
    }
}
