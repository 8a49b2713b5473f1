// Stam's model of one groove spacing d along x, as a reflectance; counterpart of stam.rs, which derives the formulas.
//
// Orders n = ±1 to ±8 carry equal fractions of the light, and order n leaves at λ_n = d|u|/n, with q = (u, v, w) = wi +
// wo. The colour is rgb = Σ_n density(λ_n)·(d/n)/(2·ORDERS·V_RANGE), n = 1 to 8, with the density of colours.wgsl.

// Number of orders on each side.
const ORDERS: u32 = 8u;
// Length of the interval of v over which an order spreads uniformly: that of the outgoing hemisphere at normal
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

// The relief's factor of the reflectance for q = wi + wo, linear sRGB in 1/sr.
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
