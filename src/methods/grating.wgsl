// Reflectance of a reflecting grating in linear sRGB, from order efficiencies by Maxwell's equations. Counterpart of
// `GratingColourLobe::eval` in src/grating/colour_lobe.rs, of `CellPosition` in cell_position.rs, of `EfficiencyView`
// in efficiencies.rs and of `ColourTables` in colour_tables.rs, with the same arithmetic. Compiled after common.wgsl
// (TAU, which is 2π, and answer_part).
//
// Symbols:
//     d         period of the grating in µm; the grooves run along y
//     ν         1/λ in 1/µm
//     q, ρ      (wi + wo).xy, and its length
//     σ         standard deviation in cycles/µm of an order's Gaussian; order m has the frequency (m/d, 0)
//     ν_m       m·q.x/(d·ρ²): the ν at which the frequency ν·q of the pair of directions is nearest to order m
//     b_m       distance from ν_m·q to order m, in units of σ
//     τ         σ/ρ, the standard deviation over ν of the order's Gaussian along the line ν·q
//     e_m       efficiency of order m, the fraction of the light in it, at ν_m or at the nearest visible ν
//     W(ν_m, τ) ∫ weight(1/ν)·exp(-(ν - ν_m)²/2τ²) dν with the weights of linear sRGB, from a table
// The reflectance is
//     f_r = Σ_m e_m·exp(-b_m²/2)·W(ν_m, τ)/(2πσ²).
// The factor 1/λ² of f_r at a wavelength cancels against dλ = dν/ν².
// Order 0 has ν_m = 0 and no wavelength of its own; the colour of its efficiency is a table over directions.
//
// The visible range is that of the library's tables, 360 to 830 nm, wider than that of the published methods
// (common.wgsl).
//
// Efficiencies are tabulated over λ, t and a. With y the direction cosine along the grooves, t = νd·√(1 - y²). The wave
// number of the incident wave along x is a·2π/d. Order m propagates where |a + m| < t. So the lines where t - a or
// t + a is a whole number divide the (t, a) plane into cells. The same orders propagate throughout a cell. Cells that
// are shifted along a by a whole number have the same index. Order numbers count the propagating orders from 0, by
// ascending m. Nodes of a cell lie at fractional parts of t - a (`minus`) and t + a (`plus`).

// A test compares the constants below with those of Rust.

// Middle of the visible range of ν, from 1/830 nm to 1/360 nm, in 1/µm.
const NU_MIDDLE: f32 = 1.9912986;
// Half the width of the visible range of ν in 1/µm.
const NU_HALF: f32 = 0.78647923;
// Scale in 1/µm of the coordinate τ/(τ + TAU_SCALE) of the table of W; unrelated to TAU.
const TAU_SCALE: f32 = 0.25;
// Distance in standard deviations beyond which a Gaussian is neglected: 4e-6 of its peak.
const GAUSSIAN_REACH: f32 = 5.0;
// Efficiency that one unit of a stored 16-bit integer represents, 1/40000. The largest integer represents 1.64.
const UNIT: f32 = 2.5e-5;
// log₂(e), which turns exp into exp2.
const LOG2_E: f32 = 1.442695;
// Number of nodes of the table of W along τ.
const WEIGHT_NODES_TAU: u32 = 96u;
// Number of nodes of the table of W along ν_m.
const WEIGHT_NODES_NU: u32 = 256u;
// Number of nodes of the table of order 0 along each axis.
const ORDER_ZERO_NODES: u32 = 48u;
// Lower bound on divisors: lengths ρ of sums of directions, squared direction cosines, and frequencies in cycles/µm.
// Counterpart of DIVISOR_MIN in colour_tables.rs, which has its reason.
const GRATING_DIVISOR_MIN: f32 = 1e-9;

// Numbers of a grating and layout of its tables; counterpart of `GratingUniform` in grating.rs.
struct Grating {
    // First wavelength of the efficiencies in nm.
    first_nm: f32,
    // Number of wavelengths of the efficiencies per nm.
    steps_per_nm: f32,
    // Number of wavelengths of the efficiencies.
    wavelengths: u32,
    // Number of cells at the shortest wavelength. Longer wavelengths use the first of them.
    cells: u32,
    // Number of nodes along each side of a cell.
    nodes: u32,
    // Highest order that propagates at any incidence and wavelength; a float, since it is compared with floats.
    order_max: f32,
    // Index in `colours` of the first node of the table of order 0.
    order_zero_start: u32,
    // Period d in µm.
    period_um: f32,
    // Frequency of order 1, 1/d, in cycles/µm.
    spacing_per_um: f32,
    // Standard deviation σ of an order's Gaussian in cycles/µm.
    sigma_per_um: f32,
    _pad0: u32,
    _pad1: u32,
}

@group(1) @binding(0) var<uniform> grating: Grating;
// First, for each [wavelength][cell], the offset of the cell from the beginning, in 16-bit halves of words. Then the
// efficiencies in units of UNIT, 16 bits each, the lower half of a word first. Cell s is [node along minus][node along
// plus][incident order][entry], with s + 1 incident orders and s + 2 entries: the efficiencies of the outgoing orders,
// and their sum, which is not read here.
@group(1) @binding(1) var<storage, read> efficiencies: array<u32>;
// Colours (red, green, blue, unused): the table of W, then the table of order 0.
@group(1) @binding(2) var<storage, read> colours: array<vec4<f32>>;

// Position of an incident wave in the cells. The library has t and a in double precision, here they are single:
// crates/realtime/tests/realtime/gratings.rs bounds the difference.
struct CellPosition {
    // Index of the cell: the number of propagating orders minus one.
    cell: u32,
    // Order number of order 0, whose wave number along x is that of the incident wave.
    incident: u32,
    // `node_coordinates` of the fractional parts of t - a and t + a.
    coordinates: vec2<f32>,
    // Whether the incident wave propagates.
    propagates: bool,
}

// Coordinates in [0, 1] of the fractional parts x, in which nodes have equal steps: √x/(√x + √(1 - x)). Efficiencies
// have square-root singularities at the sides of a cell.
fn node_coordinates(x: vec2<f32>) -> vec2<f32> {
    let low = sqrt(max(x, vec2<f32>(0.0)));
    let high = sqrt(max(1.0 - x, vec2<f32>(0.0)));
    return low / (low + high);
}

// Position of the incident wave with these t and a.
fn cell_position(t: f32, a: f32) -> CellPosition {
    let sums = vec2<f32>(t - a, t + a);
    let propagates = all(sums > vec2<f32>(0.0));
    let positive = max(sums, vec2<f32>(0.0));
    let whole = floor(positive);
    // Orders m from -(t + a) to t - a propagate: whole.y of them below order 0, and whole.x above it.
    return CellPosition(u32(whole.x + whole.y), u32(whole.y), node_coordinates(positive - whole), propagates);
}

// Interval between two neighbouring nodes of an axis.
struct Interval {
    // Index of the lower node.
    low: u32,
    // Fraction of a step from the lower node.
    fraction: f32,
}

// The interval around the position x, in steps, among `count` nodes, at least 2.
fn interval_at(x: f32, count: u32) -> Interval {
    let inside = clamp(x, 0.0, f32(count - 1u));
    let low = min(floor(inside), f32(count - 2u));
    return Interval(u32(low), inside - low);
}

// The 16-bit integer at an offset in halves of words.
fn half_word(offset: u32) -> f32 {
    return f32((efficiencies[offset >> 1u] >> (16u * (offset & 1u))) & 0xffffu);
}

// Efficiency in units of UNIT at one wavelength of the table, bilinear between the nodes of a cell. `entry` is the
// index of the pair of incident and outgoing order within a node.
fn efficiency_at_wavelength(wavelength: u32, cell: u32, entry: u32, minus: Interval, plus: Interval) -> f32 {
    let node_length = (cell + 1u) * (cell + 2u);
    let first = efficiencies[wavelength * grating.cells + cell] + entry;
    let low = first + (minus.low * grating.nodes + plus.low) * node_length;
    let high = low + grating.nodes * node_length;
    return mix(
        mix(half_word(low), half_word(low + node_length), plus.fraction),
        mix(half_word(high), half_word(high + node_length), plus.fraction),
        minus.fraction,
    );
}

// Efficiency of the outgoing order with this order number at a wavelength in nm.
fn efficiency(position: CellPosition, nm: f32, outgoing: u32) -> f32 {
    // By rounding the cell may lie beyond the last. A wavelength has all cells that waves reach at the next shorter.
    let cell = min(position.cell, grating.cells - 1u);
    let entry = min(position.incident, cell) * (cell + 2u) + outgoing;
    let wavelength = interval_at((nm - grating.first_nm) * grating.steps_per_nm, grating.wavelengths);
    let minus = interval_at(position.coordinates.x * f32(grating.nodes - 1u), grating.nodes);
    let plus = interval_at(position.coordinates.y * f32(grating.nodes - 1u), grating.nodes);
    let shorter = efficiency_at_wavelength(wavelength.low, cell, entry, minus, plus);
    let longer = efficiency_at_wavelength(wavelength.low + 1u, cell, entry, minus, plus);
    return mix(shorter, longer, wavelength.fraction) * UNIT;
}

// Bilinear interpolation at coordinates in [0, 1]² in a table of colours that begins at the index `begin`. The table is
// [first axis][second axis] with `counts` nodes.
fn interpolated_colour(begin: u32, counts: vec2<u32>, coordinates: vec2<f32>) -> vec3<f32> {
    let last = vec2<f32>(counts - 1u);
    let x = clamp(coordinates, vec2<f32>(0.0), vec2<f32>(1.0)) * last;
    let low = min(floor(x), last - 1.0);
    let fraction = x - low;
    let first = begin + u32(low.x) * counts.y + u32(low.y);
    let next = first + counts.y;
    return mix(
        mix(colours[first].xyz, colours[first + 1u].xyz, fraction.y),
        mix(colours[next].xyz, colours[next + 1u].xyz, fraction.y),
        fraction.x,
    );
}

// W(ν_m, τ) of red, green and blue; 0 where the visible range is more than GAUSSIAN_REACH·τ away.
fn spectral_weights(nu_m: f32, tau: f32) -> vec3<f32> {
    // -1 and 1 where ν_m lies GAUSSIAN_REACH·τ below and above the visible range.
    let centre = (nu_m - NU_MIDDLE) / (tau * GAUSSIAN_REACH + NU_HALF);
    if abs(centre) >= 1.0 {
        return vec3<f32>(0.0);
    }
    // First coordinate of the table. The table has W divided by it, since W is proportional to τ for small τ.
    let width = tau / (tau + TAU_SCALE);
    let counts = vec2<u32>(WEIGHT_NODES_TAU, WEIGHT_NODES_NU);
    return interpolated_colour(0u, counts, vec2<f32>(width, 0.5 * centre + 0.5)) * width;
}

// Colour of order 0's efficiency between directions whose half difference (wo - wi)/2 is ±x across the grooves and ±y
// along them. The table's coordinates are those of a direction's projection onto the xz plane: the cosine of its angle
// from the normal, and its length √(1 - y²).
fn order_zero(x: f32, y: f32) -> vec3<f32> {
    let squared_length = max(1.0 - y * y, 0.0);
    let squared_cosine = max(1.0 - x * x / max(squared_length, GRATING_DIVISOR_MIN), 0.0);
    let coordinates = sqrt(vec2<f32>(squared_cosine, squared_length));
    return interpolated_colour(grating.order_zero_start, vec2<u32>(ORDER_ZERO_NODES), coordinates);
}

// The line νq, and the orders whose Gaussians reach its visible part.
struct Line {
    // ρ.
    length: f32,
    // q/ρ; (1, 0) for ρ = 0.
    direction: vec2<f32>,
    // Sign of q.x, 1 or -1. The orders are sign·n for n from `first` to `last`.
    sign: f32,
    // First n.
    first: f32,
    // Last n; below `first` if there are no orders.
    last: f32,
}

// The line of a pair of directions with the sum q.
fn line_of(q: vec2<f32>) -> Line {
    let length = length(q);
    let direction = select(q / max(length, GRATING_DIVISOR_MIN), vec2<f32>(1.0, 0.0), length < GRATING_DIVISOR_MIN);
    let sign = select(1.0, -1.0, direction.x < 0.0);
    // Order n·sign has the frequency n·per_order along q.
    let per_order = max(abs(direction.x) * grating.spacing_per_um, GRATING_DIVISOR_MIN);
    let reach = GAUSSIAN_REACH * grating.sigma_per_um;
    let low = (length * (NU_MIDDLE - NU_HALF) - reach) / per_order;
    let high = (length * (NU_MIDDLE + NU_HALF) + reach) / per_order;
    // Orders beyond ±order_max never propagate. Where the range has no other orders, first exceeds last.
    let first = clamp(ceil(low), -grating.order_max, grating.order_max + 1.0);
    let last = clamp(floor(high), -grating.order_max - 1.0, grating.order_max);
    return Line(length, direction, sign, first, last);
}

// Contribution of an order to 2πσ²·f_r; `gauss` is exp(-b_m²/2). The efficiency is that of directions which fulfil the
// grating equation: both are moved by half of the distance to the order (src/grating/lobe.rs). x_difference is
// wo.x - wi.x, and y = (wi.y - wo.y)/2 is wi.y after the move.
fn order_colour(order: f32, nu_m: f32, gauss: f32, tau: f32, x_difference: f32, y: f32) -> vec3<f32> {
    let visible_nu = clamp(nu_m, NU_MIDDLE - NU_HALF, NU_MIDDLE + NU_HALF);
    let periods = visible_nu * grating.period_um;
    let t = periods * sqrt(max((1.0 - y) * (1.0 + y), 0.0));
    // a = -wi.x·νd after the move, since the incident wave travels along -wi.
    let position = cell_position(t, 0.5 * (x_difference * periods - order));
    let outgoing = i32(position.incident) + i32(order);
    if !position.propagates || outgoing < 0 || outgoing > i32(position.cell) {
        return vec3<f32>(0.0);
    }
    return spectral_weights(nu_m, tau) * (efficiency(position, 1e3 / visible_nu, u32(outgoing)) * gauss);
}

// The whole reflectance f_r, linear sRGB in 1/sr. wi points to the light and wo to the viewer, both above the surface.
fn answer_rgb(wi: vec3<f32>, wo: vec3<f32>) -> vec3<f32> {
    // Part 0 is the whole answer (common.wgsl).
    if answer_part != 0u {
        return vec3<f32>(0.0);
    }
    let line = line_of(wi.xy + wo.xy);
    let tau = grating.sigma_per_um / max(line.length, GRATING_DIVISOR_MIN);
    let x_difference = wo.x - wi.x;
    let y = 0.5 * (wi.y - wo.y);
    // The sum begins with order 0, whose Gaussian reaches the visible range near the mirror direction only.
    var sum = spectral_weights(0.0, tau);
    if any(sum != vec3<f32>(0.0)) {
        sum *= order_zero(0.5 * x_difference, y);
    }
    for (var n = line.first; n <= line.last; n += 1.0) {
        let order = n * line.sign;
        let frequency = order * grating.spacing_per_um;
        let nu_m = frequency * line.direction.x / max(line.length, GRATING_DIVISOR_MIN);
        let b_m = frequency * line.direction.y / grating.sigma_per_um;
        let gauss = exp2(-0.5 * LOG2_E * b_m * b_m);
        // The Gaussian of most orders underflows to zero.
        if order != 0.0 && gauss > 0.0 {
            sum += order_colour(order, nu_m, gauss, tau, x_difference, y);
        }
    }
    return sum / (TAU * grating.sigma_per_um * grating.sigma_per_um);
}
