//! Builds a table: splines in κ through the node values of a [`Spectrum`], refined until their error meets the
//! tolerance.
//!
//! - `h`: half the range of heights in µm. `κ₀ = 1/h` (`kappa_knee`): where powers leave their behaviour at κ → 0.
//! - `Δ` (`kappa_step`): distance of knots in rad/µm. `b`: half bandwidth of a node's curve in κ, `h` of an amplitude
//!   and `2h` of a power. Spacing: `Δ·b`, the largest phase advance of a curve over one knot, in radians.
//! - `Q(κ)`: the quantity that the splines interpolate ([`SpectralTable`] has its formula).
//! - A cubic B-spline errs on a wave of `a` radians a knot by about `(a/2π)⁴`, so the error goes with `Δ⁴`.
//! - κ range: 0 to `2π·2/λ_min`, since `|wi + wo| ≤ 2`. Only `|f|² + (κ/2π)² ≤ (2/λ_min)²` occurs.

use super::lattice::Lattice;
use super::lookup::{HEADER, NodeQuantity, SpectralTable};
use super::packed::PackedTable;
use super::progress::Progress;
use super::spectrum::Spectrum;
use super::spline::prefilter;
use super::{FREQUENCY_MAX_PER_UM, TableError, WAVELENGTH_MIN_NM};
use crate::clock::Instant;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::f64::consts::TAU;
use sunbeam_fourier::num_complex::Complex64;

/// Largest number of floats in a table's records: offsets are 32-bit integers.
const FLOATS_MAX: usize = u32::MAX as usize;
/// Knots beyond either end of the κ range. The influence of a spline's end falls by 0.27 a knot, to 4e-4 after six.
pub(super) const EXTRA_KNOTS: i64 = 6;
/// First spacing tried for a tolerance of 1, in radians a knot; it goes with the fourth root of the tolerance. Chosen:
/// the widest with which any relief met its tolerance. A wider one costs a second build, a narrower one memory.
const KNOT_SPACING: f64 = 13.0;
/// Least spacing tried, as a fraction of the first. Below it, rounding to single precision holds the error near 1e-6.
const REFINEMENT_MIN: f64 = 0.2;
/// Fraction of the tolerance that a refined table aims at. Chosen, so that one refinement mostly suffices.
const AIM: f64 = 0.7;
/// Factor on the spacing in one refinement. Chosen: the `Δ⁴` law is unreliable beyond it.
const REFINEMENT: std::ops::RangeInclusive<f64> = 0.4..=0.95;

/// Power density in µm² below which errors count as absolute: a hundredth of `λ²/π`, the density of a surface that
/// scatters uniformly over the disc of direction cosines, at the shortest wavelength. Chosen.
pub const DENSITY_FLOOR_UM2: f64 =
    0.01 * (WAVELENGTH_MIN_NM * 1e-3) * (WAVELENGTH_MIN_NM * 1e-3) / std::f64::consts::PI;

/// Frequencies sampled at each κ when the error of a table is measured. Chosen: enough for a 99th percentile.
const ERROR_SAMPLES: usize = 4000;

/// Size, sampling and measured error of a table.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct TableReport {
    /// Size in bytes.
    pub bytes: usize,
    /// Nodes kept.
    pub nodes: usize,
    /// Knots in κ.
    pub kappa_knots: usize,
    /// Nodes read by one look-up, along x and y.
    pub taps: (usize, usize),
    /// Error of S from the splines: 99th percentile over frequencies and over three κ midway between knots. Relative to
    /// the largest of S, its mean over κ at that frequency, and [`DENSITY_FLOOR_UM2`].
    pub relative_error: f64,
    /// Wall time of the build in seconds.
    pub build_seconds: f64,
}

/// Number of nodes up to which knots cost little memory, so that the error is set lower by [`FEW_NODES_FRACTION`].
/// Chosen.
const FEW_NODES: usize = 4096;
/// Fraction of the tolerance given to the splines of a table of few nodes. Chosen: few orders leave deep gaps in κ,
/// which a percentile over all κ hardly sees.
const FEW_NODES_FRACTION: f64 = 0.1;

/// A table in its two forms, with its report.
pub struct Built {
    /// Single-precision form, node by node; samplers, albedos and colour tables are made from it.
    pub table: SpectralTable,
    /// Form that evaluators read.
    pub packed: PackedTable,
    /// Sizes and measured error.
    pub report: TableReport,
}

/// Fraction of the remaining progress that one build reports, since a finer build may follow. Chosen.
const BUILD_FRACTION: f64 = 0.6;

/// Builds the table of `spectrum` to the relative error `tolerance`. [`BuildDemand::check`] predicts the cost
/// beforehand.
///
/// # Errors
/// [`TableError::TooLarge`] beyond the range of 32-bit offsets.
///
/// ```
/// use sunbeam::Preset;
/// use sunbeam::table::{CoherenceWindow, FREQUENCY_MAX_PER_UM, Model, Progress, Spectrum, Tiling, build};
///
/// let (field, window) = (Preset::Blazed.build(None, None)?, CoherenceWindow::new(20.0));
/// let spectrum = Spectrum::new(&field, Model::Ensemble, Tiling::Periodic, window, FREQUENCY_MAX_PER_UM, 1e-2);
/// let built = build(&spectrum, 1e-2, &Progress::none())?;
/// assert!(built.report.relative_error <= 1e-2);
/// // Power density in µm² at order −1 of the period 2.5 µm, at κ = 20 rad/µm.
/// assert!(built.packed.density([-0.4, 0.0], 20.0) > 0.0);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// [`BuildDemand::check`]: super::BuildDemand::check
pub fn build(spectrum: &Spectrum, tolerance: f64, progress: &Progress) -> Result<Built, TableError> {
    let start = Instant::now();
    let target = spline_tolerance(spectrum.lattice(), tolerance);
    let first_spacing = first_spacing(spectrum.lattice(), tolerance);
    let mut spacing = first_spacing;
    let mut progress = progress.clone();
    loop {
        let build = Build { progress: progress.part(0.0, BUILD_FRACTION), ..Build::new(spectrum, spacing)? };
        let table = build.table();
        let packed = PackedTable::new(&table, tolerance);
        let relative_error = build.error(&table, &packed);
        if relative_error <= target || spacing <= REFINEMENT_MIN * first_spacing {
            let report = TableReport {
                bytes: packed.bytes(),
                nodes: build.kept.len(),
                kappa_knots: build.knots,
                taps: (table.lattice.x.taps, table.lattice.y.taps),
                relative_error,
                build_seconds: start.elapsed().as_secs_f64(),
            };
            progress.report(1.0);
            return Ok(Built { table, packed, report });
        }
        let closer = (AIM * target / relative_error).powf(0.25).clamp(*REFINEMENT.start(), *REFINEMENT.end());
        spacing = (spacing * closer).max(REFINEMENT_MIN * first_spacing);
        progress = progress.part(BUILD_FRACTION, 1.0);
    }
}

/// Error that the splines of a table may have, of the table's relative error `tolerance`.
fn spline_tolerance(lattice: &Lattice, tolerance: f64) -> f64 {
    let nodes = lattice.x.nodes().saturating_mul(lattice.y.nodes());
    tolerance * if nodes <= FEW_NODES { FEW_NODES_FRACTION } else { lattice.spline_fraction() }
}

/// First spacing of knots tried, in radians a knot.
pub(super) fn first_spacing(lattice: &Lattice, tolerance: f64) -> f64 {
    KNOT_SPACING * spline_tolerance(lattice, tolerance).powf(0.25)
}

/// Largest κ of a table in rad/µm: `|wi + wo| ≤ 2` at the shortest wavelength.
pub(super) fn kappa_range() -> f64 {
    TAU * 2e3 / WAVELENGTH_MIN_NM
}

/// Distance of knots in rad/µm, at most the whole range, for half the range of heights `half_range_um` and a `spacing`
/// in radians a knot.
pub(super) fn knot_step(quantity: NodeQuantity, half_range_um: f64, spacing: f64) -> f64 {
    // Powers are correlations of screens: twice the bandwidth of amplitudes.
    let bandwidth = if quantity == NodeQuantity::Power { 2.0 * half_range_um } else { half_range_um };
    if bandwidth > 0.0 { (spacing / bandwidth).min(kappa_range()) } else { kappa_range() }
}

/// Floats of a record whose last interval begins at the knot `last_knot`. A look-up reads four coefficients from there.
/// The number of coefficients is even, so that two of 16 bits fill a word.
pub(super) fn record_floats(quantity: NodeQuantity, last_knot: usize) -> usize {
    HEADER + (last_knot + 4).next_multiple_of(2) * quantity.components()
}

/// Margin on the largest κ of a node, relative: a look-up's κ is rounded to single precision.
const KAPPA_MARGIN: f64 = 1e-5;

/// Knots up to the largest κ of a node, `(κ/2π)² = squared_per_um2` in 1/µm².
pub(super) fn knots_below(squared_per_um2: f64, kappa_step: f64) -> f64 {
    TAU * squared_per_um2.sqrt() * (1.0 + KAPPA_MARGIN) / kappa_step
}

/// A node that some pair of directions reaches.
struct Kept {
    /// Row-major index in the lattice.
    index: usize,
    /// Knot below the largest κ at which a look-up reads this node.
    last_knot: usize,
}

/// One build at a fixed distance of knots.
struct Build<'a> {
    spectrum: &'a Spectrum,
    quantity: NodeQuantity,
    /// End of the κ range in rad/µm.
    kappa_max: f64,
    /// Distance of knots Δ in rad/µm.
    kappa_step: f64,
    /// κ₀ in rad/µm.
    kappa_knee: f64,
    /// Knots within the range, the first at κ = 0.
    knots: usize,
    /// Nodes in row-major order, symmetric about order zero: the mirror of `kept[i]` is `kept[len − 1 − i]`.
    kept: Vec<Kept>,
    /// Progress over the knots.
    progress: Progress,
}

impl<'a> Build<'a> {
    fn new(spectrum: &'a Spectrum, spacing: f64) -> Result<Self, TableError> {
        let build = Self::planned(spectrum, spacing);
        let (needed, limit) = (build.kept_floats(), FLOATS_MAX);
        if needed >= limit {
            let mb = |floats: usize| 4e-6 * floats as f64;
            return Err(TableError::TooLarge { needed_mb: mb(needed), limit_mb: mb(limit) });
        }
        Ok(build)
    }

    fn planned(spectrum: &'a Spectrum, spacing: f64) -> Self {
        let kappa_max = kappa_range();
        let quantity = spectrum.quantity();
        let h = spectrum.half_range_um();
        let kappa_step = knot_step(quantity, h, spacing);
        let kappa_knee = if h > 0.0 { 1.0 / h } else { kappa_max };
        let knots = (kappa_max / kappa_step).ceil() as usize + 1;
        let kept = reachable(spectrum.lattice(), FREQUENCY_MAX_PER_UM, kappa_step);
        Self { spectrum, quantity, kappa_max, kappa_step, kappa_knee, knots, kept, progress: Progress::none() }
    }

    /// Floats of all records of kept nodes.
    fn kept_floats(&self) -> usize {
        self.kept.iter().map(|kept| self.record_floats(kept.last_knot)).sum()
    }

    fn record_floats(&self, last_knot: usize) -> usize {
        record_floats(self.quantity, last_knot)
    }

    fn table(&self) -> SpectralTable {
        let (at_zero, curves) = self.curves();
        let components = self.quantity.components();
        let mut offsets = vec![0u32; self.spectrum.lattice().x.nodes() * self.spectrum.lattice().y.nodes()];
        // Offset 0 marks a node without a record.
        let mut length = 1;
        let mut spans = Vec::with_capacity(self.kept.len());
        for kept in &self.kept {
            offsets[kept.index] = length as u32;
            spans.push(self.record_floats(kept.last_knot));
            length += self.record_floats(kept.last_knot);
        }
        let mut records = vec![0f32; length];
        let mut pieces = Vec::with_capacity(spans.len());
        let mut rest = &mut records[1..];
        for span in spans {
            let (piece, tail) = rest.split_at_mut(span);
            pieces.push(piece);
            rest = tail;
        }
        pieces.into_par_iter().enumerate().with_min_len(256).for_each(|(node, record)| {
            let (zero, coefficients) = record.split_at_mut(HEADER);
            zero.copy_from_slice(&[at_zero[node].re as f32, at_zero[node].im as f32]);
            let mut curve = Vec::with_capacity(curves.len());
            for part in 0..components {
                curve.clear();
                curve.extend(curves.iter().map(|knot| f64::from(knot[node * components + part])));
                prefilter(&mut curve);
                // Coefficient 0 of a record belongs to the knot −1.
                let inner = &curve[EXTRA_KNOTS as usize - 1..];
                for (to, from) in coefficients.iter_mut().skip(part).step_by(components).zip(inner) {
                    *to = *from as f32;
                }
            }
        });
        SpectralTable {
            lattice: self.spectrum.lattice().clone(),
            quantity: self.quantity,
            norm: self.spectrum.norm(),
            kappa_max: self.kappa_max,
            kappa_step: self.kappa_step,
            kappa_knee: self.kappa_knee,
            offsets,
            records,
        }
    }

    /// Values at κ = 0 of each kept node, and Q of all kept nodes at every knot from `−EXTRA_KNOTS` on, as
    /// `[knot][node]`. The values at κ = 0 are (power, slope) as a complex number for powers, and the amplitude for
    /// amplitudes.
    fn curves(&self) -> (Vec<Complex64>, Vec<Vec<f32>>) {
        let mut at_zero = self.kept_values(&self.spectrum.nodes(0.0));
        let last = self.knots as i64 + EXTRA_KNOTS;
        let small = 1e-4 / self.spectrum.half_range_um().max(1e-12);
        if self.quantity == NodeQuantity::Power {
            let nearby = self.kept_values(&self.spectrum.nodes(small));
            for (i, zero) in at_zero.iter_mut().enumerate() {
                zero.im = (nearby[i] - self.mirrored(&nearby, i)).re / (2.0 * small);
            }
        }
        // Rows are rounded to single precision one by one: all of them in double precision would be most of a build's
        // memory. Knot 0 is the mean of both sides of κ = 0, in which the odd terms of the series cancel.
        let steps = self.progress.of_steps(last as usize + 1);
        let rows: Vec<Vec<f32>> = (0..=last)
            .into_par_iter()
            .map(|k| {
                let kappa = if k == 0 { small } else { k as f64 * self.kappa_step };
                let mut scaled = self.scaled(kappa, &at_zero);
                if k == 0 {
                    scaled = (0..scaled.len()).map(|i| 0.5 * (scaled[i] + self.mirrored(&scaled, i))).collect();
                }
                steps.one();
                self.pack(&scaled)
            })
            .collect();
        let before: Vec<Vec<f32>> =
            rows[1..=EXTRA_KNOTS as usize].iter().rev().map(|row| self.pack_mirrored(row)).collect();
        (at_zero, before.into_iter().chain(rows).collect())
    }

    /// A node's quantity at −κ from all nodes' at κ. Heights are real, so `P_j(−κ) = P_{−j}(κ)` and `D_j(−κ) =
    /// D̄_{−j}(κ)`.
    fn mirrored(&self, scaled: &[Complex64], node: usize) -> Complex64 {
        scaled[scaled.len() - 1 - node].conj()
    }

    /// Row of one κ in single precision; complex values as real and imaginary part.
    fn pack(&self, values: &[Complex64]) -> Vec<f32> {
        match self.quantity {
            NodeQuantity::Power => values.iter().map(|c| c.re as f32).collect(),
            NodeQuantity::Amplitude => values.iter().flat_map(|c| [c.re as f32, c.im as f32]).collect(),
        }
    }

    /// Row of `−κ` from the row of κ; see [`Build::mirrored`].
    fn pack_mirrored(&self, row: &[f32]) -> Vec<f32> {
        match self.quantity {
            NodeQuantity::Power => row.iter().rev().copied().collect(),
            NodeQuantity::Amplitude => row.chunks_exact(2).rev().flat_map(|c| [c[0], -c[1]]).collect(),
        }
    }

    fn kept_values(&self, nodes: &[Complex64]) -> Vec<Complex64> {
        self.kept.iter().map(|kept| nodes[kept.index]).collect()
    }

    /// `Q(κ)` of the kept nodes, κ > 0.
    fn scaled(&self, kappa: f64, at_zero: &[Complex64]) -> Vec<Complex64> {
        let values = self.kept_values(&self.spectrum.nodes(kappa));
        let ratio = self.kappa_knee / kappa;
        let pairs = values.iter().zip(at_zero);
        match self.quantity {
            NodeQuantity::Power => pairs
                .map(|(value, zero)| {
                    let beyond = (value.re - zero.re) * (1.0 + ratio * ratio) - ratio * self.kappa_knee * zero.im;
                    (zero.re + beyond).into()
                })
                .collect(),
            NodeQuantity::Amplitude => {
                let scale = Complex64::new(1.0, ratio);
                pairs.map(|(value, zero)| (value - zero) * scale).collect()
            }
        }
    }

    /// Measures [`TableReport::relative_error`] against node values of the spectrum.
    fn error(&self, table: &SpectralTable, packed: &PackedTable) -> f64 {
        if self.spectrum.half_range_um() == 0.0 {
            return 0.0;
        }
        let (x, y) = (&table.lattice.x, &table.lattice.y);
        let middle = self.knots / 2;
        let mut errors = Vec::new();
        for knot in [0, middle / 2, middle] {
            let kappa = (knot as f64 + 0.5) * self.kappa_step;
            let nodes = self.spectrum.nodes(kappa.min(self.kappa_max));
            let stride = self.kept.len().div_ceil(ERROR_SAMPLES);
            errors.par_extend(self.kept.par_iter().step_by(stride).filter_map(|kept| {
                // Positions between nodes: a third of an order's width away, and less than half the gap.
                let at = |i: usize, reach: usize, by: f64| i as f64 - reach as f64 + by;
                let px = at(kept.index % x.nodes(), x.reach, 0.3 * x.sigma.min(1.0));
                let py = at(kept.index / x.nodes(), y.reach, 0.4 * y.sigma.min(1.0));
                let f = [px / x.period_um, py / y.period_um];
                let occurs = TAU * (f[0] * f[0] + f[1] * f[1]).sqrt().hypot(kappa / TAU) <= self.kappa_max;
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

/// Nodes that a look-up can read, with `|f|² + (κ/2π)² ≤ frequency_max²` in cycles/µm. A look-up reads nodes up to half
/// the taps away from its frequency.
fn reachable(lattice: &Lattice, frequency_max: f64, kappa_step: f64) -> Vec<Kept> {
    let (x, y) = (&lattice.x, &lattice.y);
    let mut kept = Vec::new();
    for row in 0..y.nodes() {
        for column in 0..x.nodes() {
            let nearest = |i: usize, axis: &super::LatticeAxis| {
                ((i as f64 - axis.reach as f64).abs() - 0.5 * axis.taps as f64).max(0.0) / axis.period_um
            };
            let rest = frequency_max.powi(2) - nearest(column, x).powi(2) - nearest(row, y).powi(2);
            if rest >= 0.0 {
                let last_knot = knots_below(rest, kappa_step) as usize;
                kept.push(Kept { index: row * x.nodes() + column, last_knot });
            }
        }
    }
    kept
}
