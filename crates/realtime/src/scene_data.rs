//! A scene as bytes in the layout of the GPU, which another thread or process (such as a worker of a browser) can
//! prepare.
//!
//! The bytes are a [`Header`] and four parts without padding: vertices (`Vertex` in layout.rs), vertex indices of the
//! triangles (three u32 each), tree nodes (`Node` in layout.rs), and the pigment texture (`Pigment` in resolve.wgsl),
//! the diffuse colour below the relief. Numbers have the byte order of the machine.

use super::GpuError;
use super::layout::{Node, Vertex};
use super::mesh::Mesh;
use super::tree::tree;
use crate::snake::PigmentTexture;
use bytemuck::{Pod, Zeroable};
use glam::{DVec3, Vec3};

/// A mesh with the tree over its triangles and its pigment, in the layout of the GPU. [`super::Scene::of`] uploads it.
/// No GPU is needed to build it.
#[derive(Clone, Debug, PartialEq)]
pub struct SceneData {
    /// The header and the parts.
    bytes: Vec<u8>,
    /// Copy of the header in `bytes`.
    header: Header,
}

/// Number of parts after the header.
const PARTS: usize = 4;
// Indices of the parts.
const VERTICES: usize = 0;
const TRIANGLES: usize = 1;
const NODES: usize = 2;
const PIGMENT: usize = 3;

/// Magic number, lengths of the parts, and bounding box of the mesh.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
struct Header {
    /// [`MAGIC`].
    magic: u32,
    /// Length of each part in bytes.
    lengths: [u32; PARTS],
    /// Lower corner of the bounding box in cm.
    low: [f32; 3],
    /// Upper corner of the bounding box in cm.
    high: [f32; 3],
}

/// Smallest number of u32 in the struct `Pigment` of `resolve.wgsl`, which takes at least 16 bytes: a `vec2<u32>` and
/// one texel are 12 bytes, rounded up to a multiple of 8, the alignment of the vector.
const PIGMENT_U32_MIN: usize = 4;
/// Magic number at the beginning of the bytes: the characters "sun1" on little-endian machines. Bytes of the other byte
/// order begin with another number, and are refused.
const MAGIC: u32 = u32::from_le_bytes(*b"sun1");

impl SceneData {
    /// Checks the mesh and builds the tree.
    ///
    /// # Errors
    /// The errors of [`Mesh::check`], and [`GpuError::Mesh`] for a part of 4 GiB or more.
    pub fn new(mesh: &Mesh, pigment: &PigmentTexture) -> Result<Self, GpuError> {
        mesh.check()?;
        let vertices: Vec<Vertex> = (0..mesh.positions.len())
            .map(|i| Vertex {
                position: mesh.positions[i],
                u: mesh.uvs[i][0],
                normal: mesh.normals[i],
                v: mesh.uvs[i][1],
            })
            .collect();
        let nodes: Vec<Node> = tree(mesh);
        let texture = pigment_struct(pigment);
        // The order is that of the indices `VERTICES`, `TRIANGLES`, `NODES`, `PIGMENT`.
        let parts: [&[u8]; PARTS] = [
            bytemuck::cast_slice(&vertices),
            bytemuck::cast_slice(&mesh.triangles),
            bytemuck::cast_slice(&nodes),
            bytemuck::cast_slice(&texture),
        ];
        let mut lengths = [0; PARTS];
        for (length, part) in lengths.iter_mut().zip(parts) {
            *length = u32::try_from(part.len()).map_err(|_| GpuError::Mesh {
                found: format!("{} triangles", mesh.triangles.len()),
                accepted: "less than 4 GiB each of vertices, triangles, tree nodes and pigment",
            })?;
        }
        let points = || mesh.positions.iter().map(|&position| Vec3::from(position));
        let header = Header {
            magic: MAGIC,
            lengths,
            low: points().fold(Vec3::INFINITY, Vec3::min).to_array(),
            high: points().fold(Vec3::NEG_INFINITY, Vec3::max).to_array(),
        };
        let mut bytes = bytemuck::bytes_of(&header).to_vec();
        for part in parts {
            bytes.extend_from_slice(part);
        }
        Ok(Self { bytes, header })
    }

    /// The scene of bytes from [`SceneData::into_bytes`]. The contents of the parts are not checked.
    ///
    /// # Errors
    /// [`GpuError::Mesh`] for another magic number, or a length that does not agree with the header.
    pub fn from_bytes(bytes: Vec<u8>) -> Result<Self, GpuError> {
        let refused = || GpuError::Mesh {
            found: format!("{} bytes of scene data", bytes.len()),
            accepted: "the magic number and the length that its header states",
        };
        let header_bytes = bytes.get(..size_of::<Header>()).ok_or_else(refused)?;
        let header = bytemuck::pod_read_unaligned::<Header>(header_bytes);
        let total = size_of::<Header>() as u64 + header.lengths.iter().map(|&length| u64::from(length)).sum::<u64>();
        if header.magic != MAGIC || total != bytes.len() as u64 {
            return Err(refused());
        }
        Ok(Self { bytes, header })
    }

    /// The bytes, for [`SceneData::from_bytes`].
    pub fn into_bytes(self) -> Vec<u8> {
        self.bytes
    }

    /// Array of [`Vertex`].
    pub(super) fn vertices(&self) -> &[u8] {
        self.part(VERTICES)
    }

    /// Three vertex indices (u32) for each triangle.
    pub(super) fn triangles(&self) -> &[u8] {
        self.part(TRIANGLES)
    }

    /// Array of [`Node`].
    pub(super) fn nodes(&self) -> &[u8] {
        self.part(NODES)
    }

    /// The struct `Pigment` of resolve.wgsl.
    pub(super) fn pigment(&self) -> &[u8] {
        self.part(PIGMENT)
    }

    /// Number of corners of all triangles, three for each.
    pub(super) fn corners(&self) -> u32 {
        self.header.lengths[TRIANGLES] / size_of::<u32>() as u32
    }

    /// Lower and upper corner of the mesh's bounding box in cm.
    pub(super) fn bounds(&self) -> (DVec3, DVec3) {
        (Vec3::from(self.header.low).as_dvec3(), Vec3::from(self.header.high).as_dvec3())
    }

    /// Bytes of the part with this index.
    fn part(&self, index: usize) -> &[u8] {
        let length = |index: usize| self.header.lengths[index] as usize;
        let start = size_of::<Header>() + (0..index).map(length).sum::<usize>();
        &self.bytes[start..start + length(index)]
    }
}

/// The struct `Pigment` of `resolve.wgsl`: width and height, then the encoded sRGB of each texel, row by row from v = 0
/// on. Red is in the lowest byte; the highest byte is not read.
fn pigment_struct(pigment: &PigmentTexture) -> Vec<u32> {
    // The sides are at most 16 384 pixels (`pigment_texture`), so they fit in 32 bits.
    let size = [pigment.width as u32, pigment.height as u32];
    let texels = pigment.pixels.iter().map(|&[r, g, b]| u32::from_le_bytes([r, g, b, 255]));
    let mut numbers: Vec<u32> = size.into_iter().chain(texels).collect();
    // A texture of one texel is padded to the size of the struct.
    numbers.resize(numbers.len().max(PIGMENT_U32_MIN), 0);
    numbers
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::snake::{SnakeMesh, SnakeOptions, pigment_texture};

    fn snake() -> SceneData {
        let options = SnakeOptions { half_cells: 1, ..Default::default() };
        let mesh = Mesh::from(&SnakeMesh::build(&options).unwrap());
        SceneData::new(&mesh, &pigment_texture(&options, 8, 4).unwrap()).unwrap()
    }

    #[test]
    fn bytes_give_back_their_scene() {
        let data = snake();
        assert_eq!(data.vertices().len() % size_of::<Vertex>(), 0);
        assert_eq!(data.nodes().len() % size_of::<Node>(), 0);
        assert_eq!(data.pigment().len(), 4 * (2 + 8 * 4));
        let (low, high) = data.bounds();
        assert!(low.cmplt(high).all());
        assert_eq!(SceneData::from_bytes(data.clone().into_bytes()).unwrap(), data);
    }

    #[test]
    fn a_single_texel_is_padded_to_the_struct_of_the_shader() {
        let texel = PigmentTexture { width: 1, height: 1, pixels: vec![[1, 2, 3]] };
        assert_eq!(pigment_struct(&texel), [1, 1, u32::from_le_bytes([1, 2, 3, 255]), 0]);
    }

    #[test]
    fn other_bytes_are_refused() {
        let bytes = snake().into_bytes();
        let mut longer = bytes.clone();
        longer.push(0);
        let mut other = bytes.clone();
        other[0] ^= 1;
        for wrong in [&bytes[..10], &bytes[..bytes.len() - 1], &longer, &other] {
            assert!(SceneData::from_bytes(wrong.to_vec()).unwrap_err().to_string().contains("bytes"));
        }
    }
}
