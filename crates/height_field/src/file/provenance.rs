//! Origin of a height field's size, unit, orientation, channel and missing points.

use serde::Serialize;

/// Origin of a property of a height field.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Source {
    /// Given by the file.
    File,
    /// Fixed by the format for all files.
    Format,
    /// Given by an option of the reader: `pixel_size`, `max_height`, `channel` or `fill`.
    Option,
    /// The documented default, where neither file nor option gives the property.
    Default,
    /// Inferred: missing points from isolated values (`isolated.rs`), square pixels from a single length.
    Guess,
}

/// A property as understood by the reader, and its origin.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Understood {
    /// The origin.
    pub source: Source,
    /// The property in words, with units.
    pub value: String,
}

impl Understood {
    /// A property of this value and origin.
    pub(super) fn new(source: Source, value: impl Into<String>) -> Self {
        Self { source, value: value.into() }
    }
}

/// Properties that the reader needed besides the numbers of a file, each with its origin.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Provenance {
    /// Pixel size along x and y.
    pub pixel_size: Understood,
    /// Unit of the heights, or the scale that stands in for it.
    pub height_unit: Understood,
    /// First row of the file: the top (largest y) or the bottom (y = 0).
    pub rows: Understood,
    /// Channel that was read; `None` for formats with a single one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub channel: Option<Understood>,
    /// Missing points, and how they were filled.
    pub holes: Understood,
}
