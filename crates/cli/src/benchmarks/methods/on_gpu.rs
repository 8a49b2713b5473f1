//! Time per colour of the methods' shaders on the GPU.
//!
//! A candidate is a method with one set of parameters (candidate.rs). A query is a pair of directions, and a run
//! answers an array of queries. The baseline is the first candidate with a shader. Each repetition times the baseline,
//! and then the candidate.

use super::candidate::{Candidate, Evaluator};
use super::{Effort, Timing};
use crate::benchmarks::{BenchError, DirectionPair};
use sunbeam::methods::Method;
use sunbeam::scattering::Options;
use sunbeam_realtime::{Gpu, GpuError, Optics, Query, Shader};

/// Number of queries of the first run, from which the speed of a shader is estimated. It is small, so that the run is
/// short on slow adapters, too.
const FIRST_QUERIES: usize = 128;
/// Largest number of queries of a run: enough to fill any GPU. More would only take memory.
const QUERIES_MAX: usize = 1 << 20;
/// Largest factor between the numbers of queries of consecutive runs. Short runs are mostly start-up time, so estimates
/// from them are unreliable: a larger factor may overshoot, a smaller one needs more runs.
const GROWTH_MAX: f64 = 16.0;
/// Smallest factor on the number of queries for which a longer run is tried. Smaller values come nearer to
/// [`Effort::repetition_ms`], with more runs.
const GROWTH_MIN: f64 = 1.5;
/// Shortest time in ms by which the estimate divides: a coarse clock may not advance during a short run.
const TIME_MIN_MS: f64 = 1e-3;

/// A shader with the queries of a timed run.
struct TimedShader {
    shader: Shader,
    queries: Vec<Query>,
}

impl TimedShader {
    /// Compiles a method's shader. Increases the number of queries until a run takes two thirds (1/[`GROWTH_MIN`]) of
    /// [`Effort::repetition_ms`] or has [`QUERIES_MAX`]. The queries repeat those of `all`, which has at least one.
    fn new(gpu: &Gpu, method: &dyn Method, optics: &Optics, all: &[Query], effort: &Effort) -> Result<Self, GpuError> {
        let shader = Shader::new(gpu, method, optics)?;
        let repeated = |count: usize| -> Vec<Query> { all.iter().cycle().take(count).copied().collect() };
        let mut queries = repeated(FIRST_QUERIES);
        loop {
            let spent_ms = shader.evaluate(gpu, &queries)?.gpu_ms;
            let growth = (effort.repetition_ms / spent_ms.max(TIME_MIN_MS)).min(GROWTH_MAX);
            if queries.len() >= QUERIES_MAX || growth < GROWTH_MIN {
                return Ok(Self { shader, queries });
            }
            queries = repeated(((growth * queries.len() as f64) as usize).min(QUERIES_MAX));
        }
    }

    /// Time per query in µs.
    fn microseconds(&self, gpu: &Gpu) -> Result<f64, GpuError> {
        Ok(1e3 * self.shader.evaluate(gpu, &self.queries)?.gpu_ms / self.queries.len() as f64)
    }
}

/// Times the candidates that have a shader, each in turn with the baseline. The result has an element for each
/// candidate, `None` for those without a shader.
///
/// Only the data of the baseline and of one candidate are on the GPU at a time: all of them would fill its memory.
///
/// # Errors
/// A shader or data that the GPU refuses.
pub(super) fn times(
    candidates: &[Candidate],
    pairs: &[DirectionPair],
    options: &Options,
    effort: &Effort,
    gpu: &Gpu,
) -> Result<Vec<Option<Timing>>, BenchError> {
    let queries: Vec<Query> = pairs.iter().map(DirectionPair::single).map(|[wi, wo]| Query::new(wi, wo)).collect();
    // Without an index, that of a perfect conductor, colours have no Fresnel factor.
    let optics = Optics { index: None, cover: None, obliquity: options.obliquity, shadowing: options.shadowing };
    let mut first_shader: Option<TimedShader> = None;
    let mut timings = Vec::new();
    for candidate in candidates {
        let Evaluator::Colour(method) = &candidate.evaluator else {
            timings.push(None);
            continue;
        };
        let shader = TimedShader::new(gpu, &**method, &optics, &queries, effort)?;
        // The first shader, the baseline, is compared with itself.
        let baseline = first_shader.as_ref().unwrap_or(&shader);
        let (mut times_us, mut baseline_us) = (Vec::new(), Vec::new());
        for _ in 0..effort.repetitions {
            baseline_us.push(baseline.microseconds(gpu)?);
            times_us.push(shader.microseconds(gpu)?);
        }
        timings.push(Some(Timing::new(&times_us, &baseline_us)));
        first_shader.get_or_insert(shader);
    }
    Ok(timings)
}
