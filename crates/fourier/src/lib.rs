//! Discrete Fourier transforms in two dimensions, of any size, on all cores.
//!
//! ```
//! use sunbeam_fourier::num_complex::Complex64;
//! use sunbeam_fourier::{Direction, Fft2};
//!
//! // One wave of two cycles along x, on 3 rows of 8 samples.
//! let mut data: Vec<_> =
//!     (0..24).map(|i| Complex64::cis(std::f64::consts::TAU * 2.0 * (i % 8) as f64 / 8.0)).collect();
//! Fft2::new(8, 3, Direction::Negative).process(&mut data, &mut Vec::new());
//! // All of it lies in bin (jy, jx) = (0, 2).
//! assert!((data[2] - 24.0).norm() < 1e-12);
//! ```
//!
//! The crate saves compile time: rustfft is generic, and every crate that plans a transform compiles it anew. Here it
//! is compiled once in each precision, behind `dyn Fft`.

use rayon::prelude::*;
pub use rustfft::num_complex;
use rustfft::num_complex::Complex;
use rustfft::{Fft, FftNum, FftPlanner};
use std::sync::Arc;

/// Floating-point type of a transform: `f32` or `f64`.
pub trait Precision: FftNum {
    /// Plans one-dimensional transforms of both `lengths` (in points).
    #[doc(hidden)]
    fn plans(lengths: [usize; 2], direction: Direction) -> [Arc<dyn Fft<Self>>; 2];
}

impl Precision for f32 {
    fn plans(lengths: [usize; 2], direction: Direction) -> [Arc<dyn Fft<f32>>; 2] {
        plan_each(lengths, direction)
    }
}

impl Precision for f64 {
    fn plans(lengths: [usize; 2], direction: Direction) -> [Arc<dyn Fft<f64>>; 2] {
        plan_each(lengths, direction)
    }
}

/// Plans one-dimensional transforms of both `lengths` (in points): the body of [`Precision::plans`].
fn plan_each<T: FftNum>(lengths: [usize; 2], direction: Direction) -> [Arc<dyn Fft<T>>; 2] {
    let mut planner = FftPlanner::new();
    lengths.map(|length| match direction {
        Direction::Positive => planner.plan_fft_inverse(length),
        Direction::Negative => planner.plan_fft_forward(length),
    })
}

/// Sign of the exponent of a transform of `n` points, from `x[j]` to bin `k`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Direction {
    /// `Σ_j x[j] · exp(+2πi jk/n)`, the sign of docs/model.md#conventions.
    Positive,
    /// `Σ_j x[j] · exp(−2πi jk/n)`.
    Negative,
}

/// A planned two-dimensional discrete Fourier transform (DFT) of `ny` rows by `nx` columns, unnormalised.
///
/// Bins are in FFT order along each axis: frequency 0, then the positive, then the negative frequencies in ascending
/// order. The frequency n/2 of an even n counts as positive. Rows and columns are distributed over the current rayon
/// thread pool.
pub struct Fft2<T: Precision> {
    /// Length of a row.
    nx: usize,
    /// Number of rows.
    ny: usize,
    /// Transform of one row, of nx points.
    along_x: Arc<dyn Fft<T>>,
    /// Transform of one column, of ny points.
    along_y: Arc<dyn Fft<T>>,
}

impl<T: Precision> Fft2<T> {
    /// Plans a transform of `nx` by `ny` points, at least one each. Every size is allowed, primes included.
    pub fn new(nx: usize, ny: usize, direction: Direction) -> Self {
        let [along_x, along_y] = T::plans([nx, ny], direction);
        Self { nx, ny, along_x, along_y }
    }

    /// Transforms `data` (row-major, length `nx · ny`) in place; `scratch` is resized as needed and may be reused. Data
    /// of another length panic or give meaningless results.
    pub fn process(&self, data: &mut [Complex<T>], scratch: &mut Vec<Complex<T>>) {
        debug_assert_eq!(data.len(), self.nx * self.ny);
        transform_rows(&*self.along_x, data, self.nx);
        if self.ny > 1 {
            scratch.resize(data.len(), Complex::new(T::zero(), T::zero()));
            transpose(data, scratch, self.nx, self.ny);
            transform_rows(&*self.along_y, scratch, self.ny);
            transpose(scratch, data, self.ny, self.nx);
        }
    }

    /// The low-frequency bins of a zero-padded transform: the `kx` by `ky` bins nearest to frequency zero.
    ///
    /// The bins equal those of [`Fft2::process`]; bins outside of this band are not computed.
    ///
    /// - `data` holds the first rows, whole and each `nx` long; missing rows up to `ny` are zero. It is overwritten
    ///   with scratch values.
    /// - `kx` is 1 to `nx`, and `ky` is 1 to `ny`. An even size `k` keeps the frequency `+k/2` and drops `−k/2`.
    ///
    /// The result has `ky` rows of `kx` bins, in the FFT order of a transform of that size.
    pub fn band(&self, data: &mut [Complex<T>], (kx, ky): (usize, usize)) -> Vec<Complex<T>> {
        let zero = Complex::new(T::zero(), T::zero());
        debug_assert!(data.len() <= self.nx * self.ny && kx <= self.nx && ky <= self.ny);
        transform_rows(&*self.along_x, data, self.nx);
        // Column-major: the kept columns, one after the other.
        let mut columns = vec![zero; kx * self.ny];
        columns.par_chunks_mut(self.ny * LINES_PER_TASK).enumerate().for_each(|(task, block)| {
            // The block has the columns of this task: `LINES_PER_TASK`, or fewer at the end.
            for (i, column) in block.chunks_mut(self.ny).enumerate() {
                let bin = kept_bin(task * LINES_PER_TASK + i, kx, self.nx);
                for (to, row) in column.iter_mut().zip(data.chunks(self.nx)) {
                    *to = row[bin];
                }
            }
            if self.ny > 1 {
                self.along_y.process(block);
            }
        });
        let mut bins = vec![zero; kx * ky];
        bins.par_chunks_mut(kx).enumerate().for_each(|(iy, row)| {
            let bin = kept_bin(iy, ky, self.ny);
            for (to, column) in row.iter_mut().zip(columns.chunks(self.ny)) {
                *to = column[bin];
            }
        });
        bins
    }
}

/// Number of rows or columns that one rayon task transforms, and side of a tile of [`transpose`] in elements. 16
/// complex numbers in double precision fill four cache lines of 64 bytes, and each of two tiles takes 4 KiB. With
/// larger values fewer cache lines are shared by two tiles; smaller ones balance threads better.
const LINES_PER_TASK: usize = 16;

/// Bin of a transform of `n` points that becomes bin `i` among the `kept` bins nearest to frequency zero (both in FFT
/// order).
fn kept_bin(i: usize, kept: usize, n: usize) -> usize {
    // Negative frequencies, in the upper half, keep their distance from the end.
    if 2 * i > kept { i + n - kept } else { i }
}

/// Transforms every row of `data`, each `width` long.
fn transform_rows<T: Precision>(fft: &dyn Fft<T>, data: &mut [Complex<T>], width: usize) {
    data.par_chunks_mut(width * LINES_PER_TASK).for_each(|chunk| fft.process(chunk));
}

/// Writes the transpose of `from` (`height` rows of `width`) into `to`, in square tiles that fit the processor's cache.
fn transpose<T: Copy + Send + Sync>(from: &[T], to: &mut [T], width: usize, height: usize) {
    to.par_chunks_mut(height * LINES_PER_TASK).enumerate().for_each(|(task, to_rows)| {
        // The task's rows of `to` are the columns of `from` from x0 on.
        let x0 = task * LINES_PER_TASK;
        for y0 in (0..height).step_by(LINES_PER_TASK) {
            for (dx, row) in to_rows.chunks_mut(height).enumerate() {
                for y in y0..(y0 + LINES_PER_TASK).min(height) {
                    row[y] = from[y * width + x0 + dx];
                }
            }
        }
    });
}

/// Smallest transform length of at least `minimum` whose prime factors are 2, 3 and 5, for which transforms are fast.
///
/// Returns `minimum` itself where no such length fits into a `usize`.
///
/// ```
/// assert_eq!(sunbeam_fourier::next_fast_len(1021), 1024);
/// assert_eq!(sunbeam_fourier::next_fast_len(241), 243);
/// ```
pub fn next_fast_len(minimum: usize) -> usize {
    // The numbers `start·factorⁿ`, n from 0 on, up to the first that reaches the minimum.
    let powers = |start: usize, factor: usize| {
        std::iter::successors(Some(start), move |power| if *power < minimum { power.checked_mul(factor) } else { None })
    };
    powers(1, 5)
        .flat_map(|five| powers(five, 3))
        // Each `3ᵃ·5ᵇ` times the least power of two that reaches the minimum.
        .filter_map(|odd| minimum.div_ceil(odd).checked_next_power_of_two()?.checked_mul(odd))
        .min()
        .unwrap_or(minimum)
}
