// Constants and checks that every method shares.

const TAU: f32 = 6.283185307179586;
const WAVELENGTH_MIN_UM: f32 = 0.38;
const WAVELENGTH_MAX_UM: f32 = 0.78;
// A sum of two unit vectors is at most 2 long; the rest is room for rounding.
const SUM_SQUARED_MAX: f32 = 4.001;

// Whether q can be a sum of two directions above the surface.
fn is_query(q: vec3<f32>) -> bool {
    return q.z > 0.0 && dot(q, q) <= SUM_SQUARED_MAX;
}
