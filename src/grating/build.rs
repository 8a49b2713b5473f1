//! Builds the table of efficiencies: solves each cell at Chebyshev nodes and resamples it to the table's nodes.

use super::GratingError;
use super::efficiencies::{EfficiencyLayout, EfficiencyView, UNIT};
use super::orders::Orders;
use super::place::{Place, unstretched};
use super::wavelengths::{Spacing, at_all_wavelengths, solved_wavelengths, wavelengths, wavelengths_of};
use crate::numeric::{Index, Plain};
use crate::table::{Progress, WAVELENGTH_MAX_NM, WAVELENGTH_MIN_NM};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::f64::consts::PI;

/// Density of a table's nodes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct TableResolution {
    /// Number of nodes along each side of a cell.
    pub stored: u32,
    /// Wavelengths; `None` for a perfect conductor, whose efficiencies do not depend on the wavelength at given `t` and
    /// `b`.
    pub spacing: Option<Spacing>,
    /// Accepted root mean square of an efficiency's highest Chebyshev terms. Cells above it are solved at more nodes.
    pub tolerance: f64,
}

/// Numbers of Chebyshev nodes along each side of a cell, tried in this order until the highest terms are small enough.
const SOLVED: [usize; 4] = [8, 12, 17, 24];

/// Size, build time and measured error of a grating's table.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct GratingReport {
    /// Bytes of the table.
    pub bytes: usize,
    /// Number of incidences solved, each at all wavelengths.
    pub solved: usize,
    /// Root mean square error of an order's unpolarised efficiency, at random incidences and wavelengths.
    pub rms: f64,
    /// The 99th percentile of that error.
    pub p99: f64,
    /// Seconds of the whole build.
    pub build_seconds: f64,
}

/// A table of efficiencies, read through [`EfficiencyView`].
#[derive(Debug, Serialize, Deserialize)]
pub(super) struct EfficiencyTable {
    pub layout: EfficiencyLayout,
    pub words: Vec<u32>,
    /// Number of incidences solved.
    pub solved: usize,
}

/// Coordinates `(t, b)` of the point of a cell whose fractions of `t − b` and `t + b` are `x`.
pub(super) fn node(cell: usize, x: [f64; 2]) -> (f64, f64) {
    let (p, q) = ((cell / 2) as f64 + x[0], (cell - cell / 2) as f64 + x[1]);
    (0.5 * (p + q), 0.5 * (q - p))
}

impl EfficiencyTable {
    /// Solves and tabulates all cells.
    ///
    /// # Errors
    /// An incidence that cannot be solved.
    pub(super) fn build(
        period_um: f64,
        orders: &impl Orders,
        resolution: TableResolution,
        progress: &Progress,
    ) -> Result<Self, GratingError> {
        let (nm, cells_of) = wavelengths(period_um, resolution.spacing.map(|spacing| spacing.step_nm));
        let every = resolution.spacing.map_or(1, |spacing| spacing.solved_every);
        let count = cells_of[0];
        let (mut step, mut solved) = (0, 0);
        // `[wavelength][cell]`.
        let mut packed: Vec<Vec<Vec<u16>>> = vec![Vec::new(); nm.len()];
        let work: usize = (1..=count).sum();
        let mut done = 0;
        for s in 0..count {
            let longest = wavelengths_of(s, &cells_of);
            let solved_at = solved_wavelengths(longest, every);
            let solved_nm: Vec<f64> = solved_at.iter().map(|&j| nm[j]).collect();
            let mut cell = Cell::solve(s, orders, &solved_nm, resolution.tolerance, &mut step, &mut solved)?;
            for matrices in &mut cell.matrices {
                *matrices = at_all_wavelengths(&solved_at, std::mem::take(matrices));
            }
            for (j, packed) in packed.iter_mut().enumerate().take(longest) {
                packed.push(cell.packed(j, resolution.stored as usize));
            }
            done += s + 1;
            progress.report(done as f64 / work as f64);
        }
        let starts = nm.len() * count;
        let mut begins = vec![0u32; starts];
        let mut halves: Vec<u16> = Vec::new();
        for (j, of_wavelength) in packed.iter().enumerate() {
            for (s, cell) in of_wavelength.iter().enumerate() {
                begins[j * count + s] = (2 * starts + halves.len()) as u32;
                halves.extend(cell);
            }
        }
        let pair = |pair: &[u16]| u32::from(pair[0]) | u32::from(pair.get(1).copied().unwrap_or_default()) << 16;
        let words = begins.into_iter().chain(halves.chunks(2).map(pair)).collect();
        let layout = EfficiencyLayout {
            first_nm: nm[0],
            step_nm: nm[1] - nm[0],
            wavelengths: nm.len() as u32,
            cells: count as u32,
            nodes: resolution.stored,
        };
        Ok(Self { layout, words, solved })
    }

    /// Root mean square and 99th percentile of the difference to `orders` at `count` random places and wavelengths.
    ///
    /// # Errors
    /// An incidence that cannot be solved.
    pub(super) fn error(&self, period_um: f64, orders: &impl Orders, count: usize) -> Result<(f64, f64), GratingError> {
        let mut random = Pcg64Mcg::seed_from_u64(1);
        let queries: Vec<[f64; 3]> = (0..count)
            .map(|_| {
                let nm = random.random_range(WAVELENGTH_MIN_NM..WAVELENGTH_MAX_NM);
                // Uniform over the projected hemisphere of incidences.
                let (radius, turn) = (random.random::<f64>().sqrt(), random.random_range(0.0..2.0 * PI));
                [nm, radius * turn.cos(), radius * turn.sin()]
            })
            .collect();
        let mut differences = queries
            .par_iter()
            .map(|&[nm, x, y]| {
                let periods = 1e3 * period_um / nm;
                let (t, a) = (periods * (1.0 - y * y).sqrt(), periods * x);
                let place = Place::<Plain<f64>>::new(t, a);
                let solved = orders.efficiencies(t, a, &[nm])?;
                let view = EfficiencyView::<Plain<f64>> { layout: self.layout, words: &self.words };
                let row = view.row(&place, nm, true);
                let (width, incident) = (place.cell as usize + 1, place.incident as usize);
                Ok((0..width)
                    .map(|o| view.entry(&row, u32::lit(o as u32), true) - solved[0][incident * width + o])
                    .map(f64::abs)
                    .collect::<Vec<_>>())
            })
            .collect::<Result<Vec<_>, GratingError>>()?
            .concat();
        differences.sort_by(f64::total_cmp);
        let rms = (differences.iter().map(|d| d * d).sum::<f64>() / differences.len().max(1) as f64).sqrt();
        let p99 = differences.get(differences.len() * 99 / 100).copied().unwrap_or_default();
        Ok((rms, p99))
    }
}

/// Efficiencies of one cell at Chebyshev nodes in each coordinate's angle.
///
/// Reciprocity maps a node to its mirror image about the diagonal, where both coordinates swap; one triangle is solved.
struct Cell {
    index: usize,
    nodes: usize,
    /// `[node of the triangle][wavelength]`, each a matrix of [`Orders::efficiencies`].
    matrices: Vec<Vec<Vec<f64>>>,
}

impl Cell {
    /// Solves a cell with enough nodes that its highest terms are within the tolerance, or with the last number of
    /// [`SOLVED`].
    ///
    /// `step` is the position in [`SOLVED`] to start from, and is updated for the next cell, which is similar. `solved`
    /// counts the incidences.
    fn solve(
        index: usize,
        orders: &impl Orders,
        wavelengths_nm: &[f64],
        tolerance: f64,
        step: &mut usize,
        solved: &mut usize,
    ) -> Result<Self, GratingError> {
        loop {
            let cell = Self::solve_at(index, orders, wavelengths_nm, SOLVED[*step])?;
            *solved += cell.matrices.len();
            let left = cell.highest_terms();
            if left <= tolerance || *step + 1 == SOLVED.len() {
                // The next cell may need fewer nodes.
                *step -= usize::from(*step > 0 && left <= 0.25 * tolerance);
                return Ok(cell);
            }
            *step += 1;
        }
    }

    fn solve_at(
        index: usize,
        orders: &impl Orders,
        wavelengths_nm: &[f64],
        nodes: usize,
    ) -> Result<Self, GratingError> {
        let x: Vec<f64> = chebyshev_angles(nodes).map(|angle| (0.5 * angle).sin().powi(2)).collect();
        // One triangle; reciprocity gives the other.
        let places: Vec<[usize; 2]> = (0..nodes).flat_map(|i| (0..=i).map(move |k| [i, k])).collect();
        let matrices = places
            .par_iter()
            .map(|&[i, k]| {
                let (t, b) = node(index, [x[i], x[k]]);
                let mut matrices = orders.efficiencies(t, b, wavelengths_nm)?;
                if i == k {
                    matrices.iter_mut().for_each(|matrix| make_reciprocal(matrix, index));
                }
                Ok(matrices)
            })
            .collect::<Result<Vec<_>, GratingError>>()?;
        Ok(Self { index, nodes, matrices })
    }

    /// The efficiency `at = incident · orders + outgoing` at a pair of nodes and the `j`-th wavelength.
    fn value(&self, i: usize, k: usize, j: usize, at: usize) -> f64 {
        let (high, low) = (i.max(k), i.min(k));
        let matrix = &self.matrices[high * (high + 1) / 2 + low][j];
        let width = self.index + 1;
        // The reversed path: the outgoing order arrives, and both are counted from the other side.
        let from = if i < k { (self.index - at % width) * width + self.index - at / width } else { at };
        matrix[from]
    }

    /// Root mean square, over efficiencies and wavelengths, of the two highest Chebyshev terms.
    fn highest_terms(&self) -> f64 {
        let n = self.nodes;
        let terms = matrix_of(n, n, |degree, k| {
            let angle = PI * (k as f64 + 0.5) / n as f64;
            if degree == 0 { 1.0 / n as f64 } else { 2.0 / n as f64 * (degree as f64 * angle).cos() }
        });
        let (entries, wavelengths) = ((self.index + 1).pow(2), self.matrices[0].len());
        let mut sum = 0.0;
        for j in 0..wavelengths {
            for at in 0..entries {
                let values = matrix_of(n, n, |i, k| self.value(i, k, j, at));
                // Terms of one coordinate at every node of the other; reciprocity gives the other coordinate's.
                for degree in [n - 2, n - 1] {
                    for k in 0..n {
                        let term: f64 = terms[degree].iter().zip(&values).map(|(weight, row)| weight * row[k]).sum();
                        sum += term * term / n as f64;
                    }
                }
            }
        }
        (sum / (entries * wavelengths) as f64).sqrt()
    }

    /// The cell's efficiencies at one wavelength, in the order of [`EfficiencyLayout`].
    fn packed(&self, j: usize, stored: usize) -> Vec<u16> {
        let (width, solved) = (self.index + 1, self.nodes);
        let entries = width * width;
        let resample = resampling(solved, stored);
        // Resamples the second coordinate, then the first.
        let mut half_way = vec![0.0; solved * stored * entries];
        for i in 0..solved {
            for k in 0..solved {
                for (g, weights) in resample.iter().enumerate() {
                    let to = &mut half_way[(i * stored + g) * entries..][..entries];
                    for (at, value) in to.iter_mut().enumerate() {
                        *value += weights[k] * self.value(i, k, j, at);
                    }
                }
            }
        }
        let mut halves = Vec::with_capacity(stored * stored * width * (width + 1));
        for weights in &resample {
            for g in 0..stored {
                for incident in 0..width {
                    let mut sum = 0;
                    for at in incident * width..(incident + 1) * width {
                        let value: f64 = weights
                            .iter()
                            .enumerate()
                            .map(|(i, w)| w * half_way[(i * stored + g) * entries + at])
                            .sum();
                        let stored = (value.clamp(0.0, 1.0) / UNIT).round() as u16;
                        sum += u32::from(stored);
                        halves.push(stored);
                    }
                    halves.push(sum.min(u16::MAX.into()) as u16);
                }
            }
        }
        halves
    }
}

/// A matrix `[row][column]` of a function.
fn matrix_of(rows: usize, columns: usize, value: impl Fn(usize, usize) -> f64) -> Vec<Vec<f64>> {
    (0..rows).map(|i| (0..columns).map(|k| value(i, k)).collect()).collect()
}

/// Angles of the Chebyshev nodes over [0, π].
pub(super) fn chebyshev_angles(count: usize) -> impl Iterator<Item = f64> {
    (0..count).map(move |k| 0.5 * PI * (1.0 + (PI * (k as f64 + 0.5) / count as f64).cos()))
}

/// Matrix `[stored][solved]` that takes values at Chebyshev nodes to values at the table's nodes.
pub(super) fn resampling(solved: usize, stored: usize) -> Vec<Vec<f64>> {
    matrix_of(stored, solved, |g, k| {
        let x = unstretched(g as f64 / (stored - 1) as f64);
        // The table node's position in [−1, 1], as an angle.
        let turn = ((1.0 - 2.0 * x).acos() / PI * 2.0 - 1.0).clamp(-1.0, 1.0).acos();
        let angle = PI * (k as f64 + 0.5) / solved as f64;
        let sum: f64 = (1..solved).map(|n| (n as f64 * turn).cos() * (n as f64 * angle).cos()).sum();
        (1.0 + 2.0 * sum) / solved as f64
    })
}

/// Averages a matrix on the diagonal with its mirror image, from which it differs by the solver's rounding alone.
fn make_reciprocal(matrix: &mut [f64], s: usize) {
    let width = s + 1;
    let before = matrix.to_vec();
    for (at, value) in matrix.iter_mut().enumerate() {
        *value = 0.5 * (*value + before[(s - at % width) * width + s - at / width]);
    }
}
