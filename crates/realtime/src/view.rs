//! Camera, sun and blending of a picture, and the uniform struct that carries them to the shaders (frame.wgsl).
//!
//! The defaults are those of the Mitsuba scene of the snake in the folder mitsuba_scenes, so that pictures can be
//! compared. Lengths are in cm, z points up, and azimuths are counter-clockwise from +x seen from above. Positions and
//! angles are f64 on the CPU; the shaders get them as f32.

use super::GpuError;
use super::layout::FrameUniform;
use glam::DVec3;
use std::str::FromStr;
use sunbeam::scattering::ComplexIndex;

/// Diffuse reflectance of the ground, linear sRGB: a dark, slightly reddish soil, so that the snake stands out.
pub const SOIL: [f32; 3] = [0.020, 0.0155, 0.012];
/// Refractive index of keratin, the material of a snake's scales.
pub const KERATIN: ComplexIndex = ComplexIndex { eta: 1.56, k: 0.0 };
/// Factor on the reflectance of the pigment texture. Larger values hide the diffraction colours on the nearly black
/// snake; smaller ones hide its pattern.
pub const PIGMENT_SCALE: f32 = 0.35;
/// Accepted numbers of samples along each side of a pixel. The upper bound limits the time of a picture to that of 4096
/// samples of each pixel.
const SUPERSAMPLE: std::ops::RangeInclusive<u32> = 1..=64;

/// A pinhole camera.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    /// Position in cm.
    pub origin: [f64; 3],
    /// Point in the middle of the picture, in cm. It lies neither at `origin` nor straight above or below it.
    pub target: [f64; 3],
    /// Horizontal field of view in degrees, in (0, 180).
    pub fov_deg: f64,
}

impl Default for Camera {
    fn default() -> Self {
        Self { origin: [-1.2, -7.0, 8.5], target: [-1.0, 0.55, 0.9], fov_deg: 30.0 }
    }
}

/// The image plane of a camera, at the distance 1 from it.
struct ImagePlane {
    /// Unit vector from the camera to the middle of the plane.
    forward: DVec3,
    /// Vector from the middle of the plane to its right edge.
    right: DVec3,
    /// Vector from the middle of the plane to its lower edge.
    down: DVec3,
}

impl Camera {
    /// The image plane of a picture with this width and height in pixels, at least 1. Its vectors are those of
    /// Mitsuba's `look_at` and `perspective`: rows are stored from the top, and the field of view is the horizontal
    /// one.
    ///
    /// # Errors
    /// [`GpuError::Parameter`] for a viewing direction that is zero or vertical.
    fn image_plane(&self, (width, height): (u32, u32)) -> Result<ImagePlane, GpuError> {
        let Self { origin, target, fov_deg } = *self;
        let forward = (DVec3::from(target) - DVec3::from(origin)).try_normalize();
        let right = forward.and_then(|forward| forward.cross(DVec3::Z).try_normalize());
        let (Some(forward), Some(right)) = (forward, right) else {
            let found = format!("{target:?} seen from {origin:?}");
            return refuse("camera-target", &found, "a place neither at the camera, nor straight above or below it");
        };
        let right_edge = right * (0.5 * fov_deg).to_radians().tan();
        let lower_edge = forward.cross(right) * (right_edge.length() * f64::from(height) / f64::from(width));
        Ok(ImagePlane { forward, right: right_edge, down: lower_edge })
    }
}

/// A sun at infinity with the spectrum D65. Its irradiance is π, so a white diffuse plane that faces the sun has the
/// radiance 1. There is no sky: surfaces in shadow are black.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Light {
    /// Unit vector to the sun.
    to_sun: [f64; 3],
}

impl Default for Light {
    /// The sun at the azimuth −150° and the elevation 40°.
    fn default() -> Self {
        Self { to_sun: unit_vector(-150.0, 40.0) }
    }
}

impl Light {
    /// Lowest elevation of the sun in degrees that the controls of window and browser page offer. At 0 the ground would
    /// be dark.
    pub const ELEVATION_MIN_DEG: f64 = 0.5;

    /// The sun at an azimuth in degrees, counter-clockwise from +x seen from above, and an elevation in degrees.
    ///
    /// # Errors
    /// [`GpuError::Parameter`] unless the azimuth is finite and the elevation in (0, 90].
    pub fn from_angles(azimuth_deg: f64, elevation_deg: f64) -> Result<Self, GpuError> {
        if !azimuth_deg.is_finite() {
            return refuse("light-azimuth", &azimuth_deg, "finite");
        }
        if !(elevation_deg > 0.0 && elevation_deg <= 90.0) {
            return refuse("light-elevation", &elevation_deg, "in (0, 90] degrees");
        }
        Ok(Self { to_sun: unit_vector(azimuth_deg, elevation_deg) })
    }

    /// The sun in the direction of a vector of any length.
    ///
    /// # Errors
    /// [`GpuError::Parameter`] unless the vector is finite and not zero.
    pub fn from_direction(to_sun: [f64; 3]) -> Result<Self, GpuError> {
        match DVec3::from(to_sun).try_normalize() {
            Some(unit) => Ok(Self { to_sun: unit.to_array() }),
            None => refuse("light-from", &to_sun, "a finite vector other than zero"),
        }
    }

    /// Unit vector to the sun.
    pub fn to_sun(&self) -> [f64; 3] {
        self.to_sun
    }
}

/// Unit vector at an azimuth and an elevation in degrees.
fn unit_vector(azimuth_deg: f64, elevation_deg: f64) -> [f64; 3] {
    let ((sin_a, cos_a), (sin_e, cos_e)) = (azimuth_deg.to_radians().sin_cos(), elevation_deg.to_radians().sin_cos());
    [cos_a * cos_e, sin_a * cos_e, sin_e]
}

/// Blending of the diffraction colour with the pigment, the diffuse colour below the surface (formulas: resolve.wgsl).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Blend {
    /// Sum of the diffraction colour and the diffuse pigment. The pigment has the weight `(1 − R(θi))·(1 − R(θo))`, the
    /// fraction of light that passes the surface on the way in and out. R is the Fresnel reflectance of the macroscopic
    /// surface.
    #[default]
    Physical,
    /// Weighted mean of the diffraction colour and the pigment, as in M. Single's thesis (*An Interactive Shader for
    /// Natural Diffraction Gratings*, Bern 2014).
    FixedMix {
        /// Weight of the diffraction colour, in [0, 1].
        share: f32,
    },
    /// No pigment.
    None,
}

impl FromStr for Blend {
    type Err = GpuError;

    /// Parses `physical`, `mix` (with the share 0.5) or `none`.
    fn from_str(name: &str) -> Result<Self, GpuError> {
        match name {
            "physical" => Ok(Self::Physical),
            // `sources` is accepted for scripts that use this older name.
            "mix" | "sources" => Ok(Self::FixedMix { share: 0.5 }),
            "none" => Ok(Self::None),
            _ => refuse("blend", &name, "\"physical\", \"mix\" or \"none\""),
        }
    }
}

/// Camera, light and blending of a picture. A change requires no new tables, meshes or programs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct View {
    /// The camera.
    pub camera: Camera,
    /// The sun.
    pub light: Light,
    /// Blending with the pigment.
    pub blend: Blend,
    /// Whether there is a ground: a square in the plane z = 0 with sides of 4 m and the reflectance [`SOIL`].
    pub ground: bool,
    /// Angle in degrees from the mesh's tangent along its texture coordinate u to the relief's x axis,
    /// counter-clockwise seen from outside.
    pub rotation_deg: f64,
    /// Number of samples along each side of a pixel, 1 to 64. Their rays pass through the centres of equal cells of the
    /// pixel. The pixel is the mean of their radiances.
    pub supersample: u32,
}

impl Default for View {
    fn default() -> Self {
        Self {
            camera: Camera::default(),
            light: Light::default(),
            blend: Blend::default(),
            ground: true,
            rotation_deg: 0.0,
            supersample: 1,
        }
    }
}

impl View {
    /// Number of samples of each pixel.
    pub(super) fn samples(&self) -> u32 {
        self.supersample * self.supersample
    }

    /// Refuses a camera whose viewing direction is zero or vertical, and numbers out of range.
    ///
    /// # Errors
    /// [`GpuError::Parameter`].
    pub fn check(&self) -> Result<(), GpuError> {
        let fov_deg = self.camera.fov_deg;
        if !(fov_deg > 0.0 && fov_deg < 180.0) {
            return refuse("fov", &fov_deg, "in (0, 180) degrees");
        }
        if !self.rotation_deg.is_finite() {
            return refuse("rotation", &self.rotation_deg, "finite");
        }
        if !SUPERSAMPLE.contains(&self.supersample) {
            return refuse("supersample", &self.supersample, "1 to 64");
        }
        if let Blend::FixedMix { share } = self.blend
            && !(0.0..=1.0).contains(&share)
        {
            return refuse("share", &share, "in [0, 1]");
        }
        // The errors of `image_plane` do not depend on the size.
        self.camera.image_plane((1, 1)).map(|_| ())
    }

    /// The uniform struct of one sample of a picture with this width and height in pixels. `sample` counts the samples
    /// of a pixel from 0 to `samples() − 1`, by rows from the upper left one. `film_eta` is the refractive index of a
    /// mesh that is a transparent film, and 0 for an opaque mesh.
    ///
    /// # Errors
    /// The errors of [`View::check`].
    pub(super) fn uniform(&self, size: (u32, u32), sample: u32, film_eta: f32) -> Result<FrameUniform, GpuError> {
        self.check()?;
        let ImagePlane { forward, right, down } = self.camera.image_plane(size)?;
        // Centre of the cell `i` along one side of the pixel, in pixels.
        let subpixel = |i: u32| (i as f32 + 0.5) / self.supersample as f32;
        let (sin, cos) = self.rotation_deg.to_radians().sin_cos();
        // The numbers are FRAME_PHYSICAL, FRAME_FIXED_MIX and FRAME_NONE of frame.wgsl.
        let (blend, share) = match self.blend {
            Blend::Physical => (0, 0.0),
            Blend::FixedMix { share } => (1, share),
            Blend::None => (2, 0.0),
        };
        Ok(FrameUniform {
            origin: DVec3::from(self.camera.origin).as_vec3().to_array(),
            width: size.0,
            forward: forward.as_vec3().to_array(),
            height: size.1,
            right: right.as_vec3().to_array(),
            share,
            down: down.as_vec3().to_array(),
            pigment_scale: PIGMENT_SCALE,
            to_sun: DVec3::from(self.light.to_sun).as_vec3().to_array(),
            blend,
            subpixel: [subpixel(sample % self.supersample), subpixel(sample / self.supersample)],
            rotation: [cos as f32, sin as f32],
            soil: SOIL,
            weight: 1.0 / self.samples() as f32,
            is_first: u32::from(sample == 0),
            has_ground: u32::from(self.ground),
            film_eta,
            padding: 0,
        })
    }
}

/// The error for a parameter out of range. T is the type of the result that the caller would return otherwise.
fn refuse<T>(parameter: &'static str, found: &dyn std::fmt::Debug, accepted: &'static str) -> Result<T, GpuError> {
    Err(GpuError::Parameter { parameter, found: format!("{found:?}"), accepted })
}
