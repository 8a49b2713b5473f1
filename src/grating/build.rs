//! Build of the table of efficiencies of a reflector or film from solved points (symbols: `mod.rs`).
//!
//! A cell s has the incident waves at which s + 1 orders propagate. (p, q) is a wave's position in its cell, each from
//! 0 to 1. It gives a *point* (t, b): t is the bound of the propagating orders' wave numbers along x, and b their Bloch
//! phase, both in units of 2π over the period. Each cell is solved at Chebyshev nodes and resampled to the table's
//! nodes. The number of Chebyshev nodes grows until the efficiencies' highest Chebyshev terms are small. Half of the
//! nodes follow by reciprocity: on the reversed path, p and q are exchanged, and order numbers count from the other
//! side.

use super::GratingError;
use super::cell_position::wave_at;
use super::chebyshev::{
    coefficient_matrix, matrix_of, node_fractions, resampling_matrix, triangle_index, triangle_nodes,
};
use super::efficiencies::{EfficiencyView, UNIT};
use super::layout::{Below, EfficiencyLayout};
use super::order_solver::OrderSolver;
use super::wavelengths::{Spacing, at_all_wavelengths, solved_indices, table_wavelengths, wavelengths_with_cell};
use crate::numeric::Plain;
use crate::table::{Progress, WAVELENGTH_MAX_NM, WAVELENGTH_MIN_NM};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::f64::consts::TAU;

/// Resolution of a table, and of the solution behind it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct TableResolution {
    /// Nodes of the table along either side of a cell.
    pub stored: usize,
    /// Spacing of wavelengths; `None` where efficiencies do not depend on them at given t and b.
    pub spacing: Option<Spacing>,
    /// Largest accepted RMS of an efficiency's two highest Chebyshev terms; a cell above it is solved at more nodes.
    pub tolerance: f64,
}

/// Numbers of Chebyshev nodes along either side of a cell, tried in turn: 24 divided by powers of √2, so that each has
/// about twice the points of the one before. Larger numbers take more time; smaller ones leave larger errors.
pub(super) const NODE_COUNTS: [usize; 4] = [8, 12, 17, 24];
/// RMS of the highest terms, as a fraction of the tolerance, up to which the next cell begins with fewer nodes.
/// Neighbouring cells need similar numbers: larger values lead to more repeated solutions, smaller ones to more nodes
/// than needed.
const FEWER_BELOW: f64 = 0.25;

/// Seed of the random incidences at which tables are tested; arbitrary.
pub(super) const RANDOM_SEED: u64 = 1;

/// Size, cost and measured error of a grating's table.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct GratingReport {
    /// Bytes of the table.
    pub bytes: usize,
    /// Number of solved points (t, b), each at the solved wavelengths of its cell.
    pub solved: usize,
    /// Root mean square error of an order's unpolarised efficiency, at random incidences and wavelengths.
    pub rms: f64,
    /// 99th percentile of the absolute error of an efficiency, at the same incidences and wavelengths.
    pub p99: f64,
    /// Build time in seconds, with that of the meshes and of the error's measurement.
    pub build_seconds: f64,
}

/// A table of efficiencies.
#[derive(Debug, Serialize, Deserialize)]
pub(super) struct EfficiencyTable {
    pub layout: EfficiencyLayout,
    /// Table data, arranged as [`EfficiencyLayout`] describes.
    pub words: Vec<u32>,
    /// Number of solved points (t, b).
    pub solved: usize,
}

impl EfficiencyTable {
    /// Solves the cells of a grating and tabulates their efficiencies.
    ///
    /// # Errors
    /// A point that cannot be solved accurately enough.
    pub(super) fn build(
        period_um: f64,
        solver: &impl OrderSolver,
        table_resolution: TableResolution,
        progress: &Progress,
    ) -> Result<Self, GratingError> {
        let sides = solver.sides();
        let (nm, cell_counts) = table_wavelengths(period_um, table_resolution.spacing.map(|spacing| spacing.step_nm));
        // Steps from one solved wavelength to the next.
        let every = table_resolution.spacing.map_or(1, |spacing| spacing.solved_every);
        let cells = cell_counts[0];
        // Index in NODE_COUNTS at which the next cell begins, and number of points solved so far.
        let (mut count_index, mut solved) = (0, 0);
        // 16-bit entries of each cell: `[wavelength][cell][entry]`.
        let mut packed: Vec<Vec<Vec<u16>>> = vec![Vec::new(); nm.len()];
        // Progress counts the orders of each cell: larger cells take longer.
        let work: usize = (1..=cells).sum();
        let mut done = 0;
        for s in 0..cells {
            // The cell exists at the first `count` wavelengths.
            let count = wavelengths_with_cell(s, &cell_counts);
            let solved_at = solved_indices(count, every);
            let solved_nm: Vec<f64> = solved_at.iter().map(|&j| nm[j]).collect();
            let tolerance = table_resolution.tolerance;
            let mut cell = Cell::solve(s, solver, &solved_nm, tolerance, &mut count_index, &mut solved)?;
            // Interpolates to the wavelengths in between.
            for matrices in &mut cell.matrices {
                *matrices = at_all_wavelengths(&solved_at, std::mem::take(matrices));
            }
            for (j, packed_cells) in packed.iter_mut().enumerate().take(count) {
                packed_cells.push(cell.packed(j, table_resolution.stored));
            }
            done += s + 1;
            progress.report(done as f64 / work as f64);
        }
        // Only tables of interfaces have further words between the offsets and the entries.
        let words = offsets_and_halves(&packed, &[]);
        let layout = EfficiencyLayout::new(&nm, cells, table_resolution.stored, Below::of_sides(sides));
        Ok(Self { layout, words, solved })
    }

    /// RMS and 99th percentile of the absolute error of an efficiency. The reference is solved at `count` random
    /// wavelengths and incidences, uniform over the projected hemisphere.
    ///
    /// # Errors
    /// An incidence that cannot be solved accurately enough.
    pub(super) fn error(
        &self,
        period_um: f64,
        solver: &impl OrderSolver,
        count: usize,
    ) -> Result<(f64, f64), GratingError> {
        let mut random = Pcg64Mcg::seed_from_u64(RANDOM_SEED);
        // Wavelength in nm, and direction cosines x and y of the light's travel.
        let incidences: Vec<[f64; 3]> = (0..count)
            .map(|_| {
                let nm = random.random_range(WAVELENGTH_MIN_NM..WAVELENGTH_MAX_NM);
                let (radius, phi) = (random.random::<f64>().sqrt(), random.random_range(0.0..TAU));
                [nm, radius * phi.cos(), radius * phi.sin()]
            })
            .collect();
        let errors = incidences
            .par_iter()
            .map(|&[nm, x, y]| {
                let periods = 1e3 * period_um / nm;
                let (t, a) = (periods * (1.0 - y * y).sqrt(), periods * x);
                // The Bloch phase is any number that differs from a by an integer, such as a itself.
                let solved = solver.efficiencies(t, a, &[nm])?;
                let view = EfficiencyView::<Plain<f64>> { layout: self.layout, words: &self.words };
                // The last argument masks the lanes of a SIMD vector. A plain number has a single lane.
                let channels = view.channels(&view.bounds(periods, y), a, true);
                let channel_count = channels.count as usize;
                let mut errors = Vec::new();
                for side in 0..solver.sides() {
                    // Incident light is order 0 on its side.
                    let (incident, _) = channels.of_order(0.0, side == 1);
                    let row = view.row(&channels, incident, nm, true);
                    // The row of the incident channel, in the matrix at the only wavelength. The solver numbers
                    // channels as the table does.
                    let exact = &solved[0][incident as usize * channel_count..][..channel_count];
                    for (outgoing, exact) in exact.iter().enumerate() {
                        errors.push((view.entry(&row, outgoing as u32, true) - exact).abs());
                    }
                }
                Ok(errors)
            })
            .collect::<Result<Vec<_>, GratingError>>()?
            .concat();
        Ok(error_statistics(errors))
    }
}

/// Table data: the offsets of all cells, in halves of words, then the words `further`, then the 16-bit entries of
/// `packed`, two to a word. `packed` is `[wavelength][cell][entry]`; longer wavelengths may have fewer cells than the
/// first.
pub(super) fn offsets_and_halves(packed: &[Vec<Vec<u16>>], further: &[u32]) -> Vec<u32> {
    let cells = packed[0].len();
    // In words.
    let header = packed.len() * cells + further.len();
    let mut offsets = vec![0u32; packed.len() * cells];
    let mut halves: Vec<u16> = Vec::new();
    for (j, packed_cells) in packed.iter().enumerate() {
        for (s, cell) in packed_cells.iter().enumerate() {
            offsets[j * cells + s] = (2 * header + halves.len()) as u32;
            halves.extend(cell);
        }
    }
    let word = |pair: &[u16]| u32::from(pair[0]) | u32::from(pair.get(1).copied().unwrap_or_default()) << 16;
    offsets.into_iter().chain(further.iter().copied()).chain(halves.chunks(2).map(word)).collect()
}

/// RMS and 99th percentile of absolute errors; zero if there are none.
pub(super) fn error_statistics(mut errors: Vec<f64>) -> (f64, f64) {
    errors.sort_by(f64::total_cmp);
    let rms = (errors.iter().map(|error| error * error).sum::<f64>() / errors.len().max(1) as f64).sqrt();
    let p99 = errors.get(errors.len() * 99 / 100).copied().unwrap_or_default();
    (rms, p99)
}

/// Efficiencies of one cell at Chebyshev nodes.
struct Cell {
    /// Index s of the cell.
    index: usize,
    /// Number of sides of the relief on which light arrives and leaves, 1 or 2.
    sides: usize,
    /// Number of Chebyshev nodes along either side of the cell.
    nodes: usize,
    /// `[node of triangle_nodes][wavelength]`, each a matrix of [`OrderSolver::efficiencies`].
    matrices: Vec<Vec<Vec<f64>>>,
}

impl Cell {
    /// Solves a cell with the first of [`NODE_COUNTS`] whose highest terms meet the tolerance, or with the
    /// largest number.
    ///
    /// `count_index` is the index in [`NODE_COUNTS`] to begin with, and is updated for the next cell. The number of
    /// solved points is added to `solved`.
    ///
    /// # Errors
    /// A point that cannot be solved accurately enough.
    fn solve(
        index: usize,
        solver: &impl OrderSolver,
        wavelengths_nm: &[f64],
        tolerance: f64,
        count_index: &mut usize,
        solved: &mut usize,
    ) -> Result<Self, GratingError> {
        loop {
            let cell = Self::solve_at(index, solver, wavelengths_nm, NODE_COUNTS[*count_index])?;
            *solved += cell.matrices.len();
            let highest = cell.highest_terms();
            if highest <= tolerance || *count_index + 1 == NODE_COUNTS.len() {
                if *count_index > 0 && highest <= FEWER_BELOW * tolerance {
                    *count_index -= 1;
                }
                return Ok(cell);
            }
            *count_index += 1;
        }
    }

    /// Solves a cell at `nodes` Chebyshev nodes along either side.
    fn solve_at(
        index: usize,
        solver: &impl OrderSolver,
        wavelengths_nm: &[f64],
        nodes: usize,
    ) -> Result<Self, GratingError> {
        let fractions = node_fractions(nodes);
        let matrices = triangle_nodes(nodes)
            .par_iter()
            .map(|&[i, k]| {
                let (t, b) = wave_at(index as i32, [fractions[i], fractions[k]]);
                let mut matrices = solver.efficiencies(t, b, wavelengths_nm)?;
                if i == k {
                    matrices.iter_mut().for_each(|matrix| symmetrise(matrix, index, solver.sides()));
                }
                Ok(matrices)
            })
            .collect::<Result<Vec<_>, GratingError>>()?;
        Ok(Self { index, sides: solver.sides(), nodes, matrices })
    }

    /// Efficiency at node i of p, node k of q, and wavelength j; `entry` is `incident · channels + outgoing`. Beyond
    /// the diagonal, i < k, the efficiency is that of the reversed path.
    fn value(&self, i: usize, k: usize, j: usize, entry: usize) -> f64 {
        let matrix = &self.matrices[triangle_index(i, k)][j];
        matrix[if i < k { reversed(entry, self.index, self.sides) } else { entry }]
    }

    /// RMS of the two highest Chebyshev terms along p together: the root of the sum of their squares, averaged over
    /// efficiencies, wavelengths and nodes of q. The terms along q are equal by reciprocity.
    fn highest_terms(&self) -> f64 {
        let n = self.nodes;
        let coefficients = coefficient_matrix(n);
        let (entries, wavelengths) = (self.channels().pow(2), self.matrices[0].len());
        let mut sum = 0.0;
        for j in 0..wavelengths {
            for entry in 0..entries {
                let values = matrix_of(n, n, |i, k| self.value(i, k, j, entry));
                for degree in [n - 2, n - 1] {
                    for k in 0..n {
                        let term: f64 =
                            coefficients[degree].iter().zip(&values).map(|(weight, row)| weight * row[k]).sum();
                        sum += term * term / n as f64;
                    }
                }
            }
        }
        (sum / (entries * wavelengths) as f64).sqrt()
    }

    /// Number of channels.
    fn channels(&self) -> usize {
        (self.index + 1) * self.sides
    }

    /// 16-bit entries of the cell at wavelength j, in the order of [`EfficiencyLayout`], for `stored` nodes along
    /// either side.
    fn packed(&self, j: usize, stored: usize) -> Vec<u16> {
        let channels = self.channels();
        let entries = channels * channels;
        let resampling = resampling_matrix(self.nodes, stored);
        // Resampled along q, not yet along p: `[Chebyshev node i of p][stored node g of q][entry]`.
        let mut along_q = vec![0.0; self.nodes * stored * entries];
        for i in 0..self.nodes {
            for k in 0..self.nodes {
                for (g, weights) in resampling.iter().enumerate() {
                    let row = &mut along_q[(i * stored + g) * entries..][..entries];
                    for (entry, value) in row.iter_mut().enumerate() {
                        *value += weights[k] * self.value(i, k, j, entry);
                    }
                }
            }
        }
        // Resampled along p, by stored nodes of p, then those of q.
        let mut halves = Vec::with_capacity(stored * stored * channels * (channels + 1));
        for weights in &resampling {
            for g in 0..stored {
                let value = |entry: usize| {
                    let column = (0..self.nodes).map(|i| along_q[(i * stored + g) * entries + entry]);
                    weights.iter().zip(column).map(|(weight, value)| weight * value).sum::<f64>()
                };
                let values: Vec<f64> = (0..entries).map(value).collect();
                halves.extend(packed_rows(&values, channels));
            }
        }
        halves
    }
}

/// 16-bit entries of one node in units of [`UNIT`]: the row of each incident channel, followed by the sum of its stored
/// entries, clipped to 16 bits. `values` are `[incident · channels + outgoing]`.
pub(super) fn packed_rows(values: &[f64], channels: usize) -> Vec<u16> {
    // `chunks` refuses 0. A cell without channels has no values either.
    let rows = values.chunks(channels.max(1));
    rows.flat_map(|row| {
        let mut units: Vec<u16> = row.iter().map(|value| (value.clamp(0.0, 1.0) / UNIT).round() as u16).collect();
        let sum: u32 = units.iter().map(|&unit| u32::from(unit)).sum();
        units.push(sum.min(u16::MAX.into()) as u16);
        units
    })
    .collect()
}

/// Entry of the reversed path of `entry`, in a matrix of cell `s` with the entries `incident · channels + outgoing`.
/// The outgoing channel becomes the incident one and vice versa, and order numbers count from the other end.
pub(super) fn reversed(entry: usize, s: usize, sides: usize) -> usize {
    let orders = s + 1;
    let channels = orders * sides;
    // Channels are `[side][order number]`. The opposite order lies on the same side of the relief.
    let opposite = |channel: usize| channel - channel % orders + (s - channel % orders);
    opposite(entry % channels) * channels + opposite(entry / channels)
}

/// Replaces a matrix on the diagonal `p = q`, which reciprocity maps to itself, by the mean with its image. The two
/// differ by the solver's error.
fn symmetrise(matrix: &mut [f64], s: usize, sides: usize) {
    let before = matrix.to_vec();
    for (entry, value) in matrix.iter_mut().enumerate() {
        *value = 0.5 * (*value + before[reversed(entry, s, sides)]);
    }
}
