//! Build of a colour table: integrates the rings' samples and packs their spline coefficients.

use super::pack::{exponent_offset, pack};
use super::path::{LANES, Lanes, Path, Reading, Reflectance, STEP_SIGMAS, STEPS_MIN, VISIBLE_UM};
use super::rings::{RingPlan, Rings, W_LOG};
use super::{ColourLayout, ColourTable, ColourTableError, ColourTableReport, RESOLUTION, Ring};
use crate::clock::Instant;
use crate::colour::SpectralToRgb;
use crate::height_field::HeightField;
use crate::numeric::math::cubic_b_spline;
use crate::table::{
    BuildDemand, CoherenceWindow, FREQUENCY_MAX_PER_UM, Model, Progress, Purpose, SpectralTable, Spectrum, TableError,
    Tiling,
};
use nalgebra::DMatrix;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::f64::consts::TAU;

/// Largest number of record reads of a build. Chosen: some seconds on two cores.
const COST_MAX: f64 = 1.5e9;
/// Fraction of the build's progress that the spectral table counts for. Chosen, for display only.
const SPECTRAL_FRACTION: f64 = 0.5;
/// Standard deviation of the Gaussian window that stands for a scan's taper, in widths of the scan.
///
/// Chosen on the safe side: the taper of `src/table/spectrum.rs` has the half width of a narrower one, about 0.2, so
/// the rings resolve its features.
const TAPER_SIGMA: f64 = 0.35;
/// Factor by which the coherence length is shortened until the table is within its limits. Chosen.
const SHORTENING: f64 = 0.95;
/// Wavelength in µm at which [`knee`] takes the relief's phase: the middle of the visible range, rounded.
const KNEE_WAVELENGTH_UM: f64 = 0.5;
/// Pole of the cubic B-spline's recursive prefilter, `√3 − 2` (Unser, *Splines: A Perfect Fit for Signal and Image
/// Processing*, 1999).
const POLE: f32 = -0.267_949_2;
/// Samples after which the prefilter has forgotten its start: `|POLE|²⁴` is below the rounding of single precision.
const START_UP: usize = 24;

/// Parameters of a colour table.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ColourTableOptions {
    /// Four standard deviations of the coherence window, in µm.
    pub coherence_length_um: f64,
    /// Coherence model.
    pub model: Model,
    /// Whether the tile repeats.
    pub tiling: Tiling,
    /// Relative error of the spectral table that colours are integrated from.
    pub tolerance: f64,
    /// Factor on the number of samples along each axis, 0.25 to 4. At 1 the ΔE₂₀₀₀ of 99 % of pixels is below 1.
    pub resolution: f64,
    /// Factor on the limits of memory and time of the spectral table, at least 1.
    pub build_limit: f64,
}

impl ColourTable {
    /// Builds the table of `field`.
    ///
    /// # Errors
    /// A coherence length outside [1e-3, 1e5] µm, a tolerance outside [1e-6, 0.1], a resolution outside [0.25, 4], or a
    /// spectral table that would take more than its limit allows.
    pub fn build(field: &HeightField, options: &ColourTableOptions) -> Result<Self, ColourTableError> {
        Self::build_reflecting(field, options, &|_, _| 1.0, &Progress::none()).map(|(table, _)| table)
    }

    /// Builds the table with a reflectance inside the integral: `reflected(nm, cos)` for wavelengths of 380 to 780 nm
    /// and the cosine at the half vector. It should be smooth in the cosine, which the heights sample: six of them on a
    /// flat relief. Also returns the spectral table, at the colour table's coherence length.
    ///
    /// # Errors
    /// As [`ColourTable::build`].
    pub fn build_reflecting(
        field: &HeightField,
        options: &ColourTableOptions,
        reflectance: Reflectance,
        progress: &Progress,
    ) -> Result<(Self, SpectralTable), ColourTableError> {
        let start = Instant::now();
        TableError::unless_in("coherence_length", options.coherence_length_um, 1e-3..=1e5, "0.001 to 100000 µm")?;
        TableError::unless_in("tolerance", options.tolerance, 1e-6..=0.1, "1e-6 to 0.1")?;
        TableError::unless_in("resolution", options.resolution, RESOLUTION, "0.25 to 4")?;
        let colours = SpectralToRgb::visible(1.0)?;
        let (plan, coherence_length_um) = fitting_plan(field, options);
        let (low, high) = field.range_um();
        let demand = BuildDemand {
            size: field.size(),
            pixel_um: (field.dx_um(), field.dy_um()),
            range_um: high - low,
            model: options.model,
            tiling: options.tiling,
            coherence_length_um,
            tolerance: options.tolerance,
            purpose: Purpose::Table,
        };
        demand.check(options.build_limit)?;
        let spectrum = Spectrum::new(
            field,
            options.model,
            options.tiling,
            CoherenceWindow::new(coherence_length_um),
            FREQUENCY_MAX_PER_UM,
            options.tolerance,
        );
        let built = crate::table::build(&spectrum, options.tolerance, &progress.part(0.0, SPECTRAL_FRACTION))?;
        let (table, spectral_error) = (built.table, built.report.relative_error);
        let sigma = order_sigma(field, options.tiling, coherence_length_um);
        let of_rings = progress.part(SPECTRAL_FRACTION, 1.0);
        let rings = fill(&table, &plan, sigma, knee(&spectrum), &colours, reflectance, &of_rings);
        progress.report(1.0);
        let mut colours = assemble(&plan, rings, coherence_length_um, sigma, start);
        colours.report.spectral_error = spectral_error;
        Ok((colours, table))
    }
}

/// Standard deviation in cycles/µm of the narrowest feature of S, that of an order's Gaussian.
fn order_sigma(field: &HeightField, tiling: Tiling, coherence_length_um: f64) -> f64 {
    let s = CoherenceWindow::new(coherence_length_um).sigma_um();
    let window_um = match tiling {
        Tiling::Periodic => s,
        Tiling::Aperiodic => {
            // A tapered scan is itself a window. The narrower of the two windows dominates.
            let (lx, ly) = field.extent_um();
            s.powi(-2).hypot((TAPER_SIGMA * lx.max(ly)).powi(-2)).powf(-0.5)
        }
    };
    CoherenceWindow::from_sigma_um(window_um).order_sigma_per_um()
}

/// Plan of the rings with its coherence length in µm: the surface's, shortened until the table is within the limits.
fn fitting_plan(field: &HeightField, options: &ColourTableOptions) -> (Rings, f64) {
    let (low, high) = field.range_um();
    let mut coherence_length_um = options.coherence_length_um;
    loop {
        let sigma = order_sigma(field, options.tiling, coherence_length_um);
        let plan = Rings::plan(sigma, high - low, options.tiling == Tiling::Aperiodic, options.resolution);
        let small = 4 * (plan.words() + Ring::WORDS * plan.rings.len()) <= ColourTable::LIMIT_BYTES
            && plan.rings.len() <= ColourTable::RINGS_MAX;
        if small && cost(&plan, sigma) <= COST_MAX {
            return (plan, coherence_length_um);
        }
        coherence_length_um *= SHORTENING;
    }
}

/// Number of record reads of a build.
fn cost(plan: &Rings, sigma: f64) -> f64 {
    let bandwidth = 1.0 / VISIBLE_UM.0 - 1.0 / VISIBLE_UM.1;
    plan.rings
        .iter()
        .map(|ring| {
            (ring.directions * ring.heights()) as f64 * (ring.radius * bandwidth / (STEP_SIGMAS * sigma)).max(STEPS_MIN)
        })
        .sum()
}

/// The w at which the relief's phase is one radian, at most 2; below it `F` falls as w².
fn knee(spectrum: &Spectrum) -> f64 {
    (KNEE_WAVELENGTH_UM / (TAU * spectrum.half_range_um().max(1e-6))).min(2.0)
}

/// Contents of one ring: the scale of its values, and their B-spline coefficients `[direction][height][channel]`.
struct FilledRing {
    knee_squared: f64,
    zero_squared: f64,
    coefficients: Vec<f32>,
}

/// Integrates the samples of all rings and turns them into spline coefficients.
///
/// `sigma` is the standard deviation of an order in cycles/µm; `knee` is a value of w.
fn fill(
    table: &SpectralTable,
    plan: &Rings,
    sigma: f64,
    knee: f64,
    colours: &SpectralToRgb,
    reflectance: Reflectance,
    progress: &Progress,
) -> Vec<FilledRing> {
    let batches_of = |group: &[RingPlan]| group[0].directions.div_ceil(LANES);
    let groups = || plan.rings.chunk_by(|a, b| a.directions == b.directions);
    let steps = progress.of_steps(groups().map(batches_of).sum());
    groups()
        .flat_map(|group| {
            let path = Path::new(group, sigma);
            let readings: Vec<Vec<Reading>> =
                group.iter().map(|ring| path.readings(table, ring, colours, reflectance)).collect();
            let coefficients = path.coefficients(&readings);
            let batches: Vec<Vec<Lanes>> = (0..batches_of(group))
                .into_par_iter()
                .map(|batch| {
                    let integrals = path.integrate(table, &coefficients, &readings, group, batch * LANES);
                    steps.one();
                    integrals
                })
                .collect();
            // Start of each ring in a batch.
            let starts = group.iter().scan(0, |next, ring| {
                let start = *next;
                *next += ring.heights() * 3;
                Some(start)
            });
            let starts: Vec<usize> = starts.collect();
            let rings: Vec<FilledRing> = group
                .par_iter()
                .zip(starts)
                .map(|(ring, start)| filled(ring, ring_values(&batches, start, ring), knee))
                .collect();
            rings
        })
        .collect()
}

/// One ring's samples `[direction][height][channel]`, from batches `[ring][height][channel]` of [`LANES`] directions.
/// `start` is the ring's first index in a batch.
fn ring_values(batches: &[Vec<Lanes>], start: usize, ring: &RingPlan) -> Vec<f32> {
    let numbers = ring.heights() * 3;
    let mut values = vec![0f32; ring.directions * numbers];
    for (direction, to) in values.chunks_exact_mut(numbers).enumerate() {
        let from = &batches[direction / LANES][start..];
        to.iter_mut().zip(from).for_each(|(to, lanes)| *to = lanes[direction % LANES]);
    }
    values
}

/// Turns a ring's samples of F into spline coefficients of H.
fn filled(ring: &RingPlan, mut values: Vec<f32>, knee: f64) -> FilledRing {
    let (heights, numbers) = (ring.heights(), 3 * ring.heights());
    let samples = ring.samples();
    let total = |height: usize| -> f64 {
        values.chunks_exact(numbers).flat_map(|v| &v[3 * height..3 * height + 3]).map(|v| f64::from(v.abs())).sum()
    };
    let knee_squared = knee * knee;
    // F ∝ (w² + zero²)/(w² + knee²) at the first sample and near the knee gives zero². The factor 3 overestimates the
    // part of the first sample that falls as w²: up to the knee this law changes by less.
    let near_knee = samples.partition_point(|w| *w < knee).min(heights - 1);
    let fall = total(0) / total(near_knee).max(f64::MIN_POSITIVE);
    let zero_squared = (samples[near_knee].powi(2) * fall - 3.0 * samples[0] * samples[0]).clamp(0.0, knee_squared);
    for value in values.chunks_exact_mut(numbers) {
        for (sample, w) in value.chunks_exact_mut(3).zip(&samples) {
            let scale = ((w * w + knee_squared) / (w * w + zero_squared)) as f32;
            sample.iter_mut().for_each(|channel| *channel *= scale);
        }
    }
    let inverse = interpolation_inverse(ring);
    let mut columns = vec![0f32; numbers];
    for value in values.chunks_exact_mut(numbers) {
        for (weights, column) in inverse.chunks_exact(heights).zip(columns.chunks_exact_mut(3)) {
            let mut sums = [0f32; 3];
            for (weight, sample) in weights.iter().zip(value.chunks_exact(3)) {
                sums.iter_mut().zip(sample).for_each(|(sum, sample)| *sum += weight * sample);
            }
            column.copy_from_slice(&sums);
        }
        value.copy_from_slice(&columns);
    }
    prefilter_around(&mut values, numbers);
    FilledRing { knee_squared, zero_squared, coefficients: values }
}

/// The matrix from samples at [`RingPlan::samples`] to the coefficients of the cubic B-spline through them, row-major.
fn interpolation_inverse(ring: &RingPlan) -> Vec<f32> {
    let n = ring.heights();
    let samples = ring.samples();
    let basis = DMatrix::from_fn(n, n, |sample, coefficient| {
        let y = ring.knot_position(samples[sample]);
        cubic_b_spline(y - (coefficient as f64 - 1.0))
    });
    // Schoenberg and Whitney: each basis function has a sample of its own, so the inverse exists.
    let inverse = basis.try_inverse().unwrap_or_else(|| DMatrix::identity(n, n));
    (0..n * n).map(|i| inverse[(i / n, i % n)] as f32).collect()
}

/// Replaces samples around a ring, rows of `numbers`, by the coefficients of the periodic cubic B-spline through them.
fn prefilter_around(values: &mut [f32], numbers: usize) {
    let n = values.len() / numbers;
    let start_up = START_UP.min(n);
    let mut state = vec![0f32; numbers];
    for row in values.chunks_exact(numbers).skip(n - start_up) {
        state.iter_mut().zip(row).for_each(|(state, value)| *state = value + POLE * *state);
    }
    for row in values.chunks_exact_mut(numbers) {
        for (state, value) in state.iter_mut().zip(row) {
            *state = *value + POLE * *state;
            *value = *state;
        }
    }
    // The anticausal pass starts from its state after one turn, like the causal one.
    state.fill(0.0);
    for row in values.chunks_exact(numbers).take(start_up).rev() {
        state.iter_mut().zip(row).for_each(|(state, value)| *state = POLE * (*state - value));
    }
    for row in values.chunks_exact_mut(numbers).rev() {
        for (state, value) in state.iter_mut().zip(row) {
            *state = POLE * (*state - *value);
            *value = 6.0 * *state;
        }
    }
}

/// Packs the coefficients and the rings' records.
fn assemble(
    plan: &Rings,
    filled: Vec<FilledRing>,
    coherence_length_um: f64,
    sigma: f64,
    start: Instant,
) -> ColourTable {
    let largest = filled
        .par_iter()
        .map(|ring| ring.coefficients.iter().fold(0f32, |a, b| a.max(b.abs())))
        .reduce(|| 0.0, f32::max);
    let exponent_offset = exponent_offset(largest);
    let count = plan.rings.len();
    let mut words = Vec::with_capacity(plan.words() + Ring::WORDS * count + 4);
    let mut rings = Vec::with_capacity(count);
    for (ring, filled) in plan.rings.iter().zip(filled) {
        rings.push(Ring {
            offset: words.len() as u32,
            directions: ring.directions as u32,
            heights: ring.heights() as u32,
            knots_per_w: ring.knots_per_w as f32,
            knots_per_efold: ring.knots_per_efold as f32,
            knee_squared: filled.knee_squared as f32,
            zero_squared: filled.zero_squared as f32,
        });
        words.extend(filled.coefficients.chunks_exact(3).map(|c| pack([c[0], c[1], c[2]], exponent_offset)));
    }
    // Padded to packets of four words.
    words.resize(words.len().next_multiple_of(4), 0);
    let layout = ColourLayout {
        knee_radius: plan.knee_radius as f32,
        growth: plan.growth as f32,
        w_log: W_LOG as f32,
        exponent_offset,
        last_ring: count as u32 - 1,
        rings_at: words.len() as u32 / 4,
    };
    words.extend(rings.iter().flat_map(Ring::words));
    let report = ColourTableReport {
        bytes: 4 * words.len(),
        rings: count,
        directions: plan.rings.iter().map(|ring| ring.directions).max().unwrap_or(0),
        coherence_length_um,
        order_sigma_per_um: sigma,
        spectral_error: 0.0,
        build_seconds: start.elapsed().as_secs_f64(),
    };
    ColourTable { layout, words, report }
}
