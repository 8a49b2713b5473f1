//! Build of the table of normalised Jones matrices (symbols: `mod.rs`; contents and packets: `polarisation.rs`).
//!
//! A *shape* is a Jones matrix of unit power, `[EE, EH, HE, HH]`, between the states of Ey and Hy; its crossed
//! elements are divided by ky/k (`jones_shape.rs`). A table has the shape of each pair of *channels*, the orders on
//! one side of the relief. Cell s has the incident waves at which s + 1 orders propagate. Nodes of the table are over
//! wavelength and over a wave's position (p, q) in its cell, each from 0 to 1. Cells are solved at *points* (t, b).
//! The wave numbers of all orders along x, in units of 2π over the period, differ by whole numbers; b, the Bloch
//! phase, is one of them, and t bounds the magnitude of those that propagate.

use super::GratingError;
use super::body::GratingBody;
use super::build::reversed;
use super::cell_position::wave_at;
use super::chebyshev::{node_fractions, resampling_matrix, triangle_count, triangle_index, triangle_nodes};
use super::film_solver::FilmSolver;
use super::interface_solver::InterfaceSolver;
use super::interface_table::{InterfacePlan, NODES as INTERFACE_NODES, SolvedCell};
use super::jones_shape::{JonesShape, jones_shape};
use super::layout::{Below, EfficiencyLayout};
use super::order_solver::ShapeSolver;
use super::plan::{CostBasis, choose_spacing, create_meshes, spacing_of};
use super::polarisation::{JonesView, UNIT, ZERO};
use super::rigorous_solver::RigorousSolver;
use super::wavelengths::{STEPS_NM, Spacing, table_wavelengths, wavelengths_with_cell};
use crate::numeric::Numbers;
use crate::table::Progress;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use sunbeam_fourier::num_complex::Complex64;
use sunbeam_rigorous::{Profile, Scattering};

/// Number of Chebyshev nodes along either side of a cell at which matrices are solved, and most nodes of the table.
/// More nodes take longer to solve; with 12 instead of 18, the error in the tests of this file doubles.
const NODES_MAX: usize = 18;
/// Size in bytes up to which a table has more than [`INTERFACE_NODES`], 12, nodes along a side. Larger values allow
/// more accurate tables of gratings with long periods; smaller ones save memory.
const BYTES_MAX: f64 = 24e6;
/// Bytes of a packet, the shape of one matrix.
const PACKET_BYTES: usize = 16;
/// Ratio of the wavelength step of this table to that of the efficiencies. The step can be longer, since anomalies,
/// the resonant peaks of metals, change the polarisation less than the power.
const STEP_RATIO: f64 = 2.0;
/// Largest wavelength step of this table in nm: the second longest that efficiencies have.
const STEP_MAX_NM: f64 = STEPS_NM[1];

/// A table of the shapes of Jones matrices: the polarisation of each order. The order's power is in the table of
/// efficiencies.
///
/// It is arranged as [`EfficiencyLayout`] describes, with two differences. A node has a packet of four words for each
/// pair of channels, `[incident][outgoing]`, the shape of one matrix. Offsets of cells are counted in packets.
///
/// ```
/// use sunbeam::grating::{GratingBody, JonesTable, Profile};
/// use sunbeam::table::Progress;
///
/// // A perfectly conducting sinusoid of period 0.4 µm and height 0.05 µm, and the default limit of the build's cost.
/// let conductor = GratingBody::Reflector(None);
/// let table = JonesTable::new(&Profile::sinusoid(0.4, 0.05)?, conductor, 1.0, &Progress::none())?;
/// // Packets of four words.
/// assert_eq!(table.words().len() % 4, 0);
/// # Ok::<(), sunbeam::grating::GratingError>(())
/// ```
#[derive(Debug, Serialize, Deserialize)]
pub struct JonesTable {
    layout: EfficiencyLayout,
    /// Table data: offsets of cells, then packets.
    words: Vec<u32>,
}

impl JonesTable {
    /// Solves a profile in air on a body, and tabulates the shapes of its orders' matrices. A build may cost up to
    /// `build_limit` times the default limits of [`crate::table`].
    ///
    /// # Errors
    /// The errors of [`GratingSurface::new`](super::GratingSurface::new).
    pub fn new(
        profile: &Profile,
        body: GratingBody<'_>,
        build_limit: f64,
        progress: &Progress,
    ) -> Result<Self, GratingError> {
        let period_um = profile.period_um();
        let meshes = create_meshes(profile, body, cost_basis(period_um, body), build_limit)?;
        let step_of = |spacing: Spacing| (STEP_RATIO * spacing.step_nm).min(STEP_MAX_NM);
        match body {
            GratingBody::Reflector(index) => {
                let step_nm = choose_spacing(&meshes, period_um, index)?.map(step_of);
                let (wavelengths_nm, _) = table_wavelengths(period_um, step_nm);
                Self::build(period_um, &RigorousSolver::new(&meshes, index, &wavelengths_nm)?, step_nm, progress)
            }
            GratingBody::Film(eta) => {
                let solver = FilmSolver { meshes: &meshes, eta };
                let step_nm = Some(step_of(spacing_of(&solver, period_um)?));
                Self::build(period_um, &solver, step_nm, progress)
            }
            GratingBody::Interface(eta) => {
                Self::build_interface(period_um, &InterfaceSolver { meshes: &meshes, eta }, progress)
            }
        }
    }

    /// Solves and tabulates matrices at wavelengths at most `step_nm` apart. This is `None` for a perfect conductor,
    /// whose matrices at given t and b do not depend on the wavelength.
    ///
    /// # Errors
    /// A point that cannot be solved accurately enough.
    fn build(
        period_um: f64,
        solver: &impl ShapeSolver,
        step_nm: Option<f64>,
        progress: &Progress,
    ) -> Result<Self, GratingError> {
        let (nm, cell_counts) = table_wavelengths(period_um, step_nm);
        let cells = cell_counts[0];
        let sides = solver.sides();
        let stored = stored_nodes(&cell_counts, sides);
        // Words of the packets of each cell: `[wavelength][cell][word]`.
        let mut packed: Vec<Vec<Vec<u32>>> = vec![Vec::new(); nm.len()];
        // Progress counts the orders of each cell: larger cells take longer.
        let work: usize = (1..=cells).sum();
        let mut done = 0;
        for s in 0..cells {
            // The cell exists at the first `count` wavelengths.
            let count = wavelengths_with_cell(s, &cell_counts);
            let cell = Cell::solve(s, solver, &nm[..count])?;
            let by_wavelength: Vec<_> = (0..count).into_par_iter().map(|j| cell.packed(j, stored)).collect();
            for (packed_cells, packets) in packed.iter_mut().zip(by_wavelength) {
                packed_cells.push(packets);
            }
            done += s + 1;
            progress.report(done as f64 / work as f64);
        }
        // Only tables of interfaces have further words between the offsets and the packets.
        let words = offsets_and_packets(&packed, &[]);
        Ok(Self { layout: EfficiencyLayout::new(&nm, cells, stored, Below::of_sides(sides)), words })
    }

    /// Solves and tabulates the matrices of an interface.
    ///
    /// # Errors
    /// A point that cannot be solved accurately enough.
    fn build_interface(
        period_um: f64,
        solver: &InterfaceSolver<'_>,
        progress: &Progress,
    ) -> Result<Self, GratingError> {
        let plan = InterfacePlan::new(period_um, solver.eta);
        let shape = |scattering: &Scattering, out, from| {
            jones_shape(scattering.jones(out, from), scattering.ky_squared_ratio())
        };
        let pack = |solved: &SolvedCell<JonesShape>, j: usize| {
            // Where a channel does not propagate it has no power, so its polarisation is arbitrary.
            solved.at_wavelength(j, |shape, _| shape).flatten().flat_map(|shape| packet(&shape)).collect()
        };
        let packed = plan.tabulated(solver, progress, shape, transposed, pack)?;
        let layout = plan.layout(INTERFACE_NODES);
        Ok(Self { layout, words: offsets_and_packets(&packed, &plan.extras()) })
    }

    /// Layout of the table data.
    pub fn layout(&self) -> &EfficiencyLayout {
        &self.layout
    }

    /// Table data: offsets of cells, then packets.
    pub fn words(&self) -> &[u32] {
        &self.words
    }

    /// The table as an evaluator over the numbers `N` reads it; `words` are [`JonesTable::words`].
    pub fn view<N: Numbers>(&self, words: N::Words) -> JonesView<N> {
        JonesView { layout: self.layout, words }
    }
}

/// Quantities by which `plan.rs` estimates the table of a grating with this period on a body. Large tables have
/// [`INTERFACE_NODES`] nodes.
fn cost_basis(period_um: f64, body: GratingBody<'_>) -> CostBasis {
    let points_per_cell = triangle_count(NODES_MAX) as f64;
    let pair_bytes = (PACKET_BYTES * INTERFACE_NODES * INTERFACE_NODES) as f64;
    CostBasis { period_um, sides: body.sides(), points_per_cell, pair_bytes }
}

/// Table data: the offsets of all cells, in packets, then `further` words, filled up to whole packets, then the packets
/// of `packed`, `[wavelength][cell][word]`. Longer wavelengths may have fewer cells than the first.
fn offsets_and_packets(packed: &[Vec<Vec<u32>>], further: &[u32]) -> Vec<u32> {
    let cells = packed[0].len();
    let mut words = vec![0u32; packed.len() * cells];
    words.extend(further);
    words.resize(words.len().next_multiple_of(4), 0);
    for (j, packed_cells) in packed.iter().enumerate() {
        for (s, packets) in packed_cells.iter().enumerate() {
            words[j * cells + s] = (words.len() / 4) as u32;
            words.extend(packets);
        }
    }
    words
}

/// Packet of a shape: one word for each element, the real part in its lower half and the imaginary part in the upper.
/// Each is a 16-bit integer, [`ZERO`] for 0, in steps of [`UNIT`].
fn packet(shape: &JonesShape) -> [u32; 4] {
    let units = |x: f64| (x / UNIT + ZERO).round().clamp(0.0, f64::from(u16::MAX)) as u32;
    shape.map(|element| units(element.re) | units(element.im) << 16)
}

/// Shape of light on the reversed path: by reciprocity, the transpose.
fn transposed([ee, eh, he, hh]: JonesShape) -> JonesShape {
    [ee, he, eh, hh]
}

/// Number of table nodes along either side of a cell: as many as [`BYTES_MAX`] allows, within [`INTERFACE_NODES`]
/// and [`NODES_MAX`]. `cell_counts` has the number of cells at each wavelength.
fn stored_nodes(cell_counts: &[usize], sides: usize) -> usize {
    // Packets for each node (p, q), summed over cells and wavelengths.
    let channels = cell_counts.iter().flat_map(|&cells| (1..=cells).map(|orders| orders * sides));
    let packets: usize = channels.map(|channels| channels * channels).sum();
    let fitting = (BYTES_MAX / (PACKET_BYTES * packets) as f64).sqrt() as usize;
    fitting.clamp(INTERFACE_NODES, NODES_MAX)
}

/// Shapes of one cell at Chebyshev nodes.
struct Cell {
    /// Index s of the cell.
    index: usize,
    /// Number of sides of the relief with channels: 1, or 2 for a transparent body.
    sides: usize,
    /// `[node of triangle_nodes][wavelength][incident · channels + outgoing]`.
    shapes: Vec<Vec<Vec<JonesShape>>>,
}

impl Cell {
    /// Solves a cell at [`NODES_MAX`] Chebyshev nodes along either side.
    ///
    /// # Errors
    /// A point that cannot be solved accurately enough.
    fn solve(index: usize, solver: &impl ShapeSolver, wavelengths_nm: &[f64]) -> Result<Self, GratingError> {
        let fractions = node_fractions(NODES_MAX);
        let shapes = triangle_nodes(NODES_MAX)
            .par_iter()
            .map(|&[i, k]| {
                let (t, b) = wave_at(index as i32, [fractions[i], fractions[k]]);
                solver.shapes(t, b, wavelengths_nm)
            })
            .collect::<Result<Vec<_>, GratingError>>()?;
        Ok(Self { index, sides: solver.sides(), shapes })
    }

    /// Shape at node i of p, node k of q, and wavelength j; `entry` is `incident · channels + outgoing`. Beyond the
    /// diagonal p = q, i < k, the shape is that of the reversed path, transposed.
    fn value(&self, i: usize, k: usize, j: usize, entry: usize) -> JonesShape {
        let shapes = &self.shapes[triangle_index(i, k)][j];
        if i >= k {
            return shapes[entry];
        }
        transposed(shapes[reversed(entry, self.index, self.sides)])
    }

    /// Packets of the cell at wavelength j, `[node of p][node of q][entry][element]`, for `stored` nodes along either
    /// side.
    fn packed(&self, j: usize, stored: usize) -> Vec<u32> {
        let entries = ((self.index + 1) * self.sides).pow(2);
        // Weights `[stored node][Chebyshev node]`.
        let resampling = resampling_matrix(NODES_MAX, stored);
        // Adds a weighted shape to a sum.
        let add = |sum: &mut JonesShape, shape: JonesShape, weight: f64| {
            sum.iter_mut().zip(shape).for_each(|(sum, element)| *sum += element * weight);
        };
        // Shapes resampled along q, not yet along p: `[Chebyshev node i of p][stored node g of q · entries + entry]`.
        let mut along_q = vec![vec![[Complex64::ZERO; 4]; stored * entries]; NODES_MAX];
        for (i, row) in along_q.iter_mut().enumerate() {
            for (k, entry) in (0..NODES_MAX).flat_map(|k| (0..entries).map(move |entry| (k, entry))) {
                let value = self.value(i, k, j, entry);
                for (g, weights) in resampling.iter().enumerate() {
                    add(&mut row[g * entries + entry], value, weights[k]);
                }
            }
        }
        // Packets resampled along p as well, ordered by stored nodes of p, then by nodes of q and entries (`column`).
        let mut packets = Vec::with_capacity(4 * stored * stored * entries);
        for weights in &resampling {
            for column in 0..stored * entries {
                let mut sum = [Complex64::ZERO; 4];
                for (row, &weight) in along_q.iter().zip(weights) {
                    add(&mut sum, row[column], weight);
                }
                packets.extend(packet(&sum));
            }
        }
        packets
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::grating::efficiencies::EfficiencyView;
    use crate::grating::plan::estimate;
    use crate::grating::polarisation::mueller;
    use crate::numeric::Plain;
    use crate::scattering::{ComplexIndex, SpectralIndex};
    use sunbeam_rigorous::{Medium, Profile, solve_orders};

    type Double<'a> = Plain<'a, f64>;

    /// Mueller matrix of an order, divided by its first element, from the solver's Jones matrix for light from `wi`;
    /// `None` where the order does not propagate.
    fn solved(profile: &Profile, medium: &Medium, nm: f64, wi: [f64; 3], order: i32) -> Option<[f64; 16]> {
        let orders = solve_orders(profile, medium, nm, wi).unwrap();
        let order = orders.orders.iter().find(|found| found.index == order)?;
        let [[ee, eh], [he, hh]] = order.jones;
        // `mueller` treats a power of at most 1 as zero; the factor cancels in the result.
        let scaled = |z: Complex64| [z.re * 1e3, z.im * 1e3];
        // Crossed elements change their signs, as in `JonesView::matrix`.
        Some(mueller::<Double>([scaled(ee), scaled(-eh), scaled(-he), scaled(hh)]))
    }

    /// Mueller matrix of an order, divided by its first element, from the table for light from `wi`.
    fn tabulated(table: &JonesTable, period_um: f64, nm: f64, wi: [f64; 3], order: i32) -> [f64; 16] {
        // d/λ. `wi` points against the light's travel, hence the signs of its components below.
        let periods = 1e3 * period_um / nm;
        let efficiencies = EfficiencyView::<Double> { layout: table.layout, words: &table.words };
        let channels = efficiencies.channels(&efficiencies.bounds(periods, -wi[1]), -wi[0] * periods, true);
        let pair = [0, order].map(|m| channels.of_order(f64::from(m), false));
        assert!(pair.iter().all(|(_, propagates)| *propagates));
        table.view::<Double>(&table.words).matrix(&channels, pair.map(|(channel, _)| channel), nm, -wi[1], true)
    }

    /// Accepted root mean square interpolation error of matrix elements, for a grating with an anomaly in every cell.
    /// With two thirds of [`NODES_MAX`] the error is twice as large.
    const RMS_MAX: f64 = 0.015;
    /// Accepted interpolation error of an element, for the same grating.
    const ERROR_MAX: f64 = 0.15;

    #[test]
    fn interpolated_matrices_match_the_solver() {
        let aluminium = ComplexIndex { eta: 1.0, k: 6.5 };
        let (period_um, nm) = (0.9, 517.0);
        let profile = Profile::sinusoid(period_um, 0.2).unwrap();
        for (index, medium) in [
            (None, Medium::Perfect),
            (Some(SpectralIndex::Constant(aluminium)), Medium::index(aluminium.eta, aluminium.k).unwrap()),
        ] {
            let table =
                JonesTable::new(&profile, GratingBody::Reflector(index.as_ref()), 1.0, &Progress::none()).unwrap();
            let (mut squares, mut largest, mut count) = (0.0, 0.0_f64, 0);
            for (theta, phi) in [(0.1_f64, 0.4_f64), (0.5, 2.1), (0.8, -1.1), (1.1, 1.4), (1.3, 3.6), (0.6, 0.0)] {
                let wi = [theta.sin() * phi.cos(), theta.sin() * phi.sin(), theta.cos()];
                for order in -2..=2 {
                    let Some(expected) = solved(&profile, &medium, nm, wi, order) else { continue };
                    let found = tabulated(&table, period_um, nm, wi, order);
                    for (found, expected) in found.iter().zip(expected) {
                        squares += (found - expected).powi(2);
                        largest = largest.max((found - expected).abs());
                        count += 1;
                    }
                }
            }
            let rms = (squares / f64::from(count)).sqrt();
            assert!(
                count > 16 * 10 && rms < RMS_MAX && largest < ERROR_MAX,
                "{medium:?}: {rms:.1e}, {largest:.1e} of {count}"
            );
        }
    }

    #[test]
    fn large_tables_have_about_their_estimated_size() {
        let metal = SpectralIndex::Constant(ComplexIndex { eta: 1.0, k: 6.5 });
        // A long period in µm.
        let period_um = 5.0;
        for (body, step_nm) in [
            (GratingBody::Reflector(None), None),
            (GratingBody::Reflector(Some(&metal)), Some(STEP_MAX_NM)),
            (GratingBody::Film(1.5), Some(STEP_MAX_NM)),
        ] {
            let (_, cell_counts) = table_wavelengths(period_um, step_nm);
            let sides = body.sides() as usize;
            let channels = cell_counts.iter().flat_map(|&cells| (1..=cells).map(|orders| orders * sides));
            let packets: usize = channels.map(|channels| channels * channels).sum();
            let nodes = stored_nodes(&cell_counts, sides);
            let bytes = (PACKET_BYTES * packets * nodes * nodes) as f64;
            // The bytes do not depend on the number of mesh nodes.
            let estimated = estimate(cost_basis(period_um, body), 64, body).bytes;
            // Steps of wavelengths are estimated within a factor of two.
            assert!((0.4..2.0).contains(&(estimated / bytes)), "{body:?}: {estimated} of {bytes}");
        }
    }

    #[test]
    fn tables_stay_within_their_size_limit() {
        // Periods in µm: that of the presets, one of a compact disc, and one of few orders. The last two have the most
        // nodes.
        for (period_um, has_most) in [(2.5, false), (1.6, true), (0.9, true)] {
            let (_, cell_counts) = table_wavelengths(period_um, Some(40.0));
            let packets: usize = cell_counts.iter().flat_map(|&cells| (1..=cells).map(|orders| orders * orders)).sum();
            let nodes = stored_nodes(&cell_counts, 1);
            let bytes = PACKET_BYTES * packets * nodes * nodes;
            assert!(bytes as f64 <= BYTES_MAX, "{period_um} µm: {nodes} nodes");
            assert_eq!(nodes == NODES_MAX, has_most, "{period_um} µm: {nodes} nodes");
        }
    }
}
