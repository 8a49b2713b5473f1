//! Bruker (Veeco, Digital Instruments) NanoScope, version 4.3 and later: a text header of lines that begin with a
//! backslash, then the images, from the bottom row on.
//!
//! A height is `stored · hard value / 256^(bytes per pixel) · soft scale`. The line `@2:Z scale` holds the hard value
//! in V and names the soft scale, a sensitivity in nm/V, which is another line of the header.
//!
//! The bytes per pixel in the formula are the header's `Bytes/pixel`. Some files say 2 but store four bytes for each
//! point, so the size of the stored numbers is inferred from the length of the data ([`layout`]).

use super::bytes::{Bytes, Number};
use super::channel::{self, Channel, ValueKind};
use super::provenance::{Source, Understood};
use super::raw::{FirstRow, Pixel};
use super::units::micrometres;
use super::{Meaning, Parsed, Raw, encoding};
use ndarray::Array2;
use std::collections::HashMap;

/// Largest relative difference between the ratio of a scan's sides and its aspect ratio that counts as agreement. The
/// header has few digits of the sides, which a smaller value would refuse. A larger one would accept other ratios.
const SIDES_AGREEMENT: f64 = 1e-2;

/// A section of the header: a headline and its lines `key: value`.
pub(super) struct Section<'a> {
    /// Headline without its asterisk.
    title: &'a str,
    /// Values by key. Keys are in lower case and contain their group, such as `@2:` in `@2:z scale`.
    lines: HashMap<String, &'a str>,
}

impl<'a> Section<'a> {
    /// Whether the section describes an image rather than a force curve (force over the distance of the tip).
    pub(super) fn is_image(&self) -> bool {
        self.title.to_ascii_lowercase().ends_with("ciao image list")
    }

    /// The value of a key, in any case.
    fn text(&self, key: &str) -> Result<&'a str, String> {
        let found = self.lines.get(&key.to_ascii_lowercase()).copied();
        found.ok_or_else(|| format!("the section \"{}\" has no {key}", self.title))
    }

    /// The value of a key that is a positive integer.
    pub(super) fn count(&self, key: &str) -> Result<usize, String> {
        let text = self.text(key)?;
        text.parse().ok().filter(|count| *count > 0).ok_or_else(|| format!("{key} is \"{text}\", not a count"))
    }
}

/// Sections of a header, up to `*File list end` or the first line without a backslash.
pub(super) fn sections(header: &str) -> Vec<Section<'_>> {
    let mut sections: Vec<Section> = Vec::new();
    for line in header.lines().map(str::trim_end) {
        let Some(line) = line.strip_prefix('\\') else { break };
        if let Some(title) = line.strip_prefix('*') {
            if title.eq_ignore_ascii_case("File list end") {
                break;
            }
            sections.push(Section { title, lines: HashMap::new() });
        } else if let Some(section) = sections.last_mut() {
            // A key may begin with its group: `@`, one or two digits, and a colon, as in `@2:Z scale: …`.
            let first_colon = line.find(':').filter(|at| line.starts_with('@') && *at <= 3);
            let after_group = first_colon.map_or(0, |at| at + 1);
            if let Some(colon) = line[after_group..].find(':') {
                let (key, value) = (&line[..after_group + colon], &line[after_group + colon + 1..]);
                section.lines.insert(key.trim().to_ascii_lowercase(), value.trim());
            }
        }
    }
    sections
}

/// A finite positive number; `None` for any other text.
fn positive_number(text: &str) -> Option<f64> {
    text.trim().parse().ok().filter(|value: &f64| value.is_finite() && *value > 0.0)
}

/// The first word as a number, and the text after it.
fn leading_number(text: &str) -> Option<(f64, &str)> {
    let text = text.trim_start();
    let end = text.find(char::is_whitespace).unwrap_or(text.len());
    Some((text[..end].parse().ok()?, text[end..].trim()))
}

/// Text between brackets at the beginning, and the text after them.
fn bracketed(text: &str, open: char, close: char) -> Option<(&str, &str)> {
    let inner = text.trim_start().strip_prefix(open)?;
    let end = inner.find(close)?;
    Some((&inner[..end], &inner[end + close.len_utf8()..]))
}

/// Scale of an image's values.
struct Scale {
    /// Height in µm of the full range of the stored numbers, 256^(bytes per pixel) steps; `None` for a channel of
    /// another quantity.
    full_range_um: Option<f64>,
    /// Name of the values' unit, or the reason why it is unknown.
    unit: String,
}

/// Reads the scale of an image; `header` holds all sections.
///
/// The line is `V [soft scale] (hard scale) hard value`, such as `V [Sens. Zscan] (0.003 V/LSB) 200 V`. The soft scale
/// names the key of a sensitivity, here `@Sens. Zscan`. The hard scale, volts per step of the stored number, is not
/// needed. Without a soft scale the hard value is the full range.
fn scale(image: &Section, header: &[Section]) -> Result<Scale, String> {
    let text = image.text("@2:Z scale")?;
    let malformed = || format!("@2:Z scale is \"{text}\", not V [soft scale] (hard scale) hard value");
    let rest = text.strip_prefix('V').ok_or_else(malformed)?;
    let (soft_name, rest) = bracketed(rest, '[', ']').map_or((None, rest), |(name, rest)| (Some(name.trim()), rest));
    // The hard scale's unit may itself contain brackets: the hard value follows the last one.
    let rest = if rest.trim_start().starts_with('(') { rest.rsplit(')').next().unwrap_or_default() } else { rest };
    let (hard_value, hard_unit) = leading_number(rest).ok_or_else(malformed)?;
    let Some(soft_name) = soft_name.filter(|name| !name.is_empty()) else {
        let full_range_um = micrometres(hard_unit).ok().map(|unit_um| hard_value * unit_um);
        return Ok(Scale { full_range_um, unit: hard_unit.to_owned() });
    };
    let key = format!("@{}", soft_name.to_ascii_lowercase());
    let soft = header.iter().find_map(|section| section.lines.get(&key));
    let soft = soft.ok_or_else(|| format!("the header has no {soft_name}, which @2:Z scale names"))?;
    let (sensitivity, unit) = soft
        .strip_prefix('V')
        .and_then(leading_number)
        .ok_or_else(|| format!("{soft_name} is \"{soft}\", not V and a number"))?;
    // Heights have a soft scale in length per volt and a hard value in volts: the volts cancel.
    let product_unit = unit.strip_suffix(&format!("/{hard_unit}")).filter(|_| !hard_unit.is_empty());
    let full_range_um =
        product_unit.and_then(|unit| micrometres(unit).ok()).map(|unit_um| hard_value * sensitivity * unit_um);
    let unit = product_unit.map_or_else(|| format!("{unit} {hard_unit}").trim().to_owned(), str::to_owned);
    Ok(Scale { full_range_um, unit })
}

/// Title of an image, and direction of the scan in lower case (empty if unknown). The value of `@2:Image Data` or
/// `@3:Image Data` is `S [key] "title"`; without quotes, the text in brackets is the title.
fn title_and_direction(image: &Section) -> Result<(String, String), String> {
    let text = image.text("@2:Image Data").or_else(|_| image.text("@3:Image Data"))?;
    let quoted = text.split('"').nth(1);
    let title = quoted.or_else(|| bracketed(text.trim_start_matches('S'), '[', ']').map(|found| found.0));
    let direction = image.text("Line Direction").unwrap_or_default();
    Ok((title.unwrap_or(text).trim().to_owned(), direction.to_ascii_lowercase()))
}

/// Columns, stored rows and number type of an image whose data take `length` bytes. A scan that was stopped may store
/// only its valid rows.
fn layout(image: &Section, length: usize) -> Result<(usize, usize, Number), String> {
    let (nx, ny) = (image.count("Samps/line")?, image.count("Number of lines")?);
    let valid = image.count("Valid data len Y").unwrap_or(ny).min(ny);
    // The first combination with the right number of bytes is taken, a complete scan before a stopped one.
    for rows in [ny, valid] {
        for number in [Number::I16, Number::I32] {
            if nx.checked_mul(rows).and_then(|points| points.checked_mul(number.size())) == Some(length) {
                return Ok((nx, rows, number));
            }
        }
    }
    Err(format!("{nx} × {ny} points of 2 or 4 bytes do not make the {length} bytes of its data"))
}

/// Pixel size in µm along x and y of an image of `nx` points in each of `ny` lines; `header` holds all sections.
///
/// For an aspect ratio other than 1:1, versions of the program differ in the meaning of a `Scan Size` of one number.
/// The pixel size is then known in two cases only, and [`Pixel::Unknown`] otherwise:
///
/// - The `Scan Size` has two numbers in the aspect ratio, which are the sides of the scan.
/// - The numbers of points have the aspect ratio, which makes the pixels square. The `Scan Size` of one number is then
///   taken for the side along x.
///
/// # Errors
/// A header without a scan size, or with a scan size or an aspect ratio that is not understood.
pub(super) fn pixel_size(image: &Section, header: &[Section], (nx, ny): (usize, usize)) -> Result<Pixel, String> {
    // An image without a size of its own has the size of the whole scan, which is in another section.
    let scan_size =
        || header.iter().find(|section| section.title.eq_ignore_ascii_case("Ciao scan list"))?.text("Scan size").ok();
    let text = image.text("Scan size").or_else(|missing| scan_size().ok_or(missing))?;
    let malformed = || format!("Scan Size is \"{text}\", not one or two numbers and a unit");
    let (x, rest) = leading_number(text).ok_or_else(malformed)?;
    let (y, unit) = leading_number(rest).unwrap_or((x, rest));
    let unit_um = micrometres(unit)?;
    let (dx, dy) = (x * unit_um / nx as f64, y * unit_um / ny as f64);
    let Ok(ratio) = image.text("Aspect ratio") else { return Ok(Pixel::Um(dx, dy)) };
    let parts = ratio.split_once(':').and_then(|(a, b)| Some((positive_number(a)?, positive_number(b)?)));
    let (ratio_x, ratio_y) = parts.ok_or_else(|| format!("Aspect Ratio is \"{ratio}\", not two numbers"))?;
    if ratio_x == ratio_y {
        return Ok(Pixel::Um(dx, dy));
    }
    // The sides have the aspect ratio.
    if (ratio_x * y / (ratio_y * x) - 1.0).abs() < SIDES_AGREEMENT {
        return Ok(Pixel::Um(dx, dy));
    }
    // The numbers of points have the aspect ratio to within one point.
    let points_agree = (ratio_x * ny as f64 - ratio_y * nx as f64).abs() <= ratio_x.max(ratio_y);
    if points_agree && x == y {
        return Ok(Pixel::Um(dx, dx));
    }
    // The text completes "the file does not say its …".
    Ok(Pixel::Unknown(format!(
        "pixel size plainly, by an Aspect Ratio of {ratio}, a Scan Size of {text} and {nx} × {ny} points (square \
         pixels would be of {dx} µm)"
    )))
}

/// Reads the channel that `channel_option` names (number or title), or the default one of `channel.rs`.
pub(super) fn parse(bytes: &[u8], channel_option: Option<&str>) -> Parsed {
    if !bytes.starts_with(b"\\*") {
        return Err(
            "it does not begin with a line like \\*File list; binary Nanoscope files since version 4.3 are read"
                .to_owned(),
        );
    }
    // The header ends with Ctrl-Z. Its keys are ASCII; other text is Latin-1 or UTF-8.
    let end = bytes.iter().position(|b| *b == 0x1a).unwrap_or(bytes.len());
    let header_text = encoding::utf8_or_latin1(&bytes[..end]);
    let header = sections(&header_text);
    let mut images = Vec::new();
    let mut channels = Vec::new();
    for image in header.iter().filter(|section| section.is_image()) {
        let (title, direction) = title_and_direction(image)?;
        // An unreadable scale makes one channel unusable, not the file. Messages list the reason in place of the unit.
        let unusable = |reason| Scale { full_range_um: None, unit: reason };
        let Scale { full_range_um, unit } = scale(image, &header).unwrap_or_else(unusable);
        let unit = if direction.is_empty() { unit } else { format!("{unit}, {direction}") };
        let kind = if full_range_um.is_some() { ValueKind::Lengths } else { ValueKind::Other };
        channels.push(Channel { number: channels.len() + 1, title, unit, kind });
        images.push((image, full_range_um));
    }
    let chosen = channel::choose(&channels, channel_option)?;
    let (image, full_range_um) = images[chosen];
    // Never fails: `choose` refuses channels of `ValueKind::Other`.
    let full_range_um = full_range_um.ok_or("the channel is not a height")?;
    let (offset, length) = (image.count("Data offset")?, image.count("Data length")?);
    let (nx, ny, number) = layout(image, length)?;
    let mut data = Bytes::new(bytes);
    let _before_data = data.take(offset)?;
    // Number of steps in the full range, 256^(bytes per pixel). Files without the key have 2 bytes per pixel.
    let steps = match image.text("Bytes/pixel") {
        Err(_) | Ok("2") => 65536.0,
        Ok("4") => 4_294_967_296.0,
        Ok(found) => return Err(format!("Bytes/pixel is {found}, not 2 or 4")),
    };
    let step_um = full_range_um / steps;
    let values: Vec<f64> = number.decode(data.take(length)?).iter().map(|value| value * step_um).collect();
    let values = Array2::from_shape_vec((ny, nx), values).map_err(|error| error.to_string())?;
    // The scan size covers all lines, even if the scan was stopped and fewer rows are stored.
    let lines = image.count("Number of lines")?;
    let pixel = pixel_size(image, &header, (nx, lines))?;
    let meaning = Meaning::Lengths { unit_um: 1.0, unit: Understood::new(Source::File, "Z scale and its sensitivity") };
    Ok(Raw::new(values, meaning, FirstRow::Bottom)
        .pixel_or_reason(pixel)
        .channel(channels[chosen].name(), channel_option))
}
