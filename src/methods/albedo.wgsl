// Colour table divided by the albedo, so that the surface reflects no more energy than it receives; compiled after
// table.wgsl. Counterpart of `ColourAlbedoView` in src/energy/colour.rs, with the same arithmetic.
//
// Let A(w) be the larger of 1 and the albedo for a direction w at the angle θ from the normal, for each of red, green
// and blue. The reflectance is divided by max(A(wi), A(wo)). The albedo table holds (A - 1)·cos²θ on a uniform square
// grid over the stretched direction
//     (x, y) = w.xy/√((1 + √cosθ)(1 + cosθ)), each in [-1, 1],
// which maps the hemisphere to the unit disc with dense nodes near the horizon.
//
// `albedos` has eight words of 32 bits for each cell of the grid, [row along y][column along x]. The first six are two
// words for each of red, green and blue: the values at the two corners of the lower y, then those of the upper y. A
// word holds two values, the upper 16 bits of single-precision numbers, that of the lower x in its lower half.

@group(1) @binding(2) var<storage, read> albedos: array<u32>;

// The two values of a word, that in the lower half first.
fn albedo_pair(word: u32) -> vec2<f32> {
    return vec2<f32>(bitcast<f32>(word << 16u), bitcast<f32>(word & 0xffff0000u));
}

// A - 1 of red, green and blue for the direction w, bilinear between the grid's nodes.
fn albedo_excess(w: vec3<f32>) -> vec3<f32> {
    let cosine = clamp(w.z, COSINE_MIN, 1.0);
    let scale = 1.0 / sqrt((1.0 + sqrt(cosine)) * (1.0 + cosine));
    let cells = f32(table.albedo_cells);
    let position = clamp((w.xy * scale + 1.0) * (0.5 * cells), vec2<f32>(0.0), vec2<f32>(cells));
    let cell = min(floor(position), vec2<f32>(cells - 1.0));
    let fraction = position - cell;
    let first = 8u * (u32(cell.y) * table.albedo_cells + u32(cell.x));
    var excess = vec3<f32>(0.0);
    for (var channel = 0u; channel < 3u; channel++) {
        let lower_y = albedo_pair(albedos[first + 2u * channel]);
        let upper_y = albedo_pair(albedos[first + 2u * channel + 1u]);
        excess[channel] = mix(mix(lower_y.x, lower_y.y, fraction.x), mix(upper_y.x, upper_y.y, fraction.x), fraction.y);
    }
    return excess / (cosine * cosine);
}

// The relief's factor of the reflectance divided by the larger albedo of the two directions, linear sRGB in 1/sr. Parts
// other than 0 are zero, like those of `relief_rgb`.
fn answer_rgb(wi: vec3<f32>, wo: vec3<f32>) -> vec3<f32> {
    return relief_rgb(wi + wo) / (1.0 + max(albedo_excess(wi), albedo_excess(wo)));
}
