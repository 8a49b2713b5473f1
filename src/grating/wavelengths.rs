//! Wavelengths of a table: its *nodes*, and the nodes at which the grating is solved (symbols: `mod.rs`).
//!
//! Nodes have equal steps from 360 to 830 nm; look-ups interpolate linearly between them. Where efficiencies are smooth
//! enough, only every second node is solved, and the others follow by cubic interpolation.
//!
//! Wave numbers are along x, in units of 2π over the period d. At a point (t, b), the Bloch phase b is the wave number
//! of one order, from which those of the others differ by whole numbers; t bounds the magnitude of those that
//! propagate. A *cell* has the incident waves at which a given number of orders propagate.

use super::GratingError;
use super::order_solver::OrderSolver;
use crate::table::{WAVELENGTH_MAX_NM, WAVELENGTH_MIN_NM};
use rayon::prelude::*;
use std::collections::BTreeSet;

/// Spacing of a table's wavelengths.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Spacing {
    /// Largest step between nodes in nm. The range of wavelengths is divided into equal steps of at most this.
    pub step_nm: f64,
    /// Steps between solved nodes, 1 or 2.
    pub solved_every: usize,
}

/// Steps in nm among which [`Spacing::choose`] selects. Chosen as halvings down to the width of a metal's anomalies,
/// its resonant peaks over wavelengths.
pub(super) const STEPS_NM: [f64; 4] = [80.0, 40.0, 20.0, 10.0];
/// Points at which the step is tested: `t` as a fraction of its largest value d/λ, and `b`. Chosen away from
/// symmetries. Light and the plane across the grooves form the angle arccos of the fraction: about 57° and 34°.
const TEST_POINTS: [[f64; 2]; 2] = [[0.55, 0.23], [0.83, 0.41]];
/// Wavelengths in nm at which the step is tested: spread over the range to which the eye is most sensitive.
const TEST_NM: [f64; 4] = [430.0, 510.0, 590.0, 690.0];
/// Weights of linear interpolation halfway between two nodes.
const LINEAR: [f64; 2] = [0.5, 0.5];
/// Weights of cubic interpolation halfway between the middle two of four nodes.
const CUBIC: [f64; 4] = [-0.0625, 0.5625, 0.5625, -0.0625];

impl Spacing {
    /// The longest of [`STEPS_NM`] at which the RMS error of linear interpolation halfway between nodes is at most
    /// `tolerance`, or else the shortest. Every second node is solved if cubic interpolation over twice the step also
    /// meets the tolerance.
    ///
    /// # Errors
    /// A test point that cannot be solved.
    pub(super) fn choose(period_um: f64, solver: &impl OrderSolver, tolerance: f64) -> Result<Self, GratingError> {
        let [coarser @ .., finest] = &STEPS_NM;
        let mut step_nm = *finest;
        for &step in coarser {
            if interpolation_error(period_um, solver, step, &LINEAR)? <= tolerance {
                step_nm = step;
                break;
            }
        }
        let cubic = interpolation_error(period_um, solver, 2.0 * step_nm, &CUBIC)?;
        Ok(Self { step_nm, solved_every: if cubic <= tolerance { 2 } else { 1 } })
    }
}

/// RMS error of efficiencies interpolated in the middle of nodes `step_nm` apart, over the test points and wavelengths;
/// `weights` has the weight of each node. Infinite if no test wavelength has all its nodes within 360 to 830 nm.
///
/// # Errors
/// A test point that cannot be solved.
fn interpolation_error(
    period_um: f64,
    solver: &impl OrderSolver,
    step_nm: f64,
    weights: &[f64],
) -> Result<f64, GratingError> {
    let reach = 0.5 * step_nm * (weights.len() - 1) as f64;
    let is_within = |nm: &f64| nm - reach >= WAVELENGTH_MIN_NM && nm + reach <= WAVELENGTH_MAX_NM;
    let tests: Vec<_> = TEST_POINTS
        .iter()
        .flat_map(|&point| TEST_NM.into_iter().filter(is_within).map(move |nm| (point, nm)))
        .collect();
    if tests.is_empty() {
        return Ok(f64::INFINITY);
    }
    let errors = tests
        .par_iter()
        .map(|&([fraction, b], nm)| {
            let nodes_nm = (0..weights.len()).map(|i| nm - reach + step_nm * i as f64);
            let wavelengths_nm: Vec<f64> = nodes_nm.chain([nm]).collect();
            // A fraction of d/λ at the longest wavelength used, so that ky is real at all of them.
            let t = fraction * 1e3 * period_um / (nm + reach);
            // Keeps b below t, so that at least one order propagates: the order whose wave number is b.
            let b = b.min(0.9 * t);
            let solved = solver.efficiencies(t, b, &wavelengths_nm)?;
            let (at_nodes, exact) = (&solved[..weights.len()], &solved[weights.len()]);
            let interpolated =
                |i: usize| weights.iter().zip(at_nodes).map(|(weight, row)| weight * row[i]).sum::<f64>();
            // The mean square over the pairs of incident and outgoing orders at this point.
            let squares = (0..exact.len()).map(|i| (interpolated(i) - exact[i]).powi(2)).sum::<f64>();
            Ok(squares / exact.len().max(1) as f64)
        })
        .collect::<Result<Vec<f64>, GratingError>>()?;
    Ok((errors.iter().sum::<f64>() / errors.len() as f64).sqrt())
}

/// Number of cells that propagating waves reach at a wavelength in nm. A cell's index s, the number of its orders minus
/// one, is at most `2t ≤ 2d/λ`.
fn cell_count(period_um: f64, wavelength_nm: f64) -> usize {
    (2e3 * period_um / wavelength_nm) as usize + 1
}

/// Wavelengths of a table in nm, ascending, and the number of cells at each. `step_nm` is the largest step; `None`, for
/// a perfect conductor, gives the two ends of the range: its efficiencies at (t, b) do not depend on λ. A wavelength
/// has as many cells as the next shorter one, since look-ups interpolate between both.
pub(super) fn table_wavelengths(period_um: f64, step_nm: Option<f64>) -> (Vec<f64>, Vec<usize>) {
    let range = WAVELENGTH_MAX_NM - WAVELENGTH_MIN_NM;
    let steps = step_nm.map_or(1.0, |step| (range / step).ceil());
    let nm: Vec<f64> = (0..=steps as usize).map(|j| WAVELENGTH_MIN_NM + j as f64 * range / steps).collect();
    let cells = (0..nm.len()).map(|j| cell_count(period_um, nm[j.saturating_sub(1)])).collect();
    (nm, cells)
}

/// Number of wavelengths, from the shortest on, that have the cell of index `cell`. `cell_counts` has the numbers of
/// cells that [`table_wavelengths`] returns.
pub(super) fn wavelengths_with_cell(cell: usize, cell_counts: &[usize]) -> usize {
    cell_counts.iter().rposition(|&count| cell < count).map_or(0, |last| last + 1)
}

/// All wavelengths in nm that are solved in at least one cell, ascending. Without `spacing`, for a perfect conductor,
/// the ends of the range.
pub(super) fn all_solved(period_um: f64, spacing: Option<Spacing>) -> Vec<f64> {
    let (nm, cell_counts) = table_wavelengths(period_um, spacing.map(|spacing| spacing.step_nm));
    let every = spacing.map_or(1, |spacing| spacing.solved_every);
    let in_cell = |cell| solved_indices(wavelengths_with_cell(cell, &cell_counts), every);
    let solved: BTreeSet<usize> = (0..cell_counts[0]).flat_map(in_cell).collect();
    solved.into_iter().map(|j| nm[j]).collect()
}

/// Indices of the solved wavelengths among the first `count` ≥ 1 of a table: those in steps of `every` from the first
/// on, and the last.
pub(super) fn solved_indices(count: usize, every: usize) -> Vec<usize> {
    let last = count - 1;
    (0..last).step_by(every).chain([last]).collect()
}

/// Values at all wavelengths up to the last solved one, `[wavelength][entry]`. They follow from the polynomial through
/// the four nearest solved wavelengths, or through all of them if there are fewer. `solved` has the values
/// `[solved wavelength][entry]`, and `solved_at` the indices of these wavelengths, ascending.
pub(super) fn at_all_wavelengths(solved_at: &[usize], solved: Vec<Vec<f64>>) -> Vec<Vec<f64>> {
    let count = solved_at.last().map_or(0, |last| last + 1);
    if count == solved.len() {
        return solved;
    }
    let abscissas: Vec<f64> = solved_at.iter().map(|&j| j as f64).collect();
    let used = solved.len().min(4);
    (0..count)
        .map(|j| {
            // The first solved wavelength at or above j. Two of the four nearest lie below it, if there are two.
            let above = solved_at.partition_point(|&at| at < j);
            let first = above.saturating_sub(2).min(solved.len() - used);
            let nodes = &abscissas[first..first + used];
            // Lagrange weight of the i-th node.
            let weight = |i: usize| {
                let others = nodes.iter().enumerate().filter(|&(other, _)| other != i);
                others.map(|(_, node)| (j as f64 - node) / (nodes[i] - node)).product::<f64>()
            };
            let weights: Vec<f64> = (0..used).map(weight).collect();
            let value = |entry: usize| (0..used).map(|i| weights[i] * solved[first + i][entry]).sum();
            (0..solved[0].len()).map(value).collect()
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn unsolved_wavelengths_follow_cubics() {
        for count in 1..12 {
            for every in 1..=3 {
                let solved_at = solved_indices(count, every);
                assert_eq!((solved_at[0], solved_at[solved_at.len() - 1]), (0, count - 1));
                // The highest degree that these nodes determine.
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
