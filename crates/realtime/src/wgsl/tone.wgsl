// Render pass for the screen: maps linear radiance to encoded sRGB. `tone_map` and `srgb_encode` are counterparts of
// the functions in src/colour, with which a test in crates/window/src/tone.rs compares them.
//
// x is the largest channel of the exposed colour (`peak`), k the knee and s the shoulder. The tone curve is x up to k,
// and k + (1 - k)·(x - k)/(x - k + s) above, which approaches 1. All channels are scaled by the same factor.

// Uniform of the pass, which crates/realtime/src/tone.rs writes.
struct Tone {
    // Exposure, a positive factor on the radiance; 1 leaves it unchanged.
    gain: f32,
    // Number of pixels in a row.
    width: u32,
}

// Knee k, equal to `KNEE` in src/colour/tone.rs. A lower knee keeps more detail in highlights but darkens them.
const TONE_KNEE: f32 = 0.8;
// Shoulder s, equal to `SHOULDER` in src/colour/tone.rs. An excess x - k = s is mapped halfway between the knee and 1.
const TONE_SHOULDER: f32 = 0.6;

@group(0) @binding(0) var<uniform> tone: Tone;
// Linear sRGB radiance of each pixel, rows from the top; the fourth component is not read.
@group(0) @binding(1) var<storage, read> picture: array<vec4<f32>>;

// Clip position of the corner 0, 1 or 2 of a triangle that covers the picture: (-1, -1), (3, -1), (-1, 3).
@vertex
fn corner(@builtin(vertex_index) index: u32) -> @builtin(position) vec4<f32> {
    let position = vec2<f32>(select(-1.0, 3.0, index == 1u), select(-1.0, 3.0, index == 2u));
    return vec4<f32>(position, 0.0, 1.0);
}

// Exposed radiance, compressed above the knee without a change of hue. Negative channels become 0.
fn tone_map(linear: vec3<f32>) -> vec3<f32> {
    let exposed = max(tone.gain * linear, vec3<f32>(0.0));
    let peak = max(exposed.r, max(exposed.g, exposed.b));
    let excess = peak - TONE_KNEE;
    // The negated comparison is also true for NaN.
    if !(excess > 0.0) {
        return exposed;
    }
    let compressed = TONE_KNEE + (1.0 - TONE_KNEE) * excess / (excess + TONE_SHOULDER);
    return exposed * (compressed / peak);
}

// sRGB encoding (IEC 61966-2-1) of a linear colour, clamped to [0, 1].
fn srgb_encode(linear: vec3<f32>) -> vec3<f32> {
    let value = clamp(linear, vec3<f32>(0.0), vec3<f32>(1.0));
    return select(1.055 * pow(value, vec3<f32>(1.0 / 2.4)) - 0.055, 12.92 * value, value <= vec3<f32>(0.0031308));
}

// Colour of the pixel on the screen at `position`, in pixels from the upper left corner.
@fragment
fn shown(@builtin(position) position: vec4<f32>) -> @location(0) vec4<f32> {
    let pixel = vec2<u32>(position.xy);
    let linear = picture[pixel.y * tone.width + pixel.x].rgb;
    return vec4<f32>(srgb_encode(tone_map(linear)), 1.0);
}
