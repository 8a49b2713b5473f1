//! What the page's controls say, and what the library makes of it.

use crate::error::WebError;
use serde::{Deserialize, Serialize};
use std::path::{Component, Path};
use sunbeam::config::{ObliquityChoice, ReliefSource, SurfaceConfig, Theory};
use sunbeam::height_field::Preset;
use sunbeam::methods::{MethodKind, MethodOptions};
use sunbeam::scattering::{ComplexIndex, Options, SpectralIndex};
use sunbeam::table::{Model, Tiling};
use sunbeam_realtime::snake::{PIGMENT_SIZE, PigmentTexture};
use sunbeam_realtime::{Blend, Camera, KERATIN, Light, Mesh, Optics, Orbit, Shape, View};

/// Accepted stops of the exposure.
const EXPOSURE: std::ops::RangeInclusive<f64> = -20.0..=20.0;
/// Accepted multiples of the snake's cells.
const RESOLUTION: std::ops::RangeInclusive<f64> = 0.5..=8.0;
/// Accepted elevations of the sun in degrees: at 0 nothing is lit.
const SUN_ELEVATION: std::ops::RangeInclusive<f64> = 0.5..=90.0;
/// Accepted elevations of the camera in degrees: straight above, up has no direction.
const CAMERA_ELEVATION: std::ops::RangeInclusive<f64> = -89.0..=89.0;
/// Accepted distances of the camera in cm.
const DISTANCE_CM: std::ops::RangeInclusive<f64> = 0.2..=200.0;
/// Sides of a draft's pigment are divided by this.
const DRAFT_PIGMENT: usize = 4;
/// Resolution of the snake's mesh in a draft, below all accepted ones; see [`Shape::make`].
const DRAFT_RESOLUTION: f64 = 0.35;
/// Accepted polar angles of the map's light in degrees.
const MAP_THETA: std::ops::RangeInclusive<f64> = 0.0..=89.9;

/// Everything that a picture depends on; what is left out of the JSON takes its default.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Settings {
    /// The relief and how it answers to light.
    pub surface: SurfaceConfig,
    /// The method.
    pub method: MethodKind,
    /// Its options.
    pub options: MethodOptions,
    /// What carries the relief.
    pub shape: Shape,
    /// From where it is seen.
    pub camera: CameraSettings,
    /// The sun.
    pub sun: SunSettings,
    /// Turns the relief against the tangent, in degrees.
    pub rotation_deg: f64,
    /// How the pigment shows.
    pub pigment: Pigment,
    /// The share of the relief's colour with [`Pigment::Mix`], in [0, 1].
    pub share: f64,
    /// Whether there is a ground.
    pub ground: bool,
    /// Stops by which the picture is brightened for the screen.
    pub exposure: f64,
    /// Times the cells of the snake in each direction.
    pub resolution: f64,
    /// The light of the BRDF map.
    pub map: MapSettings,
}

/// Where the camera is.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct CameraSettings {
    /// Azimuth in degrees as seen from the target, counter-clockwise seen from above, from +x.
    pub azimuth_deg: f64,
    /// Elevation in degrees.
    pub elevation_deg: f64,
    /// Distance from the target in cm.
    pub distance_cm: f64,
    /// What is in the middle of the picture, in cm.
    pub target: [f64; 3],
    /// Horizontal field of view in degrees.
    pub fov_deg: f64,
}

/// Where the sun is.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct SunSettings {
    /// Azimuth in degrees, counter-clockwise seen from above, from +x.
    pub azimuth_deg: f64,
    /// Elevation in degrees.
    pub elevation_deg: f64,
}

/// How the pigment below the relief shows; see [`Blend`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Pigment {
    /// Diffuse, weighted by what the relief does not reflect.
    #[default]
    Physical,
    /// Mixed with the relief's colour at a fixed share.
    Mix,
    /// Not at all.
    None,
}

/// The light of the BRDF map, in the relief's frame.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct MapSettings {
    /// Angle with the normal in degrees.
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
    /// The same as something that is turned.
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
    /// Reads and checks a JSON object.
    ///
    /// # Errors
    /// [`WebError::Settings`] for what is unknown, of the wrong type or out of range.
    pub fn from_json(json: &str) -> Result<Self, WebError> {
        let mut value: serde_json::Value =
            serde_json::from_str(json).map_err(|error| WebError::Settings(format!("not valid JSON: {error}")))?;
        let surface = value.as_object_mut().and_then(|fields| fields.remove("surface"));
        let mut settings: Self =
            serde_json::from_value(value).map_err(|error| WebError::Settings(error.to_string()))?;
        if let Some(surface) = surface {
            // By the library's own reader, whose messages name the parameter.
            settings.surface = SurfaceConfig::from_json(&surface.to_string())
                .map_err(|error| WebError::Settings(error.to_string()))?;
        }
        settings.check()?;
        Ok(settings)
    }

    fn check(&self) -> Result<(), WebError> {
        let refuse = |line: String| Err(WebError::Settings(line));
        self.surface.validate().map_err(|error| WebError::Settings(error.to_string()))?;
        self.options.validate().map_err(|error| WebError::Settings(error.to_string()))?;
        if self.surface.theory == Theory::Rigorous {
            return refuse("parameter \"theory\" is rigorous, but must be scalar here".to_owned());
        }
        if let Some(path) = &self.surface.filename
            && !is_plain_name(path)
        {
            return refuse(format!("parameter \"filename\" is {path:?}, but must be a name without folders"));
        }
        let ranges = [
            ("exposure", self.exposure, EXPOSURE),
            ("resolution", self.resolution, RESOLUTION),
            ("sun elevation", self.sun.elevation_deg, SUN_ELEVATION),
            ("camera elevation", self.camera.elevation_deg, CAMERA_ELEVATION),
            ("camera distance", self.camera.distance_cm, DISTANCE_CM),
            ("map theta", self.map.theta_deg, MAP_THETA),
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
        self.view(1).map(|_| ())
    }

    /// What the method is built of: the published methods know one window in a fixed place over a tile that repeats, and they and a
    /// single window have no albedo.
    pub fn config(&self) -> SurfaceConfig {
        let mut surface = self.surface.clone();
        if self.method.is_patch_only() {
            (surface.model, surface.tiling) = (Model::Patch, Some(Tiling::Periodic));
        }
        let conserves = surface.conserve_energy == Some(true) && surface.model == Model::Ensemble;
        surface.conserve_energy = Some(conserves);
        surface
    }

    /// The refractive index, keratin's where none is given.
    pub fn index(&self) -> ComplexIndex {
        self.surface.index().unwrap_or(KERATIN)
    }

    /// The model's options, with the defaults that depend on source, method and index filled in.
    pub fn model(&self) -> Options {
        self.config().options_for(Some(&SpectralIndex::Constant(self.index())))
    }

    /// The optics around the relief.
    pub fn optics(&self) -> Optics {
        let model = self.model();
        Optics { index: Some(self.index()), obliquity: model.obliquity, shadowing: model.shadowing }
    }

    /// What is drawn, with so many rays along each side of a pixel.
    ///
    /// # Errors
    /// [`WebError::Settings`] for a camera that shows nothing.
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

    /// Mesh and pigment.
    ///
    /// # Errors
    /// [`WebError::Settings`] for a mesh out of range.
    pub fn scene(&self) -> Result<(Mesh, PigmentTexture), WebError> {
        Ok(self.shape.make(self.resolution, PIGMENT_SIZE)?)
    }

    /// The same with a coarser mesh and pigment: made much sooner, and fast to draw.
    ///
    /// # Errors
    /// As [`Settings::scene`].
    pub fn draft_scene(&self) -> Result<(Mesh, PigmentTexture), WebError> {
        let (along, around) = PIGMENT_SIZE;
        let pigment = (along / DRAFT_PIGMENT, around / DRAFT_PIGMENT);
        Ok(self.shape.make(DRAFT_RESOLUTION, pigment)?)
    }

    /// What changes when the relief, the method's data or the scene have to be made anew.
    pub fn keys(&self) -> Keys {
        let config = self.config();
        // Heights do not depend on how the tile goes on.
        let relief = ReliefSource { level: Some(config.level()), tiling: None, ..config.relief_source() };
        let mut method = config;
        if method.conserve_energy != Some(true) {
            // Then these are the shader's optics, which are set without building anything.
            (method.obliquity, method.shadowing) = (ObliquityChoice::default(), false);
            (method.eta, method.k) = (None, None);
        }
        Keys {
            relief: text(&relief),
            method: format!("{} {} {}", self.method, text(&self.options), text(&method)),
            scene: match self.shape {
                Shape::Snake => format!("{} {}", self.shape.name(), self.resolution),
                Shape::Flat | Shape::Sphere => self.shape.name().to_owned(),
            },
        }
    }

    /// All fields as JSON.
    pub fn to_json(&self) -> String {
        text(self)
    }

    /// Only what differs from the defaults. A surface is read as a whole, so it is there with all that is not a surface's
    /// own default, or not at all.
    pub fn to_compact_json(&self) -> String {
        let default = Self::default();
        let value = |value: serde_json::Result<serde_json::Value>| value.unwrap_or_default();
        let of = |settings: &Self| value(serde_json::to_value(settings));
        let without_surface = Self { surface: default.surface.clone(), ..self.clone() };
        let mut kept = difference(of(&without_surface), &of(&default)).unwrap_or_else(|| serde_json::json!({}));
        if self.surface != default.surface {
            let of = |surface: &SurfaceConfig| value(serde_json::to_value(surface));
            let surface = difference(of(&self.surface), &of(&SurfaceConfig::default()));
            kept["surface"] = surface.unwrap_or_else(|| serde_json::json!({}));
        }
        kept.to_string()
    }
}

/// Strings that change when something has to be made anew.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Keys {
    /// The heights.
    pub relief: String,
    /// The method's data.
    pub method: String,
    /// Mesh and pigment.
    pub scene: String,
}

fn text(value: &impl Serialize) -> String {
    serde_json::to_string(value).unwrap_or_default()
}

fn is_plain_name(path: &Path) -> bool {
    let mut components = path.components();
    matches!((components.next(), components.next()), (Some(Component::Normal(_)), None))
}

/// The fields of an object that differ from another's, and theirs; `None` where there are none.
fn difference(value: serde_json::Value, from: &serde_json::Value) -> Option<serde_json::Value> {
    use serde_json::Value;
    match (value, from) {
        (Value::Object(fields), Value::Object(others)) => {
            let differs = |(name, value): (String, Value)| match others.get(&name) {
                Some(other) => difference(value, other).map(|value| (name, value)),
                None => Some((name, value)),
            };
            let kept: serde_json::Map<String, Value> = fields.into_iter().filter_map(differs).collect();
            (!kept.is_empty()).then_some(Value::Object(kept))
        }
        (value, other) => (value != *other).then_some(value),
    }
}
