// Linear-sRGB weights (xyz) of wavelengths in µm (w); twin of colours.rs.
//
// The entries are samples (flss.wgsl, pq.wgsl) or a density on a uniform grid (nmm.wgsl, stam.wgsl).

@group(1) @binding(1) var<storage, read> colours: array<vec4<f32>>;

// A density at a wavelength, linear between its entries from WAVELENGTH_MIN_UM to WAVELENGTH_MAX_UM.
fn colour_density(wavelength_um: f32) -> vec3<f32> {
    let intervals = arrayLength(&colours) - 1u;
    let position = (wavelength_um - WAVELENGTH_MIN_UM) / (WAVELENGTH_MAX_UM - WAVELENGTH_MIN_UM) * f32(intervals);
    let below = min(u32(max(position, 0.0)), intervals - 1u);
    return mix(colours[below].xyz, colours[below + 1u].xyz, clamp(position - f32(below), 0.0, 1.0));
}
