// The small-slope factor Q for unpolarised light, from first-order small-slope theory
// (docs/model.md#the-small-slope-factor); counterpart of src/scattering/small_slope.rs, which derives the formulas.
//
// Symbols: q_i = cosθi, q_o = cosθo, w = q_i + q_o; ε = (eta + i k)² the permittivity; φ the azimuth from the plane of
// incidence to the outgoing direction; t = √(ε - sin²θ) the normal component of the transmitted wave. For either
// direction, D_s = q + t and D_p = εq + t are the denominators of the Fresnel coefficients. Complex numbers are (re,
// im). `straight` is the power of s→s and p→p, `crossed` that of s→p and p→s. For an interface
//     Q = 2|ε - 1|² q_i q_o/w² · (straight + crossed).

// Smallest sinθi·sinθo to divide by. Chosen: the azimuth has no effect where a sine is this small.
const SMALL_SLOPE_SINES_MIN: f32 = 1e-6;
// Smallest |D|² to divide by. Chosen: it only avoids a division by zero.
const SMALL_SLOPE_TINY: f32 = 1e-18;

// cosφ in x and sinθi·sinθo in y.
fn small_slope_azimuth(pair: Pair) -> vec2<f32> {
    let q = vec2<f32>(pair.cos_i, pair.cos_o);
    let squared = 1.0 - q * q;
    let sines = sqrt(max(squared.x * squared.y, 0.0));
    let cos = (1.0 + q.x * q.y - 0.5 * pair_sum_squared(pair)) / max(sines, SMALL_SLOPE_SINES_MIN);
    return vec2<f32>(clamp(cos, -1.0, 1.0), sines);
}

// Terms of the direction with the cosine q: t in (x, y), 1/|D_s|² in z and 1/|D_p|² in w.
fn small_slope_direction(q: f32, eps: vec2<f32>) -> vec4<f32> {
    let transmitted = fresnel_sqrt(eps - vec2<f32>(1.0 - q * q, 0.0));
    let s = vec2<f32>(q, 0.0) + transmitted;
    let p = eps * q + transmitted;
    return vec4<f32>(transmitted, 1.0 / max(dot(s, s), SMALL_SLOPE_TINY), 1.0 / max(dot(p, p), SMALL_SLOPE_TINY));
}

// Q of an interface with the refractive index eta + i k. `o` and `i` are the terms of wo and wi.
fn small_slope(pair: Pair, eta: f32, k: f32) -> f32 {
    let eps = vec2<f32>((eta - k) * (eta + k), 2.0 * eta * k);
    let azimuth = small_slope_azimuth(pair);
    let cos_squared = azimuth.x * azimuth.x;
    let o = small_slope_direction(pair.cos_o, eps);
    let i = small_slope_direction(pair.cos_i, eps);
    let product = vec2<f32>(o.x * i.x - o.y * i.y, o.x * i.y + o.y * i.x);
    let pp = product * azimuth.x - eps * azimuth.y;
    let straight = cos_squared * o.z * i.z + dot(pp, pp) * o.w * i.w;
    let crossed = (1.0 - cos_squared) * (dot(o.xy, o.xy) * o.w * i.z + dot(i.xy, i.xy) * i.w * o.z);
    let contrast = eps - vec2<f32>(1.0, 0.0);
    let w = pair.q.z;
    return 2.0 * dot(contrast, contrast) * pair.cos_i * pair.cos_o / (w * w) * (straight + crossed);
}

// Q for a perfect conductor.
fn small_slope_conductor(pair: Pair) -> f32 {
    let azimuth = small_slope_azimuth(pair);
    let cos_squared = azimuth.x * azimuth.x;
    let q = vec2<f32>(pair.cos_i, pair.cos_o);
    let squared = q * q;
    let product = q.x * q.y;
    // cosφ - sinθi·sinθo. The terms cancel for two grazing directions, where the second, equal form does not.
    var difference = azimuth.x - azimuth.y;
    if azimuth.y >= 0.5 {
        difference =
            (squared.x + squared.y + product - squared.x * squared.y - 0.5 * pair_sum_squared(pair)) / azimuth.y;
    }
    let straight = difference * difference + cos_squared * product * product;
    let crossed = (1.0 - cos_squared) * (squared.x + squared.y);
    let w = pair.q.z;
    return 2.0 / (w * w) * (straight + crossed) / product;
}
