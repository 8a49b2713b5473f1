//! How a grating's orders polarise: a table of Jones matrices beside that of efficiencies, and the Mueller matrices it gives
//! (docs/model.md#gratings-by-maxwells-equations).

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

/// Chebyshev nodes along either side of a cell at which matrices are solved.
const SOLVED: usize = 18;
/// The fewest and the most nodes of the table there.
const STORED: [usize; 2] = [12, 18];
/// Bytes that a table may have for more than the fewest nodes.
const ROOM: f64 = 24e6;
/// What one unit of a stored number means. No part of a matrix of unit length is above √2.
const UNIT: f64 = 1.45 / 32_767.0;
/// What a stored number of zero is.
const ZERO: f64 = 32_768.0;
/// Share of a wave number along the grooves below which what is crossed is no longer divided by less: its error would grow.
const ALONG_MIN: f64 = 0.02;
/// Power of what is normalised, below which it is nothing.
const POWER_MIN: f64 = 1e-18;

/// A Jones matrix between the states of Ey and of Hy, `[EE, EH, HE, HH]`, out first; what is crossed over ky/k, on which it goes
/// evenly where ky changes its sign.
pub(super) type Shape = [Complex64; 4];

/// The shape of a Jones matrix, of unit length, at this share `ky²/k²`, which may be negative.
pub(super) fn shape([[ee, eh], [he, hh]]: [[Complex64; 2]; 2], ky_squared_share: f64) -> Shape {
    let along = Complex64::new(ky_squared_share, 0.0).sqrt();
    let along = if along.norm() < ALONG_MIN { along * (ALONG_MIN / along.norm().max(1e-12)) } else { along };
    let matrix = [ee, eh / along, he / along, hh];
    let power = 0.5 * matrix.iter().map(Complex64::norm_sqr).sum::<f64>();
    if power < POWER_MIN { [Complex64::ZERO; 4] } else { matrix.map(|part| part / power.sqrt()) }
}

/// A table of the shapes of Jones matrices.
///
/// Read as [`EfficiencyLayout`] says, but with `(s + 1)²` packets of four words at each place, a word of a part of the matrix, its
/// real half and its imaginary half about 32 768; and the beginnings of cells counted in packets.
#[derive(Debug, Serialize, Deserialize)]
pub struct JonesTable {
    layout: EfficiencyLayout,
    words: Vec<u32>,
}

impl JonesTable {
    /// Solves and tabulates a grating of this period at wavelengths so far apart, `None` where nothing depends on them.
    ///
    /// # Errors
    /// A place that cannot be solved.
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

    /// How the words are to be read.
    pub fn layout(&self) -> &EfficiencyLayout {
        &self.layout
    }

    /// The words of the table.
    pub fn words(&self) -> &[u32] {
        &self.words
    }

    /// The table over words of a family of numbers, which are [`JonesTable::words`].
    pub fn view<N: Numbers>(&self, words: N::Words) -> JonesView<N> {
        JonesView { layout: self.layout, words }
    }
}

/// Nodes along either side of a cell, of a table with so many cells at each wavelength.
fn stored(cells_of: &[usize]) -> usize {
    // Of a packet.
    const BYTES: usize = 16;
    let packets: usize = cells_of.iter().flat_map(|&cells| (1..=cells).map(|width| width * width)).sum();
    let fitting = (ROOM / (BYTES * packets) as f64).sqrt() as usize;
    fitting.clamp(STORED[0], STORED[1])
}

/// The shapes of one cell: `[first coordinate ≥ second, in a triangle][wavelength][incident · orders + outgoing]`.
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

    /// The shape at a pair of nodes: on the other side of the diagonal, that of the reversed path.
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
        // Along the second coordinate, then along the first: `[node][stored · entries + entry]`.
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

/// A complex number, its real part first.
type Pair<N> = [<N as Numbers>::Real; 2];

/// A [`JonesTable`] over its words.
#[derive(Clone, Copy)]
pub struct JonesView<N: Numbers> {
    layout: EfficiencyLayout,
    words: N::Words,
}

impl<N: Numbers> JonesView<N> {
    /// The Mueller matrix of an order, row by row over its first element, for a wave with this direction cosine along the
    /// grooves, in frames of reference whose first axis is the groove's, made transverse.
    #[inline(always)]
    pub(super) fn matrix(
        &self,
        place: &Place<N>,
        outgoing: N::Index,
        nm: N::Real,
        along: N::Real,
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
        // The second axis of a right-handed frame is opposite to the electric field of the state of Hy.
        let crossed = |part: Pair<N>| part.map(|x| -(x * along));
        mueller::<N>([ee, crossed(eh), crossed(he), hh])
    }
}

/// The Mueller matrix of `[xx, xy, yx, yy]`, out first, over its first element; that of a depolariser where all are zero. Time goes
/// as exp(−iωt), and the fourth of Stokes' parameters is `2 Im(x y*)`, as in Mitsuba.
#[inline(always)]
fn mueller<N: Numbers>([xx, xy, yx, yy]: [Pair<N>; 4]) -> [N::Real; 16] {
    let (real, half) = (N::Real::lit, N::Real::lit(0.5));
    // A product with a conjugate.
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
    // In units of the table a matrix of unit length has some 10⁹.
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

    /// Elements of matrices of unit power, in the root mean square and at most: what interpolation leaves in orders of a grating
    /// whose every cell has an anomaly. With two thirds of the nodes it is twice as much.
    const RMS: f64 = 0.015;
    const LARGEST: f64 = 0.15;

    #[test]
    fn matrices_between_the_nodes_are_those_of_the_solver() {
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
    fn tables_have_no_more_than_their_room() {
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
    fn a_matrix_of_nothing_depolarises() {
        let matrix = mueller::<Double>([[0.0; 2]; 4]);
        assert_eq!(matrix[0], 1.0);
        assert!(matrix[1..].iter().all(|&element| element == 0.0));
    }
}
