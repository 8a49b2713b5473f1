//! Parsing of queries, the JSON lines of `sunbeam eval` and `sunbeam sample`, with messages that name the faulty field.

use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use sunbeam::scattering::{Vec3, unit_vector};

/// One number or an array of numbers: wavelengths, or the values at wavelengths. The answer to a number is a number,
/// that to an array an array.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(untagged, expecting = "expected a number or an array of numbers")]
pub(crate) enum Numbers {
    One(f64),
    Many(Vec<f64>),
}

impl Numbers {
    /// The numbers as a slice.
    pub(crate) fn as_slice(&self) -> &[f64] {
        match self {
            Self::One(number) => std::slice::from_ref(number),
            Self::Many(numbers) => numbers,
        }
    }

    /// Applies `function` to each number.
    pub(crate) fn map(&self, function: impl Fn(f64) -> f64) -> Self {
        match self {
            Self::One(number) => Self::One(function(*number)),
            Self::Many(numbers) => Self::Many(numbers.iter().map(|number| function(*number)).collect()),
        }
    }

    /// Applies `function` to each number, and stops at the first error.
    pub(crate) fn try_map(&self, function: impl Fn(f64) -> Result<f64, String>) -> Result<Self, String> {
        Ok(match self {
            Self::One(number) => Self::One(function(*number)?),
            Self::Many(numbers) => {
                Self::Many(numbers.iter().map(|number| function(*number)).collect::<Result<_, _>>()?)
            }
        })
    }
}

/// Parses one line of JSON.
///
/// # Errors
/// A message. It names the field if the line is valid JSON with a wrong value.
pub(crate) fn parse<T: DeserializeOwned>(line: &[u8]) -> Result<T, String> {
    if line.trim_ascii().is_empty() {
        return Err("the line is empty".to_owned());
    }
    // `serde_path_to_error` records the path of the field that is being read, which is slow. So it parses the line only
    // after an error.
    if let Ok(query) = serde_json::from_slice(line) {
        return Ok(query);
    }
    let mut reader = serde_json::Deserializer::from_slice(line);
    let error = match serde_path_to_error::deserialize::<_, T>(&mut reader) {
        Err(error) => error,
        // The first value on the line is right, so a second text follows it, which `end` refuses.
        Ok(_) => {
            let message = reader.end().err().map(|error| without_line_number(&error)).unwrap_or_default();
            return Err(format!("not JSON: {message}"));
        }
    };
    let field = error.path().to_string();
    let cause = error.into_inner();
    let message = without_line_number(&cause);
    // A number beyond the range of f64 is JSON, although `serde_json` counts it as an error of syntax.
    let is_json = cause.is_data() || message.starts_with("number out of range");
    match (is_json, field.as_str()) {
        (false, _) => Err(format!("not JSON: {message}")),
        // `serde_path_to_error` writes "." for the whole line, and "?" for a place that it cannot track.
        (true, "." | "?") => Err(message),
        (true, field) => Err(format!("{field:?}: {message}")),
    }
}

/// The message without the number of the line, which is always 1.
fn without_line_number(error: &serde_json::Error) -> String {
    error.to_string().replace(" at line 1 column ", " at column ")
}

/// Checks that a direction has three components and a length near 1, and normalises it. `name` is the name of its
/// field, for messages.
///
/// # Errors
/// A number of components other than three, or a length that differs from 1 by more than
/// [`sunbeam::scattering::LENGTH_TOLERANCE`].
pub(crate) fn direction(name: &str, components: &[f64]) -> Result<Vec3, String> {
    unit_vector(triple(name, components)?).map_err(|error| format!("{name:?} {error}"))
}

/// Checks the three random numbers of a sample, in [0, 1). `name` is the name of their field, for messages.
///
/// # Errors
/// A number of components other than three, or a component outside the interval.
pub(crate) fn unit_cube(name: &str, components: &[f64]) -> Result<[f64; 3], String> {
    let point = triple(name, components)?;
    match point.iter().find(|c| !(0.0..1.0).contains(*c)) {
        Some(outside) => Err(format!("{name:?} holds {outside}; all must be in [0, 1)")),
        None => Ok(point),
    }
}

/// The components as an array of three. `name` is the name of their field, for messages.
fn triple(name: &str, components: &[f64]) -> Result<[f64; 3], String> {
    components.try_into().map_err(|_| format!("{name:?} has {} components; it must have 3", components.len()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn directions_are_normalised_or_refused() {
        let d = direction("wi", &[0.6004, 0.0, 0.8]).unwrap();
        assert!((d.iter().map(|c| c * c).sum::<f64>() - 1.0).abs() < 1e-15);
        for bad in [vec![0.0; 3], vec![0.0; 2], vec![0.0, 0.0, 1.002], vec![f64::NAN, 0.0, 1.0], vec![1e200; 3]] {
            assert!(direction("wi", &bad).unwrap_err().contains("\"wi\""), "{bad:?}");
        }
    }

    #[test]
    fn random_numbers_outside_the_unit_interval_are_refused() {
        assert!(unit_cube("u", &[0.0, 0.5, 0.999]).is_ok());
        assert!(unit_cube("u", &[0.0, 1.0, 0.5]).unwrap_err().contains("[0, 1)"));
        assert!(unit_cube("u", &[0.0, -1e-9, 0.5]).is_err());
    }

    #[test]
    fn errors_name_the_faulty_field() {
        #[derive(Debug, Deserialize)]
        #[serde(deny_unknown_fields)]
        struct Query {
            #[serde(rename = "wavelength")]
            _wavelength: Numbers,
        }
        let wrong = |line: &str| parse::<Query>(line.as_bytes()).unwrap_err();
        assert!(wrong("  ").contains("empty"));
        assert!(wrong("{").starts_with("not JSON"));
        assert!(wrong(r#"{"wavelength":"red"}"#).starts_with("\"wavelength\": expected a number"));
        assert!(wrong(r#"{"wave":1}"#).contains("unknown field `wave`"));
        let message = wrong(r#"{"wavelength":1e999}"#);
        assert!(message.contains("number out of range") && !message.contains("not JSON"), "{message}");
        assert!(wrong(r#"{"wavelength":1} 2"#).contains("trailing"));
        assert!(wrong("3").contains("expected struct"));
    }
}
