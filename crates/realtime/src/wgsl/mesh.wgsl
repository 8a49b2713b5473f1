// The mesh.

// Position, shading normal and texture coordinates.
struct Vertex {
    position: vec3<f32>,
    u: f32,
    normal: vec3<f32>,
    v: f32,
}

@group(0) @binding(1) var<storage, read> vertices: array<Vertex>;
// Three vertex indices for each triangle.
@group(0) @binding(2) var<storage, read> triangles: array<u32>;

fn mesh_vertex(triangle: u32, corner: u32) -> Vertex {
    return vertices[triangles[3u * triangle + corner]];
}
