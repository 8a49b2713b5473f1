//! TIFF: pages of grey in 8, 16 or 32 bits, or of floats in µm; ImageJ's calibration is applied.
//!
//! A file is a chain of directories, one for each page. A directory is a list of *tags*, each with a number (u16),
//! type, count and values. BigTIFF is the variant with offsets of 64 bits. [`parse`] checks the tags' sizes, selects
//! a page, reads scale and orientation from tags and from ImageJ's description, and last decodes the values. Integers
//! are fractions of *full scale*, the largest integer of their type, unless ImageJ calibrates them.

use super::channel::{self, Channel, ValueKind};
use super::provenance::{Source, Understood};
use super::raw::FirstRow;
use super::units::{PIXELS_PER_METRE_MIN, UM_PER_M, micrometres};
use super::{Meaning, Parsed, Raw};
use ndarray::Array2;
use std::io::Cursor;
use tiff::ColorType;
use tiff::decoder::ifd::Value;
use tiff::decoder::{Decoder, DecodingResult, Limits};
use tiff::tags::Tag;

/// Private tags in which instruments store the heights of a file whose pages are a preview in colours, each with the
/// manufacturer.
const PRIVATE: [(u16, &str); 3] = [(50432, "Park Systems"), (50434, "Park Systems"), (50435, "Park Systems")];
/// Largest number of pages that are searched, which bounds the time for a damaged file.
const PAGES_MAX: usize = 65_536;
/// Upper bound on the compression ratio, which bounds the memory for a damaged file. The ratios of LZW and Deflate are
/// lower.
const COMPRESSION_MAX: usize = 2048;

/// Decoder positioned at one page.
type Pages<'a> = Decoder<Cursor<&'a [u8]>>;

/// Value of an unsigned integer tag; `None` without the tag.
fn integer(pages: &mut Pages, tag: Tag) -> Result<Option<u32>, String> {
    pages.find_tag_unsigned(tag).map_err(|error| error.to_string())
}

/// Pixels per unit of length from a resolution tag; `None` unless it is finite and positive. [`Tag::ResolutionUnit`] or
/// ImageJ's description gives the unit.
fn resolution(pages: &mut Pages, tag: Tag) -> Option<f64> {
    let value = match pages.find_tag(tag).ok()?? {
        Value::Rational(numerator, denominator) => f64::from(numerator) / f64::from(denominator),
        Value::Float(value) => f64::from(value),
        Value::Double(value) => value,
        _ => return None,
    };
    (value.is_finite() && value > 0.0).then_some(value)
}

/// Text of a tag; `None` without one. A text longer than the file is damage, and is ignored.
fn ascii(pages: &mut Pages, tag: Tag, file_bytes: usize) -> Option<String> {
    if pages.image_ifd().find_entry(tag)?.count() > file_bytes as u64 {
        return None;
    }
    match pages.find_tag(tag).ok()?? {
        Value::Ascii(text) => Some(text),
        _ => None,
    }
}

/// The description that ImageJ writes, of lines `key=value`.
struct Description(String);

impl Description {
    /// ImageJ's description of the current page; `None` for another program's.
    fn of(pages: &mut Pages, file_bytes: usize) -> Option<Self> {
        let text = ascii(pages, Tag::ImageDescription, file_bytes)?;
        text.starts_with("ImageJ=").then_some(Self(text))
    }

    /// The value of a key.
    fn get(&self, key: &str) -> Option<&str> {
        self.0.lines().find_map(|line| line.strip_prefix(key)?.strip_prefix('=')).map(str::trim)
    }

    /// Unit at this key in µm; `None` if it is no length.
    fn unit_um(&self, key: &str) -> Option<f64> {
        // ImageJ writes the micro sign as an escape sequence.
        micrometres(&self.get(key)?.replace("\\u00B5", "µ").replace("\\u00b5", "µ")).ok()
    }

    /// Calibration `(c0, c1)` in µm, with which a height is `c0 + c1·value`; `None` without a linear calibration of
    /// lengths.
    fn calibration_um(&self) -> Option<(f64, f64)> {
        let unit_um = self.unit_um("vunit")?;
        let number = |key: &str| self.get(key)?.parse::<f64>().ok();
        // Calibration function 0 is a straight line.
        (self.get("cf")? == "0").then_some((number("c0")? * unit_um, number("c1")? * unit_um))
    }
}

/// Pixel size along x and y in µm, from ImageJ's unit or the resolution tags; `None` without a measured one.
fn read_pixel_um(pages: &mut Pages, description: Option<&Description>) -> Result<Option<(f64, f64)>, String> {
    let (Some(x), Some(y)) = (resolution(pages, Tag::XResolution), resolution(pages, Tag::YResolution)) else {
        return Ok(None);
    };
    if let Some(unit_um) = description.and_then(|description| description.unit_um("unit")) {
        return Ok(Some((unit_um / x, unit_um / y)));
    }
    let per_metre = match integer(pages, Tag::ResolutionUnit)? {
        // Inches, the default.
        None | Some(2) => 1.0 / 0.0254,
        // Centimetres.
        Some(3) => 100.0,
        _ => return Ok(None),
    };
    // Lower resolutions are those of printers and screens.
    let is_measure = x.min(y) * per_metre >= f64::from(PIXELS_PER_METRE_MIN);
    Ok(is_measure.then(|| (UM_PER_M / (x * per_metre), UM_PER_M / (y * per_metre))))
}

/// The number that marks missing points, from the tag `GDAL_NODATA` of geographic files.
fn read_no_data(pages: &mut Pages, file_bytes: usize) -> Option<f64> {
    ascii(pages, Tag::GdalNodata, file_bytes)?.trim().trim_end_matches('\0').parse().ok()
}

/// Goes to the page that `channel_option` names (from 0), and returns its number as text. Without the option, stays at
/// the first page and returns `None`.
fn go_to_page(pages: &mut Pages, channel_option: Option<&str>) -> Result<Option<String>, String> {
    let Some(wanted) = channel_option else { return Ok(None) };
    let page = wanted.trim().parse::<usize>().ok();
    for current in 0..PAGES_MAX {
        if Some(current) == page {
            return Ok(Some(current.to_string()));
        }
        if !pages.more_images() {
            // The page does not exist: `choose` fails with a list of all pages.
            let page_channel =
                |number| Channel { number, title: String::new(), unit: "page".to_owned(), kind: ValueKind::Lengths };
            let listed: Vec<Channel> = (0..=current).map(page_channel).collect();
            channel::choose(&listed, Some(wanted))?;
        }
        pages.next_image().map_err(|error| error.to_string())?;
    }
    Err(format!("`channel` is \"{wanted}\"; the first {PAGES_MAX} pages are counted"))
}

/// Size in bytes of one value of a tag's type, by the type's code in TIFF 6.0 and BigTIFF; 1 for unknown types.
fn value_size(kind: u64) -> u64 {
    match kind {
        // SHORT, SSHORT.
        3 | 8 => 2,
        // LONG, SLONG, FLOAT, IFD.
        4 | 9 | 11 | 13 => 4,
        // RATIONAL, SRATIONAL, DOUBLE, LONG8, SLONG8, IFD8.
        5 | 10 | 12 | 16 | 17 | 18 => 8,
        // BYTE, ASCII, SBYTE, UNDEFINED.
        _ => 1,
    }
}

/// Refuses a tag with more values than the file can hold, before the decoder allocates memory for them. The decoder
/// reports other damage of the directories.
fn check_tags(bytes: &[u8]) -> Result<(), String> {
    let is_little = bytes.starts_with(b"II");
    // The unsigned integer of `size` bytes at byte `at`, in the file's byte order; `None` beyond the end of the file.
    let uint_at = |at: usize, size: usize| -> Option<u64> {
        let stored = bytes.get(at..at.checked_add(size)?)?;
        let append = |sum: u64, byte: &u8| sum << 8 | u64::from(*byte);
        Some(if is_little { stored.iter().rev().fold(0, append) } else { stored.iter().fold(0, append) })
    };
    // Sizes in bytes of a directory's count of entries, of one entry, and of an offset. Version 43 is BigTIFF.
    let (count_size, entry_size, offset_size) = if uint_at(2, 2) == Some(43) { (8, 20, 8) } else { (2, 12, 4) };
    // Position of the next directory; 0 after the last. The position of the first directory is stored at byte 4, in
    // BigTIFF at byte 8: both equal the size of an offset.
    let mut next = uint_at(offset_size, offset_size);
    // Sum of the sizes of all directories on the chain. If it exceeds the file's size, the chain comes back to one of
    // them.
    let mut bytes_read = 0;
    while let Some(at) = next.and_then(|at| usize::try_from(at).ok()).filter(|at| *at != 0) {
        let Some(entries) = uint_at(at, count_size).and_then(|count| usize::try_from(count).ok()) else { break };
        for entry in 0..entries {
            bytes_read += entry_size;
            // An entry is the tag's number (u16), type (u16), count and values.
            let start = at + count_size + entry * entry_size;
            let (Some(kind), Some(count)) = (uint_at(start + 2, 2), uint_at(start + 4, offset_size)) else { break };
            if bytes_read > bytes.len() {
                return Err("its directories refer to each other in a circle".to_owned());
            }
            if count.saturating_mul(value_size(kind)) > bytes.len() as u64 {
                return Err(format!("a tag of {count} values does not fit into {} bytes", bytes.len()));
            }
        }
        bytes_read += count_size;
        let end = entries.checked_mul(entry_size).and_then(|length| length.checked_add(at + count_size));
        next = end.filter(|_| bytes_read <= bytes.len()).and_then(|end| uint_at(end, offset_size));
    }
    Ok(())
}

/// Refuses a page that is not grey, and a size that the file cannot hold. Returns the columns and rows of the page.
fn check_page(pages: &mut Pages, file_bytes: usize) -> Result<(u32, u32), String> {
    match integer(pages, Tag::PhotometricInterpretation)? {
        Some(0) => return Err("its numbers grow towards black (WhiteIsZero); they must grow towards white".to_owned()),
        Some(3) => return Err("it is a picture with a palette, whose numbers are colours and not heights".to_owned()),
        _ => {}
    }
    let colour = pages.colortype().map_err(|error| error.to_string())?;
    // Samples of 64 bits may be floats; `Samples::read` refuses integers of 64 bits.
    if !matches!(colour, ColorType::Gray(8 | 16 | 32 | 64)) {
        return Err(format!("it is {colour:?}; grey of 8, 16 or 32 bits, or floats, is needed"));
    }
    let (width, height) = pages.dimensions().map_err(|error| error.to_string())?;
    // Compression method 1 is none. A point takes at least one byte then.
    let is_packed = integer(pages, Tag::Compression)?.is_some_and(|method| method != 1);
    if !is_packed && u64::from(width) * u64::from(height) > file_bytes as u64 {
        return Err(format!("{width} × {height} points do not fit into {file_bytes} bytes"));
    }
    Ok((width, height))
}

/// Numbers of a page.
struct Samples {
    /// Stored numbers, row by row from the file's first row on.
    values: Vec<f64>,
    /// Full scale, the largest integer of the type; `None` for floats.
    full: Option<f64>,
}

impl Samples {
    /// Decodes the current page. Numbers equal to `no_data` become NaN.
    fn read(pages: &mut Pages, no_data: Option<f64>) -> Result<Self, String> {
        let integers = |values: Vec<f64>, full: f64| (values, Some(full), no_data);
        let (mut values, full, no_data) = match pages.read_image().map_err(damaged)? {
            DecodingResult::U8(values) => integers(values.into_iter().map(f64::from).collect(), f64::from(u8::MAX)),
            DecodingResult::U16(values) => integers(values.into_iter().map(f64::from).collect(), f64::from(u16::MAX)),
            DecodingResult::U32(values) => integers(values.into_iter().map(f64::from).collect(), f64::from(u32::MAX)),
            DecodingResult::F32(values) => {
                // The mark of missing points is rounded like the numbers that are compared with it.
                let rounded = no_data.map(|value| f64::from(value as f32));
                (values.into_iter().map(f64::from).collect(), None, rounded)
            }
            DecodingResult::F64(values) => (values, None, no_data),
            _ => {
                let needed = "unsigned ones of up to 32 bits, or floats of 32 or 64, are needed";
                return Err(format!("its samples are signed or 64-bit integers, or half floats; {needed}"));
            }
        };
        for value in values.iter_mut().filter(|value| Some(**value) == no_data) {
            *value = f64::NAN;
        }
        Ok(Self { values, full })
    }
}

/// Message for an error of the decoder.
fn damaged(error: tiff::TiffError) -> String {
    format!("it is cut short or damaged: {error}")
}

/// Reads the page that `channel_option` names (its number from 0), or the first one.
///
/// The limits bound the memory that the decoder takes for a damaged file.
pub(super) fn parse(bytes: &[u8], channel_option: Option<&str>) -> Parsed {
    check_tags(bytes)?;
    let mut limits = Limits::unlimited();
    limits.ifd_value_size = bytes.len();
    limits.decoding_buffer_size = bytes.len().saturating_mul(COMPRESSION_MAX);
    limits.intermediate_buffer_size = limits.decoding_buffer_size;
    let mut pages = Decoder::new(Cursor::new(bytes)).map_err(damaged)?.with_limits(limits);
    if let Some((_, owner)) = PRIVATE.iter().find(|(tag, _)| pages.image_ifd().find_entry(Tag::Unknown(*tag)).is_some())
    {
        return Err(format!(
            "it is of {owner}, whose heights are in a private tag beside a preview in colours: \
             `python -m sunbeam_mitsuba.convert` (with the extra \"formats\") or Gwyddion writes them as .gsf"
        ));
    }
    let page = go_to_page(&mut pages, channel_option)?;
    let (width, height) = check_page(&mut pages, bytes.len())?;
    let (first_row, first_row_source) = match integer(&mut pages, Tag::Orientation)? {
        None => (FirstRow::Top, Source::Format),
        Some(1) => (FirstRow::Top, Source::File),
        Some(4) => (FirstRow::Bottom, Source::File),
        Some(found) => return Err(format!("its Orientation is {found}; 1 and 4, rows from top or bottom, are read")),
    };
    let description = Description::of(&mut pages, bytes.len());
    let pixel_um = read_pixel_um(&mut pages, description.as_ref())?;
    let no_data = read_no_data(&mut pages, bytes.len());
    let Samples { values, full } = Samples::read(&mut pages, no_data)?;
    let size = (height as usize, width as usize);
    let mut values = Array2::from_shape_vec(size, values).map_err(|error| error.to_string())?;
    let meaning = match (description.and_then(|description| description.calibration_um()), full) {
        (Some((c0, c1)), _) => {
            values.mapv_inplace(|value| c0 + c1 * value);
            Meaning::Lengths { unit_um: 1.0, unit: Understood::new(Source::File, "calibration of ImageJ") }
        }
        (None, Some(full)) => Meaning::FullScale { full, max_height_um: None },
        (None, None) => Meaning::micrometres(),
    };
    let raw = Raw::new(values, meaning, first_row).pixel(pixel_um).rows_from(first_row_source);
    Ok(match page {
        Some(page) => raw.channel(page, channel_option),
        None => raw,
    })
}

#[cfg(test)]
mod tests {
    #[test]
    fn directories_in_a_circle_are_refused() {
        // A directory of three tags without values at byte 8, followed by itself.
        let bytes = [b"II\x2a\0\x08\0\0\0\x03\0".as_slice(), &[0; 36], &[8, 0, 0, 0]].concat();
        assert!(super::check_tags(&bytes).unwrap_err().contains("circle"));
    }
}
