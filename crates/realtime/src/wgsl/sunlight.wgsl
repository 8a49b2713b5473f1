// The mesh as the sun sees it: a depth map, which tells for nearly every place whether the sun is seen from there.

struct Sunlight {
    // The middle of the mesh's box, texels along each side of the map.
    centre: vec3<f32>,
    side: f32,
    // Unit vectors along the map's rows, along its columns from the bottom, and to the sun; with half the extent of the
    // mesh's box along each.
    across: vec3<f32>,
    half_width: f32,
    up: vec3<f32>,
    half_height: f32,
    to_sun: vec3<f32>,
    half_depth: f32,
}

// The place in the map's box, −1 to 1 along each axis.
fn sunlight_place(sunlight: Sunlight, p: vec3<f32>) -> vec3<f32> {
    let offset = p - sunlight.centre;
    return vec3<f32>(
        dot(offset, sunlight.across) / sunlight.half_width,
        dot(offset, sunlight.up) / sunlight.half_height,
        dot(offset, sunlight.to_sun) / sunlight.half_depth,
    );
}
