//! Time per colour of the methods' shaders on the GPU.
//!
//! A query is a pair of directions, and a run answers an array of queries. As on the CPU (timing.rs), each repetition
//! times the baseline, the first candidate with a shader, and then the candidate.

use super::candidate::{Candidate, Evaluator};
use super::{Effort, Timing};
use crate::benchmarks::{BenchError, DirectionPair};
use sunbeam::methods::Method;
use sunbeam::scattering::Options;
use sunbeam_realtime::{Gpu, GpuError, Optics, Query, Shader};

/// Number of queries of the first run, from which the speed of a shader is estimated. Chosen small for slow adapters.
const FIRST_QUERIES: usize = 128;
/// Largest number of queries of a repetition. Chosen: enough to fill any GPU.
const QUERIES_MAX: usize = 1 << 20;
/// Largest ratio of consecutive estimates of the number of queries. Chosen: short runs are mostly start-up time.
const GROWTH_MAX: f64 = 16.0;

/// A shader, with enough queries to fill a repetition.
struct TimedShader {
    shader: Shader,
    queries: Vec<Query>,
}

impl TimedShader {
    /// Compiles a method's shader and raises the number of queries until a run takes [`Effort::repetition_ms`].
    fn new(gpu: &Gpu, method: &dyn Method, optics: &Optics, all: &[Query], effort: &Effort) -> Result<Self, GpuError> {
        let shader = Shader::new(gpu, method, optics)?;
        let mut queries: Vec<Query> = all.iter().cycle().take(FIRST_QUERIES).copied().collect();
        loop {
            let spent = shader.evaluate(gpu, &queries)?.gpu_ms;
            let wanted = queries.len() as f64 * (effort.repetition_ms / spent.max(1e-3)).clamp(1.0, GROWTH_MAX);
            if queries.len() >= QUERIES_MAX || wanted < 1.5 * queries.len() as f64 {
                return Ok(Self { shader, queries });
            }
            queries = all.iter().cycle().take((wanted as usize).min(QUERIES_MAX)).copied().collect();
        }
    }

    /// Time per query in µs.
    fn microseconds(&self, gpu: &Gpu) -> Result<f64, GpuError> {
        Ok(1e3 * self.shader.evaluate(gpu, &self.queries)?.gpu_ms / self.queries.len() as f64)
    }
}

/// Times the candidates that have a shader, in turn with the first candidate; `None` for the others.
///
/// Only two candidates' data are on the GPU at once: all of them would fill its memory.
pub(super) fn times(
    candidates: &[Candidate],
    pairs: &[DirectionPair],
    options: &Options,
    effort: &Effort,
    gpu: &Gpu,
) -> Result<Vec<Option<Timing>>, BenchError> {
    let queries: Vec<Query> = pairs.iter().map(DirectionPair::single).map(|[wi, wo]| Query::new(wi, wo)).collect();
    let optics = Optics { index: None, obliquity: options.obliquity, shadowing: options.shadowing };
    let mut first: Option<TimedShader> = None;
    let mut timings = Vec::new();
    for candidate in candidates {
        let Evaluator::Colour(method) = &candidate.evaluator else {
            timings.push(None);
            continue;
        };
        let shader = TimedShader::new(gpu, &**method, &optics, &queries, effort)?;
        let reference = first.as_ref().unwrap_or(&shader);
        let (mut times, mut reference_times) = (Vec::new(), Vec::new());
        for _ in 0..effort.repetitions {
            reference_times.push(reference.microseconds(gpu)?);
            times.push(shader.microseconds(gpu)?);
        }
        timings.push(Some(Timing::new(&times, &reference_times)));
        first.get_or_insert(shader);
    }
    Ok(timings)
}
