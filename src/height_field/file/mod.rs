//! Height fields in files; [`HeightField::read`] says what each format holds.

mod exr;
mod gsf;
mod npy;
mod png;
mod text;

use super::{HeightField, HeightFieldError};
use ndarray::{Array2, Axis};
use std::path::Path;

const READABLE: &str = ".exr, .png, .gsf, .npy, .txt";
const WRITABLE: &str = ".exr, .png, .gsf";

/// How far a given scale may be from the file's, relatively, before they disagree: decimal numbers of seven digits
/// and the 32-bit pixels per metre of a PNG agree within this.
const AGREEMENT: f64 = 1e-6;

/// Physical scale to go with a file that has none of its own.
///
/// Where the file has one too, both must agree to 1e-6. `max_height_um` agrees with a file in physical units if it is
/// its highest height, or its highest minus its lowest.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct FileScale {
    /// Size of the (square) pixels in µm; finite and positive.
    pub pixel_size_um: Option<f64>,
    /// Height of full scale in µm: white, or the largest integer, or the highest value (see [`HeightField::read`]);
    /// finite and positive.
    pub max_height_um: Option<f64>,
}

/// What the numbers of a file mean.
enum Values {
    /// Heights in µm.
    Micrometres,
    /// `full` stands for the largest height, 0 for height 0; the file may know the largest height in µm.
    FullScale { full: f64, max_height_um: Option<f64> },
    /// Heights in an unknown unit: the lowest becomes 0, the highest the largest height.
    Unknown,
}

/// A file as it is, in the order of its rows.
struct Raw {
    values: Array2<f64>,
    top_down: bool,
    pixel_um: Option<(f64, f64)>,
    meaning: Values,
}

/// What a parser says when the bytes are not of its format.
type Parsed = Result<Raw, String>;

impl HeightField {
    /// Reads a height field; the extension (in either case) says the format.
    ///
    /// | extension | heights | pixel size |
    /// | --- | --- | --- |
    /// | `.exr` | one float channel, µm | attributes `pixelSizeX_um`, `pixelSizeY_um`, else `pixel_size` |
    /// | `.gsf` | floats in the header's `ZUnits`; without them the lowest is 0, the highest `max_height` | `XReal`, `YReal` in `XYUnits`, else `pixel_size` |
    /// | `.png` | 8- or 16-bit grey; white is the text chunk `max_height_um`, else `max_height` | text chunks `pixel_size_x_um`, `pixel_size_y_um`, else `pHYs`, else `pixel_size` |
    /// | `.npy` | floats in µm, or 8- or 16-bit unsigned integers whose largest value is `max_height` | `pixel_size` |
    /// | `.txt` | numbers in µm, one row a line, `#` for comments | `pixel_size` |
    ///
    /// EXR, GSF and PNG are pictures: their first row is the top, hence the largest y, and they are turned over on the
    /// way in and out. `.npy` and `.txt` are matrices: row 0 is y = 0, as in [`HeightField::heights_um`]. A `pHYs` chunk of
    /// fewer than 100 000 pixels a metre (10 µm a pixel) is the resolution of a printer, not a measure, and is ignored.
    /// Rows and columns in messages count from 0 in the order of the file.
    ///
    /// # Errors
    /// A file that cannot be read, has an unknown extension, is truncated or not of its format; a scale that is missing,
    /// out of range, or contradicts the file's own; a height that is not finite.
    pub fn read(path: impl AsRef<Path>, scale: &FileScale) -> Result<Self, HeightFieldError> {
        let path = path.as_ref();
        for (parameter, value) in [("pixel_size", scale.pixel_size_um), ("max_height", scale.max_height_um)] {
            if let Some(value_um) = value.filter(|v| !(v.is_finite() && *v > 0.0)) {
                return Err(HeightFieldError::OutOfRange { parameter, value_um });
            }
        }
        type Parser = fn(&[u8]) -> Parsed;
        let (format, parse): (&'static str, Parser) = match extension(path).as_str() {
            "exr" => ("OpenEXR", exr::parse),
            "png" => ("PNG", png::parse),
            "gsf" => ("Gwyddion simple field", gsf::parse),
            "npy" => ("NumPy", npy::parse),
            "txt" => ("text", text::parse),
            found => {
                let (path, found) = (path.to_owned(), found.to_owned());
                return Err(HeightFieldError::Extension { path, found, accepted: READABLE });
            }
        };
        let bytes = std::fs::read(path).map_err(|source| HeightFieldError::Read { path: path.to_owned(), source })?;
        let raw =
            parse(&bytes).map_err(|reason| HeightFieldError::Malformed { path: path.to_owned(), format, reason })?;
        raw.into_field(path, scale)
    }

    /// Writes `.exr` (32-bit floats in µm with the pixel size), `.gsf` (32-bit floats in metres) or `.png` (16-bit grey from
    /// the lowest height, black, to the highest, white, with the scale in text chunks; the lowest height itself is lost).
    ///
    /// # Errors
    /// An extension other than these, or a file that cannot be written.
    pub fn write(&self, path: impl AsRef<Path>) -> Result<(), HeightFieldError> {
        let path = path.as_ref();
        let encoded = match extension(path).as_str() {
            "exr" => exr::encode(self),
            "png" => png::encode(self),
            "gsf" => gsf::encode(self),
            found => {
                let (path, found) = (path.to_owned(), found.to_owned());
                return Err(HeightFieldError::Extension { path, found, accepted: WRITABLE });
            }
        };
        encoded
            .and_then(|bytes| std::fs::write(path, bytes).map_err(|error| error.to_string()))
            .map_err(|reason| HeightFieldError::Write { path: path.to_owned(), reason })
    }

    /// Heights with the row of the largest y first, as pictures have them.
    fn rows_from_top(&self) -> impl Iterator<Item = f64> + '_ {
        self.heights_um.rows().into_iter().rev().flat_map(|row| row.into_iter().copied())
    }
}

fn extension(path: &Path) -> String {
    path.extension().map(|e| e.to_string_lossy().to_ascii_lowercase()).unwrap_or_default()
}

fn agree(a: f64, b: f64) -> bool {
    (a - b).abs() <= AGREEMENT * a.abs().max(b.abs())
}

impl Raw {
    fn into_field(mut self, path: &Path, scale: &FileScale) -> Result<HeightField, HeightFieldError> {
        if let Some(((row, column), &value)) = self.values.indexed_iter().find(|(_, v)| !v.is_finite()) {
            return Err(HeightFieldError::NotFiniteInFile { path: path.to_owned(), row, column, value });
        }
        let (dx, dy) = self.pixel_size(path, scale)?;
        self.scale_heights(path, scale)?;
        if self.top_down {
            self.values.invert_axis(Axis(0));
            self.values = self.values.as_standard_layout().into_owned();
        }
        HeightField::new(self.values, dx, dy)
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

#[cfg(test)]
mod tests;
