//! A scene on the GPU: mesh, tree of bounding boxes, pigment and the sun's depth map.
//!
//! The pigment is a texture, the diffuse colour below the relief. The depth map tells for most pixels whether the sun
//! is visible. For the others, a ray through the tree tells (locate.wgsl).

use super::mesh::Mesh;
use super::scene_data::SceneData;
use super::sunlight::Sunlight;
use super::{Gpu, GpuError};
use crate::snake::PigmentTexture;

/// Number of texels along each side of the sun's depth map, a multiple of 64 ([`Sunlight::new`]). A finer map takes
/// longer to draw; a coarser one leaves more pixels to rays.
const SUNLIGHT_SIDE: u32 = 1024;
/// Number of texels along each side of the sun's depth map of a draft ([`Scene::draft`]). The map is drawn again for
/// each picture while the sun moves, so its time matters more than its resolution.
const DRAFT_SUNLIGHT_SIDE: u32 = 256;

/// A mesh and its pigment on the GPU, to be drawn with any camera and sun.
pub struct Scene {
    /// Array of `Vertex` (mesh.wgsl).
    pub(super) vertices: wgpu::Buffer,
    /// Three vertex indices (u32) for each triangle.
    pub(super) triangles: wgpu::Buffer,
    /// Array of `Node` (trace.wgsl).
    pub(super) nodes: wgpu::Buffer,
    /// The struct `Pigment` (resolve.wgsl).
    pub(super) pigment: wgpu::Buffer,
    /// The sun's depth map, which [`super::Renderer`] draws when the sun has moved.
    pub(super) sunlight: Sunlight,
    /// Number of corners of all triangles, three for each.
    pub(super) corners: u32,
}

impl Scene {
    /// Builds the tree over the mesh's triangles and uploads mesh, tree and pigment.
    ///
    /// # Errors
    /// The errors of [`SceneData::new`] and [`Scene::of`].
    pub fn new(gpu: &Gpu, mesh: &Mesh, pigment: &PigmentTexture) -> Result<Self, GpuError> {
        Self::of(gpu, &SceneData::new(mesh, pigment)?)
    }

    /// Uploads data that [`SceneData::new`] has prepared.
    ///
    /// # Errors
    /// [`GpuError::TooLarge`], [`GpuError::Refused`], [`GpuError::Lost`].
    pub fn of(gpu: &Gpu, data: &SceneData) -> Result<Self, GpuError> {
        Self::with_sunlight(gpu, data, SUNLIGHT_SIDE)
    }

    /// [`Scene::of`] with a coarser depth map of the sun, for pictures while the sun moves. The map is drawn faster,
    /// but edges of shadows may be less exact.
    ///
    /// # Errors
    /// The errors of [`Scene::of`].
    pub fn draft(gpu: &Gpu, data: &SceneData) -> Result<Self, GpuError> {
        Self::with_sunlight(gpu, data, DRAFT_SUNLIGHT_SIDE)
    }

    /// Uploads data. The sun's depth map has `sunlight_side` texels along each side.
    fn with_sunlight(gpu: &Gpu, data: &SceneData, sunlight_side: u32) -> Result<Self, GpuError> {
        Ok(Self {
            vertices: gpu.storage_of("vertices", data.vertices())?,
            triangles: gpu.storage_of("triangles", data.triangles())?,
            nodes: gpu.storage_of("tree over the triangles", data.nodes())?,
            pigment: gpu.storage_of("pigment", data.pigment())?,
            sunlight: Sunlight::new(gpu, data.bounds(), sunlight_side)?,
            corners: data.corners(),
        })
    }
}
