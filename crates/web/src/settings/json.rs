//! Settings as a JSON object: reading, and writing in full or without the fields that have their defaults.

use super::Settings;
use crate::error::WebError;
use serde::Serialize;
use sunbeam::config::SurfaceConfig;

impl Settings {
    /// Reads and checks a JSON object.
    ///
    /// # Errors
    /// [`WebError::Settings`] for settings that are unknown, of the wrong type or out of range.
    pub fn from_json(json: &str) -> Result<Self, WebError> {
        let mut value: serde_json::Value =
            serde_json::from_str(json).map_err(|error| WebError::Settings(format!("not valid JSON: {error}")))?;
        let surface = value.as_object_mut().and_then(|fields| fields.remove("surface"));
        let mut settings: Self =
            serde_json::from_value(value).map_err(|error| WebError::Settings(error.to_string()))?;
        if let Some(surface) = surface {
            // Unlike serde's, the messages of the library's own reader name the parameter.
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
        let without_surface = Self { surface: default.surface.clone(), ..self.clone() };
        let no_fields = || serde_json::json!({});
        let mut kept = difference(tree(&without_surface), &tree(&default)).unwrap_or_else(no_fields);
        if self.surface != default.surface {
            let surface = difference(tree(&self.surface), &tree(&SurfaceConfig::default()));
            kept["surface"] = surface.unwrap_or_else(no_fields);
        }
        kept.to_string()
    }
}

/// A value as a tree of JSON values. Settings always convert, so the default, null, is never taken. Nor is the empty
/// text in [`serialised`].
fn tree(value: &impl Serialize) -> serde_json::Value {
    serde_json::to_value(value).unwrap_or_default()
}

/// A value as JSON text.
pub(super) fn serialised(value: &impl Serialize) -> String {
    serde_json::to_string(value).unwrap_or_default()
}

/// The fields of the object `value`, recursively, that differ from those of `from` or are missing there. `None` if
/// there are none. Fields that only `from` has are ignored.
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
