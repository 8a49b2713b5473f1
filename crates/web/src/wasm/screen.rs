//! The canvas on which `artist.rs` shows pictures: its WebGPU surface, and the tone pass that draws on it.

use crate::WebError;
use std::cell::RefCell;
use sunbeam_realtime::{Gpu, Target, TonePass};

/// The canvas that shows pictures.
pub(super) struct Screen {
    surface: wgpu::Surface<'static>,
    /// Configuration of the surface, which has the size of the picture shown.
    config: RefCell<wgpu::SurfaceConfiguration>,
    /// Copies a picture to the canvas: exposure, tone mapping and sRGB encoding.
    tone: TonePass,
}

impl Screen {
    /// Prepares the surface of the canvas and the tone pass. The surface has a format without automatic sRGB encoding,
    /// because the tone pass encodes sRGB itself.
    pub(super) fn new(gpu: &Gpu, adapter: &wgpu::Adapter, surface: wgpu::Surface<'static>) -> Result<Self, WebError> {
        let config = surface.get_default_config(adapter, 1, 1);
        let mut config = config.ok_or_else(|| WebError::NoWebGpu("the canvas takes no WebGPU".to_owned()))?;
        config.format = config.format.remove_srgb_suffix();
        // A width that no picture has, so that the first picture configures the surface.
        config.width = 0;
        let tone = TonePass::new(gpu.device(), config.format);
        Ok(Self { surface, config: RefCell::new(config), tone })
    }

    /// Draws the picture of `target` on the canvas, its radiance times 2^`stops`.
    pub(super) fn show(&self, gpu: &Gpu, target: &Target, stops: f64) -> Result<(), WebError> {
        let (width, height) = target.size();
        {
            let mut config = self.config.borrow_mut();
            if (config.width, config.height) != (width, height) {
                (config.width, config.height) = (width, height);
                self.surface.configure(gpu.device(), &config);
            }
        }
        let frame = match self.surface.get_current_texture() {
            wgpu::CurrentSurfaceTexture::Success(frame) | wgpu::CurrentSurfaceTexture::Suboptimal(frame) => frame,
            _ => {
                // The cause may be that the device is lost, which is a different error.
                gpu.check()?;
                return Err(WebError::Gpu("the canvas gives no texture to draw on".to_owned()));
            }
        };
        let view = frame.texture.create_view(&wgpu::TextureViewDescriptor::default());
        self.tone.draw(gpu.device(), gpu.queue(), target.picture(), width, &view, stops);
        gpu.queue().present(frame);
        Ok(())
    }
}
