// Reflectance of the colour table divided by the albedo, so that the surface reflects no more energy than it receives;
// compiled after albedo_grid.wgsl. Counterpart of `ColourAlbedoView` in src/energy/colour.rs, with the same arithmetic.
//
// Let A(w) be the larger of 1 and the albedo for a direction w at the angle θ from the normal, for each of red, green
// and blue. The reflectance is divided by max(A(wi), A(wo)). The albedo table holds (A - 1)·cos²θ on the grid.
//
// `albedos` has eight words of 32 bits for each cell of the grid: two for each of red, green and blue, and two of
// padding. A channel's first word has the values at the cell's two corners of lower y, its second those of upper y. A
// value is the upper 16 bits of a single-precision number. The lower half of a word is the corner of lower x.

// A - 1 of red, green and blue for the direction w, whose tabulated value is bilinear between the grid's nodes.
fn albedo_excess(w: vec3<f32>) -> vec3<f32> {
    let at = place(w);
    let first = 8u * at.cell;
    var excess = vec3<f32>(0.0);
    for (var channel = 0u; channel < 3u; channel++) {
        excess[channel] = in_cell(albedos[first + 2u * channel], albedos[first + 2u * channel + 1u], at.fraction);
    }
    return excess * at.per_squared_cosine;
}

// The relief's factor of the reflectance divided by max(A(wi), A(wo)), linear sRGB in 1/sr. wi points to the light and
// wo to the viewer. Like `relief_rgb`, it is zero unless `answer_part` is 0 (common.wgsl).
fn answer_rgb(wi: vec3<f32>, wo: vec3<f32>) -> vec3<f32> {
    return relief_rgb(wi + wo) / (1.0 + max(albedo_excess(wi), albedo_excess(wo)));
}
