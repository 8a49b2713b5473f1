//! Build of a colour table.
//!
//! 1. A plan of the rings (`rings.rs`) that fits the limits of memory and time.
//! 2. The spectral table of the relief.
//! 3. Samples of the colour F on all rings, integrated over wavelength (`path.rs`).
//! 4. Spline coefficients of each ring (`fit.rs`), packed in words (`pack.rs`).
//!
//! F is the colour over the scattering vector wi + wo = (u, v, w), the integral over the wavelength λ of the power
//! spectrum S at the frequency (u, v)/λ and the phase rate κ = 2πw/λ ([parent module](super)).

use super::fit::{FittedRing, fit};
use super::pack::{exponent_offset, pack};
use super::path::{Path, PerRay, RAYS, Reflectance, STEP_SIGMAS, STEPS_MIN, Term, VISIBLE_UM};
use super::rings::{RingPlan, Rings, W_LOG};
use super::{ColourLayout, ColourTable, ColourTableError, ColourTableReport, RESOLUTION, Ring};
use crate::clock::Instant;
use crate::colour::SpectralToRgb;
use crate::height_field::HeightField;
use crate::table::{
    BuildDemand, COHERENCE_LENGTH_UM, CoherenceWindow, Model, Progress, Purpose, SpectralTable, Spectrum, TOLERANCE,
    TableError, Tiling,
};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::f64::consts::TAU;

/// Upper bound of the [`cost`] of a build, in products of a [`Term`] and a ray: a few seconds on two cores. The other
/// work grows with the range of heights: sinusoids of 10, 120 and 250 µm took 5, 19 and 28 s in all. Larger values keep
/// longer coherence lengths; smaller ones build faster.
const COST_MAX: f64 = 1.5e9;

/// Factor by which the coherence length is reduced until the table is small enough. A smaller factor would reduce the
/// length more than necessary; a larger one takes more plans, which are cheap.
const LENGTH_STEP: f64 = 0.95;

/// Standard deviation of the Gaussian window that stands for an aperiodic scan's taper, as a fraction of the scan's
/// longer side. A Gaussian with a spectral peak as wide as the taper's has 0.23. This value is larger, so that rings
/// resolve the taper's side lobes, too.
const TAPER_SIGMA: f64 = 0.35;

/// Wavelength in µm for which [`knee`] is computed: about the middle of the visible range.
const KNEE_WAVELENGTH_UM: f64 = 0.5;

/// Options of [`ColourTable::build`].
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ColourTableOptions {
    /// Coherence length in µm: four standard deviations of the window.
    pub coherence_length_um: f64,
    /// Coherence model.
    pub model: Model,
    /// Continuation of the relief beyond the tile.
    pub tiling: Tiling,
    /// Relative error of the spectral table from which colours are computed, in [`TOLERANCE`].
    pub tolerance: f64,
    /// Factor on the number of samples along each axis, in [`RESOLUTION`]. At 1 the colour difference ΔE₂₀₀₀ from the
    /// integral is below 1 in 99 % of the directions.
    pub resolution: f64,
    /// Factor on the limits of memory and time of the spectral table, in [`crate::table::BUILD_LIMIT`].
    pub build_limit: f64,
}

impl ColourTable {
    /// Builds the table of `field`.
    ///
    /// # Errors
    /// A coherence length outside [`COHERENCE_LENGTH_UM`], a tolerance outside [`TOLERANCE`], a resolution outside
    /// [`RESOLUTION`], or a spectral table that costs more than its limit.
    pub fn build(field: &HeightField, options: &ColourTableOptions) -> Result<Self, ColourTableError> {
        Self::build_reflecting(field, options, &|_, _| 1.0, &Progress::none()).map(|(table, _)| table)
    }

    /// Builds the table of `field` with the interface's `reflectance` in the integral over wavelength. Also returns the
    /// spectral table that it was integrated from, whose coherence length is
    /// [`ColourTableReport::coherence_length_um`].
    ///
    /// `reflectance` should be smooth in the cosine: it is sampled at the table's values of w, which are only six on
    /// each ring of a flat relief.
    ///
    /// # Errors
    /// The errors of [`ColourTable::build`].
    pub fn build_reflecting(
        field: &HeightField,
        options: &ColourTableOptions,
        reflectance: Reflectance,
        progress: &Progress,
    ) -> Result<(Self, SpectralTable), ColourTableError> {
        let start = Instant::now();
        let length_um = options.coherence_length_um;
        TableError::unless_in("coherence_length", length_um, COHERENCE_LENGTH_UM, "0.001 to 100000 µm")?;
        TableError::unless_in("tolerance", options.tolerance, TOLERANCE, "1e-6 to 0.1")?;
        TableError::unless_in("resolution", options.resolution, RESOLUTION, "0.25 to 4")?;
        // Step of the CIE's tables of the observer.
        let step_nm = 1.0;
        let weights = SpectralToRgb::visible(step_nm)?;
        let (plan, coherence_length_um) = fitting_plan(field, options);
        let (low, high) = field.range_um();
        let demand = BuildDemand {
            size: field.size(),
            pixel_um: (field.dx_um(), field.dy_um()),
            range_um: high - low,
            model: options.model,
            tiling: options.tiling,
            coherence_length_um,
            // Only the advice in a refusal's message reads it. A `ColourSurface` has passed this check before, with the
            // magnification of its cover or body.
            magnification: 1.0,
            tolerance: options.tolerance,
            purpose: Purpose::Table,
        };
        demand.check(options.build_limit)?;
        let window = CoherenceWindow::new(coherence_length_um);
        let spectrum = Spectrum::new(field, options.model, options.tiling, window, options.tolerance);
        let (table_progress, rings_progress) = progress.halves();
        // The spectral table, with a report of its error.
        let built = crate::table::build(&spectrum, options.tolerance, &table_progress)?;
        let sigma_per_um = order_sigma_per_um(field, options.tiling, coherence_length_um);
        let rings =
            fit_rings(&built.table, &plan, sigma_per_um, knee(&spectrum), &weights, reflectance, &rings_progress);
        progress.report(1.0);
        let (layout, words) = assemble(&plan, &rings);
        let report = ColourTableReport {
            bytes: 4 * words.len(),
            rings: plan.rings.len(),
            directions: plan.rings.iter().map(|ring| ring.directions).max().unwrap_or(0),
            coherence_length_um,
            order_sigma_per_um: sigma_per_um,
            spectral_error: built.report.relative_error,
            build_seconds: start.elapsed().as_secs_f64(),
        };
        Ok((Self { layout, words, report }, built.table))
    }
}

/// Standard deviation in cycles/µm of the narrowest feature of S: an order's Gaussian, which an aperiodic scan's taper
/// widens.
fn order_sigma_per_um(field: &HeightField, tiling: Tiling, coherence_length_um: f64) -> f64 {
    let window_sigma_um = CoherenceWindow::new(coherence_length_um).sigma_um();
    let sigma_um = match tiling {
        Tiling::Periodic => window_sigma_um,
        Tiling::Aperiodic => {
            let (lx, ly) = field.extent_um();
            let taper_sigma_um = TAPER_SIGMA * lx.max(ly);
            // A smooth minimum of both standard deviations: (σ₁⁻⁴ + σ₂⁻⁴)^(−1/4).
            window_sigma_um.powi(-2).hypot(taper_sigma_um.powi(-2)).powf(-0.5)
        }
    };
    CoherenceWindow::from_sigma_um(sigma_um).order_sigma_per_um()
}

/// Plan of the rings, and its coherence length in µm: the surface's, or a shorter one whose table is small enough.
fn fitting_plan(field: &HeightField, options: &ColourTableOptions) -> (Rings, f64) {
    let (low, high) = field.range_um();
    let mut coherence_length_um = options.coherence_length_um;
    // The loop ends, since bounds in `rings.rs` keep the tables of short coherence lengths small for any relief.
    loop {
        let sigma_per_um = order_sigma_per_um(field, options.tiling, coherence_length_um);
        let plan = Rings::plan(sigma_per_um, high - low, options.tiling == Tiling::Aperiodic, options.resolution);
        // A word has four bytes.
        let is_small = 4 * (plan.words() + Ring::WORDS * plan.rings.len()) <= ColourTable::LIMIT_BYTES
            && plan.rings.len() <= ColourTable::RINGS_MAX;
        if is_small && cost(&plan, sigma_per_um) <= COST_MAX {
            return (plan, coherence_length_um);
        }
        coherence_length_um *= LENGTH_STEP;
    }
}

/// Estimated number of products of a [`Term`] and a ray, over all rings: directions times values of w times steps. The
/// steps are those over the radial frequency ρ = r/λ from the longest to the shortest visible wavelength ([`Path`]).
fn cost(plan: &Rings, sigma_per_um: f64) -> f64 {
    // Difference of 1/λ between the shortest and the longest wavelength.
    let visible_per_um = 1.0 / VISIBLE_UM.0 - 1.0 / VISIBLE_UM.1;
    plan.rings
        .iter()
        .map(|ring| {
            let steps = (ring.radius * visible_per_um / (STEP_SIGMAS * sigma_per_um)).max(STEPS_MIN);
            (ring.directions * ring.w_count()) as f64 * steps
        })
        .sum()
}

/// The `knee` of `fit.rs`, the value of w below which F falls as w². There `κH = 2πwH/λ` is one radian, with H half the
/// range of heights. The knee is at most the largest w, 2.
fn knee(spectrum: &Spectrum) -> f64 {
    // The lower bound of H, 1 pm, avoids a division by zero for a flat relief.
    (KNEE_WAVELENGTH_UM / (TAU * spectrum.half_range_um().max(1e-6))).min(2.0)
}

/// Samples and fits all rings, group by group, so that only one group's samples are in memory.
///
/// `sigma_per_um` is the standard deviation of an order in cycles/µm; `weights` are those of the wavelengths in linear
/// sRGB.
fn fit_rings(
    table: &SpectralTable,
    plan: &Rings,
    sigma_per_um: f64,
    knee: f64,
    weights: &SpectralToRgb,
    reflectance: Reflectance,
    progress: &Progress,
) -> Vec<FittedRing> {
    // A group has the rings with equal numbers of directions; a batch of it has RAYS directions and all its rings. The
    // last batch may have rays beyond the last direction, whose samples are not used.
    let batches_of = |group: &[RingPlan]| group[0].directions.div_ceil(RAYS);
    let groups = || plan.rings.chunk_by(|a, b| a.directions == b.directions);
    let steps = progress.of_steps(groups().map(batches_of).sum());
    groups()
        .flat_map(|group| {
            let path = Path::new(group, sigma_per_um);
            let terms: Vec<Vec<Term>> =
                group.iter().map(|ring| path.terms(table, ring, weights, reflectance)).collect();
            let coefficient_counts = path.coefficient_counts(&terms);
            let batches: Vec<Vec<PerRay>> = (0..batches_of(group))
                .into_par_iter()
                .map(|batch| {
                    let samples = path.integrate(table, &coefficient_counts, &terms, group, batch * RAYS);
                    steps.one();
                    samples
                })
                .collect();
            // Index in a batch of each ring's first sample, of three channels for each w.
            let mut next = 0;
            let mut starts = Vec::with_capacity(group.len());
            for ring in group {
                starts.push(next);
                next += ring.w_count() * 3;
            }
            let rings: Vec<FittedRing> = group
                .par_iter()
                .zip(starts)
                .map(|(ring, start)| fit(ring, ring_samples(&batches, start, ring), knee))
                .collect();
            rings
        })
        .collect()
}

/// Samples of one ring, `[direction][w][channel]`, from batches of [`RAYS`] directions. A batch is
/// `[ring][w][channel][ray]`, and the ring begins at `start` in it.
fn ring_samples(batches: &[Vec<PerRay>], start: usize, ring: &RingPlan) -> Vec<f32> {
    let row_len = ring.w_count() * 3;
    let mut samples = vec![0f32; ring.directions * row_len];
    for (direction, row) in samples.chunks_exact_mut(row_len).enumerate() {
        let batch = &batches[direction / RAYS][start..];
        row.iter_mut().zip(batch).for_each(|(sample, rays)| *sample = rays[direction % RAYS]);
    }
    samples
}

/// Packs the coefficients of the fitted rings and the rings' records into the words of a table.
fn assemble(plan: &Rings, fitted: &[FittedRing]) -> (ColourLayout, Vec<u32>) {
    let largest = fitted
        .par_iter()
        .map(|ring| ring.coefficients.iter().fold(0f32, |a, b| a.max(b.abs())))
        .reduce(|| 0.0, f32::max);
    // Offset of the packed exponents, for which the largest coefficient fits (`pack.rs`).
    let exponent_offset = exponent_offset(largest);
    let count = plan.rings.len();
    let padding_max = 3;
    let mut words = Vec::with_capacity(plan.words() + padding_max + Ring::WORDS * count);
    let mut rings = Vec::with_capacity(count);
    for (ring, fitted_ring) in plan.rings.iter().zip(fitted) {
        rings.push(Ring {
            offset: words.len() as u32,
            directions: ring.directions as u32,
            w_count: ring.w_count() as u32,
            knots_per_w: ring.knots_per_w as f32,
            knots_per_efold: ring.knots_per_efold as f32,
            knee_squared: fitted_ring.knee_squared as f32,
            zero_squared: fitted_ring.zero_squared as f32,
        });
        words.extend(fitted_ring.coefficients.chunks_exact(3).map(|c| pack([c[0], c[1], c[2]], exponent_offset)));
    }
    // Records are read in packets of four words, and GPU buffers are aligned to four words.
    words.resize(words.len().next_multiple_of(4), 0);
    let layout = ColourLayout {
        inner_spacing: plan.inner_spacing as f32,
        growth: plan.growth as f32,
        w_log: W_LOG as f32,
        exponent_offset,
        last_ring: count as u32 - 1,
        rings_at: words.len() as u32 / 4,
    };
    words.extend(rings.iter().flat_map(Ring::words));
    (layout, words)
}
