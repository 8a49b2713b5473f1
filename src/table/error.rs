//! Errors of building tables.

use super::advice::RoundNumber;
use std::ops::RangeInclusive;
use thiserror::Error;

/// Reason why a table is not built.
///
/// ```
/// use sunbeam::{Options, Preset, Surface};
///
/// let field = Preset::Blazed.build(None, None)?;
/// let error = Surface::new(&field, &Options { tolerance: 1.0, ..Options::default() }).err();
/// assert_eq!(error.map(|error| error.to_string()).as_deref(), Some("tolerance is 1; accepted: 1e-6 to 0.1"));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, PartialEq, Error)]
#[allow(missing_docs, reason = "each message describes its fields")]
pub enum TableError {
    /// The build needs more memory (GB) or time (minutes on two cores) than its limit.
    #[error(
        "building the tables would take about {} GB and {} min on two cores, and the limit is {} GB and {} min: {advice}",
        RoundNumber(*needed_gb), RoundNumber(*needed_minutes), RoundNumber(*limit_gb), RoundNumber(*limit_minutes)
    )]
    TooMuch { needed_gb: f64, needed_minutes: f64, limit_gb: f64, limit_minutes: f64, advice: String },
    /// The table is larger than 32-bit offsets can address.
    #[error("the table would take {needed_mb:.0} MB, more than the {limit_mb:.0} MB that it can address")]
    TooLarge { needed_mb: f64, limit_mb: f64 },
    /// An option is out of range.
    #[error("{name} is {value}; accepted: {accepted}")]
    OutOfRange { name: &'static str, value: f64, accepted: &'static str },
}

impl TableError {
    /// Checks that an option is in range; `accepted` describes the range for the message.
    ///
    /// # Errors
    /// [`TableError::OutOfRange`].
    pub(crate) fn unless_in(
        name: &'static str,
        value: f64,
        range: RangeInclusive<f64>,
        accepted: &'static str,
    ) -> Result<(), Self> {
        if range.contains(&value) { Ok(()) } else { Err(Self::OutOfRange { name, value, accepted }) }
    }
}
