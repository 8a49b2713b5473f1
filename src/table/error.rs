use thiserror::Error;

/// Why tables were not built.
#[derive(Debug, PartialEq, Error)]
pub enum TableError {
    #[error(
        "the tables would take {needed_mb:.0} MB, more than the {limit_mb:.0} MB allowed; use a larger tolerance, \
         a smaller tile, or coarser pixels"
    )]
    TooLarge { needed_mb: f64, limit_mb: f64 },
    #[error("{name} is {value}; accepted: {accepted}")]
    OutOfRange { name: &'static str, value: f64, accepted: &'static str },
}
