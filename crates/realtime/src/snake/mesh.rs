//! The triangle mesh of the snake.
//!
//! The skin is a *sheet* (body.rs). Points (i, j) of its lattice are centres of scales where i + j is even, else
//! *nodes*, corners at which scales meet (lattice.rs). Each scale is a grid of n × n cells over its visible part
//! (patch.rs). The height of the scale (scales.rs) displaces the grid from the smooth body. Grid coordinates x and y
//! are 0 to n: (0, 0) is the root, (n, 0) the left flank, (0, n) the right flank, and (n, n) the tip.
//!
//! Scales share vertices only at the nodes of the lattice. Elsewhere a *wall* of triangles leads from each *free edge*
//! of a scale, a side towards the tail, down to the edge's *foot* on the scale below.

use std::collections::HashMap;

use glam::{DVec2, DVec3};

use super::{SnakeError, SnakeOptions, body::Body, patch::Patch, scales::Scales};

/// The snake as an indexed triangle mesh; the first four vectors have one entry per vertex. [`crate::snake`] defines
/// the orientation and the units.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct SnakeMesh {
    /// Positions in cm; the ground is z = 0.
    pub positions: Vec<[f32; 3]>,
    /// Unit shading normals, outward: those of the vertex's scale, not averaged over the steps between scales.
    pub normals: Vec<[f32; 3]>,
    /// Unit tangents along the body towards the tail, orthogonal to the normals.
    pub tangents: Vec<[f32; 3]>,
    /// Texture coordinates in [0, 1]: u along the body, v around it.
    pub uvs: Vec<[f32; 2]>,
    /// Vertex indices of each triangle, counter-clockwise seen from outside.
    pub triangles: Vec<[u32; 3]>,
}

impl SnakeMesh {
    /// Builds the mesh. A scale inside the sheet has two triangles in each of `n²` cells, where `n = 2·half_cells`. The
    /// walls below its two free edges are strips of n quadrilaterals, the first of which is a triangle. They have
    /// `4n − 2` triangles.
    ///
    /// ```
    /// use sunbeam_realtime::snake::{SnakeMesh, SnakeOptions};
    ///
    /// let mesh = SnakeMesh::build(&SnakeOptions { half_cells: 1, ..SnakeOptions::default() })?;
    /// assert_eq!(mesh.positions.len(), mesh.normals.len());
    /// assert!(mesh.positions.iter().all(|[_, _, z]| *z > -0.01));
    /// # Ok::<(), sunbeam_realtime::snake::SnakeError>(())
    /// ```
    ///
    /// # Errors
    /// [`SnakeError::Count`], [`SnakeError::Number`] or [`SnakeError::Bend`] for options out of range.
    pub fn build(options: &SnakeOptions) -> Result<Self, SnakeError> {
        options.check()?;
        let mut builder = Builder {
            surface: Surface::new(options),
            cells: 2 * options.half_cells,
            mesh: Self::default(),
            node_vertices: HashMap::new(),
            scale_vertices: HashMap::new(),
        };
        let (along, around) = (options.rows_along as i64, options.rows_around as i64);
        let centres = || (0..=along).flat_map(|i| (0..=around).map(move |j| (i, j))).filter(|(i, j)| (i + j) % 2 == 0);
        for scale in centres() {
            builder.add_vertices(scale);
        }
        for scale in centres() {
            builder.add_cells(scale);
            builder.add_walls(scale);
        }
        Ok(builder.mesh)
    }

    /// Adds a vertex and returns its index.
    fn push(&mut self, vertex: &Vertex) -> u32 {
        self.positions.push(vertex.position.as_vec3().to_array());
        self.normals.push(vertex.normal.as_vec3().to_array());
        self.tangents.push(vertex.tangent.as_vec3().to_array());
        self.uvs.push(vertex.uv.as_vec2().to_array());
        (self.positions.len() - 1) as u32
    }

    /// Adds a triangle, or a quadrilateral cut from the first to the third corner; nothing for fewer than three
    /// corners. Corners are counter-clockwise.
    fn add_polygon(&mut self, corners: &[u32]) {
        self.triangles.extend(corners.windows(2).skip(1).map(|pair| [corners[0], pair[0], pair[1]]));
    }
}

/// A mesh being built.
struct Builder {
    surface: Surface,
    /// Number n of cells along each side of a scale.
    cells: usize,
    mesh: SnakeMesh,
    /// Vertex of each node that has been added. Three scales share it; the tip of the fourth scale lies above the node
    /// and has a vertex of its own.
    node_vertices: HashMap<(i64, i64), u32>,
    /// Vertices of each scale, at the index `x · (n + 1) + y`; `None` beyond the sheet.
    scale_vertices: HashMap<(i64, i64), Vec<Option<u32>>>,
}

impl Builder {
    /// Adds the vertices of scale (i, j), except the nodes that another scale has added.
    fn add_vertices(&mut self, (i, j): (i64, i64)) {
        let n = self.cells;
        let patch = Patch::new(&self.surface.scales.lattice, (i, j));
        let mut indices = Vec::with_capacity((n + 1) * (n + 1));
        for x in 0..=n {
            for y in 0..=n {
                if !patch.covers(x, y, n) {
                    indices.push(None);
                    continue;
                }
                // The node at a corner of the grid. The tip lies above its node and is an ordinary vertex.
                let node = match (x, y) {
                    (0, 0) => Some((i - 1, j)),
                    (x, 0) if x == n => Some((i, j - 1)),
                    (0, y) if y == n => Some((i, j + 1)),
                    _ => None,
                };
                let index = if let Some(node) = node {
                    *self.node_vertices.entry(node).or_insert_with(|| self.mesh.push(&self.surface.node(node)))
                } else {
                    let point = patch.point(x as f64 / n as f64, y as f64 / n as f64);
                    self.mesh.push(&self.surface.vertex((i, j), point))
                };
                indices.push(Some(index));
            }
        }
        self.scale_vertices.insert((i, j), indices);
    }

    /// Index of the vertex (`x`, `y`) of a scale; `None` beyond the sheet.
    fn vertex_index(&self, scale: (i64, i64), x: usize, y: usize) -> Option<u32> {
        self.scale_vertices.get(&scale)?[x * (self.cells + 1) + y]
    }

    /// Adds the triangles of a scale's grid. A cell on the rim of the sheet has three corners on the sheet and is a
    /// single triangle.
    fn add_cells(&mut self, scale: (i64, i64)) {
        for x in 0..self.cells {
            for y in 0..self.cells {
                let cell = [(x, y), (x + 1, y), (x + 1, y + 1), (x, y + 1)];
                let mut corners = cell.map(|(x, y)| self.vertex_index(scale, x, y));
                // Cells are cut along the scale's axis, because scales bend more across it. The cell at the root is cut
                // the other way: its corner at the root is narrow.
                if (x, y) == (0, 0) {
                    corners.rotate_left(1);
                }
                let on_sheet: Vec<u32> = corners.into_iter().flatten().collect();
                self.mesh.add_polygon(&on_sheet);
            }
        }
    }

    /// Adds the walls below the two free edges of scale (i, j). Each is a strip from the flank, where edge and foot are
    /// the same vertex, to the tip.
    fn add_walls(&mut self, (i, j): (i64, i64)) {
        let n = self.cells;
        for t in 0..n {
            // Pairs of a vertex of the free edge and a vertex of its foot on the scale below. On the right the foot
            // comes first, so that both strips face outwards.
            let left = |t: usize| [self.vertex_index((i, j), n, t), self.vertex_index((i + 1, j - 1), 0, t)];
            let right = |t: usize| [self.vertex_index((i + 1, j + 1), t, 0), self.vertex_index((i, j), t, n)];
            for [pair, next_pair] in [[left(t), left(t + 1)], [right(t), right(t + 1)]] {
                // `None` if a corner lies beyond the sheet.
                let corners: Option<Vec<u32>> = [pair[0], pair[1], next_pair[1], next_pair[0]].into_iter().collect();
                if let Some(mut corners) = corners {
                    // At the flank, where `t` is 0, edge and foot have one vertex, so a triangle remains.
                    corners.dedup();
                    self.mesh.add_polygon(&corners);
                }
            }
        }
    }
}

/// The skin with its scales.
pub(super) struct Surface {
    body: Body,
    pub(super) scales: Scales,
    /// Extent of a cell's side along each axis of the lattice, in half scales (lattice.rs): 1/n.
    cell: f64,
}

/// A vertex of the mesh; [`SnakeMesh`] documents the members.
struct Vertex {
    position: DVec3,
    normal: DVec3,
    tangent: DVec3,
    uv: DVec2,
}

impl Surface {
    /// The skin that the options describe.
    pub(super) fn new(options: &SnakeOptions) -> Self {
        // A row of scales runs along the top of the back, so its v is a whole number of half scales over their count,
        // near ½.
        let back_v = (options.rows_around / 2) as f64 / options.rows_around as f64;
        let body = Body::new(options, back_v);
        let scales = Scales::new(options, body.width_cm());
        Self { body, scales, cell: 0.5 / options.half_cells as f64 }
    }

    /// The vertex of a scale at a point of the lattice, in half scales.
    ///
    /// Normal and tangent are those of the scale's surface, continued beyond its edges. A mean over the triangles
    /// around the vertex would average over the step at each free edge.
    fn vertex(&self, scale: (i64, i64), point: DVec2) -> Vertex {
        let size = self.scales.lattice.size();
        let position_at = |point: DVec2| {
            let inside = point.clamp(DVec2::ZERO, size);
            let uv = inside / size;
            let (skin, normal) = self.body.point(uv.x, uv.y);
            skin + normal * self.scales.height_cm(scale, inside)
        };
        // Central differences over the extent of a cell's side, so that a keel narrower than a cell is smoothed.
        let difference = |step: DVec2| position_at(point + step) - position_at(point - step);
        let along = difference(DVec2::new(0.5 * self.cell, 0.0));
        let around = difference(DVec2::new(0.0, 0.5 * self.cell));
        let uv = (point / size).clamp(DVec2::ZERO, DVec2::ONE);
        Vertex { position: position_at(point), normal: along.cross(around).normalize(), tangent: along.normalize(), uv }
    }

    /// The vertex of node (i, j), with the mean normal and tangent of the three scales that meet there on the skin.
    fn node(&self, (i, j): (i64, i64)) -> Vertex {
        let point = self.scales.lattice.node((i, j));
        let meeting = [(i, j - 1), (i, j + 1), (i + 1, j)].map(|scale| self.vertex(scale, point));
        let normal = meeting.iter().map(|vertex| vertex.normal).sum::<DVec3>().normalize();
        let tangent = meeting.iter().map(|vertex| vertex.tangent).sum::<DVec3>();
        let [vertex, ..] = meeting;
        Vertex { normal, tangent: tangent.reject_from_normalized(normal).normalize(), ..vertex }
    }
}
