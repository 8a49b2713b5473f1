// NMM (Dhillon et al. 2014); counterpart of nmm.rs, which derives the formulas. common.wgsl has the range of
// wavelengths.
//
// The colour is a sum over the wavelengths at which an order of light from wi leaves along wo: a list λ = |u|·Lx/n
// along x and a list λ = |v|·Ly/n along y, for whole n. Here q = (u, v, w) = wi + wo, and (Lx, Ly) is the extent of the
// tile in µm. With the spans |u|·Lx and |v|·Ly,
//     rgb = Σ S(λ)·mean_over_peak·density(λ) / (sum of the spans),
// where S is the power spectrum in µm² (`order_density` in orders.wgsl). density(λ) is the weight of each channel per
// µm, or in the unweighted form W of nmm.rs (`colour_density` in colours.wgsl). An axis without a list has no span in
// the sum.

// Wavelength in µm of the white answer near q.xy = 0, where neither axis has a list, as in Single 2014. A test compares
// the value with that in Rust.
const WHITE_UM: f32 = 0.55;

// Uniform of the method; counterpart of `NmmUniform` in nmm.rs.
struct Nmm {
    // Lattice of the tile's diffraction orders.
    grid: OrderGrid,
    // Mean of S over the cell of an order (the frequencies nearest to it), divided by the peak of S at the order; along
    // x and y.
    mean_over_peak: vec2<f32>,
    _pad: vec2<f32>,
}

@group(1) @binding(0) var<uniform> nmm: Nmm;

// The relief's factor of the reflectance for q = wi + wo, linear sRGB in 1/sr: the sum over the wavelengths of the part
// `answer_part` (common.wgsl).
fn relief_rgb(q: vec3<f32>) -> vec3<f32> {
    if !is_query(q) {
        return vec3<f32>();
    }
    let span_um = abs(q.xy) * nmm.grid.extent_um;
    // Whether an axis has a list: orders other than 0 are stored (`reach`), and the span reaches the first of them.
    let listed = (nmm.grid.reach > vec2<i32>()) & (span_um >= vec2<f32>(WAVELENGTH_MIN_UM));
    let span_sum_um = dot(select(vec2<f32>(), span_um, listed), vec2<f32>(1.0));
    if span_sum_um == 0.0 {
        // White; its single wavelength belongs to part 0.
        if answer_part != 0u {
            return vec3<f32>();
        }
        return vec3<f32>(order_density(nmm.grid, q, WHITE_UM) / (WHITE_UM * WHITE_UM));
    }
    var rgb = vec3<f32>();
    for (var axis = 0; axis < 2; axis++) {
        if listed[axis] {
            // The span is at least WAVELENGTH_MIN_UM, so n is at least 1.
            let first = u32(ceil(span_um[axis] / WAVELENGTH_MAX_UM));
            let last = u32(floor(span_um[axis] / WAVELENGTH_MIN_UM));
            for (var n = first + answer_part; n <= last; n += answer_parts) {
                let wavelength_um = span_um[axis] / f32(n);
                let weight = order_density(nmm.grid, q, wavelength_um) * nmm.mean_over_peak[axis];
                rgb += weight * colour_density(wavelength_um);
            }
        }
    }
    return rgb / span_sum_um;
}
