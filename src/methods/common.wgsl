// Constants and checks shared by the WGSL of all methods; counterpart of mod.rs in this folder. Symbols: q = wi + wo =
// (u, v, w), the sum of the unit vectors to the light and to the viewer.

// 2π.
const TAU: f32 = 6.283185307179586;
// Shortest wavelength of the published methods (FLSS, NMM, PQ and Stam's) in µm.
const WAVELENGTH_MIN_UM: f32 = 0.38;
// Longest wavelength of the published methods in µm.
const WAVELENGTH_MAX_UM: f32 = 0.78;
// Lower bound on divisors: cosines of directions with the normal, and arguments of Bessel functions. About the rounding
// error of a number near 1 in single precision.
const DIVISOR_MIN: f32 = 1e-7;
// Largest squared length of a sum of two unit vectors: 4, with room for rounding.
const SUM_SQUARED_MAX: f32 = 4.001;

// Some adapters end long loops early. Therefore an *answer*, the value of `answer_rgb` for a pair of directions, may be
// divided into parts. The caller evaluates the parts 0 to `answer_parts` - 1 and sums the results. In part
// `answer_part`, a method with a long loop does every `answer_parts`-th iteration, from iteration `answer_part` on.
// Other methods return the whole answer in part 0 and zero in the other parts.
var<private> answer_part: u32 = 0u;
var<private> answer_parts: u32 = 1u;

// Whether q can be the sum of two unit vectors above the surface. Methods that call this are zero elsewhere.
fn is_query(q: vec3<f32>) -> bool {
    return q.z > 0.0 && dot(q, q) <= SUM_SQUARED_MAX;
}
