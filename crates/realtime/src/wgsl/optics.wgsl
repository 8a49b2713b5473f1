// The part of the reflectance that does not depend on the relief (docs/model.md#the-reflectance).

const OPTICS_ANSWERS_REFLECTANCE: u32 = 1u;

struct Optics {
    // Refractive index eta + i k.
    eta: f32,
    k: f32,
    // 1: everything is reflected, and the index does not matter.
    reflects_all: u32,
    // 0 stam, 1 unit, 2 small slope.
    obliquity: u32,
    // 1: V-cavity shadowing and masking.
    shadowing: u32,
    // Meaning of the method's answer: 0 the relief's part, 1 the whole reflectance.
    answers: u32,
}

// Fresnel reflectance R at an angle of incidence.
fn optics_reflectance(optics: Optics, cos_theta: f32) -> f32 {
    if optics.reflects_all != 0u {
        return 1.0;
    }
    return fresnel_unpolarised(cos_theta, optics.eta, optics.k);
}

// Fraction of the light that passes to the pigment below.
fn optics_remainder(optics: Optics, cos_theta: f32) -> f32 {
    return max(1.0 - optics_reflectance(optics, cos_theta), 0.0);
}

// Factor of the interface for unpolarised light: R, or Q of the small slope.
fn optics_interface(optics: Optics, pair: Pair) -> f32 {
    if optics.obliquity != PAIR_OBLIQUITY_SMALL_SLOPE {
        return optics_reflectance(optics, pair_cos_half(pair));
    }
    if optics.reflects_all != 0u {
        return small_slope_conductor(pair);
    }
    return small_slope(pair, optics.eta, optics.k);
}

// Factor on the method's answer: R·O·M (Q·M for small slope), or 1 where the answer is the whole reflectance.
fn optics_factor(optics: Optics, pair: Pair) -> f32 {
    if optics.answers == OPTICS_ANSWERS_REFLECTANCE {
        return 1.0;
    }
    var factor = optics_interface(optics, pair) * pair_obliquity(pair, optics.obliquity);
    if optics.shadowing != 0u {
        factor *= pair_shadowing(pair);
    }
    return factor;
}
