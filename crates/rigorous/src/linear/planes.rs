//! Complex matrices and columns as separate real and imaginary parts, because ndarray has fast products for real
//! matrices only.

use super::Matrix;
use ndarray::{Array2, ArrayView2, ArrayViewMut, Axis, Dimension, Ix1, Ix2, ShapeBuilder, Zip};
use num_complex::Complex64;

/// Real and imaginary part of a complex array: two real arrays of the same shape.
pub(super) struct Planes<A> {
    pub(super) re: A,
    pub(super) im: A,
}

/// Read-only view of a matrix.
pub(super) type View<'a> = Planes<ArrayView2<'a, f64>>;
/// Writable view of a matrix, or of a column for `D = Ix1`.
pub(super) type ViewMut<'a, D = Ix2> = Planes<ArrayViewMut<'a, f64, D>>;

impl Planes<Array2<f64>> {
    /// The zero matrix, in column-major order.
    pub(super) fn zeros(rows: usize, columns: usize) -> Self {
        Self { re: Array2::zeros((rows, columns).f()), im: Array2::zeros((rows, columns).f()) }
    }

    /// The parts of `matrix`.
    pub(super) fn of(matrix: &Matrix) -> Self {
        Self { re: matrix.map(|value| value.re), im: matrix.map(|value| value.im) }
    }

    /// The complex matrix with these parts.
    pub(super) fn joined(&self) -> Matrix {
        Zip::from(&self.re).and(&self.im).map_collect(|&re, &im| Complex64::new(re, im))
    }

    /// Read-only view of all elements.
    pub(super) fn view(&self) -> View<'_> {
        Planes { re: self.re.view(), im: self.im.view() }
    }

    /// Writable view of all elements.
    pub(super) fn view_mut(&mut self) -> ViewMut<'_> {
        Planes { re: self.re.view_mut(), im: self.im.view_mut() }
    }
}

impl<'a> View<'a> {
    /// Element of row i and column j.
    pub(super) fn at(&self, i: usize, j: usize) -> Complex64 {
        Complex64::new(self.re[(i, j)], self.im[(i, j)])
    }

    /// Quadrants `[[upper left, upper right], [lower left, lower right]]`. The lower right quadrant begins at row
    /// `index` and column `index`.
    pub(super) fn quadrants(&self, index: usize) -> [[Self; 2]; 2] {
        let halves = |view: Self, axis: Axis| {
            let (re_before, re_from) = view.re.split_at(axis, index);
            let (im_before, im_from) = view.im.split_at(axis, index);
            [Self { re: re_before, im: im_before }, Self { re: re_from, im: im_from }]
        };
        let (rows, columns) = (Axis(0), Axis(1));
        halves(Self { re: self.re, im: self.im }, rows).map(|half| halves(half, columns))
    }
}

impl<D: Dimension> ViewMut<'_, D> {
    /// A view of the same elements with a shorter lifetime. `self` may be used again when that view is dropped.
    pub(super) fn reborrow(&mut self) -> ViewMut<'_, D> {
        Planes { re: self.re.view_mut(), im: self.im.view_mut() }
    }

    /// The views before `index` along an axis, and from `index` on.
    pub(super) fn split_at(self, axis: Axis, index: usize) -> (Self, Self) {
        let ((re, re_rest), (im, im_rest)) = (self.re.split_at(axis, index), self.im.split_at(axis, index));
        (Planes { re, im }, Planes { re: re_rest, im: im_rest })
    }
}

impl ViewMut<'_> {
    /// Read-only view of the same elements.
    pub(super) fn view(&self) -> View<'_> {
        Planes { re: self.re.view(), im: self.im.view() }
    }

    /// Column j.
    pub(super) fn column(&mut self, j: usize) -> ViewMut<'_, Ix1> {
        Planes { re: self.re.column_mut(j), im: self.im.column_mut(j) }
    }

    /// Adds `factor·a·b`, with three real products instead of four (Gauss):
    /// `Im(a·b) = (Re a + Im a)(Re b + Im b) − Re a·Re b − Im a·Im b`.
    pub(super) fn add_product(&mut self, factor: f64, a: &View<'_>, b: &View<'_>) {
        let (re_re, im_im) = (a.re.dot(&b.re), a.im.dot(&b.im));
        let of_sums = (&a.re + &a.im).dot(&(&b.re + &b.im));
        Zip::from(&mut self.re).and(&re_re).and(&im_im).for_each(|into, re_re, im_im| {
            *into += factor * (re_re - im_im);
        });
        Zip::from(&mut self.im).and(&of_sums).and(&re_re).and(&im_im).for_each(|into, of_sums, re_re, im_im| {
            *into += factor * (of_sums - re_re - im_im);
        });
    }
}

impl ViewMut<'_, Ix1> {
    /// Element i.
    pub(super) fn at(&self, i: usize) -> Complex64 {
        Complex64::new(self.re[i], self.im[i])
    }

    /// Overwrites element i.
    pub(super) fn set(&mut self, i: usize, value: Complex64) {
        (self.re[i], self.im[i]) = (value.re, value.im);
    }

    /// Multiplies all elements by `factor`.
    pub(super) fn scale(&mut self, factor: Complex64) {
        Zip::from(&mut self.re).and(&mut self.im).for_each(|re, im| {
            (*re, *im) = (*re * factor.re - *im * factor.im, *re * factor.im + *im * factor.re);
        });
    }

    /// Subtracts `factor·column`.
    pub(super) fn subtract(&mut self, factor: Complex64, column: &Self) {
        Zip::from(&mut self.re).and(&mut self.im).and(&column.re).and(&column.im).for_each(|re, im, &x, &y| {
            *re -= x * factor.re - y * factor.im;
            *im -= x * factor.im + y * factor.re;
        });
    }
}
