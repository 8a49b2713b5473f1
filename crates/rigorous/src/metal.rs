//! The lower medium's answer to a field on the curve: W, from the field to its normal derivative.

use crate::discretisation::Discretisation;
use crate::error::positive;
use crate::layers::{Images, layers};
use crate::linear::{Matrix, solve, zeros};
use crate::medium::outgoing;
use crate::{Error, Medium};
use num_complex::Complex64;
use std::f64::consts::{PI, TAU};

/// What W may be off by interpolation, of its size: efficiencies are then off by about a hundredth of it.
const TOLERANCE: f64 = 1e-4;

/// The squared wave number along y that a table covers, over k²: below 0 for cells of directions that reach beyond the
/// horizon.
const KY_SQUARED: [f64; 2] = [-0.35, 1.0];

/// Phases at most; a medium that needs more has no table.
const PHASES_MAX: usize = 9;

/// W at the nodes, times their speed, for a squared wave number km² across y and a phase in turns a period.
pub(crate) fn response(mesh: &Discretisation, square: Complex64, bloch: f64) -> Result<Matrix, Error> {
    let factor = mesh.resolution().oversampling;
    let layers = layers(&mesh.fine, factor, outgoing(square), bloch)?;
    let single = mesh.interpolation.apply(&layers.single, bloch);
    let mut double = mesh.interpolation.apply(&layers.double, bloch);
    double.diag_mut().map_inplace(|value| *value += 0.5);
    solve(&single, &double, "the field in the lower medium")
}

/// W of one metal at one wavelength, for every direction: what a table over directions asks for again and again.
///
/// W is analytic in ky² and falls off within the skin depth, so a few values of ky² and of the phase give it for all.
pub struct MetalTable<'a> {
    mesh: &'a Discretisation,
    index: Complex64,
    wave_number: f64,
    /// Chebyshev nodes of ky².
    ky_squared: Vec<f64>,
    /// Equally spaced phases.
    phases: usize,
    /// `[ky²][phase]`.
    responses: Vec<Vec<Matrix>>,
}

impl<'a> MetalTable<'a> {
    /// Tabulates a metal of index eta + ik at a wavelength (nm); `None` where its field does not fall off within a few periods,
    /// as for a dielectric or a perfect conductor: those are solved one by one.
    ///
    /// # Errors
    /// A wavelength that is not finite and positive, or functions that are not finite.
    pub fn new(mesh: &'a Discretisation, medium: &Medium, wavelength_nm: f64) -> Result<Option<Self>, Error> {
        let &Medium::Index(index) = medium else { return Ok(None) };
        let wave_number = TAU * 1e3 / positive("wavelength in nm", wavelength_nm)?;
        let square = |ky_squared: f64| index * index * wave_number * wave_number - ky_squared;
        let [low, high] = KY_SQUARED.map(|share| share * wave_number * wave_number);
        let (middle, half) = (0.5 * (low + high), 0.5 * (high - low));
        // A Bernstein ellipse that ends where km² = 0.
        let along = square(middle) / half;
        let ratio = (along + (along * along - 1.0).sqrt()).norm();
        let ratio = ratio.max(1.0 / ratio);
        let nodes = (-TOLERANCE.ln() / ratio.ln()).ceil();
        let slowest = outgoing(square(low)).im.min(outgoing(square(high)).im);
        let period = mesh.profile().period_um();
        let images = (-TOLERANCE.ln() / (slowest * period) - 0.5).ceil().max(0.0);
        let phases = 2.0 * images + 1.0;
        let all = matches!(Images::needed(slowest, period), Images::All);
        if all || phases > PHASES_MAX as f64 || !(1.0..12.0).contains(&nodes) {
            return Ok(None);
        }
        let (phases, count) = (phases as usize, nodes as usize);
        let ky_squared: Vec<f64> =
            (0..count).map(|i| middle + half * (PI * (i as f64 + 0.5) / count as f64).cos()).collect();
        let responses = ky_squared
            .iter()
            .map(|&ky| (0..phases).map(|l| response(mesh, square(ky), l as f64 / phases as f64)).collect())
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

    /// W at a squared wave number along y (1/µm²) and a phase.
    pub(crate) fn at(&self, ky_squared: f64, bloch: f64) -> Matrix {
        let n = self.mesh.nodes();
        let lagrange: Vec<f64> =
            (0..self.ky_squared.len()).map(|i| lagrange(&self.ky_squared, i, ky_squared)).collect();
        let phases = self.phases as i32;
        // With the image p at phase `bloch`, from its Fourier series over the tabulated phases.
        let weights: Vec<[Complex64; 3]> =
            (0..phases).map(|l| [-1, 0, 1].map(|turn| self.phase_weight(l, turn, bloch))).collect();
        let turns = self.turns();
        let mut result = zeros(n, n);
        for (of_phase, weight) in self.responses.iter().zip(&lagrange) {
            for (response, phase) in of_phase.iter().zip(&weights) {
                let phase = phase.map(|p| p * *weight);
                for j in 0..n {
                    let turns = &turns[j * n..(j + 1) * n];
                    let (from, mut into) = (response.column(j), result.column_mut(j));
                    for ((into, from), &turn) in into.iter_mut().zip(from).zip(turns) {
                        *into += from * phase[turn as usize];
                    }
                }
            }
        }
        result
    }

    /// `1/n Σ_p e^{2πi(b − l/n)p}` over the n images p around `turn`.
    fn phase_weight(&self, l: i32, turn: i32, bloch: f64) -> Complex64 {
        let images = (self.phases / 2) as i32;
        let apart = bloch - f64::from(l) / self.phases as f64;
        let sum: Complex64 =
            (turn - images..=turn + images).map(|p| Complex64::cis(TAU * (apart * f64::from(p)).fract())).sum();
        sum / self.phases as f64
    }

    /// The periods by which each pair's nearest image is moved, plus one; by columns.
    fn turns(&self) -> Vec<u8> {
        let n = self.mesh.nodes();
        let coarse = &self.mesh.coarse;
        (0..n * n).map(|i| (coarse.separation(i % n, i / n).turn + 1).clamp(0, 2) as u8).collect()
    }
}

fn lagrange(nodes: &[f64], i: usize, x: f64) -> f64 {
    nodes.iter().enumerate().filter(|&(j, _)| j != i).map(|(_, node)| (x - node) / (nodes[i] - node)).product()
}
