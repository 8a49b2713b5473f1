//! Time against error of every method and parameter set on one surface.
//!
//! Colours are those of `f_r` without the Fresnel reflectance. The published methods are held against the oracle of a
//! single window in a fixed place, the tables against that of the model they were made for. All candidates of a surface
//! are alive at once and timed in turn, so that what else the machine does falls on all of them.

mod candidates;
mod errors;
mod front;
mod on_gpu;
mod timing;

pub use errors::Errors;
pub use front::{FRONT_MARGIN, front, noticed};
pub use timing::Timing;

use super::{BenchError, Truth, TruthCheck, directions};
use candidates::Candidate;
use serde::Serialize;
use serde_json::{Map, Value};
use sunbeam::height_field::HeightField;
use sunbeam::lobe::Surface;
use sunbeam::scattering::Options;
use sunbeam::table::Model;

/// Deviation of the oracle over spectra from the direct sum that is taken for rounding.
const ORACLE_LIMIT: f64 = 1e-9;

/// How much is measured.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Effort {
    /// Pairs of directions at which errors are taken.
    pub directions: usize,
    /// Wavelength step of the oracle's integral in nm.
    pub truth_step_nm: f64,
    /// Pairs of directions among which methods are timed.
    pub timed_directions: usize,
    /// Repetitions of each timing.
    pub repetitions: usize,
    /// Milliseconds that one repetition of one candidate aims at.
    pub repetition_ms: f64,
    /// Whether only a few parameter sets are tried.
    pub few: bool,
}

impl Effort {
    /// What the documentation's figures are made with.
    pub const FULL: Self = Self {
        directions: 1024,
        truth_step_nm: 0.5,
        timed_directions: 8192,
        repetitions: 5,
        repetition_ms: 25.0,
        few: false,
    };
    /// A look in seconds.
    pub const QUICK: Self = Self {
        directions: 128,
        truth_step_nm: 2.5,
        timed_directions: 512,
        repetitions: 3,
        repetition_ms: 2.0,
        few: true,
    };
}

/// What was measured on one surface.
#[derive(Clone, Debug, Serialize)]
pub struct SurfaceFigures {
    /// Pixels along x and y.
    pub pixels: [usize; 2],
    pub extent_um: [f64; 2],
    /// Phase rate times half the range of heights at 380 nm along the normal.
    pub kappa_h: f64,
    pub coherence_length_um: f64,
    /// How far the oracle over spectra is from the direct sum.
    pub oracle: TruthCheck,
    pub entries: Vec<Entry>,
}

/// One method with one set of parameters.
#[derive(Clone, Debug, Serialize)]
pub struct Entry {
    /// `flss`, `nmm`, `pq`, `stam`, `colour-table` or `spectral-table`.
    pub method: &'static str,
    pub model: Model,
    /// What tells it from the others of its method.
    pub parameters: Map<String, Value>,
    /// Whether these are the parameters that the library takes unless told otherwise.
    pub is_default: bool,
    /// Bytes of its data.
    pub bytes: u64,
    pub build_seconds: f64,
    pub cpu: Timing,
    /// Absent where there is no adapter, or the method has no twin there.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub gpu: Option<Timing>,
    pub errors: Errors,
    /// Whether no other entry of the surface is faster on the CPU and as good in the mean of ΔE and in its 99th percentile
    /// (see [`front()`]), those of its own method with the other model left out.
    pub on_front: bool,
    /// The same among the entries of its own method and model, and as good in its spectrum where it has one.
    pub on_front_of_method: bool,
}

/// Where methods run besides the CPU.
pub type Adapter = sunbeam_realtime::Gpu;
/// Measures everything on `field`, a tile that repeats. Of `options`, the coherence length, the tolerance, the obliquity
/// and the shadowing are heeded. `progress` is told what is being done.
///
/// # Errors
/// A method that cannot be made, or an oracle that is off.
pub fn measure(
    field: &HeightField,
    options: &Options,
    effort: &Effort,
    adapter: Option<&Adapter>,
    progress: &mut dyn FnMut(&str),
) -> Result<SurfaceFigures, BenchError> {
    let options = Options { conserve_energy: false, tiling: sunbeam::table::Tiling::Periodic, ..options.clone() };
    progress("sampler");
    let sampler = Surface::new(field, &Options { model: Model::Ensemble, ..options.clone() })?;
    let timed = directions(&sampler, effort.timed_directions.max(effort.directions));
    let judged = &timed[..effort.directions];
    progress("oracle");
    let places: Vec<[f64; 3]> = judged.iter().map(|pair| pair.sum().map(f64::from)).collect();
    let truth = Truth::new(field, options.coherence_length_um, &places, effort.truth_step_nm);
    let oracle = truth.check(field, 12);
    if oracle.largest.is_nan() || oracle.largest > ORACLE_LIMIT {
        return Err(BenchError::Oracle { found: oracle.largest, limit: ORACLE_LIMIT });
    }
    let candidates = candidates::candidates(field, &options, effort.few, progress)?;
    progress("errors");
    let references = errors::References::new(&truth, judged, &options)?;
    let errors: Vec<Errors> = candidates.iter().map(|candidate| references.errors(candidate)).collect();
    progress("times on the CPU");
    let cpu = timing::on_cpu(&candidates, &timed, effort);
    let gpu = on_gpu(&candidates, &timed, &options, effort, adapter, progress)?;
    let (low, high) = field.range_um();
    let ((nx, ny), (lx, ly)) = (field.size(), field.extent_um());
    let mut entries: Vec<Entry> = candidates
        .into_iter()
        .zip(errors)
        .zip(cpu.into_iter().zip(gpu))
        .map(|((candidate, errors), (cpu, gpu))| candidate.entry(errors, cpu, gpu))
        .collect();
    mark_fronts(&mut entries);
    Ok(SurfaceFigures {
        pixels: [nx, ny],
        extent_um: [lx, ly],
        kappa_h: 2.0 * std::f64::consts::PI * (high - low) / 0.38,
        coherence_length_um: options.coherence_length_um,
        oracle,
        entries,
    })
}

fn on_gpu(
    candidates: &[Candidate],
    timed: &[super::DirectionPair],
    options: &Options,
    effort: &Effort,
    adapter: Option<&Adapter>,
    progress: &mut dyn FnMut(&str),
) -> Result<Vec<Option<Timing>>, BenchError> {
    let Some(gpu) = adapter else { return Ok(vec![None; candidates.len()]) };
    progress("times on the GPU");
    on_gpu::times(candidates, timed, options, effort, gpu)
}

fn mark_fronts(entries: &mut [Entry]) {
    let colours =
        |entry: &Entry| (entry.cpu.microseconds, [entry.errors.delta_e_mean, entry.errors.delta_e_p99].map(noticed));
    let point = |entry: &Entry| {
        let (time, [mean, p99]) = colours(entry);
        (time, [mean, p99, entry.errors.spectral_rmse.unwrap_or(0.0)])
    };
    let marks: Vec<(bool, bool)> = entries
        .iter()
        .enumerate()
        .map(|(i, entry)| {
            // Which of a method's two models is taken is a question of what is to be shown, not of speed.
            let comparable = |other: &&Entry| other.method != entry.method || other.model == entry.model;
            let kin = |other: &&Entry| other.method == entry.method && other.model == entry.model;
            let all: Vec<_> = entries.iter().filter(comparable).map(colours).collect();
            let own: Vec<_> = entries.iter().filter(kin).map(point).collect();
            let [in_all, in_own] =
                [entries[..i].iter().filter(comparable).count(), entries[..i].iter().filter(kin).count()];
            (front(&all)[in_all], front(&own)[in_own])
        })
        .collect();
    for (entry, mark) in entries.iter_mut().zip(marks) {
        (entry.on_front, entry.on_front_of_method) = mark;
    }
}
