// From answered queries to radiance: a white diffuse plane that faces the sun has radiance 1.

@group(0) @binding(1) var<uniform> optics: Optics;
@group(0) @binding(2) var<storage, read> queries: array<Query>;
@group(0) @binding(3) var<storage, read> reflectances: array<vec4<f32>>;
// The sum over the samples so far, rows from the top.
@group(0) @binding(4) var<storage, read_write> picture: array<vec4<f32>>;
@group(0) @binding(5) var<storage, read> pigment: Pigment;
// Indices of the answered queries, and how many there are.
@group(0) @binding(6) var<storage, read> chosen: array<u32>;
@group(0) @binding(7) var<storage, read> chosen_count: u32;

// The pigment's texture: its width and height, and sRGB in bytes, rows in the order of v.
struct Pigment {
    size: vec2<u32>,
    texels: array<u32>,
}

// Irradiance of a plane that faces the sun.
const RESOLVE_SUN: f32 = 3.141592653589793;

// sRGB to linear. Adapters decode such textures themselves, but some with no more than the eight bits of the result. The
// power 2.4 is the square times a polynomial in the root, off by 1e-6 at most, which is no more than `pow` may be and takes
// software adapters much less time.
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

fn resolve_texel(at: vec2<i32>) -> vec3<f32> {
    return resolve_decoded(unpack4x8unorm(pigment.texels[u32(at.y) * pigment.size.x + u32(at.x)]).rgb);
}

// Bilinear, repeating, in linear light, and in full precision, which samplers do not promise.
fn resolve_pigment(uv: vec2<f32>) -> vec3<f32> {
    let size = vec2<i32>(pigment.size);
    let place = fract(uv) * vec2<f32>(size) - 0.5;
    let t = place - floor(place);
    // −1 to the size, and each end is next to the other.
    let low = vec2<i32>(floor(place));
    let a = select(low, size - 1, low < vec2<i32>(0));
    let b = select(low + 1, vec2<i32>(0), low + 1 >= size);
    let lower = mix(resolve_texel(a), resolve_texel(vec2<i32>(b.x, a.y)), t.x);
    let upper = mix(resolve_texel(vec2<i32>(a.x, b.y)), resolve_texel(b), t.x);
    return frame.pigment_scale * mix(lower, upper, t.y);
}

fn resolve_skin(query: Query, reflectance: vec3<f32>) -> vec3<f32> {
    if frame.blend == FRAME_NONE {
        return reflectance;
    }
    let diffuse = resolve_pigment(query.uv) / RESOLVE_SUN;
    if frame.blend == FRAME_FIXED_MIX {
        return mix(diffuse, reflectance, frame.share);
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
