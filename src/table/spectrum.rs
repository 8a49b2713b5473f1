//! What a table's nodes hold at one κ, from the height field.

use super::band::Band;
use super::lattice::{AxisDemand, Lattice, LatticeAxis};
use super::lookup::KernelKind;
use crate::height_field::HeightField;
use crate::transform::{Direction, Fft2, OrderTransform};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::f64::consts::PI;
use sunbeam_fourier::next_fast_len;
use sunbeam_fourier::num_complex::Complex64;

/// Which coherence model the spectrum follows (docs/model.md#coherence).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Model {
    /// The mean over all window places: orders add by power.
    #[default]
    Ensemble,
    /// One window at a fixed place: orders add by amplitude.
    Patch,
}

impl Model {
    /// How node values combine.
    pub(super) fn kernel(self) -> KernelKind {
        match self {
            Self::Ensemble => KernelKind::Power,
            Self::Patch => KernelKind::Amplitude,
        }
    }
}

/// Whether the tile repeats (docs/model.md#coherence).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Tiling {
    /// The tile repeats for ever.
    Periodic,
    /// The scan stands alone, tapered at its edges.
    Aperiodic,
}

/// Fraction of a scan's width over which each of its edges is tapered by a raised cosine (a Tukey window of 0.5),
/// where it does not repeat.
const TAPER_FRACTION: f64 = 0.25;

/// Factor on the tolerance that the nodes of such a scan's ensemble are joined to. A single scan has deep gaps between its
/// lobes. What the joining leaves of the lobes' power is small beside the lobes, but not beside what is in a gap. A patch needs
/// no such factor: it joins amplitudes, whose ratio of lobe to gap is the root of that of powers.
const GAP_SHARE: f64 = 0.125;

/// Computes the node values of a [`Lattice`] at any κ.
pub struct Spectrum {
    transform: OrderTransform,
    model: Model,
    lattice: Lattice,
    /// Tapers of a scan that stands alone, along x and y.
    tapers: Option<(Vec<f64>, Vec<f64>)>,
    /// Normalisation of the ensemble autocorrelation or the patch's power.
    total: f64,
    norm: f64,
    /// Grid in pixels of the relief on which it is transformed, padded where it stands alone.
    lag_grid: (usize, usize),
    /// What is kept of that transform, along x and y, for the autocorrelation of the ensemble.
    bands: [Band; 2],
    /// Pixels of the autocorrelation or of the patch, and their weights by what is applied before the lattice's transform, along x
    /// and y.
    applied: [Vec<(usize, f64)>; 2],
    lag_forward: Fft2<f64>,
    lag_back: Fft2<f64>,
    node_transform: Fft2<f64>,
}

impl Spectrum {
    /// Plans the lattice for `field` under a coherence window of standard deviation `coherence_s_um`
    /// (`coherence_length/4`), for frequencies up to `frequency_max` cycles/µm, to a relative error `tolerance`.
    pub fn new(
        field: &HeightField,
        model: Model,
        tiling: Tiling,
        coherence_s_um: f64,
        frequency_max: f64,
        tolerance: f64,
    ) -> Self {
        let (nx, ny) = field.size();
        let pixel_um = (field.dx_um(), field.dy_um());
        let lattice = plan_lattice((nx, ny), pixel_um, model, tiling, coherence_s_um, frequency_max, tolerance);
        let tapers = (tiling == Tiling::Aperiodic).then(|| (taper(nx), taper(ny)));
        let lag_grid = if tapers.is_some() { lag_grid(nx, ny) } else { (nx, ny) };
        let joined_to = joined_to(model, tiling, tolerance);
        let band = |axis, lags, pixel_um| Band::new(axis, lags, pixel_um, frequency_max, joined_to);
        let bands = [band(&lattice.x, lag_grid.0, pixel_um.0), band(&lattice.y, lag_grid.1, pixel_um.1)];
        let (kx, ky) = (bands[0].weights.len(), bands[1].weights.len());
        let total = match (&tapers, model) {
            (None, _) => 1.0,
            (Some((tx, ty)), Model::Ensemble) => squares(tx, |_| 1.0) * squares(ty, |_| 1.0),
            (Some((tx, ty)), Model::Patch) => {
                let window =
                    |pixel_um: f64| move |offset: f64| (-(offset * pixel_um / coherence_s_um).powi(2)).exp() * pixel_um;
                squares(tx, window(field.dx_um())) * squares(ty, window(field.dy_um()))
                    / (PI * coherence_s_um * coherence_s_um)
            }
        };
        let [x, y] = [&lattice.x, &lattice.y].map(|axis| axis.period_um / axis.joining.transform(0.0));
        let kernel = x * y;
        let norm = match model {
            Model::Ensemble => kernel,
            Model::Patch => kernel * kernel / (PI * coherence_s_um * coherence_s_um),
        };
        Self {
            transform: OrderTransform::new(field),
            model,
            tapers,
            total,
            norm,
            lag_grid,
            bands,
            applied: [
                axis_weights(&lattice.x, kx, tiling == Tiling::Aperiodic),
                axis_weights(&lattice.y, ky, tiling == Tiling::Aperiodic),
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

    /// How node values combine.
    pub fn kernel(&self) -> KernelKind {
        self.model.kernel()
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
            (Model::Ensemble, false) => self.windowed(&self.autocorrelation(kappa), 1.0 / self.total),
            (Model::Patch, false) => self.patch_bins(kappa),
        };
        self.collect_nodes(&bins)
    }

    /// The autocorrelation `mean of exp(iκ(h(x+τ) − h(x)))` over the band, at as many lags as the band has bins; not normalised by the
    /// taper.
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
            // Then lag zero is one.
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

    /// The windowed patch about the tile's origin or, where it stands alone, the middle of the scan.
    fn patch_bins(&self, kappa: f64) -> Vec<Complex64> {
        let (nx, ny) = self.transform.size();
        let screen = self.tapered_screen(kappa);
        if self.tapers.is_none() {
            return self.windowed(&screen, 1.0);
        }
        // Bring the middle of the scan to the origin of a grid that holds it once.
        let (gx, gy) = self.lag_grid;
        let mut centred = vec![Complex64::new(0.0, 0.0); gx * gy];
        for (iy, row) in screen.chunks(nx).enumerate() {
            let y = (iy + gy - ny / 2) % gy;
            for (ix, &c) in row.iter().enumerate() {
                centred[y * gx + (ix + gx - nx / 2) % gx] = c;
            }
        }
        self.windowed(&centred, self.total.sqrt().recip())
    }

    /// Multiplies `values` (on a grid about the origin, wrapped where the tile repeats, zero beyond where it does not)
    /// by the part of the window applied beforehand and transforms to the lattice.
    fn windowed(&self, values: &[Complex64], scale: f64) -> Vec<Complex64> {
        let (px, py) = (self.lattice.x.pixels, self.lattice.y.pixels);
        let width = self.bands[0].weights.len();
        let [column, row] = &self.applied;
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

    /// Reorders FFT bins into nodes from `−reach` to `reach`. Of orders, the one bin at half the sampling rate of an even
    /// size stands for both signs and is shared between them (by power, or by amplitude).
    fn collect_nodes(&self, bins: &[Complex64]) -> Vec<Complex64> {
        let share = match self.model {
            Model::Ensemble => 0.5,
            Model::Patch => 0.5f64.sqrt(),
        };
        let source = |axis: &LatticeAxis| -> Vec<(usize, f64)> {
            let (n, reach, native) = (axis.pixels as i64, axis.reach as i64, axis.cutoff.is_infinite());
            (-reach..=reach)
                .map(|j| (j.rem_euclid(n) as usize, if native && 2 * j.abs() == n { share } else { 1.0 }))
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

/// For each pixel of an axis (FFT order) the pixel of a grid of `size` it is read from and its weight. `alone` says that the grid
/// holds what it holds once.
fn axis_weights(axis: &LatticeAxis, size: usize, alone: bool) -> Vec<(usize, f64)> {
    let n = axis.pixels as i64;
    let pixel_um = axis.period_um / axis.pixels as f64;
    (0..n)
        .map(|i| {
            let offset = if 2 * i > n { i - n } else { i };
            let inside = !alone || 2 * offset.unsigned_abs() as usize <= size;
            let weight = if inside { axis.window(offset as f64 * pixel_um) } else { 0.0 };
            (offset.rem_euclid(size as i64) as usize, weight)
        })
        .collect()
}

/// The lattice that [`Spectrum::new`] takes, told from sizes alone.
pub(super) fn plan_lattice(
    (nx, ny): (usize, usize),
    (dx_um, dy_um): (f64, f64),
    model: Model,
    tiling: Tiling,
    coherence_s_um: f64,
    frequency_max: f64,
    tolerance: f64,
) -> Lattice {
    // The power spectrum of the ensemble transforms autocorrelation times window autocorrelation, exp(−τ²/4s²).
    let (window_um, support) = match model {
        Model::Ensemble => (2f64.sqrt() * coherence_s_um, 1.0),
        // The field ends at half its width, but is not small before its ends as an autocorrelation is.
        Model::Patch => (coherence_s_um, 0.8),
    };
    let is_grating = nx == 1 || ny == 1;
    let tolerance = joined_to(model, tiling, tolerance);
    let (lags_x, lags_y) = if tiling == Tiling::Aperiodic { lag_grid(nx, ny) } else { (nx, ny) };
    let axis = |pixels: usize, pixel_um: f64, lags: usize| {
        let support_um = (tiling == Tiling::Aperiodic).then_some(support * (pixels as f64 * pixel_um));
        let lags = (model == Model::Ensemble).then_some(lags);
        AxisDemand { pixels, pixel_um, window_um, support_um, tolerance, frequency_max, is_grating, lags }.plan()
    };
    Lattice { x: axis(nx, dx_um, lags_x), y: axis(ny, dy_um, lags_y) }
}

/// The error that nodes are joined to.
fn joined_to(model: Model, tiling: Tiling, tolerance: f64) -> f64 {
    let has_gaps = model == Model::Ensemble && tiling == Tiling::Aperiodic;
    if has_gaps { GAP_SHARE * tolerance } else { tolerance }
}

/// Size of the grid on which the autocorrelation of `nx` by `ny` pixels does not wrap onto itself.
pub(crate) fn lag_grid(nx: usize, ny: usize) -> (usize, usize) {
    (next_fast_len(2 * nx), next_fast_len(2 * ny))
}

/// A Tukey window sampled at the middles of `n` pixels.
pub(crate) fn taper(n: usize) -> Vec<f64> {
    (0..n)
        .map(|i| {
            let from_edge = ((i.min(n - 1 - i)) as f64 + 0.5) / n as f64;
            if from_edge < TAPER_FRACTION { 0.5 - 0.5 * (PI * from_edge / TAPER_FRACTION).cos() } else { 1.0 }
        })
        .collect()
}

/// `Σ t² · weight(offset from the middle pixel)`.
fn squares(taper: &[f64], weight: impl Fn(f64) -> f64) -> f64 {
    let middle = taper.len() / 2;
    taper.iter().enumerate().map(|(i, t)| t * t * weight(i as f64 - middle as f64)).sum()
}
