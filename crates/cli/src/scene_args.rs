//! The arguments of the realtime renderer's scene: mesh, camera, light. One unit of the scene is 1 cm, z is up.

use super::arguments::out_of_range;
use std::path::PathBuf;
use std::str::FromStr;
use sunbeam_realtime::snake::{PIGMENT_SIZE, PigmentTexture, SnakeOptions, pigment_texture};
use sunbeam_realtime::{Blend, Camera, Light, Mesh, Shape, View};

/// Default factor on the number of the snake's mesh cells (pairs of triangles) along each direction. More cells make
/// the outline rounder and take more time.
const RESOLUTION: f64 = 4.0;

/// The mesh, the camera and the light.
#[derive(Clone, Debug, clap::Args)]
#[command(next_help_heading = "Scene")]
pub struct SceneArgs {
    /// Shape that carries the relief: snake, flat (a square on the ground), sphere
    #[arg(long, value_name = "NAME", default_value = "snake")]
    shape: Shape,
    /// Mesh in place of the shape: triangles with normals and texture coordinates (.ply)
    #[arg(long, value_name = "FILE", conflicts_with_all = ["resolution", "shape"])]
    mesh: Option<PathBuf>,
    /// Factor on the snake's cells along each direction; with --shape snake [default: 4]
    #[arg(long, value_name = "FACTOR", allow_negative_numbers = true)]
    resolution: Option<f64>,
    /// Draw the ground at z = 0
    #[arg(long, value_name = "BOOL", default_value_t = true, action = clap::ArgAction::Set)]
    ground: bool,
    /// Blend with the pigment below the relief: physical weights the pigment by the light that is not reflected, mix
    /// takes the fraction --share of the diffraction colour and the rest of the pigment, none omits the pigment
    #[arg(long, value_name = "MODE", default_value = "physical")]
    blend: Blend,
    /// Fraction of the diffraction colour with --blend mix, 0 to 1 [default: 0.5]
    #[arg(long, allow_negative_numbers = true)]
    share: Option<f32>,
    /// Angle in degrees from the mesh's tangent along u to the relief's x axis, about the normal
    #[arg(long, value_name = "DEGREES", default_value_t = 0.0, allow_negative_numbers = true)]
    rotation: f64,
    /// Position of the camera in cm [default: that of the Mitsuba scenes]
    #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true)]
    camera_origin: Option<Point>,
    /// Point in the middle of the picture in cm [default: that of the Mitsuba scenes]
    #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true)]
    camera_target: Option<Point>,
    /// Horizontal field of view in degrees
    #[arg(long, value_name = "DEGREES", default_value_t = 30.0, allow_negative_numbers = true)]
    fov: f64,
    /// Azimuth of the sun in degrees, counter-clockwise from +x seen from above
    #[arg(long, value_name = "DEGREES", default_value_t = -150.0, allow_negative_numbers = true)]
    light_azimuth: f64,
    /// Elevation of the sun above the ground in degrees
    #[arg(long, value_name = "DEGREES", default_value_t = 40.0, allow_negative_numbers = true)]
    light_elevation: f64,
    /// Direction to the sun, in place of the two angles
    #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true)]
    #[arg(conflicts_with_all = ["light_azimuth", "light_elevation"])]
    light_from: Option<Point>,
}

/// Width and height of the picture in pixels.
#[derive(Clone, Copy, Debug)]
pub struct Size(pub u32, pub u32);

impl FromStr for Size {
    type Err = &'static str;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let sides = text.split_once('x').and_then(|(w, h)| Some((w.parse().ok()?, h.parse().ok()?)));
        sides.map(|(width, height)| Self(width, height)).ok_or("it must be two whole numbers, such as 384x256")
    }
}

/// A point or a direction: three finite coordinates.
#[derive(Clone, Copy, Debug)]
struct Point([f64; 3]);

impl FromStr for Point {
    type Err = &'static str;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let numbers: Option<Vec<f64>> =
            text.split(',').map(|part| part.trim().parse().ok().filter(|number: &f64| number.is_finite())).collect();
        let point = numbers.and_then(|numbers| numbers.try_into().ok());
        point.map(Self).ok_or("it must be three numbers, such as 1,0,2.5")
    }
}

impl SceneArgs {
    /// The view, with `supersample`² rays per pixel. Drawing checks the remaining ranges ([`View::check`]).
    ///
    /// # Errors
    /// `--share` without `--blend mix`, the sun's angles out of range, or a direction to the sun of zero length.
    pub fn view(&self, supersample: u32) -> Result<View, Box<dyn std::error::Error>> {
        let camera = Camera::default();
        let blend = match (self.blend, self.share) {
            (Blend::FixedMix { .. }, Some(share)) => Blend::FixedMix { share },
            (_, Some(_)) => return Err("parameter \"share\" needs --blend mix".into()),
            // `--blend mix` without `--share` has the default share.
            (blend, None) => blend,
        };
        Ok(View {
            camera: Camera {
                origin: self.camera_origin.map_or(camera.origin, |point| point.0),
                target: self.camera_target.map_or(camera.target, |point| point.0),
                fov_deg: self.fov,
            },
            light: match self.light_from {
                Some(point) => Light::from_direction(point.0)?,
                None => Light::from_angles(self.light_azimuth, self.light_elevation)?,
            },
            blend,
            ground: self.ground,
            rotation_deg: self.rotation,
            supersample,
        })
    }

    /// The mesh, and the pigment over its texture coordinates. A mesh from a file has the pigment of the snake.
    ///
    /// # Errors
    /// A resolution that is not finite and positive or belongs to another shape, or a mesh that cannot be read.
    pub fn mesh(&self) -> Result<(Mesh, PigmentTexture), Box<dyn std::error::Error>> {
        let resolution = self.resolution.unwrap_or(RESOLUTION);
        if !(resolution.is_finite() && resolution > 0.0) {
            return Err(out_of_range("resolution", resolution, "finite and positive").into());
        }
        if self.resolution.is_some() && self.shape != Shape::Snake {
            return Err("parameter \"resolution\" needs --shape snake: the other shapes have a fixed mesh".into());
        }
        let Some(path) = &self.mesh else { return Ok(self.shape.make(resolution, PIGMENT_SIZE)?) };
        let pigment = pigment_texture(&SnakeOptions::default(), PIGMENT_SIZE.0, PIGMENT_SIZE.1)?;
        Ok((Mesh::read_ply(path)?, pigment))
    }
}
