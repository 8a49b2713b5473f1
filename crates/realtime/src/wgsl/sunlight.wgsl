// Box and axes of the sun's depth map, an orthographic projection of the mesh along the sun's direction. shadow.wgsl
// draws the map, and locate.wgsl reads it to decide for nearly every point whether the sun is visible. Lengths are in
// cm.

// Counterpart of `SunlightUniform` in layout.rs; sunlight.rs computes the box. `right`, `up` and `to_sun` are
// orthogonal.
struct Sunlight {
    // Centre of the map's box, which bounds the mesh.
    centre: vec3<f32>,
    // Number of texels along each side of the map.
    side: f32,
    // Unit vector along the map's rows, and half the box's extent along it.
    right: vec3<f32>,
    half_width: f32,
    // Unit vector along the map's columns from the bottom, and half the box's extent along it.
    up: vec3<f32>,
    half_height: f32,
    // Unit vector to the sun, and half the box's extent along it.
    to_sun: vec3<f32>,
    half_depth: f32,
}

// The position of a point in the map's box, -1 to 1 along each axis.
fn sunlight_position(sunlight: Sunlight, p: vec3<f32>) -> vec3<f32> {
    let offset = p - sunlight.centre;
    return vec3<f32>(
        dot(offset, sunlight.right) / sunlight.half_width,
        dot(offset, sunlight.up) / sunlight.half_height,
        dot(offset, sunlight.to_sun) / sunlight.half_depth,
    );
}
