use super::layout::Vertex;
use super::mesh::Mesh;
use super::sunlight::Sunlight;
use super::tree::tree;
use super::{Gpu, GpuError};
use crate::snake::PigmentTexture;

/// A mesh and its pigment on the GPU, ready to be seen from anywhere.
pub struct Scene {
    pub(super) vertices: wgpu::Buffer,
    pub(super) triangles: wgpu::Buffer,
    pub(super) nodes: wgpu::Buffer,
    pub(super) pigment: wgpu::Buffer,
    pub(super) sunlight: Sunlight,
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
            sunlight: Sunlight::new(gpu, mesh)?,
            // At most a thousand million triangles, which `check` has seen to.
            corners: 3 * mesh.triangles.len() as u32,
        })
    }

    /// Corners of triangles to draw.
    pub(super) fn corners(&self) -> u32 {
        self.corners
    }
}

/// Size, then a word for each texel.
fn upload(gpu: &Gpu, pigment: &PigmentTexture) -> Result<wgpu::Buffer, GpuError> {
    let size = [pigment.width as u32, pigment.height as u32];
    let texels = pigment.pixels.iter().map(|&[r, g, b]| u32::from_le_bytes([r, g, b, 255]));
    let words: Vec<u32> = size.into_iter().chain(texels).collect();
    gpu.storage_of("pigment", bytemuck::cast_slice(&words))
}
