// Constants and checks that every method shares.

const TAU: f32 = 6.283185307179586;
const WAVELENGTH_MIN_UM: f32 = 0.38;
const WAVELENGTH_MAX_UM: f32 = 0.78;
// What a cosine is divided by at least.
const COSINE_MIN: f32 = 1e-7;
// A sum of two unit vectors is at most 2 long; the rest is room for rounding.
const SUM_SQUARED_MAX: f32 = 4.001;

// An answer may be asked for in parts that add up to it, since some adapters cut long loops short. A method whose loop
// is long takes every `answer_parts`-th turn of it, from turn `answer_part` on; others answer in part 0 only.
var<private> answer_part: u32 = 0u;
var<private> answer_parts: u32 = 1u;

// Whether q can be a sum of two directions above the surface.
fn is_query(q: vec3<f32>) -> bool {
    return q.z > 0.0 && dot(q, q) <= SUM_SQUARED_MAX;
}
