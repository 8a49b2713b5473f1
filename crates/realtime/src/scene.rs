use super::mesh::Mesh;
use super::scene_data::SceneData;
use super::sunlight::Sunlight;
use super::{Gpu, GpuError};
use crate::snake::PigmentTexture;

/// Texels along each side of the sun's depth map.
const SUNLIGHT_SIDE: u32 = 1024;
/// Texels along each side of the sun's depth map of a draft.
const DRAFT_SUNLIGHT_SIDE: u32 = 256;

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

    /// Uploads data that were prepared before.
    ///
    /// # Errors
    /// [`GpuError::TooLarge`], [`GpuError::TooWide`], [`GpuError::Refused`].
    pub fn of(gpu: &Gpu, data: &SceneData) -> Result<Self, GpuError> {
        Self::with_sunlight(gpu, data, SUNLIGHT_SIDE)
    }

    /// [`Scene::of`] with a coarser depth map of the sun, for pictures while the sun moves: edges of shadows are less
    /// exact.
    ///
    /// # Errors
    /// The errors of [`Scene::of`].
    pub fn draft(gpu: &Gpu, data: &SceneData) -> Result<Self, GpuError> {
        Self::with_sunlight(gpu, data, DRAFT_SUNLIGHT_SIDE)
    }

    fn with_sunlight(gpu: &Gpu, data: &SceneData, side: u32) -> Result<Self, GpuError> {
        Ok(Self {
            vertices: gpu.storage_of("vertices", data.vertices())?,
            triangles: gpu.storage_of("triangles", data.triangles())?,
            nodes: gpu.storage_of("tree over the triangles", data.nodes())?,
            pigment: gpu.storage_of("pigment", data.pigment())?,
            sunlight: Sunlight::new(gpu, data.bounds(), side)?,
            corners: data.corners(),
        })
    }

    /// Number of corners of all triangles.
    pub(super) fn corners(&self) -> u32 {
        self.corners
    }
}
