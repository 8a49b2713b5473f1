//! Tone mapping of pictures into a texture that egui shows.

use eframe::egui::TextureId;
use eframe::egui_wgpu::RenderState;
use sunbeam_realtime::{Target, TonePass};

/// Format of the texture: sRGB-encoded values, which egui shows without decoding them.
const FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rgba8Unorm;

/// Tone-maps pictures of linear radiance into a texture of the window, on the GPU.
pub(crate) struct ToneMapper {
    /// Compiled tone mapping.
    pass: TonePass,
    /// Texture of the last picture; `None` before the first.
    shown: Option<Shown>,
}

/// A texture and its identifier in egui.
struct Shown {
    texture: wgpu::Texture,
    id: TextureId,
}

impl Shown {
    /// A texture of this size. It takes the place of the texture `id` in egui, or gets a new identifier.
    fn new(window: &RenderState, size: wgpu::Extent3d, id: Option<TextureId>) -> Self {
        let texture = texture(&window.device, size);
        let view = texture.create_view(&wgpu::TextureViewDescriptor::default());
        let mut renderer = window.renderer.write();
        let filter = wgpu::FilterMode::Linear;
        let id = match id {
            Some(id) => {
                renderer.update_egui_texture_from_wgpu_texture(&window.device, &view, filter, id);
                id
            }
            None => renderer.register_native_texture(&window.device, &view, filter),
        };
        Self { texture, id }
    }
}

impl ToneMapper {
    /// Compiles the tone mapping.
    pub(crate) fn new(device: &wgpu::Device) -> Self {
        Self { pass: TonePass::new(device, FORMAT), shown: None }
    }

    /// Tone-maps a picture, its radiance times 2^`stops`, into the texture. Returns the texture's identifier, which is
    /// the same for all pictures.
    pub(crate) fn show(&mut self, window: &RenderState, target: &Target, stops: f64) -> TextureId {
        let (width, height) = target.size();
        let size = wgpu::Extent3d { width, height, depth_or_array_layers: 1 };
        let shown = match self.shown.take() {
            Some(shown) if shown.texture.size() == size => shown,
            none_or_other_size => Shown::new(window, size, none_or_other_size.map(|shown| shown.id)),
        };
        let view = shown.texture.create_view(&wgpu::TextureViewDescriptor::default());
        self.pass.draw(&window.device, &window.queue, target.picture(), width, &view, stops);
        let id = shown.id;
        self.shown = Some(shown);
        id
    }
}

/// A texture that the tone mapping can draw into, egui can show, and tests can read.
fn texture(device: &wgpu::Device, size: wgpu::Extent3d) -> wgpu::Texture {
    device.create_texture(&wgpu::TextureDescriptor {
        label: Some("shown"),
        size,
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format: FORMAT,
        usage: wgpu::TextureUsages::RENDER_ATTACHMENT
            | wgpu::TextureUsages::TEXTURE_BINDING
            | wgpu::TextureUsages::COPY_SRC,
        view_formats: &[],
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use sunbeam::colour::{srgb_encode, tone_map};
    use sunbeam_realtime::{AdapterChoice, Gpu, GpuError};
    use wgpu::util::DeviceExt;

    /// Bytes of a copied row of 16 texels, padded to wgpu's alignment.
    const ROW_BYTES: u64 = wgpu::COPY_BYTES_PER_ROW_ALIGNMENT as u64;

    /// The bytes (r, g, b, a) of each colour, tone-mapped by the pass.
    fn on_gpu(gpu: &Gpu, colours: &[[f32; 3]; 16], stops: f64) -> Vec<u8> {
        let (device, queue) = (gpu.device(), gpu.queue());
        let size = wgpu::Extent3d { width: 16, height: 1, depth_or_array_layers: 1 };
        let texels: Vec<[f32; 4]> = colours.iter().map(|&[r, g, b]| [r, g, b, 1.0]).collect();
        let picture = device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
            label: None,
            contents: bytemuck::cast_slice(&texels),
            usage: wgpu::BufferUsages::STORAGE,
        });
        let shown = texture(device, size);
        let view = shown.create_view(&wgpu::TextureViewDescriptor::default());
        TonePass::new(device, FORMAT).draw(device, queue, &picture, size.width, &view, stops);
        let read = device.create_buffer(&wgpu::BufferDescriptor {
            label: None,
            size: ROW_BYTES,
            usage: wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        encoder.copy_texture_to_buffer(
            shown.as_image_copy(),
            wgpu::TexelCopyBufferInfo { buffer: &read, layout: wgpu::TexelCopyBufferLayout::default() },
            size,
        );
        queue.submit([encoder.finish()]);
        read.map_async(wgpu::MapMode::Read, .., |mapped| mapped.unwrap());
        device.poll(wgpu::PollType::wait_indefinitely()).unwrap();
        gpu.check().unwrap();
        read.get_mapped_range(..).unwrap()[..4 * colours.len()].to_vec()
    }

    #[test]
    fn the_gpu_tone_maps_as_the_processor_does() {
        let gpu = match Gpu::open(AdapterChoice::from_env().unwrap()) {
            Ok(gpu) => gpu,
            Err(error @ GpuError::NoAdapter { .. }) => return sunbeam_testing::skip("gpu", error),
            Err(error) => panic!("{error}"),
        };
        // Shadows, colours on both sides of the tone curve's knee, out of the gamut, and far too bright.
        let colours: [[f32; 3]; 16] = std::array::from_fn(|i| {
            let bright = 0.002 * 2.0f32.powi(i as i32);
            [bright, 0.3 * bright, if i % 2 == 0 { -bright } else { 0.7 * bright }]
        });
        for stops in [-1.0, 0.0, 2.0] {
            let found = on_gpu(&gpu, &colours, stops);
            for (texel, colour) in found.chunks_exact(4).zip(colours) {
                let expected = srgb_encode(tone_map(colour.map(f64::from), stops));
                for (byte, value) in texel.iter().zip(expected) {
                    // Rounding to a byte (0.5), and the error of `pow`.
                    assert!((f64::from(*byte) - 255.0 * value).abs() < 0.6, "{colour:?}: {texel:?}, not {expected:?}");
                }
            }
        }
    }
}
