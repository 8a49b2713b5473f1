// Constants and checks that all methods share; twin of mod.rs.

const TAU: f32 = 6.283185307179586;
const WAVELENGTH_MIN_UM: f32 = 0.38;
const WAVELENGTH_MAX_UM: f32 = 0.78;
// Smallest cosine to divide by.
const COSINE_MIN: f32 = 1e-7;
// Largest squared length of a sum of two unit vectors, with room for rounding.
const SUM_SQUARED_MAX: f32 = 4.001;

// Number of this part of an answer, and of all parts. The parts of an answer add up to it: some adapters cut long loops
// short. A method with a long loop takes every `answer_parts`-th turn, from turn `answer_part` on; others answer in
// part 0.
var<private> answer_part: u32 = 0u;
var<private> answer_parts: u32 = 1u;

// Whether q can be a sum of two directions above the surface.
fn is_query(q: vec3<f32>) -> bool {
    return q.z > 0.0 && dot(q, q) <= SUM_SQUARED_MAX;
}
