// Record of one visible surface point; counterpart of `Query` in layout.rs, with the same memory layout.
//
// locate.wgsl writes one query for each pixel. shade.wgsl reads its two directions and computes the reflectance.
// resolve.wgsl turns the reflectance into the pixel's radiance, with the pigment at the texture coordinates. The
// grating's frame is the shading frame, rotated about the normal by the angle of `frame.rotation` (frame.wgsl). Both
// directions lie above the surface; those of a film lie on either side.

// Kinds of surface that the ray of a pixel meets: none, the ground plane, or the mesh.
const QUERY_NOTHING: u32 = 0u;
const QUERY_GROUND: u32 = 1u;
const QUERY_SKIN: u32 = 2u;

// A visible surface point.
struct Query {
    // Unit vector towards the light in the grating's frame; in the scene's frame for QUERY_GROUND.
    wi: vec3<f32>,
    // The surface met: QUERY_NOTHING, QUERY_GROUND or QUERY_SKIN.
    kind: u32,
    // Unit vector towards the viewer in the frame of `wi`.
    wo: vec3<f32>,
    // 1 where the sun is visible, also through films, else 0.
    lit: u32,
    // Texture coordinates of the skin.
    uv: vec2<f32>,
    // Fraction of the sunlight that arrives at the point: `lit`, and less behind films.
    sun: f32,
}
