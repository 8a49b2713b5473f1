// Definition of `answer_rgb` for every method whose colour depends on q = wi + wo alone, such as flss.wgsl; counterpart
// of the trait `Relief` in mod.rs, which defines the relief's factor.
//
// The phase screen depends on the unit vectors wi (to the light) and wo (to the viewer) through their sum alone
// (docs/model.md#the-phase-screen). `relief_rgb(q)` is in the method's own file, which precedes this one in the
// compiled source.

// The relief's factor of the reflectance for a pair of directions, linear sRGB in 1/sr.
fn answer_rgb(wi: vec3<f32>, wo: vec3<f32>) -> vec3<f32> {
    return relief_rgb(wi + wo);
}
