// Twin of flss.rs: the sum over equal steps of the wavelength.

struct Flss {
    grid: OrderGrid,
    wavelengths: u32,
    _pad0: u32,
    _pad1: u32,
    _pad2: u32,
}

@group(1) @binding(0) var<uniform> flss: Flss;

fn relief_rgb(q: vec3<f32>) -> vec3<f32> {
    if !is_query(q) {
        return vec3<f32>();
    }
    var rgb = vec3<f32>();
    for (var i = answer_part; i < flss.wavelengths; i += answer_parts) {
        let colour = colours[i];
        rgb += order_density(flss.grid, q, colour.w) / (colour.w * colour.w) * colour.xyz;
    }
    return rgb;
}
