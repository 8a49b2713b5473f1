//! Build of a [`SpectralTable`]: node values at every knot in κ, then one spline per node. Builds with finer knots
//! follow until the tolerance is met.
//!
//! Nodes are powers P(κ) or amplitudes D(κ), Q is the curve that their splines interpolate, and κ₀ (`kappa_knee`) the
//! reciprocal of half the range of heights ([`SpectralTable`]). S is the power spectrum that nodes add up to.

use super::knots::{
    EXTRA_KNOTS, KAPPA_MAX, first_spacing, kappa_reached, knot_step, nearest_frequency, record_floats, spline_tolerance,
};
use super::lattice::Lattice;
use super::packed::PackedTable;
use super::progress::Progress;
use super::spectral::{HEADER, NodeQuantity, SpectralTable};
use super::spectrum::Spectrum;
use super::spline::prefilter;
use super::{TableError, WAVELENGTH_MIN_NM};
use crate::clock::Instant;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::f64::consts::{PI, TAU};
use sunbeam_fourier::num_complex::Complex64;

/// Number of floats that a table's 32-bit offsets can address.
const FLOATS_MAX: usize = u32::MAX as usize;
/// Smallest knot spacing that is tried, as a fraction of the first. Rounding keeps the error above about 1e-6, so finer
/// knots would not help.
const REFINEMENT_MIN: f64 = 0.2;
/// Lower bound of a build's spacing, relative to that of the build before. It applies where the error is more than
/// 0.4⁻⁴ = 39 times that aimed at. The fourth-power law of the error does not hold there, and would take more knots
/// than needed (preset `blazed`: 25 instead of 20).
const REFINEMENT_STEP: f64 = 0.4;
/// Fraction of the allowed error that the next spacing aims at. A smaller one costs knots, a larger one further builds.
const REFINEMENT_AIM: f64 = 0.7;

/// Power density in µm² below which errors are absolute: a hundredth of that of a Lambertian surface, `λ²/π`, at the
/// shortest wavelength.
pub const DENSITY_FLOOR_UM2: f64 = 0.01 * (WAVELENGTH_MIN_NM * 1e-3) * (WAVELENGTH_MIN_NM * 1e-3) / PI;

/// Number of κ midway between knots at which [`TableReport::relative_error`] is measured.
pub(super) const ERROR_KAPPAS: usize = 3;
/// Upper bound of the number of frequencies at each of these κ. More take longer. With this number, 40 errors at each κ
/// lie above the 99th percentile; fewer would make it uncertain.
const ERROR_SAMPLES: usize = 4000;

/// Phase κ/κ₀ in rad at which the slopes P'(0) and the limit of Q at κ = 0 are measured: the fourth root of ε = 2⁻⁵²,
/// the rounding of double precision. The neglected terms, of the order of the phase squared, then equal the rounding
/// error of Q, ε over this square: 1.5e-8.
const SMALL_PHASE: f64 = 1.0 / 8192.0;

/// Build time, size and measured error of a table.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct TableReport {
    /// Size of the packed table in bytes.
    pub bytes: usize,
    /// Number of nodes with a record.
    pub nodes: usize,
    /// Number of knots in κ.
    pub kappa_knots: usize,
    /// Numbers of nodes that a look-up reads along x and y.
    pub taps: (usize, usize),
    /// Error of S from splines and packing: the 99th percentile over frequencies and three κ midway between knots. It
    /// is relative to the largest of S, its mean over κ, and [`DENSITY_FLOOR_UM2`].
    pub relative_error: f64,
    /// Build time in seconds.
    pub build_seconds: f64,
}

/// Table in both of its forms, from [`build`].
///
/// ```
/// use sunbeam::table::{self, CoherenceWindow, Model, Progress, Spectrum, Tiling};
/// use sunbeam::Preset;
///
/// let field = Preset::Blazed.build(None, None)?;
/// let window = CoherenceWindow::new(20.0);
/// let spectrum = Spectrum::new(&field, Model::Ensemble, Tiling::Periodic, window, 1e-3);
/// let table::Built { packed, report, .. } = table::build(&spectrum, 1e-3, &Progress::none())?;
/// assert!(report.relative_error < 1e-3);
///
/// // Where κ = 0 all light is in order 0.
/// assert!((packed.density([0.0; 2], 0.0) / window.order_peak_um2() - 1.0).abs() < 1e-5);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub struct Built {
    /// Splines in single precision, from which samplers, albedos and colours are computed.
    pub table: SpectralTable,
    /// Packed words, which evaluators read.
    pub packed: PackedTable,
    /// Sizes, and the measured error.
    pub report: TableReport,
}

/// Builds the table of `spectrum` to a relative error of `tolerance`, if knots down to a fifth of the first spacing
/// reach it. Where nodes may have deep gaps over κ, the measured error is brought to a tenth of the tolerance
/// (`spline_tolerance` in `knots.rs`). [`TableReport::relative_error`] has the measured error.
///
/// [`BuildDemand::check`] refuses builds that are too expensive, before the spectrum is made.
///
/// # Errors
/// [`TableError::TooLarge`] where 32-bit offsets cannot address the table.
///
/// [`BuildDemand::check`]: super::BuildDemand::check
pub fn build(spectrum: &Spectrum, tolerance: f64, progress: &Progress) -> Result<Built, TableError> {
    let start = Instant::now();
    let target = spline_tolerance(spectrum.lattice(), tolerance);
    // Spacings of knots are in units of 1/bandwidth (`knots.rs`).
    let first_spacing = first_spacing(spectrum.lattice(), tolerance);
    let mut spacing = first_spacing;
    let mut progress = progress.clone();
    loop {
        // Another build with finer knots may follow: half of the remaining progress is left for it.
        let (progress_now, progress_rest) = progress.halves();
        let build = Build::new(spectrum, spacing, progress_now)?;
        let table = build.table();
        let packed = PackedTable::new(&table, tolerance);
        let relative_error = build.measured_error(&table, &packed);
        if relative_error <= target || spacing <= REFINEMENT_MIN * first_spacing {
            let report = TableReport {
                bytes: packed.bytes(),
                nodes: build.kept.len(),
                kappa_knots: build.knots,
                taps: (table.lattice.x.taps, table.lattice.y.taps),
                relative_error,
                build_seconds: start.elapsed().as_secs_f64(),
            };
            progress_rest.report(1.0);
            return Ok(Built { table, packed, report });
        }
        // The error of a cubic B-spline goes as the fourth power of the spacing, once the spacing resolves the waves.
        let factor = (REFINEMENT_AIM * target / relative_error).powf(0.25).max(REFINEMENT_STEP);
        spacing = (spacing * factor).max(REFINEMENT_MIN * first_spacing);
        progress = progress_rest;
    }
}

/// Kept node: one that the look-up of some pair of directions reads. Other nodes have no record.
struct KeptNode {
    /// Index in the lattice, row-major from node `(−reach, −reach)`.
    index: usize,
    /// Last knot at or below the largest κ at which the node can be read.
    last_knot: usize,
}

/// Build at a fixed spacing of knots.
struct Build<'a> {
    /// Source of the node values.
    spectrum: &'a Spectrum,
    /// Quantity of the nodes.
    quantity: NodeQuantity,
    /// Distance between knots in rad/µm.
    kappa_step: f64,
    /// κ₀ in rad/µm. A flat relief may have any positive value.
    kappa_knee: f64,
    /// Number of knots from κ = 0 to the first at or beyond [`KAPPA_MAX`].
    knots: usize,
    /// Nodes in the table, row by row. The list is symmetric: if `kept[i]` is node j, `kept[len − 1 − i]` is node −j.
    kept: Vec<KeptNode>,
    /// Progress over the knots.
    progress: Progress,
}

impl<'a> Build<'a> {
    /// Prepares a build; `spacing` of the knots is in units of 1/bandwidth (`knots.rs`).
    fn new(spectrum: &'a Spectrum, spacing: f64, progress: Progress) -> Result<Self, TableError> {
        let quantity = spectrum.quantity();
        let half_range_um = spectrum.half_range_um();
        let kappa_step = knot_step(quantity, half_range_um, spacing);
        let kappa_knee = if half_range_um > 0.0 { 1.0 / half_range_um } else { KAPPA_MAX };
        let knots = (KAPPA_MAX / kappa_step).ceil() as usize + 1;
        let kept = kept_nodes(spectrum.lattice(), kappa_step);
        let build = Self { spectrum, quantity, kappa_step, kappa_knee, knots, kept, progress };
        let (needed, limit) = (build.kept.iter().map(|node| build.record_floats(node)).sum(), FLOATS_MAX);
        if needed >= limit {
            let mb = |floats: usize| 4e-6 * floats as f64;
            return Err(TableError::TooLarge { needed_mb: mb(needed), limit_mb: mb(limit) });
        }
        Ok(build)
    }

    /// Length of a node's record in floats.
    fn record_floats(&self, node: &KeptNode) -> usize {
        record_floats(self.quantity, node.last_knot as f64) as usize
    }

    /// Computes the table.
    fn table(&self) -> SpectralTable {
        let (headers, rows) = self.curves();
        let components = self.quantity.components();
        let mut offsets = vec![0u32; self.spectrum.lattice().nodes()];
        // Offset 0 stands for no record, so float 0 is unused.
        let mut records = vec![0f32; 1 + self.kept.iter().map(|node| self.record_floats(node)).sum::<usize>()];
        let mut slices = Vec::with_capacity(self.kept.len());
        let (mut start, mut rest) = (1, &mut records[1..]);
        for node in &self.kept {
            offsets[node.index] = start as u32;
            let (slice, tail) = rest.split_at_mut(self.record_floats(node));
            start += slice.len();
            slices.push(slice);
            rest = tail;
        }
        slices.into_par_iter().enumerate().for_each(|(i, record)| {
            let (header, coefficients) = record.split_at_mut(HEADER);
            header.copy_from_slice(&[headers[i].re as f32, headers[i].im as f32]);
            let mut curve = Vec::with_capacity(rows.len());
            for component in 0..components {
                // Values at the knots, which the filter replaces by coefficients.
                curve.clear();
                curve.extend(rows.iter().map(|row| f64::from(row[i * components + component])));
                prefilter(&mut curve);
                // A record begins with the coefficient of knot −1, the curve with that of knot −EXTRA_KNOTS.
                let from_knot_minus_1 = &curve[EXTRA_KNOTS as usize - 1..];
                for (to, from) in coefficients.iter_mut().skip(component).step_by(components).zip(from_knot_minus_1) {
                    *to = *from as f32;
                }
            }
        });
        SpectralTable {
            lattice: self.spectrum.lattice().clone(),
            quantity: self.quantity,
            norm: self.spectrum.norm(),
            kappa_max: KAPPA_MAX,
            kappa_step: self.kappa_step,
            kappa_knee: self.kappa_knee,
            offsets,
            records,
        }
    }

    /// Headers and scaled curves `Q(κ)` of the kept nodes (see [`SpectralTable`]).
    ///
    /// A header is a pair of floats in the form of a complex number: `P(0) + i·P'(0)`, or `D(0)`. Curves are rows
    /// `[knot][node][component]`, with the knots from `−EXTRA_KNOTS` to `knots + EXTRA_KNOTS`. Rows of negative knots
    /// are mirrored. Rows are in single precision, since they are most of a build's memory.
    fn curves(&self) -> (Vec<Complex64>, Vec<Vec<f32>>) {
        let mut headers = self.kept_values(&self.spectrum.nodes(0.0));
        let last_computed_knot = self.knots as i64 + EXTRA_KNOTS;
        let small_kappa = SMALL_PHASE * self.kappa_knee;
        if self.quantity == NodeQuantity::Power {
            let nearby = self.kept_values(&self.spectrum.nodes(small_kappa));
            for (i, header) in headers.iter_mut().enumerate() {
                // Slope P'(0), the central difference between ±small_kappa.
                header.im = (nearby[i] - mirrored(&nearby, i)).re / (2.0 * small_kappa);
            }
        }
        let steps = self.progress.of_steps(last_computed_knot as usize + 1);
        let rows: Vec<Vec<f32>> = (0..=last_computed_knot)
            .into_par_iter()
            .map(|k| {
                let kappa = if k == 0 { small_kappa } else { k as f64 * self.kappa_step };
                let mut scaled = self.scaled(kappa, &headers);
                if k == 0 {
                    // The limit κ → 0: the mean of ±κ, in which odd terms of the series cancel.
                    scaled = (0..scaled.len()).map(|i| 0.5 * (scaled[i] + mirrored(&scaled, i))).collect();
                }
                steps.one();
                self.row(&scaled)
            })
            .collect();
        let before: Vec<Vec<f32>> =
            rows[1..=EXTRA_KNOTS as usize].iter().rev().map(|row| self.mirrored_row(row)).collect();
        (headers, before.into_iter().chain(rows).collect())
    }

    /// Values of the kept nodes as a row `[node][component]`.
    fn row(&self, values: &[Complex64]) -> Vec<f32> {
        match self.quantity {
            NodeQuantity::Power => values.iter().map(|c| c.re as f32).collect(),
            NodeQuantity::Amplitude => values.iter().flat_map(|c| [c.re as f32, c.im as f32]).collect(),
        }
    }

    /// Row at −κ from the row at κ; see [`mirrored`].
    fn mirrored_row(&self, row: &[f32]) -> Vec<f32> {
        match self.quantity {
            NodeQuantity::Power => row.iter().rev().copied().collect(),
            NodeQuantity::Amplitude => row.chunks_exact(2).rev().flat_map(|c| [c[0], -c[1]]).collect(),
        }
    }

    /// Values of the kept nodes, from those of all nodes of the lattice.
    fn kept_values(&self, nodes: &[Complex64]) -> Vec<Complex64> {
        self.kept.iter().map(|node| nodes[node.index]).collect()
    }

    /// `Q(κ)` of the kept nodes at a positive κ: the formulas of [`SpectralTable`], solved for Q. With r = κ₀/κ,
    ///
    /// - powers: `Q = P(0) + (P(κ) − P(0))·(1 + r²) − r·κ₀·P'(0)`,
    /// - amplitudes: `Q = (D(κ) − D(0))·(1 + ir)`.
    fn scaled(&self, kappa: f64, headers: &[Complex64]) -> Vec<Complex64> {
        let values = self.kept_values(&self.spectrum.nodes(kappa));
        let ratio = self.kappa_knee / kappa;
        let pairs = values.iter().zip(headers);
        match self.quantity {
            NodeQuantity::Power => pairs
                .map(|(value, header)| {
                    let (zero, slope) = (header.re, header.im);
                    let from_zero = (value.re - zero) * (1.0 + ratio * ratio) - ratio * self.kappa_knee * slope;
                    (zero + from_zero).into()
                })
                .collect(),
            NodeQuantity::Amplitude => {
                let scale = Complex64::new(1.0, ratio);
                pairs.map(|(value, zero)| (value - zero) * scale).collect()
            }
        }
    }

    /// Measures [`TableReport::relative_error`]: the packed table against S from node values midway between knots, at
    /// frequencies near some of the nodes. Zero for a flat relief, whose S does not depend on κ.
    fn measured_error(&self, table: &SpectralTable, packed: &PackedTable) -> f64 {
        if self.spectrum.half_range_um() == 0.0 {
            return 0.0;
        }
        let (x, y) = (&table.lattice.x, &table.lattice.y);
        let middle = self.knots / 2;
        let mut errors = Vec::new();
        // Knots before the κ of the measurement. Beyond half of the range, κ occurs at few frequencies.
        let knots: [usize; ERROR_KAPPAS] = [0, middle / 2, middle];
        for knot in knots {
            let kappa = (knot as f64 + 0.5) * self.kappa_step;
            // No pair of directions has a κ above KAPPA_MAX, so these nodes are then not used.
            let nodes = self.spectrum.nodes(kappa.min(KAPPA_MAX));
            // Every `stride`-th kept node, at most ERROR_SAMPLES of them. Node 0 is always kept, so `stride` is at
            // least 1.
            let stride = self.kept.len().div_ceil(ERROR_SAMPLES);
            errors.par_extend(self.kept.par_iter().step_by(stride).filter_map(|node| {
                // Positions off the nodes, by 0.3 along x and 0.4 along y of the spacing, or of the kernel's standard
                // deviation if that is smaller. Chosen: neither on a node nor midway between two.
                let at = |i: usize, reach: usize, by: f64| i as f64 - reach as f64 + by;
                let px = at(node.index % x.nodes(), x.reach, 0.3 * x.sigma.min(1.0));
                let py = at(node.index / x.nodes(), y.reach, 0.4 * y.sigma.min(1.0));
                let f = [px / x.period_um, py / y.period_um];
                // Only where a pair of directions has this frequency and κ: (2πf, κ) is their scattering vector times
                // 2π/λ, no longer than KAPPA_MAX.
                let occurs = TAU * (f[0] * f[0] + f[1] * f[1]).sqrt().hypot(kappa / TAU) <= KAPPA_MAX;
                if !occurs || !table.is_resolved(f) {
                    return None;
                }
                let mean = packed.mean(f, [0.0, table.kappa_limit(f)]);
                let truth = table.combine([px, py], |index| nodes[index]);
                Some((packed.density(f, kappa) - truth).abs() / truth.max(mean).max(DENSITY_FLOOR_UM2))
            }));
        }
        errors.sort_by(f64::total_cmp);
        errors.get(errors.len().saturating_sub(1) * 99 / 100).copied().unwrap_or(0.0)
    }
}

/// Value at −κ of kept node `i`, from the values of all kept nodes at κ. Heights are real, so `P_j(−κ) = P_{−j}(κ)` and
/// `D_j(−κ)` is the conjugate of `D_{−j}(κ)`.
fn mirrored(values: &[Complex64], i: usize) -> Complex64 {
    values[values.len() - 1 - i].conj()
}

/// Nodes that the look-up of some pair of directions reads, row by row.
fn kept_nodes(lattice: &Lattice, kappa_step: f64) -> Vec<KeptNode> {
    let (x, y) = (&lattice.x, &lattice.y);
    let mut kept = Vec::new();
    for row in 0..y.nodes() {
        for column in 0..x.nodes() {
            let nearest =
                [(x, column), (y, row)].map(|(axis, i)| nearest_frequency(axis, i as f64 - axis.reach as f64));
            if let Some(kappa) = kappa_reached(nearest) {
                kept.push(KeptNode { index: row * x.nodes() + column, last_knot: (kappa / kappa_step) as usize });
            }
        }
    }
    kept
}
