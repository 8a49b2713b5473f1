// Geometry of a pair of directions and the factors that follow from it; counterpart of `Pair` in
// src/scattering/geometry.rs, with the same formulas in single precision.
//
// wi is the unit vector to the light and wo the unit vector to the viewer, in a frame with the normal along +z.
// Their sum is the scattering vector q = wi + wo = (u, v, w). Factors: O, the obliquity factor, and M, shadowing and
// masking (docs/model.md#the-reflectance).

// A pair of directions.
struct Pair {
    // Scattering vector q = wi + wo, with cos_i + cos_o as z component, at least twice PAIR_COSINE_MIN.
    q: vec3<f32>,
    // cosθi and cosθo, at least PAIR_COSINE_MIN.
    cos_i: f32,
    cos_o: f32,
    // Whether both directions are finite and above the surface. Otherwise the other members are meaningless.
    valid: bool,
}

// Smallest cosine to divide by, about the rounding error of a single-precision cosine. Larger values would change
// grazing directions; smaller ones would amplify rounding errors there.
const PAIR_COSINE_MIN: f32 = 1e-7;
// Value of `Optics.obliquity` (optics.wgsl) for Stam's obliquity factor.
const PAIR_OBLIQUITY_STAM: u32 = 0u;
// Value of `Optics.obliquity` for O = 1.
const PAIR_OBLIQUITY_UNIT: u32 = 1u;
// Value of `Optics.obliquity` for the small-slope factor Q, which replaces O and the Fresnel reflectance R.
const PAIR_OBLIQUITY_SMALL_SLOPE: u32 = 2u;

// Whether no component is infinite or NaN. All exponent bits of such a number are set. The test compares bits, because
// compilers may assume that NaN does not occur and remove a comparison of numbers.
fn pair_is_finite(v: vec3<f32>) -> bool {
    return all((bitcast<vec3<u32>>(v) & vec3<u32>(0x7f800000u)) != vec3<u32>(0x7f800000u));
}

// The pair of two unit vectors.
fn pair_new(wi: vec3<f32>, wo: vec3<f32>) -> Pair {
    let valid = pair_is_finite(wi) && pair_is_finite(wo) && wi.z > 0.0 && wo.z > 0.0;
    let cos_i = max(wi.z, PAIR_COSINE_MIN);
    let cos_o = max(wo.z, PAIR_COSINE_MIN);
    return Pair(vec3<f32>(wi.xy + wo.xy, cos_i + cos_o), cos_i, cos_o, valid);
}

// |wi + wo|² = 2(1 + wi·wo). The sum of squares avoids the cancellation of 1 + wi·wo, which is near 0 for two grazing
// directions on opposite sides.
fn pair_sum_squared(pair: Pair) -> f32 {
    return dot(pair.q, pair.q);
}

// Cosine of the angle between either direction and the half vector, |wi + wo|/2.
fn pair_cos_half(pair: Pair) -> f32 {
    return min(0.5 * sqrt(pair_sum_squared(pair)), 1.0);
}

// Obliquity factor O: (1 + wi·wo)²/(cosθi cosθo w²) for PAIR_OBLIQUITY_STAM, 1 for other kinds.
fn pair_obliquity(pair: Pair, kind: u32) -> f32 {
    if kind != PAIR_OBLIQUITY_STAM {
        return 1.0;
    }
    // (1 + wi·wo)/w.
    let ratio = pair_sum_squared(pair) / (2.0 * pair.q.z);
    return ratio * ratio / (pair.cos_i * pair.cos_o);
}

// Shadowing and masking factor M of V-shaped cavities, min(1, 2w·min(cosθi, cosθo)/(1 + wi·wo)), with the denominator
// |wi + wo|²/2.
fn pair_shadowing(pair: Pair) -> f32 {
    return min(4.0 * pair.q.z * min(pair.cos_i, pair.cos_o) / pair_sum_squared(pair), 1.0);
}
