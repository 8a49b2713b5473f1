// Finds the triangle that is in front at each pixel. Nothing is interpolated: what lies where on the triangle is worked
// out from the pixel's ray.

struct Corner {
    @builtin(position) position: vec4<f32>,
    @location(0) @interpolate(flat) triangle: u32,
}

@vertex
fn corner(@builtin(vertex_index) index: u32) -> Corner {
    let triangle = index / 3u;
    let offset = mesh_vertex(triangle, index % 3u).position - frame.origin;
    // The rasteriser looks at pixel centres; shifted so that the place the ray goes through is there.
    let shift = 2.0 * (vec2<f32>(0.5) - frame.place) / vec2<f32>(f32(frame.width), f32(frame.height));
    let depth = dot(offset, frame.forward);
    let x = dot(offset, frame.across) / dot(frame.across, frame.across) + shift.x * depth;
    let y = -dot(offset, frame.down) / dot(frame.down, frame.down) - shift.y * depth;
    // Depth is near/distance: 1 at the near plane, 0 at infinity, and accurate everywhere in floating point.
    return Corner(vec4<f32>(x, y, FRAME_NEAR, depth), triangle);
}

// The number of the triangle plus one; 0 is none.
@fragment
fn triangle_number(in: Corner) -> @location(0) u32 {
    return in.triangle + 1u;
}
