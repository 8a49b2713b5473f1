//! The page's settings, their accepted ranges, and their conversion to objects of the library and the renderer.
//!
//! `json.rs` reads and writes them as a JSON object. `keys.rs` tells which data of the page they change.
//!
//! Lengths in the scene are in cm, and z is up ([`Camera`]). Azimuths are counter-clockwise from +x, seen from above.
//! `docs/realtime.md` describes the methods, `docs/plugin.md` the fields of the surface.
//!
//! A *cover* is a flat clear layer over the relief. A *body* is a transparent medium below it, here always a film.

mod json;
mod keys;
#[cfg(test)]
mod tests;

pub use keys::Keys;

use crate::error::WebError;
use serde::{Deserialize, Serialize};
use std::ops::RangeInclusive;
use std::path::{Component, Path};
use sunbeam::config::{SurfaceConfig, Theory};
use sunbeam::height_field::Preset;
use sunbeam::methods::{MethodKind, MethodOptions};
use sunbeam::scattering::{ComplexIndex, Options, SpectralIndex};
use sunbeam::table::{Model, Tiling};
use sunbeam_realtime::snake::{PIGMENT_SIZE, PigmentTexture};
use sunbeam_realtime::{Blend, Camera, KERATIN, Light, Mesh, Optics, Orbit, Shape, View};

/// Accepted exposures in stops: factors on the radiance of about a millionth to a million.
const EXPOSURE_STOPS: RangeInclusive<f64> = -20.0..=20.0;
/// Accepted values of [`Settings::resolution`]. Larger values take more time and memory, which grow with the square;
/// smaller ones make the outline of the snake angular.
const RESOLUTION: RangeInclusive<f64> = 0.5..=8.0;
/// Accepted elevations of the sun in degrees.
pub(crate) const SUN_ELEVATION_DEG: RangeInclusive<f64> = Light::ELEVATION_MIN_DEG..=90.0;
/// Accepted polar angles of the map's light in degrees. At 90° the light would not reach the surface.
const MAP_THETA_DEG: RangeInclusive<f64> = 0.0..=89.9;
/// Divisor of the width and height of the pigment texture in a draft, the coarse scene that is shown first. A larger
/// one shows the draft sooner; a smaller one makes it less blurred.
const DRAFT_PIGMENT_DIVISOR: usize = 4;
/// [`Settings::resolution`] of a draft, below all accepted values. A smaller one shows the draft sooner; a larger one
/// makes its outline smoother.
const DRAFT_RESOLUTION: f64 = 0.35;

/// All settings of a picture and of the BRDF map. Fields missing in the JSON take their defaults.
///
/// ```
/// use sunbeam_web::Settings;
///
/// let settings = Settings::from_json(r#"{"surface": {"preset": "cd"}, "sun": {"elevation_deg": 20}}"#)?;
/// assert_eq!(settings.sun.azimuth_deg, -150.0);
/// assert_eq!(settings.to_compact_json(), r#"{"sun":{"elevation_deg":20.0},"surface":{"preset":"cd"}}"#);
/// # Ok::<(), sunbeam_web::WebError>(())
/// ```
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Settings {
    /// The relief and its material.
    pub surface: SurfaceConfig,
    /// The realtime method that draws the picture.
    pub method: MethodKind,
    /// Options of the method.
    pub options: MethodOptions,
    /// The shape that carries the relief.
    pub shape: Shape,
    /// The camera.
    pub camera: CameraSettings,
    /// Direction of the sun.
    pub sun: SunSettings,
    /// Rotation of the relief's x axis from the mesh's tangent, counter-clockwise in degrees.
    pub rotation_deg: f64,
    /// Blending of the relief's colour with the pigment.
    pub pigment: Pigment,
    /// Fraction of the relief's colour with [`Pigment::Mix`], in [0, 1].
    pub share: f64,
    /// Whether the scene has a ground.
    pub ground: bool,
    /// Stops by which the picture is brightened for the screen, −20 to 20.
    pub exposure: f64,
    /// Factor on the number of cells (pairs of triangles) of the snake's mesh in each direction, 0.5 to 8. The other
    /// shapes ignore it.
    pub resolution: f64,
    /// Light of the BRDF map.
    pub map: MapSettings,
}

/// Position, target and field of view of the camera.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct CameraSettings {
    /// Azimuth of the camera as seen from the target, in degrees.
    pub azimuth_deg: f64,
    /// Elevation of the camera as seen from the target, in degrees ([`Orbit::ELEVATION_DEG`]).
    pub elevation_deg: f64,
    /// Distance from the target in cm ([`Orbit::DISTANCE_CM`]).
    pub distance_cm: f64,
    /// Target in cm: the point in the middle of the picture.
    pub target: [f64; 3],
    /// Horizontal field of view in degrees, above 0 and below 180.
    pub fov_deg: f64,
}

/// Direction of the sun.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct SunSettings {
    /// Azimuth in degrees, counter-clockwise from +x seen from above.
    pub azimuth_deg: f64,
    /// Elevation above the horizon in degrees, 0.5 to 90.
    pub elevation_deg: f64,
}

/// Blending of the relief's colour with the pigment below it ([`Blend`]).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Pigment {
    /// The pigment is added, lit by the light that passes the surface.
    #[default]
    Physical,
    /// Both are mixed at the fixed fraction [`Settings::share`].
    Mix,
    /// No pigment.
    None,
}

/// Direction to the light of the BRDF map, in the relief's frame.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct MapSettings {
    /// Angle to the normal in degrees, 0 to 89.9.
    pub theta_deg: f64,
    /// Azimuth in degrees from +x towards +y.
    pub phi_deg: f64,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            surface: SurfaceConfig { preset: Some(Preset::Xenopeltis), ..SurfaceConfig::default() },
            method: MethodKind::Table,
            options: MethodOptions::default(),
            shape: Shape::default(),
            camera: CameraSettings::default(),
            sun: SunSettings::default(),
            rotation_deg: 0.0,
            pigment: Pigment::default(),
            share: 0.5,
            ground: true,
            exposure: 2.0,
            resolution: 2.0,
            map: MapSettings::default(),
        }
    }
}

impl Default for CameraSettings {
    fn default() -> Self {
        // Two decimals, for short links.
        let rounded = |value: f64| (value * 100.0).round() / 100.0;
        let orbit = Self::from(&Orbit::from(&Camera::default()));
        Self {
            azimuth_deg: rounded(orbit.azimuth_deg),
            elevation_deg: rounded(orbit.elevation_deg),
            distance_cm: rounded(orbit.distance_cm),
            ..orbit
        }
    }
}

impl From<&Orbit> for CameraSettings {
    fn from(orbit: &Orbit) -> Self {
        let Camera { target, fov_deg, .. } = orbit.camera();
        Self {
            azimuth_deg: orbit.azimuth_deg(),
            elevation_deg: orbit.elevation_deg(),
            distance_cm: orbit.distance_cm(),
            target,
            fov_deg,
        }
    }
}

impl CameraSettings {
    /// The camera as an orbit about its target, which drags turn.
    pub fn orbit(&self) -> Orbit {
        Orbit::new(self.target, self.azimuth_deg, self.elevation_deg, self.distance_cm, self.fov_deg)
    }
}

impl Default for SunSettings {
    fn default() -> Self {
        Self { azimuth_deg: -150.0, elevation_deg: 40.0 }
    }
}

impl Default for MapSettings {
    fn default() -> Self {
        Self { theta_deg: 30.0, phi_deg: 0.0 }
    }
}

impl Settings {
    /// Refuses settings out of range, the rigorous theory, and a file name with folders.
    fn check(&self) -> Result<(), WebError> {
        let refuse = |line: String| Err(WebError::Settings(line));
        self.surface.validate().map_err(|error| WebError::Settings(error.to_string()))?;
        self.options.validate().map_err(|error| WebError::Settings(error.to_string()))?;
        // The page builds tables of the scalar theory only.
        if self.surface.theory == Theory::Rigorous {
            return refuse("parameter \"theory\" is rigorous, but must be scalar here".to_owned());
        }
        self.method.accept(self.surface.body()).map_err(|error| WebError::Settings(error.to_string()))?;
        // The page passes the file's bytes; the path is only its name.
        if let Some(path) = &self.surface.filename
            && !is_plain_name(path)
        {
            return refuse(format!("parameter \"filename\" is {path:?}, but must be a name without folders"));
        }
        let ranges = [
            ("exposure", self.exposure, EXPOSURE_STOPS),
            ("resolution", self.resolution, RESOLUTION),
            ("sun elevation", self.sun.elevation_deg, SUN_ELEVATION_DEG),
            ("camera elevation", self.camera.elevation_deg, Orbit::ELEVATION_DEG),
            ("camera distance", self.camera.distance_cm, Orbit::DISTANCE_CM),
            ("map theta", self.map.theta_deg, MAP_THETA_DEG),
            ("share", self.share, 0.0..=1.0),
        ];
        if let Some((name, found, range)) = ranges.iter().find(|(_, found, range)| !range.contains(found)) {
            return refuse(format!("parameter {name:?} is {found}, but must be {} to {}", range.start(), range.end()));
        }
        let finite = [
            ("sun azimuth", self.sun.azimuth_deg),
            ("camera azimuth", self.camera.azimuth_deg),
            ("map phi", self.map.phi_deg),
            ("rotation", self.rotation_deg),
        ];
        let target = self.camera.target.map(|coordinate| ("camera target", coordinate));
        if let Some((name, found)) = finite.into_iter().chain(target).find(|(_, found)| !found.is_finite()) {
            return refuse(format!("parameter {name:?} is {found}, but must be finite"));
        }
        // Checks the remaining values, such as the field of view. The rays per pixel (1) are no setting.
        self.view(1).map(|_| ())
    }

    /// The configuration from which the method is built: [`Settings::surface`] with the restrictions of the method.
    ///
    /// The published methods have only the patch model (one coherence window at a fixed position) and a periodic
    /// tiling. Energy is conserved only if the settings say so, and never with the patch model, for which realtime
    /// methods have no albedo.
    pub fn config(&self) -> SurfaceConfig {
        let mut surface = self.surface.clone();
        if self.method.is_patch_only() {
            (surface.model, surface.tiling) = (Model::Patch, Some(Tiling::Periodic));
        }
        let conserves = surface.conserve_energy == Some(true) && surface.model == Model::Ensemble;
        surface.conserve_energy = Some(conserves);
        surface
    }

    /// The refractive index relative to that of the cover.
    pub fn index_inside(&self) -> ComplexIndex {
        self.index().relative_to(self.surface.cover_eta.unwrap_or(1.0))
    }

    /// The refractive index; that of keratin if none is given.
    pub fn index(&self) -> ComplexIndex {
        self.surface.index().unwrap_or(KERATIN)
    }

    /// Options of the library for [`Settings::config`] and [`Settings::index`], with all defaults filled in.
    pub fn library_options(&self) -> Options {
        self.config().options_for(Some(&SpectralIndex::Constant(self.index())))
    }

    /// The optics that the renderer's shader adds to the method's reflectance: index, cover, obliquity factor and
    /// shadowing.
    pub fn optics(&self) -> Optics {
        let options = self.library_options();
        Optics {
            index: Some(self.index()),
            cover: self.surface.cover(),
            obliquity: options.obliquity,
            shadowing: options.shadowing,
        }
    }

    /// Camera, light and blending for the renderer, with `supersample` rays along each side of a pixel.
    ///
    /// # Errors
    /// [`WebError::Settings`] for a camera or sun out of range.
    pub fn view(&self, supersample: u32) -> Result<View, WebError> {
        let light = Light::from_angles(self.sun.azimuth_deg, self.sun.elevation_deg);
        let view = View {
            camera: self.camera.orbit().camera(),
            light: light.map_err(|error| WebError::Settings(error.to_string()))?,
            blend: match self.pigment {
                Pigment::Physical => Blend::Physical,
                Pigment::Mix => Blend::FixedMix { share: self.share as f32 },
                Pigment::None => Blend::None,
            },
            ground: self.ground,
            rotation_deg: self.rotation_deg,
            supersample,
        };
        view.check().map_err(|error| WebError::Settings(error.to_string()))?;
        Ok(view)
    }

    /// Mesh and pigment of the shape.
    ///
    /// # Errors
    /// [`WebError::Settings`] for a mesh out of range.
    pub fn scene(&self) -> Result<(Mesh, PigmentTexture), WebError> {
        Ok(self.shape.make(self.resolution, PIGMENT_SIZE)?)
    }

    /// Mesh and pigment of the draft, a coarser scene that is built and drawn sooner.
    ///
    /// # Errors
    /// The errors of [`Settings::scene`].
    pub fn draft_scene(&self) -> Result<(Mesh, PigmentTexture), WebError> {
        let (width, height) = PIGMENT_SIZE;
        let pigment = (width / DRAFT_PIGMENT_DIVISOR, height / DRAFT_PIGMENT_DIVISOR);
        Ok(self.shape.make(DRAFT_RESOLUTION, pigment)?)
    }
}

/// Whether a path is a file name without folders.
fn is_plain_name(path: &Path) -> bool {
    let mut components = path.components();
    matches!((components.next(), components.next()), (Some(Component::Normal(_)), None))
}
