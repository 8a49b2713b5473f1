// Factor F of a film, which reflects and transmits: the scattering function of the film is F times S/λ², with the power
// spectrum S of the relief and the wavelength λ. The colour table is that of the relief magnified n times, since
// wavelengths in the film are 1/n of those in air. Compiled after common.wgsl (DIVISOR_MIN) and table.wgsl. Counterpart
// of src/scattering/transparent.rs, which derives the formulas, for bodies that are films: a relief on top, a flat side
// below, and air on both sides.
//
// n is the refractive index of the film, and ε = n². K is the wave vector of a direction, in units of the wave number
// in air. All directions of a film are in air, so no component is imaginary. "Over n" means in units of the wave number
// in the film, which is n times that in air.
//
//     k        length of the tangential part of K
//     c1, cn   normal components in air and in the film, √(1 - k²) and √(n² - k²)
//     ζ        c1 above the relief, cn below
//     v, e     cn and n for a direction above; n·c1 and 1 below
//     s, p     c1 + cn and ε·c1 + cn, the denominators of the two states of polarisation, s and p
//     τ        1 above; below, the transmittance of the film's flat side for the state
//     φ        azimuth between the arriving and the leaving light
//     σ        1 for reflection, -1 for transmission
//     w        normal component of Ki + Ko
//
//     B_ss = cosφ/(s s0)      B_sp = v0 sinφ/(s p0)
//     B_ps = v sinφ/(p s0)    B_pp = (v v0 cosφ - σ e e0 k k0)/(p p0)
//     F = 2 ζ ζ0 (ε - 1)²/w² · Σ |B|² τ τ0      over the four pairs of states; 0 marks the incident direction

// Smallest product k·k0 by which cosφ is computed. The azimuth of a direction along the normal is arbitrary: F does not
// depend on it. A test compares the value with that in Rust.
const SINES_MIN: f32 = 1e-6;

// Wave of one direction at a film: its wave vector, and its terms of the factor F.
struct BodyWave {
    // Whether the direction lies below the relief.
    is_below: bool,
    // Direction cosines along the surface, those of the wave vector in air.
    cosines: vec2<f32>,
    // ζ over n, positive.
    normal: f32,
    // k, the length of `cosines`.
    k: f32,
    // v of the factor F.
    v: f32,
    // e of the factor F.
    e: f32,
    // τ/s² and τ/p².
    states: vec2<f32>,
}

// A pair of directions at a film.
struct TransparentPair {
    // Ki + Ko over n, with the sign that makes the normal component positive, which is at least body_normal_min.
    q: vec3<f32>,
    // Factor on S/λ² of the magnified relief, in the scattering function of light from wi to wo, in 1/sr.
    factor: f32,
}

// Wave of a direction of unit length, which points away from the relief on either side of it.
fn wave_at_body(direction: vec3<f32>) -> BodyWave {
    let n = table.body_eta;
    let eps = n * n;
    let is_below = direction.z < 0.0;
    let c1 = max(abs(direction.z), DIVISOR_MIN);
    let cn = sqrt(c1 * c1 + (n - 1.0) * (n + 1.0));
    let s = c1 + cn;
    let p = eps * c1 + cn;
    let per_squared = 1.0 / vec2<f32>(s * s, p * p);
    // Transmittances of the flat side below for both states.
    let refracted = 4.0 * c1 * cn * vec2<f32>(1.0, eps) * per_squared;
    return BodyWave(
        is_below,
        direction.xy,
        select(c1, cn, is_below) / n,
        length(direction.xy),
        select(cn, n * c1, is_below),
        select(n, 1.0, is_below),
        select(vec2<f32>(1.0), refracted, is_below) * per_squared,
    );
}

// (ε - 1)/w, with w over n. For n = 1, where this is 0/0, reflected light has 0 and transmitted light the limit s0 =
// 2 c1: light goes straight on.
fn contrast_over_normal(is_reflected: bool, normal: f32, wi: BodyWave) -> f32 {
    let n = table.body_eta;
    if n == 1.0 {
        return select(2.0 * wi.normal, 0.0, is_reflected);
    }
    return (n - 1.0) * (n + 1.0) / normal;
}

// The pair of two directions, light arriving from wi and leaving along wo.
fn pair_at_body(wi: BodyWave, wo: BodyWave) -> TransparentPair {
    let n = table.body_eta;
    let is_reflected = wi.is_below == wo.is_below;
    let sigma = select(-1.0, 1.0, is_reflected);
    // Normal component of Ki + Ko over n: wave vectors below point downwards.
    let w = select(wi.normal, -wi.normal, wi.is_below) + select(wo.normal, -wo.normal, wo.is_below);
    // In transmission w can vanish. F and S both use the bound, so that their product stays smooth.
    let normal = max(abs(w), table.body_normal_min);
    let tangential = (wi.cosines + wo.cosines) / n * select(1.0, -1.0, w < 0.0);
    // k·k0·cosφ = −(Ki·Ko)_xy.
    let k_k0 = wi.k * wo.k;
    let cos_phi = clamp(-dot(wi.cosines, wo.cosines) / max(k_k0, SINES_MIN), -1.0, 1.0);
    let cos_squared = cos_phi * cos_phi;
    let sin_squared = 1.0 - cos_squared;
    let pp = wi.v * wo.v * cos_phi - sigma * wi.e * wo.e * k_k0;
    let contrast = contrast_over_normal(is_reflected, normal, wi);
    // |B|² τ τ0 of the states ss, sp, ps and pp, the outgoing state first. F is for unpolarised light.
    let powers = vec4<f32>(
        cos_squared * wo.states.x * wi.states.x,
        sin_squared * wi.v * wi.v * wo.states.x * wi.states.y,
        sin_squared * wo.v * wo.v * wo.states.y * wi.states.x,
        pp * pp * wo.states.y * wi.states.y,
    );
    // F, with ζ ζ0 and w² both over n², which cancels.
    let power = 2.0 * (powers.x + powers.y + powers.z + powers.w) * wi.normal * wo.normal * contrast * contrast;
    // S/λ² of the relief is that of the magnified relief over n².
    return TransparentPair(vec3<f32>(tangential, normal), power / (n * n));
}
