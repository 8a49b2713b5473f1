//! Reference evaluation of the reflectance: direct double-precision sums, without tables.
//!
//! | symbol | meaning |
//! | --- | --- |
//! | h | height in µm; the phase screen is `exp(iκh)` |
//! | κ | phase rate in rad per µm of height |
//! | f | spatial frequency in cycles/µm |
//! | S(f; κ) | power spectrum in µm², a density over f |
//! | s | standard deviation of the coherence window in µm, a quarter of the coherence length |
//! | c_j, f_j | amplitude and frequency of order j of a tile that repeats |
//! | p | pixel area in µm² |
//! | t | taper of an aperiodic scan (a Tukey window), between 0 and 1 |
//! | x | position of a pixel in µm, from the middle of the scan |
//! | A(r) | autocorrelation of `t exp(iκh)` at the lag r in µm |
//!
//! S for each coherence model (docs/model.md#coherence) and tiling: the *ensemble* is the mean over all positions of
//! the coherence window, a *patch* has one fixed position; a *periodic* tile repeats, an *aperiodic* scan does not.
//!
//! - ensemble, periodic: `4πs² Σ_j |c_j|² exp(−4π²s²|f − f_j|²)`;
//! - patch, periodic: `4πs² |Σ_j c_j exp(−2π²s²|f − f_j|²)|²`;
//! - ensemble, aperiodic: `p Σ_r A(r)/A(0) exp(−|r|²/(4s²)) exp(2πi f·r)`;
//! - patch, aperiodic: `p |Σ_x t g exp(iκh) exp(2πi f·x)|² / Σ_x (t g)²`, with `g = exp(−|x|²/(2s²))`.
//!
//! Every sum is over products of a *summand*, which depends on κ only, and a *weight*, which depends on f. Each weight
//! is the product of a factor along x and a factor along y.

use super::transmissive::value_at_body;
use crate::energy::AlbedoTable;
use crate::height_field::HeightField;
use crate::scattering::{Options, Pair, Vec3};
use crate::table::{CoherenceWindow, Model, Tiling, lag_grid, taper};
use crate::transform::{Direction, Fft2, OrderTransform};
use std::f64::consts::{PI, TAU};
use std::sync::{Arc, Mutex};
use sunbeam_fourier::num_complex::Complex64;

/// Reflectance by the direct sums at the head of this file, without tables. No Gaussian is truncated.
///
/// A periodic tile is summed over all its orders. An aperiodic scan is summed over the lags of its autocorrelation
/// (ensemble) or over its pixels (patch). One evaluation costs a Fourier transform of the tile and a sum over it.
///
/// ```
/// use sunbeam::lobe::Exact;
/// use sunbeam::{Options, Preset};
///
/// let options = Options { coherence_length_um: 20.0, ..Options::default() };
/// let exact = Exact::new(&Preset::Flat.build(None, None)?, &options, None);
/// let (wi, mirror) = ([0.6, 0.0, 0.8], [-0.6, 0.0, 0.8]);
/// assert!(exact.eval(wi, mirror, 550.0) > 0.0);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub struct Exact {
    /// Transform of the phase screen `exp(iκh)`.
    transform: OrderTransform,
    options: Options,
    /// Extent of the tile along x and y.
    extent_um: (f64, f64),
    /// Size of a pixel along x and y.
    pixel_um: (f64, f64),
    /// Taper t along x and y of an aperiodic scan; `None` for a periodic tile.
    tapers: Option<(Vec<f64>, Vec<f64>)>,
    /// Albedos by which the reflectance is divided.
    albedo: Option<Arc<AlbedoTable>>,
    /// κ and summands ([`Exact::summands`]) of the last evaluation; consecutive evaluations often share κ.
    last: Mutex<Option<(f64, Arc<Vec<Complex64>>)>>,
}

impl Exact {
    /// The reference evaluation of `field`. The reflectance is divided by `albedo` to conserve energy; `None` leaves it
    /// undivided, whatever `options` say.
    pub fn new(field: &HeightField, options: &Options, albedo: Option<Arc<AlbedoTable>>) -> Self {
        let (nx, ny) = field.size();
        Self {
            transform: OrderTransform::new(field),
            options: options.clone(),
            extent_um: field.extent_um(),
            pixel_um: (field.dx_um(), field.dy_um()),
            tapers: (options.tiling == Tiling::Aperiodic).then(|| (taper(nx), taper(ny))),
            albedo,
            last: Mutex::new(None),
        }
    }

    /// `f_r` in 1/sr, with the factors of [`Surface::eval`](super::Surface::eval). Zero unless both directions lie
    /// above the surface, or on either side of a transparent body, and the wavelength (nm) is positive.
    pub fn eval(&self, wi: Vec3, wo: Vec3, wavelength_nm: f64) -> f64 {
        if let Some(body) = self.options.body {
            let density = |f: [f64; 2], kappa: f64| self.power_density(f, kappa);
            return value_at_body(body, wi, wo, wavelength_nm, density, self.albedo.as_deref());
        }
        let Some(pair) = Pair::new(wi, wo).filter(|_| wavelength_nm > 0.0) else { return 0.0 };
        let wavelength_um = wavelength_nm * 1e-3;
        let f = [pair.u / wavelength_um, pair.v / wavelength_um];
        let density = self.power_density(f, pair.kappa(wavelength_um));
        let factor = self.albedo.as_ref().map_or(1.0, |albedo| albedo.factor(wi, wo, wavelength_nm));
        self.options.angular_factor(&pair) * factor * density / (wavelength_um * wavelength_um)
    }

    /// `S(f; κ)` in µm², with `f` in cycles/µm and `kappa` in rad/µm.
    pub fn power_density(&self, f: [f64; 2], kappa: f64) -> f64 {
        let s = CoherenceWindow::new(self.options.coherence_length_um).sigma_um();
        let (nx, ny) = self.transform.size();
        let (dx_um, dy_um) = self.pixel_um;
        // Sums over pixels and lags are periodic in f. Above the Nyquist frequency S is defined as 0.
        let is_above_nyquist = 2.0 * f[0].abs() * dx_um > 1.0 || 2.0 * f[1].abs() * dy_um > 1.0;
        if self.tapers.is_some() && is_above_nyquist {
            return 0.0;
        }
        let summands = self.summands(kappa);
        let density = match (self.options.model, &self.tapers) {
            (Model::Ensemble, None) => {
                // The factor ½ of the Nyquist bin (`order_weights`) is on its power.
                let gaussian = |df: f64| (-4.0 * PI * PI * s * s * df * df).exp();
                let weights_x = order_weights(nx, self.extent_um.0, f[0], 0.5, gaussian);
                let weights_y = order_weights(ny, self.extent_um.1, f[1], 0.5, gaussian);
                4.0 * PI * s * s * separable_sum(&summands, &weights_x, &weights_y).re
            }
            (Model::Patch, None) => {
                let gaussian = |df: f64| (-2.0 * PI * PI * s * s * df * df).exp();
                // A factor ½ on the power of the Nyquist bin is √½ on its amplitude.
                let weights_x = order_weights(nx, self.extent_um.0, f[0], 0.5f64.sqrt(), gaussian);
                let weights_y = order_weights(ny, self.extent_um.1, f[1], 0.5f64.sqrt(), gaussian);
                4.0 * PI * s * s * separable_sum(&summands, &weights_x, &weights_y).norm_sqr()
            }
            (Model::Ensemble, Some(_)) => {
                let (lags_x, lags_y) = lag_grid(nx, ny);
                let (weights_x, weights_y) = (lag_weights(lags_x, dx_um, f[0], s), lag_weights(lags_y, dy_um, f[1], s));
                // The first summand is that of the lag 0.
                dx_um * dy_um * separable_sum(&summands, &weights_x, &weights_y).re / summands[0].re
            }
            (Model::Patch, Some((taper_x, taper_y))) => {
                let (weights_x, power_x) = pixel_weights(taper_x, dx_um, f[0], s);
                let (weights_y, power_y) = pixel_weights(taper_y, dy_um, f[1], s);
                dx_um * dy_um * separable_sum(&summands, &weights_x, &weights_y).norm_sqr() / (power_x * power_y)
            }
        };
        // Rounding may leave the real parts of the ensemble just below zero.
        density.max(0.0)
    }

    /// Summands at one κ, row-major `[iy][ix]`: `|c_j|²` or `c_j` for a periodic tile, and `A(r)` times a constant or
    /// `exp(iκh)` for a scan (ensemble or patch). Orders and lags are in FFT order: from 0 upwards, then the negative
    /// ones. Pixels are in the order of the scan.
    fn summands(&self, kappa: f64) -> Arc<Vec<Complex64>> {
        // A poisoned lock is used all the same: a thread that panics with the lock held leaves the pair consistent.
        let lock = || self.last.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        if let Some((_, summands)) = lock().as_ref().filter(|(last_kappa, _)| *last_kappa == kappa) {
            return summands.clone();
        }
        // Not locked during the transform, which uses rayon. A thread that waits there may run another evaluation,
        // which would then wait for a lock that its own thread holds.
        let summands = Arc::new(match (self.options.model, &self.tapers) {
            (Model::Ensemble, None) => {
                self.transform.amplitudes(kappa).into_iter().map(|c| c.norm_sqr().into()).collect()
            }
            (Model::Patch, None) => self.transform.amplitudes(kappa),
            (Model::Ensemble, Some((taper_x, taper_y))) => {
                autocorrelation(&self.transform.screen(kappa), taper_x, taper_y)
            }
            (Model::Patch, Some(_)) => self.transform.screen(kappa),
        });
        *lock() = Some((kappa, summands.clone()));
        summands
    }
}

/// Gaussian weights of all `n` orders along one axis at the frequency `f` in cycles/µm, in FFT order. `gaussian` takes
/// the distance from f to the order's frequency in cycles/µm.
///
/// The Nyquist bin of an even `n` stands for the orders n/2 and −n/2, which share its power equally. `nyquist` is
/// the factor on the weight of each: ½ for powers, √½ for amplitudes.
fn order_weights(n: usize, extent_um: f64, f: f64, nyquist: f64, gaussian: impl Fn(f64) -> f64) -> Vec<Complex64> {
    (0..n as i64)
        .map(|i| {
            let at = |j: i64| gaussian(f - j as f64 / extent_um);
            let n = n as i64;
            let value = match (2 * i).cmp(&n) {
                std::cmp::Ordering::Less => at(i),
                std::cmp::Ordering::Equal => nyquist * (at(i) + at(-i)),
                std::cmp::Ordering::Greater => at(i - n),
            };
            value.into()
        })
        .collect()
}

/// Weights `exp(−r²/(4s²)) exp(2πi f·r)` of the `n` lags r along one axis, in FFT order. `f` is in cycles/µm, and `s`
/// in µm.
fn lag_weights(n: usize, pixel_um: f64, f: f64, s: f64) -> Vec<Complex64> {
    let lag_um = |i: usize| {
        // The upper half of the grid holds the negative lags.
        let lag = if 2 * i > n { i as f64 - n as f64 } else { i as f64 };
        lag * pixel_um
    };
    (0..n).map(|i| Complex64::from_polar((-lag_um(i).powi(2) / (4.0 * s * s)).exp(), TAU * f * lag_um(i))).collect()
}

/// Weights `t g exp(2πi f·x)` of the pixels along one axis, and the sum of `(t g)²`. `taper` has t at each pixel. `f`
/// is in cycles/µm, and `s` in µm.
fn pixel_weights(taper: &[f64], pixel_um: f64, f: f64, s: f64) -> (Vec<Complex64>, f64) {
    let x_um = |i: usize| (i as f64 - (taper.len() / 2) as f64) * pixel_um;
    let window = |i: usize| taper[i] * (-x_um(i).powi(2) / (2.0 * s * s)).exp();
    let weights = (0..taper.len()).map(|i| Complex64::from_polar(window(i), TAU * f * x_um(i))).collect();
    let power = (0..taper.len()).map(|i| window(i).powi(2)).sum();
    (weights, power)
}

/// `Σ summands[iy][ix] · weights_x[ix] · weights_y[iy]`.
fn separable_sum(summands: &[Complex64], weights_x: &[Complex64], weights_y: &[Complex64]) -> Complex64 {
    let row_sum =
        |row: &[Complex64]| row.iter().zip(weights_x).map(|(summand, weight)| summand * weight).sum::<Complex64>();
    summands.chunks(weights_x.len()).zip(weights_y).map(|(row, weight_y)| weight_y * row_sum(row)).sum()
}

/// Autocorrelation A of the tapered screen `t exp(iκh)`, times the number of grid points: the inverse transform of its
/// power (Wiener–Khinchin), unnormalised. The grid is padded with zeros so that lags do not wrap.
fn autocorrelation(screen: &[Complex64], taper_x: &[f64], taper_y: &[f64]) -> Vec<Complex64> {
    let (lags_x, lags_y) = lag_grid(taper_x.len(), taper_y.len());
    let mut grid = vec![Complex64::new(0.0, 0.0); lags_x * lags_y];
    for ((to_row, from_row), ty) in grid.chunks_mut(lags_x).zip(screen.chunks(taper_x.len())).zip(taper_y) {
        for ((to, from), tx) in to_row.iter_mut().zip(from_row).zip(taper_x) {
            *to = from * (tx * ty);
        }
    }
    let mut scratch = Vec::new();
    Fft2::new(lags_x, lags_y, Direction::Positive).process(&mut grid, &mut scratch);
    grid.iter_mut().for_each(|c| *c = c.norm_sqr().into());
    Fft2::new(lags_x, lags_y, Direction::Negative).process(&mut grid, &mut scratch);
    grid
}
