//! Reading of settings from a JSON object, and writing with all fields or with those that differ from the defaults.
//!
//! There are two default surfaces: the page's, in `Settings::default()`, and the library's, `SurfaceConfig::default()`.

use super::Settings;
use crate::error::WebError;
use serde::Serialize;
use sunbeam::config::SurfaceConfig;

impl Settings {
    /// Reads and checks a JSON object. Missing fields have the values of `Settings::default()`. Missing fields of a
    /// given `surface` have the values of [`SurfaceConfig::default`].
    ///
    /// # Errors
    /// [`WebError::Settings`] for a text that is no JSON object, and for settings that are unknown, of the wrong type
    /// or out of range.
    pub fn from_json(json: &str) -> Result<Self, WebError> {
        let mut value: serde_json::Value =
            serde_json::from_str(json).map_err(|error| WebError::Settings(format!("not valid JSON: {error}")))?;
        let fields =
            value.as_object_mut().ok_or_else(|| WebError::Settings("settings must be a JSON object".into()))?;
        let surface = fields.remove("surface");
        let mut settings: Self =
            serde_json::from_value(value).map_err(|error| WebError::Settings(error.to_string()))?;
        if let Some(surface) = surface {
            // The library's own reader names the faulty parameter in its messages, which serde does not.
            settings.surface = SurfaceConfig::from_json(&surface.to_string())
                .map_err(|error| WebError::Settings(error.to_string()))?;
        }
        settings.check()?;
        Ok(settings)
    }

    /// All fields as JSON.
    pub fn to_json(&self) -> String {
        serialised(self)
    }

    /// The fields that differ from the defaults, as JSON.
    ///
    /// `surface` is left out if it is the page's default surface. Otherwise it is written with all fields that differ
    /// from [`SurfaceConfig::default`], since [`Settings::from_json`] takes missing fields from there.
    pub fn to_compact_json(&self) -> String {
        let default = Self::default();
        let with_default_surface = Self { surface: default.surface.clone(), ..self.clone() };
        let no_fields = || serde_json::json!({});
        let mut kept = difference(to_value(&with_default_surface), &to_value(&default)).unwrap_or_else(no_fields);
        if self.surface != default.surface {
            let surface = difference(to_value(&self.surface), &to_value(&SurfaceConfig::default()));
            kept["surface"] = surface.unwrap_or_else(no_fields);
        }
        kept.to_string()
    }
}

/// A value as a tree of JSON values. The conversion of settings cannot fail, so the fallbacks here (null) and in
/// [`serialised`] (an empty text) are never used.
fn to_value(value: &impl Serialize) -> serde_json::Value {
    serde_json::to_value(value).unwrap_or_default()
}

/// A value as JSON text.
pub(super) fn serialised(value: &impl Serialize) -> String {
    serde_json::to_string(value).unwrap_or_default()
}

/// The fields of the object `value` that `base` lacks or has with another value; objects are compared field by field.
/// `None` if there are none. Fields that only `base` has are ignored, so a field that the default settings serialise
/// must always be serialised.
fn difference(value: serde_json::Value, base: &serde_json::Value) -> Option<serde_json::Value> {
    use serde_json::Value;
    match (value, base) {
        (Value::Object(fields), Value::Object(others)) => {
            let differs = |(name, value): (String, Value)| match others.get(&name) {
                Some(other) => difference(value, other).map(|changed| (name, changed)),
                None => Some((name, value)),
            };
            let kept: serde_json::Map<String, Value> = fields.into_iter().filter_map(differs).collect();
            (!kept.is_empty()).then_some(Value::Object(kept))
        }
        (value, other) => (value != *other).then_some(value),
    }
}
