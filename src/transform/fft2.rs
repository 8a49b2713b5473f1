use rayon::prelude::*;
use rustfft::num_complex::Complex;
use rustfft::{Fft, FftNum, FftPlanner};
use std::sync::Arc;

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
pub struct Fft2<T: FftNum> {
    nx: usize,
    ny: usize,
    along_x: Arc<dyn Fft<T>>,
    along_y: Arc<dyn Fft<T>>,
}

impl<T: FftNum> Fft2<T> {
    /// Plans a transform of `nx` by `ny` points (any sizes, primes included).
    pub fn new(nx: usize, ny: usize, direction: Direction) -> Self {
        let mut planner = FftPlanner::new();
        let mut plan = |n| match direction {
            Direction::Positive => planner.plan_fft_inverse(n),
            Direction::Negative => planner.plan_fft_forward(n),
        };
        Self { nx, ny, along_x: plan(nx), along_y: plan(ny) }
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

fn rows<T: FftNum>(fft: &dyn Fft<T>, data: &mut [Complex<T>], width: usize) {
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_band_has_the_bins_of_the_whole() {
        for ((nx, ny), filled, (kx, ky)) in [((12, 10), 10, (12, 10)), ((12, 10), 4, (5, 6)), ((9, 1), 1, (4, 1))] {
            let value = |i: usize| Complex::new((i as f64 * 0.7).sin(), (i as f64 * 1.3).cos());
            let given: Vec<_> = (0..nx * filled).map(value).collect();
            let fft = Fft2::new(nx, ny, Direction::Negative);
            let mut whole = given.clone();
            whole.resize(nx * ny, Complex::new(0.0, 0.0));
            fft.process(&mut whole, &mut Vec::new());
            let band = fft.band(&mut given.clone(), (kx, ky));
            for y in 0..ky as i64 {
                for x in 0..kx as i64 {
                    // The frequency of a place of the band, and its bin in the whole.
                    let signed = |i: i64, kept: usize| if 2 * i > kept as i64 { i - kept as i64 } else { i };
                    let bin = |i: i64, kept, n: usize| signed(i, kept).rem_euclid(n as i64) as usize;
                    let expected = whole[bin(y, ky, ny) * nx + bin(x, kx, nx)];
                    // The same sums, but for their roundings.
                    assert!((band[y as usize * kx + x as usize] - expected).norm() < 1e-12, "{nx}x{ny}: {x},{y}");
                }
            }
        }
    }

    #[test]
    fn agrees_with_the_definition_on_awkward_sizes() {
        for (nx, ny) in [(1, 1), (7, 1), (1, 13), (17, 31), (40, 12)] {
            let value = |i: usize| Complex::new((i as f64 * 0.7).sin(), (i as f64 * 1.3).cos());
            let input: Vec<_> = (0..nx * ny).map(value).collect();
            let mut output = input.clone();
            Fft2::new(nx, ny, Direction::Positive).process(&mut output, &mut Vec::new());
            for (jy, jx) in [(0, 0), (ny / 2, nx / 3), (ny - 1, nx - 1)] {
                let mut sum = Complex::new(0.0, 0.0);
                for iy in 0..ny {
                    for ix in 0..nx {
                        let turns = (jx * ix) as f64 / nx as f64 + (jy * iy) as f64 / ny as f64;
                        sum += input[iy * nx + ix] * Complex::cis(std::f64::consts::TAU * turns);
                    }
                }
                // Rounding of a sum of at most 527 terms of size one.
                assert!((sum - output[jy * nx + jx]).norm() < 1e-10, "{nx}x{ny} bin {jx},{jy}");
            }
        }
    }
}
