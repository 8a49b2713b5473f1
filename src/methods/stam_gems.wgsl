// Stam's diffraction shader of GPU Gems, chapter 8: one groove spacing d along x; counterpart of stam_gems.rs, which
// explains its colours.
//
// q = (u, v, w) = wi + wo is the sum of the unit vectors to the light and to the viewer. With the wavelengths
// λ_n = d|u|/n, n = 1 to GEMS_ORDERS, the colour is
//     highlight·exp(-(sharpness·d·u/w)²) + Σ_n max(0, 1 - ((λ_n - centre)/HALF_WIDTH_UM)²),
// a sum of *bumps* with a centre for each channel. The first summand is order 0. f_r is the colour over π·cosθi, where
// θi is the angle of incidence.

// Number of orders on each side of order 0; the chapter's value. A test compares this file's constants with those in
// Rust.
const GEMS_ORDERS: u32 = 7u;
// Centre of the red bump in µm; the chapter's value.
const RED_UM: f32 = 0.875;
// Centre of the green bump in µm; the chapter's value.
const GREEN_UM: f32 = 0.75;
// Centre of the blue bump in µm; the chapter's value.
const BLUE_UM: f32 = 0.625;
// Half width of a bump in µm; the chapter's value.
const HALF_WIDTH_UM: f32 = 0.125;

// Uniform of the method; counterpart of `StamGemsUniform` in stam_gems.rs.
struct StamGems {
    // Colour of the highlight, linear sRGB.
    highlight: vec3<f32>,
    // Sharpness of the highlight in 1/µm.
    sharpness: f32,
    // The spacing d in µm.
    period_um: f32,
    _pad0: u32,
    _pad1: u32,
    _pad2: u32,
}

@group(1) @binding(0) var<uniform> gems: StamGems;

// The whole reflectance f_r, linear sRGB in 1/sr. Zero unless wi + wo can be the sum of two unit vectors above the
// surface (is_query). Callers add up parts of the answer (common.wgsl); the loop is short, so part 0 is the whole
// answer and the other parts are zero.
fn answer_rgb(wi: vec3<f32>, wo: vec3<f32>) -> vec3<f32> {
    let q = wi + wo;
    if !is_query(q) || answer_part != 0u {
        return vec3<f32>();
    }
    // d·u: its magnitude is n times the wavelength of order n.
    let path_um = gems.period_um * q.x;
    let scaled_slope = gems.sharpness * path_um / q.z;
    var rgb = gems.highlight * exp(-scaled_slope * scaled_slope);
    for (var n = 1u; n <= GEMS_ORDERS; n++) {
        let wavelength_um = abs(path_um) / f32(n);
        let x = (vec3<f32>(wavelength_um) - vec3<f32>(RED_UM, GREEN_UM, BLUE_UM)) / HALF_WIDTH_UM;
        rgb += max(1.0 - x * x, vec3<f32>(0.0));
    }
    // 1/(π·cosθi), with TAU = 2π and a lower bound on the cosine (common.wgsl).
    return rgb * (2.0 / TAU) / max(wi.z, DIVISOR_MIN);
}
