//! The sun's depth map: an orthographic depth buffer of the mesh, seen from the sun.
//!
//! The map covers a box with one axis towards the sun that contains the mesh's bounding box. shadow.wgsl draws it, and
//! locate.wgsl reads it to decide whether the sun is visible. It is drawn again only when the sun has moved:
//! [`Sunlight::begins`], drawing, [`Sunlight::copy`], [`Sunlight::ends`].

use super::layout::SunlightUniform;
use super::target::DEPTH_FORMAT;
use super::{Gpu, GpuError};
use bytemuck::Zeroable;
use glam::DVec3;
use std::sync::{Mutex, PoisonError};

/// Width in texels of the empty border around the mesh. Chosen: the four texels around a point of the mesh always
/// exist, and a point outside the map is lit.
const MARGIN: f64 = 4.0;

/// The sun's depth map of the mesh, drawn again when the sun has moved.
pub(super) struct Sunlight {
    map: wgpu::Texture,
    /// Texels along each side of the map.
    side: u32,
    /// The map's depths, rows from the top.
    pub depths: wgpu::Buffer,
    /// The uniform struct [`SunlightUniform`].
    pub uniform: wgpu::Buffer,
    /// Opposite corners of the box around the mesh.
    low: DVec3,
    high: DVec3,
    /// Direction to the sun that the map is drawn for.
    drawn: Mutex<Option<[f64; 3]>>,
}

impl Sunlight {
    /// An empty map of `side`² texels for a mesh between these corners of a box; `side` is a multiple of 64.
    pub(crate) fn new(gpu: &Gpu, (low, high): (DVec3, DVec3), side: u32) -> Result<Self, GpuError> {
        let map = gpu.device().create_texture(&wgpu::TextureDescriptor {
            label: Some("sunlight"),
            size: wgpu::Extent3d { width: side, height: side, depth_or_array_layers: 1 },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format: DEPTH_FORMAT,
            usage: wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::COPY_SRC,
            view_formats: &[],
        });
        Ok(Self {
            map,
            side,
            depths: gpu.storage("sunlight", u64::from(side) * u64::from(side) * size_of::<f32>() as u64)?,
            uniform: gpu.uniform_of("sunlight", bytemuck::bytes_of(&SunlightUniform::zeroed()))?,
            low,
            high,
            drawn: Mutex::new(None),
        })
    }

    /// Prepares the map for the direction `to_sun`, a unit vector. Returns whether the map has to be drawn; the caller
    /// then draws it and calls [`Sunlight::ends`].
    pub(crate) fn begins(&self, gpu: &Gpu, to_sun: [f64; 3]) -> bool {
        let mut drawn = self.drawn.lock().unwrap_or_else(PoisonError::into_inner);
        if *drawn == Some(to_sun) {
            return false;
        }
        *drawn = None;
        gpu.queue().write_buffer(&self.uniform, 0, bytemuck::bytes_of(&self.frame(to_sun.into())));
        true
    }

    /// Records that the map is drawn for the direction `to_sun`.
    pub(crate) fn ends(&self, to_sun: [f64; 3]) {
        *self.drawn.lock().unwrap_or_else(PoisonError::into_inner) = Some(to_sun);
    }

    /// The render target of the map.
    pub(crate) fn view(&self) -> wgpu::TextureView {
        self.map.create_view(&wgpu::TextureViewDescriptor::default())
    }

    /// Copies the map into [`Sunlight::depths`].
    pub(crate) async fn copy(&self, gpu: &Gpu) -> Result<(), GpuError> {
        let mut encoder = gpu.encoder();
        let layout = wgpu::TexelCopyBufferLayout {
            offset: 0,
            bytes_per_row: Some(self.side * size_of::<f32>() as u32),
            rows_per_image: None,
        };
        let buffer = wgpu::TexelCopyBufferInfo { buffer: &self.depths, layout };
        encoder.copy_texture_to_buffer(self.map.as_image_copy(), buffer, self.map.size());
        gpu.run(encoder).await
    }

    /// The box around the mesh with an axis towards the sun.
    fn frame(&self, to_sun: DVec3) -> SunlightUniform {
        let centre = 0.5 * (self.low + self.high);
        let (right, up) = to_sun.any_orthonormal_pair();
        let half = 0.5 * (self.high - self.low);
        let margin = 1.0 + 2.0 * MARGIN / f64::from(self.side);
        // At least 1e-6 cm: the extents are divided by, also for a flat mesh.
        let extent = |axis: DVec3| (margin * axis.abs().dot(half)).max(1e-6) as f32;
        SunlightUniform {
            centre: centre.as_vec3().to_array(),
            side: self.side as f32,
            right: right.as_vec3().to_array(),
            half_width: extent(right),
            up: up.as_vec3().to_array(),
            half_height: extent(up),
            to_sun: to_sun.as_vec3().to_array(),
            half_depth: extent(to_sun),
        }
    }
}
