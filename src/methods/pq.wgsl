// Twin of pq.rs: a finite number of tiles.

// The πPd below which the kernel is its series.
const SINC_SERIES: f32 = 0.01;

struct Pq {
    grid: OrderGrid,
    repeats: vec2<f32>,
    wavelengths: u32,
    _pad: u32,
}

@group(1) @binding(0) var<uniform> pq: Pq;

// sin(πPd)/(P·sin(πd)) at a distance of d orders for P repeats.
fn repeat_kernel(repeats: f32, distance: f32) -> f32 {
    let x = 0.5 * TAU * distance;
    if repeats * abs(x) < SINC_SERIES {
        return 1.0 - (repeats * repeats - 1.0) * x * x / 6.0;
    }
    return sin(repeats * x) / (repeats * sin(x));
}

// S in µm².
fn pq_density(q: vec3<f32>, wavelength_um: f32) -> f32 {
    let position = order_position(pq.grid, q, wavelength_um);
    let nearest = nearest_order(position);
    if any(abs(nearest) > vec2<f32>(pq.grid.reach)) {
        return 0.0;
    }
    set_term_weights(pq.grid, q.z, wavelength_um);
    let c = order_amplitude(pq.grid, vec2<i32>(nearest));
    let distance = position - nearest;
    let kernel = repeat_kernel(pq.repeats.x, distance.x) * repeat_kernel(pq.repeats.y, distance.y);
    return pq.grid.peak_um2 * dot(c, c) * kernel * kernel;
}

fn relief_rgb(q: vec3<f32>) -> vec3<f32> {
    if !is_query(q) {
        return vec3<f32>();
    }
    var rgb = vec3<f32>();
    for (var i = answer_part; i < pq.wavelengths; i += answer_parts) {
        let colour = colours[i];
        rgb += pq_density(q, colour.w) / (colour.w * colour.w) * colour.xyz;
    }
    return rgb;
}
