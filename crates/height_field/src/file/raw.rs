//! What parsers make of a file, and how it becomes a height field.

use super::{FileField, FileScale, ReadOptions};
use crate::{Fill, HeightField, HeightFieldError};
use ndarray::{Array2, Axis};
use std::path::Path;

/// How far a given scale may be from the file's, relatively, before they disagree: decimal numbers of seven digits
/// and the 32-bit pixels per metre of a PNG agree within this.
const AGREEMENT: f64 = 1e-6;

/// What the numbers of a file mean.
pub(super) enum Values {
    /// Heights in µm.
    Micrometres,
    /// `full` stands for the largest height, 0 for height 0; the file may know the largest height in µm.
    FullScale { full: f64, max_height_um: Option<f64> },
    /// Heights in an unknown unit: the lowest becomes 0, the highest the largest height.
    Unknown,
}

/// Numbers from here on are no heights in any unit: programs write them where an instrument measured nothing.
const NO_HEIGHT: f64 = 1e30;

/// A number as a file holds it; NaN where it says that there is no height.
pub(crate) fn known(stored: f64) -> f64 {
    // Written so that infinities and NaN are none either.
    if stored.abs() < NO_HEIGHT { stored } else { f64::NAN }
}

/// A file as it is, in the order of its rows. NaN says that there is no height, whatever the format says it with.
pub(super) struct Raw {
    pub values: Array2<f64>,
    pub top_down: bool,
    pub pixel_um: Option<(f64, f64)>,
    pub meaning: Values,
    /// The channel that was read, for formats that have several.
    pub channel: Option<String>,
}

/// What a parser says when the bytes are not of its format.
pub(super) type Parsed = Result<Raw, String>;

fn agree(a: f64, b: f64) -> bool {
    (a - b).abs() <= AGREEMENT * a.abs().max(b.abs())
}

impl Raw {
    /// Refuses what a file may say and no surface can be.
    pub fn check(&self) -> Result<(), String> {
        if self.values.is_empty() {
            return Err("it holds no points".to_owned());
        }
        match self.pixel_um {
            Some((dx, dy)) if !(dx.is_finite() && dx > 0.0 && dy.is_finite() && dy > 0.0) => {
                Err(format!("its pixels are {dx} × {dy} µm; both must be finite and positive"))
            }
            _ => Ok(()),
        }
    }

    /// The height field, scaled, filled, and with its first row at the bottom.
    pub fn into_field(mut self, path: &Path, options: &ReadOptions) -> Result<FileField, HeightFieldError> {
        // Parsers that scale numbers have looked at them before; what a scale made too large is no height either.
        self.values.mapv_inplace(known);
        let mut missing = self.values.indexed_iter().filter(|(_, v)| v.is_nan()).map(|(at, _)| at);
        let first = missing.next();
        let filled = first.map_or(0, |_| 1 + missing.count());
        let total = self.values.len();
        if let Some((row, column)) = first.filter(|_| options.fill == Fill::None || filled == total) {
            return Err(HeightFieldError::Missing { path: path.to_owned(), count: filled, total, row, column });
        }
        let (dx, dy) = self.pixel_size(path, &options.scale)?;
        self.scale_heights(path, &options.scale)?;
        if self.top_down {
            self.values.invert_axis(Axis(0));
            self.values = self.values.as_standard_layout().into_owned();
        }
        options.fill.apply(&mut self.values, dx, dy);
        Ok(FileField { field: HeightField::new(self.values, dx, dy)?, channel: self.channel, filled })
    }

    fn pixel_size(&self, path: &Path, scale: &FileScale) -> Result<(f64, f64), HeightFieldError> {
        let (parameter, path) = ("pixel_size", path.to_owned());
        match (self.pixel_um, scale.pixel_size_um) {
            (None, None) => Err(HeightFieldError::MissingScale { path, parameter, what: "pixel size" }),
            (None, Some(given)) => Ok((given, given)),
            (Some(own), None) => Ok(own),
            (Some((dx, dy)), Some(given_um)) => match [dx, dy].into_iter().find(|own| !agree(*own, given_um)) {
                Some(file_um) => Err(HeightFieldError::ScaleDisagrees { path, parameter, given_um, file_um }),
                None => Ok((dx, dy)),
            },
        }
    }

    fn scale_heights(&mut self, path: &Path, scale: &FileScale) -> Result<(), HeightFieldError> {
        let parameter = "max_height";
        let missing = |what| HeightFieldError::MissingScale { path: path.to_owned(), parameter, what };
        let (low, high) =
            self.values.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(lo, hi), &v| (lo.min(v), hi.max(v)));
        let check = |own: &[f64]| match scale.max_height_um {
            Some(given_um) if !own.iter().any(|value| agree(*value, given_um)) => {
                Err(HeightFieldError::ScaleDisagrees { path: path.to_owned(), parameter, given_um, file_um: own[0] })
            }
            _ => Ok(()),
        };
        match self.meaning {
            Values::Micrometres => check(&[high, high - low])?,
            Values::FullScale { full, max_height_um } => {
                if let Some(own) = max_height_um {
                    check(&[own])?;
                }
                let top = max_height_um.or(scale.max_height_um).ok_or_else(|| missing("height of full scale"))?;
                self.values.mapv_inplace(|v| v / full * top);
            }
            Values::Unknown => {
                let top = scale.max_height_um.ok_or_else(|| missing("unit of height"))?;
                let range = if high > low { high - low } else { 1.0 };
                self.values.mapv_inplace(|v| (v - low) / range * top);
            }
        }
        Ok(())
    }
}
