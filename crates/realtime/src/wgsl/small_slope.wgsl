// The small-slope factor Q for unpolarised light; twin of scattering/small_slope.rs, which has the formulas.
//
// Complex numbers are (re, im). s and p are the polarisations; `straight` keeps the polarisation and `crossed` changes
// it.

const SMALL_SLOPE_SINES_MIN: f32 = 1e-6;
const SMALL_SLOPE_TINY: f32 = 1e-18;

// The cosine of the azimuth between incoming and outgoing light, and the product of the sines of their angles with the
// normal.
fn small_slope_azimuth(pair: Pair) -> vec2<f32> {
    let q = vec2<f32>(pair.cos_i, pair.cos_o);
    let squared = 1.0 - q * q;
    let sines = sqrt(max(squared.x * squared.y, 0.0));
    let cos = (1.0 + q.x * q.y - 0.5 * pair_sum_squared(pair)) / max(sines, SMALL_SLOPE_SINES_MIN);
    return vec2<f32>(clamp(cos, -1.0, 1.0), sines);
}

// Of the direction with the cosine q: the normal component of the transmitted wave (x, y), and the reciprocal squared
// denominators of s (z) and p (w).
fn small_slope_direction(q: f32, eps: vec2<f32>) -> vec4<f32> {
    let transmitted = fresnel_sqrt(eps - vec2<f32>(1.0 - q * q, 0.0));
    let s = vec2<f32>(q, 0.0) + transmitted;
    let p = eps * q + transmitted;
    return vec4<f32>(transmitted, 1.0 / max(dot(s, s), SMALL_SLOPE_TINY), 1.0 / max(dot(p, p), SMALL_SLOPE_TINY));
}

// Q for the index eta + i k.
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
    // The cosine less the product of sines. They cancel for two grazing directions, where the second form does not.
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
