use super::clock::Clock;
use super::pipeline::{self, Access};
use super::scene::Scene;
use super::target::Target;
use super::{Gpu, GpuError, program};

/// Pixels along a side of a workgroup over a picture, as in `locate.wgsl`.
const WORKGROUP: u32 = 8;

/// Frame, vertices, triangles, nodes, seen, queries, chosen, lists, unsure, picture, sunlight, its depths.
const GROUP: [Access; 12] = [
    Access::Uniform,
    Access::Read,
    Access::Read,
    Access::Read,
    Access::Texture,
    Access::Write,
    Access::Write,
    Access::Write,
    Access::Write,
    Access::Write,
    Access::Uniform,
    Access::Read,
];

/// Turns triangles into queries, in two submissions: every pixel, then those of which only a ray through the tree tells
/// what they see or whether the sun is seen from there; see `locate.wgsl`.
pub(super) struct Locate {
    layout: wgpu::BindGroupLayout,
    all: wgpu::ComputePipeline,
    missed: wgpu::ComputePipeline,
    unsure: wgpu::ComputePipeline,
}

impl Locate {
    pub fn new(gpu: &Gpu) -> Result<Self, GpuError> {
        let module = pipeline::module(gpu, "locate", program::locate());
        let layout = pipeline::layout(gpu, &GROUP);
        let entry = |name| pipeline::compute(gpu, &module, name, Some(&[Some(&layout)]));
        let (all, missed, unsure) = (entry("locate")?, entry("locate_missed")?, entry("locate_unsure")?);
        Ok(Self { layout, all, missed, unsure })
    }

    pub fn bind(&self, gpu: &Gpu, frame: &wgpu::Buffer, scene: &Scene, target: &Target) -> wgpu::BindGroup {
        pipeline::bind_resources(
            gpu,
            &self.layout,
            &[
                frame.as_entire_binding(),
                scene.vertices.as_entire_binding(),
                scene.triangles.as_entire_binding(),
                scene.nodes.as_entire_binding(),
                wgpu::BindingResource::TextureView(&target.seen),
                target.queries.as_entire_binding(),
                target.chosen.as_entire_binding(),
                target.lists.as_entire_binding(),
                target.unsure.as_entire_binding(),
                target.picture().as_entire_binding(),
                scene.sunlight.uniform.as_entire_binding(),
                scene.sunlight.depths.as_entire_binding(),
            ],
        )
    }

    /// Makes the queries of a sample; the time in ms, and how many need an answer.
    pub fn run(&self, gpu: &Gpu, target: &Target, bindings: &wgpu::BindGroup) -> Result<(f64, u32), GpuError> {
        let (width, height) = target.size();
        let (first_ms, [_, unsure, missed]) = self.submit(gpu, target, |encoder, pass| {
            encoder.clear_buffer(&target.lists, 0, Some(Target::LIST_COUNTS_BYTES));
            let mut pass = encoder.begin_compute_pass(pass);
            pass.set_bind_group(0, bindings, &[]);
            pass.set_pipeline(&self.all);
            pass.dispatch_workgroups(width.div_ceil(WORKGROUP), height.div_ceil(WORKGROUP), 1);
        })?;
        let (ms, [chosen, ..]) = self.submit(gpu, target, |encoder, pass| {
            let mut pass = encoder.begin_compute_pass(pass);
            pass.set_bind_group(0, bindings, &[]);
            pass.set_pipeline(&self.missed);
            pipeline::dispatch_over(&mut pass, missed);
            pass.set_pipeline(&self.unsure);
            // Each of the missed may have become unsure.
            pipeline::dispatch_over(&mut pass, unsure + missed);
        })?;
        Ok((first_ms + ms, chosen))
    }

    /// Submits a compute pass; the time in ms, and how long the lists are then.
    fn submit(
        &self,
        gpu: &Gpu,
        target: &Target,
        record: impl FnOnce(&mut wgpu::CommandEncoder, &wgpu::ComputePassDescriptor<'_>),
    ) -> Result<(f64, [u32; 3]), GpuError> {
        let clock = Clock::new(gpu);
        let mut encoder = gpu.encoder();
        record(&mut encoder, &wgpu::ComputePassDescriptor { label: Some("locate"), timestamp_writes: clock.compute() });
        let counts = gpu.staging(Target::LIST_COUNTS_BYTES);
        encoder.copy_buffer_to_buffer(&target.lists, 0, &counts, 0, Target::LIST_COUNTS_BYTES);
        let ms = clock.run(gpu, encoder)?;
        Ok((ms, bytemuck::pod_read_unaligned(&gpu.read_staging(&counts)?)))
    }
}
