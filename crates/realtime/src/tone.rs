//! The last render pass before the screen: tone mapping and sRGB encoding (tone.wgsl).

use super::program;

/// Tone-maps and encodes pictures of linear radiance for a screen, on the GPU.
pub struct TonePass {
    pipeline: wgpu::RenderPipeline,
    /// The uniform struct `Tone` (tone.wgsl).
    uniform: wgpu::Buffer,
}

/// Size of the uniform in bytes: two numbers and padding, because some adapters require at least 16 bytes.
const UNIFORM_BYTES: u64 = size_of::<[u32; 4]>() as u64;

impl TonePass {
    /// Compiles the pass for textures of this format. The pass encodes sRGB itself, so the format must not be one whose
    /// name ends in `Srgb`.
    pub fn new(device: &wgpu::Device, format: wgpu::TextureFormat) -> Self {
        let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
            label: Some("tone"),
            source: wgpu::ShaderSource::Wgsl(program::TONE.into()),
        });
        let pipeline = device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
            label: Some("tone"),
            layout: None,
            vertex: wgpu::VertexState {
                module: &module,
                entry_point: Some("corner"),
                compilation_options: wgpu::PipelineCompilationOptions::default(),
                buffers: &[],
            },
            primitive: wgpu::PrimitiveState::default(),
            depth_stencil: None,
            multisample: wgpu::MultisampleState::default(),
            fragment: Some(wgpu::FragmentState {
                module: &module,
                entry_point: Some("shown"),
                compilation_options: wgpu::PipelineCompilationOptions::default(),
                targets: &[Some(format.into())],
            }),
            multiview_mask: None,
            cache: None,
        });
        let uniform = device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("tone"),
            size: UNIFORM_BYTES,
            usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        Self { pipeline, uniform }
    }

    /// Draws a picture ([`super::Target::picture`]) into the texture `shown`, which has the size of the picture. Rows
    /// have `width` pixels. The radiance is multiplied by `2^stops` before tone mapping: positive stops brighten the
    /// picture.
    pub fn draw(
        &self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        picture: &wgpu::Buffer,
        width: u32,
        shown: &wgpu::TextureView,
        stops: f64,
    ) {
        // The members `gain` (f32, by its bits) and `width` (u32), then padding.
        let gain = stops.exp2() as f32;
        let uniform = [gain.to_bits(), width, 0, 0];
        queue.write_buffer(&self.uniform, 0, bytemuck::bytes_of(&uniform));
        let bindings = device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("tone"),
            layout: &self.pipeline.get_bind_group_layout(0),
            entries: &[
                wgpu::BindGroupEntry { binding: 0, resource: self.uniform.as_entire_binding() },
                wgpu::BindGroupEntry { binding: 1, resource: picture.as_entire_binding() },
            ],
        });
        let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("tone"),
            color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                view: shown,
                depth_slice: None,
                resolve_target: None,
                ops: wgpu::Operations { load: wgpu::LoadOp::Clear(wgpu::Color::BLACK), store: wgpu::StoreOp::Store },
            })],
            ..Default::default()
        });
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, &bindings, &[]);
        // One triangle covers the texture.
        pass.draw(0..3, 0..1);
        drop(pass);
        queue.submit([encoder.finish()]);
    }
}
