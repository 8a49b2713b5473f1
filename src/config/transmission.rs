//! The parameter `transmission`, and the parameters that contradict it.

use super::validate::{contradiction, refuse_contradictions};
use super::{Accepted, ConfigError, ObliquityChoice, SurfaceConfig};
use crate::scattering::{Transmission, TransparentBody};
use std::ops::RangeInclusive;

/// Accepted index of a body that transmits, besides 1, which changes no light. At indices between 1 and 1.2 the
/// deflection by refraction is lost in the width of an order. The largest is that of germanium.
pub const BODY_ETA: RangeInclusive<f64> = 1.2..=4.0;

impl SurfaceConfig {
    /// The transparent body below the relief; `None` for a surface that only reflects. Also `None` for transmission
    /// without `eta`, which [`SurfaceConfig::validate`] refuses.
    pub fn body(&self) -> Option<TransparentBody> {
        let is_film = match self.transmission {
            Transmission::None => return None,
            Transmission::Film => true,
            Transmission::Interface => false,
        };
        // The coherence length gives the width of an order. It bounds `normal_min` from below, the smallest |w|/eta at
        // which the body's factors are evaluated.
        self.eta.map(|eta| TransparentBody::new(eta, is_film, self.coherence_length))
    }

    /// Factor by which scalar tables magnify the relief and its coherence window (`build.rs`): the index of the cover
    /// or of the body, which exclude each other.
    pub fn magnification(&self) -> f64 {
        self.cover_eta.or(self.body().map(|body| body.eta)).unwrap_or(1.0)
    }

    /// Refuses transmission. `user` is a plural for the message: functions that show reflected light only.
    ///
    /// # Errors
    /// [`ConfigError::Contradiction`] if the configuration transmits.
    pub fn refuse_transmission(&self, user: &str) -> Result<(), ConfigError> {
        match self.transmission {
            Transmission::None => Ok(()),
            _ => contradiction("transmission", user, "they are for reflected light; leave it out"),
        }
    }

    /// Refuses parameters that contradict transmission.
    pub(super) fn validate_transmission(&self) -> Result<(), ConfigError> {
        if self.transmission == Transmission::None {
            return Ok(());
        }
        let Some(eta) = self.eta else {
            return contradiction("transmission", "the absence of \"eta\"", "give the index of the dielectric");
        };
        // Parameter, whether it contradicts, and why.
        let checks = [
            ("k", self.k.is_some_and(|k| k > 0.0), "a body that transmits does not absorb; leave it out"),
            ("cover_eta", self.cover_eta.is_some(), "a relief that transmits is bare; leave it out"),
            ("shadowing", self.shadowing, "light passes what would shadow it"),
            (
                "obliquity",
                !matches!(self.obliquity, ObliquityChoice::Auto | ObliquityChoice::SmallSlope),
                "only \"small_slope\" has a factor for it",
            ),
        ];
        refuse_contradictions(&format!("transmission {:?}", self.transmission.name()), &checks)?;
        if eta != 1.0 && !BODY_ETA.contains(&eta) {
            return Err(ConfigError::OutOfRange { parameter: "eta", found: eta, accepted: Accepted::BodyEta });
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parameters_that_contradict_transmission_are_named() {
        for (parameter, json) in [
            ("transmission", r#"{"preset":"blazed","transmission":"film"}"#),
            ("k", r#"{"preset":"blazed","transmission":"film","eta":1.5,"k":0.1}"#),
            ("cover_eta", r#"{"preset":"blazed","transmission":"film","eta":1.5,"cover_eta":1.4}"#),
            ("shadowing", r#"{"preset":"blazed","transmission":"interface","eta":1.5,"shadowing":true}"#),
            ("obliquity", r#"{"preset":"blazed","transmission":"interface","eta":1.5,"obliquity":"stam"}"#),
        ] {
            let message = SurfaceConfig::from_json(json).expect_err(json).to_string();
            assert!(message.starts_with(&format!("parameter {parameter:?} contradicts")), "{message}");
        }
        let message = SurfaceConfig::from_json(r#"{"transmission":"film","eta":0.7}"#).unwrap_err().to_string();
        assert!(message.contains("\"eta\" is 0.7") && message.contains("1, or in [1.2e0, 4e0]"), "{message}");
        for transmission in Transmission::ALL {
            let json = format!(r#"{{"transmission":"{}","eta":1.5}}"#, transmission.name());
            assert_eq!(SurfaceConfig::from_json(&json).unwrap().transmission, transmission);
        }
    }
}
