// Camera, light and blending of a picture; counterpart of `FrameUniform` in layout.rs, with the same memory layout.
// Lengths are in cm, the unit of the mesh. Vectors are in the scene's frame, where z points up.

// Data of one sample of a picture.
struct Frame {
    // Position of the camera.
    origin: vec3<f32>,
    // Number of pixels in a row.
    width: u32,
    // Unit vector along the viewing direction.
    forward: vec3<f32>,
    // Number of rows.
    height: u32,
    // Vector from the middle of the picture to its right edge, at distance 1.
    right: vec3<f32>,
    // Fraction of the diffraction colour with FRAME_FIXED_MIX; the rest is pigment.
    mix: f32,
    // Vector from the middle of the picture to its lower edge, at distance 1.
    down: vec3<f32>,
    // Factor on the reflectance of the pigment texture.
    pigment_scale: f32,
    // Unit vector to the sun.
    to_sun: vec3<f32>,
    // FRAME_PHYSICAL, FRAME_FIXED_MIX or FRAME_NONE.
    blend: u32,
    // Position of this sample's ray within its pixel, 0 to 1 from the left and the top; the centre is (0.5, 0.5).
    subpixel: vec2<f32>,
    // Cosine and sine of the angle from the tangent along u to the grating's x axis.
    rotation: vec2<f32>,
    // Diffuse reflectance of the ground, linear sRGB, 0 to 1.
    soil: vec3<f32>,
    // Weight of this sample in the sum over the pixel's samples: 1 over their number.
    weight: f32,
    // 1 for the first sample, which replaces the previous picture; 0 for the others, which are added.
    first: u32,
    // 1 if the scene has a ground, the plane z = 0; else 0.
    ground: u32,
    // Index of the film that the mesh is; 0 for a surface that only reflects.
    film_eta: f32,
}

@group(0) @binding(0) var<uniform> frame: Frame;

// Values of `blend` (`Blend` in view.rs; formulas in resolve.wgsl).
//
// The pigment receives the light that the interface does not reflect.
const FRAME_PHYSICAL: u32 = 0u;
// Weighted mean of pigment and diffraction by `mix`.
const FRAME_FIXED_MIX: u32 = 1u;
// Diffraction alone.
const FRAME_NONE: u32 = 2u;

// Distance of the near plane in cm, far below 0.2 cm, the smallest distance of an orbiting camera (orbit.rs).
const FRAME_NEAR: f32 = 0.01;
