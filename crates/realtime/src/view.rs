//! Camera, sun and blending of a picture, and the uniform struct that carries them to the shaders (frame.wgsl).
//!
//! The defaults are those of the Mitsuba scene of the snake (mitsuba_scenes), so that pictures can be compared. Lengths
//! are in cm, z points up, and azimuths are counter-clockwise from +x seen from above.

use super::GpuError;
use super::layout::FrameUniform;
use glam::DVec3;
use std::str::FromStr;
use sunbeam::scattering::ComplexIndex;

/// Linear reflectance of the ground, that of the Mitsuba scene.
pub const SOIL: [f32; 3] = [0.020, 0.0155, 0.012];
/// Refractive index of keratin, the material of scales.
pub const KERATIN: ComplexIndex = ComplexIndex { eta: 1.56, k: 0.0 };
/// Factor on the pigment's reflectance, that of the Mitsuba scene.
pub const PIGMENT_SCALE: f32 = 0.35;

/// A pinhole camera; z is up. The defaults are those of the Mitsuba scene.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    /// Position in cm.
    pub origin: [f64; 3],
    /// Point in the middle of the picture, in cm.
    pub target: [f64; 3],
    /// Horizontal field of view in degrees, in (0, 180).
    pub fov_deg: f64,
}

impl Default for Camera {
    fn default() -> Self {
        Self { origin: [-1.2, -7.0, 8.5], target: [-1.0, 0.55, 0.9], fov_deg: 30.0 }
    }
}

/// A sun at infinity with the spectrum D65. A white diffuse plane that faces it has the radiance 1 (irradiance π).
/// There is no sky: surfaces without sun are black.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Light {
    /// Unit vector to the sun.
    to_sun: [f64; 3],
}

impl Default for Light {
    /// The sun of the Mitsuba scene: azimuth −150°, elevation 40°.
    fn default() -> Self {
        Self { to_sun: toward(-150.0, 40.0) }
    }
}

impl Light {
    /// Lowest elevation of the sun that sliders of the interfaces offer, in degrees. Chosen above 0, at which the
    /// ground is dark.
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
        Ok(Self { to_sun: toward(azimuth_deg, elevation_deg) })
    }

    /// The sun in the direction of a vector of any length.
    ///
    /// # Errors
    /// [`GpuError::Parameter`] unless it is finite and not zero.
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
fn toward(azimuth_deg: f64, elevation_deg: f64) -> [f64; 3] {
    let ((sin_a, cos_a), (sin_e, cos_e)) = (azimuth_deg.to_radians().sin_cos(), elevation_deg.to_radians().sin_cos());
    [cos_a * cos_e, sin_a * cos_e, sin_e]
}

/// Blending of the relief's colour with the pigment below.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Blend {
    /// Diffuse pigment, weighted by the light that passes the surface on the way in and out: `(1 − R(θi))·(1 −
    /// R(θo))/π`, with the Fresnel reflectance R of the macroscopic surface.
    #[default]
    Physical,
    /// Single 2014's texture blending: a fixed mix of diffraction colour and pigment.
    FixedMix {
        /// Fraction of the diffraction colour, in [0, 1].
        share: f32,
    },
    /// No pigment.
    None,
}

impl FromStr for Blend {
    type Err = GpuError;

    /// Parses `physical`, `mix` (a mix of equal parts) or `none`.
    fn from_str(name: &str) -> Result<Self, GpuError> {
        match name {
            "physical" => Ok(Self::Physical),
            // `sources` is an older name.
            "mix" | "sources" => Ok(Self::FixedMix { share: 0.5 }),
            "none" => Ok(Self::None),
            _ => refuse("blend", &name, "\"physical\", \"mix\" or \"none\""),
        }
    }
}

/// Camera, light and blending of a picture. A change needs no rebuilding of tables, meshes or programs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct View {
    /// The camera.
    pub camera: Camera,
    /// The sun.
    pub light: Light,
    /// Blending with the pigment.
    pub blend: Blend,
    /// Whether there is a ground: a plane of [`SOIL`] at z = 0.
    pub ground: bool,
    /// Angle in degrees from the tangent of the mesh along u to the relief's x axis, about the normal.
    pub rotation_deg: f64,
    /// Rays along each side of a pixel, 1 to 64, through the centres of equal squares. The pixel is their mean.
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
    /// Rays of each pixel.
    pub(super) fn samples(&self) -> u32 {
        self.supersample * self.supersample
    }

    /// Refuses a camera without a picture, and numbers out of range.
    ///
    /// # Errors
    /// [`GpuError::Parameter`].
    pub fn check(&self) -> Result<(), GpuError> {
        self.uniform((1, 1), 0).map(|_| ())
    }

    /// The uniform struct of one sample of a picture.
    ///
    /// Its vectors are those of Mitsuba's `look_at` and `perspective`: rows from the top, the field of view along a
    /// row.
    pub(super) fn uniform(&self, (width, height): (u32, u32), sample: u32) -> Result<FrameUniform, GpuError> {
        let Camera { origin, target, fov_deg } = self.camera;
        if !(fov_deg > 0.0 && fov_deg < 180.0) {
            return refuse("fov", &fov_deg, "in (0, 180) degrees");
        }
        if !self.rotation_deg.is_finite() {
            return refuse("rotation", &self.rotation_deg, "finite");
        }
        if !(1..=64).contains(&self.supersample) {
            return refuse("supersample", &self.supersample, "1 to 64");
        }
        let share = if let Blend::FixedMix { share } = self.blend { share } else { 0.0 };
        if !(0.0..=1.0).contains(&share) {
            return refuse("share", &share, "in [0, 1]");
        }
        let forward = (DVec3::from(target) - DVec3::from(origin)).try_normalize();
        let right = forward.and_then(|forward| forward.cross(DVec3::Z).try_normalize());
        let (Some(forward), Some(right)) = (forward, right) else {
            let found = format!("{target:?} seen from {origin:?}");
            return refuse("camera-target", &found, "a place neither at the camera, nor straight above or below it");
        };
        let half_row = right * (0.5 * fov_deg).to_radians().tan();
        let down = forward.cross(right) * (half_row.length() * f64::from(height) / f64::from(width));
        let subpixel = |i: u32| (i as f32 + 0.5) / self.supersample as f32;
        let (sin, cos) = self.rotation_deg.to_radians().sin_cos();
        Ok(FrameUniform {
            origin: DVec3::from(origin).as_vec3().to_array(),
            width,
            forward: forward.as_vec3().to_array(),
            height,
            right: half_row.as_vec3().to_array(),
            mix: share,
            down: down.as_vec3().to_array(),
            pigment_scale: PIGMENT_SCALE,
            to_sun: DVec3::from(self.light.to_sun).as_vec3().to_array(),
            blend: match self.blend {
                Blend::Physical => 0,
                Blend::FixedMix { .. } => 1,
                Blend::None => 2,
            },
            subpixel: [subpixel(sample % self.supersample), subpixel(sample / self.supersample)],
            rotation: [cos as f32, sin as f32],
            soil: SOIL,
            weight: 1.0 / self.samples() as f32,
            first: u32::from(sample == 0),
            ground: u32::from(self.ground),
            padding: [0; 2],
        })
    }
}

/// The error for a parameter out of range.
fn refuse<T>(parameter: &'static str, found: &dyn std::fmt::Debug, accepted: &'static str) -> Result<T, GpuError> {
    Err(GpuError::Parameter { parameter, found: format!("{found:?}"), accepted })
}
