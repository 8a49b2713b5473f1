//! The snake's mesh as a PLY file, which Mitsuba and [`crate::Mesh::read_ply`] read.

use std::{fs, io, path::Path};

use ply_rs_bw::{
    ply::{Addable, ElementDef, Encoding, Header, PropertyAccess, PropertyDef, PropertyType, ScalarType},
    writer::Writer,
};

use super::{SnakeError, SnakeMesh};

/// Names of a vertex's properties.
const VERTEX_PROPERTIES: [&str; 11] =
    ["x", "y", "z", "nx", "ny", "nz", "u", "v", "tangent_x", "tangent_y", "tangent_z"];

/// The properties of a vertex, in the order of [`VERTEX_PROPERTIES`].
struct Vertex([f32; VERTEX_PROPERTIES.len()]);

impl PropertyAccess for Vertex {
    fn new() -> Self {
        Self([0.0; VERTEX_PROPERTIES.len()])
    }

    fn get_float(&self, name: &str) -> Option<f32> {
        VERTEX_PROPERTIES.iter().position(|&known| known == name).map(|i| self.0[i])
    }
}

/// Vertex indices of a triangle.
struct Face([i32; 3]);

impl PropertyAccess for Face {
    fn new() -> Self {
        Self([0; 3])
    }

    fn get_list_int(&self, name: &str) -> Option<&[i32]> {
        (name == "vertex_indices").then_some(&self.0)
    }
}

impl SnakeMesh {
    /// Writes the mesh as a binary little-endian PLY file: positions in cm, normals, texture coordinates, and tangents
    /// along the body. Mitsuba 3 offers `tangent_x`, `tangent_y`, `tangent_z` as the mesh attribute `vertex_tangent`.
    ///
    /// # Errors
    /// [`SnakeError::Write`] when the file cannot be written.
    pub fn write_ply(&self, path: impl AsRef<Path>) -> Result<(), SnakeError> {
        let path = path.as_ref();
        self.encode_ply()
            .and_then(|bytes| fs::write(path, bytes))
            .map_err(|source| SnakeError::Write { path: path.to_owned(), source })
    }

    /// The bytes of [`SnakeMesh::write_ply`].
    fn encode_ply(&self) -> io::Result<Vec<u8>> {
        let mut vertex = ElementDef::new("vertex".to_owned());
        vertex.count = self.positions.len();
        for name in VERTEX_PROPERTIES {
            vertex.properties.add(PropertyDef::new(name.to_owned(), PropertyType::Scalar(ScalarType::Float)));
        }
        let mut face = ElementDef::new("face".to_owned());
        face.count = self.triangles.len();
        let indices = PropertyType::List(ScalarType::UChar, ScalarType::Int);
        face.properties.add(PropertyDef::new("vertex_indices".to_owned(), indices));

        let mut header = Header::new();
        header.encoding = Encoding::BinaryLittleEndian;
        header.comments.push("sunbeam snake; 1 unit = 1 cm, z up, u along the body".to_owned());
        header.elements.add(vertex.clone());
        header.elements.add(face.clone());

        // A vertex takes 11 f32, and a triangle a count byte and three i32. The header is shorter than 1024 bytes.
        let mut bytes = Vec::with_capacity(1024 + 44 * vertex.count + 13 * face.count);
        let vertices = Writer::<Vertex>::new();
        vertices.write_header(&mut bytes, &header)?;
        for i in 0..self.positions.len() {
            let ([x, y, z], [nx, ny, nz]) = (self.positions[i], self.normals[i]);
            let ([u, v], [tx, ty, tz]) = (self.uvs[i], self.tangents[i]);
            let record = Vertex([x, y, z, nx, ny, nz, u, v, tx, ty, tz]);
            vertices.write_little_endian_element(&mut bytes, &record, &vertex)?;
        }
        let faces = Writer::<Face>::new();
        for triangle in &self.triangles {
            // The largest accepted options (options.rs) have fewer than 1.4·10⁹ vertices, so indices are below 2³¹.
            let record = Face(triangle.map(|index| index as i32));
            faces.write_little_endian_element(&mut bytes, &record, &face)?;
        }
        Ok(bytes)
    }
}
