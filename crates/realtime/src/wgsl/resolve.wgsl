// Adds pigment and light to the answered queries. A white diffuse plane that faces the sun has the radiance 1.

@group(0) @binding(1) var<uniform> optics: Optics;
@group(0) @binding(2) var<storage, read> queries: array<Query>;
@group(0) @binding(3) var<storage, read> reflectances: array<vec4<f32>>;
// Radiance summed over the samples so far, rows from the top.
@group(0) @binding(4) var<storage, read_write> picture: array<vec4<f32>>;
@group(0) @binding(5) var<storage, read> pigment: Pigment;
// Indices of the answered queries.
@group(0) @binding(6) var<storage, read> chosen: array<u32>;
// Number of the answered queries.
@group(0) @binding(7) var<storage, read> chosen_count: u32;

// The pigment texture: width and height, then sRGB bytes (red lowest), rows in the order of v.
struct Pigment {
    size: vec2<u32>,
    texels: array<u32>,
}

// Irradiance of a plane that faces the sun, π.
const RESOLVE_SUN: f32 = 3.141592653589793;

// Decodes sRGB. Some adapters decode sRGB textures to eight bits only, so the texture is a buffer. x^2.4 is x² times a
// polynomial in √x with an error of at most 1e-6; `pow` may be as inexact and takes software adapters longer.
fn resolve_decoded(encoded: vec3<f32>) -> vec3<f32> {
    let x = (encoded + 0.055) * (1.0 / 1.055);
    let root = sqrt(x);
    var sum = vec3<f32>(0.14774336);
    sum = sum * root - 0.7795302;
    sum = sum * root + 1.789988;
    sum = sum * root - 2.3643625;
    sum = sum * root + 2.0260804;
    sum = sum * root - 1.279901;
    sum = sum * root + 1.432114;
    sum = sum * root + 0.027868535;
    return select(x * x * sum, encoded * (1.0 / 12.92), encoded <= vec3<f32>(0.04045));
}

// Linear reflectance of a texel.
fn resolve_texel(at: vec2<i32>) -> vec3<f32> {
    return resolve_decoded(unpack4x8unorm(pigment.texels[u32(at.y) * pigment.size.x + u32(at.x)]).rgb);
}

// Linear reflectance of the pigment, bilinear and repeating. Samplers do not promise full precision.
fn resolve_pigment(uv: vec2<f32>) -> vec3<f32> {
    let size = vec2<i32>(pigment.size);
    let position = fract(uv) * vec2<f32>(size) - 0.5;
    let t = position - floor(position);
    // From -1 to the size; opposite ends are neighbours.
    let low = vec2<i32>(floor(position));
    let a = select(low, size - 1, low < vec2<i32>(0));
    let b = select(low + 1, vec2<i32>(0), low + 1 >= size);
    let lower = mix(resolve_texel(a), resolve_texel(vec2<i32>(b.x, a.y)), t.x);
    let upper = mix(resolve_texel(vec2<i32>(a.x, b.y)), resolve_texel(b), t.x);
    return frame.pigment_scale * mix(lower, upper, t.y);
}

// Reflectance of the skin with its pigment, in 1/sr.
fn resolve_skin(query: Query, reflectance: vec3<f32>) -> vec3<f32> {
    if frame.blend == FRAME_NONE {
        return reflectance;
    }
    let diffuse = resolve_pigment(query.uv) / RESOLVE_SUN;
    if frame.blend == FRAME_FIXED_MIX {
        return mix(diffuse, reflectance, frame.mix);
    }
    return reflectance + diffuse * optics_remainder(optics, query.wi.z) * optics_remainder(optics, query.wo.z);
}

// Adds the radiance of the pixels whose queries were answered to the picture.
@compute @workgroup_size(64)
fn resolve(@builtin(global_invocation_id) id: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let number = id.y * groups.x * 64u + id.x;
    if number >= chosen_count {
        return;
    }
    let index = chosen[number];
    let query = queries[index];
    let radiance = RESOLVE_SUN * query.wi.z * resolve_skin(query, reflectances[index].rgb);
    picture[index] += vec4<f32>(frame.weight * radiance, 0.0);
}
