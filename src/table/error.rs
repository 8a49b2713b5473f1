use super::estimate::Rough;
use std::ops::RangeInclusive;
use thiserror::Error;

/// Why tables were not built.
#[derive(Debug, PartialEq, Error)]
#[allow(missing_docs, reason = "each message describes its fields")]
pub enum TableError {
    /// The build would take more memory, in GB, or more time, in minutes on two cores, than its limit allows.
    #[error(
        "building the tables would take about {} GB and {} min on two cores, and the limit is {} GB and {} min: {advice}",
        Rough(*needed_gb), Rough(*needed_minutes), Rough(*limit_gb), Rough(*limit_minutes)
    )]
    TooMuch { needed_gb: f64, needed_minutes: f64, limit_gb: f64, limit_minutes: f64, advice: String },
    /// A table that 32-bit offsets cannot address.
    #[error("the table would take {needed_mb:.0} MB, more than the {limit_mb:.0} MB that it can address")]
    TooLarge { needed_mb: f64, limit_mb: f64 },
    #[error("{name} is {value}; accepted: {accepted}")]
    OutOfRange { name: &'static str, value: f64, accepted: &'static str },
}

impl TableError {
    /// Refuses a number out of range, and says what is accepted.
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
