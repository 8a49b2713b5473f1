//! Discrete Fourier transforms in two dimensions, of any size, on all cores.
//!
//! rustfft is generic: whoever plans a transform compiles all of it. Here it is planned for the two precisions that there are,
//! so that it is compiled with this crate alone, and not with every package and test that uses it.

use rayon::prelude::*;
pub use rustfft::num_complex;
use rustfft::num_complex::Complex;
use rustfft::{Fft, FftNum, FftPlanner};
use std::sync::Arc;

/// A precision that transforms are made in: `f32` or `f64`.
pub trait Precision: FftNum {
    /// Plans transforms of these lengths in points.
    #[doc(hidden)]
    fn plans(lengths: [usize; 2], direction: Direction) -> [Arc<dyn Fft<Self>>; 2];
}

impl Precision for f32 {
    fn plans(lengths: [usize; 2], direction: Direction) -> [Arc<dyn Fft<f32>>; 2] {
        plans(lengths, direction)
    }
}

impl Precision for f64 {
    fn plans(lengths: [usize; 2], direction: Direction) -> [Arc<dyn Fft<f64>>; 2] {
        plans(lengths, direction)
    }
}

fn plans<T: FftNum>(lengths: [usize; 2], direction: Direction) -> [Arc<dyn Fft<T>>; 2] {
    let mut planner = FftPlanner::new();
    lengths.map(|length| match direction {
        Direction::Positive => planner.plan_fft_inverse(length),
        Direction::Negative => planner.plan_fft_forward(length),
    })
}

/// Sign of the exponent of a transform.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Direction {
    /// `Σ x · exp(+2πi jk/n)`, the sign of docs/model.md#conventions.
    Positive,
    /// `Σ x · exp(−2πi jk/n)`.
    Negative,
}

/// A planned two-dimensional DFT of `ny` rows by `nx` columns, unnormalised, bins in FFT order. Its rows are shared
/// out over the rayon pool.
pub struct Fft2<T: Precision> {
    nx: usize,
    ny: usize,
    along_x: Arc<dyn Fft<T>>,
    along_y: Arc<dyn Fft<T>>,
}

impl<T: Precision> Fft2<T> {
    /// Plans a transform of `nx` by `ny` points (any sizes, primes included).
    pub fn new(nx: usize, ny: usize, direction: Direction) -> Self {
        let [along_x, along_y] = T::plans([nx, ny], direction);
        Self { nx, ny, along_x, along_y }
    }

    /// Transforms `data` (row-major, `nx·ny` long) in place; `scratch` is resized as needed and may be reused.
    pub fn process(&self, data: &mut [Complex<T>], scratch: &mut Vec<Complex<T>>) {
        debug_assert_eq!(data.len(), self.nx * self.ny);
        rows(&*self.along_x, data, self.nx);
        if self.ny > 1 {
            scratch.resize(data.len(), Complex::new(T::zero(), T::zero()));
            transpose(data, scratch, self.nx, self.ny);
            rows(&*self.along_y, scratch, self.ny);
            transpose(scratch, data, self.ny, self.nx);
        }
    }

    /// As [`Fft2::process`], of `data` whose rows beyond those given are zero and of which the bins nearest to frequency zero are
    /// asked for alone, `kept` along x and y: row-major, in the FFT order of so many bins. What is not asked for is not computed.
    /// `data` is worked in.
    pub fn band(&self, data: &mut [Complex<T>], kept: (usize, usize)) -> Vec<Complex<T>> {
        let zero = Complex::new(T::zero(), T::zero());
        let (kx, ky) = kept;
        debug_assert!(data.len() <= self.nx * self.ny && kx <= self.nx && ky <= self.ny);
        rows(&*self.along_x, data, self.nx);
        // One column after the other.
        let mut columns = vec![zero; kx * self.ny];
        columns.par_chunks_mut(self.ny * COLUMNS_PER_TASK).enumerate().for_each(|(task, columns)| {
            for (i, column) in columns.chunks_mut(self.ny).enumerate() {
                let bin = bin_of(task * COLUMNS_PER_TASK + i, kx, self.nx);
                for (to, row) in column.iter_mut().zip(data.chunks(self.nx)) {
                    *to = row[bin];
                }
            }
            if self.ny > 1 {
                self.along_y.process(columns);
            }
        });
        let mut bins = vec![zero; kx * ky];
        bins.par_chunks_mut(kx).enumerate().for_each(|(iy, row)| {
            let bin = bin_of(iy, ky, self.ny);
            for (to, column) in row.iter_mut().zip(columns.chunks(self.ny)) {
                *to = column[bin];
            }
        });
        bins
    }
}

/// Columns that a task gathers and transforms; rows of the data hold their bins next to each other.
const COLUMNS_PER_TASK: usize = 16;

/// The bin of `n`, in FFT order, that is the `i`th of the `kept` nearest to frequency zero.
fn bin_of(i: usize, kept: usize, n: usize) -> usize {
    if 2 * i > kept { i + n - kept } else { i }
}

fn rows<T: Precision>(fft: &dyn Fft<T>, data: &mut [Complex<T>], width: usize) {
    const ROWS_PER_TASK: usize = 32;
    data.par_chunks_mut(width * ROWS_PER_TASK).for_each(|chunk| fft.process(chunk));
}

/// Writes the transpose of `from` (rows of `width`, `height` of them) into `to`, in tiles that fit the cache.
fn transpose<T: Copy + Send + Sync>(from: &[T], to: &mut [T], width: usize, height: usize) {
    const TILE: usize = 16;
    to.par_chunks_mut(height * TILE).enumerate().for_each(|(block, out)| {
        let x0 = block * TILE;
        for y0 in (0..height).step_by(TILE) {
            for (dx, row) in out.chunks_mut(height).enumerate() {
                for y in y0..(y0 + TILE).min(height) {
                    row[y] = from[y * width + x0 + dx];
                }
            }
        }
    });
}
