// Linear-sRGB weights of wavelengths, which turn a spectrum into a colour; counterpart of colours.rs, which computes
// them.
//
// An entry of `colours` has the weights of red, green and blue in xyz, and the wavelength in µm in w. For flss.wgsl and
// pq.wgsl the entries are quadrature nodes: rgb = Σ_i spectrum(λ_i)·weight_i. For nmm.wgsl and stam.wgsl they are
// values of a density on a uniform grid: rgb = ∫ spectrum(λ)·density(λ) dλ.

@group(1) @binding(1) var<storage, read> colours: array<vec4<f32>>;

// The density per µm at a wavelength in µm: linear between the entries, and constant beyond them. At least two entries
// reach from WAVELENGTH_MIN_UM to WAVELENGTH_MAX_UM (common.wgsl).
fn colour_density(wavelength_um: f32) -> vec3<f32> {
    let intervals = arrayLength(&colours) - 1u;
    let position = (wavelength_um - WAVELENGTH_MIN_UM) / (WAVELENGTH_MAX_UM - WAVELENGTH_MIN_UM) * f32(intervals);
    let below = min(u32(max(position, 0.0)), intervals - 1u);
    return mix(colours[below].xyz, colours[below + 1u].xyz, clamp(position - f32(below), 0.0, 1.0));
}
