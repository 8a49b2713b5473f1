//! Transforms against the sums that they stand for.

use sunbeam_fourier::num_complex::Complex;
use sunbeam_fourier::{Direction, Fft2};

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
