// Unpolarised Fresnel reflectance at a plane interface; counterpart of `fresnel_unpolarised` in
// src/scattering/fresnel.rs. Complex numbers are vectors (re, im).
//
// Symbols:
//     c    cosθ, with the angle of incidence θ
//     n    refractive index eta + i k relative to the outer medium
//     t    √(n² - sin²θ), normal component of the transmitted wave vector, in units of the outer wave number
//     R_s  |c - t|²/|c + t|², reflectance of the polarisation s
//     R_p  |n²c - t|²/|n²c + t|², reflectance of the polarisation p
//     R    (R_s + R_p)/2

// Principal square root of a complex z with im z ≥ 0. The larger of its real and imaginary parts is the root of a sum
// without cancellation. The smaller one follows from their product, im z/2.
fn fresnel_sqrt(z: vec2<f32>) -> vec2<f32> {
    let larger = sqrt(0.5 * (length(z) + abs(z.x)));
    if larger == 0.0 {
        return vec2<f32>(0.0);
    }
    let smaller = 0.5 * z.y / larger;
    return select(vec2<f32>(smaller, larger), vec2<f32>(larger, smaller), z.x >= 0.0);
}

// Ratio |a - b|²/|a + b|² of complex numbers.
fn fresnel_ratio(a: vec2<f32>, b: vec2<f32>) -> f32 {
    return dot(a - b, a - b) / dot(a + b, a + b);
}

// Reflectance R in [0, 1] at the cosine of the angle of incidence, which is clamped to [0, 1]; k = 0 is a dielectric.
fn fresnel_unpolarised(cos_theta: f32, eta: f32, k: f32) -> f32 {
    // Equal media reflect nothing. The formula would be 0/0 at grazing incidence.
    if eta == 1.0 && k == 0.0 {
        return 0.0;
    }
    let c = clamp(cos_theta, 0.0, 1.0);
    let index_squared = vec2<f32>((eta - k) * (eta + k), 2.0 * eta * k);
    let t = fresnel_sqrt(index_squared - vec2<f32>((1.0 - c) * (1.0 + c), 0.0));
    let r_s = fresnel_ratio(vec2<f32>(c, 0.0), t);
    let r_p = fresnel_ratio(index_squared * c, t);
    return clamp(0.5 * (r_s + r_p), 0.0, 1.0);
}
