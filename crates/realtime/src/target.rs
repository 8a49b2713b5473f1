//! Memory of a picture on the GPU: textures of the rasteriser, buffers of the later stages (lib.rs), and the picture.

use super::layout::{self, Query};
use super::{Gpu, GpuError};
use bytemuck::{Pod, Zeroable};

/// Lengths of the lists of pixels: the members before `entries` of the struct `Lists` in `locate.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
pub(super) struct ListLengths {
    /// Number of queries (layout.rs) of sunlit skin, the surface of the mesh, whose reflectance the method computes.
    pub chosen: u32,
    /// Number of pixels that need a ray through the mesh's tree of bounding boxes, because rasteriser and depth map do
    /// not suffice.
    pub rest: u32,
    /// Number of pixels with a triangle of the rasteriser.
    pub skin: u32,
    /// Number of pixels without one.
    pub bare: u32,
}

impl ListLengths {
    /// Size of the struct in bytes.
    pub(crate) const BYTES: u64 = size_of::<Self>() as u64;
}

/// Bytes of list entries for each pixel: a u32 in `skin` or `bare`, and a u32 in `rest`.
const ENTRIES_BYTES_PER_PIXEL: u64 = size_of::<[u32; 2]>() as u64;
/// Bytes of a colour in `reflectances` and `picture`, a `vec4<f32>`.
const COLOUR_BYTES: u64 = size_of::<[f32; 4]>() as u64;
/// Bytes of a [`Query`].
const QUERY_BYTES: u64 = size_of::<Query>() as u64;
/// Accepted sides of a picture in pixels. A list entry has 16 bits each for column and row, so 65 536 would be
/// possible, but few adapters have textures above 16 384.
const SIDE: std::ops::RangeInclusive<u32> = 1..=16_384;

/// Format of [`Target::seen`].
pub(super) const SEEN_FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::R32Uint;
/// Format of depth maps.
pub(super) const DEPTH_FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Depth32Float;

/// All data of a picture on the GPU. Buffers with an entry for each pixel have rows from the top.
pub struct Target {
    width: u32,
    height: u32,
    /// Index, plus 1, of the triangle that the rasteriser found at each pixel; 0 for none.
    pub(super) seen: wgpu::TextureView,
    /// The rasteriser's depth buffer.
    pub(super) depth: wgpu::TextureView,
    /// A [`Query`] for each pixel.
    pub(super) queries: wgpu::Buffer,
    /// Indices (u32) of the queries counted by [`ListLengths::chosen`].
    pub(super) chosen: wgpu::Buffer,
    /// The struct `Lists` of `locate.wgsl`.
    pub(super) lists: wgpu::Buffer,
    /// The reflectance at each pixel, valid at those of `chosen`: a `vec4<f32>` with an unused fourth component.
    pub(super) reflectances: wgpu::Buffer,
    /// See [`Target::picture`].
    picture: wgpu::Buffer,
}

impl Target {
    /// A target for pictures of `width` × `height` pixels.
    ///
    /// # Errors
    /// [`GpuError::Parameter`] unless both sides are 1 to 16 384, [`GpuError::TooLarge`] or
    /// [`GpuError::TooWide`] where the adapter cannot hold the target, [`GpuError::Refused`], [`GpuError::Lost`].
    pub fn new(gpu: &Gpu, width: u32, height: u32) -> Result<Self, GpuError> {
        let side_max = gpu.device().limits().max_texture_dimension_2d;
        for (parameter, side) in [("width", width), ("height", height)] {
            if !SIDE.contains(&side) {
                return Err(GpuError::Parameter { parameter, found: side.to_string(), accepted: "1 to 16384 pixels" });
            }
            if side > side_max {
                let (needed, most) = (u64::from(side), u64::from(side_max));
                return Err(GpuError::TooWide { what: "the picture", needed, most, adapter: gpu.adapter() });
            }
        }
        let texture = |label, format, usage| {
            gpu.device().create_texture(&wgpu::TextureDescriptor {
                label: Some(label),
                size: wgpu::Extent3d { width, height, depth_or_array_layers: 1 },
                mip_level_count: 1,
                sample_count: 1,
                dimension: wgpu::TextureDimension::D2,
                format,
                usage,
                view_formats: &[],
            })
        };
        let drawn_into = wgpu::TextureUsages::RENDER_ATTACHMENT;
        let read_by_shaders = wgpu::TextureUsages::TEXTURE_BINDING;
        let view = |texture: &wgpu::Texture| texture.create_view(&wgpu::TextureViewDescriptor::default());
        let pixel_count = u64::from(width) * u64::from(height);
        let per_pixel = |label: &str, bytes: u64| {
            gpu.storage(&format!("{label} of {width} x {height} pixels"), pixel_count * bytes)
        };
        let target = Self {
            width,
            height,
            seen: view(&texture("seen", SEEN_FORMAT, drawn_into | read_by_shaders)),
            depth: view(&texture("depth", DEPTH_FORMAT, drawn_into)),
            queries: per_pixel("queries", QUERY_BYTES)?,
            chosen: per_pixel("chosen", size_of::<u32>() as u64)?,
            lists: gpu.storage("lists", ListLengths::BYTES + pixel_count * ENTRIES_BYTES_PER_PIXEL)?,
            reflectances: per_pixel("reflectances", COLOUR_BYTES)?,
            picture: per_pixel("picture", COLOUR_BYTES)?,
        };
        gpu.check()?;
        Ok(target)
    }

    /// Width and height in pixels.
    pub fn size(&self) -> (u32, u32) {
        (self.width, self.height)
    }

    /// Column and row of the pixel at a point of the picture, each coordinate in [0, 1) from the upper left; `None` for
    /// a point outside.
    pub fn pixel_at(&self, x: f64, y: f64) -> Option<(u32, u32)> {
        let inside = |coordinate: f64| (0.0..1.0).contains(&coordinate);
        // The product may be rounded up to `count`.
        let pixel = |coordinate: f64, count: u32| ((coordinate * f64::from(count)) as u32).min(count - 1);
        (inside(x) && inside(y)).then(|| (pixel(x, self.width), pixel(y, self.height)))
    }

    /// The picture on the GPU: a `vec4<f32>` for each pixel, rows from the top. Its components are the linear sRGB
    /// radiance, and 1 as the sum of the weights of all samples.
    pub fn picture(&self) -> &wgpu::Buffer {
        &self.picture
    }

    /// The picture, linear sRGB radiance, rows from the top.
    ///
    /// # Errors
    /// [`GpuError::Refused`], [`GpuError::Lost`].
    pub async fn read_picture_async(&self, gpu: &Gpu) -> Result<Vec<[f32; 3]>, GpuError> {
        let contents = gpu.read(&self.picture, self.pixel_count() * COLOUR_BYTES).await?;
        Ok(layout::colours(&contents))
    }

    /// The query of each pixel's last sample, rows from the top.
    ///
    /// # Errors
    /// [`GpuError::Refused`], [`GpuError::Lost`].
    pub async fn read_queries_async(&self, gpu: &Gpu) -> Result<Vec<Query>, GpuError> {
        let contents = gpu.read(&self.queries, self.pixel_count() * QUERY_BYTES).await?;
        Ok(contents.chunks_exact(size_of::<Query>()).map(bytemuck::pod_read_unaligned).collect())
    }

    /// The query of the last sample of a pixel; columns count from the left and rows from the top. The pixel must be in
    /// the picture: a column outside gives the query of another pixel.
    ///
    /// # Errors
    /// [`GpuError::Refused`], for instance for a row outside the picture, [`GpuError::Lost`].
    pub async fn read_query_async(&self, gpu: &Gpu, column: u32, row: u32) -> Result<Query, GpuError> {
        let index = u64::from(row) * u64::from(self.width) + u64::from(column);
        let staging = gpu.staging(QUERY_BYTES);
        let mut encoder = gpu.encoder();
        encoder.copy_buffer_to_buffer(&self.queries, index * QUERY_BYTES, &staging, 0, QUERY_BYTES);
        gpu.run(encoder)?;
        Ok(bytemuck::pod_read_unaligned(&gpu.read_staging(&staging).await?))
    }

    fn pixel_count(&self) -> u64 {
        u64::from(self.width) * u64::from(self.height)
    }
}
