//! A method on the GPU: answers arrays of queries in submissions of bounded time.
//!
//! `shade.wgsl` computes `f_r` for the queries (layout.rs) whose indices are listed in a buffer `chosen`. A submission
//! processes a range of this list. [`Shader`] keeps two numbers that it adapts from submission to submission:
//!
//! - the number of queries, so that a submission takes about [`SUBMISSION_MS`];
//! - the number of parts of an answer (src/methods/common.wgsl), which doubles when the adapter ends long loops early.

use super::clock::Clock;
use super::layout::{Optics, OpticsUniform, Query, RangeUniform};
use super::pipeline::{self, Access, WORKGROUPS_MAX};
use super::{Gpu, GpuError, program};
use bytemuck::Zeroable;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering::Relaxed};
use sunbeam::methods::{AnswerKind, Method, MethodShader};
use sunbeam::scattering::map_direction;

/// Intended time of a submission in ms. Chosen: drivers reset a GPU that does not answer for a second or two, and a
/// window on the same GPU should not stutter.
const SUBMISSION_MS: f64 = 250.0;
/// Number of queries of the first submission, before the speed is known. Chosen small.
const FIRST_QUERIES: u32 = 1024;
/// Largest ratio of the numbers of queries of consecutive submissions. Chosen: start-up time dominates small
/// submissions, so the speed measured from them is too low.
const GROWTH: u32 = 8;
/// Invocations of a workgroup in `shade.wgsl`.
const WORKGROUP: u32 = 64;
/// Largest number of parts of an answer. Chosen; a method that needs more is refused with [`GpuError::CutShort`].
const PARTS_MAX: u32 = 4096;
/// Largest number of queries that [`Shader::evaluate_async`] holds on the GPU at a time. Chosen to bound the memory.
const BATCH: usize = 1 << 20;

/// Bindings of `shade.wgsl`: range, optics, queries, chosen, reflectances, cut_short.
const OWN_GROUP: [Access; 6] =
    [Access::Uniform, Access::Uniform, Access::Read, Access::Read, Access::Write, Access::Write];

/// A method on the GPU with the optics around it. It answers arrays of queries.
pub struct Shader {
    pipeline: wgpu::ComputePipeline,
    /// Group 1 of the bindings: the method's uniform and data.
    method: wgpu::BindGroup,
    /// The method's uniform struct.
    parameters: wgpu::Buffer,
    /// The uniform struct [`OpticsUniform`].
    optics: wgpu::Buffer,
    answers: AnswerKind,
    /// The uniform struct [`RangeUniform`] of the present submission.
    range: wgpu::Buffer,
    /// Bytes of the method's data.
    bytes: u64,
    /// Number of answers of the present submission whose loops the adapter ended early.
    cut_short: wgpu::Buffer,
    /// Number of queries of the next submission.
    queries: AtomicU32,
    /// Number of parts of an answer.
    parts: AtomicU32,
    /// Whether the work is to be stopped; set by another thread.
    stop: Arc<AtomicBool>,
}

/// The answers of [`Shader::evaluate_async`].
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Answers {
    /// `f_r` of each query, linear sRGB in 1/sr.
    pub reflectances: Vec<[f32; 3]>,
    /// Time of the GPU in ms; see [`Gpu::has_timestamps`].
    pub gpu_ms: f64,
    /// Number of submissions.
    pub submissions: u32,
}

/// Time in ms and number of submissions of a run.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Spent {
    pub gpu_ms: f64,
    pub submissions: u32,
}

impl Shader {
    /// Compiles the method's WGSL and uploads its data.
    ///
    /// # Errors
    /// [`GpuError::TooLarge`] where the adapter cannot bind the data, [`GpuError::Refused`] where it refuses the WGSL.
    pub async fn new_async(gpu: &Gpu, method: &dyn Method, optics: &Optics) -> Result<Self, GpuError> {
        Self::of_async(gpu, &method.shader(), method.answers(), optics).await
    }

    /// [`Shader::new_async`] for the [`Method::shader`] and [`Method::answers`] of a method that was built elsewhere.
    ///
    /// # Errors
    /// The errors of [`Shader::new_async`].
    pub async fn of_async(
        gpu: &Gpu,
        shader: &MethodShader<'_>,
        answers: AnswerKind,
        optics: &Optics,
    ) -> Result<Self, GpuError> {
        let module = pipeline::module(gpu, shader.name, program::shade(shader));
        let mut accesses = vec![Access::Read; shader.storage.len() + 1];
        accesses[0] = Access::Uniform;
        let (own, methods) = (pipeline::layout(gpu, &OWN_GROUP), pipeline::layout(gpu, &accesses));
        let pipeline = pipeline::compute(gpu, &module, "shade", Some(&[Some(&own), Some(&methods)]))?;
        let parameters = gpu.uniform_of(shader.name, &shader.uniform)?;
        let storage = shader
            .storage
            .iter()
            .enumerate()
            .map(|(i, contents)| gpu.storage_of(&format!("data {i} of method {}", shader.name), contents))
            .collect::<Result<Vec<_>, _>>()?;
        let buffers: Vec<&wgpu::Buffer> = std::iter::once(&parameters).chain(&storage).collect();
        let method = pipeline::bind(gpu, &methods, &buffers);
        let range = gpu.uniform_of("range", bytemuck::bytes_of(&RangeUniform::zeroed()))?;
        let optics = gpu.uniform_of("optics", bytemuck::bytes_of(&OpticsUniform::new(optics, answers)))?;
        gpu.check()?;
        let bytes = buffers.iter().map(|buffer| buffer.size()).sum();
        let cut_short = gpu.storage("cut_short", size_of::<u32>() as u64)?;
        let (queries, parts) = (AtomicU32::new(FIRST_QUERIES), AtomicU32::new(1));
        let stop = Arc::default();
        let shader =
            Self { pipeline, method, parameters, optics, answers, range, bytes, cut_short, queries, parts, stop };
        // Drivers finish compiling at the first use, whose time says nothing about the method's speed.
        shader.evaluate_async(gpu, &[Query::default()]).await?;
        shader.queries.store(FIRST_QUERIES, Relaxed);
        Ok(shader)
    }

    /// Bytes of the method's data on the GPU.
    pub fn bytes(&self) -> u64 {
        self.bytes
    }

    /// Changes the optics of later answers.
    pub fn set_optics(&self, gpu: &Gpu, optics: &Optics) {
        let uniform = OpticsUniform::new(optics, self.answers);
        gpu.queue().write_buffer(&self.optics, 0, bytemuck::bytes_of(&uniform));
    }

    /// Registers a flag. When it is set, answers and pictures end with [`GpuError::Stopped`] after the present
    /// submission.
    pub fn stop_when(&mut self, flag: Arc<AtomicBool>) {
        self.stop = flag;
    }

    /// Changes the method's uniform to [`MethodShader::uniform`] of a method with the same storage.
    ///
    /// # Errors
    /// [`GpuError::Parameter`] for a uniform of another size.
    pub fn set_parameters(&self, gpu: &Gpu, uniform: &[u8]) -> Result<(), GpuError> {
        if uniform.len() as u64 != self.parameters.size() {
            let (found, accepted) = (format!("{} bytes", uniform.len()), "as long as the method's");
            return Err(GpuError::Parameter { parameter: "uniform", found, accepted });
        }
        gpu.queue().write_buffer(&self.parameters, 0, uniform);
        gpu.check()
    }

    /// Answers queries, of which only the directions matter. An answer is 0 unless both directions are finite and above
    /// the surface.
    ///
    /// # Errors
    /// [`GpuError::Refused`], [`GpuError::Lost`], [`GpuError::CutShort`].
    pub async fn evaluate_async(&self, gpu: &Gpu, queries: &[Query]) -> Result<Answers, GpuError> {
        let mut answers = Answers::default();
        for batch in queries.chunks(BATCH) {
            let all: Vec<u32> = (0..batch.len() as u32).collect();
            let queries = gpu.storage_of("queries", bytemuck::cast_slice(batch))?;
            let chosen = gpu.storage_of("chosen", bytemuck::cast_slice(&all))?;
            let bytes = size_of::<[f32; 4]>() as u64 * batch.len() as u64;
            let reflectances = gpu.storage("reflectances", bytes)?;
            let bindings = self.bind(gpu, &queries, &chosen, &reflectances);
            let spent = self.run(gpu, &bindings, batch.len() as u32).await?;
            answers.gpu_ms += spent.gpu_ms;
            answers.submissions += spent.submissions;
            let contents = gpu.read(&reflectances, bytes).await?;
            let colour = |bytes: &[u8]| bytemuck::pod_read_unaligned::<[f32; 3]>(&bytes[..12]);
            answers.reflectances.extend(contents.chunks_exact(16).map(colour));
        }
        Ok(answers)
    }

    /// Answers over the hemisphere for light from `wi`, in the layout of [`map_direction`] with `side` pixels along
    /// each side, rows from the top; `None` outside the disc.
    ///
    /// # Errors
    /// The errors of [`Shader::evaluate_async`].
    pub async fn brdf_map_async(
        &self,
        gpu: &Gpu,
        wi: [f32; 3],
        side: usize,
    ) -> Result<Vec<Option<[f32; 3]>>, GpuError> {
        let directions: Vec<_> = (0..side * side).map(|i| map_direction(i % side, i / side, side)).collect();
        let queries: Vec<Query> =
            directions.iter().flatten().map(|wo| Query::new(wi, wo.map(|component| component as f32))).collect();
        let mut answers = self.evaluate_async(gpu, &queries).await?.reflectances.into_iter();
        Ok(directions.iter().map(|direction| direction.and_then(|_| answers.next())).collect())
    }

    /// The bind group of queries, chosen indices and reflectances.
    pub(super) fn bind(
        &self,
        gpu: &Gpu,
        queries: &wgpu::Buffer,
        chosen: &wgpu::Buffer,
        reflectances: &wgpu::Buffer,
    ) -> wgpu::BindGroup {
        let layout = self.pipeline.get_bind_group_layout(0);
        pipeline::bind(gpu, &layout, &[&self.range, &self.optics, queries, chosen, reflectances, &self.cut_short])
    }

    /// The uniform of the optics, which `resolve.wgsl` reads too, to weight the pigment.
    pub(super) fn optics(&self) -> &wgpu::Buffer {
        &self.optics
    }

    /// Answers the first `count` of the chosen queries, in submissions of about [`SUBMISSION_MS`].
    pub(super) async fn run(&self, gpu: &Gpu, bindings: &wgpu::BindGroup, count: u32) -> Result<Spent, GpuError> {
        let clock = Clock::new(gpu);
        let mut spent = Spent::default();
        let mut first = 0;
        while first < count {
            // Number of queries of this submission.
            let some = self.queries.load(Relaxed).min(count - first);
            let parts = self.parts.load(Relaxed);
            let mut longest_ms = 0.0f64;
            let mut cut_short = false;
            for part in 0..parts {
                if self.stop.load(Relaxed) {
                    return Err(GpuError::Stopped);
                }
                let range = RangeUniform { first, count: some, part, parts, two: 2 };
                let (ms, cut) = self.submit(gpu, &clock, bindings, &range).await?;
                spent.gpu_ms += ms;
                spent.submissions += 1;
                longest_ms = longest_ms.max(ms);
                cut_short = cut;
                if cut_short {
                    break;
                }
            }
            // Repeats the range with twice the number of parts.
            if cut_short {
                if parts >= PARTS_MAX {
                    return Err(GpuError::CutShort { adapter: gpu.adapter() });
                }
                self.parts.store(2 * parts, Relaxed);
                continue;
            }
            self.queries.store(next_queries(self.queries.load(Relaxed), some, longest_ms), Relaxed);
            first += some;
        }
        Ok(spent)
    }

    /// Does one submission; returns its time in ms and whether loops were cut short.
    async fn submit(
        &self,
        gpu: &Gpu,
        clock: &Clock,
        bindings: &wgpu::BindGroup,
        range: &RangeUniform,
    ) -> Result<(f64, bool), GpuError> {
        gpu.queue().write_buffer(&self.range, 0, bytemuck::bytes_of(range));
        let mut encoder = gpu.encoder();
        encoder.clear_buffer(&self.cut_short, 0, None);
        let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor {
            label: Some("shade"),
            timestamp_writes: clock.compute(),
        });
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, bindings, &[]);
        pass.set_bind_group(1, &self.method, &[]);
        pass.dispatch_workgroups(range.count.div_ceil(WORKGROUP), 1, 1);
        drop(pass);
        let cut_short = gpu.staging(self.cut_short.size());
        encoder.copy_buffer_to_buffer(&self.cut_short, 0, &cut_short, 0, cut_short.size());
        let (ms, cut_short) = clock.run_and_read(gpu, encoder, Some(&cut_short)).await?;
        Ok((ms, cut_short.iter().any(|&byte| byte != 0)))
    }
}

/// Number of queries of the next submission. `planned` queries were intended for the last one, `some` were submitted,
/// and the longest of its parts took `ms` milliseconds.
fn next_queries(planned: u32, some: u32, ms: f64) -> u32 {
    let fitting = f64::from(some) * SUBMISSION_MS / ms.max(1e-6);
    if some < planned && fitting > f64::from(planned) {
        // The last, smaller submission says nothing about larger ones.
        return planned;
    }
    (fitting as u32).clamp(WORKGROUP, planned.saturating_mul(GROWTH).min(WORKGROUP * WORKGROUPS_MAX))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::AdapterChoice;
    use sunbeam::height_field::Preset;
    use sunbeam::methods::{MethodKind, MethodOptions, StamForm, build};
    use sunbeam::scattering::Options;
    use sunbeam::table::Model;

    /// Roundings of single precision, in another order.
    const TOLERANCE: f32 = 1e-5;

    #[test]
    fn the_parts_of_an_answer_add_up_to_it() {
        let gpu = match Gpu::open(AdapterChoice::from_env().unwrap()) {
            Ok(gpu) => gpu,
            Err(error @ GpuError::NoAdapter { .. }) => return sunbeam_testing::skip("gpu", error),
            Err(error) => panic!("{error}"),
        };
        let field = Preset::Sinusoidal.build(None, None).unwrap();
        let surface = Options { model: Model::Patch, conserve_energy: false, ..Options::default() };
        let direction = |x: f32, y: f32| [x, y, (1.0 - x * x - y * y).sqrt()];
        let queries: Vec<Query> = (0..200)
            .map(|i| Query::new(direction(0.3, 1e-3), direction(-0.9 + 0.008 * i as f32, -1e-3)))
            .chain([Query::new(direction(0.3, 0.0), direction(-0.3, 0.0))])
            .collect();
        let gems = MethodOptions { stam_form: StamForm::Gems, ..MethodOptions::default() };
        let all = MethodKind::ALL.map(|kind| (kind, MethodOptions::default()));
        for (kind, options) in all.into_iter().chain([(MethodKind::Stam, gems)]) {
            let method = build(kind, &field, &surface, &options).unwrap();
            let shader = Shader::new(&gpu, &*method, &Optics::default()).unwrap();
            let whole = shader.evaluate(&gpu, &queries).unwrap();
            shader.parts.store(7, Relaxed);
            let parts = shader.evaluate(&gpu, &queries).unwrap();
            assert_eq!((whole.submissions, parts.submissions), (1, 7), "{kind}");
            assert!(whole.reflectances.as_flattened().iter().any(|value| *value > 0.0), "{kind}");
            for (a, b) in parts.reflectances.as_flattened().iter().zip(whole.reflectances.as_flattened()) {
                assert!((a - b).abs() <= TOLERANCE * b.abs().max(1.0), "{kind}: {a} and {b}");
            }
        }
    }

    #[test]
    fn submissions_grow_gradually_and_shrink_at_once() {
        assert_eq!(next_queries(1024, 1024, 1.0), 8192);
        assert_eq!(next_queries(8192, 8192, 125.0), 16384);
        assert_eq!(next_queries(8192, 8192, 2500.0), 819);
        assert_eq!(next_queries(8192, 100, 1.0), 8192);
        assert_eq!(next_queries(8192, 4096, 1000.0), 1024);
        assert_eq!(next_queries(64, 64, 1e9), 64);
        assert_eq!(next_queries(1 << 31, 1 << 31, 0.0), 64 * 65_535);
    }
}
