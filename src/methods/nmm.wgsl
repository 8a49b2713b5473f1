// Twin of nmm.rs: the sum over wavelengths at whole orders.

// Wavelength in µm that stands for all where the answer is white.
const WHITE_UM: f32 = 0.55;

struct Nmm {
    grid: OrderGrid,
    line_width: vec2<f32>,
    _pad: vec2<f32>,
}

@group(1) @binding(0) var<uniform> nmm: Nmm;

fn relief_rgb(q: vec3<f32>) -> vec3<f32> {
    if !is_query(q) {
        return vec3<f32>();
    }
    let span = abs(q.xy) * nmm.grid.extent_um;
    let listed = (nmm.grid.reach > vec2<i32>()) & (span >= vec2<f32>(WAVELENGTH_MIN_UM));
    let total = dot(select(vec2<f32>(), span, listed), vec2<f32>(1.0));
    if total == 0.0 {
        if answer_part != 0u {
            return vec3<f32>();
        }
        return vec3<f32>(order_density(nmm.grid, q, WHITE_UM) / (WHITE_UM * WHITE_UM));
    }
    var rgb = vec3<f32>();
    for (var axis = 0; axis < 2; axis++) {
        if listed[axis] {
            let first = u32(ceil(span[axis] / WAVELENGTH_MAX_UM));
            let last = u32(floor(span[axis] / WAVELENGTH_MIN_UM));
            for (var n = first + answer_part; n <= last; n += answer_parts) {
                let wavelength_um = span[axis] / f32(n);
                let weight = order_density(nmm.grid, q, wavelength_um) * nmm.line_width[axis];
                rgb += weight * colour_density(wavelength_um);
            }
        }
    }
    return rgb / total;
}
