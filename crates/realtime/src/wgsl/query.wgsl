// Record of one visible surface point; counterpart of `Query` in layout.rs, with the same memory layout.
//
// For each sample of the pixels, locate.wgsl writes one query per pixel. shade.wgsl computes the reflectance f_r, the
// *answer*, from its directions and stores it in the buffer `reflectances` at the query's index. resolve.wgsl turns the
// answer into radiance, with the pigment, the diffuse colour at the texture coordinates, and adds it to the pixel.
//
// The grating's frame is the shading frame (z is the normal, x the tangent along u), rotated about the normal by the
// angle of `frame.rotation` (frame.wgsl). A film is a mesh that is a transparent sheet, lit from both sides: z
// of its directions may have either sign. Other surfaces are lit only where both z are positive.

// Value of `Query.kind`: the ray of the pixel meets no surface.
const QUERY_NOTHING: u32 = 0u;
// Value of `Query.kind`: the ray meets the ground.
const QUERY_GROUND: u32 = 1u;
// Value of `Query.kind`: the ray meets the mesh, whose surface is called skin.
const QUERY_SKIN: u32 = 2u;

// A visible surface point.
struct Query {
    // Unit vector towards the light, in the grating's frame; in the scene's frame for QUERY_GROUND.
    wi: vec3<f32>,
    // Kind of surface at the point: QUERY_NOTHING, QUERY_GROUND or QUERY_SKIN.
    kind: u32,
    // Unit vector towards the viewer, in the frame of `wi`.
    wo: vec3<f32>,
    // 1 where the sun is visible, directly or through films; else 0, and `sun` is 0, too. Of the skin, only lit points
    // are answered.
    lit: u32,
    // Texture coordinates of the skin; (0, 0) on the ground.
    uv: vec2<f32>,
    // Fraction of the sunlight that arrives at the point: 0 in shadow, 1 in direct sun, a value between behind films.
    sun: f32,
}
