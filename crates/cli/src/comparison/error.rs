use std::path::PathBuf;
use thiserror::Error;

/// Why two pictures were not compared.
#[derive(Debug, Error)]
#[non_exhaustive]
#[allow(missing_docs)] // Each message says what its fields are.
pub enum CompareError {
    /// A picture or a mask of another size than the first picture.
    #[error("the {what} has {} x {} pixels, but the first picture has {} x {}; both must have the same size",
        found.0, found.1, expected.0, expected.1)]
    Size { what: &'static str, expected: (usize, usize), found: (usize, usize) },
    /// No pixels, more than FLIP can index, or not as many as the size says.
    #[error("a picture of {} x {} pixels with {found} values cannot be compared; accepted are 1 to 2^28 pixels, as many as the size says",
        size.0, size.1)]
    Shape { size: (usize, usize), found: usize },
    /// A channel that is NaN or infinite. Rows and columns count from 0 at the top left.
    #[error("the pixel at column {column}, row {row} has {channel} = {value}; every channel must be finite")]
    NotFinite { column: usize, row: usize, channel: char, value: f32 },
    /// Every pixel is masked out.
    #[error("the mask leaves no pixel to compare; it must be above 0 somewhere")]
    NothingLeft,
    /// An exposure that shows nothing.
    #[error("the exposure is {stops} stops, but must be in [-100, 100]")]
    Exposure { stops: f64 },
    /// A file cannot be read as what it is meant to be.
    #[error("{}: {reason}", path.display())]
    File { path: PathBuf, reason: String },
}

impl CompareError {
    /// Adds the file's name to what is wrong with its contents.
    pub(super) fn in_file(self, path: &std::path::Path) -> Self {
        Self::File { path: path.to_owned(), reason: self.to_string() }
    }
}
