// The wave orders of a tile, and Single 2014's sum over the orders near a query; counterpart of orders.rs, which
// derives the formulas, and of term_weights.rs.
//
// Symbols: q = wi + wo = (u, v, w); κ = 2πw/λ; H half the range of heights; (Lx, Ly) the extent of the tile. The
// position p = (u·Lx, v·Ly)/λ of a query is a fractional order. Order j has the amplitude c_j = Σ_n
// weight_n(κH)·term_{j,n}, where the terms are Fourier coefficients of powers (Taylor) or Chebyshev polynomials of the
// heights. The power spectrum is
//     S = peak·|Σ_j c_j·exp(-sharpness·(p - j)²)|².

// Exponent above which a Gaussian counts as 0: its square, e⁻⁸⁰, is lost in single precision.
const FAINT: f32 = 40.0;

// Lattice of the orders; counterpart of `OrderGrid` in order_grid.rs.
struct OrderGrid {
    // (Lx, Ly) in µm.
    extent_um: vec2<f32>,
    // Factor of d² in the exponent of the Gaussian, for a distance d in orders along x and y.
    sharpness: vec2<f32>,
    // Largest |jx| and |jy| of the stored orders.
    reach: vec2<i32>,
    // Number of stored terms, a multiple of 8.
    terms: u32,
    // 0 for Chebyshev, 1 for Taylor.
    series: u32,
    // H in µm.
    half_range_um: f32,
    // S at the centre of an order with |c_j| = 1, in µm².
    peak_um2: f32,
    // Number of orders summed along each axis.
    neighbourhood: u32,
    // The κH from which on all terms are summed; see set_term_weights.
    argument_of_terms: f32,
}

// Terms of the orders: (re, im) of an even term and (re, im) of the following odd term. The layout is [jy][jx][n/2]
// with jy from 0 and jx from -reach.x. Orders with a negative jy are the complex conjugates of their opposites.
@group(1) @binding(2) var<storage, read> order_terms: array<vec4<f32>>;

// Weights of the terms at the present wavelength; set_term_weights writes them.
var<private> term_weights: array<f32, TERMS_MAX>;
// Number of terms to sum, a multiple of eight.
var<private> term_count: u32;

// The position of q among the orders, in orders.
fn order_position(grid: OrderGrid, q: vec3<f32>, wavelength_um: f32) -> vec2<f32> {
    return q.xy / wavelength_um * grid.extent_um;
}

// The order nearest to a position.
fn nearest_order(position: vec2<f32>) -> vec2<f32> {
    return floor(position + 0.5);
}

// Sets `term_weights` and `term_count` for one wavelength. The weight of term n is (2 - δ_n0)·J_n(κH) of the Chebyshev
// series (series 0) or (κH)^n/n! of the Taylor series, times the sign of i^n, which is + + - - and so on.
fn set_term_weights(grid: OrderGrid, w: f32, wavelength_um: f32) {
    // x = κH. Each unit of x below `argument_of_terms` saves one term.
    let x = TAU * w / wavelength_um * grid.half_range_um;
    let spare = u32(max(grid.argument_of_terms - x, 0.0));
    term_count = (max(grid.terms - min(spare, grid.terms), 1u) + 7u) & ~7u;
    if grid.series == 0u {
        bessel_j(x, term_count, &term_weights);
    } else {
        var power_over_factorial = 1.0;
        term_weights[0] = 1.0;
        for (var n = 1u; n < term_count; n++) {
            power_over_factorial *= x / f32(n);
            term_weights[n] = power_over_factorial;
        }
    }
    let factor = select(1.0, 2.0, grid.series == 0u);
    let constant = term_weights[0];
    for (var n = 0u; n < term_count; n += 4u) {
        term_weights[n] *= factor;
        term_weights[n + 1u] *= factor;
        term_weights[n + 2u] *= -factor;
        term_weights[n + 3u] *= -factor;
    }
    term_weights[0] = constant;
}

// The weights of an even and of the following odd term, each twice, for the layout of `order_terms`.
fn weight_pair(even: u32) -> vec4<f32> {
    return vec2<f32>(term_weights[even], term_weights[even + 1u]).xxyy;
}

// The amplitude c_j of an order within `reach`: (re, im). Even terms are summed as they are, odd ones times i.
fn order_amplitude(grid: OrderGrid, order: vec2<i32>) -> vec2<f32> {
    let sign = select(1, -1, order.y < 0);
    let row = (sign * order.y) * (2 * grid.reach.x + 1);
    var pair = u32(row + sign * order.x + grid.reach.x) * (grid.terms / 2u);
    var sum = vec4<f32>();
    for (var n = 0u; n < term_count; n += 8u) {
        sum += order_terms[pair] * weight_pair(n);
        sum += order_terms[pair + 1u] * weight_pair(n + 2u);
        sum += order_terms[pair + 2u] * weight_pair(n + 4u);
        sum += order_terms[pair + 3u] * weight_pair(n + 6u);
        pair += 4u;
    }
    return vec2<f32>(sum.x - f32(sign) * sum.w, f32(sign) * sum.y + sum.z);
}

// Exponent of the Gaussian at a distance, in orders, along x and y.
fn order_exponent(grid: OrderGrid, distance: vec2<f32>) -> f32 {
    return dot(grid.sharpness, distance * distance);
}

// Power spectrum S in µm²: the coherent sum over a block of `neighbourhood`² orders around the query's position.
fn order_density(grid: OrderGrid, q: vec3<f32>, wavelength_um: f32) -> f32 {
    let position = order_position(grid, q, wavelength_um);
    let reach = vec2<f32>(grid.reach);
    if order_exponent(grid, position - clamp(nearest_order(position), -reach, reach)) > FAINT {
        return 0.0;
    }
    set_term_weights(grid, q.z, wavelength_um);
    let first = vec2<i32>(floor(position - 0.5 * f32(grid.neighbourhood))) + 1;
    let last = min(first + i32(grid.neighbourhood) - 1, grid.reach);
    let start = max(first, -grid.reach);
    var sum = vec2<f32>();
    for (var jy = start.y; jy <= last.y; jy++) {
        for (var jx = start.x; jx <= last.x; jx++) {
            let order = vec2<i32>(jx, jy);
            let exponent = order_exponent(grid, position - vec2<f32>(order));
            if exponent < FAINT {
                sum += exp(-exponent) * order_amplitude(grid, order);
            }
        }
    }
    return grid.peak_um2 * dot(sum, sum);
}
