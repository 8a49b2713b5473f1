// The answer of a method that sees the sum of both directions alone; compiled after its `relief_rgb`. Twin of mod.rs.

fn answer_rgb(wi: vec3<f32>, wo: vec3<f32>) -> vec3<f32> {
    return relief_rgb(wi + wo);
}
