//! Wavelengths of a table of efficiencies: its nodes, and those among them that are solved.

use super::GratingError;
use super::orders::Orders;
use crate::table::{WAVELENGTH_MAX_NM, WAVELENGTH_MIN_NM};
use rayon::prelude::*;
use std::collections::BTreeSet;

/// Spacing of a table's wavelengths.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Spacing {
    /// Distance of two wavelengths in nm.
    pub step_nm: f64,
    /// Number of steps between solved wavelengths. Cubic interpolation gives those in between.
    pub solved_every: usize,
}

/// Candidate steps in nm, coarsest first.
const STEPS_NM: [f64; 4] = [80.0, 40.0, 20.0, 10.0];
/// Incidences at which the step is chosen: `t` as a fraction of the largest one, and the Bloch phase `b`. Arbitrary,
/// away from grazing orders and from symmetry.
const PROBES: [[f64; 2]; 2] = [[0.55, 0.23], [0.83, 0.41]];
/// Wavelengths in nm at which the step is chosen, spread over the visible range.
const PROBES_NM: [f64; 4] = [430.0, 510.0, 590.0, 690.0];

impl Spacing {
    /// Chooses the longest step whose linear interpolation errs by at most `tolerance` halfway between wavelengths, in
    /// root mean square over the orders of [`PROBES`]. Every second wavelength is solved if cubic interpolation is as
    /// accurate.
    ///
    /// # Errors
    /// An incidence that cannot be solved.
    pub(super) fn choose(period_um: f64, orders: &impl Orders, tolerance: f64) -> Result<Self, GratingError> {
        let [coarser @ .., finest] = &STEPS_NM;
        let mut step_nm = *finest;
        for &step in coarser {
            if error_between(period_um, orders, step, &[0.5, 0.5])? <= tolerance {
                step_nm = step;
                break;
            }
        }
        let cubic = error_between(period_um, orders, 2.0 * step_nm, &[-0.0625, 0.5625, 0.5625, -0.0625])?;
        Ok(Self { step_nm, solved_every: if cubic <= tolerance { 2 } else { 1 } })
    }
}

/// Root mean square error, over orders, of efficiencies interpolated halfway between wavelengths `step_nm` apart with
/// these weights. Infinite if the stencil leaves the tables' range at every wavelength of [`PROBES_NM`].
fn error_between(period_um: f64, orders: &impl Orders, step_nm: f64, weights: &[f64]) -> Result<f64, GratingError> {
    let reach = 0.5 * step_nm * (weights.len() - 1) as f64;
    let inside = |nm: &f64| nm - reach >= WAVELENGTH_MIN_NM && nm + reach <= WAVELENGTH_MAX_NM;
    let queries: Vec<_> =
        PROBES.iter().flat_map(|&place| PROBES_NM.into_iter().filter(inside).map(move |nm| (place, nm))).collect();
    if queries.is_empty() {
        return Ok(f64::INFINITY);
    }
    let errors = queries
        .par_iter()
        .map(|&([fraction, b], nm)| {
            let about = (0..weights.len()).map(|i| nm - reach + step_nm * i as f64);
            let wavelengths_nm: Vec<f64> = about.chain([nm]).collect();
            let t = fraction * 1e3 * period_um / (nm + reach);
            // Limited so that the incident wave propagates.
            let b = b.min(0.9 * t);
            let found = orders.efficiencies(t, b, &wavelengths_nm)?;
            let (about, at) = (&found[..weights.len()], &found[weights.len()]);
            let between = |i: usize| weights.iter().zip(about).map(|(weight, row)| weight * row[i]).sum::<f64>();
            let squares = (0..at.len()).map(|i| (between(i) - at[i]).powi(2)).sum::<f64>();
            Ok(squares / at.len().max(1) as f64)
        })
        .collect::<Result<Vec<f64>, GratingError>>()?;
    Ok((errors.iter().sum::<f64>() / errors.len() as f64).sqrt())
}

/// Number of cells at a wavelength in nm.
fn cells(period_um: f64, wavelength_nm: f64) -> usize {
    (2e3 * period_um / wavelength_nm) as usize + 1
}

/// Wavelengths of a table in nm, and the number of cells of each. A wavelength has the cells of the one before it,
/// since look-ups interpolate between the two.
pub(super) fn wavelengths(period_um: f64, step_nm: Option<f64>) -> (Vec<f64>, Vec<usize>) {
    let range = WAVELENGTH_MAX_NM - WAVELENGTH_MIN_NM;
    let steps = step_nm.map_or(1.0, |step| (range / step).ceil());
    let nm: Vec<f64> = (0..=steps as usize).map(|j| WAVELENGTH_MIN_NM + j as f64 * range / steps).collect();
    let cells = (0..nm.len()).map(|j| cells(period_um, nm[j.saturating_sub(1)])).collect();
    (nm, cells)
}

/// Number of wavelengths at which a cell exists, from the numbers of cells of all wavelengths.
pub(super) fn wavelengths_of(cell: usize, cells_of: &[usize]) -> usize {
    cells_of.iter().rposition(|&cells| cell < cells).map_or(0, |last| last + 1)
}

/// Wavelengths in nm that are solved in at least one cell.
pub(super) fn ever_solved(period_um: f64, spacing: Option<Spacing>) -> Vec<f64> {
    let (nm, cells_of) = wavelengths(period_um, spacing.map(|spacing| spacing.step_nm));
    let every = spacing.map_or(1, |spacing| spacing.solved_every);
    let of = |cell| solved_wavelengths(wavelengths_of(cell, &cells_of), every);
    let solved: BTreeSet<usize> = (0..cells_of[0]).flat_map(of).collect();
    solved.into_iter().map(|j| nm[j]).collect()
}

/// Indices of the solved wavelengths among the first `count`: each `every`-th one and the last.
pub(super) fn solved_wavelengths(count: usize, every: usize) -> Vec<usize> {
    let last = count.saturating_sub(1);
    (0..last).step_by(every).chain([last]).collect()
}

/// Values at all wavelengths up to the last solved one, interpolated by the polynomial through the four nearest solved
/// wavelengths, or through all if there are fewer.
pub(super) fn at_all_wavelengths(solved_at: &[usize], solved: Vec<Vec<f64>>) -> Vec<Vec<f64>> {
    let count = solved_at.last().map_or(0, |last| last + 1);
    if count == solved.len() {
        return solved;
    }
    let places: Vec<f64> = solved_at.iter().map(|&j| j as f64).collect();
    let about = solved.len().min(4);
    (0..count)
        .map(|j| {
            let above = solved_at.partition_point(|&at| at < j);
            let first = above.saturating_sub(2).min(solved.len() - about);
            let nodes = &places[first..first + about];
            let weight = |i: usize| {
                let others = nodes.iter().enumerate().filter(|&(other, _)| other != i);
                others.map(|(_, place)| (j as f64 - place) / (nodes[i] - place)).product::<f64>()
            };
            let weights: Vec<f64> = (0..about).map(weight).collect();
            let value = |at: usize| (0..about).map(|i| weights[i] * solved[first + i][at]).sum();
            (0..solved[0].len()).map(value).collect()
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cubics_are_interpolated_exactly() {
        for count in 1..12 {
            for every in 1..=3 {
                let solved_at = solved_wavelengths(count, every);
                assert_eq!((solved_at[0], solved_at[solved_at.len() - 1]), (0, count - 1));
                // The degree that this number of nodes determines.
                let degree = solved_at.len().min(4) - 1;
                let value = |j: usize| vec![(0.3 * j as f64 - 1.0).powi(degree as i32), 1.0];
                let all = at_all_wavelengths(&solved_at, solved_at.iter().map(|&j| value(j)).collect());
                assert_eq!(all.len(), count);
                for (j, found) in all.iter().enumerate() {
                    for (found, expected) in found.iter().zip(value(j)) {
                        assert!((found - expected).abs() < 1e-12, "{count} {every} {j}");
                    }
                }
            }
        }
    }
}
