//! Reference spectra of the phase screen (docs/model.md#the-phase-screen), at many pairs of directions at once.
//!
//! Symbols:
//!
//! - q = wi + wo: the scattering vector;
//! - λ: the wavelength in µm;
//! - f = (qx, qy)/λ: the spatial frequency in 1/µm;
//! - κ = 2π·qz/λ: the phase rate in rad/µm;
//! - c_j(κ): the amplitude of order j, one DFT bin of the phase screen;
//! - f_j: the frequency of order j in 1/µm;
//! - h: the height in µm;
//! - H: half the range of heights in µm;
//! - s: the standard deviation of the coherence window (a Gaussian) in µm;
//! - g = exp(−2π²s²·|f − f_j|²): the weight of c_j by the coherence window.
//!
//! The power spectral density S in µm² is a sum over the orders around f. Values of [`Truth`] are S/λ² in 1/sr:
//!
//! - patch, one fixed coherence window: S = 4πs²·|Σ g·c_j|²;
//! - ensemble, the mean over all positions of the window: S = 4πs²·Σ g²·|c_j|².
//!
//! A transform of the tile for each λ and pair would take too long. Both c_j and |c_j|² are smooth functions of κ: c_j
//! is a mean of exp(iκh), and |c_j|² is a mean of exp(iκ(h − h′)) with |h − h′| ≤ 2H. The transform is computed at
//! Chebyshev nodes of κ ∈ [0, κ_max] only. The polynomials through the nodes then interpolate c_j and |c_j|².
//!
//! The result is exact to rounding: the number of nodes keeps the remainder below [`REMAINDER`]. [`Truth::check`]
//! compares values with the direct sum ([`Exact`]).

use crate::arguments::VISIBLE_NM;
use num_complex::Complex64;
use rayon::prelude::*;
use serde::Serialize;
use std::f64::consts::{FRAC_1_SQRT_2, PI, TAU};
use sunbeam::height_field::HeightField;
use sunbeam::lobe::Exact;
use sunbeam::scattering::Options;
use sunbeam::table::{CoherenceWindow, DENSITY_FLOOR_UM2, Model};
use sunbeam::transform::{OrderTransform, chebyshev_terms};

/// Remainder of the interpolation relative to the total power: near the rounding of sums in double precision. Smaller
/// values would add nodes without effect.
const REMAINDER: f64 = 1e-12;
/// Largest exponent a·d² ([`Axis`]) of a Gaussian that is summed. The others are below e⁻²⁹ = 2.5e-13, near rounding.
const EXPONENT_MAX: f64 = 29.0;
/// Step between the indices of the wavelengths that [`Truth::check`] compares, modulo the number of wavelengths. It is
/// a large prime, so that the checks spread over all wavelengths.
const CHECK_STRIDE: usize = 7919;

/// `S/λ²` in 1/sr of both models, for a periodic tile.
pub(crate) struct Truth {
    step_nm: f64,
    /// Number of wavelengths.
    wavelengths: usize,
    /// Values of the patch model, `[pair][wavelength]`.
    patch: Vec<f64>,
    /// Values of the ensemble model, `[pair][wavelength]`.
    ensemble: Vec<f64>,
    /// `wi + wo` of each pair.
    sums: Vec<[f64; 3]>,
    coherence_length_um: f64,
}

/// The deviation of [`Truth`] from the direct sum [`Exact`].
#[derive(Clone, Copy, Debug, Serialize)]
pub(crate) struct TruthCheck {
    /// Number of values compared, for each model.
    pub(crate) compared: usize,
    /// Largest deviation of S, relative to the largest of both models' values and [`DENSITY_FLOOR_UM2`], a hundredth of
    /// the S of a white diffuse surface.
    pub(crate) largest: f64,
}

/// The orders along one axis. The weight g is the product of a Gaussian along x and one along y.
struct Axis {
    /// Number of pixels, and of orders.
    pixels: i64,
    /// Factor a of the Gaussian `exp(−a·d²)` along this axis: `2π²s²/extent²`, where d is the distance in orders.
    sharpness: f64,
}

impl Axis {
    /// Replaces `values` by the Gaussians of the orders around `position`, a fractional order, and returns the first of
    /// these orders. Without such orders, `values` is empty.
    ///
    /// With an even number of pixels, the bin at the Nyquist frequency stands for the orders at both ends, each with
    /// half of its power. The Gaussians of both orders, factors on amplitudes, are therefore multiplied by √½.
    fn gaussians(&self, position: f64, values: &mut Vec<f64>) -> i64 {
        // Distance in orders at which the exponent a·d² is EXPONENT_MAX.
        let reach = (EXPONENT_MAX / self.sharpness).sqrt();
        let half = self.pixels / 2;
        let first = ((position - reach).ceil() as i64).max(-half);
        let last = ((position + reach).floor() as i64).min(half);
        values.clear();
        values.extend((first..=last).map(|j| {
            let edge_factor = if self.pixels % 2 == 0 && j.abs() == half { FRAC_1_SQRT_2 } else { 1.0 };
            edge_factor * (-self.sharpness * (position - j as f64).powi(2)).exp()
        }));
        first
    }
}

/// The sums over orders for one pair of directions and one wavelength, interpolated over κ.
#[derive(Clone, Copy, Default)]
struct Total {
    /// `Σ g·c_j`.
    amplitude: Complex64,
    /// `Σ g²·|c_j|²`; rounding may make it negative.
    power: f64,
}

/// The orders of the tile along both axes.
struct Orders {
    x: Axis,
    y: Axis,
}

impl Orders {
    /// Adds one Chebyshev node's contribution to `total`, over the orders around f.
    ///
    /// `position` is f in orders along x and y. `amplitudes` are the c_j of all orders at the node's κ, row-major, with
    /// order 0 first and negative orders last along each axis. `polynomial` returns the value of the node's Lagrange
    /// polynomial at the pair's κ. It is called only if there are orders around f, to save time. `gaussians` is scratch
    /// memory for x and y.
    fn add(
        &self,
        position: [f64; 2],
        amplitudes: &[Complex64],
        polynomial: impl FnOnce() -> f64,
        gaussians: &mut [Vec<f64>; 2],
        total: &mut Total,
    ) {
        let [gaussians_x, gaussians_y] = gaussians;
        let first_x = self.x.gaussians(position[0], gaussians_x);
        let first_y = self.y.gaussians(position[1], gaussians_y);
        if gaussians_x.is_empty() || gaussians_y.is_empty() {
            return;
        }
        let node_weight = polynomial();
        for (jy, gaussian_y) in (first_y..).zip(&*gaussians_y) {
            let row_start = jy.rem_euclid(self.y.pixels) * self.x.pixels;
            for (jx, gaussian_x) in (first_x..).zip(&*gaussians_x) {
                let bin = (row_start + jx.rem_euclid(self.x.pixels)) as usize;
                let amplitude = amplitudes[bin] * (gaussian_x * gaussian_y);
                total.amplitude += node_weight * amplitude;
                total.power += node_weight * amplitude.norm_sqr();
            }
        }
    }
}

impl Truth {
    /// The spectra for pairs of directions above the surface, given by their sums `wi + wo`, from 380 nm in steps of
    /// `step_nm` up to at most 780 nm.
    pub(crate) fn new(field: &HeightField, coherence_length_um: f64, sums: &[[f64; 3]], step_nm: f64) -> Self {
        let transform = OrderTransform::new(field);
        let window = CoherenceWindow::new(coherence_length_um);
        let (nx, ny) = field.size();
        let (lx, ly) = field.extent_um();
        let axis = |extent_um: f64, pixels: usize| Axis {
            pixels: pixels as i64,
            sharpness: 2.0 * (PI * window.sigma_um() / extent_um).powi(2),
        };
        let tile_orders = Orders { x: axis(lx, nx), y: axis(ly, ny) };
        let (first_nm, last_nm) = (*VISIBLE_NM.start(), *VISIBLE_NM.end());
        // The addition undoes the rounding of a whole number of steps.
        let wavelengths = ((last_nm - first_nm) / step_nm + 1e-9).floor() as usize + 1;
        let wavelength_um = |i: usize| (first_nm + i as f64 * step_nm) * 1e-3;
        let kappa_max = TAU * sums.iter().map(|q| q[2]).fold(0.0, f64::max) / wavelength_um(0);
        // exp(iκ(h − h′)) needs the most nodes: κ varies by κ_max/2 about its middle and |h − h′| is at most 2H, so the
        // phase varies by κ_max·H. Two more nodes make up for interpolation, whose error is up to twice the remainder
        // of the truncated series.
        let nodes = chebyshev_terms(kappa_max * transform.half_range_um(), REMAINDER) + 2;
        // `[pair][wavelength]`.
        let mut totals = vec![Total::default(); sums.len() * wavelengths];
        for node in 0..nodes {
            let node_angle = PI * (node as f64 + 0.5) / nodes as f64;
            // The node's κ, mapped from [−1, 1] to [0, κ_max].
            let amplitudes = transform.amplitudes(0.5 * kappa_max * (1.0 + node_angle.cos()));
            let add_node = |gaussians: &mut [Vec<f64>; 2], (totals, q): (&mut [Total], &[f64; 3])| {
                for (i, total) in totals.iter_mut().enumerate() {
                    let um = wavelength_um(i);
                    // κ = 2π·qz/λ ∈ [0, κ_max] mapped to [−1, 1].
                    let x = (2.0 * TAU * q[2] / (um * kappa_max) - 1.0).clamp(-1.0, 1.0);
                    let position = [q[0] * lx / um, q[1] * ly / um];
                    tile_orders.add(position, &amplitudes, || lagrange(node_angle, x, nodes), gaussians, total);
                }
            };
            // One task for each pair; `Default::default` makes the scratch memory of each thread.
            totals.par_chunks_mut(wavelengths).zip(sums).for_each_init(Default::default, add_node);
        }
        // 4πs²/λ², the factor on both sums.
        let peak = |i: usize| window.order_peak_um2() / wavelength_um(i % wavelengths).powi(2);
        let patch = totals.iter().enumerate().map(|(i, total)| peak(i) * total.amplitude.norm_sqr()).collect();
        // `f64::max` would turn a NaN into 0.
        let power = |total: &Total| if total.power < 0.0 { 0.0 } else { total.power };
        let ensemble = totals.iter().enumerate().map(|(i, total)| peak(i) * power(total)).collect();
        Self { step_nm, wavelengths, patch, ensemble, sums: sums.to_vec(), coherence_length_um }
    }

    /// Step between wavelengths in nm.
    pub(crate) fn step_nm(&self) -> f64 {
        self.step_nm
    }

    /// The spectrum of the pair with this index, `S/λ²` in 1/sr, from 380 nm on in steps of [`Truth::step_nm`].
    pub(crate) fn spectrum(&self, model: Model, pair: usize) -> &[f64] {
        let all = if model == Model::Patch { &self.patch } else { &self.ensemble };
        &all[pair * self.wavelengths..][..self.wavelengths]
    }

    /// Compares `count` values, spread over pairs and wavelengths, with the direct sum over `field`. A NaN in either
    /// makes the largest deviation NaN.
    pub(crate) fn check(&self, field: &HeightField, count: usize) -> TruthCheck {
        let mut largest = 0.0f64;
        for i in 0..count {
            // The pair in the middle of the i-th of `count` equal parts of the list.
            let pair = (i * self.sums.len() + self.sums.len() / 2) / count;
            let wavelength = (i * CHECK_STRIDE) % self.wavelengths;
            let um = (VISIBLE_NM.start() + wavelength as f64 * self.step_nm) * 1e-3;
            let q = self.sums[pair];
            let value = |model: Model| {
                let options = Options { model, coherence_length_um: self.coherence_length_um, ..Options::default() };
                // Albedos divide the reflectance and not S, so their table is left out (`None`).
                Exact::new(field, &options, None).power_density([q[0] / um, q[1] / um], TAU * q[2] / um)
            };
            let [patch, ensemble] = [Model::Patch, Model::Ensemble].map(value);
            let scale = patch.max(ensemble).max(DENSITY_FLOOR_UM2);
            for (model, exact) in [(Model::Patch, patch), (Model::Ensemble, ensemble)] {
                let found = self.spectrum(model, pair)[wavelength] * um * um;
                let deviation = (found - exact).abs() / scale;
                // `f64::max` would drop a NaN. Once `largest` is NaN, nothing exceeds it.
                if deviation.is_nan() || deviation > largest {
                    largest = deviation;
                }
            }
        }
        TruthCheck { compared: count, largest }
    }
}

/// The Lagrange polynomial at `x` in [−1, 1] that is 1 at the Chebyshev node `cos(node_angle)` and 0 at the other
/// nodes.
fn lagrange(node_angle: f64, x: f64, nodes: usize) -> f64 {
    // Σ_n (2 − δ_n0) T_n(cos α) T_n(cos θ)/N over n < N, with N nodes, x = cos θ and the node angle α. Each product is
    // a sum of cosines of n(θ ± α), which add up to the Dirichlet kernels of θ ± α.
    let n = nodes as f64;
    let dirichlet = |phi: f64| {
        let sin_half = (0.5 * phi).sin();
        // The limit at multiples of 2π is 2N − 1. It replaces the quotient near 0/0, where rounding would dominate.
        if sin_half.abs() < 1e-9 { 2.0 * n - 1.0 } else { ((n - 0.5) * phi).sin() / sin_half }
    };
    let theta = x.acos();
    (dirichlet(theta - node_angle) + dirichlet(theta + node_angle)) / (2.0 * n)
}

#[cfg(test)]
mod tests {
    use super::*;
    use ndarray::Array2;

    #[test]
    fn interpolation_reproduces_polynomials() {
        let nodes = 9;
        for x in [-1.0, -0.3, 0.0, 0.77, 1.0] {
            for degree in 0..nodes as i32 {
                let angle = |m: usize| PI * (m as f64 + 0.5) / nodes as f64;
                let found: f64 = (0..nodes).map(|m| lagrange(angle(m), x, nodes) * angle(m).cos().powi(degree)).sum();
                // The rounding of nine terms of at most a few.
                assert!((found - x.powi(degree)).abs() < 1e-13, "{x}^{degree}: {found}");
            }
        }
    }

    #[test]
    fn a_nan_in_the_reference_is_found() {
        let heights_um = Array2::from_shape_fn((4, 4), |(iy, ix)| 0.02 * (ix + 2 * iy) as f64);
        let field = HeightField::new(heights_um, 0.5, 0.5).unwrap();
        let mut truth = Truth::new(&field, 5.0, &[[0.1, 0.0, 1.9]], 5.0);
        assert!(truth.check(&field, 2).largest.is_finite());
        // The NaN of the first wavelength must not be lost at the second.
        truth.patch[0] = f64::NAN;
        assert!(truth.check(&field, 2).largest.is_nan());
    }
}
