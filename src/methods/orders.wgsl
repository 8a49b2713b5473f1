// The diffraction orders of a tile, and the sum over the orders nearest to a scattering vector (Single 2014,
// docs/model.md#sources); counterpart of orders.rs, which defines the symbols, and of term_weights.rs. Compiled after
// common.wgsl (TAU) and bessel.wgsl (TERMS_MAX, bessel_j).
//
// q = wi + wo = (u, v, w) is the scattering vector, the sum of the unit vectors to the light and to the viewer. λ is
// the wavelength. κ = 2πw/λ is the phase rate in rad/µm: a point at the height h has the phase κh. H is half the range
// of heights, and (Lx, Ly) the extent of the tile. All lengths are in µm.
// The position p = (u·Lx, v·Ly)/λ of q among the orders is counted in orders: order j = (jx, jy) is at p = j. Its
// amplitude is c_j = Σ_n weight_n(κH)·term_{j,n}. The terms are Fourier coefficients of Chebyshev polynomials of the
// heights, or of their powers (Taylor series). The power spectrum is
//     S = peak_um2·|Σ_j c_j·exp(-sharpness·(p - j)²)|².

// Largest exponent x of the Gaussian e⁻ˣ of an amplitude that is not neglected. Beyond it, the order's power is less
// than e⁻⁶⁰ of its peak, too little to be visible.
const EXPONENT_MAX: f32 = 30.0;

// Lattice of the orders; counterpart of `OrderGrid` in order_grid.rs.
struct OrderGrid {
    // (Lx, Ly) in µm.
    extent_um: vec2<f32>,
    // Factor of d² in the exponent of the Gaussian, for a distance d in orders along x and y.
    sharpness: vec2<f32>,
    // Largest |jx| and |jy| of the stored orders.
    reach: vec2<i32>,
    // Number of stored terms, a multiple of 8. Terms beyond the required ones are zero.
    terms: u32,
    // Series of the phase screen: 0 for Chebyshev, 1 for Taylor.
    series: u32,
    // H in µm.
    half_range_um: f32,
    // S at the centre of an order with |c_j| = 1, in µm².
    peak_um2: f32,
    // Number of orders summed along each axis, at least 1.
    neighbourhood: u32,
    // The κH from which on all stored terms are summed, with the phase rate κ = 2πw/λ and H = `half_range_um`. For each
    // unit of κH below it, the series needs at least one term less. One less is summed.
    full_terms_kappa_h: f32,
}

// Terms of the orders: (re, im) of an even term and (re, im) of the following odd term. The layout is [jy][jx][n/2]
// with jy from 0 and jx from -reach.x. The terms of order -j are the complex conjugates of those of order j, since
// heights are real.
@group(1) @binding(2) var<storage, read> order_terms: array<vec4<f32>>;

// Weights of the terms at the present w and wavelength; set_term_weights writes them.
var<private> term_weights: array<f32, TERMS_MAX>;
// Number of terms to sum, a multiple of 8: order_amplitude sums eight in an iteration.
var<private> term_count: u32;

// The position p of q among the orders.
fn order_position(grid: OrderGrid, q: vec3<f32>, wavelength_um: f32) -> vec2<f32> {
    return q.xy / wavelength_um * grid.extent_um;
}

// The order nearest to a position.
fn nearest_order(position: vec2<f32>) -> vec2<f32> {
    return floor(position + 0.5);
}

// Writes `term_weights` and `term_count` for one wavelength. The weight of term n is (2 - δ_n0)·i^n·J_n(κH) of the
// Chebyshev series (series 0), or i^n·(κH)^n/n! of the Taylor series. For odd n the factor i is left to
// order_amplitude, so that weights are real and have the signs + + - - and so on.
fn set_term_weights(grid: OrderGrid, w: f32, wavelength_um: f32) {
    let kappa_h = TAU * w / wavelength_um * grid.half_range_um;
    // Number of terms that the series does not need at this κH.
    let spare = u32(max(grid.full_terms_kappa_h - kappa_h, 0.0));
    // At least one term, rounded up to a multiple of 8.
    term_count = (max(grid.terms - min(spare, grid.terms), 1u) + 7u) & ~7u;
    if grid.series == 0u {
        bessel_j(kappa_h, term_count, &term_weights);
    } else {
        var power_over_factorial = 1.0;
        term_weights[0] = 1.0;
        for (var n = 1u; n < term_count; n++) {
            power_over_factorial *= kappa_h / f32(n);
            term_weights[n] = power_over_factorial;
        }
    }
    // 2 - δ_n0 of the Chebyshev series. Term 0 has the factor 1, so its weight is restored after the loop.
    let factor = select(1.0, 2.0, grid.series == 0u);
    let weight_0 = term_weights[0];
    for (var n = 0u; n < term_count; n += 4u) {
        term_weights[n] *= factor;
        term_weights[n + 1u] *= factor;
        term_weights[n + 2u] *= -factor;
        term_weights[n + 3u] *= -factor;
    }
    term_weights[0] = weight_0;
}

// The weights of an even and of the following odd term, each twice: for the real and the imaginary part of the term.
fn weight_pair(even: u32) -> vec4<f32> {
    return vec2<f32>(term_weights[even], term_weights[even + 1u]).xxyy;
}

// The amplitude c_j = (re, im) of an order within `reach`.
fn order_amplitude(grid: OrderGrid, order: vec2<i32>) -> vec2<f32> {
    // Order j or -j is stored: the one with jy ≥ 0.
    let sign = select(1, -1, order.y < 0);
    let row_start = (sign * order.y) * (2 * grid.reach.x + 1);
    // Index in `order_terms` of the order's first pair of terms.
    var pair = u32(row_start + sign * order.x + grid.reach.x) * (grid.terms / 2u);
    // Sums over even terms (re, im) and over odd ones (re, im).
    var sum = vec4<f32>();
    for (var n = 0u; n < term_count; n += 8u) {
        sum += order_terms[pair] * weight_pair(n);
        sum += order_terms[pair + 1u] * weight_pair(n + 2u);
        sum += order_terms[pair + 2u] * weight_pair(n + 4u);
        sum += order_terms[pair + 3u] * weight_pair(n + 6u);
        pair += 4u;
    }
    // The even sum plus i times the odd one. Where -j is stored, the sums of j are the conjugates of both.
    return vec2<f32>(sum.x - f32(sign) * sum.w, f32(sign) * sum.y + sum.z);
}

// Exponent of an order's Gaussian at a distance (x, y) in orders from the order.
fn order_exponent(grid: OrderGrid, distance: vec2<f32>) -> f32 {
    return dot(grid.sharpness, distance * distance);
}

// Power spectrum S in µm²: the coherent sum over a block of `neighbourhood`² orders around the position of q.
fn order_density(grid: OrderGrid, q: vec3<f32>, wavelength_um: f32) -> f32 {
    let position = order_position(grid, q, wavelength_um);
    let reach = vec2<f32>(grid.reach);
    // The nearest stored order. If its Gaussian is neglected, all are.
    let nearest = clamp(nearest_order(position), -reach, reach);
    if order_exponent(grid, position - nearest) > EXPONENT_MAX {
        return 0.0;
    }
    set_term_weights(grid, q.z, wavelength_um);
    // The block of nearest orders, from `start` to `last`, without those that are not stored.
    let first = vec2<i32>(floor(position - 0.5 * f32(grid.neighbourhood))) + 1;
    let last = min(first + i32(grid.neighbourhood) - 1, grid.reach);
    let start = max(first, -grid.reach);
    var sum = vec2<f32>();
    for (var jy = start.y; jy <= last.y; jy++) {
        for (var jx = start.x; jx <= last.x; jx++) {
            let order = vec2<i32>(jx, jy);
            let exponent = order_exponent(grid, position - vec2<f32>(order));
            if exponent < EXPONENT_MAX {
                sum += exp(-exponent) * order_amplitude(grid, order);
            }
        }
    }
    return grid.peak_um2 * dot(sum, sum);
}
