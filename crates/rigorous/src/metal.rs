//! Response of the lower medium: W, the matrix from a field u on the curve to its normal derivative ∂νu.
//!
//! W = S⁻¹(½ + K), with the single and double layer potential S and K (`layers.rs`). It depends on two numbers:
//!
//! - κm² = k²n² − ky², the squared wave number in the medium across the grooves, with the wave number k in vacuum, the
//!   medium's index n, and the wave number ky along the grooves;
//! - the Bloch phase b in turns: a field changes by the factor e^{2πib} from one period d to the next.
//!
//! The unknown fields belong to *coarse* nodes, points of the curve. S and K are integrals over *fine* nodes, an odd
//! number for each coarse one, since fields in a metal vary within the skin depth 1/Im κm.
//!
//! [`MetalTable`] tabulates W of one metal: polynomial interpolation between Chebyshev nodes of ky², and a Fourier
//! series over b,
//!
//! `W(b) = Σ_p W_p e^{2πibp}`, with W_p the coupling of a target node to image p of a source node, the source moved by
//! p periods.
//!
//! The series is short because a field in the metal reaches few periods: W_p is damped by e^{−Im κm·|p|d}. Only the N
//! images nearest to the target are kept, N being odd. W is tabulated at the N phases l/N, l from 0 to N − 1. A Fourier
//! sum over W(l/N) gives the W_p, so that `W(b) = Σ_l w_l W(l/N)` with `w_l = 1/N Σ_p e^{2πi(b − l/N)p}` over the N
//! nearest images p.

use crate::discretisation::Discretisation;
use crate::error::positive;
use crate::layers::{Images, layer_matrices};
use crate::linear::{Matrix, solve, zeros};
use crate::medium::outgoing;
use crate::special::chebyshev_nodes;
use crate::{Error, Medium};
use num_complex::Complex64;
use std::f64::consts::TAU;

/// Relative error of W by interpolation. Efficiencies are off by about a hundredth of this error. A smaller tolerance
/// needs more Bloch phases and more nodes of ky².
const TOLERANCE: f64 = 1e-4;

/// Lowest and highest ky²/k² that a table covers.
///
/// Directions of light have 0 to 1. Negative values, where κ² = k² − ky² exceeds k², belong to tables over directions
/// that extend beyond the horizon (`src/grating` of the main crate). With a lower minimum a table needs more nodes of
/// ky²; with a higher one more of those directions are solved without the table.
pub const KY_SQUARED_RANGE: [f64; 2] = [-0.35, 1.0];

/// Most Chebyshev nodes of ky². A medium that needs more is solved directly; larger values take more memory and time. A
/// float, since the estimate that it bounds may be infinite.
const KY_NODES_MAX: f64 = 11.0;

/// W between coarse nodes, target × source; each row is multiplied by the target's speed |dr/dτ| (`nodes.rs`).
/// Arguments are κm² in (rad/µm)² and the Bloch phase in turns.
///
/// S and K have a row for each coarse node and a column for each fine one. Their product with the interpolation from
/// coarse to fine nodes has a column for each coarse node.
///
/// # Errors
/// Special functions that overflow, and solutions that are not finite.
pub(crate) fn response(mesh: &Discretisation, kappa_m_squared: Complex64, bloch: f64) -> Result<Matrix, Error> {
    let oversampling = mesh.resolution().oversampling;
    let layers = layer_matrices(&mesh.fine, oversampling, outgoing(kappa_m_squared), bloch)?;
    let single = mesh.interpolation.apply(&layers.single, bloch);
    let mut double = mesh.interpolation.apply(&layers.double, bloch);
    double.diag_mut().map_inplace(|value| *value += 0.5);
    solve(&single, &double, "the field in the lower medium")
}

/// W of one metal at one wavelength, interpolated for every direction.
///
/// A solution without this table assembles S and K on the fine nodes for every direction. W is analytic in ky²
/// and couples only points within some skin depths. A few values of ky² and of the Bloch phase therefore give W for all
/// directions.
///
/// ```
/// use sunbeam_rigorous::{Discretisation, Medium, MetalTable, Profile, Resolution};
///
/// let profile = Profile::sinusoid(1.1, 0.1)?;
/// let silver = Medium::index(0.06, 3.59)?;
/// let mesh = Discretisation::new(&profile, Resolution::new(&profile, &silver, 550.0)?)?;
/// let table = MetalTable::new(&mesh, &silver, 550.0)?.expect("fields in silver decay within a few periods");
/// let air = mesh.air(1.7, 0.3)?;
/// let (read, direct) = (air.solve_tabulated(&table)?, air.solve(&silver, 550.0)?);
/// assert!((read.efficiency(0, 0) - direct.efficiency(0, 0)).abs() < 1e-5);
/// # Ok::<(), sunbeam_rigorous::Error>(())
/// ```
pub struct MetalTable<'a> {
    /// The profile with its nodes.
    mesh: &'a Discretisation,
    /// Refractive index of the metal.
    index: Complex64,
    /// Wave number k in vacuum, in rad/µm.
    wave_number: f64,
    /// Chebyshev nodes of ky², in (rad/µm)².
    ky_squared: Vec<f64>,
    /// Number N of tabulated Bloch phases l/N, l from 0 on; odd.
    phases: usize,
    /// [`response`] at the nodes of ky² and the Bloch phases: `[ky²][phase]`.
    responses: Vec<Vec<Matrix>>,
}

impl<'a> MetalTable<'a> {
    /// Tabulates the response of a metal at a wavelength (nm).
    ///
    /// Returns `None` for a perfect conductor, and where the table would be too large: where fields in the medium do
    /// not decay within a few periods, as in a dielectric. [`Air::solve`](crate::Air::solve) solves both.
    ///
    /// # Errors
    /// A wavelength that is not finite and positive, special functions that overflow, and solutions that are not
    /// finite.
    pub fn new(mesh: &'a Discretisation, medium: &Medium, wavelength_nm: f64) -> Result<Option<Self>, Error> {
        let &Medium::Index(index) = medium else { return Ok(None) };
        let wave_number = TAU * 1e3 / positive("wavelength in nm", wavelength_nm)?;
        let kappa_m_squared = |ky_squared: f64| index * index * wave_number * wave_number - ky_squared;
        let [low, high] = KY_SQUARED_RANGE.map(|ratio| ratio * wave_number * wave_number);
        let (middle, half) = (0.5 * (low + high), 0.5 * (high - low));
        // Interpolation at n nodes converges as ρ^−n, so ρ^−n = TOLERANCE gives n. The range of ky² is mapped to
        // [−1, 1]. ρ is the sum of the semi-axes of the ellipse with foci ±1 (Bernstein's) through the singularity of
        // W at κm² = 0.
        let singularity = kappa_m_squared(middle) / half;
        let rho_or_reciprocal = (singularity + (singularity * singularity - 1.0).sqrt()).norm();
        // The two signs of the square root give ρ and 1/ρ.
        let rho = rho_or_reciprocal.max(1.0 / rho_or_reciprocal);
        let ky_nodes = (-TOLERANCE.ln() / rho.ln()).ceil();
        // Im κm is monotonic in ky², so the slowest decay is at an end of the range.
        let slowest_decay = outgoing(kappa_m_squared(low)).im.min(outgoing(kappa_m_squared(high)).im);
        let period = mesh.profile().period_um();
        // Images kept on either side of the nearest one. The first one left out is at least images + ½ periods away,
        // where fields have decayed below the tolerance: e^{−Im κm·(images + ½)d} ≤ TOLERANCE. With strong decay the
        // solution is negative, and no image is kept besides the nearest one.
        let images = (-TOLERANCE.ln() / (slowest_decay * period) - 0.5).ceil().max(0.0);
        let phases = 2.0 * images + 1.0;
        // Fields that need the sum over all images reach too many periods for a table. The range of `ky_nodes` also
        // refuses an estimate that is infinite or NaN.
        let needs_lattice_sum = matches!(Images::needed(slowest_decay, period), Images::All);
        if needs_lattice_sum || !(1.0..=KY_NODES_MAX).contains(&ky_nodes) {
            return Ok(None);
        }
        let (phases, ky_nodes) = (phases as usize, ky_nodes as usize);
        let ky_squared: Vec<f64> = chebyshev_nodes(ky_nodes).iter().map(|x| middle + half * x).collect();
        let responses = ky_squared
            .iter()
            .map(|&ky_squared| {
                let kappa_m_squared = kappa_m_squared(ky_squared);
                (0..phases).map(|l| response(mesh, kappa_m_squared, l as f64 / phases as f64)).collect()
            })
            .collect::<Result<_, _>>()?;
        Ok(Some(Self { mesh, index, wave_number, ky_squared, phases, responses }))
    }

    /// Refractive index `eta + i·k` of the metal.
    pub fn index(&self) -> Complex64 {
        self.index
    }

    /// Wave number k in vacuum, in rad/µm.
    pub fn wave_number_per_um(&self) -> f64 {
        self.wave_number
    }

    /// [`response`], interpolated at a squared wave number along y in (rad/µm)² and a Bloch phase in turns. The former
    /// is within [`KY_SQUARED_RANGE`] times k², which is not checked: polynomials extrapolate poorly.
    pub(crate) fn at(&self, ky_squared: f64, bloch: f64) -> Matrix {
        let n = self.mesh.nodes();
        let ky_weights: Vec<f64> =
            (0..self.ky_squared.len()).map(|i| lagrange(&self.ky_squared, i, ky_squared)).collect();
        // `[phase][periods + 1]`. The image nearest to the target is the source moved by −1, 0 or 1 periods. This
        // number of periods differs between pairs of nodes, and so do the N images that are kept.
        let phase_weights: Vec<[Complex64; 3]> =
            (0..self.phases).map(|l| [-1, 0, 1].map(|periods| self.phase_weight(l, periods, bloch))).collect();
        let image_indices = self.image_indices();
        let mut result = zeros(n, n);
        for (responses, ky_weight) in self.responses.iter().zip(&ky_weights) {
            for (matrix, phase_weight) in responses.iter().zip(&phase_weights) {
                let weights = phase_weight.map(|weight| weight * *ky_weight);
                for source in 0..n {
                    let indices = &image_indices[source * n..(source + 1) * n];
                    let (from, mut into) = (matrix.column(source), result.column_mut(source));
                    for ((into, from), &index) in into.iter_mut().zip(from).zip(indices) {
                        *into += from * weights[index as usize];
                    }
                }
            }
        }
        result
    }

    /// Weight w_l of the tabulated phase l/N, for pairs of nodes whose nearest image is the source moved by `periods`:
    /// the sum runs over the N images p around p = `periods`.
    fn phase_weight(&self, l: usize, periods: i32, bloch: f64) -> Complex64 {
        let images = (self.phases / 2) as i32;
        let difference = bloch - l as f64 / self.phases as f64;
        let sum: Complex64 = (periods - images..=periods + images)
            // Whole turns are removed, which keeps the digits of the angle.
            .map(|p| Complex64::cis(TAU * (difference * f64::from(p)).fract()))
            .sum();
        sum / self.phases as f64
    }

    /// Index of the weight of each pair of coarse nodes in [`MetalTable::at`]: `periods + 1`, 0 to 2, where the nearest
    /// image is the source moved by `periods`. The pair is at `source · n + target`.
    fn image_indices(&self) -> Vec<u8> {
        let n = self.mesh.nodes();
        let coarse = &self.mesh.coarse;
        (0..n * n).map(|i| (coarse.separation(i % n, i / n).periods + 1) as u8).collect()
    }
}

/// Lagrange basis polynomial i of `nodes` at x: 1 at node i, 0 at the others.
fn lagrange(nodes: &[f64], i: usize, x: f64) -> f64 {
    nodes.iter().enumerate().filter(|&(j, _)| j != i).map(|(_, node)| (x - node) / (nodes[i] - node)).product()
}
