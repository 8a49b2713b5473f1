// Definition of `answer_rgb` for every method whose colour depends on q = wi + wo alone, such as flss.wgsl; counterpart
// of the trait `Relief` in mod.rs.
//
// wi and wo are the unit vectors to the light and to the viewer. The relief's factor is the part of the reflectance
// that depends on the heights: all of it but Fresnel factor, obliquity and shadowing. It depends on wi and wo through
// their sum alone (docs/model.md#the-phase-screen). `relief_rgb(q)` is in the method's own file.

// The relief's factor for a pair of directions, linear sRGB in 1/sr, without the cosine.
fn answer_rgb(wi: vec3<f32>, wo: vec3<f32>) -> vec3<f32> {
    return relief_rgb(wi + wo);
}
