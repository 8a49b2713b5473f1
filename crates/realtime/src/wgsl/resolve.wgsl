// Fourth and last stage of a picture (lib.rs), after shade.wgsl: turns the reflectance of each answered query
// (query.wgsl) into radiance and adds it to the picture.
//
// Radiance L = E·cosθi·f, where E = π is the sun's irradiance: a white diffuse plane that faces the sun has L = 1.
// The reflectance f in 1/sr blends the diffraction f_r and the pigment ρ/π according to `frame.blend` (frame.wgsl):
//     physical   f = f_r + C·ρ/π·(1 - R(θi'))·(1 - R(θo')); the surface transmits 1 - R to the pigment
//     fixed mix  f = (1 - share)·ρ/π + share·f_r
//     none       f = f_r
// R is the Fresnel reflectance, C the factor of a cover, and θ' an angle inside the cover (optics.wgsl). Without a
// cover, C is 1 and θ' is θ. A film, a transparent mesh, has no pigment: f is its scattering function, for light on
// either side. Where light arrives through films, E is multiplied by `query.sun`.

@group(0) @binding(1) var<uniform> optics: Optics;
@group(0) @binding(2) var<storage, read> queries: array<Query>;
// f_r of each query, linear sRGB in 1/sr (shade.wgsl); the fourth component is not read.
@group(0) @binding(3) var<storage, read> reflectances: array<vec4<f32>>;
// Weighted sum of the radiance over the samples of each pixel so far (rgb), and the sum of their weights (a), to which
// locate.wgsl adds; rows from the top.
@group(0) @binding(4) var<storage, read_write> picture: array<vec4<f32>>;
@group(0) @binding(5) var<storage, read> pigment: Pigment;
// Indices of the answered queries, in `queries` and in the arrays of pixels.
@group(0) @binding(6) var<storage, read> chosen: array<u32>;
// Number of answered queries, the first member of `Lists` (locate.wgsl).
@group(0) @binding(7) var<storage, read> chosen_count: u32;

// The pigment texture.
struct Pigment {
    // Width (along u) and height (along v) in texels.
    size: vec2<u32>,
    // Encoded sRGB of each texel with red in the lowest byte, in rows of equal v from v = 0 on.
    texels: array<u32>,
}

// π.
const RESOLVE_PI: f32 = 3.141592653589793;
// Irradiance E of a plane that faces the sun, for each colour channel.
const RESOLVE_SUN_IRRADIANCE: f32 = RESOLVE_PI;

// Linear values of encoded sRGB values in [0, 1] (IEC 61966-2-1); counterpart of `srgb_decode` in src/colour/srgb.rs.
// Some adapters would decode an sRGB texture to eight bits only, so the texture is a buffer.
//
// With x = (encoded + 0.055)/1.055, the result is x^2.4 = x²·x^0.4. A fitted polynomial in √x replaces x^0.4 with a
// relative error below 1e-6. WGSL allows `pow` a similar error, and software adapters compute `pow` more slowly.
fn srgb_decode(encoded: vec3<f32>) -> vec3<f32> {
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

// Linear reflectance of the texel at a column (x) and row (y).
fn resolve_texel(texel: vec2<i32>) -> vec3<f32> {
    return srgb_decode(unpack4x8unorm(pigment.texels[u32(texel.y) * pigment.size.x + u32(texel.x)]).rgb);
}

// Linear reflectance ρ of the pigment at texture coordinates, with bilinear interpolation; the texture repeats. Texture
// samplers of the hardware interpolate with few bits, so the interpolation is computed here.
fn resolve_pigment(uv: vec2<f32>) -> vec3<f32> {
    let size = vec2<i32>(pigment.size);
    let position = fract(uv) * vec2<f32>(size) - 0.5;
    let t = position - floor(position);
    // Texels a and b have the columns and rows below and above the position. These wrap around: `low` is at least -1,
    // and `low + 1` is at most the size.
    let low = vec2<i32>(floor(position));
    let a = select(low, size - 1, low < vec2<i32>(0));
    let b = select(low + 1, vec2<i32>(0), low + 1 >= size);
    let lower = mix(resolve_texel(a), resolve_texel(vec2<i32>(b.x, a.y)), t.x);
    let upper = mix(resolve_texel(vec2<i32>(a.x, b.y)), resolve_texel(b), t.x);
    return frame.pigment_scale * mix(lower, upper, t.y);
}

// Reflectance f of the mesh's surface, the skin, with its pigment, in 1/sr; `reflectance` is f_r.
fn resolve_skin(query: Query, reflectance: vec3<f32>) -> vec3<f32> {
    if frame.blend == FRAME_NONE || optics.answer_kind == OPTICS_ANSWER_FILM {
        return reflectance;
    }
    let diffuse = resolve_pigment(query.uv) / RESOLVE_PI;
    if frame.blend == FRAME_FIXED_MIX {
        return mix(diffuse, reflectance, frame.share);
    }
    // (1 - R(θi'))·(1 - R(θo')).
    let passed = optics_remainder(optics, optics_inside(optics, query.wi).z) *
        optics_remainder(optics, optics_inside(optics, query.wo).z);
    return reflectance + diffuse * passed * optics_cover_factor(optics, query.wi, query.wo);
}

// Adds the radiance of the answered queries to the picture.
@compute @workgroup_size(64)
fn resolve(@builtin(global_invocation_id) id: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    // Linear index of the invocation. The workgroups, of 64 invocations along x, form a grid (`dispatch_over` in
    // pipeline.rs).
    let number = id.y * groups.x * 64u + id.x;
    if number >= chosen_count {
        return;
    }
    let index = chosen[number];
    let query = queries[index];
    // Light may arrive at the back of a film, where z is negative.
    let irradiance = RESOLVE_SUN_IRRADIANCE * query.sun * abs(query.wi.z);
    let radiance = irradiance * resolve_skin(query, reflectances[index].rgb);
    picture[index] += vec4<f32>(frame.weight * radiance, 0.0);
}
