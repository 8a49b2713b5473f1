// The reflectance of an array of queries, linear sRGB in 1/sr. Compiled after a method, which defines `response`.

// Which part of `chosen` one submission works off.
struct Range {
    first: u32,
    count: u32,
}

@group(0) @binding(0) var<uniform> range: Range;
@group(0) @binding(1) var<uniform> optics: Optics;
@group(0) @binding(2) var<storage, read> queries: array<Query>;
// Indices of the queries to be answered.
@group(0) @binding(3) var<storage, read> chosen: array<u32>;
@group(0) @binding(4) var<storage, read_write> reflectances: array<vec4<f32>>;

@compute @workgroup_size(64)
fn shade(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x >= range.count {
        return;
    }
    let index = chosen[range.first + id.x];
    let pair = pair_of(queries[index].wi, queries[index].wo);
    var reflectance = vec3<f32>(0.0);
    if pair.valid {
        reflectance = optics_factor(optics, pair) * response(pair.q);
    }
    reflectances[index] = vec4<f32>(reflectance, 1.0);
}
