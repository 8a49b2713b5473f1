//! The parameter `theory`, and the parameters that the rigorous theory refuses.

use super::validate::{contradiction, refuse_contradictions};
use super::{ConfigError, ObliquityChoice, Source, SurfaceConfig};
use crate::height_field::Preset;
use crate::table::{Model, Tiling};
use serde::{Deserialize, Serialize};

/// The theory of diffraction.
///
/// ```
/// use sunbeam::config::{SurfaceConfig, Theory};
///
/// let json = r#"{"preset": "blazed", "theory": "rigorous", "eta": 1.0, "k": 6.9}"#;
/// assert_eq!(SurfaceConfig::from_json(json)?.theory, Theory::Rigorous);
/// # Ok::<(), sunbeam::config::ConfigError>(())
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Theory {
    /// A phase screen, for any relief (docs/model.md#the-reflectance).
    #[default]
    Scalar,
    /// Maxwell's equations, for reliefs that vary along x only (docs/model.md#gratings-by-maxwells-equations).
    Rigorous,
}

impl Theory {
    /// All theories, the default first.
    pub const ALL: [Self; 2] = [Self::Scalar, Self::Rigorous];

    /// The name in the users' interfaces.
    pub fn name(self) -> &'static str {
        match self {
            Self::Scalar => "scalar",
            Self::Rigorous => "rigorous",
        }
    }
}

impl SurfaceConfig {
    /// Refuses parameters that contradict the rigorous theory.
    pub(super) fn validate_theory(&self) -> Result<(), ConfigError> {
        if self.theory == Theory::Scalar {
            return Ok(());
        }
        let other = "theory \"rigorous\"";
        let scalar_only = "theory \"scalar\" has it";
        // Parameter, whether its value contradicts the rigorous theory, and advice for the message.
        let checks = [
            ("model", self.model == Model::Patch, scalar_only),
            ("shadowing", self.shadowing, "orders contain what the relief shadows"),
            ("conserve_energy", self.conserve_energy == Some(false), "orders keep energy by themselves"),
            ("tiling", self.tiling == Some(Tiling::Aperiodic), "a grating is one period, repeated"),
            ("obliquity", self.obliquity != ObliquityChoice::Auto, scalar_only),
        ];
        refuse_contradictions(other, &checks)?;
        match self.source() {
            // These presets vary along y, too; elaphe is also the default without preset and file.
            Source::Preset(Preset::Cd | Preset::Elaphe | Preset::Xenopeltis) => contradiction(
                "preset",
                other,
                "it takes reliefs that vary along x alone: \"blazed\", \"sinusoidal\", \"lamellar\", \"flat\", or a \
                 file of one",
            ),
            Source::Preset(Preset::Flat | Preset::Blazed | Preset::Sinusoidal | Preset::Lamellar) => Ok(()),
            // Checked when its profile is read; so is an array, for which the flat preset stands here (validate.rs).
            Source::File(_) => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parameters_that_contradict_the_rigorous_theory_are_named() {
        for (parameter, json) in [
            ("model", r#"{"preset":"blazed","theory":"rigorous","model":"patch"}"#),
            ("shadowing", r#"{"preset":"blazed","theory":"rigorous","shadowing":true}"#),
            ("conserve_energy", r#"{"preset":"blazed","theory":"rigorous","conserve_energy":false}"#),
            ("tiling", r#"{"filename":"a.npy","theory":"rigorous","tiling":"aperiodic"}"#),
            ("obliquity", r#"{"preset":"blazed","theory":"rigorous","obliquity":"unit"}"#),
            ("preset", r#"{"preset":"elaphe","theory":"rigorous"}"#),
            ("preset", r#"{"theory":"rigorous"}"#),
        ] {
            let message = SurfaceConfig::from_json(json).expect_err(json).to_string();
            assert!(message.starts_with(&format!("parameter {parameter:?} contradicts theory")), "{message}");
        }
        for preset in ["blazed", "sinusoidal", "lamellar", "flat"] {
            let json = format!(r#"{{"preset":"{preset}","theory":"rigorous","eta":1.0,"k":6.9}}"#);
            assert_eq!(SurfaceConfig::from_json(&json).unwrap().theory, Theory::Rigorous);
        }
        for theory in Theory::ALL {
            assert_eq!(serde_json::to_string(&theory).unwrap(), format!("{:?}", theory.name()));
        }
    }
}
