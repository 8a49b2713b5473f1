// Unpolarised Fresnel reflectance at a plane interface; twin of scattering/fresnel.rs. Complex numbers are (re, im).

// The principal square root of z, whose imaginary part is not negative. The larger part comes from a sum without
// cancellation, the smaller one from the product of both.
fn fresnel_sqrt(z: vec2<f32>) -> vec2<f32> {
    let larger = sqrt(0.5 * (length(z) + abs(z.x)));
    if larger == 0.0 {
        return vec2<f32>(0.0);
    }
    let smaller = 0.5 * z.y / larger;
    return select(vec2<f32>(smaller, larger), vec2<f32>(larger, smaller), z.x >= 0.0);
}

// |a − b|² / |a + b|²
fn fresnel_ratio(a: vec2<f32>, b: vec2<f32>) -> f32 {
    return dot(a - b, a - b) / dot(a + b, a + b);
}

// Reflectance for the cosine of the angle of incidence and the index eta + i k; k = 0 is a dielectric.
fn fresnel_unpolarised(cos_theta: f32, eta: f32, k: f32) -> f32 {
    if eta == 1.0 && k == 0.0 {
        return 0.0;
    }
    let c = clamp(cos_theta, 0.0, 1.0);
    let index_squared = vec2<f32>((eta - k) * (eta + k), 2.0 * eta * k);
    let transmitted = fresnel_sqrt(index_squared - vec2<f32>((1.0 - c) * (1.0 + c), 0.0));
    let s = fresnel_ratio(vec2<f32>(c, 0.0), transmitted);
    let p = fresnel_ratio(index_squared * c, transmitted);
    return clamp(0.5 * (s + p), 0.0, 1.0);
}
