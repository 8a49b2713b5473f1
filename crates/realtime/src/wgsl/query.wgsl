// A pair of directions to be answered, and what a picture keeps beside it.

const QUERY_NOTHING: u32 = 0u;
const QUERY_GROUND: u32 = 1u;
const QUERY_SKIN: u32 = 2u;

struct Query {
    // Towards the light, in the grating's frame.
    wi: vec3<f32>,
    // What is there: QUERY_NOTHING, QUERY_GROUND, QUERY_SKIN.
    kind: u32,
    // Towards the viewer, in the same frame.
    wo: vec3<f32>,
    // 1 where the light arrives.
    lit: u32,
    // Texture coordinates of the skin.
    uv: vec2<f32>,
}
