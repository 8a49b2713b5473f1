// Rasteriser pass: writes the nearest triangle of each pixel into the texture that locate.wgsl reads as `seen`.
// Nothing is interpolated: locate.wgsl intersects the pixel's ray with the triangle.
//
// Clip coordinates come from the camera of frame.wgsl. With the offset o from the camera, they are
// x = o·right/|right|², y = -o·down/|down|² and w = o·forward. z is constant, the distance of the near plane. At w = 1,
// the ends of the vectors `right` and `down`, on the edges of the image plane, have x = 1 and y = -1.

// A triangle corner in clip space, with the triangle's index.
struct Corner {
    @builtin(position) position: vec4<f32>,
    @location(0) @interpolate(flat) triangle: u32,
}

// Vertex shader without vertex buffers: `index` counts the corners of all triangles, three for each.
@vertex
fn corner(@builtin(vertex_index) index: u32) -> Corner {
    let triangle = index / 3u;
    let offset = mesh_vertex(triangle, index % 3u).position - frame.origin;
    // The rasteriser samples pixel centres, but the ray passes through the position `subpixel` of the pixel. The shift,
    // in normalised device coordinates, moves the ray's position to the centre; y grows upwards there.
    let shift = 2.0 * (vec2<f32>(0.5) - frame.subpixel) / vec2<f32>(f32(frame.width), f32(frame.height));
    let depth = dot(offset, frame.forward);
    let x = dot(offset, frame.right) / dot(frame.right, frame.right) + shift.x * depth;
    let y = -dot(offset, frame.down) / dot(frame.down, frame.down) - shift.y * depth;
    // Depth is near/distance: 1 at the near plane, 0 at infinity, and accurate everywhere in floating point.
    return Corner(vec4<f32>(x, y, FRAME_NEAR_CM, depth), triangle);
}

// Index of the triangle plus 1; the texture is cleared to 0, which means no triangle.
@fragment
fn triangle_number(in: Corner) -> @location(0) u32 {
    return in.triangle + 1u;
}
