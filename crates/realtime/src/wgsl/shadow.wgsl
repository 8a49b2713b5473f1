// Draws the mesh (mesh.wgsl) into the sun's depth map (sunlight.wgsl).

@group(0) @binding(0) var<uniform> sunlight: Sunlight;

// Clip position of a triangle corner; `index` counts the corners of all triangles, three for each. The depth is 1 on
// the sun's side of the map's box and 0 on the other side, so the depth test keeps the larger depth.
@vertex
fn sunlit_corner(@builtin(vertex_index) index: u32) -> @builtin(position) vec4<f32> {
    let position = sunlight_position(sunlight, mesh_vertex(index / 3u, index % 3u).position);
    return vec4<f32>(position.xy, 0.5 * position.z + 0.5, 1.0);
}
