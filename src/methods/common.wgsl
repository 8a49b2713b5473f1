// Constants and checks that the WGSL of all methods shares; counterpart of mod.rs in this folder. Symbols: q = wi + wo
// = (u, v, w), the sum of the unit vectors to the light and to the viewer.

// 2π.
const TAU: f32 = 6.283185307179586;
// Shortest visible wavelength in µm.
const WAVELENGTH_MIN_UM: f32 = 0.38;
// Longest visible wavelength in µm.
const WAVELENGTH_MAX_UM: f32 = 0.78;
// Smallest cosine to divide by, about the rounding error of a single-precision cosine.
const COSINE_MIN: f32 = 1e-7;
// Largest squared length of a sum of two unit vectors, with room for rounding.
const SUM_SQUARED_MAX: f32 = 4.001;

// Division of an answer into parts, for adapters that end long loops early. The caller evaluates the parts 0 to
// `answer_parts` - 1 and sums the results. A method with a long loop does every `answer_parts`-th turn of it, beginning
// with turn `answer_part`. Other methods return the whole answer in part 0 and zero in the other parts.
var<private> answer_part: u32 = 0u;
var<private> answer_parts: u32 = 1u;

// Whether q can be a sum of two directions above the surface.
fn is_query(q: vec3<f32>) -> bool {
    return q.z > 0.0 && dot(q, q) <= SUM_SQUARED_MAX;
}
