//! Seeded random numbers and fields for procedural surfaces, identical to the bit on every machine.
//!
//! Only integer arithmetic, the four operations, square roots and `libm` are used, never the platform's mathematics
//! library.

use ndarray::Array2;
use rand::{Rng, SeedableRng};
use rand_pcg::Pcg64Mcg;
use rayon::prelude::*;
use std::f64::consts::TAU;

/// A seeded generator of uniform and normal numbers.
pub struct Random(Pcg64Mcg);

impl Random {
    /// A generator with this seed.
    pub fn new(seed: u64) -> Self {
        Self(Pcg64Mcg::seed_from_u64(seed))
    }

    /// Uniform in `[0, 1)`, a multiple of 2⁻⁵³.
    pub fn unit(&mut self) -> f64 {
        // The upper 53 of 64 random bits, the precision of f64.
        (self.0.next_u64() >> 11) as f64 / (1u64 << 53) as f64
    }

    /// Uniform in `[low, high)`, except that rounding may return `high`.
    pub fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit()
    }

    /// Approximately normal with mean 0 and standard deviation 1: a sum of 12 uniform numbers, each of variance 1/12,
    /// minus 6. Values lie within ±6.
    pub fn normal(&mut self) -> f64 {
        (0..12).map(|_| self.unit()).sum::<f64>() - 6.0
    }

    /// A smooth periodic field `[[iy, ix]]` of `nx × ny` pixels with mean 0 and root mean square 1. `nx` and `ny` must
    /// exceed `2·max_wave`, or waves alias. A single pixel is not normalised.
    ///
    /// The field is a sum of random waves of `kx` and `ky` periods over the tile along x and y. Their wave number
    /// `√(kx² + ky²)` is 1 to `max_wave`, which is at least 1. Amplitudes are normal numbers divided by the wave
    /// number, so long waves dominate.
    pub fn smooth_field(&mut self, nx: usize, ny: usize, max_wave: i32) -> Array2<f64> {
        /// Rows to which one wave is added before the next wave. Fewer rows read the tables of the waves more often;
        /// more rows do not stay in the processor's cache.
        const ROWS: usize = 8;
        // The phase of a wave at (ix, iy) is a phase along x plus one along y. An entry is the wave's amplitude, the
        // tables of sines and cosines of the phase along x, and those of the phase along y.
        let mut waves = Vec::new();
        for kx in -max_wave..=max_wave {
            for ky in 0..=max_wave {
                let square = kx * kx + ky * ky;
                // (kx, ky) and (−kx, −ky) are one wave, so ky is never negative, and for ky = 0 neither is kx.
                if square == 0 || square > max_wave * max_wave || (ky == 0 && kx < 0) {
                    continue;
                }
                let (amplitude, phase) = (self.normal() / f64::from(square).sqrt(), self.between(0.0, TAU));
                // Sines and cosines of the phase `2πk·i/n + shift` at all n pixels of an axis.
                let table = |k: i32, n: usize, shift: f64| -> (Vec<f64>, Vec<f64>) {
                    (0..n).map(|i| libm::sincos(TAU * f64::from(k) * i as f64 / n as f64 + shift)).unzip()
                };
                waves.push((amplitude, table(kx, nx, phase), table(ky, ny, 0.0)));
            }
        }
        let mut values = vec![0.0; nx * ny];
        values.par_chunks_mut(nx * ROWS).enumerate().for_each(|(chunk, rows)| {
            // Every pixel sums the waves in this order, on which the rounding of its last bit depends.
            for (amplitude, (sin_x, cos_x), (sin_y, cos_y)) in &waves {
                for (row, iy) in rows.chunks_exact_mut(nx).zip(chunk * ROWS..) {
                    let (sy, cy) = (sin_y[iy], cos_y[iy]);
                    for ((value, sx), cx) in row.iter_mut().zip(sin_x).zip(cos_x) {
                        // The sine of the sum of both phases.
                        *value += amplitude * (sx * cy + cx * sy);
                    }
                }
            }
        });
        let mut field = Array2::from_shape_fn((ny, nx), |(iy, ix)| values[iy * nx + ix]);
        normalise(&mut field);
        field
    }

    /// Periodic noise `[[iy, ix]]` of `nx × ny` pixels, with mean 0 and root mean square 1: independent uniform
    /// numbers, blurred `passes_x` times along x and `passes_y` times along y with the kernel (1 2 1)/4.
    pub fn blurred_noise(&mut self, nx: usize, ny: usize, passes_x: usize, passes_y: usize) -> Array2<f64> {
        let mut field = Array2::from_shape_simple_fn((ny, nx), || self.unit() - 0.5);
        let mut next = field.clone();
        for pass in 0..passes_x + passes_y {
            // Shift to the next pixel along the blurred axis.
            let (sx, sy) = if pass < passes_x { (1, 0) } else { (0, 1) };
            let wrap = |i: usize, n: usize| if i >= n { i - n } else { i };
            for iy in 0..ny {
                for ix in 0..nx {
                    let before = field[[wrap(iy + ny - sy, ny), wrap(ix + nx - sx, nx)]];
                    let after = field[[wrap(iy + sy, ny), wrap(ix + sx, nx)]];
                    next[[iy, ix]] = 0.25 * (before + after) + 0.5 * field[[iy, ix]];
                }
            }
            std::mem::swap(&mut field, &mut next);
        }
        normalise(&mut field);
        field
    }
}

/// Shifts and scales a field to mean 0 and root mean square 1. A constant field is left as it is.
fn normalise(field: &mut Array2<f64>) {
    let count = field.len() as f64;
    let mean = field.iter().sum::<f64>() / count;
    let rms = (field.iter().map(|v| (v - mean) * (v - mean)).sum::<f64>() / count).sqrt();
    if rms > 0.0 {
        field.mapv_inplace(|v| (v - mean) / rms);
    }
}

/// Smooth step: 0 on the side of `from`, 1 on the side of `to`, and between them a cubic with zero slope at both ends.
///
/// `from` may exceed `to`; the step then falls along +x. They must differ.
pub fn smooth_step(from: f64, to: f64, x: f64) -> f64 {
    let fraction = ((x - from) / (to - from)).clamp(0.0, 1.0);
    fraction * fraction * (3.0 - 2.0 * fraction)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sequence_of_a_seed_is_fixed() {
        // Other values change every procedural surface.
        let mut random = Random::new(1);
        let first: Vec<u64> = (0..3).map(|_| (random.unit() * (1u64 << 53) as f64) as u64).collect();
        assert_eq!(first, [7_716_621_919_182_308, 1_238_980_658_357_607, 4_237_540_709_505_645]);
        assert_ne!(Random::new(2).unit(), Random::new(1).unit());
    }

    #[test]
    fn fields_are_normalised_and_periodic() {
        let field = Random::new(3).smooth_field(64, 32, 3);
        let mean = field.iter().sum::<f64>() / 2048.0;
        let square = field.iter().map(|v| v * v).sum::<f64>() / 2048.0;
        assert!(mean.abs() < 1e-12 && (square - 1.0).abs() < 1e-12);
        let step = |a: usize, b: usize| (field[[5, a]] - field[[5, b]]).abs();
        // A step at the seam of a field that does not repeat would be far larger than those inside.
        let inside = (0..63).map(|i| step(i, i + 1)).fold(0.0, f64::max);
        assert!(step(63, 0) <= 1.5 * inside);
    }
}
