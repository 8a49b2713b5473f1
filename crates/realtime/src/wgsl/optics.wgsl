// The part of the reflectance that does not depend on the relief (docs/model.md#the-reflectance).

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
    // 1: the method's answer is a colour over π to be shown as it is (Method::is_shown_as_it_is).
    shown_as_it_is: u32,
}

fn optics_reflectance(optics: Optics, cos_theta: f32) -> f32 {
    if optics.reflects_all != 0u {
        return 1.0;
    }
    return fresnel_unpolarised(cos_theta, optics.eta, optics.k);
}

// What a facet under this angle leaves for the pigment below.
fn optics_remainder(optics: Optics, cos_theta: f32) -> f32 {
    return max(1.0 - optics_reflectance(optics, cos_theta), 0.0);
}

// What the interface makes of unpolarised light: R, or Q of the small slope.
fn optics_interface(optics: Optics, pair: Pair) -> f32 {
    if optics.obliquity != PAIR_OBLIQUITY_SMALL_SLOPE {
        return optics_reflectance(optics, pair_cos_half(pair));
    }
    if optics.reflects_all != 0u {
        return small_slope_conductor(pair);
    }
    return small_slope(pair, optics.eta, optics.k);
}

// R·O·M (or Q·M), or what takes the light's cosine out of a colour that is shown as it is.
fn optics_factor(optics: Optics, pair: Pair) -> f32 {
    if optics.shown_as_it_is != 0u {
        return 1.0 / pair.cos_i;
    }
    var factor = optics_interface(optics, pair) * pair_obliquity(pair, optics.obliquity);
    if optics.shadowing != 0u {
        factor *= pair_shadowing(pair);
    }
    return factor;
}
