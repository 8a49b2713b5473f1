//! Errors of building and writing a snake.

use std::{io, path::PathBuf};

use thiserror::Error;

/// Reason why a snake could not be built or written. The messages about options name the wrong value and the accepted
/// ones.
#[derive(Debug, Error)]
pub enum SnakeError {
    /// A whole number out of range.
    #[error("{field} is {found}; it must be between {least} and {most}")]
    Count {
        /// Name of the option or parameter.
        field: &'static str,
        /// The refused value.
        found: usize,
        /// The least accepted value.
        least: usize,
        /// The greatest accepted value.
        most: usize,
    },
    /// A number out of range.
    #[error("{field} is {found}; it must be between {least} and {most}")]
    Number {
        /// Name of the option.
        field: &'static str,
        /// The refused value.
        found: f64,
        /// The least accepted value.
        least: f64,
        /// The greatest accepted value.
        most: f64,
    },
    /// The bend is so sharp that the body would run into itself.
    #[error(
        "the body bends with a radius of {radius_cm:.2} cm; it must be at least {least_cm:.2} cm: use a smaller bend \
         or a longer body"
    )]
    Bend {
        /// The smallest radius of curvature of the centreline, in cm.
        radius_cm: f64,
        /// The least accepted radius, in cm.
        least_cm: f64,
    },
    /// A file that could not be written.
    #[error("cannot write {path}: {source}")]
    Write {
        /// The file.
        path: PathBuf,
        /// The error of the operating system.
        source: io::Error,
    },
    /// The PNG encoder failed.
    #[error("cannot encode {path} as PNG: {source}")]
    Png {
        /// The file.
        path: PathBuf,
        /// The error of the encoder.
        source: png::EncodingError,
    },
}
