use glam::{DVec2, DVec3, Vec2, Vec3};

use super::{SnakeError, SnakeOptions, body::Body, scales::Scales};

/// The snake as an indexed triangle mesh; one entry per vertex in the first four vectors.
///
/// Vertices lie in rows around the body, one row after the other from head to tail:
/// index `along · vertices_around + around`. See the module's page for orientation and units.
#[derive(Debug, Clone, PartialEq)]
pub struct SnakeMesh {
    /// Positions in cm; the ground is z = 0.
    pub positions: Vec<[f32; 3]>,
    /// Unit shading normals, outward: those of the scale on top, not smeared over the steps between scales.
    pub normals: Vec<[f32; 3]>,
    /// Unit tangents along the body towards the tail, orthogonal to the normals.
    pub tangents: Vec<[f32; 3]>,
    /// Texture coordinates in [0, 1]: u along the body, v around it.
    pub uvs: Vec<[f32; 2]>,
    /// Vertex indices of each triangle, counter-clockwise seen from outside.
    pub triangles: Vec<[u32; 3]>,
}

impl SnakeMesh {
    /// Builds the mesh: `vertices_along · vertices_around` vertices and two triangles per cell.
    ///
    /// # Errors
    /// [`SnakeError::Count`], [`SnakeError::Number`] or [`SnakeError::Bend`] for options out of range.
    pub fn build(options: &SnakeOptions) -> Result<Self, SnakeError> {
        options.check()?;
        let surface = Surface::new(options);
        let (along, around) = (options.vertices_along, options.vertices_around);
        let count = along * around;
        let mut mesh = Self {
            positions: Vec::with_capacity(count),
            normals: Vec::with_capacity(count),
            tangents: Vec::with_capacity(count),
            uvs: Vec::with_capacity(count),
            triangles: Vec::new(),
        };
        for i in 0..along {
            for j in 0..around {
                let (u, v) = (i as f64 / (along - 1) as f64, j as f64 / (around - 1) as f64);
                let (u, v) = surface.scales.snap(u, v, surface.cell);
                let vertex = surface.vertex(u, v);
                mesh.positions.push(vertex.position.as_vec3().to_array());
                mesh.normals.push(vertex.normal.as_vec3().to_array());
                mesh.tangents.push(vertex.tangent.as_vec3().to_array());
                mesh.uvs.push([u as f32, v as f32]);
            }
        }
        mesh.triangles = triangulate(&mesh.positions, &mesh.uvs, along, around);
        Ok(mesh)
    }
}

/// The skin with its scales.
pub(super) struct Surface {
    body: Body,
    pub(super) scales: Scales,
    /// Size of a cell of the mesh in `u` and `v`.
    cell: DVec2,
}

struct Vertex {
    position: DVec3,
    normal: DVec3,
    tangent: DVec3,
}

impl Surface {
    pub(super) fn new(options: &SnakeOptions) -> Self {
        // A row of scales runs along the top of the back; the sheet's rims lie under the belly.
        let centre_row = (options.rows_around / 2) as f64 / options.rows_around as f64;
        let body = Body::new(options, centre_row);
        let scales = Scales::new(options, body.width_cm());
        let cells = DVec2::new((options.vertices_along - 1) as f64, (options.vertices_around - 1) as f64);
        Self { body, scales, cell: 1.0 / cells }
    }

    /// The vertex at `u`, `v` in [0, 1] with its normal and tangent.
    ///
    /// The frame is that of the scale on top, continued beyond its free edge: a mean over the triangles
    /// around the vertex would smear the step at each free edge over both scales.
    fn vertex(&self, u: f64, v: f64) -> Vertex {
        let (point, normal) = self.body.point(u, v);
        let spot = self.scales.at(u, v);
        let scale = |u: f64, v: f64| {
            let (point, normal) = self.body.point(u, v);
            point + normal * self.scales.uncut_cm(spot.index, u, v)
        };
        let difference = |du: f64, dv: f64| {
            let (ahead, behind) = (DVec2::new(u + du, v + dv), DVec2::new(u - du, v - dv));
            let (ahead, behind) = (ahead.clamp(DVec2::ZERO, DVec2::ONE), behind.clamp(DVec2::ZERO, DVec2::ONE));
            scale(ahead.x, ahead.y) - scale(behind.x, behind.y)
        };
        // Over a cell in all, so that a keel narrower than a cell is smoothed, not sampled.
        let (along, around) = (difference(0.5 * self.cell.x, 0.0), difference(0.0, 0.5 * self.cell.y));
        let frame_normal = along.cross(around).normalize();
        Vertex { position: point + normal * spot.height_cm, normal: frame_normal, tangent: along.normalize() }
    }
}

/// A cut is refused when its thinner triangle is so much smaller than with the other cut.
const SLIVER: f64 = 0.3;

/// Two triangles per cell, cut along the shorter diagonal, which follows the edges of the scales; the
/// other one where snapped vertices have made the cell so skewed that the cut would leave a sliver.
fn triangulate(positions: &[[f32; 3]], uvs: &[[f32; 2]], along: usize, around: usize) -> Vec<[u32; 3]> {
    let mut triangles = Vec::with_capacity(2 * (along - 1) * (around - 1));
    for i in 0..along - 1 {
        for j in 0..around - 1 {
            let a = i * around + j;
            let (b, c, d) = (a + around, a + around + 1, a + 1);
            let distance =
                |from: usize, to: usize| Vec3::from(positions[from]).distance_squared(Vec3::from(positions[to]));
            let thinnest = |cut: [[usize; 3]; 2]| {
                let area = |[i, j, k]: [usize; 3]| {
                    let [p, q, r] = [uvs[i], uvs[j], uvs[k]].map(|uv| Vec2::from(uv).as_dvec2());
                    (q - p).perp_dot(r - p)
                };
                area(cut[0]).min(area(cut[1]))
            };
            let (first, second) = ([[a, b, c], [a, c, d]], [[a, b, d], [b, c, d]]);
            let (thin_first, thin_second) = (thinnest(first), thinnest(second));
            let cut = if thin_first < SLIVER * thin_second {
                second
            } else if thin_second < SLIVER * thin_first || distance(a, c) <= distance(b, d) {
                first
            } else {
                second
            };
            triangles.extend(cut.map(|triangle| triangle.map(|index| index as u32)));
        }
    }
    triangles
}
