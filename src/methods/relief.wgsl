// `answer_rgb` of every method whose colour is a function of q = wi + wo alone, such as flss.wgsl.
//
// The phase screen depends on the unit vectors wi (to the light) and wo (to the viewer) only through their sum
// (docs/model.md#the-phase-screen). `relief_rgb(q)` is in the method's own file, which precedes this one in the
// compiled source. The result is linear sRGB of the relief's factor `∫ S/λ² weight(λ) dλ`; mod.rs defines it in Rust
// (`Relief`).

// The relief's factor of the reflectance for a pair of directions, linear sRGB in 1/sr.
fn answer_rgb(wi: vec3<f32>, wo: vec3<f32>) -> vec3<f32> {
    return relief_rgb(wi + wo);
}
