//! Height fields in files; [`HeightField::read`] says what each format holds.

mod bytes;
mod channel;
mod doubts;
mod encoding;
mod exr;
mod formats;
mod gsf;
mod gwy;
mod nanoscope;
mod npy;
mod png;
mod provenance;
mod raw;
mod sdf;
mod text;
mod tiff;
mod units;
mod x3p;

pub use doubts::Doubt;
pub use formats::{FORMATS, Format, READABLE};
pub use provenance::{Provenance, Source, Understood};

use super::{Fill, HeightField, HeightFieldError};
use raw::{Parsed, Raw, Values};
use std::path::Path;

/// Extensions of maps that the Python library SurfaceTopography reads, those of `convert.EXTENSIONS` in the Python
/// package.
const INSTRUMENTS: [&str; 36] = [
    "al3d", "apx", "bcr", "bcrf", "cur", "datx", "di", "ezd", "frt", "ibw", "jpk", "lext", "mdt", "mi", "mnt", "nc",
    "nid", "nms", "oir", "opd", "opdx", "os3d", "plu", "plux", "poir", "stp", "sur", "tmd", "tom", "top", "vk3", "vk4",
    "vk6", "vk7", "zmg", "zon",
];
/// Extensions of instruments' formats that Gwyddion reads and SurfaceTopography does not: Nanonis, RHK and WITec.
const GWYDDION: [&str; 5] = ["sxm", "sm2", "sm3", "sm4", "wip"];
const WRITABLE: &str = ".exr, .png, .gsf, .npy";

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

impl FileScale {
    fn check(&self) -> Result<(), HeightFieldError> {
        for (parameter, value) in [("pixel_size", self.pixel_size_um), ("max_height", self.max_height_um)] {
            if let Some(value_um) = value.filter(|v| !(v.is_finite() && *v > 0.0)) {
                return Err(HeightFieldError::OutOfRange { parameter, value_um });
            }
        }
        Ok(())
    }
}

/// How a file is to be read.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ReadOptions {
    /// Scale of a file that has none of its own.
    pub scale: FileScale,
    /// The channel of a file that may hold several, by number or title; by default the first that is a height.
    pub channel: Option<String>,
    /// What is put where the file has no height.
    pub fill: Fill,
}

/// A height field out of a file, and how the file was understood.
#[derive(Clone, Debug, PartialEq)]
pub struct FileField {
    /// The heights.
    pub field: HeightField,
    /// Title or number of the channel, for formats that have several.
    pub channel: Option<String>,
    /// Number of points that the file has no height for, and that were filled.
    pub filled: usize,
    /// Origin of size, unit, orientation, channel and holes; `None` for heights that come from no file.
    pub provenance: Option<Provenance>,
    /// Properties that no relief has, and that do not prevent its use.
    pub doubts: Vec<Doubt>,
}

impl FileField {
    /// Heights that come from no file.
    pub fn without_file(field: HeightField) -> Self {
        Self { field, channel: None, filled: 0, provenance: None, doubts: Vec::new() }
    }
}

impl Format {
    /// The format that the extension of `path` says.
    fn of(path: &Path) -> Result<&'static Self, HeightFieldError> {
        let found = extension(path);
        let is_number = found.len() == 3 && found.bytes().all(|byte| byte.is_ascii_digit());
        let key = if is_number { "000" } else { &found };
        if let Some(format) = FORMATS.iter().find(|format| format.extensions.contains(&key)) {
            return Ok(format);
        }
        let path = path.to_owned();
        Err(match found.as_str() {
            key if INSTRUMENTS.contains(&key) => HeightFieldError::Instrument { path, found: format!(".{found}") },
            key if GWYDDION.contains(&key) => HeightFieldError::Gwyddion { path, found: format!(".{found}") },
            _ => HeightFieldError::Extension { path, found, accepted: READABLE },
        })
    }

    /// Reads the bytes of a file; its path is for messages.
    fn read(&self, path: &Path, bytes: &[u8], options: &ReadOptions) -> Result<FileField, HeightFieldError> {
        let malformed = |reason: String| {
            // One line, whatever a library says in several.
            let reason = reason.split_whitespace().collect::<Vec<_>>().join(" ");
            HeightFieldError::Malformed { path: path.to_owned(), format: self.name, reason }
        };
        let raw = (self.parse)(bytes, options.channel.as_deref()).map_err(malformed)?;
        raw.check().map_err(malformed)?;
        raw.into_field(path, options)
    }
}

impl HeightField {
    /// Reads a height field; the extension (in either case) says the format, and [`FORMATS`] what each holds.
    ///
    /// Rows from the top are turned over, since y points up: row 0 of [`HeightField::heights_um`] is the lowest y. A
    /// `pHYs` chunk or a TIFF resolution of fewer than 100 000 pixels a metre (10 µm a pixel) is that of a printer, not
    /// a measure, and is ignored. Rows and columns in messages count from 0 in the order of the file.
    ///
    /// # Errors
    /// A file that cannot be read, has an unknown extension, is truncated or not of its format; a scale that is
    /// missing, out of range, or contradicts the file's own; a point without a height: NaN, infinite, or from ±1e30 on.
    pub fn read(path: impl AsRef<Path>, scale: &FileScale) -> Result<Self, HeightFieldError> {
        let options = ReadOptions { scale: *scale, ..Default::default() };
        Ok(Self::read_with(path, &options)?.field)
    }

    /// As [`HeightField::read`], with a choice of channel, and heights put where the file has none.
    ///
    /// # Errors
    /// As [`HeightField::read`]; a channel that is not there, is not a height, or is chosen in a format that has but
    /// one; missing heights where [`Fill::None`] is asked for, or nothing but missing heights.
    pub fn read_with(path: impl AsRef<Path>, options: &ReadOptions) -> Result<FileField, HeightFieldError> {
        let path = path.as_ref();
        options.scale.check()?;
        let format = Format::of(path)?;
        let bytes = std::fs::read(path).map_err(|source| HeightFieldError::Read { path: path.to_owned(), source })?;
        format.read(path, &bytes, options)
    }

    /// As [`HeightField::read_with`] of a file that is in memory; its name says the format, and nothing is read from
    /// there.
    ///
    /// # Errors
    /// As [`HeightField::read_with`].
    pub fn read_bytes(
        name: impl AsRef<Path>,
        bytes: &[u8],
        options: &ReadOptions,
    ) -> Result<FileField, HeightFieldError> {
        let name = name.as_ref();
        options.scale.check()?;
        Format::of(name)?.read(name, bytes, options)
    }

    /// Writes `.exr` (32-bit floats in µm with the pixel size), `.gsf` (32-bit floats in metres) or `.png` (16-bit grey
    /// from the lowest height, black, to the highest, white, with the scale in text chunks; the lowest height itself is
    /// lost), or `.npy` (64-bit floats in µm without the pixel size).
    ///
    /// # Errors
    /// An extension other than these, or a file that cannot be written.
    pub fn write(&self, path: impl AsRef<Path>) -> Result<(), HeightFieldError> {
        let path = path.as_ref();
        let encoded = match extension(path).as_str() {
            "exr" => exr::encode(self),
            "png" => png::encode(self),
            "gsf" => gsf::encode(self),
            "npy" => npy::encode(self),
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

#[cfg(test)]
mod tests;
