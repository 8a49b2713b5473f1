// Box and axes of the sun's depth map, an orthographic projection of the mesh along the sun's direction. shadow.wgsl
// draws the map, and point.wgsl reads it to decide for nearly every point whether the sun is visible.

// The map's box, which bounds the mesh. Counterpart of `SunlightUniform` in layout.rs; sunlight.rs computes the box.
// `right`, `up` and `to_sun` are orthogonal unit vectors. Lengths are in cm.
struct Sunlight {
    // Centre of the box.
    centre: vec3<f32>,
    // Number of texels along each side of the map, a whole number.
    side: f32,
    // Direction along the map's rows, towards higher columns.
    right: vec3<f32>,
    // Half the box's extent along `right`.
    half_width: f32,
    // Direction along the map's columns, towards the top row.
    up: vec3<f32>,
    // Half the box's extent along `up`.
    half_height: f32,
    // Direction to the sun.
    to_sun: vec3<f32>,
    // Half the box's extent along `to_sun`.
    half_depth: f32,
}

// Coordinates of the point p in the map's box along `right`, `up` and `to_sun`, -1 to 1 inside the box.
fn sunlight_position(sunlight: Sunlight, p: vec3<f32>) -> vec3<f32> {
    let offset = p - sunlight.centre;
    return vec3<f32>(
        dot(offset, sunlight.right) / sunlight.half_width,
        dot(offset, sunlight.up) / sunlight.half_height,
        dot(offset, sunlight.to_sun) / sunlight.half_depth,
    );
}
