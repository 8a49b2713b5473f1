// What changes from picture to picture: camera, light, and how they are shown. Lengths are the mesh's.

struct Frame {
    // The camera's place, the pixels along a row.
    origin: vec3<f32>,
    width: u32,
    // The unit vector in which the camera looks, the rows.
    forward: vec3<f32>,
    height: u32,
    // From the middle of the picture to its right edge, at distance 1; the share of the diffraction colour.
    across: vec3<f32>,
    share: f32,
    // From the middle to the lower edge; what the pigment is multiplied by.
    down: vec3<f32>,
    pigment_scale: f32,
    // The unit vector to the sun; one of FRAME_PHYSICAL, FRAME_FIXED_MIX, FRAME_NONE.
    to_sun: vec3<f32>,
    blend: u32,
    // Where in a pixel its ray goes, (0.5, 0.5) being the centre; cosine and sine of the grating's rotation.
    place: vec2<f32>,
    rotation: vec2<f32>,
    // Linear reflectance of the ground; the share of this sample of the pixel.
    soil: vec3<f32>,
    weight: f32,
    // 1 for the first sample, which replaces the previous picture.
    first: u32,
    // 1: there is a ground.
    ground: u32,
}

@group(0) @binding(0) var<uniform> frame: Frame;

const FRAME_PHYSICAL: u32 = 0u;
const FRAME_FIXED_MIX: u32 = 1u;
const FRAME_NONE: u32 = 2u;

// Nothing closer to the camera is seen.
const FRAME_NEAR: f32 = 0.01;
