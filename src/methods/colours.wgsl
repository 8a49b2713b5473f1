// Twin of colours.rs: the linear-sRGB weight (xyz) at a wavelength in µm (w). What the entries are, a list of samples
// or a density on an even grid, is the method's.

@group(1) @binding(1) var<storage, read> colours: array<vec4<f32>>;

// A density on the even grid from WAVELENGTH_MIN_UM to WAVELENGTH_MAX_UM, between its entries linear.
fn colour_density(wavelength_um: f32) -> vec3<f32> {
    let intervals = arrayLength(&colours) - 1u;
    let place = (wavelength_um - WAVELENGTH_MIN_UM) / (WAVELENGTH_MAX_UM - WAVELENGTH_MIN_UM) * f32(intervals);
    let below = min(u32(max(place, 0.0)), intervals - 1u);
    return mix(colours[below].xyz, colours[below + 1u].xyz, clamp(place - f32(below), 0.0, 1.0));
}
