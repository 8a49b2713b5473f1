//! Time against error of every method and parameter set on one surface.
//!
//! A *candidate* is a method with one set of parameters (candidate.rs). It becomes an [`Entry`] of the report. Colours
//! are those of the reflectance `f_r` in 1/sr without the Fresnel factor. A ΔE₂₀₀₀ is the difference of two colours by
//! CIEDE2000; 1 is just noticeable.
//!
//! The *reference* spectra ([`Truth`]) are exact to rounding. They are checked against the *oracle*, the direct
//! double-precision sum, which is too slow for all of them. The published methods (docs/realtime.md) are compared with
//! the reference of the patch model, one fixed coherence window. Tables are compared with the reference of their own
//! model: patch, or ensemble, the mean over all positions of the window.
//!
//! κ = 2π·(cosθi + cosθo)/λ is the phase rate of a pair of directions, and H half the range of the heights.
//!
//! All candidates of a surface are in memory at once. Each repetition times all of them one after another, so that
//! other processes on the machine slow them down alike.

mod candidate;
mod candidates;
mod errors;
mod on_gpu;
mod pareto;
mod timing;

pub(crate) use errors::Errors;
pub(crate) use pareto::{Cost, clamp_delta_e};
pub(crate) use timing::Timing;

use super::{BenchError, Truth, TruthCheck, direction_pairs};
use crate::arguments::SHORTEST_VISIBLE_UM;
use serde::Serialize;
use serde_json::{Map, Value};
use std::f64::consts::PI;
use sunbeam::height_field::HeightField;
use sunbeam::lobe::Surface;
use sunbeam::scattering::Options;
use sunbeam::table::{Model, Tiling};
use sunbeam_realtime::Gpu;

/// Largest accepted deviation of [`Truth`] from the oracle, on the scale of [`TruthCheck::largest`]. Rounding of
/// double-precision sums causes less.
const ORACLE_LIMIT: f64 = 1e-9;
/// Number of pairs of directions and wavelengths at which [`Truth`] is compared with the oracle. Each oracle value is
/// a sum over the tile, so larger numbers take longer; smaller ones may miss a defect.
const ORACLE_CHECKS: usize = 12;

/// The size of a run. Larger numbers, and a smaller step, give steadier figures and take longer.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub(crate) struct Effort {
    /// Pairs of directions over which errors are computed.
    pub(crate) directions: usize,
    /// Step between wavelengths of the reference in nm. 5 nm, the step at which spectra are compared, is a whole
    /// multiple.
    pub(crate) truth_step_nm: f64,
    /// Pairs of directions over which methods are timed. Errors are computed over the first `directions` of them.
    pub(crate) timed_directions: usize,
    /// Repetitions of each timing.
    pub(crate) repetitions: usize,
    /// Intended length of one repetition of one candidate, in ms.
    pub(crate) repetition_ms: f64,
    /// Whether each method is measured with only a few of its parameter sets.
    pub(crate) few: bool,
}

impl Effort {
    /// The run behind the figures of the documentation: minutes.
    pub(crate) const FULL: Self = Self {
        directions: 1024,
        truth_step_nm: 0.5,
        timed_directions: 8192,
        repetitions: 5,
        repetition_ms: 25.0,
        few: false,
    };
    /// A run of seconds.
    pub(crate) const QUICK: Self = Self {
        directions: 128,
        truth_step_nm: 2.5,
        timed_directions: 512,
        repetitions: 3,
        repetition_ms: 2.0,
        few: true,
    };
}

/// The measurements on one surface.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct SurfaceFigures {
    /// Pixels along x and y.
    pub(crate) pixels: [usize; 2],
    /// Width and height of the tile in µm.
    pub(crate) extent_um: [f64; 2],
    /// Largest κH: at 380 nm, with both directions along the normal.
    pub(crate) kappa_h: f64,
    /// Coherence length in µm.
    pub(crate) coherence_length_um: f64,
    /// Deviation of the reference spectra from the oracle.
    pub(crate) oracle: TruthCheck,
    /// One entry for each candidate.
    pub(crate) entries: Vec<Entry>,
}

/// One method with one set of parameters.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct Entry {
    /// `flss`, `nmm`, `pq`, `stam`, `colour-table` or `spectral-table`.
    pub(crate) method: &'static str,
    /// The coherence model of the method, and of the reference with which it is compared.
    pub(crate) model: Model,
    /// Values of the parameters by name.
    pub(crate) parameters: Map<String, Value>,
    /// Whether the parameters are the library's defaults, with the tolerance of the surface.
    pub(crate) is_default: bool,
    /// Size in bytes of the data that the method looks up.
    pub(crate) bytes: u64,
    /// Seconds to compute the data.
    pub(crate) build_seconds: f64,
    /// Time per colour on one core.
    pub(crate) cpu: Timing,
    /// Time per colour on the GPU; absent without an adapter, and for methods without a shader.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) gpu: Option<Timing>,
    /// Errors against the reference.
    pub(crate) errors: Errors,
    /// Whether the entry is on the Pareto front (pareto.rs) of the time on the CPU, the mean of ΔE₂₀₀₀ and its 99th
    /// percentile: no other entry is as good in all three and better in one. Errors too small to be seen count as equal
    /// (`clamp_delta_e`). Entries of this method with the other model do not count.
    pub(crate) on_front: bool,
    /// Whether the entry is on the Pareto front of the entries with this method and model. The error of the spectrum
    /// counts as a fourth coordinate.
    pub(crate) on_front_of_method: bool,
}

/// Measures every candidate on `field`, a periodic tile.
///
/// Each candidate has its own model. The other options are those of `options`, except that the tiling is periodic and
/// energy conservation is off. `progress` receives the name of each stage when it begins. Without a GPU there are no
/// GPU times.
///
/// # Errors
/// A method that cannot be built or that the GPU refuses, or reference spectra that deviate from the oracle.
pub(crate) fn measure(
    field: &HeightField,
    options: &Options,
    effort: &Effort,
    gpu: Option<&Gpu>,
    progress: &mut dyn FnMut(&str),
) -> Result<SurfaceFigures, BenchError> {
    let options = Options { conserve_energy: false, tiling: Tiling::Periodic, ..options.clone() };
    progress("sampler");
    // Both models share the directions. The ensemble's power is the mean of the patch's over all positions of the
    // window, so its sampler covers every direction that a patch can light. A patch's own sampler would leave out
    // directions in which the orders of its one position cancel.
    let sampled_surface = Surface::new(field, &Options { model: Model::Ensemble, ..options.clone() })?;
    let timed = direction_pairs(&sampled_surface, effort.timed_directions);
    let compared = &timed[..effort.directions];
    progress("oracle");
    // Scattering vectors wi + wo.
    let sums: Vec<[f64; 3]> = compared.iter().map(|pair| pair.sum().map(f64::from)).collect();
    let truth = Truth::new(field, options.coherence_length_um, &sums, effort.truth_step_nm);
    let oracle = truth.check(field, ORACLE_CHECKS);
    if oracle.largest.is_nan() || oracle.largest > ORACLE_LIMIT {
        return Err(BenchError::Oracle { found: oracle.largest, limit: ORACLE_LIMIT });
    }
    let candidates = candidates::build_all(field, &options, effort.few, progress)?;
    progress("errors");
    let references = errors::References::new(&truth, compared, &options)?;
    let errors: Vec<Errors> = candidates.iter().map(|candidate| references.errors(candidate)).collect();
    progress("times on the CPU");
    let cpu_timings = timing::on_cpu(&candidates, &timed, effort);
    let gpu_timings = match gpu {
        Some(gpu) => {
            progress("times on the GPU");
            on_gpu::times(&candidates, &timed, &options, effort, gpu)?
        }
        None => vec![None; candidates.len()],
    };
    let mut entries: Vec<Entry> = candidates
        .into_iter()
        .zip(errors)
        .zip(cpu_timings.into_iter().zip(gpu_timings))
        .map(|((candidate, errors), (cpu, gpu))| candidate.into_entry(errors, cpu, gpu))
        .collect();
    mark_fronts(&mut entries);
    let (low, high) = field.range_um();
    Ok(SurfaceFigures {
        pixels: field.size().into(),
        extent_um: field.extent_um().into(),
        // κ = 4π/λ along the normal, times H = (high − low)/2.
        kappa_h: 2.0 * PI * (high - low) / SHORTEST_VISIBLE_UM,
        coherence_length_um: options.coherence_length_um,
        oracle,
        entries,
    })
}

/// Sets [`Entry::on_front`] and [`Entry::on_front_of_method`].
fn mark_fronts(entries: &mut [Entry]) {
    let delta_e = |entry: &Entry| [entry.errors.delta_e_mean, entry.errors.delta_e_p99].map(clamp_delta_e);
    let colour_cost = |entry: &Entry| Cost::new(entry.cpu.microseconds, delta_e(entry));
    let spectral_cost = |entry: &Entry| {
        let [mean, p99] = delta_e(entry);
        // Either all entries of a method have spectra, or none has. Without spectra, 0 makes their errors equal.
        Cost::new(entry.cpu.microseconds, [mean, p99, entry.errors.spectral_rmse.unwrap_or(0.0)])
    };
    let marks: Vec<(bool, bool)> = entries
        .iter()
        .map(|entry| {
            // The models patch and ensemble of a method differ in appearance, so one does not replace the other.
            let rivals = entries.iter().filter(|other| other.method != entry.method || other.model == entry.model);
            let same_method = entries.iter().filter(|other| other.method == entry.method && other.model == entry.model);
            let on_front = colour_cost(entry).is_on_front(rivals.map(colour_cost));
            (on_front, spectral_cost(entry).is_on_front(same_method.map(spectral_cost)))
        })
        .collect();
    for (entry, mark) in entries.iter_mut().zip(marks) {
        (entry.on_front, entry.on_front_of_method) = mark;
    }
}
