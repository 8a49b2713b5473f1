//! The renderer: runs the four stages of a picture (raster, locate, shade, resolve; lib.rs). Each run of the stages
//! draws one sample of every pixel.
//!
//! If the sun has moved, the sun's depth map (sunlight.rs) is drawn before the first sample. The locate stage writes a
//! *query* for each pixel: its visible point with the directions to sun and viewer (layout.rs). The stage also adds
//! the ground's radiance to the picture, or in the first sample overwrites the old picture with it. Last, the stage
//! lists the queries of sunlit points of the mesh in the buffer `chosen` (target.rs). The length of the list,
//! `chosen_count`, is read back, because it sizes the dispatches of shade and resolve.

use super::clock::Clock;
use super::layout::FrameUniform;
use super::locate::Locate;
use super::scene::Scene;
use super::shader::Shader;
use super::target::{DEPTH_FORMAT, SEEN_FORMAT, Target};
use super::view::View;
use super::{Gpu, GpuError, pipeline, program};
use bytemuck::Zeroable;

/// Times in ms of the stages of a picture, measured by the GPU or, without [`Gpu::has_timestamps`], by the wall clock.
/// In a browser without timestamps, raster and resolve do not wait for the GPU: they have the time of their submission
/// alone, and the next stage that waits includes their work.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize)]
pub struct StageTimes {
    /// Finding the triangle at each pixel, and drawing the sun's depth map if the sun has moved.
    pub raster: f64,
    /// Computing shading frames, directions and the visibility of the sun.
    pub locate: f64,
    /// Evaluating the method.
    pub shade: f64,
    /// Adding the radiance of the answered queries to the picture.
    pub resolve: f64,
}

impl StageTimes {
    /// Sum over all stages in ms.
    pub fn total(&self) -> f64 {
        self.raster + self.locate + self.shade + self.resolve
    }

    /// The median of each stage over several pictures. For an even number of pictures it is the upper one of the two
    /// middle values, and without pictures it is 0.
    pub fn medians(pictures: &[Self]) -> Self {
        let median = |stage: fn(&Self) -> f64| {
            let mut sorted: Vec<f64> = pictures.iter().map(stage).collect();
            sorted.sort_by(f64::total_cmp);
            sorted.get(sorted.len() / 2).copied().unwrap_or_default()
        };
        Self {
            raster: median(|t| t.raster),
            locate: median(|t| t.locate),
            shade: median(|t| t.shade),
            resolve: median(|t| t.resolve),
        }
    }
}

/// Time and work of a picture.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct FrameReport {
    /// Times of the stages, summed over all samples of a pixel.
    pub gpu_ms: StageTimes,
    /// Number of queries that the method answered: sunlit samples of the mesh.
    pub answered: u64,
    /// Number of submissions of the stage `shade`, at least one for each sample that has queries to answer.
    pub submissions: u32,
}

/// Draws a [`Scene`] with a [`Shader`] into a [`Target`]. All three may change from picture to picture.
pub struct Renderer {
    /// Draws the sun's depth map (shadow.wgsl).
    shadow: wgpu::RenderPipeline,
    /// Draws the triangle numbers (raster.wgsl).
    raster: wgpu::RenderPipeline,
    /// Writes the queries (locate.wgsl).
    locate: Locate,
    /// Adds the answers to the picture (resolve.wgsl).
    resolve: wgpu::ComputePipeline,
    /// The uniform struct `Frame` of the current sample (frame.wgsl).
    frame: wgpu::Buffer,
}

impl Renderer {
    /// Compiles all programs except the method's.
    ///
    /// # Errors
    /// [`GpuError::Refused`], [`GpuError::Lost`].
    pub fn new(gpu: &Gpu) -> Result<Self, GpuError> {
        let resolve = pipeline::module(gpu, "resolve", program::resolve());
        // Overwritten before each sample.
        let frame = FrameUniform::zeroed();
        Ok(Self {
            shadow: depth_pipeline(gpu, program::shadow(), "sunlit_corner", None)?,
            raster: depth_pipeline(gpu, program::raster(), "corner", Some("triangle_number"))?,
            locate: Locate::new(gpu)?,
            resolve: pipeline::compute(gpu, &resolve, "resolve", None)?,
            frame: gpu.uniform_of("frame", bytemuck::bytes_of(&frame))?,
        })
    }

    /// Draws a picture into [`Target::picture`], without blocking. Calls must not overlap: they share buffers.
    ///
    /// # Errors
    /// The errors of [`View::check`]; [`GpuError::Refused`], [`GpuError::Lost`], [`GpuError::CutShort`], and
    /// [`GpuError::Stopped`] when the flag of [`Shader::stop_when`] is set.
    pub async fn draw_async(
        &self,
        gpu: &Gpu,
        scene: &Scene,
        shader: &Shader,
        target: &Target,
        view: &View,
    ) -> Result<FrameReport, GpuError> {
        view.check()?;
        let bindings = Bindings::new(gpu, self, scene, shader, target);
        let mut report = FrameReport::default();
        let to_sun = view.light.to_sun();
        if scene.sunlight.begin_drawing(gpu, to_sun) {
            let map = scene.sunlight.view();
            // The sun's pass writes depths only, no triangle numbers.
            report.gpu_ms.raster += self.rasterise(gpu, scene, &self.shadow, &bindings.shadow, None, &map).await?;
            // The map is copied into the buffer that the locate stage reads. The time of the copy belongs to no stage.
            scene.sunlight.copy(gpu)?;
            // Not reached after an error; the next picture then draws the map again.
            scene.sunlight.end_drawing(to_sun);
        }
        for sample in 0..view.samples() {
            let uniform = view.uniform(target.size(), sample, shader.film_eta())?;
            gpu.queue().write_buffer(&self.frame, 0, bytemuck::bytes_of(&uniform));
            report.gpu_ms.raster +=
                self.rasterise(gpu, scene, &self.raster, &bindings.raster, Some(&target.seen), &target.depth).await?;
            let (locate_ms, chosen_count) = self.locate.run(gpu, target, &bindings.locate).await?;
            report.gpu_ms.locate += locate_ms;
            let spent = shader.run(gpu, &bindings.shade, chosen_count).await?;
            report.gpu_ms.shade += spent.gpu_ms;
            report.submissions += spent.submissions;
            report.answered += u64::from(chosen_count);
            report.gpu_ms.resolve += self.add_radiance(gpu, &bindings, chosen_count).await?;
        }
        Ok(report)
    }

    /// Draws the triangles into the depth texture `depth` and, if given, their numbers into the texture `triangles`.
    /// Returns the time in ms. Both textures are cleared to 0, which is the farthest depth and no triangle.
    async fn rasterise(
        &self,
        gpu: &Gpu,
        scene: &Scene,
        pipeline: &wgpu::RenderPipeline,
        bindings: &wgpu::BindGroup,
        triangles: Option<&wgpu::TextureView>,
        depth: &wgpu::TextureView,
    ) -> Result<f64, GpuError> {
        let clock = Clock::new(gpu);
        let mut encoder = gpu.encoder();
        let attachment = triangles.map(|view| wgpu::RenderPassColorAttachment {
            view,
            depth_slice: None,
            resolve_target: None,
            ops: wgpu::Operations { load: wgpu::LoadOp::Clear(wgpu::Color::BLACK), store: wgpu::StoreOp::Store },
        });
        // Without `triangles` the list of colour attachments is empty.
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("raster"),
            color_attachments: attachment.map(Some).as_slice(),
            depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
                view: depth,
                depth_ops: Some(wgpu::Operations { load: wgpu::LoadOp::Clear(0.0), store: wgpu::StoreOp::Store }),
                stencil_ops: None,
            }),
            timestamp_writes: clock.render(),
            occlusion_query_set: None,
            multiview_mask: None,
        });
        pass.set_pipeline(pipeline);
        pass.set_bind_group(0, bindings, &[]);
        pass.draw(0..scene.corners, 0..1);
        drop(pass);
        clock.run(gpu, encoder).await
    }

    /// Adds the radiance of the `chosen_count` answered queries to the picture; returns the time in ms.
    async fn add_radiance(&self, gpu: &Gpu, bindings: &Bindings, chosen_count: u32) -> Result<f64, GpuError> {
        let clock = Clock::new(gpu);
        let mut encoder = gpu.encoder();
        let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor {
            label: Some("resolve"),
            timestamp_writes: clock.compute(),
        });
        pass.set_pipeline(&self.resolve);
        pass.set_bind_group(0, &bindings.resolve, &[]);
        pipeline::dispatch_over(&mut pass, chosen_count);
        drop(pass);
        clock.run(gpu, encoder).await
    }
}

/// Bind groups of all stages for one scene, shader and target. Creating them is cheap.
struct Bindings {
    shadow: wgpu::BindGroup,
    raster: wgpu::BindGroup,
    locate: wgpu::BindGroup,
    shade: wgpu::BindGroup,
    resolve: wgpu::BindGroup,
}

impl Bindings {
    /// Bind groups in the order of the bindings that the WGSL files declare. target.rs explains the target's buffers.
    fn new(gpu: &Gpu, renderer: &Renderer, scene: &Scene, shader: &Shader, target: &Target) -> Self {
        let shadow = renderer.shadow.get_bind_group_layout(0);
        let raster = renderer.raster.get_bind_group_layout(0);
        let resolve = renderer.resolve.get_bind_group_layout(0);
        Self {
            shadow: pipeline::bind(gpu, &shadow, &[&scene.sunlight.uniform, &scene.vertices, &scene.triangles]),
            raster: pipeline::bind(gpu, &raster, &[&renderer.frame, &scene.vertices, &scene.triangles]),
            locate: renderer.locate.bind(gpu, &renderer.frame, scene, target),
            shade: shader.bind(gpu, &target.queries, &target.chosen, &target.reflectances),
            resolve: pipeline::bind(
                gpu,
                &resolve,
                &[
                    &renderer.frame,
                    shader.optics_uniform(),
                    &target.queries,
                    &target.reflectances,
                    target.picture(),
                    &scene.pigment,
                    &target.chosen,
                    &target.lists,
                ],
            ),
        }
    }
}

/// A pipeline that draws triangles into a depth map in which larger depths are in front. `vertex` and `fragment` are
/// entry points of the WGSL `source`. With `fragment` the pipeline also writes a triangle number for each pixel.
fn depth_pipeline(
    gpu: &Gpu,
    source: String,
    vertex: &str,
    fragment: Option<&str>,
) -> Result<wgpu::RenderPipeline, GpuError> {
    let module = pipeline::module(gpu, vertex, source);
    let target = [Some(SEEN_FORMAT.into())];
    let created = gpu.device().create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: Some(vertex),
        layout: None,
        vertex: wgpu::VertexState {
            module: &module,
            entry_point: Some(vertex),
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            buffers: &[],
        },
        // Both sides of a triangle are visible: meshes may be open.
        primitive: wgpu::PrimitiveState::default(),
        depth_stencil: Some(wgpu::DepthStencilState {
            format: DEPTH_FORMAT,
            depth_write_enabled: Some(true),
            depth_compare: Some(wgpu::CompareFunction::Greater),
            stencil: wgpu::StencilState::default(),
            bias: wgpu::DepthBiasState::default(),
        }),
        multisample: wgpu::MultisampleState::default(),
        fragment: fragment.map(|entry| wgpu::FragmentState {
            module: &module,
            entry_point: Some(entry),
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            targets: &target,
        }),
        multiview_mask: None,
        cache: None,
    });
    gpu.check()?;
    Ok(created)
}
