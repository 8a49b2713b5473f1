// The colour table's factor of the reflectance (`relief_rgb` in table.wgsl), divided by max(A(wi), A(wo)). The surface
// then reflects no more energy than it receives. A of a direction is 1 or more; `band_excess` in albedo.wgsl is A - 1.
// Compiled after both files. Counterpart of `ConservingTable` in table.rs, with the same arithmetic.

// The divided factor, linear sRGB in 1/sr. wi points to the light and wo to the viewer.
// Like `relief_rgb`, it is zero unless `answer_part` is 0 (common.wgsl).
fn answer_rgb(wi: vec3<f32>, wo: vec3<f32>) -> vec3<f32> {
    return relief_rgb(wi + wo) / (1.0 + max(band_excess(place(wi)), band_excess(place(wo))));
}
