// A pair of directions above the surface with its factors; twin of `Pair` in scattering/geometry.rs.

struct Pair {
    // q = wi + wo
    q: vec3<f32>,
    cos_i: f32,
    cos_o: f32,
    // Whether both directions are finite and above the surface. Otherwise the other members are meaningless.
    valid: bool,
}

// Smallest cosine to divide by.
const PAIR_COSINE_MIN: f32 = 1e-7;
// Obliquity factors of `Optics`.
const PAIR_OBLIQUITY_STAM: u32 = 0u;
const PAIR_OBLIQUITY_SMALL_SLOPE: u32 = 2u;

// Compares bits, because compilers may assume that there is no NaN.
fn pair_is_finite(v: vec3<f32>) -> bool {
    return all((bitcast<vec3<u32>>(v) & vec3<u32>(0x7f800000u)) != vec3<u32>(0x7f800000u));
}

fn pair_of(wi: vec3<f32>, wo: vec3<f32>) -> Pair {
    let valid = pair_is_finite(wi) && pair_is_finite(wo) && wi.z > 0.0 && wo.z > 0.0;
    let cos_i = max(wi.z, PAIR_COSINE_MIN);
    let cos_o = max(wo.z, PAIR_COSINE_MIN);
    return Pair(vec3<f32>(wi.xy + wo.xy, cos_i + cos_o), cos_i, cos_o, valid);
}

// |wi + wo|² = 2(1 + wi·wo), as a sum of squares: nothing cancels at grazing forward directions.
fn pair_sum_squared(pair: Pair) -> f32 {
    return dot(pair.q, pair.q);
}

// Cosine of the angle of either direction with the half vector.
fn pair_cos_half(pair: Pair) -> f32 {
    return min(0.5 * sqrt(pair_sum_squared(pair)), 1.0);
}

// The obliquity factor O: (1 + wi·wo)²/(cosθi cosθo w²) for stam, else 1.
fn pair_obliquity(pair: Pair, kind: u32) -> f32 {
    if kind != PAIR_OBLIQUITY_STAM {
        return 1.0;
    }
    let ratio = pair_sum_squared(pair) / (2.0 * pair.q.z);
    return ratio * ratio / (pair.cos_i * pair.cos_o);
}

// V-cavity shadowing and masking, M.
fn pair_shadowing(pair: Pair) -> f32 {
    return min(4.0 * pair.q.z * min(pair.cos_i, pair.cos_o) / pair_sum_squared(pair), 1.0);
}
