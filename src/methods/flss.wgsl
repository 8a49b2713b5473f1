// FLSS, full lambda spectral sampling; counterpart of flss.rs.
//
// rgb = Σ_i S(q, λ_i)/λ_i² · weight_i over wavelengths λ_i in equal steps, in µm. q = wi + wo is the sum of the unit
// vectors to the light and to the viewer. S is the power spectrum in µm² (`order_density` in orders.wgsl). `colours`
// (colours.wgsl) has linear-sRGB weights in xyz and wavelengths in µm in w.

// Uniform of the method; counterpart of `FlssUniform` in flss.rs.
struct Flss {
    // Lattice of the tile's diffraction orders.
    grid: OrderGrid,
    // Number of entries of `colours`.
    wavelengths: u32,
    // Padding to a multiple of 16 bytes.
    _pad0: u32,
    _pad1: u32,
    _pad2: u32,
}

@group(1) @binding(0) var<uniform> flss: Flss;

// The relief's factor of the reflectance for q = wi + wo, linear sRGB in 1/sr. Zero unless q can be the sum of two unit
// vectors above the surface (is_query). Callers add up `answer_parts` parts of the answer (common.wgsl): each part sums
// every `answer_parts`-th wavelength.
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
