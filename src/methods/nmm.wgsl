// NMM, non-uniform wavelengths; counterpart of nmm.rs, which derives the formulas.
//
// Only those wavelengths are summed at which a wave order leaves in the direction of the query: λ = |u|·Lx/n for whole
// n, and likewise |v|·Ly/n. Here q = (u, v, w) = wi + wo, and (Lx, Ly) is the extent of the tile. With the span
// (|u|·Lx, |v|·Ly), rgb = Σ S(λ)·line_width·density(λ) / (sum of the spans).

// Wavelength in µm at which S is evaluated where no list of wavelengths counts and the answer is white.
const WHITE_UM: f32 = 0.55;

// Uniform of the method; counterpart of `NmmUniform` in nmm.rs.
struct Nmm {
    // Wave orders of the tile (order_grid.rs).
    grid: OrderGrid,
    // Ratio of the mean over an order's cell to the peak, along x and y (`line_width` in nmm.rs).
    line_width: vec2<f32>,
    _pad: vec2<f32>,
}

@group(1) @binding(0) var<uniform> nmm: Nmm;

// The relief's factor of the reflectance for q = wi + wo, linear sRGB in 1/sr.
fn relief_rgb(q: vec3<f32>) -> vec3<f32> {
    if !is_query(q) {
        return vec3<f32>();
    }
    let span = abs(q.xy) * nmm.grid.extent_um;
    // Whether an axis has a list: its orders are held, and its span reaches the first order.
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
