//! The sun's depth map: an orthographic depth buffer of the mesh, seen from the sun.
//!
//! The map covers a box that contains the mesh's bounding box and has one axis towards the sun. shadow.wgsl draws the
//! map, and point.wgsl reads it to decide whether the sun is visible. The map is drawn again only when the sun has
//! moved. The renderer calls [`Sunlight::begin_drawing`]. If the result is true, it draws into [`Sunlight::view`] and
//! calls [`Sunlight::copy`] and [`Sunlight::end_drawing`].

use super::layout::SunlightUniform;
use super::target::DEPTH_FORMAT;
use super::{Gpu, GpuError};
use bytemuck::Zeroable;
use glam::DVec3;
use std::sync::{Mutex, MutexGuard, PoisonError};

/// Approximate width in texels of the empty border around the mesh's box. With a border, the four texels around a point
/// of the mesh always exist, and no mesh lies between the sun and a point beyond the map. The same factor enlarges
/// the box along the sun's direction, so that depths of the mesh exceed 0, the depth of an empty texel. A wider border
/// makes the texels larger.
const MARGIN_TEXELS: f64 = 4.0;
/// Smallest half extent of the map's box in cm. Positions are divided by the half extents, and one of them may be 0 for
/// a flat mesh.
const HALF_EXTENT_MIN_CM: f64 = 1e-6;

/// The sun's depth map of a mesh.
pub(super) struct Sunlight {
    /// The render target.
    map: wgpu::Texture,
    /// Number of texels along each side of the map.
    side: u32,
    /// Copy of the map for shaders: a `f32` for each texel, rows from the top. Depths increase towards the sun.
    pub depths: wgpu::Buffer,
    /// The uniform struct [`SunlightUniform`].
    pub uniform: wgpu::Buffer,
    /// Lower corner of the mesh's bounding box in cm.
    low: DVec3,
    /// Upper corner of the mesh's bounding box in cm.
    high: DVec3,
    /// Unit vector to the sun that the map was drawn for; `None` while the map is not complete.
    drawn_for: Mutex<Option<[f64; 3]>>,
}

impl Sunlight {
    /// An empty map of `side`² texels for a mesh whose bounding box has the corners `low` and `high` in cm. `side` is a
    /// multiple of 64 (scene.rs), because copied rows must have multiples of 256 bytes.
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
            drawn_for: Mutex::new(None),
        })
    }

    /// Prepares the uniform for the direction `to_sun`, a unit vector. Returns whether the map must be drawn: false if
    /// it is complete for this direction. A map that must be drawn counts as incomplete until
    /// [`Sunlight::end_drawing`], so that it is drawn again after an error.
    pub(crate) fn begin_drawing(&self, gpu: &Gpu, to_sun: [f64; 3]) -> bool {
        let mut drawn_for = self.lock();
        if *drawn_for == Some(to_sun) {
            return false;
        }
        *drawn_for = None;
        gpu.queue().write_buffer(&self.uniform, 0, bytemuck::bytes_of(&self.uniform_for(to_sun.into())));
        true
    }

    /// Records that the map is complete for the direction `to_sun`.
    pub(crate) fn end_drawing(&self, to_sun: [f64; 3]) {
        *self.lock() = Some(to_sun);
    }

    /// [`Sunlight::drawn_for`]; a panic of another thread leaves its value intact.
    fn lock(&self) -> MutexGuard<'_, Option<[f64; 3]>> {
        self.drawn_for.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The render target of the map.
    pub(crate) fn view(&self) -> wgpu::TextureView {
        self.map.create_view(&wgpu::TextureViewDescriptor::default())
    }

    /// Copies the map into [`Sunlight::depths`].
    pub(crate) fn copy(&self, gpu: &Gpu) -> Result<(), GpuError> {
        let mut encoder = gpu.encoder();
        let layout = wgpu::TexelCopyBufferLayout {
            offset: 0,
            bytes_per_row: Some(self.side * size_of::<f32>() as u32),
            rows_per_image: None,
        };
        let buffer = wgpu::TexelCopyBufferInfo { buffer: &self.depths, layout };
        encoder.copy_texture_to_buffer(self.map.as_image_copy(), buffer, self.map.size());
        gpu.run(encoder)
    }

    /// The map's box for the direction `to_sun`, a unit vector; the other two axes are arbitrary. The projection of the
    /// mesh's box on an axis extends from its centre by `Σ |axis_c|·half_diagonal_c` over the components c.
    fn uniform_for(&self, to_sun: DVec3) -> SunlightUniform {
        let centre = 0.5 * (self.low + self.high);
        let (right, up) = to_sun.any_orthonormal_pair();
        let half_diagonal = 0.5 * (self.high - self.low);
        let scale = 1.0 + 2.0 * MARGIN_TEXELS / f64::from(self.side);
        let half_extent = |axis: DVec3| (scale * axis.abs().dot(half_diagonal)).max(HALF_EXTENT_MIN_CM) as f32;
        SunlightUniform {
            centre: centre.as_vec3().to_array(),
            side: self.side as f32,
            right: right.as_vec3().to_array(),
            half_width: half_extent(right),
            up: up.as_vec3().to_array(),
            half_height: half_extent(up),
            to_sun: to_sun.as_vec3().to_array(),
            half_depth: half_extent(to_sun),
        }
    }
}
