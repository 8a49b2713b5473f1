//! Polarisation of a grating's orders: a table of Jones matrices beside the efficiencies, and their Mueller matrices
//! (docs/model.md#gratings-by-maxwells-equations; symbols: `mod.rs`).

use super::GratingError;
use super::build::reversed;
use super::cell_position::{CellPosition, wave_at};
use super::chebyshev::{node_fractions, resampling, triangle, triangle_index};
use super::efficiencies::{EfficiencyLayout, EfficiencyView, Node};
use super::jones_shape::JonesShape;
use super::plan::{meshes, spacing};
use super::solved::Solved;
use super::wavelengths::{STEPS_NM, wavelengths, wavelengths_with_cell};
use crate::numeric::math::u16_pair;
use crate::numeric::{Index, Number, Numbers, Real};
use crate::scattering::SpectralIndex;
use crate::table::Progress;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use sunbeam_fourier::num_complex::Complex64;
use sunbeam_rigorous::Profile;

/// Number of Chebyshev nodes along either side of a cell at which matrices are solved, and most nodes of the table.
/// With two thirds of them the error of the test below doubles.
const NODES_MAX: usize = 18;
/// Least number of table nodes along either side of a cell.
const NODES_MIN: usize = 12;
/// Bytes that a table may take for more than the least number of nodes.
const BYTES_MAX: f64 = 24e6;
/// Bytes of a packet: one matrix.
const PACKET_BYTES: usize = 16;
/// Value of one unit of a stored 16-bit integer. Elements of a matrix of unit power are at most √2.
const UNIT: f64 = 1.45 / 32_767.0;
/// Stored integer that stands for zero.
const ZERO: f64 = 32_768.0;
/// Wavelength step of matrices, in steps of efficiencies. Anomalies change the power more than the polarisation.
const STEPS: f64 = 2.0;
/// Largest wavelength step of matrices in nm: the second longest of efficiencies.
const STEP_MAX_NM: f64 = STEPS_NM[1];

/// A table of the shapes of Jones matrices: matrices of unit power, which an order's efficiency scales.
///
/// Arranged as [`EfficiencyLayout`], but each node has `(s + 1)²` packets of four words. A word holds one element, its
/// real and imaginary part as 16-bit integers about 32 768. Offsets of cells are counted in packets.
///
/// ```
/// use sunbeam::grating::{JonesTable, Profile};
/// use sunbeam::table::Progress;
///
/// // A perfectly conducting sinusoid of 0.4 µm, 0.05 µm high.
/// let table = JonesTable::new(&Profile::sinusoid(0.4, 0.05)?, None, 1.0, &Progress::none())?;
/// // Packets of four words.
/// assert_eq!(table.words().len() % 4, 0);
/// # Ok::<(), sunbeam::grating::GratingError>(())
/// ```
#[derive(Debug, Serialize, Deserialize)]
pub struct JonesTable {
    layout: EfficiencyLayout,
    words: Vec<u32>,
}

impl JonesTable {
    /// Solves a profile in air above a medium of this index, or above a perfect conductor (`None`), and tabulates the
    /// shapes of its orders' matrices.
    ///
    /// # Errors
    /// The errors of [`GratingSurface::new`](super::GratingSurface::new).
    pub fn new(
        profile: &Profile,
        index: Option<&SpectralIndex>,
        build_limit: f64,
        progress: &Progress,
    ) -> Result<Self, GratingError> {
        let period_um = profile.period_um();
        let meshes = meshes(profile, index, build_limit)?;
        let spacing = spacing(&meshes, period_um, index)?;
        let step_nm = spacing.map(|spacing| (STEPS * spacing.step_nm).min(STEP_MAX_NM));
        let (wavelengths_nm, _) = wavelengths(period_um, step_nm);
        Self::build(period_um, &Solved::new(&meshes, index, &wavelengths_nm)?, step_nm, progress)
    }

    /// Solves and tabulates matrices at wavelengths `step_nm` apart; `None` for a perfect conductor.
    ///
    /// # Errors
    /// A point that cannot be solved.
    fn build(period_um: f64, orders: &Solved, step_nm: Option<f64>, progress: &Progress) -> Result<Self, GratingError> {
        let (nm, cell_counts) = wavelengths(period_um, step_nm);
        let cells = cell_counts[0];
        let stored = stored_nodes(&cell_counts);
        // `[wavelength][cell]`.
        let mut packed: Vec<Vec<Vec<u32>>> = vec![Vec::new(); nm.len()];
        let work: usize = (1..=cells).sum();
        let mut done = 0;
        for s in 0..cells {
            let longest = wavelengths_with_cell(s, &cell_counts);
            let cell = Cell::solve(s, orders, &nm[..longest])?;
            let by_wavelength: Vec<_> = (0..longest).into_par_iter().map(|j| cell.packed(j, stored)).collect();
            for (packed, cell) in packed.iter_mut().zip(by_wavelength) {
                packed.push(cell);
            }
            done += s + 1;
            progress.report(done as f64 / work as f64);
        }
        let offset_words = (nm.len() * cells).next_multiple_of(4);
        let mut words = vec![0u32; offset_words];
        for (j, packed_cells) in packed.iter().enumerate() {
            for (s, cell) in packed_cells.iter().enumerate() {
                words[j * cells + s] = (words.len() / 4) as u32;
                words.extend(cell);
            }
        }
        let layout = EfficiencyLayout {
            first_nm: nm[0],
            step_nm: nm[1] - nm[0],
            wavelengths: nm.len() as u32,
            cells: cells as u32,
            nodes: stored as u32,
        };
        Ok(Self { layout, words })
    }

    /// Arrangement of the table data.
    pub fn layout(&self) -> &EfficiencyLayout {
        &self.layout
    }

    /// Table data.
    pub fn words(&self) -> &[u32] {
        &self.words
    }

    /// The table over [`JonesTable::words`] of one family of numbers.
    pub fn view<N: Numbers>(&self, words: N::Words) -> JonesView<N> {
        JonesView { layout: self.layout, words }
    }
}

/// Number of table nodes along either side of a cell, from the numbers of cells at each wavelength.
fn stored_nodes(cell_counts: &[usize]) -> usize {
    let packets: usize = cell_counts.iter().flat_map(|&cells| (1..=cells).map(|orders| orders * orders)).sum();
    let fitting = (BYTES_MAX / (PACKET_BYTES * packets) as f64).sqrt() as usize;
    fitting.clamp(NODES_MIN, NODES_MAX)
}

/// Shapes of one cell at Chebyshev nodes.
struct Cell {
    /// Index s of the cell.
    index: usize,
    /// `[node in the triangle][wavelength][incident · orders + outgoing]`.
    shapes: Vec<Vec<Vec<JonesShape>>>,
}

impl Cell {
    /// Solves a cell at [`NODES_MAX`] Chebyshev nodes along either side.
    fn solve(index: usize, orders: &Solved, wavelengths_nm: &[f64]) -> Result<Self, GratingError> {
        let fractions = node_fractions(NODES_MAX);
        let shapes = triangle(NODES_MAX)
            .par_iter()
            .map(|&[i, k]| {
                let (t, b) = wave_at(index, [fractions[i], fractions[k]]);
                orders.shapes(t, b, wavelengths_nm)
            })
            .collect::<Result<Vec<_>, GratingError>>()?;
        Ok(Self { index, shapes })
    }

    /// Shape at the node (i, k) and wavelength j; `entry` is `incident · orders + outgoing`. Beyond the diagonal it is
    /// that of the reversed path, whose matrix is the transpose.
    fn value(&self, i: usize, k: usize, j: usize, entry: usize) -> JonesShape {
        let shapes = &self.shapes[triangle_index(i, k)][j];
        if i >= k {
            return shapes[entry];
        }
        let [ee, eh, he, hh] = shapes[reversed(entry, self.index)];
        [ee, he, eh, hh]
    }

    /// Packets of the cell at wavelength j: `[node of p][node of q][entry]`.
    fn packed(&self, j: usize, stored: usize) -> Vec<u32> {
        let entries = (self.index + 1).pow(2);
        let resample = resampling(NODES_MAX, stored);
        let add = |sum: &mut JonesShape, shape: JonesShape, weight: f64| {
            sum.iter_mut().zip(shape).for_each(|(sum, element)| *sum += element * weight);
        };
        // Resampled along q, then along p: `[solved node of p][stored node of q · entries + entry]`.
        let mut along_q = vec![vec![[Complex64::ZERO; 4]; stored * entries]; NODES_MAX];
        for (i, row) in along_q.iter_mut().enumerate() {
            for (k, entry) in (0..NODES_MAX).flat_map(|k| (0..entries).map(move |entry| (k, entry))) {
                let value = self.value(i, k, j, entry);
                for (g, weights) in resample.iter().enumerate() {
                    add(&mut row[g * entries + entry], value, weights[k]);
                }
            }
        }
        let units = |x: f64| (x / UNIT + ZERO).round().clamp(0.0, f64::from(u16::MAX)) as u32;
        let mut packets = Vec::with_capacity(4 * stored * stored * entries);
        for weights in &resample {
            for column in 0..stored * entries {
                let mut sum = [Complex64::ZERO; 4];
                for (row, &weight) in along_q.iter().zip(weights) {
                    add(&mut sum, row[column], weight);
                }
                packets.extend(sum.map(|element| units(element.re) | units(element.im) << 16));
            }
        }
        packets
    }
}

/// A complex number: real part, imaginary part.
type Complex<N> = [<N as Numbers>::Real; 2];

/// A [`JonesTable`] over one family of numbers.
#[derive(Clone, Copy)]
pub struct JonesView<N: Numbers> {
    layout: EfficiencyLayout,
    words: N::Words,
}

impl<N: Numbers> JonesView<N> {
    /// Mueller matrix of an order, row by row and divided by its first element. `groove_cosine` is the wave's direction
    /// cosine along the grooves. Frames of reference have the grooves' direction, made transverse, as first axis.
    #[inline(always)]
    pub(super) fn matrix(
        &self,
        position: &CellPosition<N>,
        outgoing: N::Index,
        nm: N::Real,
        groove_cosine: N::Real,
        active: N::Mask,
    ) -> [N::Real; 16] {
        let (real, index) = (N::Real::lit, N::Index::lit);
        let nodes = EfficiencyView::<N> { layout: self.layout, words: self.words };
        let orders = position.cell.min(index(self.layout.cells - 1)) + index(1);
        let entry = position.incident.min(orders - index(1)) * orders + outgoing;
        let mut sum = [[real(-ZERO); 2]; 4];
        for (Node { cell_offset, number }, weight) in nodes.weighted_nodes(position, nm, active) {
            let packet = N::gather::<4>(self.words, cell_offset + number * orders * orders + entry, active);
            for (sum, word) in sum.iter_mut().zip(packet) {
                let parts = u16_pair::<N>(word);
                *sum = [0, 1].map(|c| parts[c].fma(weight, sum[c]));
            }
        }
        let [ee, eh, he, hh] = sum;
        // In a right-handed frame the electric field of the Hy state is opposite to the second axis.
        let crossed = |part: Complex<N>| part.map(|x| -(x * groove_cosine));
        mueller::<N>([ee, crossed(eh), crossed(he), hh])
    }
}

/// Mueller matrix of the Jones matrix `[xx, xy, yx, yy]` (outgoing state first), divided by its first element. A zero
/// matrix becomes a depolariser. The time dependence is exp(−iωt), and the fourth Stokes parameter is `2 Im(x y*)`, as
/// in Mitsuba.
#[inline(always)]
fn mueller<N: Numbers>([xx, xy, yx, yy]: [Complex<N>; 4]) -> [N::Real; 16] {
    let (real, half) = (N::Real::lit, N::Real::lit(0.5));
    // a·b*.
    let times = |a: Complex<N>, b: Complex<N>| [a[0].fma(b[0], a[1] * b[1]), a[1] * b[0] - a[0] * b[1]];
    let [a, b, c, d] = [xx, xy, yx, yy].map(|z| times(z, z)[0] * half);
    let (x, y) = (times(xx, xy), times(yx, yy));
    let (u, v) = (times(xx, yx), times(xy, yy));
    let (f, g) = (times(xx, yy), times(xy, yx));
    let power = a + b + c + d;
    let matrix = [
        [power, a - b + c - d, x[0] + y[0], -(x[1] + y[1])],
        [a + b - c - d, a - b - c + d, x[0] - y[0], y[1] - x[1]],
        [u[0] + v[0], u[0] - v[0], f[0] + g[0], g[1] - f[1]],
        [u[1] + v[1], u[1] - v[1], f[1] + g[1], f[0] - g[0]],
    ];
    // A normalised matrix has a power of about 10⁹ in the table's units.
    let known = real(1.0).lt(power);
    let scale = real(1.0) / N::Real::select(known, power, real(1.0));
    std::array::from_fn(|i| {
        let unpolarised = real(if i == 0 { 1.0 } else { 0.0 });
        N::Real::select(known, matrix[i / 4][i % 4] * scale, unpolarised)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::grating::cell_position::groove_t;
    use crate::numeric::Plain;
    use crate::scattering::{ComplexIndex, SpectralIndex};
    use sunbeam_rigorous::{Medium, Profile, solve_orders};

    type Double<'a> = Plain<'a, f64>;

    /// The matrix of an order that the solver gives for a direction of light, over its first element.
    fn solved(profile: &Profile, medium: &Medium, nm: f64, wi: [f64; 3], order: i32) -> Option<[f64; 16]> {
        let orders = solve_orders(profile, medium, nm, wi).unwrap();
        let order = orders.orders.iter().find(|found| found.index == order)?;
        let [ee, eh, he, hh] = [[0, 0], [0, 1], [1, 0], [1, 1]].map(|[i, j]| order.jones[i][j]);
        let pair = |z: Complex64| [z.re * 1e3, z.im * 1e3];
        Some(mueller::<Double>([pair(ee), pair(-eh), pair(-he), pair(hh)]))
    }

    fn tabulated(table: &JonesTable, period_um: f64, nm: f64, wi: [f64; 3], order: i32) -> [f64; 16] {
        let periods = 1e3 * period_um / nm;
        let position = CellPosition::<Double>::new(groove_t::<Double>(periods, wi[1]), -wi[0] * periods);
        let (number, propagates) = position.outgoing(f64::from(order));
        assert!(propagates);
        table.view::<Double>(&table.words).matrix(&position, number, nm, -wi[1], true)
    }

    /// Root mean square interpolation error of matrix elements, for a grating with an anomaly in every cell. Two thirds
    /// of the nodes double it.
    const RMS: f64 = 0.015;
    /// Largest interpolation error of an element, for the same grating.
    const LARGEST: f64 = 0.15;

    #[test]
    fn interpolated_matrices_match_the_solver() {
        let aluminium = ComplexIndex { eta: 1.0, k: 6.5 };
        let (period_um, nm) = (0.9, 517.0);
        let profile = Profile::sinusoid(period_um, 0.2).unwrap();
        for (index, medium) in [
            (None, Medium::Perfect),
            (Some(SpectralIndex::Constant(aluminium)), Medium::index(aluminium.eta, aluminium.k).unwrap()),
        ] {
            let table = JonesTable::new(&profile, index.as_ref(), 1.0, &Progress::none()).unwrap();
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
                count > 16 * 10 && rms < RMS && largest < LARGEST,
                "{medium:?}: {rms:.1e}, {largest:.1e} of {count}"
            );
        }
    }

    #[test]
    fn tables_fit_into_their_room() {
        // Periods in µm of the presets, and of a grating of few orders, which has the most nodes.
        for (period_um, most) in [(2.5, false), (1.6, true), (0.9, true)] {
            let (_, cell_counts) = wavelengths(period_um, Some(40.0));
            let packets: usize = cell_counts.iter().flat_map(|&cells| (1..=cells).map(|width| width * width)).sum();
            let nodes = stored_nodes(&cell_counts);
            assert!(16.0 * (packets * nodes * nodes) as f64 <= BYTES_MAX, "{period_um} µm: {nodes} nodes");
            assert_eq!(nodes == NODES_MAX, most, "{period_um} µm: {nodes} nodes");
        }
    }

    #[test]
    fn zero_matrices_depolarise() {
        let matrix = mueller::<Double>([[0.0; 2]; 4]);
        assert_eq!(matrix[0], 1.0);
        assert!(matrix[1..].iter().all(|&element| element == 0.0));
    }
}
