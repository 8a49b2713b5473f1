//! Errors of table builds.

use std::ops::RangeInclusive;
use thiserror::Error;

/// Reasons for which a table was not built.
///
/// ```
/// use sunbeam::table::TableError;
///
/// let error = TableError::OutOfRange { name: "build_limit", value: 0.5, accepted: "1 to 1e6" };
/// assert_eq!(error.to_string(), "build_limit is 0.5; accepted: 1 to 1e6");
/// ```
#[derive(Debug, PartialEq, Error)]
#[allow(missing_docs, reason = "each message describes its fields")]
pub enum TableError {
    /// The build would take more memory or time than its limits. `advice` names changes that would be allowed.
    #[error(
        "building the tables would take about {} GB and {} min on two cores, \
         and the limit is {} GB and {} min: {advice}",
        RoundNumber(*needed_gb), RoundNumber(*needed_minutes), RoundNumber(*limit_gb), RoundNumber(*limit_minutes)
    )]
    TooMuch { needed_gb: f64, needed_minutes: f64, limit_gb: f64, limit_minutes: f64, advice: String },
    /// The table would exceed the range of its 32-bit offsets. Sizes are in MB.
    #[error("the table would take {needed_mb:.0} MB, more than the {limit_mb:.0} MB that it can address")]
    TooLarge { needed_mb: f64, limit_mb: f64 },
    /// A parameter outside of its accepted range.
    #[error("{name} is {value}; accepted: {accepted}")]
    OutOfRange { name: &'static str, value: f64, accepted: &'static str },
}

impl TableError {
    /// Checks that the parameter `name` with this `value` lies in `range`, which `accepted` describes in the message.
    ///
    /// # Errors
    /// [`TableError::OutOfRange`], also for NaN.
    pub(crate) fn unless_in(
        name: &'static str,
        value: f64,
        range: RangeInclusive<f64>,
        accepted: &'static str,
    ) -> Result<(), Self> {
        if range.contains(&value) { Ok(()) } else { Err(Self::OutOfRange { name, value, accepted }) }
    }
}

/// Display of a positive number with few digits, for messages. Numbers below 0.1 read 0.1. NaN reads as a number that
/// is too large, since a build of unknown cost is refused.
struct RoundNumber(f64);

impl std::fmt::Display for RoundNumber {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self.0 {
            value if value.is_nan() || value > 1e15 => f.write_str("more than 1e15"),
            value if value >= 1e5 => write!(f, "{value:.0e}"),
            value if value >= 10.0 => write!(f, "{value:.0}"),
            value => write!(f, "{:.1}", value.max(0.1)),
        }
    }
}
