use super::candidates::{Candidate, Evaluator};
use super::{Effort, Timing};
use crate::benchmarks::{BenchError, DirectionPair};
use sunbeam::methods::Method;
use sunbeam::scattering::Options;
use sunbeam_realtime::{Gpu, GpuError, Optics, Query, Shader};

/// Queries of the first look at a shader's speed.
const FIRST_QUERIES: usize = 128;
/// Most queries of a repetition: enough to fill any GPU.
const QUERIES_MAX: usize = 1 << 20;

/// A shader and how many queries fill a repetition.
struct Timed {
    shader: Shader,
    queries: Vec<Query>,
}

impl Timed {
    fn new(gpu: &Gpu, method: &dyn Method, optics: &Optics, all: &[Query], effort: &Effort) -> Result<Self, GpuError> {
        let shader = Shader::new(gpu, method, optics)?;
        let mut queries: Vec<Query> = all.iter().cycle().take(FIRST_QUERIES).copied().collect();
        loop {
            let spent = shader.evaluate(gpu, &queries)?.gpu_ms;
            let wanted = queries.len() as f64 * (effort.repetition_ms / spent.max(1e-3)).clamp(1.0, 16.0);
            if queries.len() >= QUERIES_MAX || wanted < 1.5 * queries.len() as f64 {
                return Ok(Self { shader, queries });
            }
            queries = all.iter().cycle().take((wanted as usize).min(QUERIES_MAX)).copied().collect();
        }
    }

    /// µs per query.
    fn time(&self, gpu: &Gpu) -> Result<f64, GpuError> {
        Ok(1e3 * self.shader.evaluate(gpu, &self.queries)?.gpu_ms / self.queries.len() as f64)
    }
}

/// Times of the methods that have a twin on the GPU, each in turn with the first candidate: all of them at once would fill its
/// memory.
pub(super) fn times(
    candidates: &[Candidate],
    pairs: &[DirectionPair],
    options: &Options,
    effort: &Effort,
    gpu: &Gpu,
) -> Result<Vec<Option<Timing>>, BenchError> {
    let single = |direction: [f64; 3]| direction.map(|c| c as f32);
    let queries: Vec<Query> = pairs.iter().map(|pair| Query::new(single(pair.wi), single(pair.wo))).collect();
    let optics = Optics { index: None, obliquity: options.obliquity, shadowing: options.shadowing };
    let mut first: Option<Timed> = None;
    let mut timings = Vec::new();
    for candidate in candidates {
        let Evaluator::Colour(method) = &candidate.evaluator else {
            timings.push(None);
            continue;
        };
        let own = Timed::new(gpu, &**method, &optics, &queries, effort)?;
        let reference = first.as_ref().unwrap_or(&own);
        let (mut times, mut beside) = (Vec::new(), Vec::new());
        for _ in 0..effort.repetitions {
            beside.push(reference.time(gpu)?);
            times.push(own.time(gpu)?);
        }
        timings.push(Some(Timing::new(&times, &beside)));
        first.get_or_insert(own);
    }
    Ok(timings)
}
