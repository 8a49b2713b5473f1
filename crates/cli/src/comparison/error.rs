//! Errors of a comparison.

use std::path::{Path, PathBuf};
use thiserror::Error;

/// The reason why two pictures cannot be compared.
#[derive(Debug, Error)]
pub(crate) enum CompareError {
    /// A picture or a mask, named by `what`, whose size (width, height) differs from the first picture's.
    #[error("the {what} has {} x {} pixels, but the first picture has {} x {}; both must have the same size",
        found.0, found.1, expected.0, expected.1)]
    Size { what: &'static str, expected: (usize, usize), found: (usize, usize) },
    /// A picture without pixels, with more than FLIP can index (`PIXELS_MAX` in picture.rs), or a picture or mask whose
    /// `found` pixels do not fill its size.
    #[error(
        "a picture of {} x {} pixels with {found} values cannot be compared; it must have 1 to 2^28 pixels and a value \
         for each",
        size.0, size.1)]
    Shape { size: (usize, usize), found: usize },
    /// A pixel's channel ('R', 'G' or 'B') that is NaN or infinite. Columns and rows count from 0 at the top left.
    #[error("the pixel at column {column}, row {row} has {channel} = {value}; every channel must be finite")]
    NotFinite { column: usize, row: usize, channel: char, value: f32 },
    /// A mask that excludes every pixel.
    #[error("the mask leaves no pixel to compare; it must be above 0 somewhere")]
    NothingLeft,
    /// An exposure in stops (powers of two) that is not finite, or beyond ±`STOPS_MAX` (mod.rs).
    #[error("the exposure is {stops} stops, but must be in [-100, 100]")]
    Exposure { stops: f64 },
    /// A file that cannot be read, or whose format or contents are wrong.
    #[error("{}: {reason}", path.display())]
    File { path: PathBuf, reason: String },
}

impl CompareError {
    /// [`CompareError::File`] with this message and the path of the file whose contents are wrong.
    pub(super) fn in_file(self, path: &Path) -> Self {
        Self::File { path: path.to_owned(), reason: self.to_string() }
    }
}
