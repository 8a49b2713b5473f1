//! Transforms against their defining sums, and fast lengths against a search.

use sunbeam_fourier::num_complex::Complex;
use sunbeam_fourier::{Direction, Fft2, next_fast_len};

/// Deterministic test data without symmetry.
fn samples(count: usize) -> Vec<Complex<f64>> {
    (0..count).map(|i| Complex::new((i as f64 * 0.7).sin(), (i as f64 * 1.3).cos())).collect()
}

#[test]
fn band_equals_the_full_transform_at_its_bins() {
    for ((nx, ny), filled, (kx, ky)) in [((12, 10), 10, (12, 10)), ((12, 10), 4, (5, 6)), ((9, 1), 1, (4, 1))] {
        let given = samples(nx * filled);
        let fft = Fft2::new(nx, ny, Direction::Negative);
        let mut whole = given.clone();
        whole.resize(nx * ny, Complex::new(0.0, 0.0));
        fft.process(&mut whole, &mut Vec::new());
        let band = fft.band(&mut given.clone(), (kx, ky));
        for y in 0..ky as i64 {
            for x in 0..kx as i64 {
                // Signed frequency of a bin of the band, and its bin in the full transform.
                let signed = |i: i64, kept: usize| if 2 * i > kept as i64 { i - kept as i64 } else { i };
                let bin = |i: i64, kept, n: usize| signed(i, kept).rem_euclid(n as i64) as usize;
                let expected = whole[bin(y, ky, ny) * nx + bin(x, kx, nx)];
                // Rounding of equal sums in another order.
                assert!((band[y as usize * kx + x as usize] - expected).norm() < 1e-12, "{nx}x{ny}: {x},{y}");
            }
        }
    }
}

#[test]
fn transform_equals_its_defining_sum_at_awkward_sizes() {
    for (nx, ny) in [(1, 1), (7, 1), (1, 13), (17, 31), (40, 12)] {
        let input = samples(nx * ny);
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

#[test]
fn fast_lengths_are_the_smallest() {
    let is_fast = |mut n: usize| {
        for prime in [2, 3, 5] {
            while n.is_multiple_of(prime) {
                n /= prime;
            }
        }
        n == 1
    };
    for minimum in (0..3000).chain([16_385, 65_537, 1_000_001]) {
        let expected = (minimum.max(1)..).find(|&n| is_fast(n)).unwrap();
        assert_eq!(next_fast_len(minimum), expected, "{minimum}");
    }
}

#[test]
fn fast_lengths_of_huge_sizes_are_found_at_once() {
    // The next one after 10¹² is 0.4 % above it; a search would take 10⁹ steps.
    assert_eq!(next_fast_len(1_000_000_000_001), 1_004_193_907_488);
    assert_eq!(next_fast_len(usize::MAX), usize::MAX);
}
