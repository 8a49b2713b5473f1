//! Properties that no relief has: metres taken for µm, pixels out of proportion, missing points written as numbers.

use crate::HeightField;
use std::fmt;

/// Peak to valley in µm below which a relief is smoother than any surface: a tenth of an atom. Metres that are taken
/// for µm end up there.
const PEAK_TO_VALLEY_MIN_UM: f64 = 5e-5;
/// Ratio of a pixel's sides from which it is told. Scans with fewer lines than points stay at 2 or 4.
const PIXEL_RATIO_MAX: f64 = 4.0;
/// Something about a height field that no relief has, but that does not prevent its use.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum Doubt {
    /// Heights that range over less than a tenth of an atom, in µm.
    Shallow {
        /// Highest minus lowest height in µm.
        peak_to_valley_um: f64,
    },
    /// Pixels with a side more than four times the other, in µm.
    LongPixels {
        /// Size along x in µm.
        dx_um: f64,
        /// Size along y in µm.
        dy_um: f64,
    },
    /// A number that stands isolated from all heights and was filled as a missing point.
    Isolated {
        /// The number as the file has it.
        value: f64,
        /// Points that have it.
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

/// Doubts about a whole field.
pub(super) fn about(field: &HeightField) -> Vec<Doubt> {
    let (low, high) = field.range_um();
    let (dx_um, dy_um) = (field.dx_um(), field.dy_um());
    let mut doubts = Vec::new();
    // A flat field is a mirror, which is meant.
    if high > low && high - low < PEAK_TO_VALLEY_MIN_UM {
        doubts.push(Doubt::Shallow { peak_to_valley_um: high - low });
    }
    // A grating may be a single row, as wide as its period.
    let (nx, ny) = field.size();
    if nx > 1 && ny > 1 && dx_um.max(dy_um) > PIXEL_RATIO_MAX * dx_um.min(dy_um) {
        doubts.push(Doubt::LongPixels { dx_um, dy_um });
    }
    doubts
}
