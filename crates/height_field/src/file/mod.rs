//! Height fields from and to files. [`FORMATS`] describes every format.
//!
//! Each format has a parser (`exr.rs`, `gwy.rs`, …) from bytes to a [`Raw`]: numbers in the order of the file's rows,
//! with their unit and pixel size as far as the file says. `raw.rs` turns a [`Raw`] into a height field: scale,
//! orientation and missing points, and the origin of each property.
//!
//! In all parsers `channel_option` is the option `channel` (number or title, `channel.rs`); `None` if it is not given.
//! *Full scale* is the stored number of the largest height, such as 255. Errors are texts that complete "not a usable …
//! height field: ".

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
use raw::{Meaning, Parsed, Raw};
use std::path::Path;

/// Extensions of files that the Python library SurfaceTopography reads; equal to `convert.EXTENSIONS` of the Python
/// package. `tests/test_formats.py` checks that none of the Python package's is missing here.
const INSTRUMENTS: [&str; 36] = [
    "al3d", "apx", "bcr", "bcrf", "cur", "datx", "di", "ezd", "frt", "ibw", "jpk", "lext", "mdt", "mi", "mnt", "nc",
    "nid", "nms", "oir", "opd", "opdx", "os3d", "plu", "plux", "poir", "stp", "sur", "tmd", "tom", "top", "vk3", "vk4",
    "vk6", "vk7", "zmg", "zon",
];
/// Extensions of instruments' files that Gwyddion reads but SurfaceTopography does not: Nanonis, RHK and WITec.
const GWYDDION: [&str; 5] = ["sxm", "sm2", "sm3", "sm4", "wip"];
/// Extensions of the formats that [`HeightField::write`] writes, for messages.
const WRITABLE: &str = ".exr, .png, .gsf, .npy";

/// Physical scale for a file that has none of its own.
///
/// If the file has a scale, too, the two must agree to a relative 1e-6. For a file with heights in a unit of length,
/// `max_height_um` must be the highest height, or the highest minus the lowest height.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct FileScale {
    /// Size of the (square) pixels in µm; finite and positive.
    pub pixel_size_um: Option<f64>,
    /// Height of full scale in µm, finite and positive. Full scale is white, the largest integer of the type, or the
    /// highest value (see `unit` in [`FORMATS`]).
    pub max_height_um: Option<f64>,
}

impl FileScale {
    /// Refuses scales that are not finite and positive.
    fn check(&self) -> Result<(), HeightFieldError> {
        for (parameter, value) in [("pixel_size", self.pixel_size_um), ("max_height", self.max_height_um)] {
            if let Some(value_um) = value.filter(|v| !(v.is_finite() && *v > 0.0)) {
                return Err(HeightFieldError::OutOfRange { parameter, value_um });
            }
        }
        Ok(())
    }
}

/// Options of [`HeightField::read_with`].
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ReadOptions {
    /// Scale of a file that has none of its own.
    pub scale: FileScale,
    /// Number or title of the channel, for formats with several; by default the first channel of heights.
    pub channel: Option<String>,
    /// Heights for missing points.
    pub fill: Fill,
}

/// A height field from a file, and how the file was understood.
#[derive(Clone, Debug, PartialEq)]
pub struct FileField {
    /// The heights.
    pub field: HeightField,
    /// Title or number of the channel; `None` for formats with a single one.
    pub channel: Option<String>,
    /// Number of missing points that were filled.
    pub filled: usize,
    /// Origin of size, unit, orientation, channel and missing points; `None` for heights without a file.
    pub provenance: Option<Provenance>,
    /// Implausible properties of the relief; they do not prevent its use.
    pub doubts: Vec<Doubt>,
}

impl FileField {
    /// Wraps heights of another origin than a file.
    pub fn without_file(field: HeightField) -> Self {
        Self { field, channel: None, filled: 0, provenance: None, doubts: Vec::new() }
    }
}

impl Format {
    /// The format of a path, by its extension.
    ///
    /// # Errors
    /// An extension of no readable format. For an instrument's extension, the error names a program that converts it.
    fn of(path: &Path) -> Result<&'static Self, HeightFieldError> {
        let found = extension(path);
        // NanoScope numbers its files: .000, .001, and so on.
        let is_number = found.len() == 3 && found.bytes().all(|byte| byte.is_ascii_digit());
        let key = if is_number { "000" } else { &found };
        if let Some(format) = FORMATS.iter().find(|format| format.extensions.contains(&key)) {
            return Ok(format);
        }
        let path = path.to_owned();
        Err(match found.as_str() {
            name if INSTRUMENTS.contains(&name) => HeightFieldError::Instrument { path, found: format!(".{found}") },
            name if GWYDDION.contains(&name) => HeightFieldError::Gwyddion { path, found: format!(".{found}") },
            _ => HeightFieldError::Extension { path, found, accepted: READABLE },
        })
    }

    /// Reads a file's bytes; `path` appears in messages.
    fn read(&self, path: &Path, bytes: &[u8], options: &ReadOptions) -> Result<FileField, HeightFieldError> {
        let malformed = |reason: String| {
            // Messages of libraries may have several lines; errors have one.
            let reason = reason.split_whitespace().collect::<Vec<_>>().join(" ");
            HeightFieldError::Malformed { path: path.to_owned(), format: self.name, reason }
        };
        let raw = (self.parse)(bytes, options.channel.as_deref()).map_err(malformed)?;
        raw.check().map_err(malformed)?;
        raw.into_field(path, options)
    }
}

impl HeightField {
    /// Reads a height field from a file. Its extension, in either case, tells the format; [`FORMATS`] describes each.
    ///
    /// y points up: row 0 of [`HeightField::heights_um`] has the lowest y, so files that begin with the top row are
    /// flipped. Rows and columns in messages count from 0 in the order of the file. A resolution of a PNG or TIFF below
    /// 100 000 pixels a metre (10 µm a pixel) is that of a printer, and is ignored.
    ///
    /// ```
    /// use sunbeam_height_field::{FileScale, HeightField, Preset};
    ///
    /// let folder = tempfile::tempdir()?;
    /// let path = folder.path().join("blazed.gsf");
    /// let blazed = Preset::Blazed.build(None, None)?;
    /// blazed.write(&path)?;
    /// // A .gsf file carries its scale.
    /// let read = HeightField::read(&path, &FileScale::default())?;
    /// assert!((read.extent_um().0 - 2.5).abs() < 1e-9);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// A file that cannot be read, has an unknown extension, or is damaged; a scale that is missing, out of range, or
    /// contradicts the file's own; missing points (NaN, infinite, of magnitude 1e30 or more, marked by the format, or a
    /// number isolated from all heights, such as −9999).
    pub fn read(path: impl AsRef<Path>, scale: &FileScale) -> Result<Self, HeightFieldError> {
        let options = ReadOptions { scale: *scale, ..Default::default() };
        Ok(Self::read_with(path, &options)?.field)
    }

    /// Variant of [`HeightField::read`] with a choice of channel and of heights for missing points.
    ///
    /// ```
    /// use sunbeam_height_field::{FileScale, Fill, HeightField, ReadOptions, Source};
    ///
    /// let folder = tempfile::tempdir()?;
    /// let path = folder.path().join("scan.txt");
    /// std::fs::write(&path, "0.0 0.1 0.2 0.3\n0.1 nan 0.3 0.4\n0.2 0.3 0.4 0.5\n")?;
    /// let scale = FileScale { pixel_size_um: Some(0.05), max_height_um: None };
    /// let read = HeightField::read_with(&path, &ReadOptions { scale, fill: Fill::Laplace, channel: None })?;
    /// assert_eq!((read.field.size(), read.filled), ((4, 3), 1));
    /// assert!(read.doubts.is_empty());
    /// assert_eq!(read.provenance.unwrap().pixel_size.source, Source::Option);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// The errors of [`HeightField::read`]; a channel that does not exist, is not a height, or is given for a format
    /// with a single channel; missing points with [`Fill::None`], or a file without any height.
    pub fn read_with(path: impl AsRef<Path>, options: &ReadOptions) -> Result<FileField, HeightFieldError> {
        let path = path.as_ref();
        options.scale.check()?;
        let format = Format::of(path)?;
        let bytes = std::fs::read(path).map_err(|reason| HeightFieldError::Read { path: path.to_owned(), reason })?;
        format.read(path, &bytes, options)
    }

    /// Variant of [`HeightField::read_with`] for a file in memory. The extension of `name` tells the format; no file is
    /// opened.
    ///
    /// # Errors
    /// The errors of [`HeightField::read_with`].
    pub fn read_bytes(
        name: impl AsRef<Path>,
        bytes: &[u8],
        options: &ReadOptions,
    ) -> Result<FileField, HeightFieldError> {
        let name = name.as_ref();
        options.scale.check()?;
        Format::of(name)?.read(name, bytes, options)
    }

    /// Writes a file in the format of its extension:
    ///
    /// - `.exr`: 32-bit floats in µm, with the pixel size;
    /// - `.gsf`: 32-bit floats in metres, with the pixel size;
    /// - `.npy`: 64-bit floats in µm, without the pixel size;
    /// - `.png`: 16-bit grey from the lowest height (black) to the highest (white), with range and pixel size in text
    ///   chunks. The lowest height itself is not kept.
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

    /// Heights row by row from the largest y, the order of pictures.
    fn rows_from_top(&self) -> impl Iterator<Item = f64> + '_ {
        self.heights_um.rows().into_iter().rev().flat_map(|row| row.into_iter().copied())
    }
}

/// Extension in lower case without the dot; empty where there is none.
fn extension(path: &Path) -> String {
    path.extension().map(|e| e.to_string_lossy().to_ascii_lowercase()).unwrap_or_default()
}

#[cfg(test)]
mod tests;
