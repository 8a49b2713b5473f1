//! Triangle meshes, and their PLY files. A PLY file has an element `vertex`, whose properties are named numbers, and an
//! element `face`, whose property is a list of vertex indices.

use super::GpuError;
use crate::snake::SnakeMesh;
use ply_rs_bw::parser::Parser;
use ply_rs_bw::ply::{Property, PropertyAccess};
use std::fs::File;
use std::io::BufReader;
use std::path::Path;

/// Triangles with normals and texture coordinates. The first three vectors have one entry per vertex.
///
/// ```
/// use sunbeam_realtime::Mesh;
///
/// let triangle = Mesh {
///     positions: vec![[0.0, 0.0, 1.0], [1.0, 0.0, 1.0], [0.0, 1.0, 1.0]],
///     normals: vec![[0.0, 0.0, 1.0]; 3],
///     uvs: vec![[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]],
///     triangles: vec![[0, 1, 2]],
/// };
/// assert!(triangle.check().is_ok());
/// ```
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Mesh {
    /// Positions in cm; z is up and the ground is z = 0.
    pub positions: Vec<[f32; 3]>,
    /// Shading normals of any length except 0.
    pub normals: Vec<[f32; 3]>,
    /// Texture coordinates (u, v). The tangent along growing u is the relief's x axis at a
    /// [`rotation`](super::View::rotation_deg) of 0.
    pub uvs: Vec<[f32; 2]>,
    /// Indices of vertices, counter-clockwise seen from outside.
    pub triangles: Vec<[u32; 3]>,
}

impl From<&SnakeMesh> for Mesh {
    fn from(snake: &SnakeMesh) -> Self {
        Self {
            positions: snake.positions.clone(),
            normals: snake.normals.clone(),
            uvs: snake.uvs.clone(),
            triangles: snake.triangles.clone(),
        }
    }
}

/// Largest number of triangles. Three corners and at most three tree nodes for each triangle (a leaf, and on average at
/// most two inner nodes; tree.rs) are counted in 32 bits.
const TRIANGLES_MAX: usize = 1_000_000_000;

/// Accepted names in PLY files of each property of a vertex: position, normal and texture coordinates.
const VERTEX_NAMES: [&[&str]; 8] = [&["x"], &["y"], &["z"], &["nx"], &["ny"], &["nz"], &["u", "s"], &["v", "t"]];
/// Accepted names of a face's list of vertex indices in PLY files.
const INDICES_NAMES: [&str; 2] = ["vertex_indices", "vertex_index"];

/// The properties of a vertex, in the order of [`VERTEX_NAMES`].
struct Vertex([f32; VERTEX_NAMES.len()]);

impl PropertyAccess for Vertex {
    fn new() -> Self {
        Self([0.0; VERTEX_NAMES.len()])
    }

    fn set_property(&mut self, name: &str, property: Property) {
        let Some(index) = VERTEX_NAMES.iter().position(|names| names.contains(&name)) else { return };
        self.0[index] = match property {
            Property::Float(value) => value,
            Property::Double(value) => value as f32,
            Property::Char(value) => f32::from(value),
            Property::UChar(value) => f32::from(value),
            Property::Short(value) => f32::from(value),
            Property::UShort(value) => f32::from(value),
            Property::Int(value) => value as f32,
            Property::UInt(value) => value as f32,
            // A list in place of a number. [`Mesh::check`] refuses NaN.
            _ => f32::NAN,
        };
    }
}

/// Vertex indices of a face.
struct Face(Vec<i64>);

impl PropertyAccess for Face {
    fn new() -> Self {
        Self(Vec::new())
    }

    fn set_property(&mut self, name: &str, property: Property) {
        if !INDICES_NAMES.contains(&name) {
            return;
        }
        self.0 = match property {
            Property::ListUInt(list) => list.into_iter().map(i64::from).collect(),
            Property::ListInt(list) => list.into_iter().map(i64::from).collect(),
            Property::ListUShort(list) => list.into_iter().map(i64::from).collect(),
            Property::ListShort(list) => list.into_iter().map(i64::from).collect(),
            Property::ListUChar(list) => list.into_iter().map(i64::from).collect(),
            Property::ListChar(list) => list.into_iter().map(i64::from).collect(),
            // Not a list of integers. [`parse`] refuses a face without corners.
            _ => Vec::new(),
        };
    }
}

impl Mesh {
    /// Reads a PLY file of triangles with normals (`nx`, `ny`, `nz`) and texture coordinates (`u`, `v` or `s`, `t`), as
    /// `sunbeam snake` writes it.
    ///
    /// # Errors
    /// [`GpuError::File`] for a file that cannot be read, lacks normals or texture coordinates, or has faces other than
    /// triangles. The errors of [`Mesh::check`].
    pub fn read_ply(path: impl AsRef<Path>) -> Result<Self, GpuError> {
        let path = path.as_ref();
        let mesh = parse(path).map_err(|reason| GpuError::File { path: path.to_owned(), reason })?;
        mesh.check()?;
        Ok(mesh)
    }

    /// Refuses a mesh that cannot be drawn.
    ///
    /// # Errors
    /// [`GpuError::Mesh`] for vectors of different lengths, no triangles or more than 10⁹, indices out of
    /// range, numbers that are not finite, or a normal of length 0.
    pub fn check(&self) -> Result<(), GpuError> {
        let refuse = |found: String, accepted| Err(GpuError::Mesh { found, accepted });
        let count = self.positions.len();
        if self.normals.len() != count || self.uvs.len() != count {
            let found = format!("{count} positions, {} normals, {} uvs", self.normals.len(), self.uvs.len());
            return refuse(found, "one normal and one pair of texture coordinates for each position");
        }
        if self.triangles.is_empty() || self.triangles.len() > TRIANGLES_MAX {
            return refuse(format!("{} triangles", self.triangles.len()), "1 to 1 000 000 000 triangles");
        }
        if let Some(index) = self.triangles.as_flattened().iter().find(|&&index| index as usize >= count) {
            return refuse(format!("a triangle with vertex {index} of {count}"), "indices of its vertices");
        }
        let vectors = self.positions.as_flattened().iter().chain(self.normals.as_flattened());
        if vectors.chain(self.uvs.as_flattened()).any(|number| !number.is_finite()) {
            return refuse("a number that is not finite".to_owned(), "finite numbers only");
        }
        if self.normals.contains(&[0.0; 3]) {
            return refuse("a normal of length 0".to_owned(), "normals of non-zero length");
        }
        Ok(())
    }
}

/// Reads a PLY file without checking the mesh; the error is the reason without the path.
fn parse(path: &Path) -> Result<Mesh, String> {
    let unreadable = |error: std::io::Error| format!("cannot be read as PLY: {error}");
    let mut reader = BufReader::new(File::open(path).map_err(|error| format!("cannot be opened: {error}"))?);
    let header = Parser::<Vertex>::new().read_header(&mut reader).map_err(unreadable)?;
    let mut mesh = Mesh::default();
    for (name, element) in &header.elements {
        let has = |names: &[&str]| names.iter().any(|name| element.properties.contains_key(*name));
        match name.as_str() {
            "vertex" => {
                if let Some(missing) = VERTEX_NAMES.iter().find(|names| !has(names)) {
                    return Err(format!(
                        "its vertices lack {:?}; normals and texture coordinates are needed",
                        missing[0]
                    ));
                }
                let read = Parser::<Vertex>::new().read_payload_for_element(&mut reader, element, &header);
                for Vertex([x, y, z, nx, ny, nz, u, v]) in read.map_err(unreadable)? {
                    mesh.positions.push([x, y, z]);
                    mesh.normals.push([nx, ny, nz]);
                    mesh.uvs.push([u, v]);
                }
            }
            "face" => {
                let read = Parser::<Face>::new().read_payload_for_element(&mut reader, element, &header);
                for Face(corners) in read.map_err(unreadable)? {
                    let corner = |i: usize| corners.get(i).and_then(|&index| u32::try_from(index).ok());
                    match (corners.len(), corner(0), corner(1), corner(2)) {
                        (3, Some(a), Some(b), Some(c)) => mesh.triangles.push([a, b, c]),
                        _ => return Err(format!("a face has the corners {corners:?}; only triangles are drawn")),
                    }
                }
            }
            _ => {
                // Reads past an unknown element; the type of the parser does not matter.
                let skipped = Parser::<Face>::new().read_payload_for_element(&mut reader, element, &header);
                skipped.map_err(unreadable)?;
            }
        }
    }
    Ok(mesh)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::snake::SnakeOptions;

    #[test]
    fn a_written_snake_is_read_back_bit_for_bit() {
        let options = SnakeOptions { half_cells: 1, ..Default::default() };
        let snake = SnakeMesh::build(&options).unwrap();
        let file = tempfile::Builder::new().suffix(".ply").tempfile().unwrap();
        snake.write_ply(file.path()).unwrap();
        assert_eq!(Mesh::read_ply(file.path()).unwrap(), Mesh::from(&snake));
    }

    #[test]
    fn errors_name_the_fault_of_a_mesh() {
        let read = |text: &str| {
            let file = tempfile::Builder::new().suffix(".ply").tempfile().unwrap();
            std::fs::write(file.path(), text).unwrap();
            Mesh::read_ply(file.path()).unwrap_err().to_string()
        };
        assert!(read("not a mesh\n").contains("PLY"));
        let bare = "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\n\
                    end_header\n0 0 0\n";
        assert!(read(bare).contains("\"nx\""));
        let quad =
            "ply\nformat ascii 1.0\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n4 0 1 2 3\n";
        assert!(read(quad).contains("only triangles"));
        assert!(Mesh::read_ply("no/such.ply").unwrap_err().to_string().contains("no/such.ply"));
        let mut mesh = Mesh {
            positions: vec![[0.0; 3]; 3],
            normals: vec![[0.0, 0.0, 1.0]; 3],
            uvs: vec![[0.0; 2]; 3],
            triangles: vec![[0, 1, 3]],
        };
        assert!(mesh.check().unwrap_err().to_string().contains("vertex 3 of 3"));
        mesh.triangles = vec![[0, 1, 2]];
        mesh.check().unwrap();
        mesh.positions[1][2] = f32::NAN;
        assert!(mesh.check().unwrap_err().to_string().contains("finite"));
        mesh.triangles.clear();
        assert!(mesh.check().unwrap_err().to_string().contains("0 triangles"));
    }
}
