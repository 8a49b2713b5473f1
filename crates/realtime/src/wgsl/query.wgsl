// A pair of directions to answer, with the data that a picture needs; twin of `Query` in layout.rs.

const QUERY_NOTHING: u32 = 0u;
const QUERY_GROUND: u32 = 1u;
const QUERY_SKIN: u32 = 2u;

struct Query {
    // Unit vector towards the light in the grating's frame.
    wi: vec3<f32>,
    // The surface met: QUERY_NOTHING, QUERY_GROUND or QUERY_SKIN.
    kind: u32,
    // Unit vector towards the viewer in the grating's frame.
    wo: vec3<f32>,
    // 1 where the sun is visible, else 0.
    lit: u32,
    // Texture coordinates of the skin.
    uv: vec2<f32>,
}
