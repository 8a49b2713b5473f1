//! Reference evaluation of the reflectance: direct double-precision sums, without tables.
//!
//! Symbols: h the height, κ the phase rate (rad/µm), f the spatial frequency (1/µm), S(f; κ) the power density (µm²),
//! s a quarter of the coherence length, c_j the amplitude of order j of a periodic tile, f_j its frequency, p the pixel
//! area, t the taper of a scan (a Tukey window), x the position of a pixel, r a lag of the autocorrelation A.
//!
//! S for each model and tiling:
//!
//! - ensemble, periodic: `4πs² Σ_j |c_j|² exp(−4π²s²|f − f_j|²)`;
//! - patch, periodic: `4πs² |Σ_j c_j exp(−2π²s²|f − f_j|²)|²`;
//! - ensemble, aperiodic: `p Σ_r A(r)/A(0) exp(−|r|²/(4s²)) exp(2πi f·r)`, with the autocorrelation A of `t exp(iκh)`;
//! - patch, aperiodic: `p |Σ_x t g exp(iκh) exp(2πi f·x)|² / Σ_x (t g)²`, with `g = exp(−|x|²/(2s²))`.
//!
//! Each weight is the product of a factor along x and a factor along y.

use crate::energy::AlbedoTable;
use crate::height_field::HeightField;
use crate::scattering::{Options, Pair, Vec3};
use crate::table::{CoherenceWindow, Model, Tiling, lag_grid, taper};
use crate::transform::{Direction, Fft2, OrderTransform};
use std::f64::consts::{PI, TAU};
use std::sync::{Arc, Mutex};
use sunbeam_fourier::num_complex::Complex64;

/// Reflectance by the direct sum of docs/model.md#the-reflectance, without tables and without a truncated window.
///
/// A periodic tile is summed over all its orders with their Gaussians. An aperiodic scan is summed over the lags of its
/// autocorrelation (ensemble) or over its pixels (patch). One evaluation costs a transform of the tile and a pass over
/// it.
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
    transform: OrderTransform,
    options: Options,
    extent_um: (f64, f64),
    pixel_um: (f64, f64),
    /// Taper t along x and y of an aperiodic scan; `None` for a periodic tile.
    tapers: Option<(Vec<f64>, Vec<f64>)>,
    albedo: Option<Arc<AlbedoTable>>,
    /// κ and summands ([`Exact::summands`]) of the last query; consecutive queries often share κ.
    last: Mutex<Option<(f64, Arc<Vec<Complex64>>)>>,
}

impl Exact {
    /// The reference evaluation of `field`. `albedo` divides the reflectance to conserve energy; `None` leaves it
    /// undivided.
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
    /// above the surface and the wavelength (nm) is positive.
    pub fn eval(&self, wi: Vec3, wo: Vec3, wavelength_nm: f64) -> f64 {
        let Some(pair) = Pair::new(wi, wo).filter(|_| wavelength_nm > 0.0) else { return 0.0 };
        let wavelength_um = wavelength_nm * 1e-3;
        let f = [pair.u / wavelength_um, pair.v / wavelength_um];
        let s = self.power_density(f, pair.kappa(wavelength_um));
        let factor = self.albedo.as_ref().map_or(1.0, |albedo| albedo.factor(wi, wo, wavelength_nm));
        self.options.angular_factor(&pair) * factor * s / (wavelength_um * wavelength_um)
    }

    /// `S(f; κ)` in µm², `f` in cycles/µm, `kappa` in rad/µm.
    pub fn power_density(&self, f: [f64; 2], kappa: f64) -> f64 {
        let s = CoherenceWindow::new(self.options.coherence_length_um).sigma_um();
        let (nx, ny) = self.transform.size();
        // The sums over pixels are periodic in f. Above the Nyquist frequency S is defined as 0.
        let beyond = 2.0 * f[0].abs() * self.pixel_um.0 > 1.0 || 2.0 * f[1].abs() * self.pixel_um.1 > 1.0;
        if self.tapers.is_some() && beyond {
            return 0.0;
        }
        let summands = self.summands(kappa);
        let density = match (self.options.model, &self.tapers) {
            (Model::Ensemble, None) => {
                let gaussian = |df: f64| (-4.0 * PI * PI * s * s * df * df).exp();
                let ex = order_weights(nx, self.extent_um.0, f[0], 0.5, gaussian);
                let ey = order_weights(ny, self.extent_um.1, f[1], 0.5, gaussian);
                4.0 * PI * s * s * separable_sum(&summands, &ex, &ey).re
            }
            (Model::Patch, None) => {
                let gaussian = |df: f64| (-2.0 * PI * PI * s * s * df * df).exp();
                // Amplitudes have the square root of the power's weight.
                let ex = order_weights(nx, self.extent_um.0, f[0], 0.5f64.sqrt(), gaussian);
                let ey = order_weights(ny, self.extent_um.1, f[1], 0.5f64.sqrt(), gaussian);
                4.0 * PI * s * s * separable_sum(&summands, &ex, &ey).norm_sqr()
            }
            (Model::Ensemble, Some(_)) => {
                let (gx, gy) = lag_grid(nx, ny);
                let lag_weights = |n: usize, pixel: f64, f: f64| -> Vec<Complex64> {
                    // Lags in FFT order: the upper half of the grid holds the negative ones.
                    let lag = |i: usize| if 2 * i > n { i as f64 - n as f64 } else { i as f64 } * pixel;
                    (0..n)
                        .map(|i| Complex64::from_polar((-lag(i).powi(2) / (4.0 * s * s)).exp(), TAU * f * lag(i)))
                        .collect()
                };
                let (ex, ey) = (lag_weights(gx, self.pixel_um.0, f[0]), lag_weights(gy, self.pixel_um.1, f[1]));
                self.pixel_um.0 * self.pixel_um.1 * separable_sum(&summands, &ex, &ey).re / summands[0].re
            }
            (Model::Patch, Some((tx, ty))) => {
                let pixel_weights = |taper: &[f64], pixel: f64, f: f64| {
                    let x = |i: usize| (i as f64 - (taper.len() / 2) as f64) * pixel;
                    let window = |i: usize| taper[i] * (-x(i).powi(2) / (2.0 * s * s)).exp();
                    let terms: Vec<_> =
                        (0..taper.len()).map(|i| Complex64::from_polar(window(i), TAU * f * x(i))).collect();
                    let power: f64 = (0..taper.len()).map(|i| window(i).powi(2)).sum();
                    (terms, power)
                };
                let (ex, power_x) = pixel_weights(tx, self.pixel_um.0, f[0]);
                let (ey, power_y) = pixel_weights(ty, self.pixel_um.1, f[1]);
                self.pixel_um.0 * self.pixel_um.1 * separable_sum(&summands, &ex, &ey).norm_sqr() / (power_x * power_y)
            }
        };
        density.max(0.0)
    }

    /// Summands at one κ before their weights, row-major: `|c_j|²`, `c_j`, `A(r)` or `exp(iκh)` in the table's order.
    fn summands(&self, kappa: f64) -> Arc<Vec<Complex64>> {
        // The cached pair is consistent even if another query panicked with the lock held.
        let lock = || self.last.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        if let Some((_, summands)) = lock().as_ref().filter(|(last_kappa, _)| *last_kappa == kappa) {
            return summands.clone();
        }
        // Unlocked during the transform: rayon's waiting threads may run other queries.
        let summands = Arc::new(match (self.options.model, &self.tapers) {
            (Model::Ensemble, None) => {
                self.transform.amplitudes(kappa).into_iter().map(|c| c.norm_sqr().into()).collect()
            }
            (Model::Patch, None) => self.transform.amplitudes(kappa),
            (Model::Ensemble, Some((tx, ty))) => autocorrelation(&self.transform.screen(kappa), tx, ty),
            (Model::Patch, Some(_)) => self.transform.screen(kappa),
        });
        *lock() = Some((kappa, summands.clone()));
        summands
    }
}

/// Gaussian weights of all `n` orders along one axis at the frequency `f` (1/µm), in FFT order. `gaussian` takes the
/// distance from f to the order's frequency in 1/µm.
///
/// The Nyquist bin of an even `n` stands for the orders n/2 and −n/2, each with the weight `nyquist`.
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

/// `Σ summands[iy][ix] · ex[ix] · ey[iy]`.
fn separable_sum(summands: &[Complex64], ex: &[Complex64], ey: &[Complex64]) -> Complex64 {
    summands
        .chunks(ex.len())
        .zip(ey)
        .map(|(row, ey)| ey * row.iter().zip(ex).map(|(d, e)| d * e).sum::<Complex64>())
        .sum()
}

/// Autocorrelation A of the tapered screen `t exp(iκh)` (Wiener–Khinchin: the inverse transform of its power), times
/// the number of grid points. The grid is padded with zeros so that lags do not wrap.
fn autocorrelation(screen: &[Complex64], tx: &[f64], ty: &[f64]) -> Vec<Complex64> {
    let (gx, gy) = lag_grid(tx.len(), ty.len());
    let mut grid = vec![Complex64::new(0.0, 0.0); gx * gy];
    for ((row, from), ty) in grid.chunks_mut(gx).zip(screen.chunks(tx.len())).zip(ty) {
        for ((to, from), tx) in row.iter_mut().zip(from).zip(tx) {
            *to = from * (tx * ty);
        }
    }
    let mut scratch = Vec::new();
    Fft2::new(gx, gy, Direction::Positive).process(&mut grid, &mut scratch);
    grid.iter_mut().for_each(|c| *c = c.norm_sqr().into());
    Fft2::new(gx, gy, Direction::Negative).process(&mut grid, &mut scratch);
    grid
}
