// Factors of the reflectance f_r that do not depend on the relief (docs/model.md#the-reflectance).
//
// f_r is R·O·M times the relief's factor, which the method computes (src/methods/mod.rs): ∫ S/λ² weight(λ) dλ, with the
// wavelength λ, the power spectrum S in µm² and the weights of linear sRGB. R is the Fresnel reflectance
// (fresnel.wgsl), O the obliquity factor, and M shadowing and masking (both pair.wgsl). With the small-slope factor Q
// (small_slope.wgsl), f_r is Q·M times the relief's factor.
//
// Under a cover of index n, these factors are taken for the directions inside the cover. f_r is multiplied by
// T(θi)·T(θo)/n², where T is the transmittance of the cover's flat side. The angle θ' inside the cover follows from
// n·cosθ' = √(n² − sin²θ). The functions for covers are counterparts of `Cover` in src/scattering/cover.rs.

// Value of `Optics.answer_kind` for methods whose answer is the relief's factor.
const OPTICS_ANSWER_RELIEF: u32 = 0u;
// Value of `Optics.answer_kind` for methods whose answer is f_r itself.
const OPTICS_ANSWER_REFLECTANCE: u32 = 1u;
// Value of `Optics.answer_kind` for methods whose answer is the whole scattering function of a film, a transparent
// sheet with the relief on one side.
const OPTICS_ANSWER_FILM: u32 = 2u;

// Optical options of the surface; counterpart of `OpticsUniform` in layout.rs.
struct Optics {
    // Real part of the refractive index eta + i k, relative to the index of the cover.
    eta: f32,
    // Imaginary part of the index, likewise relative; 0 for a dielectric.
    k: f32,
    // 1: a perfect conductor with R = 1 at every angle; eta and k are not read.
    reflects_all: u32,
    // Obliquity factor: PAIR_OBLIQUITY_STAM, PAIR_OBLIQUITY_UNIT or PAIR_OBLIQUITY_SMALL_SLOPE.
    obliquity: u32,
    // 1: M of V-shaped cavities; 0: M = 1.
    shadowing: u32,
    // Meaning of the method's answer: OPTICS_ANSWER_RELIEF, OPTICS_ANSWER_REFLECTANCE or OPTICS_ANSWER_FILM.
    answer_kind: u32,
    // Refractive index n of the cover, at least 1; 1 without a cover.
    cover_eta: f32,
}

// Direction inside the cover of light that has the direction w outside, a unit vector above the surface.
fn optics_inside(optics: Optics, w: vec3<f32>) -> vec3<f32> {
    let n = optics.cover_eta;
    if n == 1.0 {
        return w;
    }
    return vec3<f32>(w.xy, sqrt((n - 1.0) * (n + 1.0) + w.z * w.z)) / n;
}

// Fresnel transmittance T of the cover's flat side for unpolarised light that has the direction w outside, a unit
// vector above the surface.
fn optics_cover_transmittance(optics: Optics, w: vec3<f32>) -> f32 {
    let n = optics.cover_eta;
    if n == 1.0 {
        return 1.0;
    }
    // With N = n·cosθ' (`normal`) and the denominators s and p of the Fresnel coefficients, T is the mean of
    // 4N·cosθ/s² and 4N·n²·cosθ/p². Near the horizon this form is more precise than 1 − R.
    let normal = sqrt((n - 1.0) * (n + 1.0) + w.z * w.z);
    let s = w.z + normal;
    let p = n * n * w.z + normal;
    return 2.0 * w.z * normal * (1.0 / (s * s) + n * n / (p * p));
}

// Factor of the cover on the reflectance f_r inside it, T(θi)·T(θo)/n², from the directions outside.
fn optics_cover_factor(optics: Optics, wi: vec3<f32>, wo: vec3<f32>) -> f32 {
    let n = optics.cover_eta;
    return optics_cover_transmittance(optics, wi) * optics_cover_transmittance(optics, wo) / (n * n);
}

// Fresnel reflectance R of the relief's material at the cosine of an angle of incidence.
fn optics_reflectance(optics: Optics, cos_theta: f32) -> f32 {
    if optics.reflects_all != 0u {
        return 1.0;
    }
    return fresnel_unpolarised(cos_theta, optics.eta, optics.k);
}

// Fraction 1 - R of the light that passes the surface, to the pigment below, at the cosine of an angle of incidence.
fn optics_remainder(optics: Optics, cos_theta: f32) -> f32 {
    return max(1.0 - optics_reflectance(optics, cos_theta), 0.0);
}

// Factor of the interface for unpolarised light: R at the angle between either direction and the half vector, or the
// small-slope factor Q. Counterpart of `Pair::interface` in src/scattering/geometry.rs.
fn optics_interface(optics: Optics, pair: Pair) -> f32 {
    if optics.obliquity != PAIR_OBLIQUITY_SMALL_SLOPE {
        return optics_reflectance(optics, pair_cos_half(pair));
    }
    if optics.reflects_all != 0u {
        return small_slope_conductor(pair);
    }
    return small_slope(pair, optics.eta, optics.k);
}

// Factor on the method's answer without the cover's factor: R·O·M or Q·M for the relief's factor. It is 1 for answers
// that contain these factors.
fn optics_factor(optics: Optics, pair: Pair) -> f32 {
    if optics.answer_kind != OPTICS_ANSWER_RELIEF {
        return 1.0;
    }
    // `pair_obliquity` is 1 with Q.
    var factor = optics_interface(optics, pair) * pair_obliquity(pair, optics.obliquity);
    if optics.shadowing != 0u {
        factor *= pair_shadowing(pair);
    }
    return factor;
}
