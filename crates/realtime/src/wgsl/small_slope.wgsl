// The small-slope factor Q for unpolarised light, from first-order small-slope theory
// (docs/model.md#the-small-slope-factor); counterpart of src/scattering/small_slope.rs. Complex numbers are vectors
// (re, im).
//
// Symbols; the indices i and o mark the direction:
//     c         cosθ, at least PAIR_COSINE_MIN (pair.wgsl)
//     w         c_i + c_o, in code pair.q.z
//     ε         permittivity (eta + i k)², relative to the medium above the relief: air or the cover
//     φ         azimuth from the tangential direction of the arriving light (−wi) to that of the leaving light (wo)
//     t         √(ε - sin²θ), normal component of the transmitted wave vector, over the wave number above the relief
//     D_s, D_p  c + t and εc + t, denominators of the Fresnel coefficients
//     straight  sum of the powers from polarisation s to s and from p to p
//     crossed   sum of the powers from s to p and from p to s
// For an interface
//     Q = 2|ε - 1|² c_i c_o/w² · (straight + crossed)
//     straight = cos²φ/|D_s,i D_s,o|² + |t_i t_o cosφ - ε sinθi sinθo|²/|D_p,i D_p,o|²
//     crossed = sin²φ·(|t_i|²/|D_p,i D_s,o|² + |t_o|²/|D_p,o D_s,i|²)
// and for a perfect conductor
//     Q = 2/(w² c_i c_o) · (straight + crossed)
//     straight = (cosφ - sinθi sinθo)² + cos²φ (c_i c_o)²
//     crossed = sin²φ·(c_i² + c_o²)

// Smallest sinθi·sinθo to divide by. At smaller products one direction is nearly the normal, where the azimuth is lost
// to rounding and has no effect.
const SMALL_SLOPE_SINES_MIN: f32 = 1e-6;
// Smallest |D|² to divide by, which avoids a division by zero. Chosen so that products of two reciprocals stay finite;
// a larger bound would change more pairs of directions. |D_s|² exceeds it, since c is at least 1e-7 and Re t ≥ 0.
const SMALL_SLOPE_SQUARED_MODULUS_MIN: f32 = 1e-18;

// Azimuth of a pair of directions, and the product of sines with which it occurs.
struct SmallSlopeAzimuth {
    // cosφ.
    cos_phi: f32,
    // sinθi·sinθo.
    sines: f32,
}

// Terms of one direction at an interface.
struct SmallSlopeTerms {
    // t.
    t: vec2<f32>,
    // 1/|D_s|².
    per_s_squared: f32,
    // 1/|D_p|².
    per_p_squared: f32,
}

// cosφ from sinθi·sinθo·cosφ = c_i c_o - wi·wo, where 1 + wi·wo = |wi + wo|²/2.
fn small_slope_azimuth(pair: Pair) -> SmallSlopeAzimuth {
    let cosines = vec2<f32>(pair.cos_i, pair.cos_o);
    let sin_squared = 1.0 - cosines * cosines;
    let sines = sqrt(max(sin_squared.x * sin_squared.y, 0.0));
    let cos_phi = (1.0 + cosines.x * cosines.y - 0.5 * pair_sum_squared(pair)) / max(sines, SMALL_SLOPE_SINES_MIN);
    return SmallSlopeAzimuth(clamp(cos_phi, -1.0, 1.0), sines);
}

// Terms of the direction with the cosine c, for the permittivity `eps`.
fn small_slope_terms(c: f32, eps: vec2<f32>) -> SmallSlopeTerms {
    let t = fresnel_sqrt(eps - vec2<f32>(1.0 - c * c, 0.0));
    let s = vec2<f32>(c, 0.0) + t;
    let p = eps * c + t;
    let s_squared = max(dot(s, s), SMALL_SLOPE_SQUARED_MODULUS_MIN);
    let p_squared = max(dot(p, p), SMALL_SLOPE_SQUARED_MODULUS_MIN);
    return SmallSlopeTerms(t, 1.0 / s_squared, 1.0 / p_squared);
}

// Q of an interface with the relative refractive index eta + i k.
fn small_slope(pair: Pair, eta: f32, k: f32) -> f32 {
    let eps = vec2<f32>((eta - k) * (eta + k), 2.0 * eta * k);
    let azimuth = small_slope_azimuth(pair);
    let cos_squared = azimuth.cos_phi * azimuth.cos_phi;
    let o = small_slope_terms(pair.cos_o, eps);
    let i = small_slope_terms(pair.cos_i, eps);
    // Complex product t_i t_o.
    let t_product = vec2<f32>(o.t.x * i.t.x - o.t.y * i.t.y, o.t.x * i.t.y + o.t.y * i.t.x);
    // Numerator of the amplitude from p to p.
    let pp = t_product * azimuth.cos_phi - eps * azimuth.sines;
    let straight = cos_squared * o.per_s_squared * i.per_s_squared + dot(pp, pp) * o.per_p_squared * i.per_p_squared;
    let crossed = (1.0 - cos_squared) *
        (dot(o.t, o.t) * o.per_p_squared * i.per_s_squared + dot(i.t, i.t) * i.per_p_squared * o.per_s_squared);
    // ε - 1.
    let contrast = eps - vec2<f32>(1.0, 0.0);
    let w = pair.q.z;
    return 2.0 * dot(contrast, contrast) * pair.cos_i * pair.cos_o / (w * w) * (straight + crossed);
}

// Q of a perfect conductor.
fn small_slope_conductor(pair: Pair) -> f32 {
    let azimuth = small_slope_azimuth(pair);
    let cos_squared = azimuth.cos_phi * azimuth.cos_phi;
    let cosines = vec2<f32>(pair.cos_i, pair.cos_o);
    let squared = cosines * cosines;
    let c_product = cosines.x * cosines.y;
    // cosφ - sinθi sinθo. The terms cancel for two grazing directions. Multiplied by sinθi sinθo, the difference is
    // c_i² + c_o² + c_i c_o - c_i² c_o² - |wi + wo|²/2, which does not cancel there. The second form divides by the
    // product of the sines, so it is used only where the product is large: chosen, at least ½, half its maximum. With a
    // larger bound the first form would cancel more, with a smaller one the division would amplify rounding errors.
    var difference = azimuth.cos_phi - azimuth.sines;
    if azimuth.sines >= 0.5 {
        difference =
            (squared.x + squared.y + c_product - squared.x * squared.y - 0.5 * pair_sum_squared(pair)) / azimuth.sines;
    }
    let straight = difference * difference + cos_squared * c_product * c_product;
    let crossed = (1.0 - cos_squared) * (squared.x + squared.y);
    let w = pair.q.z;
    return 2.0 / (w * w) * (straight + crossed) / c_product;
}
