//! Memory of a picture on the GPU: textures of the rasteriser, buffers of the later stages (lib.rs), and the picture.

use super::layout::Query;
use super::{Gpu, GpuError};

/// Bytes of the lists of `locate.wgsl` per pixel: a u32 of `skin` or `bare`, and a u32 of `rest`.
const LISTED_BYTES: u64 = size_of::<[u32; 2]>() as u64;
/// Accepted sides of a picture in pixels. A column or row fits in the 16 bits of an entry of the lists.
const SIDE: std::ops::RangeInclusive<u32> = 1..=16_384;

/// Format of the rasteriser's triangle numbers.
pub(super) const SEEN_FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::R32Uint;
/// Format of depth maps.
pub(super) const DEPTH_FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Depth32Float;

/// All data of a picture on the GPU.
pub struct Target {
    width: u32,
    height: u32,
    /// The rasteriser's triangle number plus 1 of each pixel.
    pub(super) seen: wgpu::TextureView,
    /// The rasteriser's depth buffer.
    pub(super) depth: wgpu::TextureView,
    /// One [`Query`] for each pixel.
    pub(super) queries: wgpu::Buffer,
    /// Indices of the queries that the method answers.
    pub(super) chosen: wgpu::Buffer,
    /// The struct `Lists` of `locate.wgsl`.
    pub(super) lists: wgpu::Buffer,
    /// The method's answers, four `f32` for each pixel.
    pub(super) reflectances: wgpu::Buffer,
    /// Radiance, four `f32` for each pixel.
    picture: wgpu::Buffer,
}

impl Target {
    /// Number of lists.
    pub(super) const LISTS: usize = 4;
    /// Bytes of the lists' lengths, which precede their entries.
    pub(super) const LIST_COUNTS_BYTES: u64 = size_of::<[u32; Self::LISTS]>() as u64;

    /// A target for pictures of `width` × `height` pixels.
    ///
    /// # Errors
    /// [`GpuError::Parameter`] unless both sides are 1 to 16 384, [`GpuError::TooLarge`] or
    /// [`GpuError::TooWide`] where the adapter cannot hold it.
    pub fn new(gpu: &Gpu, width: u32, height: u32) -> Result<Self, GpuError> {
        let most = gpu.device().limits().max_texture_dimension_2d;
        for (parameter, side) in [("width", width), ("height", height)] {
            if !SIDE.contains(&side) {
                return Err(GpuError::Parameter { parameter, found: side.to_string(), accepted: "1 to 16384 pixels" });
            }
            if side > most {
                let (needed, most) = (u64::from(side), u64::from(most));
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
        let drawn = wgpu::TextureUsages::RENDER_ATTACHMENT;
        let shown = wgpu::TextureUsages::TEXTURE_BINDING;
        let view = |texture: &wgpu::Texture| texture.create_view(&wgpu::TextureViewDescriptor::default());
        let per_pixel = |label: &str, bytes: usize| {
            gpu.storage(&format!("{label} of {width} x {height} pixels"), pixels(width, height) * bytes as u64)
        };
        let target = Self {
            width,
            height,
            seen: view(&texture("seen", SEEN_FORMAT, drawn | shown)),
            depth: view(&texture("depth", DEPTH_FORMAT, drawn)),
            queries: per_pixel("queries", size_of::<Query>())?,
            chosen: per_pixel("chosen", size_of::<u32>())?,
            lists: gpu.storage("lists", Self::LIST_COUNTS_BYTES + pixels(width, height) * LISTED_BYTES)?,
            reflectances: per_pixel("reflectances", size_of::<[f32; 4]>())?,
            picture: per_pixel("picture", size_of::<[f32; 4]>())?,
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
        let pixel = |coordinate: f64, count: u32| ((coordinate * f64::from(count)) as u32).min(count - 1);
        (inside(x) && inside(y)).then(|| (pixel(x, self.width), pixel(y, self.height)))
    }

    /// The picture on the GPU: four `f32` for each pixel, linear radiance and alpha 1, rows from the top.
    pub fn picture(&self) -> &wgpu::Buffer {
        &self.picture
    }

    /// The picture, linear sRGB radiance, rows from the top.
    ///
    /// # Errors
    /// [`GpuError::Refused`], [`GpuError::Lost`].
    pub async fn read_picture_async(&self, gpu: &Gpu) -> Result<Vec<[f32; 3]>, GpuError> {
        let bytes = pixels(self.width, self.height) * size_of::<[f32; 4]>() as u64;
        let contents = gpu.read(&self.picture, bytes).await?;
        let colour = |bytes: &[u8]| bytemuck::pod_read_unaligned::<[f32; 3]>(&bytes[..12]);
        Ok(contents.chunks_exact(16).map(colour).collect())
    }

    /// The query of each pixel's last ray, rows from the top.
    ///
    /// # Errors
    /// [`GpuError::Refused`], [`GpuError::Lost`].
    pub async fn read_queries_async(&self, gpu: &Gpu) -> Result<Vec<Query>, GpuError> {
        let bytes = pixels(self.width, self.height) * size_of::<Query>() as u64;
        let contents = gpu.read(&self.queries, bytes).await?;
        Ok(contents.chunks_exact(size_of::<Query>()).map(bytemuck::pod_read_unaligned).collect())
    }

    /// The query of one pixel's last ray, columns from the left and rows from the top.
    ///
    /// # Errors
    /// [`GpuError::Refused`], also for a pixel outside the picture, [`GpuError::Lost`].
    pub async fn read_query_async(&self, gpu: &Gpu, column: u32, row: u32) -> Result<Query, GpuError> {
        let bytes = size_of::<Query>() as u64;
        let index = u64::from(row) * u64::from(self.width) + u64::from(column);
        let staging = gpu.staging(bytes);
        let mut encoder = gpu.encoder();
        encoder.copy_buffer_to_buffer(&self.queries, index * bytes, &staging, 0, bytes);
        gpu.run(encoder).await?;
        Ok(bytemuck::pod_read_unaligned(&gpu.read_staging(&staging).await?))
    }
}

/// Number of pixels.
fn pixels(width: u32, height: u32) -> u64 {
    u64::from(width) * u64::from(height)
}
