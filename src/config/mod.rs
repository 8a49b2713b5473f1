//! Parameters of a surface, under the names that all interfaces share: scene files, JSON, the command line, Python.
//!
//! A [`SurfaceConfig`] holds the parameters as given. A missing one is `None` where its default depends on another
//! parameter; methods such as [`SurfaceConfig::level`] resolve it. Lengths are in µm.
//!
//! ```
//! use sunbeam::config::SurfaceConfig;
//! let config = SurfaceConfig::from_json(r#"{"preset": "blazed", "period": 2.0}"#).unwrap();
//! assert_eq!(config.coherence_length, 65.0);
//! let error = SurfaceConfig::from_json(r#"{"preset": "blazed", "period": -2.0}"#).unwrap_err();
//! assert_eq!(error.to_string(), "parameter \"period\" is -2, but must be a length in µm in (0, 1e3]");
//! ```

#[cfg(feature = "full")]
mod build;
#[cfg(feature = "full")]
mod built_surface;
mod channel;
mod error;
#[cfg(feature = "full")]
mod method;
mod obliquity;
mod relief_source;
#[cfg(test)]
mod tests;
mod theory;
mod transmission;
mod validate;

#[cfg(feature = "full")]
pub use build::BuildError;
#[cfg(feature = "full")]
pub use built_surface::{BuiltReport, BuiltSurface};
pub use error::{Accepted, ConfigError};
pub use obliquity::ObliquityChoice;
pub use relief_source::ReliefSource;
pub use theory::Theory;
pub use transmission::BODY_ETA;

pub use crate::scattering::RELATIVE_SIZE;

use crate::height_field::{Fill, Level, Preset};
use crate::scattering::{ComplexIndex, Cover, Options, SizeRange, Transmission};
use crate::table::{Model, Tiling};
use serde::{Deserialize, Serialize};
use std::ops::RangeInclusive;
use std::path::PathBuf;

/// Accepted real parts of a refractive index. They include all materials, and their squares neither overflow nor vanish
/// in single precision.
pub const ETA: RangeInclusive<f64> = 1e-3..=1e3;
/// Accepted imaginary parts of a refractive index; positive ones absorb. The upper bound is that of [`ETA`].
pub const K: RangeInclusive<f64> = 0.0..=1e3;

/// Accepted indices of a cover. The range includes diamond (2.4) and titania (2.6).
pub const COVER_ETA: RangeInclusive<f64> = 1.0..=2.6;

/// The source of the heights: a preset or a file.
///
/// ```
/// use sunbeam::config::{Source, SurfaceConfig};
/// use sunbeam::Preset;
///
/// assert_eq!(SurfaceConfig::default().source(), Source::Preset(Preset::Elaphe));
/// ```
#[derive(Clone, Debug, PartialEq)]
pub enum Source<'a> {
    /// A built-in relief.
    Preset(Preset),
    /// Path of a file, whose extension tells the format.
    File(&'a PathBuf),
}

/// Parameters of a surface. The names of the fields are those of the users' interfaces.
///
/// [`SurfaceConfig::validate`] checks ranges and combinations.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct SurfaceConfig {
    /// The built-in relief (default: `elaphe`, unless `filename` is given).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub preset: Option<Preset>,
    /// Period along x in µm of the presets `blazed`, `sinusoidal`, `lamellar` (default: the preset's).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub period: Option<f64>,
    /// Height from valley to peak in µm of the same presets (default: the preset's).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub height: Option<f64>,
    /// Edge in µm of the sub-regions of the presets `elaphe` and `xenopeltis`; needs `region_spread` (default: none).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub region_size: Option<f64>,
    /// Relative deviation of the skin's spatial frequency, upwards and downwards in alternate sub-regions; needs
    /// `region_size` (default: none).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub region_spread: Option<f64>,
    /// A height field on disk (default: none).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub filename: Option<PathBuf>,
    /// Edge of a pixel of the file in µm (default: the file's own).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub pixel_size: Option<f64>,
    /// Height in µm of full scale: of white, of the integer type's largest number, or of the highest value of a file
    /// without a unit (default: the file's own).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub max_height: Option<f64>,
    /// The channel of a file that holds several, by number or title (default: the first that is a height).
    #[serde(skip_serializing_if = "Option::is_none", deserialize_with = "channel::deserialize")]
    pub channel: Option<String>,
    /// Replacement for missing points of the file or array (default: `none`, which refuses a relief with such points).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub fill: Option<Fill>,
    /// Surface subtracted from the heights (default: `plane` for files, `none` for presets).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub level: Option<Level>,
    /// Continuation beyond the tile (default: `aperiodic` for files by the scalar theory, else `periodic`).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub tiling: Option<Tiling>,
    /// Size of the pattern along x and y relative to the relief given (default: 1). The coherence length is not scaled.
    #[serde(skip_serializing_if = "is_one")]
    pub scale: f64,
    /// Heights relative to the relief given (default: 1).
    #[serde(skip_serializing_if = "is_one")]
    pub depth: f64,
    /// Range of sizes at which a scalar surface is evaluated, relative to the relief resized by `scale` and `depth`
    /// (default: none, at this relief's own size). Renderers set it for textures of sizes; files cannot give it.
    #[serde(skip)]
    pub sizes: Option<SizeRange>,
    /// Theory of diffraction (default: `scalar`).
    #[serde(skip_serializing_if = "is_scalar")]
    pub theory: Theory,
    /// Four standard deviations of the coherence window in µm (default: 65, filtered sunlight).
    pub coherence_length: f64,
    /// Coherence model: an average over window positions, or a single window (default: `ensemble`).
    pub model: Model,
    /// The obliquity factor (default: `auto`).
    pub obliquity: ObliquityChoice,
    /// Whether the albedo is kept at or below 1 (default: true for `ensemble`, false for `patch`).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub conserve_energy: Option<bool>,
    /// Whether the V-cavity factor `M` for shadowing (docs/model.md) applies (default: false).
    pub shadowing: bool,
    /// Real part of the refractive index at all wavelengths; without `k` a dielectric (default: none, the surface
    /// reflects everything).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub eta: Option<f64>,
    /// Imaginary part of the refractive index; needs `eta` (default: 0).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub k: Option<f64>,
    /// Index of a flat clear layer over the relief, such as a disc's polycarbonate or a foil's lacquer (default: none).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub cover_eta: Option<f64>,
    /// Fate of the light that passes the relief of a dielectric: absorbed, or transmitted through a film or into a
    /// medium (default: `none`, absorbed).
    #[serde(skip_serializing_if = "is_none")]
    pub transmission: Transmission,
    /// Relative error of the tables (default: 1e-3).
    pub tolerance: f64,
    /// Factor on the limits of a build, 8 GB and two minutes on two cores (default: 1).
    #[serde(skip_serializing_if = "is_one")]
    pub build_limit: f64,
}

/// Whether a factor has its default, which is not serialised.
fn is_one(factor: &f64) -> bool {
    *factor == 1.0
}

/// Whether `transmission` has its default, which is not serialised.
fn is_none(transmission: &Transmission) -> bool {
    *transmission == Transmission::None
}

/// Whether `theory` has its default, which is not serialised.
fn is_scalar(theory: &Theory) -> bool {
    *theory == Theory::Scalar
}

impl Default for SurfaceConfig {
    /// The default preset with the parameters of [`Options::default`].
    fn default() -> Self {
        let options = Options::default();
        Self {
            preset: None,
            period: None,
            height: None,
            region_size: None,
            region_spread: None,
            filename: None,
            pixel_size: None,
            max_height: None,
            channel: None,
            fill: None,
            level: None,
            tiling: None,
            scale: 1.0,
            depth: 1.0,
            theory: Theory::default(),
            coherence_length: options.coherence_length_um,
            model: options.model,
            obliquity: ObliquityChoice::default(),
            conserve_energy: None,
            shadowing: options.shadowing,
            eta: None,
            k: None,
            cover_eta: None,
            transmission: Transmission::None,
            sizes: None,
            tolerance: options.tolerance,
            build_limit: options.build_limit,
        }
    }
}

impl SurfaceConfig {
    /// Reads and validates a JSON object; missing fields take their defaults.
    ///
    /// # Errors
    /// [`ConfigError::Syntax`], [`ConfigError::Malformed`], and those of [`SurfaceConfig::validate`].
    pub fn from_json(json: &str) -> Result<Self, ConfigError> {
        let config = Self::parse(json)?;
        config.validate()?;
        Ok(config)
    }

    /// Reads and validates a JSON object for heights from an array; `fill` is accepted without a file.
    ///
    /// # Errors
    /// The errors of [`SurfaceConfig::from_json`].
    pub fn from_json_for_array(json: &str) -> Result<Self, ConfigError> {
        let config = Self::parse(json)?;
        config.validate_for_array()?;
        Ok(config)
    }

    /// Reads a JSON object. Checks names and types of the parameters, but neither ranges nor combinations.
    fn parse(json: &str) -> Result<Self, ConfigError> {
        let mut reader = serde_json::Deserializer::from_str(json);
        let config: Self = serde_path_to_error::deserialize(&mut reader).map_err(|error| {
            let parameter = error.path().to_string();
            let cause = error.into_inner();
            // The path "." is the object itself.
            if cause.is_data() && parameter != "." {
                ConfigError::Malformed { parameter, reason: without_position(&cause.to_string()) }
            } else {
                ConfigError::Syntax(cause.to_string())
            }
        })?;
        reader.end().map_err(|error| ConfigError::Syntax(error.to_string()))?;
        Ok(config)
    }

    /// The source of the heights.
    pub fn source(&self) -> Source<'_> {
        match &self.filename {
            Some(path) => Source::File(path),
            None => Source::Preset(self.preset.unwrap_or(Preset::Elaphe)),
        }
    }

    /// `level`, or its default.
    pub fn level(&self) -> Level {
        self.level.unwrap_or(if self.filename.is_some() { Level::Plane } else { Level::None })
    }

    /// `tiling`, or its default. The rigorous theory takes a file as one period of a grating.
    pub fn tiling(&self) -> Tiling {
        let is_scan = self.filename.is_some() && self.theory == Theory::Scalar;
        self.tiling.unwrap_or(if is_scan { Tiling::Aperiodic } else { Tiling::Periodic })
    }

    /// The cover over the relief; `None` for a bare one.
    pub fn cover(&self) -> Option<Cover> {
        self.cover_eta.map(Cover::new)
    }

    /// The refractive index, `None` for a surface that reflects everything.
    pub fn index(&self) -> Option<ComplexIndex> {
        self.eta.map(|eta| ComplexIndex { eta, k: self.k.unwrap_or(0.0) })
    }

    /// `conserve_energy`, or its default.
    pub fn conserve_energy(&self) -> bool {
        self.conserve_energy.unwrap_or(self.model == Model::Ensemble)
    }
}

/// A message of serde_json without its end, such as " at line 1 column 23". [`ConfigError::Malformed`] names the
/// parameter instead.
fn without_position(message: &str) -> String {
    message.rsplit_once(" at line ").map_or(message, |(head, _)| head).to_owned()
}
