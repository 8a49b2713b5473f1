//! Polarisation of a grating's orders: a table of Jones matrices beside the efficiencies, and their Mueller matrices
//! (docs/model.md#gratings-by-maxwells-equations).
//!
//! A Jones matrix `[EE, EH, HE, HH]` (outgoing state first) relates the states of Ey and of Hy, the fields along the
//! grooves. It is stored normalised, since efficiencies hold the power. Its crossed elements EH and HE are proportional
//! to ky/k and stored divided by it, so that they do not change sign with ky.

use super::GratingError;
use super::build::{chebyshev_angles, node, resampling};
use super::efficiencies::{EfficiencyLayout, EfficiencyView};
use super::place::Place;
use super::solved::Solved;
use super::wavelengths::{wavelengths, wavelengths_of};
use crate::numeric::math::u16_pair;
use crate::numeric::{Index, Number, Numbers, Real};
use crate::table::Progress;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use sunbeam_fourier::num_complex::Complex64;

/// Number of Chebyshev nodes along each side of a cell at which matrices are solved.
const SOLVED: usize = 18;
/// Least and greatest number of table nodes along each side of a cell.
const STORED: [usize; 2] = [12, 18];
/// Bytes that a table may use for more than the least number of nodes.
const ROOM: f64 = 24e6;
/// Value of one unit of a stored 16-bit number. Elements of a normalised matrix are at most √2.
const UNIT: f64 = 1.45 / 32_767.0;
/// Stored number that stands for zero.
const ZERO: f64 = 32_768.0;
/// Smallest |ky/k| that crossed elements are divided by; a smaller divisor would amplify their error.
const GROOVE_COSINE_MIN: f64 = 0.02;
/// Power below which a matrix is stored as zero.
const POWER_MIN: f64 = 1e-18;

/// A normalised Jones matrix `[EE, EH·k/ky, HE·k/ky, HH]`.
pub(super) type Shape = [Complex64; 4];

/// Normalises a Jones matrix at `ky²/k²`, which may be negative.
pub(super) fn shape([[ee, eh], [he, hh]]: [[Complex64; 2]; 2], ky_squared: f64) -> Shape {
    let along = Complex64::new(ky_squared, 0.0).sqrt();
    let along =
        if along.norm() < GROOVE_COSINE_MIN { along * (GROOVE_COSINE_MIN / along.norm().max(1e-12)) } else { along };
    let matrix = [ee, eh / along, he / along, hh];
    let power = 0.5 * matrix.iter().map(Complex64::norm_sqr).sum::<f64>();
    if power < POWER_MIN { [Complex64::ZERO; 4] } else { matrix.map(|part| part / power.sqrt()) }
}

/// A table of normalised Jones matrices.
///
/// Arranged as [`EfficiencyLayout`], but each node has `(s + 1)²` packets of four words. A word holds one element, its
/// real and imaginary part as 16-bit numbers about 32 768. Beginnings of cells are counted in packets.
#[derive(Debug, Serialize, Deserialize)]
pub struct JonesTable {
    layout: EfficiencyLayout,
    words: Vec<u32>,
}

impl JonesTable {
    /// Solves and tabulates a grating at wavelengths `step_nm` apart; `None` for a perfect conductor.
    ///
    /// # Errors
    /// An incidence that cannot be solved.
    pub(super) fn build(
        period_um: f64,
        orders: &Solved,
        step_nm: Option<f64>,
        progress: &Progress,
    ) -> Result<Self, GratingError> {
        let (nm, cells_of) = wavelengths(period_um, step_nm);
        let count = cells_of[0];
        let stored = stored(&cells_of);
        let mut packed: Vec<Vec<Vec<u32>>> = vec![Vec::new(); nm.len()];
        let work: usize = (1..=count).sum();
        let mut done = 0;
        for s in 0..count {
            let longest = wavelengths_of(s, &cells_of);
            let cell = Cell::solve(s, orders, &nm[..longest])?;
            let of_wavelengths: Vec<_> = (0..longest).into_par_iter().map(|j| cell.packed(j, stored)).collect();
            for (packed, cell) in packed.iter_mut().zip(of_wavelengths) {
                packed.push(cell);
            }
            done += s + 1;
            progress.report(done as f64 / work as f64);
        }
        let starts = (nm.len() * count).next_multiple_of(4);
        let mut words = vec![0u32; starts];
        for (j, of_wavelength) in packed.iter().enumerate() {
            for (s, cell) in of_wavelength.iter().enumerate() {
                words[j * count + s] = (words.len() / 4) as u32;
                words.extend(cell);
            }
        }
        let layout = EfficiencyLayout {
            first_nm: nm[0],
            step_nm: nm[1] - nm[0],
            wavelengths: nm.len() as u32,
            cells: count as u32,
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

/// Number of nodes along each side of a cell that fits into [`ROOM`], from the numbers of cells at each wavelength.
fn stored(cells_of: &[usize]) -> usize {
    // Bytes of a packet.
    const BYTES: usize = 16;
    let packets: usize = cells_of.iter().flat_map(|&cells| (1..=cells).map(|width| width * width)).sum();
    let fitting = (ROOM / (BYTES * packets) as f64).sqrt() as usize;
    fitting.clamp(STORED[0], STORED[1])
}

/// Matrices of one cell: `[node of the triangle][wavelength][incident · orders + outgoing]`. Reciprocity gives the
/// other triangle.
struct Cell {
    index: usize,
    shapes: Vec<Vec<Vec<Shape>>>,
}

impl Cell {
    fn solve(index: usize, orders: &Solved, wavelengths_nm: &[f64]) -> Result<Self, GratingError> {
        let x: Vec<f64> = chebyshev_angles(SOLVED).map(|angle| (0.5 * angle).sin().powi(2)).collect();
        let places: Vec<[usize; 2]> = (0..SOLVED).flat_map(|i| (0..=i).map(move |k| [i, k])).collect();
        let shapes = places
            .par_iter()
            .map(|&[i, k]| {
                let (t, b) = node(index, [x[i], x[k]]);
                orders.shapes(t, b, wavelengths_nm)
            })
            .collect::<Result<Vec<_>, GratingError>>()?;
        Ok(Self { index, shapes })
    }

    /// The matrix at a pair of nodes; beyond the diagonal, that of the reversed path.
    fn value(&self, i: usize, k: usize, j: usize, at: usize) -> Shape {
        let (high, low) = (i.max(k), i.min(k));
        let shapes = &self.shapes[high * (high + 1) / 2 + low][j];
        let width = self.index + 1;
        if i >= k {
            return shapes[at];
        }
        let [ee, eh, he, hh] = shapes[(self.index - at % width) * width + self.index - at / width];
        [ee, he, eh, hh]
    }

    /// The cell's packets at one wavelength.
    fn packed(&self, j: usize, stored: usize) -> Vec<u32> {
        let entries = (self.index + 1).pow(2);
        let resample = resampling(SOLVED, stored);
        let add = |sum: &mut Shape, shape: Shape, weight: f64| {
            sum.iter_mut().zip(shape).for_each(|(sum, part)| *sum += part * weight);
        };
        // Resamples the second coordinate, then the first: `[node][stored · entries + entry]`.
        let mut half_way = vec![vec![[Complex64::ZERO; 4]; stored * entries]; SOLVED];
        for (i, of_node) in half_way.iter_mut().enumerate() {
            for (k, at) in (0..SOLVED).flat_map(|k| (0..entries).map(move |at| (k, at))) {
                let value = self.value(i, k, j, at);
                for (g, weights) in resample.iter().enumerate() {
                    add(&mut of_node[g * entries + at], value, weights[k]);
                }
            }
        }
        let half = |x: f64| (x / UNIT + ZERO).round().clamp(0.0, f64::from(u16::MAX)) as u32;
        let mut packets = Vec::with_capacity(4 * stored * stored * entries);
        for weights in &resample {
            for at in 0..stored * entries {
                let mut sum = [Complex64::ZERO; 4];
                for (of_node, &weight) in half_way.iter().zip(weights) {
                    add(&mut sum, of_node[at], weight);
                }
                packets.extend(sum.map(|part| half(part.re) | half(part.im) << 16));
            }
        }
        packets
    }
}

/// A complex number: real part, imaginary part.
type Pair<N> = [<N as Numbers>::Real; 2];

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
        place: &Place<N>,
        outgoing: N::Index,
        nm: N::Real,
        groove_cosine: N::Real,
        active: N::Mask,
    ) -> [N::Real; 16] {
        let (real, index) = (N::Real::lit, N::Index::lit);
        let nodes = EfficiencyView::<N> { layout: self.layout, words: self.words };
        let width = place.cell.min(index(self.layout.cells - 1)) + index(1);
        let within = place.incident.min(width - index(1)) * width + outgoing;
        let mut sum = [[real(-ZERO); 2]; 4];
        for ([begin, node], weight) in nodes.weighted(place, nm, active) {
            let packet = N::gather::<4>(self.words, begin + node * width * width + within, active);
            for (sum, word) in sum.iter_mut().zip(packet) {
                let parts = u16_pair::<N>(word);
                *sum = [0, 1].map(|c| parts[c].fma(weight, sum[c]));
            }
        }
        let [ee, eh, he, hh] = sum;
        // In a right-handed frame the electric field of the Hy state is opposite to the second axis.
        let crossed = |part: Pair<N>| part.map(|x| -(x * groove_cosine));
        mueller::<N>([ee, crossed(eh), crossed(he), hh])
    }
}

/// Mueller matrix of the Jones matrix `[xx, xy, yx, yy]` (outgoing state first), divided by its first element. A zero
/// matrix becomes a depolariser. The time dependence is exp(−iωt), and the fourth Stokes parameter is `2 Im(x y*)`, as
/// in Mitsuba.
#[inline(always)]
fn mueller<N: Numbers>([xx, xy, yx, yy]: [Pair<N>; 4]) -> [N::Real; 16] {
    let (real, half) = (N::Real::lit, N::Real::lit(0.5));
    // a·b*.
    let times = |a: Pair<N>, b: Pair<N>| [a[0].fma(b[0], a[1] * b[1]), a[1] * b[0] - a[0] * b[1]];
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
    use crate::grating::lobe::groove_t;
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
        let place = Place::<Double>::new(groove_t::<Double>(periods, wi[1]), -wi[0] * periods);
        let (at, there) = place.outgoing(f64::from(order));
        assert!(there);
        table.view::<Double>(&table.words).matrix(&place, at, nm, -wi[1], true)
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
            let (_, cells_of) = wavelengths(period_um, Some(40.0));
            let packets: usize = cells_of.iter().flat_map(|&cells| (1..=cells).map(|width| width * width)).sum();
            let nodes = stored(&cells_of);
            assert!(16.0 * (packets * nodes * nodes) as f64 <= ROOM, "{period_um} µm: {nodes} nodes");
            assert_eq!(nodes == STORED[1], most, "{period_um} µm: {nodes} nodes");
        }
    }

    #[test]
    fn zero_matrices_depolarise() {
        let matrix = mueller::<Double>([[0.0; 2]; 4]);
        assert_eq!(matrix[0], 1.0);
        assert!(matrix[1..].iter().all(|&element| element == 0.0));
    }
}
