//! Surface data files (`.sdf`) of ISO 25178-71, versions 1.0 and 2.0, and of its predecessor, the proposal of the
//! European Community Bureau of Reference (BCR). Both are in text or in binary.
//!
//! A *profile* is a row of points along x.
//!
//! - ISO: the first profile lies at y = 0. Missing points are the smallest number of the type or, in text, `BAD`.
//! - BCR: the direction of y is undefined; programs show files with the first profile at the top, and so does this
//!   reader. Missing points are the largest number of the type.

use super::bytes::{Bytes, Number, data_length};
use super::raw::FirstRow;
use super::units::UM_PER_M;
use super::{Meaning, Parsed, Raw, channel, encoding};
use crate::holes::known_or_nan;
use ndarray::Array2;
use std::collections::HashMap;

/// Data types in the order of their codes 0 to 7, with their names in BCR's text headers.
const TYPES: [(&str, Number); 8] = [
    ("UCHAR", Number::U8),
    ("UINTEGER", Number::U16),
    ("ULONGINT", Number::U32),
    ("FLOAT", Number::F32),
    ("CHAR", Number::I8),
    ("INTEGER", Number::I16),
    ("LONGINT", Number::I32),
    ("DOUBLE", Number::F64),
];

/// Revision of the format, from the first bytes of a file.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Revision {
    /// ISO 25178-71, version 1.0.
    Iso1,
    /// ISO 25178-71, version 2.0: its numbers of points have 32 bits; those of the others have 16.
    Iso2,
    /// The BCR proposal.
    Bcr,
}

/// Properties of the stored heights that text and binary headers share.
struct Header {
    revision: Revision,
    /// Points in a profile, along x.
    nx: usize,
    /// Profiles, along y.
    ny: usize,
    /// Spacing along x in metres.
    dx_m: f64,
    /// Spacing along y in metres.
    dy_m: f64,
    /// Height in metres of a stored number of 1.
    z_m: f64,
    /// Type of the stored numbers.
    number: Number,
}

impl Header {
    /// Whether a stored number marks a missing point.
    fn is_missing(&self, value: f64) -> bool {
        // In any file, numbers that are NaN, infinite or of magnitude 1e30 or more are missing.
        if known_or_nan(value).is_nan() {
            return true;
        }
        // The smallest number of the type, the mark of ISO, and the largest, that of BCR.
        let (low, high) = match self.number {
            Number::U8 => (0.0, f64::from(u8::MAX)),
            Number::U16 => (0.0, f64::from(u16::MAX)),
            Number::U32 => (0.0, f64::from(u32::MAX)),
            Number::I8 => (f64::from(i8::MIN), f64::from(i8::MAX)),
            Number::I16 => (f64::from(i16::MIN), f64::from(i16::MAX)),
            Number::I32 => (f64::from(i32::MIN), f64::from(i32::MAX)),
            // The smallest and largest floats exceed 1e30 in magnitude, so they were handled above.
            Number::F32 | Number::F64 => return false,
        };
        if self.revision == Revision::Bcr { value >= high } else { value == low }
    }

    /// Contents from the stored numbers.
    fn raw(self, stored: Vec<f64>) -> Parsed {
        // The height of a stored number of 1.
        let unit = format!("{} m", self.z_m);
        let meaning = Meaning::in_unit(&unit, self.z_m * UM_PER_M);
        let heights = stored.iter().map(|&value| if self.is_missing(value) { f64::NAN } else { value });
        let values =
            Array2::from_shape_vec((self.ny, self.nx), heights.collect()).map_err(|error| error.to_string())?;
        // A single profile has no spacing along y.
        let dy_m = if self.ny == 1 && self.dy_m == 0.0 { self.dx_m } else { self.dy_m };
        let pixel_um = Some((self.dx_m * UM_PER_M, dy_m * UM_PER_M));
        let first = if self.revision == Revision::Bcr { FirstRow::Top } else { FirstRow::Bottom };
        Ok(Raw::new(values, meaning, first).pixel(pixel_um))
    }
}

/// The type of a code from 0 to 7.
fn number_of(code: u8) -> Result<Number, String> {
    let found = TYPES.get(usize::from(code)).map(|(_, number)| *number);
    found.ok_or_else(|| format!("DataType is {code}; 0 to 7 are known"))
}

/// Refuses compressed or checksummed files: the property `name` must have code 0, which means none.
fn require_none(name: &str, code: u8) -> Result<(), String> {
    if code == 0 { Ok(()) } else { Err(format!("{name} is {code}; only 0, none, is read")) }
}

/// Reads the magic, which is `a` (text) or `b` (binary) and the revision, and then the file.
/// `channel_option` must be `None`, since the format has a single channel.
pub(super) fn parse(bytes: &[u8], channel_option: Option<&str>) -> Parsed {
    channel::refuse(channel_option)?;
    // Text files may begin with the byte order mark of UTF-8.
    let mut rest = Bytes::new(bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes));
    let magic = rest.take(8).map_err(|_| "it has no header")?;
    let revision = match &magic[1..] {
        b"ISO-1.0" => Revision::Iso1,
        b"ISO-2.0" => Revision::Iso2,
        b"BCR-1.0" => Revision::Bcr,
        _ => {
            let found = String::from_utf8_lossy(magic);
            return Err(format!("it begins with {found:?}; ISO-1.0, ISO-2.0 and BCR-1.0 after a or b are read"));
        }
    };
    match magic[0] {
        b'a' | b'A' => parse_text(rest, revision),
        b'b' | b'B' => parse_binary(rest, revision),
        _ => Err("it begins with neither a, for text, nor b, for binary".to_owned()),
    }
}

/// Reads a binary file from the byte after its magic.
fn parse_binary(mut bytes: Bytes, revision: Revision) -> Parsed {
    // Skips the manufacturer (10 bytes), the date of creation (12) and the date of change (12).
    bytes.take(10 + 12 + 12)?;
    let mut count = || -> Result<usize, String> {
        Ok(if revision == Revision::Iso2 { bytes.u32()? as usize } else { usize::from(bytes.u16()?) })
    };
    let (nx, ny) = (count()?, count()?);
    // The resolution of the heights is not used.
    let (dx_m, dy_m, z_m, _resolution) = (bytes.f64()?, bytes.f64()?, bytes.f64()?, bytes.f64()?);
    require_none("Compression", bytes.u8()?)?;
    let number = number_of(bytes.u8()?)?;
    require_none("CheckType", bytes.u8()?)?;
    let data = bytes.take(data_length(nx, ny, number)?)?;
    Header { revision, nx, ny, dx_m, dy_m, z_m, number }.raw(number.decode(data))
}

/// Reads a text file from the byte after its magic.
fn parse_text(mut rest: Bytes, revision: Revision) -> Parsed {
    let text = encoding::utf8_or_latin1(rest.take_all());
    // The file has three records, each of which ends with an asterisk: header, heights, trailer.
    let mut records = text.split('*');
    let (head, data) = (records.next().unwrap_or_default(), records.next().ok_or("its header does not end with *")?);
    // In BCR files a semicolon begins a comment.
    let uncommented = |line: &str| -> String {
        if revision == Revision::Bcr { line.split(';').next().unwrap_or_default().to_owned() } else { line.to_owned() }
    };
    let mut fields = HashMap::new();
    for line in head.lines().map(uncommented) {
        if let Some((key, value)) = line.split_once('=') {
            fields.insert(key.trim().to_ascii_lowercase(), value.trim().to_owned());
        }
    }
    let field = |key: &str| fields.get(&key.to_ascii_lowercase()).ok_or_else(|| format!("the header has no {key}"));
    let count = |key: &str| -> Result<usize, String> {
        let value = field(key)?;
        value.parse().map_err(|_| format!("{key} is \"{value}\", not a count"))
    };
    let real = |key: &str| -> Result<f64, String> {
        let value = field(key)?;
        value.parse().map_err(|_| format!("{key} is \"{value}\", not a number"))
    };
    for key in ["Compression", "CheckType"] {
        let value = field(key)?;
        if !["0", "NONE", "NULL"].contains(&value.to_ascii_uppercase().as_str()) {
            return Err(format!("{key} is \"{value}\"; only 0, none, is read"));
        }
    }
    let type_name = field("DataType")?;
    let number = match TYPES.iter().find(|(name, _)| name.eq_ignore_ascii_case(type_name)) {
        Some((_, number)) => *number,
        None => number_of(type_name.parse().map_err(|_| format!("DataType is \"{type_name}\"; 0 to 7 are known"))?)?,
    };
    let (nx, ny) = (count("NumPoints")?, count("NumProfiles")?);
    // `data_length` refuses sizes that are 0 or too large.
    let points = data_length(nx, ny, number)? / number.size();
    let (dx_m, dy_m, z_m) = (real("Xscale")?, real("Yscale")?, real("Zscale")?);
    let mut stored = Vec::new();
    for line in data.lines().map(uncommented) {
        for word in line.split_whitespace() {
            let value = if word.eq_ignore_ascii_case("bad") {
                f64::NAN
            } else {
                word.parse().map_err(|_| format!("\"{word}\" among the heights is not a number"))?
            };
            stored.push(value);
        }
    }
    if stored.len() != points {
        return Err(format!("{nx} × {ny} heights are promised, but {} follow", stored.len()));
    }
    Header { revision, nx, ny, dx_m, dy_m, z_m, number }.raw(stored)
}
