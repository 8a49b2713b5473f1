use super::mesh::Mesh;
use super::scene_data::SceneData;
use super::sunlight::Sunlight;
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
        Self::of(gpu, &SceneData::new(mesh, pigment)?)
    }

    /// As [`Scene::new`] of what was made ready before.
    ///
    /// # Errors
    /// [`GpuError::TooLarge`], [`GpuError::TooWide`], [`GpuError::Refused`].
    pub fn of(gpu: &Gpu, data: &SceneData) -> Result<Self, GpuError> {
        Ok(Self {
            vertices: gpu.storage_of("vertices", data.vertices())?,
            triangles: gpu.storage_of("triangles", data.triangles())?,
            nodes: gpu.storage_of("tree over the triangles", data.nodes())?,
            pigment: gpu.storage_of("pigment", data.pigment())?,
            sunlight: Sunlight::new(gpu, data.bounds())?,
            corners: data.corners(),
        })
    }

    /// Corners of triangles to draw.
    pub(super) fn corners(&self) -> u32 {
        self.corners
    }
}
