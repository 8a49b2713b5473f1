//! Ranges of the parameters, and combinations that contradict each other. `theory.rs` and `transmission.rs` refuse the
//! parameters that contradict `theory` and `transmission`.

use super::{Accepted, COVER_ETA, ConfigError, ETA, K, RELATIVE_SIZE, ReliefSource, Source, SurfaceConfig, Theory};
use crate::height_field::{MAX_LENGTH_UM, Preset, REGION_SIZE_UM, REGION_SPREAD};
use crate::table::{BUILD_LIMIT, COHERENCE_LENGTH_UM, TOLERANCE};

/// Always fails, with the error that `parameter` contradicts `other`, and advice for the user.
pub(super) fn contradiction(
    parameter: &'static str,
    other: impl Into<String>,
    advice: &'static str,
) -> Result<(), ConfigError> {
    Err(ConfigError::Contradiction { parameter, other: other.into(), advice })
}

/// Refuses the first of the `checks` that contradicts `other`. A check is a parameter, whether it contradicts, and
/// advice for the user.
pub(super) fn refuse_contradictions(
    other: &str,
    checks: &[(&'static str, bool, &'static str)],
) -> Result<(), ConfigError> {
    match checks.iter().find(|(_, contradicts, _)| *contradicts) {
        Some(&(parameter, _, advice)) => contradiction(parameter, other, advice),
        None => Ok(()),
    }
}

impl SurfaceConfig {
    /// Validates the configuration for heights from an array; `fill` is accepted without a file.
    ///
    /// # Errors
    /// [`ConfigError::Contradiction`] for a parameter of presets or files; the errors of [`SurfaceConfig::validate`].
    pub fn validate_for_array(&self) -> Result<(), ConfigError> {
        let is_refused = |name: &&str| !ReliefSource::OF_ARRAYS.contains(name);
        if let Some(parameter) = self.relief_source().given().find(is_refused) {
            return contradiction(parameter, "heights from an array", "it is about presets and files");
        }
        // The rigorous theory would refuse the relief of the default preset. The flat preset, which passes, stands for
        // the array.
        let preset = (self.theory == Theory::Rigorous).then_some(Preset::Flat);
        Self { fill: None, preset, ..self.clone() }.validate()
    }

    /// Refuses values out of range and parameters that contradict each other.
    ///
    /// # Errors
    /// [`ConfigError::OutOfRange`], [`ConfigError::TooLong`], [`ConfigError::Contradiction`].
    pub fn validate(&self) -> Result<(), ConfigError> {
        self.validate_numbers()?;
        self.validate_source()?;
        self.validate_regions()?;
        self.validate_theory()?;
        self.validate_transmission()
    }

    /// Refuses numbers out of range, and the imaginary part of an index without the real part.
    fn validate_numbers(&self) -> Result<(), ConfigError> {
        let lengths = [
            ("period", self.period),
            ("height", self.height),
            ("pixel_size", self.pixel_size),
            ("max_height", self.max_height),
        ];
        for (parameter, value) in lengths {
            let accepted = Accepted::Length;
            match value {
                Some(found) if found > MAX_LENGTH_UM => {
                    return Err(ConfigError::TooLong { parameter, found, accepted });
                }
                Some(found) if found.is_nan() || found <= 0.0 => {
                    return Err(ConfigError::OutOfRange { parameter, found, accepted });
                }
                _ => {}
            }
        }
        // Parameter, value if given, accepted range, and the range for messages.
        let ranges = [
            ("coherence_length", Some(self.coherence_length), COHERENCE_LENGTH_UM, Accepted::CoherenceLength),
            ("eta", self.eta, ETA, Accepted::Eta),
            ("k", self.k, K, Accepted::K),
            ("cover_eta", self.cover_eta, COVER_ETA, Accepted::CoverEta),
            ("tolerance", Some(self.tolerance), TOLERANCE, Accepted::Tolerance),
            ("build_limit", Some(self.build_limit), BUILD_LIMIT, Accepted::BuildLimit),
            ("scale", Some(self.scale), RELATIVE_SIZE, Accepted::RelativeSize),
            ("depth", Some(self.depth), RELATIVE_SIZE, Accepted::RelativeSize),
            ("region_size", self.region_size, REGION_SIZE_UM, Accepted::RegionSize),
            ("region_spread", self.region_spread, REGION_SPREAD, Accepted::RegionSpread),
        ];
        for (parameter, value, range, accepted) in ranges {
            if let Some(found) = value.filter(|v| !range.contains(v)) {
                return Err(ConfigError::OutOfRange { parameter, found, accepted });
            }
        }
        if self.k.is_some() && self.eta.is_none() {
            return contradiction("k", "the absence of \"eta\"", "give both, or eta alone");
        }
        Ok(())
    }

    /// Refuses parameters that contradict the source of the heights.
    fn validate_source(&self) -> Result<(), ConfigError> {
        if self.preset.is_some() && self.filename.is_some() {
            return contradiction("preset", "\"filename\"", "give one of the two");
        }
        for (parameter, given) in [("period", self.period), ("height", self.height)] {
            match (given, self.source()) {
                (None, _) => {}
                (Some(_), Source::File(_)) => {
                    return contradiction(parameter, "\"filename\"", "it shapes presets only");
                }
                // Presets without default lengths take none.
                (Some(_), Source::Preset(preset)) if preset.defaults_um().is_none() => {
                    let other = format!("preset {:?}", preset.name());
                    let advice = "it needs preset \"blazed\", \"sinusoidal\" or \"lamellar\"";
                    return contradiction(parameter, other, advice);
                }
                _ => {}
            }
        }
        if self.filename.is_some() {
            return Ok(());
        }
        let of_files = [
            ("pixel_size", self.pixel_size.is_some(), "it gives the scale of a file"),
            ("max_height", self.max_height.is_some(), "it gives the scale of a file"),
            ("channel", self.channel.is_some(), "it chooses what is read of a file"),
            ("fill", self.fill.is_some(), "it fills the missing points of a file"),
        ];
        refuse_contradictions("the absence of \"filename\"", &of_files)
    }

    /// Refuses sub-regions of reliefs other than the skins `elaphe` and `xenopeltis`, and one of the two parameters
    /// without the other.
    fn validate_regions(&self) -> Result<(), ConfigError> {
        // The parameter that messages name, and the one that is missing beside it.
        let (parameter, missing) = match (self.region_size, self.region_spread) {
            (None, None) => return Ok(()),
            (Some(_), None) => ("region_size", Some("region_spread")),
            (None, Some(_)) => ("region_spread", Some("region_size")),
            (Some(_), Some(_)) => ("region_size", None),
        };
        match (self.source(), missing) {
            (Source::File(_), _) => contradiction(parameter, "\"filename\"", "it shapes presets only"),
            (Source::Preset(preset), _) if !preset.is_skin() => {
                let other = format!("preset {:?}", preset.name());
                contradiction(parameter, other, "it needs preset \"elaphe\" or \"xenopeltis\"")
            }
            (Source::Preset(_), Some(missing)) => {
                contradiction(parameter, format!("the absence of {missing:?}"), "give both")
            }
            (Source::Preset(_), None) => Ok(()),
        }
    }

    /// Refuses a cover or transmission. `user` is a plural for the message: functions that work with bare reliefs only.
    ///
    /// # Errors
    /// [`ConfigError::Contradiction`] if the configuration has either.
    pub fn require_bare(&self, user: &str) -> Result<(), ConfigError> {
        if self.cover_eta.is_some() {
            return contradiction("cover_eta", user, "they are for bare reliefs; leave it out");
        }
        self.refuse_transmission(user)
    }
}
