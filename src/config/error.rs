//! The error of a configuration, and the accepted values that its messages name.

use super::{BODY_ETA, COVER_ETA, ETA, K, RELATIVE_SIZE};
use crate::height_field::{MAX_LENGTH_UM, REGION_SIZE_UM, REGION_SPREAD};
use crate::table::{BUILD_LIMIT, COHERENCE_LENGTH_UM, TOLERANCE};
use std::fmt;

/// Reason why a configuration is refused. Messages about a parameter name it, with the value found and the accepted
/// values, or with the parameter that it contradicts.
///
/// ```
/// use sunbeam::config::{ConfigError, SurfaceConfig};
///
/// let error = SurfaceConfig::from_json(r#"{"tolerance": 2}"#).unwrap_err();
/// assert!(matches!(error, ConfigError::OutOfRange { parameter: "tolerance", .. }));
/// assert_eq!(error.to_string(), "parameter \"tolerance\" is 2, but must be a relative error in [1e-6, 1e-1]");
/// ```
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[allow(missing_docs, reason = "each message describes its fields")]
pub enum ConfigError {
    #[error("parameter {parameter:?} is {found}, but must be {accepted}")]
    OutOfRange { parameter: &'static str, found: f64, accepted: Accepted },
    #[error(
        "parameter {parameter:?} is {found} µm, but must be {accepted}: no relief that diffracts is so large. Lengths \
         are in µm; was it meant in nm?"
    )]
    TooLong { parameter: &'static str, found: f64, accepted: Accepted },
    #[error("parameter {parameter:?} contradicts {other}: {advice}")]
    Contradiction { parameter: &'static str, other: String, advice: &'static str },
    /// A value of the wrong type, an unknown name in a list of choices, or an unknown parameter.
    #[error("parameter {parameter:?}: {reason}")]
    Malformed { parameter: String, reason: String },
    #[error("the configuration is not valid JSON: {0}")]
    Syntax(String),
}

/// Kind of a number with its accepted range, for messages.
#[derive(Clone, Debug, PartialEq)]
pub enum Accepted {
    /// A length in µm, positive and at most [`MAX_LENGTH_UM`].
    Length,
    /// A coherence length in µm, [`COHERENCE_LENGTH_UM`].
    CoherenceLength,
    /// The real part of an index, [`ETA`].
    Eta,
    /// The imaginary part of an index, [`K`].
    K,
    /// The index of a cover, [`COVER_ETA`].
    CoverEta,
    /// The index of a body that transmits: 1, or in [`BODY_ETA`].
    BodyEta,
    /// A relative error of tables, [`TOLERANCE`].
    Tolerance,
    /// A factor on the memory and time of a build, [`BUILD_LIMIT`].
    BuildLimit,
    /// A size relative to the relief given, [`RELATIVE_SIZE`].
    RelativeSize,
    /// The edge of a sub-region of a skin in µm, [`REGION_SIZE_UM`].
    RegionSize,
    /// The relative spread of the spatial frequency over sub-regions, [`REGION_SPREAD`].
    RegionSpread,
}

impl fmt::Display for Accepted {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (kind, range) = match self {
            Self::Length => return write!(f, "a length in µm in (0, {MAX_LENGTH_UM:e}]"),
            Self::CoherenceLength => ("a length in µm", COHERENCE_LENGTH_UM),
            Self::Eta => ("the real part of a refractive index", ETA),
            Self::K => ("the imaginary part of a refractive index", K),
            Self::BodyEta => ("the index of a body that transmits: 1, or", BODY_ETA),
            Self::CoverEta => ("the index of a cover", COVER_ETA),
            Self::Tolerance => ("a relative error", TOLERANCE),
            Self::BuildLimit => ("a factor", BUILD_LIMIT),
            Self::RelativeSize => ("a size relative to the relief given", RELATIVE_SIZE),
            Self::RegionSize => ("a length in µm", REGION_SIZE_UM),
            Self::RegionSpread => ("a relative spread", REGION_SPREAD),
        };
        write!(f, "{kind} in [{:e}, {:e}]", range.start(), range.end())
    }
}
