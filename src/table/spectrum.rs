//! Node values of a table at one phase rate κ (rad per µm of height), from the height field.
//!
//! An *ensemble* is the mean over all positions of the coherence window, a *patch* has one fixed window
//! (`coherence.rs`). On a *native* lattice nodes are the diffraction orders of a tile that repeats, on a *resampled*
//! lattice other frequencies (`lattice.rs`). An *aperiodic* scan is a tile that does not repeat.
//!
//! - `E = exp(iκh)`: phase screen of the heights h over the tile.
//! - `c_j`: amplitude of order j, the Fourier coefficient of E.
//! - `t`: taper of an aperiodic scan, which falls to 0 at its edges; 1 where the tile repeats.
//! - `s`: standard deviation of the coherence window in µm.
//! - `x`, `τ`: position and lag (shift) in µm.
//! - `S`, `norm`: power density in µm², and its factor on the interpolated nodes ([module](super)).
//!
//! The node values are
//!
//! - on a native lattice the order amplitudes `c_j` of E (patch) or the powers `|c_j|²` (ensemble),
//! - on a resampled lattice of an ensemble the transform of the autocorrelation of `t·E` over lags τ, times
//!   `exp(−τ²/(4s²))`,
//! - on a resampled lattice of a patch the transform of `t·E`, times `exp(−x²/(2s²))` around the tile's origin or the
//!   scan's middle.
//!
//! Before a transform to a resampled lattice, the data are also divided by the transform of the interpolation kernel
//! ([`super::kernel`]). Windows, tapers and kernels are products over x and y, so weights are kept for each axis.
//!
//! Three grids of pixels occur:
//!
//! - *screen grid*: the pixels of the relief, padded with zeros for an aperiodic scan.
//! - *data*: the screen of a patch, or the autocorrelation of an ensemble. The autocorrelation has fewer and larger
//!   pixels over the length of the screen grid, since high frequencies are cut (`band.rs`).
//! - *lattice pixels*: as large as those of the data, over the lattice's period.
//!
//! Arrays in *FFT order* begin with frequency or lag 0; negative frequencies or lags are at the end.

use super::band::Band;
use super::lattice::{Lattice, LatticeAxis, interpolation_tolerance, lag_grid, plan_lattice};
use super::spectral::NodeQuantity;
use super::{CoherenceWindow, Model, Tiling};
use crate::height_field::HeightField;
use crate::transform::{Direction, Fft2, OrderTransform};
use rayon::prelude::*;
use std::f64::consts::{FRAC_1_SQRT_2, PI};
use sunbeam_fourier::num_complex::Complex64;

/// Fraction of an aperiodic scan's width over which each edge is tapered by a raised cosine, as in a Tukey window with
/// the parameter 0.5. A larger fraction loses more of the scan; a smaller one has stronger lobes beside each order.
const TAPER_FRACTION: f64 = 0.25;

impl Model {
    /// Quantity of the nodes.
    pub(super) fn quantity(self) -> NodeQuantity {
        match self {
            Self::Ensemble => NodeQuantity::Power,
            Self::Patch => NodeQuantity::Amplitude,
        }
    }
}

/// Node values of a [`Lattice`] at any κ, for one height field.
///
/// ```
/// use sunbeam::table::{CoherenceWindow, Model, Spectrum, Tiling};
/// use sunbeam::Preset;
///
/// let field = Preset::Blazed.build(None, None)?;
/// let window = CoherenceWindow::new(20.0);
/// let spectrum = Spectrum::new(&field, Model::Ensemble, Tiling::Periodic, window, 1e-3);
/// // At κ = 0 heights make no difference: order 0, the middle node, has all the power.
/// let nodes = spectrum.nodes(0.0);
/// assert!((nodes[nodes.len() / 2].re - 1.0).abs() < 1e-12);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub struct Spectrum {
    /// Source of the phase screen, and of the orders' amplitudes on a native lattice.
    transform: OrderTransform,
    model: Model,
    lattice: Lattice,
    /// Tapers of an aperiodic scan along x and y; `None` where the tile repeats.
    tapers: Option<(Vec<f64>, Vec<f64>)>,
    /// Divisor of node powers, with which the integral of S over frequency is one ([`total_power`]); 1 where the tile
    /// repeats.
    total_power: f64,
    /// `norm` in µm².
    norm: f64,
    /// Numbers of pixels of the screen grid along x and y.
    screen_grid: (usize, usize),
    /// Weights, along x and y, of the bins of the screen's transform that are kept for the autocorrelation of the
    /// ensemble (`band.rs`). A patch keeps all. The number of bins is that of the data's pixels.
    bands: [Band; 2],
    /// For each lattice pixel along x and y, in FFT order: the pixel of the data that it takes, and its weight. See
    /// [`axis_weights`].
    weights: [Vec<(usize, f64)>; 2],
    /// From the padded screen to its power spectrum.
    lag_forward: Fft2<f64>,
    /// From the band-limited power spectrum to the autocorrelation.
    lag_back: Fft2<f64>,
    /// From windowed data to nodes.
    node_transform: Fft2<f64>,
}

impl Spectrum {
    /// Plans the lattice of `field` under a coherence window, for a table of the relative error `tolerance`.
    pub fn new(field: &HeightField, model: Model, tiling: Tiling, window: CoherenceWindow, tolerance: f64) -> Self {
        let (nx, ny) = field.size();
        let pixel_um = (field.dx_um(), field.dy_um());
        let lattice = plan_lattice((nx, ny), pixel_um, model, tiling, window, tolerance);
        let tapers = (tiling == Tiling::Aperiodic).then(|| (taper(nx), taper(ny)));
        let screen_grid = if tapers.is_some() { lag_grid(nx, ny) } else { (nx, ny) };
        let band_tolerance = interpolation_tolerance(model, tiling, tolerance);
        let band = |axis, lags, pixel_um| Band::new(axis, lags, pixel_um, band_tolerance);
        let bands = [band(&lattice.x, screen_grid.0, pixel_um.0), band(&lattice.y, screen_grid.1, pixel_um.1)];
        // Numbers of pixels of the data.
        let (data_x, data_y) = (bands[0].weights.len(), bands[1].weights.len());
        let s_um = window.sigma_um();
        Self {
            transform: OrderTransform::new(field),
            model,
            total_power: tapers.as_ref().map_or(1.0, |tapers| total_power(tapers, model, pixel_um, s_um)),
            tapers,
            norm: norm(&lattice, model, s_um),
            screen_grid,
            bands,
            weights: [
                axis_weights(&lattice.x, data_x, tiling == Tiling::Aperiodic),
                axis_weights(&lattice.y, data_y, tiling == Tiling::Aperiodic),
            ],
            lag_forward: Fft2::new(screen_grid.0, screen_grid.1, Direction::Positive),
            lag_back: Fft2::new(data_x, data_y, Direction::Negative),
            node_transform: Fft2::new(lattice.x.pixels, lattice.y.pixels, Direction::Positive),
            lattice,
        }
    }

    /// Lattice whose nodes [`Spectrum::nodes`] computes.
    pub fn lattice(&self) -> &Lattice {
        &self.lattice
    }

    /// Quantity of the nodes.
    pub fn quantity(&self) -> NodeQuantity {
        self.model.quantity()
    }

    /// Factor in µm² that makes the nodes' powers a density `S` over frequency.
    pub fn norm(&self) -> f64 {
        self.norm
    }

    /// Half the range of heights in µm.
    pub fn half_range_um(&self) -> f64 {
        self.transform.half_range_um()
    }

    /// Node values at `kappa` in rad/µm, row-major from node `(−reach, −reach)`: real powers of the ensemble, complex
    /// amplitudes of a patch.
    pub fn nodes(&self, kappa: f64) -> Vec<Complex64> {
        let bins = match (self.model, self.lattice.is_native()) {
            (Model::Ensemble, true) => {
                let mut bins = self.transform.amplitudes(kappa);
                bins.par_iter_mut().for_each(|c| *c = c.norm_sqr().into());
                bins
            }
            (Model::Patch, true) => self.transform.amplitudes(kappa),
            (Model::Ensemble, false) => self.windowed(&self.autocorrelation(kappa), 1.0 / self.total_power),
            (Model::Patch, false) => self.patch_bins(kappa),
        };
        self.collect_nodes(&bins)
    }

    /// Autocorrelation of the tapered screen, limited to the bands of frequencies, `[lag y][lag x]` in FFT order. The
    /// number of lags along an axis is that of the band's bins. Without the limit, the value at lag zero is 1 where the
    /// tile repeats, else the sum of t² over the scan's pixels.
    fn autocorrelation(&self, kappa: f64) -> Vec<Complex64> {
        let (gx, gy) = self.screen_grid;
        let mut screen = self.tapered_screen(kappa);
        // Neither transform has a factor before its sum, so both together multiply by gx·gy, however many bins the
        // second one sums. The scale divides this out.
        let scale = if self.tapers.is_some() {
            // Rows are padded with zeros to gx pixels; `Fft2::band` treats the missing rows as zero.
            let (nx, ny) = self.transform.size();
            let mut padded = vec![Complex64::ZERO; gx * ny];
            for (to, from) in padded.chunks_mut(gx).zip(screen.chunks(nx)) {
                to[..nx].copy_from_slice(from);
            }
            screen = padded;
            // The autocorrelation is a sum over the pixels of the scan.
            1.0 / (gx * gy) as f64
        } else {
            // The autocorrelation is a mean over the pixels of the tile.
            ((gx * gy) as f64).powi(-2)
        };
        let [x, y] = &self.bands;
        // Bins of the kept frequencies alone, `[row][column]` in FFT order.
        let mut bins = self.lag_forward.band(&mut screen, (x.weights.len(), y.weights.len()));
        bins.par_chunks_mut(x.weights.len()).zip(&y.weights).for_each(|(row, wy)| {
            for (c, wx) in row.iter_mut().zip(&x.weights) {
                *c = (c.norm_sqr() * scale * wx * wy).into();
            }
        });
        self.lag_back.process(&mut bins, &mut Vec::new());
        bins
    }

    /// Phase screen times the taper, row-major over the pixels of the relief.
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

    /// Transform of the windowed patch around the tile's origin, or around the middle of an aperiodic scan.
    fn patch_bins(&self, kappa: f64) -> Vec<Complex64> {
        let (nx, ny) = self.transform.size();
        let screen = self.tapered_screen(kappa);
        if self.tapers.is_none() {
            return self.windowed(&screen, 1.0);
        }
        // The scan on a zero-padded grid, with its middle at the grid's origin.
        let (gx, gy) = self.screen_grid;
        let mut centred = vec![Complex64::ZERO; gx * gy];
        for (iy, row) in screen.chunks(nx).enumerate() {
            let y = (iy + gy - ny / 2) % gy;
            for (ix, &c) in row.iter().enumerate() {
                centred[y * gx + (ix + gx - nx / 2) % gx] = c;
            }
        }
        // The root of a divisor of powers, since a patch's nodes are amplitudes.
        self.windowed(&centred, self.total_power.sqrt().recip())
    }

    /// Multiplies `data` by `scale` and the weights of both axes, and transforms them to the lattice's bins, in FFT
    /// order. Bins are means over the lattice's pixels. `data` are row-major in FFT order around the origin, with as
    /// many pixels along an axis as its band has bins.
    fn windowed(&self, data: &[Complex64], scale: f64) -> Vec<Complex64> {
        let (px, py) = (self.lattice.x.pixels, self.lattice.y.pixels);
        let data_width = self.bands[0].weights.len();
        let [weights_x, weights_y] = &self.weights;
        let mean_scale = scale / (px * py) as f64;
        let mut grid = vec![Complex64::ZERO; px * py];
        grid.par_chunks_mut(px).zip(weights_y).for_each(|(out, &(iy, wy))| {
            let row = &data[iy * data_width..][..data_width];
            for (out, &(ix, wx)) in out.iter_mut().zip(weights_x) {
                *out = row[ix] * (wx * wy * mean_scale);
            }
        });
        self.node_transform.process(&mut grid, &mut Vec::new());
        grid
    }

    /// Reorders FFT bins into nodes from `−reach` to `reach` ([`LatticeAxis::reach`]) along both axes. On a native axis
    /// with an even number of pixels, the bin at half the sampling rate belongs to the nodes of both signs, which share
    /// its power equally.
    fn collect_nodes(&self, bins: &[Complex64]) -> Vec<Complex64> {
        // Factor along an axis: half the power, or the amplitude of half the power.
        let half_bin = match self.model {
            Model::Ensemble => 0.5,
            Model::Patch => FRAC_1_SQRT_2,
        };
        // Bin and factor of each node along an axis.
        let sources = |axis: &LatticeAxis| -> Vec<(usize, f64)> {
            let (n, reach) = (axis.pixels as i64, axis.reach as i64);
            (-reach..=reach)
                .map(|j| (j.rem_euclid(n) as usize, if axis.is_native() && 2 * j.abs() == n { half_bin } else { 1.0 }))
                .collect()
        };
        let columns = sources(&self.lattice.x);
        sources(&self.lattice.y)
            .into_par_iter()
            .flat_map_iter(|(row, wy)| {
                let row = &bins[row * self.lattice.x.pixels..];
                columns.iter().map(move |&(column, wx)| row[column] * (wx * wy))
            })
            .collect()
    }
}

/// Divisor of the node powers of an aperiodic scan, with which the integral of S over frequency is one. For an
/// ensemble it is `Σ t²` over pixels. For a patch it is the power of the tapered window, divided by the power of the
/// window. Tapers and pixel sizes are along x and y; `s_um` is the standard deviation of the window.
fn total_power((tx, ty): &(Vec<f64>, Vec<f64>), model: Model, (dx_um, dy_um): (f64, f64), s_um: f64) -> f64 {
    match model {
        Model::Ensemble => taper_power(tx, |_| 1.0) * taper_power(ty, |_| 1.0),
        Model::Patch => {
            // Power of the tapered window along one axis, in µm.
            let tapered_power = |taper: &[f64], pixel_um: f64| {
                taper_power(taper, |offset| (-(offset * pixel_um / s_um).powi(2)).exp() * pixel_um)
            };
            tapered_power(tx, dx_um) * tapered_power(ty, dy_um) / (PI * s_um * s_um)
        }
    }
}

/// `norm` in µm², for a window of the standard deviation `s_um`. A patch's S is a squared sum, divided by the power of
/// the window, `∫ exp(−|x|²/s²) d²x = πs²`.
fn norm(lattice: &Lattice, model: Model, s_um: f64) -> f64 {
    // Reciprocal of the kernel's integral over frequency, in µm².
    let [x, y] = [&lattice.x, &lattice.y].map(|axis| axis.period_um / axis.kernel.transform(0.0));
    let per_kernel = x * y;
    match model {
        Model::Ensemble => per_kernel,
        Model::Patch => per_kernel * per_kernel / (PI * s_um * s_um),
    }
}

/// For each lattice pixel along an axis, in FFT order: the pixel of the data that it takes, and its weight
/// ([`LatticeAxis::window`]). The data have `size` pixels, which repeat. For `aperiodic` data, weights are zero farther
/// than half of these pixels from the origin.
fn axis_weights(axis: &LatticeAxis, size: usize, aperiodic: bool) -> Vec<(usize, f64)> {
    let n = axis.pixels as i64;
    let pixel_um = axis.period_um / axis.pixels as f64;
    (0..n)
        .map(|i| {
            let offset = if 2 * i > n { i - n } else { i };
            // Within half the data's period of the origin.
            let inside = !aperiodic || 2 * offset.unsigned_abs() as usize <= size;
            let weight = if inside { axis.window(offset as f64 * pixel_um) } else { 0.0 };
            (offset.rem_euclid(size as i64) as usize, weight)
        })
        .collect()
}

/// Taper t at the middles of `n` pixels: a Tukey window, with raised cosines of [`TAPER_FRACTION`] at the edges.
pub(crate) fn taper(n: usize) -> Vec<f64> {
    (0..n)
        .map(|i| {
            let from_edge = ((i.min(n - 1 - i)) as f64 + 0.5) / n as f64;
            if from_edge < TAPER_FRACTION { 0.5 - 0.5 * (PI * from_edge / TAPER_FRACTION).cos() } else { 1.0 }
        })
        .collect()
}

/// `Σ t² · weight(offset)` over the pixels of a taper, where the offset is that from the middle pixel, in pixels.
fn taper_power(taper: &[f64], weight: impl Fn(f64) -> f64) -> f64 {
    let middle = taper.len() / 2;
    taper.iter().enumerate().map(|(i, t)| t * t * weight(i as f64 - middle as f64)).sum()
}
