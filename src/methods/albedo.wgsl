// What conserves energy in colours; twin of `ColourAlbedoView` in energy/colour.rs, compiled after table.wgsl.

@group(1) @binding(2) var<storage, read> albedos: array<u32>;

const ALBEDO_COSINE_MIN: f32 = 1e-7;

// The two numbers of single precision whose upper halves a word holds.
fn albedo_pair(word: u32) -> vec2<f32> {
    return vec2<f32>(bitcast<f32>(word << 16u), bitcast<f32>(word & 0xffff0000u));
}

// `A - 1` of red, green and blue.
fn albedo_excess(w: vec3<f32>) -> vec3<f32> {
    let cosine = clamp(w.z, ALBEDO_COSINE_MIN, 1.0);
    let scale = 1.0 / sqrt((1.0 + sqrt(cosine)) * (1.0 + cosine));
    let cells = f32(table.albedo_cells);
    let place = clamp((w.xy * scale + 1.0) * (0.5 * cells), vec2<f32>(0.0), vec2<f32>(cells));
    let cell = min(floor(place), vec2<f32>(cells - 1.0));
    let towards = place - cell;
    // Two words for each band: the corners of the cell's nearer row and of its farther.
    let first = 8u * (u32(cell.y) * table.albedo_cells + u32(cell.x));
    var excess = vec3<f32>(0.0);
    for (var band = 0u; band < 3u; band++) {
        let near = albedo_pair(albedos[first + 2u * band]);
        let far = albedo_pair(albedos[first + 2u * band + 1u]);
        excess[band] = mix(mix(near.x, near.y, towards.x), mix(far.x, far.y, towards.x), towards.y);
    }
    return excess / (cosine * cosine);
}

fn answer_rgb(wi: vec3<f32>, wo: vec3<f32>) -> vec3<f32> {
    return relief_rgb(wi + wo) / (1.0 + max(albedo_excess(wi), albedo_excess(wo)));
}
