// Stam's model of one groove spacing d along x, as a reflectance; counterpart of stam.rs, which derives the formulas.
//
// q = (u, v, w) = wi + wo is the sum of the unit vectors to the light and to the viewer. Orders ±1 to ±ORDERS carry
// equal fractions of the light; order 0 is left out. At u, only orders with the sign of u are visible. Order ±n then
// has the wavelength λ_n = d|u|/n, and the colour is
//     rgb = Σ_n density(λ_n)·d/n · 1/(2·ORDERS) · 1/V_RANGE,   n = 1 to ORDERS.
// The factors of a term are, in this order:
// - the colour weights per µm (`colour_density` in colours.wgsl);
// - the line δ(u/λ - n/d)/λ of an order, integrated over wavelengths;
// - the fraction of the light in an order;
// - the density of an order over v, which is uniform.

// Number of orders on each side of order 0. A test compares this file's constants with those in Rust.
const ORDERS: u32 = 8u;
// Length of the interval -1 to 1 of v over which an order spreads uniformly: that of the outgoing hemisphere at normal
// incidence.
const V_RANGE: f32 = 2.0;

// Uniform of the method; counterpart of `StamUniform` in stam.rs.
struct Stam {
    // The spacing d in µm.
    period_um: f32,
    _pad0: u32,
    _pad1: u32,
    _pad2: u32,
}

@group(1) @binding(0) var<uniform> stam: Stam;

// The relief's factor of the reflectance for q, linear sRGB in 1/sr: all of it but Fresnel factor, obliquity and
// shadowing. Zero unless q can be the sum of two unit vectors above the surface (is_query). Callers add up parts of the
// answer (common.wgsl); the loop is short, so part 0 is the whole answer and the other parts are zero.
fn relief_rgb(q: vec3<f32>) -> vec3<f32> {
    if !is_query(q) || answer_part != 0u {
        return vec3<f32>();
    }
    var rgb = vec3<f32>();
    for (var n = 1u; n <= ORDERS; n++) {
        let wavelength_um = stam.period_um * abs(q.x) / f32(n);
        if wavelength_um >= WAVELENGTH_MIN_UM && wavelength_um <= WAVELENGTH_MAX_UM {
            rgb += stam.period_um / f32(n) * colour_density(wavelength_um);
        }
    }
    return rgb / (2.0 * f32(ORDERS) * V_RANGE);
}
