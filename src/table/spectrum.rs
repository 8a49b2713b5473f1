//! Node values of a table at one κ, computed from the height field.
//!
//! - `h(x)`: height in µm. `u(x) = exp(iκ·h(x))`: phase screen, `κ` in rad/µm.
//! - `s`: standard deviation of the coherence window in µm (`coherence.rs`).
//! - Patch: `D(f)` is the transform of `u(x)·exp(−|x|²/(2s²))`.
//! - Ensemble: `P(f)` is the transform of the autocorrelation `R(τ) = ⟨u(x+τ)·ū(x)⟩` times `exp(−|τ|²/(4s²))`, the
//!   autocorrelation of the window. So its window has the standard deviation `√2·s`.
//! - Taper: a scan that does not repeat is multiplied by a Tukey window, which ends it smoothly.
//! - Grid of lags: the pixel grid on which R is computed, padded where the scan does not repeat. Band: the part of its
//!   spectrum that is kept (`band.rs`).

use super::CoherenceWindow;
use super::band::Band;
use super::lattice::{AxisDemand, Lattice, LatticeAxis};
use super::lookup::NodeQuantity;
use crate::height_field::HeightField;
use crate::transform::{Direction, Fft2, OrderTransform};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::f64::consts::PI;
use sunbeam_fourier::next_fast_len;
use sunbeam_fourier::num_complex::Complex64;

/// Coherence model of a spectrum (docs/model.md#coherence).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Model {
    /// Mean over all positions of the window: orders add by power.
    #[default]
    Ensemble,
    /// One window at a fixed position: orders add by amplitude.
    Patch,
}

impl Model {
    /// Quantity that the nodes of this model store.
    pub(super) fn quantity(self) -> NodeQuantity {
        match self {
            Self::Ensemble => NodeQuantity::Power,
            Self::Patch => NodeQuantity::Amplitude,
        }
    }
}

/// Whether the tile repeats (docs/model.md#coherence).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Tiling {
    /// The tile repeats without end.
    Periodic,
    /// The scan does not repeat; its edges are tapered.
    Aperiodic,
}

/// Fraction of a scan's width over which each of its edges is tapered by a raised cosine: a Tukey window of 0.5.
/// Chosen; it is part of the model (docs/model.md#coherence), so another value is another reflectance.
const TAPER_FRACTION: f64 = 0.25;

/// Factor on the tolerance of the interpolation in frequency, for the ensemble of a scan that does not repeat. Chosen:
/// such a spectrum has deep gaps between its lobes, in which the images of the lobes would show. A patch needs no
/// factor: it interpolates amplitudes, whose ratio of lobe to gap is the square root of the powers' ratio.
const GAP_FACTOR: f64 = 0.125;

/// Support of a patch in widths of the scan, as [`plan_lattice`] takes it in place of the half width. Chosen: the field
/// of a scan is not small before its end, so the kernel's images need more room than those of an autocorrelation.
const PATCH_SUPPORT: f64 = 0.8;

/// Node values of a [`Lattice`] at any κ.
///
/// ```
/// use sunbeam::Preset;
/// use sunbeam::table::{CoherenceWindow, Model, Spectrum, Tiling};
///
/// let (field, window) = (Preset::Blazed.build(None, None)?, CoherenceWindow::new(20.0));
/// let spectrum = Spectrum::new(&field, Model::Ensemble, Tiling::Periodic, window, 5.0, 1e-3);
/// // At κ = 0 the relief is invisible: all power is in order zero, the middle node.
/// let powers = spectrum.nodes(0.0);
/// assert!((powers[powers.len() / 2].re - 1.0).abs() < 1e-12);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub struct Spectrum {
    transform: OrderTransform,
    model: Model,
    lattice: Lattice,
    /// Tapers along x and y of a scan that does not repeat.
    tapers: Option<(Vec<f64>, Vec<f64>)>,
    /// Divisor of the ensemble's autocorrelation or of the patch's power: the sum of squared tapers; 1 without a taper.
    taper_power: f64,
    /// Factor `norm` of the table's formula, in µm².
    norm: f64,
    /// Size of the grid of lags along x and y, in pixels of the relief.
    lag_grid: (usize, usize),
    /// Band kept of the ensemble's power spectrum, along x and y.
    bands: [Band; 2],
    /// For each pixel of a lattice's period along x and y: the pixel of the autocorrelation or of the patch that it
    /// takes, and its window.
    windows: [Vec<(usize, f64)>; 2],
    lag_forward: Fft2<f64>,
    lag_back: Fft2<f64>,
    node_transform: Fft2<f64>,
}

impl Spectrum {
    /// Plans the lattice for `field` under the coherence `window`, for frequencies up to `frequency_max` cycles/µm
    /// along one axis, to a relative error `tolerance`.
    pub fn new(
        field: &HeightField,
        model: Model,
        tiling: Tiling,
        window: CoherenceWindow,
        frequency_max: f64,
        tolerance: f64,
    ) -> Self {
        let sigma_um = window.sigma_um();
        let (nx, ny) = field.size();
        let pixel_um = (field.dx_um(), field.dy_um());
        let lattice = plan_lattice((nx, ny), pixel_um, model, tiling, sigma_um, frequency_max, tolerance);
        let tapers = (tiling == Tiling::Aperiodic).then(|| (taper(nx), taper(ny)));
        let lag_grid = if tapers.is_some() { lag_grid(nx, ny) } else { (nx, ny) };
        let tolerance = interpolation_tolerance(model, tiling, tolerance);
        let band = |axis, lags, pixel_um| Band::new(axis, lags, pixel_um, frequency_max, tolerance);
        let bands = [band(&lattice.x, lag_grid.0, pixel_um.0), band(&lattice.y, lag_grid.1, pixel_um.1)];
        let (kx, ky) = (bands[0].weights.len(), bands[1].weights.len());
        let taper_power = match (&tapers, model) {
            (None, _) => 1.0,
            (Some((tx, ty)), Model::Ensemble) => squared_sum(tx, |_| 1.0) * squared_sum(ty, |_| 1.0),
            (Some((tx, ty)), Model::Patch) => {
                let window =
                    |pixel_um: f64| move |offset: f64| (-(offset * pixel_um / sigma_um).powi(2)).exp() * pixel_um;
                squared_sum(tx, window(field.dx_um())) * squared_sum(ty, window(field.dy_um()))
                    / (PI * sigma_um * sigma_um)
            }
        };
        let [x, y] = [&lattice.x, &lattice.y].map(|axis| axis.period_um / axis.kernel.transform(0.0));
        let scale = x * y;
        let norm = match model {
            Model::Ensemble => scale,
            Model::Patch => scale * scale / (PI * sigma_um * sigma_um),
        };
        Self {
            transform: OrderTransform::new(field),
            model,
            tapers,
            taper_power,
            norm,
            lag_grid,
            bands,
            windows: [
                axis_windows(&lattice.x, kx, tiling == Tiling::Periodic),
                axis_windows(&lattice.y, ky, tiling == Tiling::Periodic),
            ],
            lag_forward: Fft2::new(lag_grid.0, lag_grid.1, Direction::Positive),
            lag_back: Fft2::new(kx, ky, Direction::Negative),
            node_transform: Fft2::new(lattice.x.pixels, lattice.y.pixels, Direction::Positive),
            lattice,
        }
    }

    /// The lattice whose nodes [`Spectrum::nodes`] fills.
    pub fn lattice(&self) -> &Lattice {
        &self.lattice
    }

    /// Quantity of the nodes: powers or amplitudes.
    pub fn quantity(&self) -> NodeQuantity {
        self.model.quantity()
    }

    /// The factor `norm` of the table's formula, in µm².
    pub fn norm(&self) -> f64 {
        self.norm
    }

    /// Half the range of heights in µm.
    pub fn half_range_um(&self) -> f64 {
        self.transform.half_range_um()
    }

    /// Node values at `kappa` (rad/µm), row-major from node `(−reach, −reach)`: real powers for the ensemble,
    /// complex amplitudes for a patch.
    pub fn nodes(&self, kappa: f64) -> Vec<Complex64> {
        let (x, y) = (&self.lattice.x, &self.lattice.y);
        let native = x.cutoff.is_infinite() && y.cutoff.is_infinite();
        let bins = match (self.model, native) {
            (Model::Ensemble, true) => {
                let mut bins = self.transform.amplitudes(kappa);
                bins.par_iter_mut().with_min_len(4096).for_each(|c| *c = c.norm_sqr().into());
                bins
            }
            (Model::Patch, true) => self.transform.amplitudes(kappa),
            (Model::Ensemble, false) => self.windowed(&self.autocorrelation(kappa), 1.0 / self.taper_power),
            (Model::Patch, false) => self.patch_bins(kappa),
        };
        self.collect_nodes(&bins)
    }

    /// The autocorrelation `R(τ)`, limited to the band, row-major at one lag for each bin of the band (FFT order). Not
    /// yet divided by the power of the taper.
    fn autocorrelation(&self, kappa: f64) -> Vec<Complex64> {
        let (gx, gy) = self.lag_grid;
        let mut screen = self.tapered_screen(kappa);
        let scale = if self.tapers.is_some() {
            let (nx, ny) = self.transform.size();
            let mut padded = vec![Complex64::new(0.0, 0.0); gx * ny];
            for (to, from) in padded.chunks_mut(gx).zip(screen.chunks(nx)) {
                to[..nx].copy_from_slice(from);
            }
            screen = padded;
            1.0 / (gx * gy) as f64
        } else {
            // With this scale R(0) = 1.
            ((gx * gy) as f64).powi(-2)
        };
        let [x, y] = &self.bands;
        let mut bins = self.lag_forward.band(&mut screen, (x.weights.len(), y.weights.len()));
        bins.par_chunks_mut(x.weights.len()).zip(&y.weights).for_each(|(row, wy)| {
            for (c, wx) in row.iter_mut().zip(&x.weights) {
                *c = (c.norm_sqr() * scale * wx * wy).into();
            }
        });
        self.lag_back.process(&mut bins, &mut Vec::new());
        bins
    }

    /// Phase screen `u` over the pixels of the relief, times the taper.
    fn tapered_screen(&self, kappa: f64) -> Vec<Complex64> {
        let mut screen = self.transform.screen(kappa);
        if let Some((tx, ty)) = &self.tapers {
            for (row, ty) in screen.chunks_mut(tx.len()).zip(ty) {
                for (c, tx) in row.iter_mut().zip(tx) {
                    *c *= tx * ty;
                }
            }
        }
        screen
    }

    /// Transform of the windowed patch about the tile's origin, or about the middle of a scan that does not repeat.
    fn patch_bins(&self, kappa: f64) -> Vec<Complex64> {
        let (nx, ny) = self.transform.size();
        let screen = self.tapered_screen(kappa);
        if self.tapers.is_none() {
            return self.windowed(&screen, 1.0);
        }
        // The middle of the scan moves to the origin of the padded grid.
        let (gx, gy) = self.lag_grid;
        let mut centred = vec![Complex64::new(0.0, 0.0); gx * gy];
        for (iy, row) in screen.chunks(nx).enumerate() {
            let y = (iy + gy - ny / 2) % gy;
            for (ix, &c) in row.iter().enumerate() {
                centred[y * gx + (ix + gx - nx / 2) % gx] = c;
            }
        }
        self.windowed(&centred, self.taper_power.sqrt().recip())
    }

    /// Multiplies `values` by [`LatticeAxis::window`] and by `scale`, and transforms them to the lattice. The grid of
    /// `values` has its origin at index 0; it is periodic where the tile repeats, and zero beyond its lags where not.
    fn windowed(&self, values: &[Complex64], scale: f64) -> Vec<Complex64> {
        let (px, py) = (self.lattice.x.pixels, self.lattice.y.pixels);
        let width = self.bands[0].weights.len();
        let [column, row] = &self.windows;
        let scale = scale / (px * py) as f64;
        let mut grid = vec![Complex64::new(0.0, 0.0); px * py];
        grid.par_chunks_mut(px).zip(row).for_each(|(out, &(from_row, wy))| {
            let from = &values[from_row * width..][..width];
            for (out, &(ix, wx)) in out.iter_mut().zip(column) {
                *out = from[ix] * (wx * wy * scale);
            }
        });
        self.node_transform.process(&mut grid, &mut Vec::new());
        grid
    }

    /// Reorders FFT bins into nodes from `−reach` to `reach`. On a native lattice of even size the bin at the Nyquist
    /// frequency stands for the orders of both signs. Each gets half its power.
    fn collect_nodes(&self, bins: &[Complex64]) -> Vec<Complex64> {
        let nyquist_weight = match self.model {
            Model::Ensemble => 0.5,
            Model::Patch => 0.5f64.sqrt(),
        };
        let source = |axis: &LatticeAxis| -> Vec<(usize, f64)> {
            let (n, reach, native) = (axis.pixels as i64, axis.reach as i64, axis.cutoff.is_infinite());
            (-reach..=reach)
                .map(|j| (j.rem_euclid(n) as usize, if native && 2 * j.abs() == n { nyquist_weight } else { 1.0 }))
                .collect()
        };
        let columns = source(&self.lattice.x);
        source(&self.lattice.y)
            .into_par_iter()
            .with_min_len(16)
            .flat_map_iter(|(row, wy)| {
                let row = &bins[row * self.lattice.x.pixels..];
                columns.iter().map(move |&(column, wx)| row[column] * (wx * wy))
            })
            .collect()
    }
}

/// For each pixel of an axis (FFT order), the pixel of a grid of `size` that it is read from, and its window. The
/// window is zero beyond the lags of a grid that is not periodic.
fn axis_windows(axis: &LatticeAxis, size: usize, is_periodic: bool) -> Vec<(usize, f64)> {
    let n = axis.pixels as i64;
    let pixel_um = axis.period_um / axis.pixels as f64;
    (0..n)
        .map(|i| {
            let offset = if 2 * i > n { i - n } else { i };
            let inside = is_periodic || 2 * offset.unsigned_abs() as usize <= size;
            let weight = if inside { axis.window(offset as f64 * pixel_um) } else { 0.0 };
            (offset.rem_euclid(size as i64) as usize, weight)
        })
        .collect()
}

/// Lattice of [`Spectrum::new`], planned from the numbers of pixels and their sizes in µm.
pub(super) fn plan_lattice(
    (nx, ny): (usize, usize),
    (dx_um, dy_um): (f64, f64),
    model: Model,
    tiling: Tiling,
    sigma_um: f64,
    frequency_max: f64,
    tolerance: f64,
) -> Lattice {
    // The power spectrum of the ensemble transforms autocorrelation times window autocorrelation, exp(−τ²/4s²).
    let (window_um, support) = match model {
        Model::Ensemble => (2f64.sqrt() * sigma_um, 1.0),
        // The field ends at half the scan's width, but unlike an autocorrelation it is not small before its end.
        Model::Patch => (sigma_um, PATCH_SUPPORT),
    };
    let is_grating = nx == 1 || ny == 1;
    let tolerance = interpolation_tolerance(model, tiling, tolerance);
    let (lags_x, lags_y) = if tiling == Tiling::Aperiodic { lag_grid(nx, ny) } else { (nx, ny) };
    let axis = |pixels: usize, pixel_um: f64, lags: usize| {
        let support_um = (tiling == Tiling::Aperiodic).then_some(support * (pixels as f64 * pixel_um));
        let lags = (model == Model::Ensemble).then_some(lags);
        AxisDemand { pixels, pixel_um, window_um, support_um, tolerance, frequency_max, is_grating, lags }.plan()
    };
    Lattice { x: axis(nx, dx_um, lags_x), y: axis(ny, dy_um, lags_y) }
}

/// Relative error of the interpolation in frequency.
fn interpolation_tolerance(model: Model, tiling: Tiling, tolerance: f64) -> f64 {
    let has_gaps = model == Model::Ensemble && tiling == Tiling::Aperiodic;
    if has_gaps { GAP_FACTOR * tolerance } else { tolerance }
}

/// Size of the grid on which the autocorrelation of `nx` by `ny` pixels does not wrap onto itself.
pub(crate) fn lag_grid(nx: usize, ny: usize) -> (usize, usize) {
    (next_fast_len(2 * nx), next_fast_len(2 * ny))
}

/// Tukey window of [`TAPER_FRACTION`] sampled at the centres of `n` pixels.
pub(crate) fn taper(n: usize) -> Vec<f64> {
    (0..n)
        .map(|i| {
            let from_edge = ((i.min(n - 1 - i)) as f64 + 0.5) / n as f64;
            if from_edge < TAPER_FRACTION { 0.5 - 0.5 * (PI * from_edge / TAPER_FRACTION).cos() } else { 1.0 }
        })
        .collect()
}

/// `Σ t² · weight(offset)` over a taper's values t, `offset` in pixels from the middle one.
fn squared_sum(taper: &[f64], weight: impl Fn(f64) -> f64) -> f64 {
    let middle = taper.len() / 2;
    taper.iter().enumerate().map(|(i, t)| t * t * weight(i as f64 - middle as f64)).sum()
}
