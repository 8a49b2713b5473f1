//! Warnings (*doubts*) about implausible reliefs: metres taken for µm, elongated pixels, missing points written as
//! numbers.

use crate::HeightField;
use std::fmt;

/// Peak to valley in µm below which a relief is implausible: 0.05 nm, less than an atom. Heights in metres that were
/// taken for µm are below it, for reliefs of up to 50 µm. A larger limit would doubt polished surfaces.
const PEAK_TO_VALLEY_MIN_UM: f64 = 5e-5;
/// Largest plausible ratio of a pixel's sides. Scans with fewer lines than points in each line have a ratio of 2 or 4.
const PIXEL_RATIO_MAX: f64 = 4.0;

/// An implausible property of a height field that does not prevent its use.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum Doubt {
    /// A range of heights of less than 0.05 nm.
    Shallow {
        /// Highest minus lowest height in µm.
        peak_to_valley_um: f64,
    },
    /// Pixels with one side more than four times the other.
    LongPixels {
        /// Size along x in µm.
        dx_um: f64,
        /// Size along y in µm.
        dy_um: f64,
    },
    /// A number far from all other values (`src/isolated.rs`), which was taken for missing points.
    Isolated {
        /// The number as stored in the file, before the scale to µm.
        value: f64,
        /// Number of points with this number.
        count: usize,
    },
}

impl fmt::Display for Doubt {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Shallow { peak_to_valley_um } => write!(
                f,
                "heights range over {} nm, less than an atom: was the file in metres, and taken for µm?",
                peak_to_valley_um * 1e3
            ),
            Self::LongPixels { dx_um, dy_um } => {
                write!(f, "pixels are {dx_um} × {dy_um} µm, far from square: are the sizes along x and y right?")
            }
            Self::Isolated { value, count } => {
                write!(f, "{count} points are {value}, isolated from all heights: taken for missing points")
            }
        }
    }
}

/// Doubts that follow from a field's pixel size and range of heights. `raw.rs` adds [`Doubt::Isolated`].
pub(super) fn about(field: &HeightField) -> Vec<Doubt> {
    let (low, high) = field.range_um();
    let (dx_um, dy_um) = (field.dx_um(), field.dy_um());
    let mut doubts = Vec::new();
    // A flat field is a mirror, and plausible.
    if high > low && high - low < PEAK_TO_VALLEY_MIN_UM {
        doubts.push(Doubt::Shallow { peak_to_valley_um: high - low });
    }
    // A single row or column, as of a grating, may be of any width.
    let (nx, ny) = field.size();
    if nx > 1 && ny > 1 && dx_um.max(dy_um) > PIXEL_RATIO_MAX * dx_um.min(dy_um) {
        doubts.push(Doubt::LongPixels { dx_um, dy_um });
    }
    doubts
}
