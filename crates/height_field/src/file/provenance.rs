//! Where the size, unit, orientation, channel and holes of a height field were taken from.

use serde::Serialize;

/// Origin of a property of a height field.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Source {
    /// The file says it.
    File,
    /// The format fixes it for all of its files.
    Format,
    /// An option of the reader: `pixel_size`, `max_height`, `channel` or `fill`.
    Option,
    /// Neither file nor option says it: the documented default.
    Default,
    /// The values suggest it, and nothing else says it.
    Guess,
}

/// A property as it was understood, in words, and its origin.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Understood {
    /// The origin.
    pub source: Source,
    /// The property in words, with units.
    pub value: String,
}

impl Understood {
    pub(super) fn new(source: Source, value: impl Into<String>) -> Self {
        Self { source, value: value.into() }
    }
}

/// Everything that a reader had to know of a file beside its numbers.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Provenance {
    /// Pixel size along x and y.
    pub pixel_size: Understood,
    /// Unit of the heights, or the scale that stands in for it.
    pub height_unit: Understood,
    /// Row that comes first in the file: the top (largest y) or the bottom (y = 0).
    pub rows: Understood,
    /// Channel that was read; `None` for formats with a single one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub channel: Option<Understood>,
    /// Points without a height, and how they were filled.
    pub holes: Understood,
}
