//! Weights of the terms in the series of the phase screen exp(iκh) (symbols: orders.rs), for many wavelengths at one w.
//! Several wavelengths are computed side by side, in lanes that the compiler turns into SIMD.
//!
//! The phase rate is `κ = 2πw/λ` in rad/µm, with w = cosθi + cosθo and the wavelength λ; h is the height. `x = κH` is
//! the phase rate times half the range H of heights, in radians. The weight of term n is `(2 − δ_n0)·iⁿ·J_n(x)`
//! (Chebyshev) or `iⁿ·xⁿ/n!` (Taylor). Weights are stored without the factor i of odd terms, which
//! [`super::orders::Orders::amplitude`] restores. They are then real, with the signs + + − − and so on.

use super::bessel::{TERMS_MAX, bessel_j};
use super::order_grid::OrderGrid;
use arrayvec::ArrayVec;
use std::f32::consts::TAU;

/// Number of wavelengths whose weights are computed side by side. Larger values leave more lanes idle in the last
/// batch; smaller ones leave parts of wide SIMD registers unused.
const LANES: usize = 8;
/// Number of lanes for small batches, so that fewer lanes are idle.
const FEW_LANES: usize = LANES / 2;

/// Weights of one wavelength, in pairs `[even, even, odd, odd]` of an even term and the following odd one. Each is
/// stored twice: [`super::orders::Orders::amplitude`] multiplies the real and the imaginary part of a term by it.
pub(super) type TermWeights = [[f32; 4]];

/// Weights of a batch of wavelengths, `[wavelength][pair]`.
type BatchWeights = ArrayVec<[f32; 4], { LANES * TERMS_MAX / 2 }>;

impl OrderGrid {
    /// Number of terms to sum at `x = κH`, an even number. All terms are summed where x is at least
    /// [`OrderGrid::full_terms_kappa_h`]. For each unit below it the series needs at least one term less.
    pub(super) fn terms_at(&self, x: f32) -> usize {
        let spare = (self.full_terms_kappa_h - x).max(0.0) as usize;
        (self.terms as usize).saturating_sub(spare).max(1).next_multiple_of(2)
    }

    /// Computes the weights at `w = cosθi + cosθo` for several visible wavelengths, in batches of [`LANES`]. Each
    /// wavelength in µm comes with a value of the caller. `receive` is called with wavelength, value and weights, in
    /// the given order.
    pub(super) fn at_wavelengths<T>(
        &self,
        w: f32,
        mut wavelengths_um: impl Iterator<Item = (f32, T)>,
        mut receive: impl FnMut(f32, T, &TermWeights),
    ) {
        let (mut batch, mut batch_weights) = (ArrayVec::<(f32, T), LANES>::new(), BatchWeights::new());
        loop {
            batch.extend(wavelengths_um.by_ref().take(LANES));
            let Some(&(last_um, _)) = batch.last() else { return };
            // Lanes beyond the end of the batch repeat its last wavelength.
            let lane_um = |lane: usize| batch.get(lane).map_or(last_um, |&(um, _)| um);
            let x = |lane: usize| TAU * w / lane_um(lane) * self.half_range_um;
            let pairs = if batch.len() <= FEW_LANES {
                self.write_weights::<FEW_LANES>(std::array::from_fn(x), batch.len(), &mut batch_weights)
            } else {
                self.write_weights::<LANES>(std::array::from_fn(x), batch.len(), &mut batch_weights)
            };
            for ((wavelength_um, value), weights) in batch.drain(..).zip(batch_weights.chunks_exact(pairs)) {
                receive(wavelength_um, value, weights);
            }
        }
    }

    /// Writes the weights at the first `count` of the arguments x = κH to `weights`, `[argument][pair]`. Returns the
    /// number of pairs for each argument.
    fn write_weights<const N: usize>(&self, x: [f32; N], count: usize, weights: &mut BatchWeights) -> usize {
        // The largest argument needs the most terms.
        let terms = self.terms_at(x.into_iter().fold(0.0, f32::max));
        // `[term][lane]`.
        let mut values = ArrayVec::<[f32; N], TERMS_MAX>::new();
        values.extend(std::iter::repeat_n([0.0; N], terms));
        // Factor on the terms from 1 on: 2 for the Chebyshev series (0), 1 for the Taylor series (1).
        let factor = if self.series == 0 {
            bessel_j(x, &mut values);
            2.0
        } else {
            taylor_coefficients(x, &mut values);
            1.0
        };
        for (n, row) in values.iter_mut().enumerate().skip(1) {
            // + + − − and so on.
            let signed = if n & 2 == 0 { factor } else { -factor };
            row.iter_mut().for_each(|value| *value *= signed);
        }
        let pairs = terms / 2;
        // The buffer keeps its length where a later batch needs less: only the first `count * pairs` entries are valid.
        let missing = (count * pairs).saturating_sub(weights.len());
        weights.extend(std::iter::repeat_n([0.0; 4], missing));
        for (n, pair) in values.chunks_exact(2).enumerate() {
            for lane in 0..count {
                let [even, odd] = [pair[0][lane], pair[1][lane]];
                weights[lane * pairs + n] = [even, even, odd, odd];
            }
        }
        pairs
    }
}

/// Writes `xⁿ/n!` to row n.
fn taylor_coefficients<const N: usize>(x: [f32; N], values: &mut [[f32; N]]) {
    let mut power_over_factorial = [1.0; N];
    for (n, row) in values.iter_mut().enumerate() {
        if n > 0 {
            let reciprocal = 1.0 / n as f32;
            (0..N).for_each(|lane| power_over_factorial[lane] *= x[lane] * reciprocal);
        }
        *row = power_over_factorial;
    }
}

#[cfg(test)]
mod tests {
    use super::super::order_grid::TERMS_MULTIPLE;
    use super::*;
    use crate::methods::TAYLOR_KAPPA_H_MAX;
    use crate::transform::{chebyshev_terms, taylor_terms};

    #[test]
    fn terms_left_out_are_below_the_remainder_at_every_argument() {
        for remainder in [1e-2, 1e-4, 1e-7] {
            for largest in [0.0, 0.5, 1.0, 3.3, 9.9, 30.0, 130.0] {
                for (series, needed) in [chebyshev_terms, taylor_terms].into_iter().enumerate() {
                    if series == 1 && largest > TAYLOR_KAPPA_H_MAX {
                        continue;
                    }
                    // The grid of a tile whose largest κH is `largest`, as `Orders::new` makes it.
                    let count = needed(largest, remainder);
                    let terms = count.next_multiple_of(TERMS_MULTIPLE);
                    let full_terms_kappa_h = (largest + (terms - count) as f64) as f32;
                    let grid = OrderGrid { terms: terms as u32, full_terms_kappa_h, ..bytemuck::Zeroable::zeroed() };
                    for step in 0..=100 {
                        let x = largest * f64::from(step) / 100.0;
                        let kept = grid.terms_at(x as f32);
                        assert!(kept >= needed(x, remainder), "{remainder}, {largest}, {x}: {kept}");
                        // At most the terms of the largest argument, and an even number.
                        assert!(
                            kept <= count.next_multiple_of(2) && kept.is_multiple_of(2),
                            "{remainder}, {largest}, {x}: {kept}"
                        );
                    }
                }
            }
        }
    }

    #[test]
    fn a_given_number_of_terms_is_summed_at_any_argument() {
        let grid = OrderGrid { terms: 24, full_terms_kappa_h: 0.0, ..bytemuck::Zeroable::zeroed() };
        assert_eq!([0.0, 1.0, 30.0].map(|x| grid.terms_at(x)), [24; 3]);
    }

    #[test]
    fn batches_give_each_wavelength_its_own_weights() {
        for series in [0, 1] {
            let grid = OrderGrid { terms: 16, half_range_um: 0.2, series, ..bytemuck::Zeroable::zeroed() };
            // Batches of few lanes and of all lanes, full or not, and several batches.
            for count in [0, 1, 4, 5, 8, 9, 21] {
                let wavelengths = (0..count).map(|i| (0.38 + 0.02 * i as f32, i));
                let mut seen = 0;
                grid.at_wavelengths(1.5, wavelengths, |um, i, weights| {
                    assert_eq!((i, um), (seen, 0.38 + 0.02 * i as f32));
                    seen += 1;
                    let mut alone = None;
                    grid.at_wavelengths(1.5, std::iter::once((um, ())), |_, (), weights| {
                        alone = Some(weights.to_vec());
                    });
                    let alone = alone.unwrap();
                    // Pairs of the 16 terms.
                    assert_eq!(weights.len(), 8);
                    // Rounding: the start of Miller's recurrence depends on the batch.
                    for (batched, alone) in weights.as_flattened().iter().zip(alone.as_flattened()) {
                        assert!((batched - alone).abs() < 1e-6 * alone.abs().max(1.0), "{batched}, {alone}");
                    }
                });
                assert_eq!(seen, count);
            }
        }
    }
}
