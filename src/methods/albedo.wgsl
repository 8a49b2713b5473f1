// The colour table divided by the albedo, so that no energy is made; compiled after table.wgsl.
//
// Twin of `ColourAlbedoView` in energy/colour.rs. The albedo table holds `(A - 1)·cos²θ` of red, green and blue, where
// A is the albedo or 1 if that is larger, on a square grid over stretched directions. It holds each value as the upper
// 16 bits of a single-precision number, two values a word.

@group(1) @binding(2) var<storage, read> albedos: array<u32>;

// Smallest cosine: the table is divided by its square.
const ALBEDO_COSINE_MIN: f32 = 1e-7;

// The two numbers in a word, the lower half first.
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
    // Eight words a cell. A band has two: the corners of the cell's row y, and those of its row y + 1.
    let first = 8u * (u32(cell.y) * table.albedo_cells + u32(cell.x));
    var excess = vec3<f32>(0.0);
    for (var band = 0u; band < 3u; band++) {
        let near = albedo_pair(albedos[first + 2u * band]);
        let far = albedo_pair(albedos[first + 2u * band + 1u]);
        excess[band] = mix(mix(near.x, near.y, fraction.x), mix(far.x, far.y, fraction.x), fraction.y);
    }
    return excess / (cosine * cosine);
}

fn answer_rgb(wi: vec3<f32>, wo: vec3<f32>) -> vec3<f32> {
    return relief_rgb(wi + wo) / (1.0 + max(albedo_excess(wi), albedo_excess(wo)));
}
