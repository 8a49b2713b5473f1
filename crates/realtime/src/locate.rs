//! Pipelines, bindings and submissions of the locate stage, which follows the rasteriser. It writes a *query* for each
//! pixel: the visible point with its directions to sun and viewer (layout.rs). A *sample* of the picture has one ray
//! for each pixel. The stage also adds the radiance of sunlit ground and the sample's weight to the picture. The next
//! stage computes the reflectance of the queries in `chosen`. [`Locate`] and `locate.wgsl` explain the entry points and
//! the lists `skin`, `bare`, `rest` and `chosen`.
//!
//! The lengths of the lists are read back after each submission, because they determine the later dispatches.

use super::clock::Clock;
use super::pipeline::{self, Access};
use super::scene::Scene;
use super::target::{ListLengths, Target};
use super::{Gpu, GpuError, program};
use bytemuck::Zeroable;

/// Number of pixels of a row that an invocation of `locate_sort` processes, and of entries of `skin` that an invocation
/// of `locate_choose` processes. The shader marks them by the 32 bits of a u32, and reserves their list entries by one
/// atomic operation. A test compares the number with `LOCATE_RUN` of `locate.wgsl`.
const RUN: u32 = 32;

/// Accesses of the bindings 0, 1, … of `locate.wgsl`, each with its name in WGSL. wgpu refuses a pipeline whose WGSL
/// has other accesses.
const GROUP: [Access; 11] = [
    Access::Uniform,   // frame
    Access::Read,      // vertices
    Access::Read,      // triangles
    Access::Read,      // nodes
    Access::Texture,   // seen: the triangle at each pixel
    Access::ReadWrite, // queries
    Access::ReadWrite, // chosen
    Access::ReadWrite, // lists: their lengths, and the entries of skin, bare and rest
    Access::ReadWrite, // picture
    Access::Uniform,   // sunlight
    Access::Read,      // sun_depths
];

/// Turns the triangles of pixels into queries (`locate.wgsl`), in three submissions:
///
/// 1. `sort`: pixels are sorted into the lists `skin` (with a triangle) and `bare` (without one).
/// 2. `bare` and `skin`: the queries of both lists are written. Pixels are added to `rest` if their ray misses their
///    triangle, if the sun's depth map does not decide the visibility, or if they show a film. A film is a transparent
///    mesh, and rays find the sunlit ground behind it.
/// 3. `rest` and `choose`: rays through the mesh replace the queries of `rest`, and the queries of sunlit points of the
///    mesh are listed in `chosen`.
pub(super) struct Locate {
    /// Layout of the bind group of all five pipelines.
    layout: wgpu::BindGroupLayout,
    sort: wgpu::ComputePipeline,
    bare: wgpu::ComputePipeline,
    skin: wgpu::ComputePipeline,
    rest: wgpu::ComputePipeline,
    choose: wgpu::ComputePipeline,
}

impl Locate {
    /// Compiles the five entry points.
    pub(crate) fn new(gpu: &Gpu) -> Result<Self, GpuError> {
        let module = pipeline::module(gpu, "locate", program::locate());
        let layout = pipeline::layout(gpu, &GROUP);
        let entry_point = |name| pipeline::compute(gpu, &module, name, Some(&[Some(&layout)]));
        Ok(Self {
            sort: entry_point("locate_sort")?,
            bare: entry_point("locate_bare")?,
            skin: entry_point("locate_skin")?,
            rest: entry_point("locate_rest")?,
            choose: entry_point("locate_choose")?,
            layout,
        })
    }

    /// The bind group for a scene and a target, in the order of [`GROUP`]. `frame` is the uniform struct of one sample,
    /// which has a ray for each pixel.
    pub(crate) fn bind(&self, gpu: &Gpu, frame: &wgpu::Buffer, scene: &Scene, target: &Target) -> wgpu::BindGroup {
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
                target.picture().as_entire_binding(),
                scene.sunlight.uniform.as_entire_binding(),
                scene.sunlight.depths.as_entire_binding(),
            ],
        )
    }

    /// Runs the stage for one sample of every pixel; returns the time in ms and the number of entries of `chosen`.
    pub(crate) async fn run(
        &self,
        gpu: &Gpu,
        target: &Target,
        bindings: &wgpu::BindGroup,
    ) -> Result<(f64, u32), GpuError> {
        let (width, height) = target.size();
        // Empties the lists; their lengths are the first members of the buffer.
        gpu.queue().write_buffer(&target.lists, 0, bytemuck::bytes_of(&ListLengths::zeroed()));
        // Runs do not cross rows.
        let runs = width.div_ceil(RUN) * height;
        let (sort_ms, ListLengths { skin, bare, .. }) =
            self.submit(gpu, target, bindings, &[(&self.sort, runs)]).await?;
        let (bare_and_skin_ms, ListLengths { rest, .. }) =
            self.submit(gpu, target, bindings, &[(&self.bare, bare), (&self.skin, skin)]).await?;
        // Only pixels of `skin` can show the mesh, so only they are chosen from.
        let (rest_and_choose_ms, ListLengths { chosen, .. }) =
            self.submit(gpu, target, bindings, &[(&self.rest, rest), (&self.choose, skin.div_ceil(RUN))]).await?;
        Ok((sort_ms + bare_and_skin_ms + rest_and_choose_ms, chosen))
    }

    /// Submits a compute pass that dispatches each pipeline with its number of invocations; returns the time in ms and
    /// the lengths of the lists after the pass.
    async fn submit(
        &self,
        gpu: &Gpu,
        target: &Target,
        bindings: &wgpu::BindGroup,
        dispatches: &[(&wgpu::ComputePipeline, u32)],
    ) -> Result<(f64, ListLengths), GpuError> {
        let clock = Clock::new(gpu);
        let mut encoder = gpu.encoder();
        let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor {
            label: Some("locate"),
            timestamp_writes: clock.compute(),
        });
        pass.set_bind_group(0, bindings, &[]);
        for &(pipeline, count) in dispatches {
            pass.set_pipeline(pipeline);
            pipeline::dispatch_over(&mut pass, count);
        }
        drop(pass);
        let staging = gpu.staging(ListLengths::BYTES);
        encoder.copy_buffer_to_buffer(&target.lists, 0, &staging, 0, ListLengths::BYTES);
        let (ms, lengths) = clock.run_and_read(gpu, encoder, Some(&staging)).await?;
        Ok((ms, bytemuck::pod_read_unaligned(&lengths)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn runs_are_as_long_as_in_the_shader() {
        assert!(program::locate().contains(&format!("const LOCATE_RUN: u32 = {RUN}u;")));
    }
}
