//! A method on the GPU: answers arrays of queries in submissions of bounded time.
//!
//! A *query* is a surface point with a pair of directions (layout.rs), and its *answer* is the reflectance `f_r`.
//! `shade.wgsl` answers the queries whose indices are listed in a buffer `chosen`. A submission processes a range of
//! this list. [`Shader`] adapts two numbers from submission to submission:
//!
//! - the number of queries in the range, so that a submission takes about [`SUBMISSION_MS`];
//! - the number n of parts of an answer, which doubles when the adapter ends long loops early. A part has the terms of
//!   every n-th iteration of the method's loop (src/methods/common.wgsl). Each part is a submission of its own, and the
//!   parts are summed on the GPU.
//!
//! blocking.rs has the blocking forms of the asynchronous functions.

use super::clock::Clock;
use super::layout::{self, Optics, OpticsUniform, Query, RangeUniform};
use super::pipeline::{self, Access, WORKGROUP, WORKGROUPS_MAX};
use super::{Gpu, GpuError, program};
use bytemuck::Zeroable;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering::Relaxed};
use sunbeam::methods::{AnswerKind, Method, MethodShader};
use sunbeam::scattering::map_direction;

/// Intended time of a submission in ms. Longer submissions waste less time between them. Shorter ones keep a window on
/// the same GPU from stuttering. Drivers reset a GPU that does not answer for a second or two.
const SUBMISSION_MS: f64 = 250.0;
/// Number of queries of the first submission. The speed of the method is not known yet: a larger number may block the
/// GPU, a smaller one takes more submissions to reach the intended time.
const FIRST_QUERIES: u32 = 1024;
/// Largest ratio of the numbers of queries of consecutive submissions. The time of a small submission predicts that of
/// a large one badly, so larger ratios may overshoot the intended time. Smaller ratios take more submissions to reach
/// it.
const GROWTH_MAX: u32 = 8;
/// Largest number of parts of an answer, a power of 2; a method that needs more is refused with [`GpuError::CutShort`].
/// Each part costs a submission, so such a method would be too slow for pictures.
const PARTS_MAX: u32 = 4096;
/// Largest number of queries that [`Shader::evaluate_async`] holds on the GPU at a time: 68 MiB, with 48 bytes for a
/// query, 4 for its index and 16 for its answer. More take more memory; fewer copy between GPU and processor more
/// often.
const BATCH: usize = 1 << 20;

/// Accesses of the bindings 0, 1, … in group 0 of `shade.wgsl`: range, optics, queries, chosen, reflectances,
/// cut_short.
const OWN_GROUP: [Access; 6] =
    [Access::Uniform, Access::Uniform, Access::Read, Access::Read, Access::ReadWrite, Access::ReadWrite];

/// A method on the GPU, with the factors of the reflectance that do not depend on the relief ([`Optics`]). It answers
/// arrays of queries.
pub struct Shader {
    pipeline: wgpu::ComputePipeline,
    /// Group 1 of the bindings: the method's uniform and data.
    method_bindings: wgpu::BindGroup,
    /// The method's uniform struct.
    method_uniform: wgpu::Buffer,
    /// Bytes of the method's uniform and data.
    method_bytes: u64,
    /// Meaning of the method's answers: the relief's factor of the reflectance, the whole reflectance, or that of a
    /// film, a transparent sheet with the relief on one side.
    answer_kind: AnswerKind,
    /// The uniform struct [`OpticsUniform`].
    optics_uniform: wgpu::Buffer,
    /// The uniform struct [`RangeUniform`] of the current submission.
    range_uniform: wgpu::Buffer,
    /// Number (u32) of answers of the current submission whose loops the adapter ended early (shade.wgsl).
    cut_short: wgpu::Buffer,
    /// Number of queries of the next submission, adapted by [`Shader::run`]. It is atomic, as is `part_count`, because
    /// `run` takes a shared reference.
    planned_queries: AtomicU32,
    /// Number of parts of an answer, adapted by [`Shader::run`].
    part_count: AtomicU32,
    /// Flag of [`Shader::stop_when`].
    stop: Arc<AtomicBool>,
}

/// The answers of [`Shader::evaluate_async`].
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Answers {
    /// Reflectance `f_r` of each query, linear sRGB in 1/sr.
    pub reflectances: Vec<[f32; 3]>,
    /// Time of the GPU in ms, or wall-clock time without [`Gpu::has_timestamps`].
    pub gpu_ms: f64,
    /// Number of submissions.
    pub submissions: u32,
}

/// Time and number of submissions of [`Shader::run`].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Spent {
    /// Time in ms, as in [`Answers::gpu_ms`].
    pub gpu_ms: f64,
    /// Number of submissions.
    pub submissions: u32,
}

impl Shader {
    /// Compiles the method's WGSL and uploads its data.
    ///
    /// # Errors
    /// [`GpuError::TooLarge`] where the adapter cannot bind the data, [`GpuError::Refused`] where it refuses the WGSL,
    /// [`GpuError::Lost`], [`GpuError::CutShort`].
    pub async fn new_async(gpu: &Gpu, method: &dyn Method, optics: &Optics) -> Result<Self, GpuError> {
        Self::of_async(gpu, &method.shader(), method.answers(), optics).await
    }

    /// [`Shader::new_async`] for the [`Method::shader`] and [`Method::answers`] of a method that was built elsewhere.
    ///
    /// # Errors
    /// The errors of [`Shader::new_async`].
    pub async fn of_async(
        gpu: &Gpu,
        method: &MethodShader<'_>,
        answer_kind: AnswerKind,
        optics: &Optics,
    ) -> Result<Self, GpuError> {
        let module = pipeline::module(gpu, method.name, program::shade(method));
        // The method's uniform has binding 0, its data the bindings from 1 on.
        let mut accesses = vec![Access::Read; method.storage.len() + 1];
        accesses[0] = Access::Uniform;
        let (own_layout, method_layout) = (pipeline::layout(gpu, &OWN_GROUP), pipeline::layout(gpu, &accesses));
        let layouts = [Some(&own_layout), Some(&method_layout)];
        let pipeline = pipeline::compute(gpu, &module, "shade", Some(&layouts))?;
        let method_uniform = gpu.uniform_of(method.name, &method.uniform)?;
        let storage = method
            .storage
            .iter()
            .enumerate()
            .map(|(i, contents)| gpu.storage_of(&format!("data {i} of method {}", method.name), contents))
            .collect::<Result<Vec<_>, _>>()?;
        let buffers: Vec<&wgpu::Buffer> = std::iter::once(&method_uniform).chain(&storage).collect();
        let method_bindings = pipeline::bind(gpu, &method_layout, &buffers);
        let method_bytes = buffers.iter().map(|buffer| buffer.size()).sum();
        let optics_uniform = OpticsUniform::new(optics, answer_kind);
        let shader = Self {
            pipeline,
            method_bindings,
            method_uniform,
            method_bytes,
            answer_kind,
            optics_uniform: gpu.uniform_of("optics", bytemuck::bytes_of(&optics_uniform))?,
            range_uniform: gpu.uniform_of("range", bytemuck::bytes_of(&RangeUniform::zeroed()))?,
            cut_short: gpu.storage("cut_short", size_of::<u32>() as u64)?,
            planned_queries: AtomicU32::new(FIRST_QUERIES),
            part_count: AtomicU32::new(1),
            stop: Arc::default(),
        };
        // Drivers finish compiling at the first use, so its time says nothing about the method. The number of queries
        // derived from it is reset. The query has no valid directions, so the method is not evaluated.
        shader.evaluate_async(gpu, &[Query::default()]).await?;
        shader.planned_queries.store(FIRST_QUERIES, Relaxed);
        Ok(shader)
    }

    /// Bytes of the method's uniform and data on the GPU.
    pub fn bytes(&self) -> u64 {
        self.method_bytes
    }

    /// Whether the surface is a film. Directions of its queries may lie on either side.
    pub fn is_film(&self) -> bool {
        matches!(self.answer_kind, AnswerKind::Film { .. })
    }

    /// Refractive index of the film; 0 for a surface that is not a film.
    pub(super) fn film_eta(&self) -> f32 {
        match self.answer_kind {
            AnswerKind::Film { eta } => eta,
            AnswerKind::Relief | AnswerKind::Reflectance => 0.0,
        }
    }

    /// Changes the optics of later answers.
    pub fn set_optics(&self, gpu: &Gpu, optics: &Optics) {
        let uniform = OpticsUniform::new(optics, self.answer_kind);
        gpu.queue().write_buffer(&self.optics_uniform, 0, bytemuck::bytes_of(&uniform));
    }

    /// Registers a flag that another thread may set. While it is set, answers and pictures end with
    /// [`GpuError::Stopped`] before their next submission.
    pub fn stop_when(&mut self, flag: Arc<AtomicBool>) {
        self.stop = flag;
    }

    /// Replaces the method's uniform by the [`MethodShader::uniform`] of a method with the same storage.
    ///
    /// # Errors
    /// [`GpuError::Parameter`] for a uniform of another size, [`GpuError::Refused`], [`GpuError::Lost`].
    pub fn set_parameters(&self, gpu: &Gpu, uniform: &[u8]) -> Result<(), GpuError> {
        if uniform.len() as u64 != self.method_uniform.size() {
            let (found, accepted) = (format!("{} bytes", uniform.len()), "as long as the method's");
            return Err(GpuError::Parameter { parameter: "uniform", found, accepted });
        }
        gpu.queue().write_buffer(&self.method_uniform, 0, uniform);
        gpu.check()
    }

    /// Answers queries, in their order. Only their directions are read. An answer is 0 unless both directions are
    /// finite and above the surface. For a film they may also be below it, but not in its plane.
    ///
    /// # Errors
    /// [`GpuError::Refused`], [`GpuError::Lost`], [`GpuError::CutShort`], [`GpuError::TooLarge`], and
    /// [`GpuError::Stopped`] when the flag of [`Shader::stop_when`] is set.
    pub async fn evaluate_async(&self, gpu: &Gpu, queries: &[Query]) -> Result<Answers, GpuError> {
        let mut answers = Answers::default();
        for batch in queries.chunks(BATCH) {
            let indices: Vec<u32> = (0..batch.len() as u32).collect();
            let query_buffer = gpu.storage_of("queries", bytemuck::cast_slice(batch))?;
            let chosen = gpu.storage_of("chosen", bytemuck::cast_slice(&indices))?;
            let bytes = size_of::<[f32; 4]>() as u64 * batch.len() as u64;
            let reflectances = gpu.storage("reflectances", bytes)?;
            let bindings = self.bind(gpu, &query_buffer, &chosen, &reflectances);
            let spent = self.run(gpu, &bindings, batch.len() as u32).await?;
            answers.gpu_ms += spent.gpu_ms;
            answers.submissions += spent.submissions;
            let contents = gpu.read(&reflectances, bytes).await?;
            answers.reflectances.extend(layout::colours(&contents));
        }
        Ok(answers)
    }

    /// Reflectances `f_r` over the hemisphere of `wo` for light from `wi`, a unit vector, as linear sRGB in 1/sr. The
    /// map has `side`² pixels, rows from the top. A pixel at (x, y) in [−1, 1]², x right and y up, stands for the `wo`
    /// with these two components ([`map_direction`]). Pixels outside the unit disc are `None`.
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
        // The answers belong to the pixels inside the disc, in their order.
        Ok(directions.iter().map(|direction| direction.and_then(|_| answers.next())).collect())
    }

    /// The bind group 0 for these buffers: `Query`s, indices of the queries to answer (u32), and a `vec4<f32>` for each
    /// query, where the answers are written.
    pub(super) fn bind(
        &self,
        gpu: &Gpu,
        queries: &wgpu::Buffer,
        chosen: &wgpu::Buffer,
        reflectances: &wgpu::Buffer,
    ) -> wgpu::BindGroup {
        let layout = self.pipeline.get_bind_group_layout(0);
        let buffers = [&self.range_uniform, &self.optics_uniform, queries, chosen, reflectances, &self.cut_short];
        pipeline::bind(gpu, &layout, &buffers)
    }

    /// The uniform struct [`OpticsUniform`], from which `resolve.wgsl` computes the weight of the pigment, the diffuse
    /// colour below the relief.
    pub(super) fn optics_uniform(&self) -> &wgpu::Buffer {
        &self.optics_uniform
    }

    /// Answers the first `total` of the chosen queries, in submissions of about [`SUBMISSION_MS`]. `bindings` is a
    /// result of [`Shader::bind`].
    pub(super) async fn run(&self, gpu: &Gpu, bindings: &wgpu::BindGroup, total: u32) -> Result<Spent, GpuError> {
        let clock = Clock::new(gpu);
        let mut spent = Spent::default();
        let mut first = 0;
        while first < total {
            let planned = self.planned_queries.load(Relaxed);
            let count = planned.min(total - first);
            let parts = self.part_count.load(Relaxed);
            let mut longest_ms = 0.0f64;
            let mut cut_short = false;
            for part in 0..parts {
                if self.stop.load(Relaxed) {
                    return Err(GpuError::Stopped);
                }
                // The shader counts to `two` in a loop, to detect that the adapter ends loops early (shade.wgsl).
                let range = RangeUniform { first, count, part, parts, two: 2 };
                let (ms, is_part_cut_short) = self.submit(gpu, &clock, bindings, &range).await?;
                spent.gpu_ms += ms;
                spent.submissions += 1;
                longest_ms = longest_ms.max(ms);
                if is_part_cut_short {
                    cut_short = true;
                    break;
                }
            }
            if cut_short {
                // The range is repeated with twice the number of parts. Part 0 overwrites the wrong sums; later parts
                // are added.
                if parts >= PARTS_MAX {
                    return Err(GpuError::CutShort { adapter: gpu.adapter() });
                }
                self.part_count.store(2 * parts, Relaxed);
                continue;
            }
            self.planned_queries.store(next_queries(planned, count, longest_ms), Relaxed);
            first += count;
        }
        Ok(spent)
    }

    /// Computes one part of the answers in a range. Returns the time in ms and whether the adapter ended loops early.
    async fn submit(
        &self,
        gpu: &Gpu,
        clock: &Clock,
        bindings: &wgpu::BindGroup,
        range: &RangeUniform,
    ) -> Result<(f64, bool), GpuError> {
        gpu.queue().write_buffer(&self.range_uniform, 0, bytemuck::bytes_of(range));
        let mut encoder = gpu.encoder();
        encoder.clear_buffer(&self.cut_short, 0, None);
        let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor {
            label: Some("shade"),
            timestamp_writes: clock.compute(),
        });
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, bindings, &[]);
        pass.set_bind_group(1, &self.method_bindings, &[]);
        pass.dispatch_workgroups(range.count.div_ceil(WORKGROUP), 1, 1);
        drop(pass);
        let staging = gpu.staging(self.cut_short.size());
        encoder.copy_buffer_to_buffer(&self.cut_short, 0, &staging, 0, staging.size());
        let (ms, bytes) = clock.run_and_read(gpu, encoder, Some(&staging)).await?;
        Ok((ms, bytes.iter().any(|&byte| byte != 0)))
    }
}

/// Number of queries of the next submission. The last one was planned for `planned` queries but had `submitted`, fewer
/// at the end of a list. The longest of its parts took `ms` milliseconds.
fn next_queries(planned: u32, submitted: u32, ms: f64) -> u32 {
    // The lower bound of the time avoids a division by zero: clocks may be coarse.
    let fitting = f64::from(submitted) * SUBMISSION_MS / ms.max(1e-6);
    if submitted < planned && fitting > f64::from(planned) {
        // A submission smaller than planned does not show that more than planned would fit.
        return planned;
    }
    // A submission is one row of workgroups.
    let most = planned.saturating_mul(GROWTH_MAX).min(WORKGROUP * WORKGROUPS_MAX);
    (fitting as u32).clamp(WORKGROUP, most)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::AdapterChoice;
    use sunbeam::height_field::Preset;
    use sunbeam::methods::{MethodKind, MethodOptions, StamForm, build};
    use sunbeam::scattering::Options;
    use sunbeam::table::Model;

    /// Tolerance of the sum over parts: rounding errors of single precision, relative to values above 1.
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
            // The mirror direction.
            .chain([Query::new(direction(0.3, 0.0), direction(-0.3, 0.0))])
            .collect();
        let gems = MethodOptions { stam_form: StamForm::Gems, ..MethodOptions::default() };
        let all = MethodKind::ALL.map(|kind| (kind, MethodOptions::default()));
        for (kind, options) in all.into_iter().chain([(MethodKind::Stam, gems)]) {
            let method = build(kind, &field, &surface, &options).unwrap();
            let shader = Shader::new(&gpu, &*method, &Optics::default()).unwrap();
            let whole = shader.evaluate(&gpu, &queries).unwrap();
            // Any number of parts gives the same sum.
            shader.part_count.store(7, Relaxed);
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
        // 250 times as many would fit; the ratio is limited to 8.
        assert_eq!(next_queries(1024, 1024, 1.0), 8192);
        // Half and ten times the intended 250 ms.
        assert_eq!(next_queries(8192, 8192, 125.0), 16384);
        assert_eq!(next_queries(8192, 8192, 2500.0), 819);
        // The end of a list: a short time keeps the plan, four times the intended one shortens the next submission.
        assert_eq!(next_queries(8192, 100, 1.0), 8192);
        assert_eq!(next_queries(8192, 4096, 1000.0), 1024);
        // At least one workgroup, at most one row of workgroups.
        assert_eq!(next_queries(64, 64, 1e9), 64);
        assert_eq!(next_queries(1 << 31, 1 << 31, 0.0), 64 * 65_535);
    }
}
