use super::layout::Vertex;
use super::mesh::Mesh;
use super::tree::tree;
use super::{Gpu, GpuError};
use crate::snake::PigmentTexture;
use wgpu::util::{DeviceExt, TextureDataOrder};

/// A mesh and its pigment on the GPU, ready to be seen from anywhere.
pub struct Scene {
    pub(super) vertices: wgpu::Buffer,
    pub(super) triangles: wgpu::Buffer,
    pub(super) nodes: wgpu::Buffer,
    pub(super) pigment: wgpu::TextureView,
    corners: u32,
}

impl Scene {
    /// Uploads the mesh with a tree over its triangles, and the pigment.
    ///
    /// # Errors
    /// [`GpuError::Mesh`] as [`Mesh::check`], [`GpuError::TooLarge`], [`GpuError::TooWide`], [`GpuError::Refused`].
    pub fn new(gpu: &Gpu, mesh: &Mesh, pigment: &PigmentTexture) -> Result<Self, GpuError> {
        mesh.check()?;
        let vertices: Vec<Vertex> = (0..mesh.positions.len())
            .map(|i| Vertex {
                position: mesh.positions[i],
                u: mesh.uvs[i][0],
                normal: mesh.normals[i],
                v: mesh.uvs[i][1],
            })
            .collect();
        Ok(Self {
            vertices: gpu.storage_of("vertices", bytemuck::cast_slice(&vertices))?,
            triangles: gpu.storage_of("triangles", bytemuck::cast_slice(&mesh.triangles))?,
            nodes: gpu.storage_of("tree over the triangles", bytemuck::cast_slice(&tree(mesh)))?,
            pigment: upload(gpu, pigment)?,
            // At most a thousand million triangles, which `check` has seen to.
            corners: 3 * mesh.triangles.len() as u32,
        })
    }

    /// Corners of triangles to draw.
    pub(super) fn corners(&self) -> u32 {
        self.corners
    }
}

fn upload(gpu: &Gpu, pigment: &PigmentTexture) -> Result<wgpu::TextureView, GpuError> {
    let most = gpu.device().limits().max_texture_dimension_2d as usize;
    let (width, height) = (pigment.width, pigment.height);
    let side = width.max(height);
    if side > most {
        let (needed, most) = (side as u64, most as u64);
        return Err(GpuError::TooWide { what: "the pigment", needed, most, adapter: gpu.adapter() });
    }
    let pixels: Vec<[u8; 4]> = pigment.pixels.iter().map(|&[r, g, b]| [r, g, b, 255]).collect();
    let texture = gpu.device().create_texture_with_data(
        gpu.queue(),
        &wgpu::TextureDescriptor {
            label: Some("pigment"),
            // No larger than the limit, which is 32 bits.
            size: wgpu::Extent3d { width: width as u32, height: height as u32, depth_or_array_layers: 1 },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format: wgpu::TextureFormat::Rgba8Unorm,
            usage: wgpu::TextureUsages::TEXTURE_BINDING,
            view_formats: &[],
        },
        TextureDataOrder::default(),
        pixels.as_flattened(),
    );
    gpu.check()?;
    Ok(texture.create_view(&wgpu::TextureViewDescriptor::default()))
}
