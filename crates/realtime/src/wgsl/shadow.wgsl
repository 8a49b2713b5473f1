// Draws the depth map of sunlight.wgsl.

@group(0) @binding(0) var<uniform> sunlight: Sunlight;

// Depth is 1 at the sun's end of the box and 0 at the other.
@vertex
fn sunlit_corner(@builtin(vertex_index) index: u32) -> @builtin(position) vec4<f32> {
    let place = sunlight_place(sunlight, mesh_vertex(index / 3u, index % 3u).position);
    return vec4<f32>(place.xy, 0.5 * place.z + 0.5, 1.0);
}
