//! Complex matrices and columns as separate real and imaginary parts: ndarray has fast products for real matrices only.

use super::Matrix;
use ndarray::{Array2, ArrayView2, ArrayViewMut, Axis, Dimension, Ix1, Ix2, ShapeBuilder, Zip};
use num_complex::Complex64;

/// Real and imaginary parts of one shape, in column-major order.
pub(super) struct Planes<A> {
    pub(super) re: A,
    pub(super) im: A,
}

/// Read-only matrix.
pub(super) type View<'a> = Planes<ArrayView2<'a, f64>>;
/// Writable matrix, or column for `D = Ix1`.
pub(super) type ViewMut<'a, D = Ix2> = Planes<ArrayViewMut<'a, f64, D>>;

impl Planes<Array2<f64>> {
    /// The zero matrix.
    pub(super) fn zeros(rows: usize, columns: usize) -> Self {
        Self { re: Array2::zeros((rows, columns).f()), im: Array2::zeros((rows, columns).f()) }
    }

    /// Separates the parts of `matrix`.
    pub(super) fn of(matrix: &Matrix) -> Self {
        Self { re: matrix.map(|value| value.re), im: matrix.map(|value| value.im) }
    }

    /// The complex matrix of both parts.
    pub(super) fn joined(&self) -> Matrix {
        Zip::from(&self.re).and(&self.im).map_collect(|&re, &im| Complex64::new(re, im))
    }

    pub(super) fn view(&self) -> View<'_> {
        Planes { re: self.re.view(), im: self.im.view() }
    }

    pub(super) fn view_mut(&mut self) -> ViewMut<'_> {
        Planes { re: self.re.view_mut(), im: self.im.view_mut() }
    }
}

impl<'a> View<'a> {
    /// Element of row i and column j.
    pub(super) fn at(&self, i: usize, j: usize) -> Complex64 {
        Complex64::new(self.re[(i, j)], self.im[(i, j)])
    }

    /// Quadrants about row and column `at`: `[[upper left, upper right], [lower left, lower right]]`.
    pub(super) fn quadrants(&self, at: usize) -> [[Self; 2]; 2] {
        let cut = |plane: ArrayView2<'a, f64>| {
            let (above, below) = plane.split_at(Axis(0), at);
            [above, below].map(|half| <[_; 2]>::from(half.split_at(Axis(1), at)))
        };
        let ([[a, b], [c, d]], [[e, f], [g, h]]) = (cut(self.re), cut(self.im));
        [[Self { re: a, im: e }, Self { re: b, im: f }], [Self { re: c, im: g }, Self { re: d, im: h }]]
    }
}

impl<D: Dimension> ViewMut<'_, D> {
    /// A view with a shorter lifetime, after which this one may be used again.
    pub(super) fn reborrow(&mut self) -> ViewMut<'_, D> {
        Planes { re: self.re.view_mut(), im: self.im.view_mut() }
    }

    /// The parts before and from `index` on along an axis.
    pub(super) fn split_at(self, axis: Axis, index: usize) -> (Self, Self) {
        let ((re, re_rest), (im, im_rest)) = (self.re.split_at(axis, index), self.im.split_at(axis, index));
        (Planes { re, im }, Planes { re: re_rest, im: im_rest })
    }
}

impl ViewMut<'_> {
    pub(super) fn view(&self) -> View<'_> {
        Planes { re: self.re.view(), im: self.im.view() }
    }

    pub(super) fn column(&mut self, j: usize) -> ViewMut<'_, Ix1> {
        Planes { re: self.re.column_mut(j), im: self.im.column_mut(j) }
    }

    /// Adds `factor·a·b`, with three real products instead of four (Gauss): Im(a·b) is the product of the sums
    /// Re + Im, minus both other products.
    pub(super) fn add_product(&mut self, factor: f64, a: &View<'_>, b: &View<'_>) {
        let (re, im) = (a.re.dot(&b.re), a.im.dot(&b.im));
        let all = (&a.re + &a.im).dot(&(&b.re + &b.im));
        Zip::from(&mut self.re).and(&re).and(&im).for_each(|into, re, im| *into += factor * (re - im));
        Zip::from(&mut self.im)
            .and(&all)
            .and(&re)
            .and(&im)
            .for_each(|into, all, re, im| *into += factor * (all - re - im));
    }
}

impl ViewMut<'_, Ix1> {
    pub(super) fn at(&self, i: usize) -> Complex64 {
        Complex64::new(self.re[i], self.im[i])
    }

    pub(super) fn set(&mut self, i: usize, value: Complex64) {
        (self.re[i], self.im[i]) = (value.re, value.im);
    }

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
