//! Coefficients of the cubic B-splines over w through the samples of a ring: the solution of a banded linear system.
//!
//! The matrix `[sample][coefficient]` has the values of the basis functions at the samples
//! ([`RingPlan::sampled_w`]). Coefficient c belongs to the knot c − 1, and basis functions reach two knots to either
//! side. So row i is zero outside the columns i − 2 to i + 3: the first two and the last two samples are less than a
//! knot apart, the others lie at knots.
//!
//! The matrix is totally positive and invertible, since each basis function has a sample within its support
//! (Schoenberg and Whitney). Elimination without pivots is therefore stable (de Boor, *A Practical Guide to Splines*,
//! chapter XIII). It takes time in proportion to the number of samples.

use super::rings::RingPlan;
use crate::numeric::math::cubic_b_spline;

/// Number of columns of the band to the left of the diagonal.
const LEFT: usize = 2;
/// Number of columns of the band to the right of the diagonal.
const RIGHT: usize = 3;
/// Columns of the band.
const BAND: usize = LEFT + 1 + RIGHT;

/// The factors L·U of a ring's matrix. Both triangles are banded, and the diagonal of L is 1.
pub(super) struct Collocation {
    /// For each row i, the columns i − [`LEFT`] to i + [`RIGHT`]: L to the left of the diagonal, U from the diagonal
    /// on. The diagonal has the reciprocal of U's. Columns beyond the matrix are zero.
    rows: Vec<[f32; BAND]>,
}

impl Collocation {
    /// Factors of the matrix of a ring, with [`RingPlan::w_count`] rows.
    pub(super) fn new(ring: &RingPlan) -> Self {
        let sampled_w = ring.sampled_w();
        let n = sampled_w.len();
        let mut rows: Vec<[f64; BAND]> = (0..n)
            .map(|i| {
                let position = ring.knot_position(sampled_w[i]);
                std::array::from_fn(|k| match (i + k).checked_sub(LEFT) {
                    Some(column) if column < n => cubic_b_spline(position - (column as f64 - 1.0)),
                    _ => 0.0,
                })
            })
            .collect();
        for pivot_row in 0..n {
            let upper = rows[pivot_row];
            for below in 1..=LEFT.min(n - 1 - pivot_row) {
                let row = &mut rows[pivot_row + below];
                let factor = row[LEFT - below] / upper[LEFT];
                row[LEFT - below] = factor;
                for right in 1..=RIGHT {
                    row[LEFT - below + right] -= factor * upper[LEFT + right];
                }
            }
        }
        rows.iter_mut().for_each(|row| row[LEFT] = row[LEFT].recip());
        Self { rows: rows.into_iter().map(|row| row.map(|value| value as f32)).collect() }
    }

    /// Replaces samples `[w][channel]` by the coefficients of the spline through them.
    pub(super) fn solve(&self, samples: &mut [f32]) {
        let samples: &mut [[f32; 3]] = bytemuck::cast_slice_mut(samples);
        let n = samples.len();
        for i in 0..n {
            for left in 1..=LEFT.min(i) {
                let (factor, before) = (self.rows[i][LEFT - left], samples[i - left]);
                samples[i].iter_mut().zip(before).for_each(|(channel, before)| *channel -= factor * before);
            }
        }
        for i in (0..n).rev() {
            let row = &self.rows[i];
            for right in 1..=RIGHT.min(n - 1 - i) {
                let (factor, after) = (row[LEFT + right], samples[i + right]);
                samples[i].iter_mut().zip(after).for_each(|(channel, after)| *channel -= factor * after);
            }
            samples[i].iter_mut().for_each(|channel| *channel *= row[LEFT]);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::rings::Rings;
    use super::*;

    /// Plans with logarithmic and with uniform knots, and with the smallest number of intervals.
    #[test]
    fn splines_pass_through_the_samples() {
        for (range_um, tapered) in [(0.8, true), (40.0, false), (0.0, false)] {
            let plan = Rings::plan(0.01, range_um, tapered, 1.0);
            let ring = &plan.rings[3];
            let n = ring.w_count();
            let samples: Vec<f32> = (0..3 * n).map(|i| ((7 * i) % 13) as f32 - 6.0).collect();
            let mut coefficients = samples.clone();
            Collocation::new(ring).solve(&mut coefficients);
            for (at, w) in ring.sampled_w().into_iter().enumerate() {
                let position = ring.knot_position(w);
                for channel in 0..3 {
                    let value: f64 = (0..n)
                        .map(|c| cubic_b_spline(position - (c as f64 - 1.0)) * f64::from(coefficients[3 * c + channel]))
                        .sum();
                    // Rounding in single precision of numbers up to 6, amplified by the neighbours of the samples that
                    // are 0.3 knots apart.
                    assert!((value - f64::from(samples[3 * at + channel])).abs() < 2e-4, "{range_um} {at}: {value}");
                }
            }
        }
    }
}
