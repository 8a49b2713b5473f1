// Camera, light and blending of a picture. A test in layout.rs compares the members with those of its counterpart
// `FrameUniform`, whose additional `padding` is implicit in WGSL. view.rs computes the values. Lengths are in cm, the
// unit of the mesh. Vectors are in the scene's frame, where z points up.

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
    // Vector from the middle of the image plane to its right edge. The plane lies at the distance 1 from the camera, so
    // the length is the tangent of half the horizontal field of view.
    right: vec3<f32>,
    // Weight of the diffraction colour with FRAME_FIXED_MIX, 0 to 1; the pigment has the weight 1 - share. Not used
    // otherwise.
    share: f32,
    // Vector from the middle of the image plane to its lower edge. Its length is that of `right` times the picture's
    // height over its width: pixels are square.
    down: vec3<f32>,
    // Factor on the reflectance of the pigment texture.
    pigment_scale: f32,
    // Unit vector to the sun.
    to_sun: vec3<f32>,
    // FRAME_PHYSICAL, FRAME_FIXED_MIX or FRAME_NONE.
    blend: u32,
    // Position of this sample's ray within its pixel, 0 to 1 from the left and the top; the centre is (0.5, 0.5).
    subpixel: vec2<f32>,
    // Cosine and sine of the angle from the mesh's tangent along its texture coordinate u to the relief's x axis,
    // counter-clockwise about the normal.
    rotation: vec2<f32>,
    // Diffuse reflectance of the ground, linear sRGB, 0 to 1.
    soil: vec3<f32>,
    // Weight of this sample in the sum over the pixel's samples: 1 over the number of samples.
    weight: f32,
    // 1 for the first sample of a pixel, which replaces the previous picture; 0 for later samples, which are added.
    is_first: u32,
    // 1 if the scene has a ground in the plane z = 0, else 0.
    has_ground: u32,
    // Refractive index of the mesh if it is a transparent film; 0 for an opaque mesh.
    film_eta: f32,
}

@group(0) @binding(0) var<uniform> frame: Frame;

// Values of `Frame.blend`, which `View::uniform` in view.rs writes as numbers; resolve.wgsl has their formulas. The
// pigment is the diffuse colour below the relief.
//
// Diffraction, and the pigment in the light that the surface does not reflect.
const FRAME_PHYSICAL: u32 = 0u;
// Mean of diffraction and pigment, weighted by `share`.
const FRAME_FIXED_MIX: u32 = 1u;
// Diffraction without pigment.
const FRAME_NONE: u32 = 2u;

// Distance of the near plane in cm. A larger distance would cut off parts of the mesh in front of a near camera, whose
// distance from its target may be 0.2 cm (orbit.rs). A smaller one gains nothing.
const FRAME_NEAR_CM: f32 = 0.01;
