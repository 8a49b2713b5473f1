// Finds the triangle in front at each pixel. Nothing is interpolated: locate.wgsl intersects the pixel's ray with the
// triangle.

struct Corner {
    @builtin(position) position: vec4<f32>,
    @location(0) @interpolate(flat) triangle: u32,
}

@vertex
fn corner(@builtin(vertex_index) index: u32) -> Corner {
    let triangle = index / 3u;
    let offset = mesh_vertex(triangle, index % 3u).position - frame.origin;
    // The rasteriser samples pixel centres. The shift moves the sample of this ray there.
    let shift = 2.0 * (vec2<f32>(0.5) - frame.subpixel) / vec2<f32>(f32(frame.width), f32(frame.height));
    let depth = dot(offset, frame.forward);
    let x = dot(offset, frame.right) / dot(frame.right, frame.right) + shift.x * depth;
    let y = -dot(offset, frame.down) / dot(frame.down, frame.down) - shift.y * depth;
    // Depth is near/distance: 1 at the near plane, 0 at infinity, and accurate everywhere in floating point.
    return Corner(vec4<f32>(x, y, FRAME_NEAR, depth), triangle);
}

// The number of the triangle plus 1; 0 for none.
@fragment
fn triangle_number(in: Corner) -> @location(0) u32 {
    return in.triangle + 1u;
}
