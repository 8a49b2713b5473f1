// Colour table divided by the albedo, so that the surface reflects no more energy than it receives; compiled after
// table.wgsl. Counterpart of `ColourAlbedoView` in src/energy/colour.rs, with the same arithmetic.
//
// Let A(w) be the larger of 1 and the albedo for a direction w at the angle θ from the normal. The reflectance is
// divided by max(A(wi), A(wo)). The albedo table holds (A - 1)·cos²θ of red, green and blue on a uniform square grid
// over the stretched direction
//     (x, y) = w.xy/√((1 + √cosθ)(1 + cosθ)), each in [-1, 1],
// which maps the hemisphere to the unit disc with dense nodes near the horizon. Values are stored as the upper 16 bits
// of single-precision numbers, two in a u32.

@group(1) @binding(2) var<storage, read> albedos: array<u32>;

// Smallest cosθ to divide by, as COSINE_MIN in common.wgsl.
const ALBEDO_COSINE_MIN: f32 = 1e-7;

// The two numbers packed in a u32, the one in the lower half first.
fn albedo_pair(word: u32) -> vec2<f32> {
    return vec2<f32>(bitcast<f32>(word << 16u), bitcast<f32>(word & 0xffff0000u));
}

// A - 1 of red, green and blue for the direction w, linear between the grid's nodes.
fn albedo_excess(w: vec3<f32>) -> vec3<f32> {
    let cosine = clamp(w.z, ALBEDO_COSINE_MIN, 1.0);
    let scale = 1.0 / sqrt((1.0 + sqrt(cosine)) * (1.0 + cosine));
    let cells = f32(table.albedo_cells);
    let position = clamp((w.xy * scale + 1.0) * (0.5 * cells), vec2<f32>(0.0), vec2<f32>(cells));
    let cell = min(floor(position), vec2<f32>(cells - 1.0));
    let fraction = position - cell;
    // Eight u32 for each cell; the first six hold two for each of red, green and blue. The first of two holds the
    // corners at row y, the second those at row y + 1.
    let first = 8u * (u32(cell.y) * table.albedo_cells + u32(cell.x));
    var excess = vec3<f32>(0.0);
    for (var band = 0u; band < 3u; band++) {
        let near = albedo_pair(albedos[first + 2u * band]);
        let far = albedo_pair(albedos[first + 2u * band + 1u]);
        excess[band] = mix(mix(near.x, near.y, fraction.x), mix(far.x, far.y, fraction.x), fraction.y);
    }
    return excess / (cosine * cosine);
}

// The relief's factor, linear sRGB, divided by the larger albedo of the two directions.
fn answer_rgb(wi: vec3<f32>, wo: vec3<f32>) -> vec3<f32> {
    return relief_rgb(wi + wo) / (1.0 + max(albedo_excess(wi), albedo_excess(wo)));
}
