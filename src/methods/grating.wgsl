// Reflectance of a grating in linear sRGB, from order efficiencies by Maxwell's equations. It is the counterpart of
// `GratingColourLobe::eval` in src/grating/colour_lobe.rs, of `CellPosition` in cell_position.rs and of
// `EfficiencyView` in efficiencies.rs, with the same arithmetic.
//
// Symbols: d is the period in µm and ν = 1/λ in 1/µm. q = (wi + wo).xy has the length ρ. Order m has the frequency m/d
// in cycles/µm, and is a Gaussian of standard deviation σ over frequency. Along the line νq, order m is met at ν =
// m·q.x/(d·ρ²), with the standard deviation τ = σ/ρ. The reflectance is
//     f_r = Σ_m e_m · exp(-b²/2) · weights(ν_m, τ) / (2πσ²),
// where e_m is the efficiency of the order at ν_m, b its distance from the line in units of σ, and weights(ν, τ) the
// integral of the colour weights times the Gaussian. Order 0 has no wavelength; its colour is a table over directions.
//
// Efficiencies are tabulated over t = νd·√(1 - y²) and a, the position of the incident order
// (grating/cell_position.rs). Orders pass off where t ± a is a whole number, which divides the (t, a) plane into cells.

// Middle of the visible range of ν, from 1/830 nm to 1/360 nm, in 1/µm (src/grating/colour_tables.rs).
const NU_MIDDLE: f32 = 1.9912986;
// Half the width of the visible range in 1/µm.
const NU_HALF: f32 = 0.78647923;
// The τ in 1/µm in the middle of the table of weights, whose axis is τ/(τ + TAU_SCALE).
const TAU_SCALE: f32 = 0.25;
// Distance in standard deviations up to which a Gaussian counts: σ of an order, and τ beyond the visible range. It is
// e^-12.5 = 4e-6 there.
const REACH: f32 = 5.0;
// Efficiency that a table value of 1 stands for, 1/60000 (`UNIT` in src/grating/efficiencies.rs).
const UNIT: f32 = 1.6666667e-5;
// log₂(e), which turns exp into exp2.
const LOG2_E: f32 = 1.442695;
// Number of nodes of the table of weights along τ.
const WEIGHTS_WIDTHS: u32 = 96u;
// Number of nodes of the table of weights along ν.
const WEIGHTS_PLACES: u32 = 256u;
// Number of nodes of the table of order 0 along each axis.
const ORDER_ZERO_SIDE: u32 = 48u;

// Numbers of a grating and layout of its tables; counterpart of `GratingUniform` in grating.rs.
struct Grating {
    // First wavelength of the efficiencies in nm.
    first_nm: f32,
    // Number of wavelengths of the efficiencies per nm.
    steps_per_nm: f32,
    // Number of wavelengths of the efficiencies.
    wavelengths: u32,
    // Number of cells of each wavelength.
    cells: u32,
    // Number of nodes along each side of a cell.
    nodes: u32,
    // Highest order that propagates at any wavelength.
    orders: f32,
    // Index in `colours` of the first node of the table of order 0.
    order_zero: u32,
    // Period d in µm.
    period_um: f32,
    // Frequency of order 1, 1/d, in cycles/µm.
    spacing: f32,
    // Standard deviation σ of an order's Gaussian in cycles/µm.
    sigma: f32,
    _pad0: u32,
    _pad1: u32,
}

@group(1) @binding(0) var<uniform> grating: Grating;
// First, for each wavelength and cell, the index of the cell's first efficiency. Then the efficiencies, 16 bits each,
// two in a u32.
@group(1) @binding(1) var<storage, read> efficiencies: array<u32>;
// Colours (red, green, blue, unused): the table of weights, then the table of order 0.
@group(1) @binding(2) var<storage, read> colours: array<vec4<f32>>;

// Position (t, a) among the cells. The library has t and a in double precision, here they are single:
// crates/realtime/tests/realtime/gratings.rs bounds the difference.
struct Place {
    // Number of orders that propagate, less one.
    cell: u32,
    // Number of the incident order among them, counted from the order that goes furthest to -x.
    incident: u32,
    // Position in the cell, stretched towards its sides; each coordinate in [0, 1].
    stretched: vec2<f32>,
    // Whether the incident order propagates.
    propagates: bool,
}

// √x/(√x + √(1 - x)): efficiencies have square-root singularities at the sides of a cell.
fn stretched(x: vec2<f32>) -> vec2<f32> {
    let low = sqrt(max(x, vec2<f32>(0.0)));
    let high = sqrt(max(1.0 - x, vec2<f32>(0.0)));
    return low / (low + high);
}

// The position of the incident order with the coordinates t and a.
fn place_of(t: f32, a: f32) -> Place {
    let sums = vec2<f32>(t - a, t + a);
    let above = max(sums, vec2<f32>(0.0));
    let whole = floor(above);
    return Place(u32(whole.x + whole.y), u32(whole.y), stretched(above - whole), all(sums > vec2<f32>(0.0)));
}

// Interpolation along an axis: the node below, and the fraction of the way to the next.
struct Interval {
    low: u32,
    fraction: f32,
}

// The interval of the position x among `count` nodes.
fn interval_of(x: f32, count: u32) -> Interval {
    let inside = clamp(x, 0.0, f32(count - 1u));
    let low = min(floor(inside), f32(count - 2u));
    return Interval(u32(low), inside - low);
}

// The 16-bit value at an index.
fn table_value(number: u32) -> f32 {
    return f32((efficiencies[number >> 1u] >> (16u * (number & 1u))) & 0xffffu);
}

// Efficiency in units of UNIT at one wavelength of the table, bilinear over a cell. `entry` is the number of the pair
// of incident and outgoing order within a node.
fn efficiency_at(wavelength: u32, cell: u32, entry: u32, p: Interval, q: Interval) -> f32 {
    let entries = (cell + 1u) * (cell + 2u);
    let first = efficiencies[wavelength * grating.cells + cell] + entry;
    let near = first + (p.low * grating.nodes + q.low) * entries;
    let far = near + grating.nodes * entries;
    return mix(
        mix(table_value(near), table_value(near + entries), q.fraction),
        mix(table_value(far), table_value(far + entries), q.fraction),
        p.fraction,
    );
}

// Efficiency of an outgoing order at a wavelength in nm; `order` is its index among the cell's propagating orders.
fn efficiency(place: Place, nm: f32, order: u32) -> f32 {
    let cell = min(place.cell, grating.cells - 1u);
    let entry = min(place.incident, cell) * (cell + 2u) + order;
    let wavelength = interval_of((nm - grating.first_nm) * grating.steps_per_nm, grating.wavelengths);
    let p = interval_of(place.stretched.x * f32(grating.nodes - 1u), grating.nodes);
    let q = interval_of(place.stretched.y * f32(grating.nodes - 1u), grating.nodes);
    let shorter = efficiency_at(wavelength.low, cell, entry, p, q);
    let longer = efficiency_at(wavelength.low + 1u, cell, entry, p, q);
    return mix(shorter, longer, wavelength.fraction) * UNIT;
}

// Bilinear interpolation at a position in [0, 1]² of a table of colours that begins at index `begin` and has `counts`
// nodes along its axes.
fn colour_at(begin: u32, counts: vec2<u32>, position: vec2<f32>) -> vec3<f32> {
    let last = vec2<f32>(counts - 1u);
    let x = clamp(position, vec2<f32>(0.0), vec2<f32>(1.0)) * last;
    let low = min(floor(x), last - 1.0);
    let t = x - low;
    let first = begin + u32(low.x) * counts.y + u32(low.y);
    let near = mix(colours[first].xyz, colours[first + 1u].xyz, t.y);
    let far = mix(colours[first + counts.y].xyz, colours[first + counts.y + 1u].xyz, t.y);
    return mix(near, far, t.x);
}

// Integral of the colour weights times an order's Gaussian, ∫ weight(1/ν) exp(-(ν - nu)²/2τ²) dν, for each channel.
fn weights(nu: f32, tau: f32) -> vec3<f32> {
    let position = (nu - NU_MIDDLE) / (tau * REACH + NU_HALF);
    if abs(position) >= 1.0 {
        return vec3<f32>(0.0);
    }
    let widths = tau / (tau + TAU_SCALE);
    let counts = vec2<u32>(WEIGHTS_WIDTHS, WEIGHTS_PLACES);
    return colour_at(0u, counts, vec2<f32>(widths, 0.5 * position + 0.5)) * widths;
}

// The colour of order 0 between directions whose half difference is (x, y).
fn order_zero(x: f32, y: f32) -> vec3<f32> {
    let cosine_y_squared = max(1.0 - y * y, 0.0);
    let cosine_x_squared = max(1.0 - x * x / max(cosine_y_squared, 1e-12), 0.0);
    let position = sqrt(vec2<f32>(cosine_x_squared, cosine_y_squared));
    return colour_at(grating.order_zero, vec2<u32>(ORDER_ZERO_SIDE), position);
}

// The line νq: length ρ and direction of q, and the orders met in the visible range.
struct Line {
    length: f32,
    direction: vec2<f32>,
    // Orders are `sign` times the numbers from `first` to `last`.
    first: f32,
    last: f32,
    sign: f32,
}

// The line of a query; orders whose Gaussian does not reach the visible range are left out.
fn line_of(q: vec2<f32>) -> Line {
    let length = length(q);
    let direction = select(q / max(length, 1e-9), vec2<f32>(1.0, 0.0), length < 1e-9);
    let per_order = max(abs(direction.x) * grating.spacing, 1e-9);
    let reach = REACH * grating.sigma;
    let low = (length * (NU_MIDDLE - NU_HALF) - reach) / per_order;
    let high = (length * (NU_MIDDLE + NU_HALF) + reach) / per_order;
    let most = grating.orders;
    let first = clamp(ceil(low), -most, most + 1.0);
    let last = clamp(floor(high), -most - 1.0, most);
    return Line(length, direction, first, last, select(1.0, -1.0, direction.x < 0.0));
}

// Contribution of an order met at ν = nu to 2πσ²·f_r. `kernel` is exp(-b²/2). x is wo.x - wi.x, and y half of wi.y -
// wo.y.
fn order_colour(order: f32, nu: f32, kernel: f32, tau: f32, x: f32, y: f32) -> vec3<f32> {
    let visible_nu = clamp(nu, NU_MIDDLE - NU_HALF, NU_MIDDLE + NU_HALF);
    let periods = visible_nu * grating.period_um;
    let t = periods * sqrt(max((1.0 - y) * (1.0 + y), 0.0));
    let place = place_of(t, 0.5 * (x * periods - order));
    let outgoing = i32(place.incident) + i32(order);
    if !place.propagates || outgoing < 0 || outgoing > i32(place.cell) {
        return vec3<f32>(0.0);
    }
    return weights(nu, tau) * (efficiency(place, 1e3 / visible_nu, u32(outgoing)) * kernel);
}

// The whole reflectance f_r, linear sRGB in 1/sr.
fn answer_rgb(wi: vec3<f32>, wo: vec3<f32>) -> vec3<f32> {
    if answer_part != 0u {
        return vec3<f32>(0.0);
    }
    let line = line_of(wi.xy + wo.xy);
    let tau = grating.sigma / max(line.length, 1e-9);
    let x = wo.x - wi.x;
    let y = 0.5 * (wi.y - wo.y);
    var sum = weights(0.0, tau);
    if any(sum != vec3<f32>(0.0)) {
        sum *= order_zero(0.5 * x, y);
    }
    for (var m = line.first; m <= line.last; m += 1.0) {
        let order = m * line.sign;
        let frequency = order * grating.spacing;
        let nu = frequency * line.direction.x / max(line.length, 1e-9);
        let distance = frequency * line.direction.y / grating.sigma;
        let kernel = exp2(-0.5 * LOG2_E * distance * distance);
        // The sum begins with order 0. The kernel of most orders is zero.
        if order != 0.0 && kernel > 0.0 {
            sum += order_colour(order, nu, kernel, tau, x, y);
        }
    }
    return sum / (TAU * grating.sigma * grating.sigma);
}
