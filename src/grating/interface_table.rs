//! Build of the tables of an interface (symbols: `mod.rs`; the cells of the air and of the medium: [`InterfaceCells`]).
//!
//! A table holds one value for each pair of *channels* (orders on a side of the relief): an efficiency, or the shape
//! of a Jones matrix. Wave numbers are along x, in units of 2π over the period d. `a` is that of the incident wave; t
//! and tm bound the magnitude of those that propagate in the air and in the medium. A *cell of the air* has the
//! incident waves at which given orders propagate in the air. In a *cell of the medium* nothing propagates in the air,
//! tm takes the place of t, and the orders are those of the medium. The index s of a cell is the number of these
//! orders minus 1.
//!
//! The fractional parts p of t − a and q of t + a are a wave's position in its cell. Cells are solved at nodes with
//! equal steps in the coordinate of look-ups, `node_coordinate` of p and of q (`cell_position.rs`). Matrices are
//! stored at these nodes. Efficiencies, which vary more, are interpolated by cubics to more nodes. Polynomials through
//! Chebyshev nodes, as in `build.rs`, converge slowly here, since efficiencies have singularities inside the cells of
//! an interface.
//!
//! A channel in the medium may propagate at only some nodes of a cell. At the other nodes it gets a value from a
//! neighbouring node at which it propagates, so that look-ups can interpolate between them. Half of the nodes follow by
//! reciprocity, as in `build.rs`: on the reversed path, p and q are exchanged.

use super::GratingError;
use super::build::{EfficiencyTable, RANDOM_SEED, error_statistics, offsets_and_halves, packed_rows};
use super::cell_position::fraction_at;
use super::chebyshev::{triangle_count, triangle_index, triangle_nodes};
use super::efficiencies::EfficiencyView;
use super::interface_solver::{InterfaceCell, InterfaceSolver, propagates};
use super::layout::{Below, EfficiencyLayout, InterfaceCells};
use super::wavelengths::{STEPS_NM, table_wavelengths};
use crate::numeric::Plain;
use crate::table::{Estimate, Progress, WAVELENGTH_MAX_NM, WAVELENGTH_MIN_NM};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use rayon::prelude::*;
use std::f64::consts::TAU;
use sunbeam_rigorous::{Channel, Scattering, Side};

/// Solved nodes along either side of a cell, with equal steps in the coordinate of look-ups. More nodes reduce the
/// error, but the build time grows as the square of their number. Also the fewest nodes of any table of Jones matrices:
/// the error is then about twice that with the most nodes (`jones_table.rs`).
pub(super) const NODES: usize = 12;
/// Nodes of the table of efficiencies along either side of a cell, interpolated from the solved ones by cubics; also
/// the fewest of a reflector's or film's table (`plan.rs`). Linear look-ups err less between more nodes, but the
/// table's size grows as the square of their number. On the *reference grating*, a sinusoid of period 0.6 µm, height
/// 0.2 µm and index 1.5, the RMS error of an efficiency is 0.003. It is 0.005 with the solved nodes alone.
pub(super) const STORED: usize = 18;
/// Largest step between wavelengths in nm, 40. Twice this step doubles the error.
const STEP_NM: f64 = STEPS_NM[1];
/// Smallest p, q, 1 − p and 1 − q of a solved node. On the border of its cell, where one of these is 0, an order has
/// its cut-off, at which the solver's lattice sum has a pole. Larger values displace the nodes noticeably.
const BORDER: f64 = 1e-5;
/// Bytes of the 16-bit efficiencies of a pair of channels in one cell at one wavelength.
pub(super) const PAIR_BYTES: f64 = (2 * STORED * STORED) as f64;

/// Wavelengths and cells of a table of an interface.
pub(super) struct InterfacePlan {
    /// Wavelengths in nm, ascending.
    pub nm: Vec<f64>,
    /// Each cell, with the number of wavelengths, from the shortest on, that have it. In the order of the table: cells
    /// of the air, then those of the medium.
    pub cells: Vec<(InterfaceCell, usize)>,
    /// Refractive index n of the medium.
    eta: f64,
}

impl InterfacePlan {
    /// Plans the tables of a grating of this period on a medium of index `eta`.
    pub(super) fn new(period_um: f64, eta: f64) -> Self {
        let (nm, _) = table_wavelengths(period_um, Some(STEP_NM));
        // Largest bound of |a| at wavelength j. In cells of the air it is t = d/λ, at ky = 0; in cells of the medium
        // tm = √(n² − 1)·d/λ, at |ky| = k.
        let factor_in_medium = (eta * eta - 1.0).sqrt();
        let largest_bound =
            |j: usize, in_air: bool| 1e3 * period_um / nm[j] * if in_air { 1.0 } else { factor_in_medium };
        // Whether wavelength j has the cell of this index: s = ⌊t − a⌋ + ⌊t + a⌋ is at most 2t. Look-ups interpolate
        // between two wavelengths, so a wavelength has all cells of the next shorter one, which has more.
        let has_cell =
            |j: usize, in_air: bool, index: i32| index <= (2.0 * largest_bound(j.saturating_sub(1), in_air)) as i32;
        // Number of orders that may propagate in the medium alone, at either end of those that propagate in the air:
        // tm − t, rounded up, with tm² = t² + (n² − 1)(d/λ)². The difference is largest at the cell's smallest t, s/2,
        // and at the shortest wavelength. `largest_bound(0, false)` is the root of the second term.
        let further_orders = |index: i32| {
            let t = 0.5 * f64::from(index.max(0));
            let tm = t.hypot(largest_bound(0, false));
            (tm - t).ceil() as u32
        };
        let mut cells = Vec::new();
        // In cell −1 of the air, orders propagate in the medium alone.
        for (in_air, first) in [(true, -1), (false, 0)] {
            for index in (first..).take_while(|&index| has_cell(0, in_air, index)) {
                let extra = if in_air { further_orders(index) } else { 0 };
                let wavelengths = (0..nm.len()).take_while(|&j| has_cell(j, in_air, index)).count();
                cells.push((InterfaceCell { in_air, index, extra }, wavelengths));
            }
        }
        Self { nm, cells, eta }
    }

    /// Layout of a table with this number of nodes along either side of a cell.
    pub(super) fn layout(&self, nodes: usize) -> EfficiencyLayout {
        let air_cells = self.cells.iter().filter(|(cell, _)| cell.in_air).count() as u32;
        let below = Below::Interface(InterfaceCells { eta: self.eta, air_cells });
        EfficiencyLayout::new(&self.nm, self.cells.len(), nodes, below)
    }

    /// Solves all cells. Returns what `pack(solved cell, wavelength)` stores of each, `[wavelength][cell][item]`, empty
    /// where a wavelength does not have the cell. `extract` and `transposed` are those of [`SolvedCell::solve`].
    ///
    /// # Errors
    /// A point that cannot be solved accurately enough.
    pub(super) fn tabulated<T: Copy + Default + Send + Sync, W: Clone + Send>(
        &self,
        solver: &InterfaceSolver<'_>,
        progress: &Progress,
        extract: impl Fn(&Scattering, Channel, Channel) -> T + Sync,
        transposed: fn(T) -> T,
        pack: impl Fn(&SolvedCell<T>, usize) -> Vec<W> + Sync,
    ) -> Result<Vec<Vec<Vec<W>>>, GratingError> {
        let mut packed: Vec<Vec<Vec<W>>> = vec![Vec::new(); self.nm.len()];
        for (done, &(cell, count)) in self.cells.iter().enumerate() {
            progress.report(done as f64 / self.cells.len() as f64);
            let solved = SolvedCell::solve(cell, solver, &self.nm[..count], &extract, transposed)?;
            let items: Vec<_> = (0..count).into_par_iter().map(|j| pack(&solved, j)).collect();
            // Longer wavelengths do not have the cell.
            let absent = std::iter::repeat_with(Vec::new);
            packed.iter_mut().zip(items.into_iter().chain(absent)).for_each(|(cells, items)| cells.push(items));
        }
        Ok(packed)
    }

    /// [`InterfaceCell::extra`] of each cell, a word each.
    pub(super) fn extras(&self) -> Vec<u32> {
        self.cells.iter().map(|(cell, _)| cell.extra).collect()
    }

    /// Cost of a table's build on two cores. `seconds` is the time on one core for the solution at one node and
    /// wavelength. `pair_bytes` is the size of the values of a pair of channels in one cell at one wavelength.
    pub(super) fn estimate(&self, seconds: f64, pair_bytes: f64) -> Estimate {
        // Numbers of wavelengths, and of pairs of channels at each, summed over cells.
        let wavelengths: f64 = self.cells.iter().map(|&(_, count)| count as f64).sum();
        let pairs: f64 = self.cells.iter().map(|&(cell, count)| (cell.channels() as f64).powi(2) * count as f64).sum();
        // Nodes on the diagonal p = q and on one side of it.
        let solved_nodes = triangle_count(NODES) as f64;
        let cores = 2.0;
        Estimate { bytes: pair_bytes * pairs, seconds: solved_nodes / cores * seconds * wavelengths }
    }
}

/// Values of all pairs of channels in one cell, at the table's nodes. The *entry* of a pair is its index
/// `incident · channels + outgoing`.
pub(super) struct SolvedCell<T> {
    cell: InterfaceCell,
    /// Turns the value of a pair into the value of the pair on the reversed path.
    transposed: fn(T) -> T,
    /// `[node of triangle_nodes][wavelength][entry]`; `None` where one of the pair's channels does not propagate.
    values: Vec<Vec<Vec<Option<T>>>>,
}

impl<T: Copy + Default + Send + Sync> SolvedCell<T> {
    /// Solves a cell. `extract(solution, outgoing channel, incident channel)` is the value of a pair; `transposed` is
    /// the field of the same name.
    ///
    /// # Errors
    /// A point that cannot be solved accurately enough.
    pub(super) fn solve(
        cell: InterfaceCell,
        solver: &InterfaceSolver<'_>,
        wavelengths_nm: &[f64],
        extract: impl Fn(&Scattering, Channel, Channel) -> T + Sync,
        transposed: fn(T) -> T,
    ) -> Result<Self, GratingError> {
        let channels = cell.channels();
        // p or q of solved node g.
        let fraction = |g: usize| fraction_at(g as f64 / (NODES - 1) as f64).clamp(BORDER, 1.0 - BORDER);
        let value = |scattering: &Scattering, entry: usize| {
            let [from, out] = [entry / channels, entry % channels].map(|number| cell.channel(number));
            let both = propagates(scattering, from) && propagates(scattering, out);
            both.then(|| extract(scattering, out, from))
        };
        let values_of =
            |scattering: &Scattering| (0..channels * channels).map(|entry| value(scattering, entry)).collect();
        let values = triangle_nodes(NODES)
            .par_iter()
            .map(|&[i, k]| {
                let solutions = solver.solve(cell.in_air, cell.wave([fraction(i), fraction(k)]), wavelengths_nm)?;
                Ok(solutions.iter().map(values_of).collect())
            })
            .collect::<Result<_, GratingError>>()?;
        Ok(Self { cell, transposed, values })
    }

    /// Number of channels.
    fn channels(&self) -> usize {
        self.cell.channels()
    }

    /// Entry of the pair on the reversed path.
    fn reversed(&self, entry: usize) -> usize {
        let channels = self.channels();
        self.cell.opposite(entry % channels) * channels + self.cell.opposite(entry / channels)
    }

    /// Value at node i of p, node k of q, and wavelength j; `None` where one of the pair's channels does not
    /// propagate. Beyond the diagonal p = q, i < k, the value is that of the reversed path, which was solved at the
    /// node mirrored in the diagonal.
    fn value(&self, [j, i, k]: [usize; 3], entry: usize) -> Option<T> {
        let values = &self.values[triangle_index(i, k)][j];
        if i < k { values[self.reversed(entry)].map(self.transposed) } else { values[entry] }
    }

    /// Values of all entries at node i of p, node k of q, and wavelength j.
    ///
    /// A pair that does not propagate at the node gets `beyond(value, is_mirror)`. `value` is that at the nearest
    /// neighbour, at most one step away along each axis, at which the pair propagates. Without such a neighbour the
    /// pair gets zero. `is_mirror` tells whether both channels are the same, as in a mirror reflection.
    fn filled(&self, [j, i, k]: [usize; 3], beyond: fn(T, bool) -> T) -> Vec<T> {
        // Indices at most one step away, among `count`.
        let near = |at: usize, count: usize| at.saturating_sub(1)..(at + 2).min(count);
        // Neighbours are those of the node or of its mirror image with i ≥ k, so that the table is exactly reciprocal.
        let (high, low) = (i.max(k), i.min(k));
        let mut neighbours: Vec<[usize; 3]> = near(j, self.values[0].len())
            .flat_map(|j| near(high, NODES).flat_map(move |i| near(low, NODES).map(move |k| [j, i, k])))
            .collect();
        // The factor 4 puts neighbours at the same wavelength first: the other two distances add up to at most 2.
        neighbours.sort_by_key(|at| 4 * at[0].abs_diff(j) + at[1].abs_diff(high) + at[2].abs_diff(low));
        let own_or_near = |entry: usize| {
            let is_mirror = entry / self.channels() == entry % self.channels();
            let neighbour = || neighbours.iter().find_map(|&at| self.value(at, entry));
            self.value([j, high, low], entry).or_else(|| Some(beyond(neighbour()?, is_mirror))).unwrap_or_default()
        };
        // Beyond the diagonal a value follows from the node's mirror image. On the diagonal, of two entries that are
        // each other's reverse, the second follows from the first.
        let value = |entry: usize| {
            let reversed = self.reversed(entry);
            let is_reversed = i < k || i == k && reversed < entry;
            if is_reversed { (self.transposed)(own_or_near(reversed)) } else { own_or_near(entry) }
        };
        (0..self.channels().pow(2)).map(value).collect()
    }

    /// Values at wavelength j, `[node of p][node of q][entry]`, with `beyond` of [`SolvedCell::filled`].
    pub(super) fn at_wavelength(&self, j: usize, beyond: fn(T, bool) -> T) -> impl Iterator<Item = Vec<T>> + '_ {
        (0..NODES * NODES).map(move |node| self.filled([j, node / NODES, node % NODES], beyond))
    }
}

/// Cubic interpolation to the nodes of the table of efficiencies. Each has the index of the first of four solved nodes,
/// and the weights of the four.
fn cubics() -> Vec<(usize, [f64; 4])> {
    let of_node = |g: usize| {
        // Position of node g of the table, in solved nodes from the first.
        let x = (g * (NODES - 1)) as f64 / (STORED - 1) as f64;
        let first = (x as usize).saturating_sub(1).min(NODES - 4);
        // Lagrange's weight of the i-th of the four.
        let weight = |i: usize| {
            let others = (0..4).filter(|&other| other != i);
            others.map(|other| (x - (first + other) as f64) / (i as f64 - other as f64)).product()
        };
        (first, std::array::from_fn(weight))
    };
    (0..STORED).map(of_node).collect()
}

/// 16-bit entries of a cell at wavelength j, `[node of p][node of q][entry]`.
fn packed_cell(solved: &SolvedCell<f64>, j: usize) -> Vec<u16> {
    let (channels, cubics) = (solved.channels(), cubics());
    // Values of pairs at a node where one of their channels does not propagate. At the channel's cut-off efficiencies
    // vanish as a root, and its mirror reflection becomes total. The cut-off may lie anywhere between the node and its
    // neighbour, so half of the neighbour's value is taken. With the whole value, the RMS error on the reference
    // grating (`STORED`) is 0.005 instead of 0.003.
    let beyond = |efficiency: f64, is_mirror: bool| if is_mirror { 1.0 } else { 0.5 * efficiency };
    let values: Vec<Vec<f64>> = solved.at_wavelength(j, beyond).collect();
    let nodes = cubics.iter().flat_map(|along_p| cubics.iter().map(move |along_q| (along_p, along_q)));
    nodes
        .flat_map(|((first_i, weights_p), (first_k, weights_q))| {
            let mut sum = vec![0.0; channels * channels];
            for (i, weight_p) in weights_p.iter().enumerate() {
                for (k, weight_q) in weights_q.iter().enumerate() {
                    let node = &values[(first_i + i) * NODES + first_k + k];
                    sum.iter_mut().zip(node).for_each(|(sum, value)| *sum += weight_p * weight_q * value);
                }
            }
            packed_rows(&sum, channels)
        })
        .collect()
}

/// Builds the table of efficiencies of an interface.
///
/// # Errors
/// A point that cannot be solved accurately enough.
pub(super) fn build_efficiencies(
    period_um: f64,
    solver: &InterfaceSolver<'_>,
    progress: &Progress,
) -> Result<EfficiencyTable, GratingError> {
    let plan = InterfacePlan::new(period_um, solver.eta);
    let efficiency = |scattering: &Scattering, out, from| scattering.efficiency(out, from);
    let packed = plan.tabulated(solver, progress, efficiency, |value| value, packed_cell)?;
    let words = offsets_and_halves(&packed, &plan.extras());
    Ok(EfficiencyTable { layout: plan.layout(STORED), words, solved: triangle_count(NODES) * plan.cells.len() })
}

/// RMS and 99th percentile of the absolute error of an efficiency. The reference is solved at `count` random
/// incidences, alternately from above and below: wavelengths are uniform, directions uniform over the projected
/// hemisphere.
///
/// # Errors
/// An incidence that cannot be solved accurately enough.
pub(super) fn efficiency_error(
    table: &EfficiencyTable,
    period_um: f64,
    solver: &InterfaceSolver<'_>,
    count: usize,
) -> Result<(f64, f64), GratingError> {
    let mut random = Pcg64Mcg::seed_from_u64(RANDOM_SEED);
    // Wavelength in nm, direction cosines x and y of the light's travel in the medium it comes from, and whether this
    // medium is below.
    let incidences: Vec<([f64; 3], bool)> = (0..count)
        .map(|i| {
            let nm = random.random_range(WAVELENGTH_MIN_NM..WAVELENGTH_MAX_NM);
            let (radius, phi) = (random.random::<f64>().sqrt(), random.random_range(0.0..TAU));
            ([nm, radius * phi.cos(), radius * phi.sin()], i % 2 == 1)
        })
        .collect();
    let view = EfficiencyView::<Plain<f64>> { layout: table.layout, words: &table.words };
    // Evaluators read a table only in the lanes of a SIMD vector where this mask is true. A plain number has one.
    let active = true;
    let errors = incidences
        .par_iter()
        .map(|&([nm, x, y], from_below)| {
            let refractive_index = |below: bool| if below { solver.eta } else { 1.0 };
            let periods = 1e3 * period_um / nm;
            // ky/k is beyond ±1 for some light from below. `periods` is d/λ.
            let (ky_over_k, a) = (refractive_index(from_below) * y, refractive_index(from_below) * x * periods);
            let channels = view.channels(&view.bounds(periods, ky_over_k), a, active);
            let (incident, _) = channels.of_order(0.0, from_below);
            let in_air = ky_over_k.abs() < 1.0;
            // t where ky propagates in the air, else tm.
            let bound = periods * (refractive_index(!in_air).powi(2) - ky_over_k * ky_over_k).sqrt();
            let solutions = solver.solve(in_air, (bound, a), &[nm])?;
            let row = view.row(&channels, incident, nm, active);
            let from = Channel { side: side(from_below), order: 0 };
            let errors = (0..channels.count).filter_map(|channel| {
                let (m, is_below) = channels.order(channel);
                let (_, propagates) = channels.of_order(m, is_below);
                let out = Channel { side: side(is_below), order: m as i32 };
                propagates.then(|| (view.entry(&row, channel, active) - solutions[0].efficiency(out, from)).abs())
            });
            Ok(errors.collect::<Vec<_>>())
        })
        .collect::<Result<Vec<_>, GratingError>>()?;
    Ok(error_statistics(errors.concat()))
}

/// The side below the relief if `is_below`, else the side above.
fn side(is_below: bool) -> Side {
    if is_below { Side::Below } else { Side::Above }
}
