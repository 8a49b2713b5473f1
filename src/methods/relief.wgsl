// The answer of a method that depends on wi + wo alone; compiled after its `relief_rgb`. Twin of `Relief` in mod.rs.

fn answer_rgb(wi: vec3<f32>, wo: vec3<f32>) -> vec3<f32> {
    return relief_rgb(wi + wo);
}
