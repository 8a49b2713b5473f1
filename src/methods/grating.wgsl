// Twin of `GratingColourLobe::eval` in grating/colour_lobe.rs, and of what it reads there.

// The visible range of 1/λ in 1/µm, its middle and half its width.
const NU_MIDDLE: f32 = 1.9912986;
const NU_HALF: f32 = 0.78647923;
const TAU_SCALE: f32 = 0.25;
const REACH: f32 = 5.0;
const UNIT: f32 = 1.6666667e-5;
const LOG2_E: f32 = 1.442695;
// Nodes of the tables of weights and of order 0 along either axis.
const WEIGHTS_WIDTHS: u32 = 96u;
const WEIGHTS_PLACES: u32 = 256u;
const ORDER_ZERO_SIDE: u32 = 48u;

struct Grating {
    // The first wavelength in nm, steps for each nm, and how many wavelengths there are.
    first_nm: f32,
    steps_per_nm: f32,
    wavelengths: u32,
    // Cells of the shortest wavelength, nodes along either side of a cell.
    cells: u32,
    nodes: u32,
    // The highest order that ever propagates, and the packet from which on order 0 has its colours.
    orders: f32,
    order_zero: u32,
    period_um: f32,
    // Frequency of the first order in cycles/µm, and its standard deviation.
    spacing: f32,
    sigma: f32,
    _pad0: u32,
    _pad1: u32,
}

@group(1) @binding(0) var<uniform> grating: Grating;
@group(1) @binding(1) var<storage, read> efficiencies: array<u32>;
@group(1) @binding(2) var<storage, read> colours: array<vec4<f32>>;

// Twin of `CellPosition`. The library has t and a in double precision, here they are single: see the test of the twins.
struct Place {
    cell: u32,
    incident: u32,
    stretched: vec2<f32>,
    propagates: bool,
}

fn stretched(x: vec2<f32>) -> vec2<f32> {
    let low = sqrt(max(x, vec2<f32>(0.0)));
    let high = sqrt(max(1.0 - x, vec2<f32>(0.0)));
    return low / (low + high);
}

fn place_of(t: f32, a: f32) -> Place {
    let sums = vec2<f32>(t - a, t + a);
    let above = max(sums, vec2<f32>(0.0));
    let whole = floor(above);
    return Place(u32(whole.x + whole.y), u32(whole.y), stretched(above - whole), all(sums > vec2<f32>(0.0)));
}

// The whole part and the rest of a place among so many nodes.
struct Along {
    low: u32,
    rest: f32,
}

fn along(x: f32, count: u32) -> Along {
    let inside = clamp(x, 0.0, f32(count - 1u));
    let low = min(floor(inside), f32(count - 2u));
    return Along(u32(low), inside - low);
}

fn half(at: u32) -> f32 {
    return f32((efficiencies[at >> 1u] >> (16u * (at & 1u))) & 0xffffu);
}

// The efficiency, in units of UNIT, of one order of a wave at one of the wavelengths; `at` counts from the row's begin at the first
// node.
fn at_wavelength(wavelength: u32, cell: u32, at: u32, p: Along, q: Along) -> f32 {
    let places = (cell + 1u) * (cell + 2u);
    let first = efficiencies[wavelength * grating.cells + cell] + at;
    let a = first + (p.low * grating.nodes + q.low) * places;
    let c = a + grating.nodes * places;
    return mix(mix(half(a), half(a + places), q.rest), mix(half(c), half(c + places), q.rest), p.rest);
}

// Twin of `EfficiencyView::entry`: the order that leaves is number `order` among those of the cell.
fn efficiency(place: Place, nm: f32, order: u32) -> f32 {
    let cell = min(place.cell, grating.cells - 1u);
    let at = min(place.incident, cell) * (cell + 2u) + order;
    let wavelength = along((nm - grating.first_nm) * grating.steps_per_nm, grating.wavelengths);
    let p = along(place.stretched.x * f32(grating.nodes - 1u), grating.nodes);
    let q = along(place.stretched.y * f32(grating.nodes - 1u), grating.nodes);
    let shorter = at_wavelength(wavelength.low, cell, at, p, q);
    let longer = at_wavelength(wavelength.low + 1u, cell, at, p, q);
    return mix(shorter, longer, wavelength.rest) * UNIT;
}

fn packets(begin: u32, counts: vec2<u32>, places: vec2<f32>) -> vec3<f32> {
    let last = vec2<f32>(counts - 1u);
    let x = clamp(places, vec2<f32>(0.0), vec2<f32>(1.0)) * last;
    let low = min(floor(x), last - 1.0);
    let t = x - low;
    let first = begin + u32(low.x) * counts.y + u32(low.y);
    let near = mix(colours[first].xyz, colours[first + 1u].xyz, t.y);
    let far = mix(colours[first + counts.y].xyz, colours[first + counts.y + 1u].xyz, t.y);
    return mix(near, far, t.x);
}

// `∫ weight(1/ν) exp(−(ν − nu)²/2τ²) dν` of the three channels.
fn weights(nu: f32, tau: f32) -> vec3<f32> {
    let place = (nu - NU_MIDDLE) / (tau * REACH + NU_HALF);
    if abs(place) >= 1.0 {
        return vec3<f32>(0.0);
    }
    let widths = tau / (tau + TAU_SCALE);
    return packets(0u, vec2<u32>(WEIGHTS_WIDTHS, WEIGHTS_PLACES), vec2<f32>(widths, 0.5 * place + 0.5)) * widths;
}

// The colour of order 0 between directions whose half difference is (x, y).
fn order_zero(x: f32, y: f32) -> vec3<f32> {
    let across = max(1.0 - y * y, 0.0);
    let within = max(1.0 - x * x / max(across, 1e-12), 0.0);
    return packets(grating.order_zero, vec2<u32>(ORDER_ZERO_SIDE), sqrt(vec2<f32>(within, across)));
}

// Twin of `Line`.
struct Line {
    length: f32,
    towards: vec2<f32>,
    first: f32,
    last: f32,
    sign: f32,
}

fn line_of(q: vec2<f32>) -> Line {
    let length = length(q);
    let towards = select(q / max(length, 1e-9), vec2<f32>(1.0, 0.0), length < 1e-9);
    let per_order = max(abs(towards.x) * grating.spacing, 1e-9);
    let reach = REACH * grating.sigma;
    let low = (length * (NU_MIDDLE - NU_HALF) - reach) / per_order;
    let high = (length * (NU_MIDDLE + NU_HALF) + reach) / per_order;
    let most = grating.orders;
    let first = clamp(ceil(low), -most, most + 1.0);
    let last = clamp(floor(high), -most - 1.0, most);
    return Line(length, towards, first, last, select(1.0, -1.0, towards.x < 0.0));
}

// What an order adds at 1/λ = nu, of which the pair lies beside it by as much as `kernel` says.
fn of_order(order: f32, nu: f32, kernel: f32, tau: f32, x: f32, y: f32) -> vec3<f32> {
    let seen = clamp(nu, NU_MIDDLE - NU_HALF, NU_MIDDLE + NU_HALF);
    let periods = seen * grating.period_um;
    let across = periods * sqrt(max((1.0 - y) * (1.0 + y), 0.0));
    let place = place_of(across, 0.5 * (x * periods - order));
    let at = i32(place.incident) + i32(order);
    if !place.propagates || at < 0 || at > i32(place.cell) {
        return vec3<f32>(0.0);
    }
    return weights(nu, tau) * (efficiency(place, 1e3 / seen, u32(at)) * kernel);
}

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
        let nu = frequency * line.towards.x / max(line.length, 1e-9);
        let beside = frequency * line.towards.y / grating.sigma;
        let kernel = exp2(-0.5 * LOG2_E * beside * beside);
        // Order 0 has been counted, and most orders lie far beside the pair.
        if order != 0.0 && kernel > 0.0 {
            sum += of_order(order, nu, kernel, tau, x, y);
        }
    }
    return sum / (TAU * grating.sigma * grating.sigma);
}
