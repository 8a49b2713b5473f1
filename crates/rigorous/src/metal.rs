//! Response of the lower medium: W, the matrix from a field u on the curve to its normal derivative ∂νu.
//!
//! W = S⁻¹(½ + K) depends on the squared wave number κm² = k²n² − ky² and on the Bloch phase b (symbols: `lib.rs`). It
//! is solved on `oversampling` times as many nodes as the air, since fields in a metal vary within the skin depth 1/Im
//! κm.
//!
//! [`MetalTable`] tabulates W of one metal: Chebyshev interpolation over ky², and a Fourier series over b,
//!
//! `W(b) = Σ_p W_p e^{2πibp}`, with W_p the coupling of a target to image p of a source.
//!
//! The series is short because a field in the metal reaches few periods: W_p is damped by e^{−Im κm·|p|d}. Of the
//! images only the n nearest to the target count, n being odd. Their sum at n tabulated phases l/n determines the W_p,
//! and so `W(b) = Σ_l w_l W(l/n)` with `w_l = 1/n Σ_p e^{2πi(b − l/n)p}` over the n nearest images p.

use crate::discretisation::Discretisation;
use crate::error::positive;
use crate::layers::{Images, layers};
use crate::linear::{Matrix, solve, zeros};
use crate::medium::outgoing;
use crate::{Error, Medium};
use num_complex::Complex64;
use std::f64::consts::{PI, TAU};

/// Relative error of W by interpolation. Chosen: efficiencies are then off by about a hundredth of it (1e-6).
const TOLERANCE: f64 = 1e-4;

/// Range of ky²/k² that a table covers: at most 1 for real directions. Chosen: negative values serve cells of a table
/// over directions (`src/grating` of the main crate) that extend beyond the horizon.
pub const KY_SQUARED_RANGE: [f64; 2] = [-0.35, 1.0];

/// Most tabulated Bloch phases. Chosen: a medium that needs more is solved directly.
const PHASES_MAX: usize = 9;

/// Most Chebyshev nodes of ky². Chosen: a medium that needs more is solved directly.
const KY_NODES_MAX: f64 = 12.0;

/// W at the nodes, times their speed |dr/dτ| (`nodes.rs`), for κm² (`kappa_squared`, 1/µm²) and a Bloch phase in turns.
///
/// Rows are targets, columns are sources, both at the coarse nodes. Interpolation carries the sources from coarse to
/// fine nodes.
pub(crate) fn response(mesh: &Discretisation, kappa_squared: Complex64, bloch: f64) -> Result<Matrix, Error> {
    let factor = mesh.resolution().oversampling;
    let layers = layers(&mesh.fine, factor, outgoing(kappa_squared), bloch)?;
    let single = mesh.interpolation.apply(&layers.single, bloch);
    let mut double = mesh.interpolation.apply(&layers.double, bloch);
    double.diag_mut().map_inplace(|value| *value += 0.5);
    solve(&single, &double, "the field in the lower medium")
}

/// W of one metal at one wavelength, interpolated for every direction.
///
/// Tables over directions solve for hundreds of directions; each would assemble layers on the oversampled nodes. W is
/// analytic in ky² and decays within the skin depth, so a few values of ky² and of the Bloch phase give it for all.
///
/// ```
/// use sunbeam_rigorous::{Discretisation, Medium, MetalTable, Profile, Resolution};
///
/// let profile = Profile::sinusoid(1.1, 0.1)?;
/// let silver = Medium::index(0.06, 3.59)?;
/// let mesh = Discretisation::new(&profile, Resolution::new(&profile, &silver, 550.0)?)?;
/// let table = MetalTable::new(&mesh, &silver, 550.0)?.expect("silver absorbs within a period");
/// let air = mesh.air(1.7, 0.3)?;
/// let (read, direct) = (air.solve_tabulated(&table)?, air.solve(&silver, 550.0)?);
/// assert!((read.efficiency(0, 0) - direct.efficiency(0, 0)).abs() < 1e-5);
/// # Ok::<(), sunbeam_rigorous::Error>(())
/// ```
pub struct MetalTable<'a> {
    /// Nodes of the profile.
    mesh: &'a Discretisation,
    /// Refractive index of the metal.
    index: Complex64,
    /// Wave number k in vacuum, in 1/µm.
    wave_number: f64,
    /// Chebyshev nodes of ky², in 1/µm².
    ky_squared: Vec<f64>,
    /// Number of tabulated Bloch phases `l/phases`, l from 0 on; odd.
    phases: usize,
    /// W, indexed `[ky²][phase]`.
    responses: Vec<Vec<Matrix>>,
}

impl<'a> MetalTable<'a> {
    /// Tabulates the response of a metal at a wavelength (nm).
    ///
    /// Returns `None` where a field in the medium does not decay within a few periods, as in a dielectric, and for a
    /// perfect conductor. [`Air::solve`](crate::Air::solve) serves both.
    ///
    /// # Errors
    /// A wavelength that is not finite and positive, or special functions that overflow.
    pub fn new(mesh: &'a Discretisation, medium: &Medium, wavelength_nm: f64) -> Result<Option<Self>, Error> {
        let &Medium::Index(index) = medium else { return Ok(None) };
        let wave_number = TAU * 1e3 / positive("wavelength in nm", wavelength_nm)?;
        let kappa_squared = |ky_squared: f64| index * index * wave_number * wave_number - ky_squared;
        let [low, high] = KY_SQUARED_RANGE.map(|ratio| ratio * wave_number * wave_number);
        let (middle, half) = (0.5 * (low + high), 0.5 * (high - low));
        // Interpolation at n nodes converges as ρ^−n, with ρ the sum of semi-axes of the Bernstein ellipse through the
        // singularity of W at κm² = 0.
        let singularity = kappa_squared(middle) / half;
        let rho = (singularity + (singularity * singularity - 1.0).sqrt()).norm();
        let rho = rho.max(1.0 / rho);
        let nodes = (-TOLERANCE.ln() / rho.ln()).ceil();
        // Images up to this number of periods away are damped by less than the tolerance.
        let slowest = outgoing(kappa_squared(low)).im.min(outgoing(kappa_squared(high)).im);
        let period = mesh.profile().period_um();
        let images = (-TOLERANCE.ln() / (slowest * period) - 0.5).ceil().max(0.0);
        let phases = 2.0 * images + 1.0;
        let all = matches!(Images::needed(slowest, period), Images::All);
        if all || phases > PHASES_MAX as f64 || !(1.0..KY_NODES_MAX).contains(&nodes) {
            return Ok(None);
        }
        let (phases, count) = (phases as usize, nodes as usize);
        let ky_squared: Vec<f64> =
            (0..count).map(|i| middle + half * (PI * (i as f64 + 0.5) / count as f64).cos()).collect();
        let responses = ky_squared
            .iter()
            .map(|&ky| (0..phases).map(|l| response(mesh, kappa_squared(ky), l as f64 / phases as f64)).collect())
            .collect::<Result<_, _>>()?;
        Ok(Some(Self { mesh, index, wave_number, ky_squared, phases, responses }))
    }

    /// Refractive index.
    pub fn index(&self) -> Complex64 {
        self.index
    }

    /// Wave number in vacuum, in 1/µm.
    pub fn wave_number_per_um(&self) -> f64 {
        self.wave_number
    }

    /// W times the speed of the nodes, at a squared wave number along y (1/µm²) and a Bloch phase (turns).
    ///
    /// Sums the tabulated matrices with Lagrange weights over ky² and Fourier weights over the phase.
    pub(crate) fn at(&self, ky_squared: f64, bloch: f64) -> Matrix {
        let n = self.mesh.nodes();
        let lagrange: Vec<f64> =
            (0..self.ky_squared.len()).map(|i| lagrange(&self.ky_squared, i, ky_squared)).collect();
        let phases = self.phases as i32;
        // The weight of a tabulated phase depends on the period that the nearest image of the source lies in, which
        // differs between pairs of nodes.
        let weights: Vec<[Complex64; 3]> =
            (0..phases).map(|l| [-1, 0, 1].map(|periods| self.phase_weight(l, periods, bloch))).collect();
        let shifts = self.image_shifts();
        let mut result = zeros(n, n);
        for (responses, weight) in self.responses.iter().zip(&lagrange) {
            for (response, phase) in responses.iter().zip(&weights) {
                let phase = phase.map(|p| p * *weight);
                for j in 0..n {
                    let shifts = &shifts[j * n..(j + 1) * n];
                    let (from, mut into) = (response.column(j), result.column_mut(j));
                    for ((into, from), &shift) in into.iter_mut().zip(from).zip(shifts) {
                        *into += from * phase[shift as usize];
                    }
                }
            }
        }
        result
    }

    /// Weight w_l of tabulated phase l/n, for pairs of nodes whose nearest image is `periods` away: the sum runs over
    /// the n images around this image.
    fn phase_weight(&self, l: i32, periods: i32, bloch: f64) -> Complex64 {
        let images = (self.phases / 2) as i32;
        let difference = bloch - f64::from(l) / self.phases as f64;
        let sum: Complex64 = (periods - images..=periods + images)
            .map(|p| Complex64::cis(TAU * (difference * f64::from(p)).fract()))
            .sum();
        sum / self.phases as f64
    }

    /// Period that the nearest image of each pair of nodes lies in, plus one (0, 1 or 2); column-major.
    fn image_shifts(&self) -> Vec<u8> {
        let n = self.mesh.nodes();
        let coarse = &self.mesh.coarse;
        (0..n * n).map(|i| (coarse.separation(i % n, i / n).periods + 1).clamp(0, 2) as u8).collect()
    }
}

/// Lagrange basis polynomial i of `nodes` at x.
fn lagrange(nodes: &[f64], i: usize, x: f64) -> f64 {
    nodes.iter().enumerate().filter(|&(j, _)| j != i).map(|(_, node)| (x - node) / (nodes[i] - node)).product()
}
