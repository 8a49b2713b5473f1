// Buffers of the triangle mesh (mesh.rs).

// A vertex: position in cm, shading normal of any length but 0, and texture coordinates (u, v), which fill the padding
// of the vectors. Counterpart of `Vertex` in layout.rs.
struct Vertex {
    position: vec3<f32>,
    u: f32,
    normal: vec3<f32>,
    v: f32,
}

// All vertices of the mesh.
@group(0) @binding(1) var<storage, read> vertices: array<Vertex>;
// Three vertex indices for each triangle.
@group(0) @binding(2) var<storage, read> triangles: array<u32>;

// The vertex at a corner (0, 1 or 2) of a triangle.
fn mesh_vertex(triangle: u32, corner: u32) -> Vertex {
    return vertices[triangles[3u * triangle + corner]];
}
