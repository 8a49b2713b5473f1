// Twin of stam_gems.rs: one spacing, in the colours of GPU Gems.

const GEMS_ORDERS: u32 = 7u;
const RED_UM: f32 = 0.875;
const GREEN_UM: f32 = 0.75;
const BLUE_UM: f32 = 0.625;
const HALF_WIDTH_UM: f32 = 0.125;

struct StamGems {
    highlight: vec3<f32>,
    sharpness: f32,
    period_um: f32,
    _pad0: u32,
    _pad1: u32,
    _pad2: u32,
}

@group(1) @binding(0) var<uniform> gems: StamGems;

fn answer_rgb(wi: vec3<f32>, wo: vec3<f32>) -> vec3<f32> {
    let q = wi + wo;
    if !is_query(q) || answer_part != 0u {
        return vec3<f32>();
    }
    let u_um = gems.period_um * q.x;
    let distance = gems.sharpness * u_um / q.z;
    var rgb = gems.highlight * exp(-distance * distance);
    for (var n = 1u; n <= GEMS_ORDERS; n++) {
        let wavelength_um = abs(u_um) / f32(n);
        let x = (vec3<f32>(wavelength_um) - vec3<f32>(RED_UM, GREEN_UM, BLUE_UM)) / HALF_WIDTH_UM;
        rgb += max(1.0 - x * x, vec3<f32>(0.0));
    }
    return rgb * (2.0 / TAU) / max(wi.z, COSINE_MIN);
}
