//! The oracle of docs/model.md#the-phase-screen over whole spectra at many places at once.
//!
//! At a fixed frequency, amplitude and power of an order are functions of κ whose bandwidth is the range of heights.
//! So the direct double-precision sum over the tile is taken at Chebyshev nodes of κ, each serving every place and
//! wavelength, and the polynomial through the nodes is read in between. It is exact to rounding: there are so many nodes
//! that the remainder is below [`REMAINDER`], and [`Truth::check`] compares with [`Exact`] itself.

use num_complex::Complex64;
use rayon::prelude::*;
use serde::Serialize;
use std::f64::consts::{FRAC_1_SQRT_2, PI, TAU};
use sunbeam::height_field::HeightField;
use sunbeam::lobe::Exact;
use sunbeam::scattering::Options;
use sunbeam::table::{CoherenceWindow, DENSITY_FLOOR_UM2, Model};
use sunbeam::transform::{OrderTransform, chebyshev_terms};

/// Of a Chebyshev series with as many terms as there are nodes, relative to the power of the whole.
const REMAINDER: f64 = 1e-12;
/// Gaussians of an amplitude below e⁻²⁹ are left out.
const FAINT: f64 = 29.0;

/// `S/λ²` in 1/sr of both models, for a tile that repeats.
pub struct Truth {
    step_nm: f64,
    wavelengths: usize,
    /// `[place][wavelength]`.
    patch: Vec<f64>,
    ensemble: Vec<f64>,
    places: Vec<[f64; 3]>,
    coherence_length_um: f64,
}

/// How far [`Truth`] is from [`Exact`].
#[derive(Clone, Copy, Debug, Serialize)]
pub struct TruthCheck {
    /// Places and wavelengths compared, for each model.
    pub compared: usize,
    /// Largest deviation relative to the largest of the value, the mean over window places and the density floor.
    pub largest: f64,
}

/// The orders along one axis.
struct Axis {
    extent_um: f64,
    pixels: i64,
    /// The Gaussian of an amplitude falls as `exp(−sharpness·d²)`, d in orders.
    sharpness: f64,
}

impl Axis {
    /// Gaussians of the orders around `place`, the first of which is returned. In an even number of pixels the order at half
    /// the sampling rate counts half in power at either end.
    fn gaussians(&self, place: f64, values: &mut Vec<f64>) -> i64 {
        let reach = (FAINT / self.sharpness).sqrt();
        let half = self.pixels / 2;
        let (first, last) = (((place - reach).ceil() as i64).max(-half), ((place + reach).floor() as i64).min(half));
        values.clear();
        values.extend((first..=last).map(|j| {
            let share = if self.pixels % 2 == 0 && j.abs() == half { FRAC_1_SQRT_2 } else { 1.0 };
            share * (-self.sharpness * (place - j as f64).powi(2)).exp()
        }));
        first
    }
}

impl Truth {
    /// The spectra at `places`, `wi + wo` each, from 380 to 780 nm in steps of `step_nm`.
    pub fn new(field: &HeightField, coherence_length_um: f64, places: &[[f64; 3]], step_nm: f64) -> Self {
        let transform = OrderTransform::new(field);
        let window = CoherenceWindow::from_length_um(coherence_length_um);
        let (nx, ny) = field.size();
        let (lx, ly) = field.extent_um();
        let axis = |extent_um: f64, pixels: usize| Axis {
            extent_um,
            pixels: pixels as i64,
            sharpness: 2.0 * (PI * window.sigma_um() / extent_um).powi(2),
        };
        let (x, y) = (axis(lx, nx), axis(ly, ny));
        let wavelengths = (400.0 / step_nm + 1e-9).floor() as usize + 1;
        let wavelength_um = |i: usize| (380.0 + i as f64 * step_nm) * 1e-3;
        let kappa_max = TAU * places.iter().map(|q| q[2]).fold(0.0, f64::max) / 0.38;
        let nodes = chebyshev_terms(kappa_max * transform.half_range_um(), REMAINDER) + 2;
        let mut sums = vec![(Complex64::ZERO, 0.0f64); places.len() * wavelengths];
        for node in 0..nodes {
            let turn = PI * (node as f64 + 0.5) / nodes as f64;
            let orders = transform.amplitudes(0.5 * kappa_max * (1.0 + turn.cos()));
            sums.par_chunks_mut(wavelengths).zip(places).for_each_init(
                || (Vec::new(), Vec::new()),
                |(ex, ey), (sums, q)| {
                    for (i, (amplitude, power)) in sums.iter_mut().enumerate() {
                        let um = wavelength_um(i);
                        let first_x = x.gaussians(q[0] * x.extent_um / um, ex);
                        let first_y = y.gaussians(q[1] * y.extent_um / um, ey);
                        if ex.is_empty() || ey.is_empty() {
                            continue;
                        }
                        let share = lagrange(turn, (2.0 * TAU * q[2] / (um * kappa_max) - 1.0).clamp(-1.0, 1.0), nodes);
                        for (jy, ey) in (first_y..).zip(&*ey) {
                            let row = jy.rem_euclid(y.pixels) * x.pixels;
                            for (jx, ex) in (first_x..).zip(&*ex) {
                                let c = orders[(row + jx.rem_euclid(x.pixels)) as usize] * (ex * ey);
                                *amplitude += share * c;
                                *power += share * c.norm_sqr();
                            }
                        }
                    }
                },
            );
        }
        let peak = |i: usize| window.order_peak_um2() / wavelength_um(i % wavelengths).powi(2);
        let patch = sums.iter().enumerate().map(|(i, (amplitude, _))| peak(i) * amplitude.norm_sqr()).collect();
        let ensemble = sums.iter().enumerate().map(|(i, (_, power))| peak(i) * power.max(0.0)).collect();
        Self { step_nm, wavelengths, patch, ensemble, places: places.to_vec(), coherence_length_um }
    }

    /// Step between wavelengths in nm.
    pub fn step_nm(&self) -> f64 {
        self.step_nm
    }

    /// The spectrum at one of the places, `S/λ²` in 1/sr from 380 nm on in steps of [`Truth::step_nm`].
    pub fn spectrum(&self, model: Model, place: usize) -> &[f64] {
        let all = if model == Model::Patch { &self.patch } else { &self.ensemble };
        &all[place * self.wavelengths..][..self.wavelengths]
    }

    /// Compares `count` places and wavelengths, spread over all, with the direct sum of `field`.
    pub fn check(&self, field: &HeightField, count: usize) -> TruthCheck {
        let mut largest = 0.0f64;
        for i in 0..count {
            let place = (i * self.places.len() + self.places.len() / 2) / count;
            let wavelength = (i * 7919) % self.wavelengths;
            let um = (380.0 + wavelength as f64 * self.step_nm) * 1e-3;
            let q = self.places[place];
            let value = |model: Model| {
                let options = Options { model, coherence_length_um: self.coherence_length_um, ..Options::default() };
                Exact::new(field, &options, None).power_density([q[0] / um, q[1] / um], TAU * q[2] / um)
            };
            let [patch, ensemble] = [Model::Patch, Model::Ensemble].map(value);
            let scale = patch.max(ensemble).max(DENSITY_FLOOR_UM2);
            for (model, truth) in [(Model::Patch, patch), (Model::Ensemble, ensemble)] {
                let found = self.spectrum(model, place)[wavelength] * um * um;
                largest = largest.max((found - truth).abs() / scale);
            }
        }
        TruthCheck { compared: count, largest }
    }
}

/// The Lagrange polynomial of the Chebyshev node at the angle `turn`, of `nodes`, at `x` in [−1, 1].
fn lagrange(turn: f64, x: f64, nodes: usize) -> f64 {
    // Σ_n (2 − δ_n0) T_n(x_m) T_n(x), each product a sum of cosines, and those a Dirichlet kernel.
    let n = nodes as f64;
    let kernel = |phi: f64| {
        let half = (0.5 * phi).sin();
        if half.abs() < 1e-9 { 2.0 * n - 1.0 } else { ((n - 0.5) * phi).sin() / half }
    };
    let theta = x.acos();
    (kernel(theta - turn) + kernel(theta + turn)) / (2.0 * n)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn polynomials_are_reproduced() {
        let nodes = 9;
        for x in [-1.0, -0.3, 0.0, 0.77, 1.0] {
            for degree in 0..nodes as i32 {
                let at = |m: usize| PI * (m as f64 + 0.5) / nodes as f64;
                let found: f64 = (0..nodes).map(|m| lagrange(at(m), x, nodes) * at(m).cos().powi(degree)).sum();
                // Rounding of nine terms.
                assert!((found - x.powi(degree)).abs() < 1e-13, "{x}^{degree}: {found}");
            }
        }
    }
}
