//! A scene as bytes in the layout of the GPU, which another thread or process can prepare.
//!
//! The bytes are a [`Header`] and four parts: vertices and tree nodes (layout.rs), vertex indices of the triangles
//! (three u32 each), and the pigment texture (`Pigment` in resolve.wgsl). The order is vertices, triangles, nodes,
//! pigment.

use super::GpuError;
use super::layout::{Node, Vertex};
use super::mesh::Mesh;
use super::tree::tree;
use crate::snake::PigmentTexture;
use bytemuck::{Pod, Zeroable};
use glam::DVec3;

/// A mesh, the tree over its triangles and its pigment, in the layout of the GPU, for [`super::Scene::of`]. It is built
/// without a GPU, so that another thread or process can build it and hand over the bytes.
#[derive(Clone, Debug, PartialEq)]
pub struct SceneData {
    /// The header, then the parts that it counts.
    bytes: Vec<u8>,
    header: Header,
}

/// Magic number, length of each part in bytes, and bounding box of the mesh in cm.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
struct Header {
    /// [`MAGIC`].
    magic: u32,
    vertices: u32,
    triangles: u32,
    nodes: u32,
    pigment: u32,
    /// Opposite corners of the box around the mesh.
    low: [f32; 3],
    high: [f32; 3],
}

/// Smallest number of u32 of a texture. The struct in `resolve.wgsl` is at least 16 bytes: its size, 12 bytes, is
/// rounded up to a multiple of 8.
const PIGMENT_WORDS_MIN: usize = 4;
/// Magic number at the beginning of the bytes, the characters "sun1".
const MAGIC: u32 = u32::from_le_bytes(*b"sun1");

impl SceneData {
    /// Checks the mesh and builds the tree.
    ///
    /// # Errors
    /// [`GpuError::Mesh`] as [`Mesh::check`], and for more bytes than 32 bits count.
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
        let pigment = words(pigment);
        let parts: [&[u8]; 4] = [
            bytemuck::cast_slice(&vertices),
            bytemuck::cast_slice(&mesh.triangles),
            bytemuck::cast_slice(&nodes),
            bytemuck::cast_slice(&pigment),
        ];
        let too_large = || GpuError::Mesh {
            found: format!("{} triangles", mesh.triangles.len()),
            accepted: "fewer than 4 GB of them",
        };
        let length = |part: usize| u32::try_from(parts[part].len()).map_err(|_| too_large());
        let points = || mesh.positions.iter().map(|&position| glam::Vec3::from(position));
        let header = Header {
            magic: MAGIC,
            vertices: length(0)?,
            triangles: length(1)?,
            nodes: length(2)?,
            pigment: length(3)?,
            low: points().fold(glam::Vec3::INFINITY, glam::Vec3::min).to_array(),
            high: points().fold(glam::Vec3::NEG_INFINITY, glam::Vec3::max).to_array(),
        };
        let mut bytes = bytemuck::bytes_of(&header).to_vec();
        for part in parts {
            bytes.extend_from_slice(part);
        }
        Ok(Self { bytes, header })
    }

    /// The scene of bytes from [`SceneData::into_bytes`].
    ///
    /// # Errors
    /// [`GpuError::Mesh`] for bytes that are no scene.
    pub fn from_bytes(bytes: Vec<u8>) -> Result<Self, GpuError> {
        let refused = || GpuError::Mesh {
            found: format!("{} bytes", bytes.len()),
            accepted: "the number of bytes in its header",
        };
        let head = bytes.get(..size_of::<Header>()).ok_or_else(refused)?;
        let header = bytemuck::pod_read_unaligned::<Header>(head);
        let counted = [header.vertices, header.triangles, header.nodes, header.pigment];
        let whole: u64 = counted.into_iter().map(u64::from).sum::<u64>() + size_of::<Header>() as u64;
        if header.magic != MAGIC || whole != bytes.len() as u64 {
            return Err(refused());
        }
        Ok(Self { bytes, header })
    }

    /// The bytes, for [`SceneData::from_bytes`].
    pub fn into_bytes(self) -> Vec<u8> {
        self.bytes
    }

    pub(super) fn vertices(&self) -> &[u8] {
        self.part(&[], self.header.vertices)
    }

    pub(super) fn triangles(&self) -> &[u8] {
        self.part(&[self.header.vertices], self.header.triangles)
    }

    pub(super) fn nodes(&self) -> &[u8] {
        self.part(&[self.header.vertices, self.header.triangles], self.header.nodes)
    }

    pub(super) fn pigment(&self) -> &[u8] {
        self.part(&[self.header.vertices, self.header.triangles, self.header.nodes], self.header.pigment)
    }

    /// Number of corners of all triangles.
    pub(super) fn corners(&self) -> u32 {
        self.header.triangles / size_of::<u32>() as u32
    }

    /// Opposite corners of the box around the mesh.
    pub(super) fn bounds(&self) -> (DVec3, DVec3) {
        let corner = |point: [f32; 3]| DVec3::from(point.map(f64::from));
        (corner(self.header.low), corner(self.header.high))
    }

    /// The part of `bytes` bytes that follows parts with the lengths `before`.
    fn part(&self, before: &[u32], bytes: u32) -> &[u8] {
        let start = size_of::<Header>() + before.iter().map(|&bytes| bytes as usize).sum::<usize>();
        &self.bytes[start..start + bytes as usize]
    }
}

/// The pigment for `resolve.wgsl`: width and height, then one word per texel.
fn words(pigment: &PigmentTexture) -> Vec<u32> {
    let size = [pigment.width as u32, pigment.height as u32];
    let texels = pigment.pixels.iter().map(|&[r, g, b]| u32::from_le_bytes([r, g, b, 255]));
    let mut words: Vec<u32> = size.into_iter().chain(texels).collect();
    // A texture of one texel is shorter than the struct of the shader.
    words.resize(words.len().max(PIGMENT_WORDS_MIN), 0);
    words
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
        assert_eq!(words(&texel), [1, 1, u32::from_le_bytes([1, 2, 3, 255]), 0]);
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
