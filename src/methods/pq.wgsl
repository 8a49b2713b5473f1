// PQ: a finite number of repeats of the tile, P along x and Q along y; counterpart of pq.rs, which derives the
// formulas.
//
// rgb = Σ_i S(q, λ_i)/λ_i² · weight_i at the scattering vector q = wi + wo, over wavelengths in equal steps
// (colours.wgsl). The power spectrum in µm² is
//     S = peak_um2·|c_j|²·D_P(d.x)²·D_Q(d.y)².
// Here d is the distance in orders from the nearest order j to q's position among the orders. c_j is the amplitude of
// order j (orders.wgsl), peak_um2 the S of an order with |c_j| = 1 at d = 0, and D_P(d) = sin(πPd)/(P·sin(πd)).

// Value of |πPd| below which D_P is computed by its Taylor series, to avoid 0/0. The first term left out is under 1e-9
// there. A test compares the value with that in Rust.
const SERIES_ARGUMENT_MAX: f32 = 0.01;

// Uniform of the method; counterpart of `PqUniform` in pq.rs.
struct Pq {
    // Lattice of the tile's diffraction orders.
    grid: OrderGrid,
    // P and Q, whole numbers of at least 1.
    repeats: vec2<f32>,
    // Number of entries of `colours` (colours.wgsl).
    wavelengths: u32,
    _pad: u32,
}

@group(1) @binding(0) var<uniform> pq: Pq;

// Interference kernel D_P(d) of P `repeats` at the `distance` d from the nearest order, in orders, |d| ≤ 1/2. It is 1
// at d = 0.
fn repeat_kernel(repeats: f32, distance: f32) -> f32 {
    // πd, since TAU is 2π (common.wgsl).
    let x = 0.5 * TAU * distance;
    if repeats * abs(x) < SERIES_ARGUMENT_MAX {
        return 1.0 - (repeats * repeats - 1.0) * x * x / 6.0;
    }
    return sin(repeats * x) / (repeats * sin(x));
}

// Power spectrum S in µm²; 0 where the nearest order is not stored.
fn pq_density(q: vec3<f32>, wavelength_um: f32) -> f32 {
    let position = order_position(pq.grid, q, wavelength_um);
    let nearest = nearest_order(position);
    if any(abs(nearest) > vec2<f32>(pq.grid.reach)) {
        return 0.0;
    }
    // Sets the weights of the terms of the phase screen's series, which order_amplitude reads.
    set_term_weights(pq.grid, q.z, wavelength_um);
    let c = order_amplitude(pq.grid, vec2<i32>(nearest));
    let distance = position - nearest;
    let kernel = repeat_kernel(pq.repeats.x, distance.x) * repeat_kernel(pq.repeats.y, distance.y);
    return pq.grid.peak_um2 * dot(c, c) * kernel * kernel;
}

// The relief's factor of the reflectance, linear sRGB in 1/sr: without Fresnel factor, obliquity and shadowing. Zero
// unless q can be the sum of two unit vectors above the surface (is_query).
fn relief_rgb(q: vec3<f32>) -> vec3<f32> {
    if !is_query(q) {
        return vec3<f32>();
    }
    var rgb = vec3<f32>();
    // The wavelengths of this part of the sum; the caller adds up the parts (common.wgsl).
    for (var i = answer_part; i < pq.wavelengths; i += answer_parts) {
        // Weights of red, green and blue in xyz, the wavelength in µm in w.
        let colour = colours[i];
        rgb += pq_density(q, colour.w) / (colour.w * colour.w) * colour.xyz;
    }
    return rgb;
}
