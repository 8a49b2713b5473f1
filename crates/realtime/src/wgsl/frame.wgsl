// Camera, light and blending of a picture; twin of `FrameUniform` in layout.rs. Lengths are in the unit of the mesh,
// cm.

struct Frame {
    // Position of the camera.
    origin: vec3<f32>,
    // Pixels of a row.
    width: u32,
    // Unit vector of the viewing direction.
    forward: vec3<f32>,
    // Rows.
    height: u32,
    // Vector from the middle of the picture to its right edge, at distance 1.
    right: vec3<f32>,
    // Fraction of the diffraction colour in FRAME_FIXED_MIX.
    mix: f32,
    // Vector from the middle of the picture to its lower edge, at distance 1.
    down: vec3<f32>,
    // Factor on the pigment's reflectance.
    pigment_scale: f32,
    // Unit vector to the sun.
    to_sun: vec3<f32>,
    // FRAME_PHYSICAL, FRAME_FIXED_MIX or FRAME_NONE.
    blend: u32,
    // Position of the ray in its pixel; the centre is (0.5, 0.5).
    subpixel: vec2<f32>,
    // Cosine and sine of the grating's rotation.
    rotation: vec2<f32>,
    // Linear reflectance of the ground.
    soil: vec3<f32>,
    // Weight of this sample in the pixel.
    weight: f32,
    // 1 for the first sample, which replaces the previous picture.
    first: u32,
    // 1 where there is a ground.
    ground: u32,
}

@group(0) @binding(0) var<uniform> frame: Frame;

// Ways in which the pigment is added; see `Blend` in view.rs.
const FRAME_PHYSICAL: u32 = 0u;
const FRAME_FIXED_MIX: u32 = 1u;
const FRAME_NONE: u32 = 2u;

// Distance of the near plane.
const FRAME_NEAR: f32 = 0.01;
