//! Shapes that carry the relief in a picture: the snake, a square and a sphere.

use super::{GpuError, Mesh};
use crate::snake::{BACK_REFLECTANCE, PigmentTexture, SnakeError, SnakeMesh, SnakeOptions, pigment_texture};
use serde::{Deserialize, Serialize};
use std::f64::consts::{PI, TAU};
use std::str::FromStr;
use sunbeam::colour::srgb_bytes;

/// Number of cells of the sphere around its axis and from pole to pole. Cells are square at the equator. More cells
/// make the outline rounder; fewer take less memory.
const SPHERE_CELLS: (u32, u32) = (192, 96);

/// A shape that carries the relief, in view of the default camera. Lengths are in cm; z is up.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Shape {
    /// The procedural snake of [`crate::snake`].
    #[default]
    Snake,
    /// A square just above the ground; the relief's x is +x.
    Flat,
    /// A sphere on the ground; the relief's x runs along the circles of latitude, counter-clockwise seen from above.
    Sphere,
}

impl Shape {
    /// All shapes, the default first.
    pub const ALL: [Self; 3] = [Self::Snake, Self::Flat, Self::Sphere];
    /// Linear sRGB reflectance of the pigment of square and sphere, that of the snake's back.
    pub const BARE_PIGMENT: [f64; 3] = BACK_REFLECTANCE;
    /// Middle of the square, in cm. In x and y it is the target of the default camera; its height keeps it clear of the
    /// ground.
    pub const FLAT_CENTRE_CM: [f64; 3] = [-1.0, 0.55, 0.05];
    /// Half the side of the square, in cm.
    pub const FLAT_HALF_SIDE_CM: f64 = 2.6;
    /// Middle of the sphere, in cm: above the square's middle, one radius over the ground.
    pub const SPHERE_CENTRE_CM: [f64; 3] = [-1.0, 0.55, 1.6];
    /// Radius of the sphere, in cm.
    pub const SPHERE_RADIUS_CM: f64 = 1.6;

    /// The name on the command line and in JSON.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Snake => "snake",
            Self::Flat => "flat",
            Self::Sphere => "sphere",
        }
    }

    /// The mesh, and the pigment for its texture coordinates.
    ///
    /// `resolution` multiplies the snake's cells in each direction ([`SnakeOptions::with_resolution`]). `pigment_size`
    /// is the size of the snake's texture in pixels along and around the body. The other shapes ignore both.
    ///
    /// # Errors
    /// The errors of [`SnakeMesh::build`] and [`pigment_texture`].
    pub fn make(self, resolution: f64, pigment_size: (usize, usize)) -> Result<(Mesh, PigmentTexture), SnakeError> {
        Ok(match self {
            Self::Snake => {
                let options = SnakeOptions::default().with_resolution(resolution);
                let pigment = pigment_texture(&options, pigment_size.0, pigment_size.1)?;
                (Mesh::from(&SnakeMesh::build(&options)?), pigment)
            }
            Self::Flat => (flat(), bare_pigment()),
            Self::Sphere => (sphere(), bare_pigment()),
        })
    }
}

impl FromStr for Shape {
    type Err = GpuError;

    fn from_str(name: &str) -> Result<Self, GpuError> {
        Self::ALL.into_iter().find(|shape| shape.name() == name).ok_or_else(|| GpuError::Parameter {
            parameter: "shape",
            found: format!("{name:?}"),
            accepted: "\"snake\", \"flat\" or \"sphere\"",
        })
    }
}

/// A texture of one texel with [`Shape::BARE_PIGMENT`].
fn bare_pigment() -> PigmentTexture {
    PigmentTexture { width: 1, height: 1, pixels: vec![srgb_bytes(Shape::BARE_PIGMENT)] }
}

/// The mesh of the square, with u along +x and v along +y.
fn flat() -> Mesh {
    let ([x, y, z], half) = (Shape::FLAT_CENTRE_CM, Shape::FLAT_HALF_SIDE_CM);
    let corner = |sign_x: f64, sign_y: f64| [x + sign_x * half, y + sign_y * half, z].map(|c| c as f32);
    Mesh {
        positions: vec![corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)],
        normals: vec![[0.0, 0.0, 1.0]; 4],
        uvs: vec![[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]],
        triangles: vec![[0, 1, 2], [0, 2, 3]],
    }
}

/// The mesh of the sphere: u in [0, 1] around the axis from +x towards +y, v in [0, 1] from the upper to the lower
/// pole.
fn sphere() -> Mesh {
    let (columns, rows) = SPHERE_CELLS;
    let mut mesh = Mesh::default();
    for row in 0..=rows {
        for column in 0..=columns {
            // A pole has a vertex for each column, in the middle of the column's range of u. No triangle has its last
            // vertex, at u > 1.
            let shift = if row == 0 || row == rows { 0.5 } else { 0.0 };
            let (u, v) = ((f64::from(column) + shift) / f64::from(columns), f64::from(row) / f64::from(rows));
            let ((sin_phi, cos_phi), (sin_theta, cos_theta)) = ((TAU * u).sin_cos(), (PI * v).sin_cos());
            let normal = [sin_theta * cos_phi, sin_theta * sin_phi, cos_theta];
            let coordinate = |axis: usize| Shape::SPHERE_CENTRE_CM[axis] + Shape::SPHERE_RADIUS_CM * normal[axis];
            mesh.positions.push([0, 1, 2].map(|axis| coordinate(axis) as f32));
            mesh.normals.push(normal.map(|component| component as f32));
            mesh.uvs.push([u as f32, v as f32]);
        }
    }
    for row in 0..rows {
        for column in 0..columns {
            let above = row * (columns + 1) + column;
            let below = above + columns + 1;
            // A cell at a pole is one triangle with the pole's vertex of the column; other cells are two triangles.
            let is_at_lower_pole = row + 1 == rows;
            if !is_at_lower_pole {
                mesh.triangles.push([above, below, below + 1]);
            }
            if row > 0 {
                mesh.triangles.push([above, if is_at_lower_pole { below } else { below + 1 }, above + 1]);
            }
        }
    }
    mesh
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;

    fn corners(mesh: &Mesh, triangle: [u32; 3]) -> [Vec3; 3] {
        triangle.map(|corner| Vec3::from(mesh.positions[corner as usize]))
    }

    #[test]
    fn shapes_can_be_drawn_and_triangles_face_outwards() {
        for shape in [Shape::Flat, Shape::Sphere] {
            let (mesh, pigment) = shape.make(1.0, (1, 1)).unwrap();
            mesh.check().unwrap();
            assert_eq!(pigment.pixels.len(), pigment.width * pigment.height);
            for &triangle in &mesh.triangles {
                let [a, b, c] = corners(&mesh, triangle);
                let normal = Vec3::from(mesh.normals[triangle[0] as usize]);
                let area = (b - a).cross(c - a);
                assert!(area.length() > 0.0 && area.dot(normal) > 0.0, "{shape:?} {triangle:?}");
            }
        }
    }

    #[test]
    fn the_sphere_is_closed_and_has_its_radius() {
        let (mesh, _) = Shape::Sphere.make(1.0, (1, 1)).unwrap();
        let area: f32 = mesh
            .triangles
            .iter()
            .map(|&triangle| {
                let [a, b, c] = corners(&mesh, triangle);
                0.5 * (b - a).cross(c - a).length()
            })
            .sum();
        let expected = 4.0 * PI * Shape::SPHERE_RADIUS_CM.powi(2);
        // Flat triangles have less area than the sphere, by a fraction of 2.2e-4. It grows as the square of the size of
        // a cell.
        assert!((f64::from(area) / expected - 1.0).abs() < 1e-3, "{area} {expected}");
        // The sphere touches the ground, but for rounding of f32.
        assert!(mesh.positions.iter().all(|position| position[2] > -1e-6));
    }

    #[test]
    fn u_grows_along_the_circles_of_latitude() {
        let (mesh, _) = Shape::Sphere.make(1.0, (1, 1)).unwrap();
        for &triangle in &mesh.triangles {
            let [a, b, c] = corners(&mesh, triangle);
            let [ua, ub, uc] = triangle.map(|corner| mesh.uvs[corner as usize]);
            let (du1, dv1, du2, dv2) = (ub[0] - ua[0], ub[1] - ua[1], uc[0] - ua[0], uc[1] - ua[1]);
            // ∂P/∂u, from two edges and their differences of texture coordinates.
            let tangent = ((b - a) * dv2 - (c - a) * dv1) / (du1 * dv2 - du2 * dv1);
            let [x, y, _] = ((a + b + c) / 3.0).to_array();
            let centre = Shape::SPHERE_CENTRE_CM.map(|coordinate| coordinate as f32);
            let east = Vec3::new(centre[1] - y, x - centre[0], 0.0);
            // A tangent towards the poles would give 0, a reversed one −1.
            assert!(tangent.normalize().dot(east.normalize()) > 0.99, "{triangle:?}");
        }
    }
}
