// Twin of stam.rs: one spacing, as a reflectance.

// Orders on each side.
const ORDERS: u32 = 8u;
// Range of v over the outgoing hemisphere.
const V_RANGE: f32 = 2.0;

struct Stam {
    period_um: f32,
    _pad0: u32,
    _pad1: u32,
    _pad2: u32,
}

@group(1) @binding(0) var<uniform> stam: Stam;

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
