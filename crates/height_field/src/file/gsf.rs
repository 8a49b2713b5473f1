//! Gwyddion simple field (`.gsf`): a text header `key = value`, NUL padding to a multiple of four bytes, and 32-bit
//! little-endian floats, from the top row on.

use super::bytes::{Number, data_length};
use super::raw::FirstRow;
use super::units::micrometres;
use super::{Meaning, Parsed, Raw, channel, encoding};
use crate::HeightField;
use ndarray::Array2;
use std::collections::HashMap;

/// First line of a file.
const MAGIC: &[u8] = b"Gwyddion Simple Field 1.0\n";
/// Metres in a µm.
const M_PER_UM: f64 = 1e-6;

/// Position of the data after a header that ends at `header_end`: the next multiple of four, so that one to four NUL
/// bytes lie between.
const fn data_position(header_end: usize) -> usize {
    (header_end / 4 + 1) * 4
}

/// Reads a field. Without `ZUnits` the heights' unit is unknown. Without `XYUnits`, `XReal` or `YReal` the pixel size
/// is unknown. `channel_option` must be `None`, since the format has a single channel.
pub(super) fn parse(bytes: &[u8], channel_option: Option<&str>) -> Parsed {
    channel::refuse(channel_option)?;
    let body = bytes.strip_prefix(MAGIC).ok_or("it does not begin with \"Gwyddion Simple Field 1.0\"")?;
    let end = body.iter().position(|b| *b == 0).ok_or("the header does not end with a NUL byte")?;
    let header = encoding::utf8_or_latin1(&body[..end]);
    let mut fields = HashMap::new();
    for line in header.lines().filter(|line| !line.trim().is_empty()) {
        let (key, value) = line.split_once('=').ok_or_else(|| format!("header line \"{line}\" has no \"=\""))?;
        fields.insert(key.trim(), value.trim());
    }
    let count = |key: &str| -> Result<usize, String> {
        let value = fields.get(key).ok_or_else(|| format!("the header has no {key}"))?;
        value.parse().ok().filter(|n| *n > 0).ok_or_else(|| format!("{key} is \"{value}\", not a positive integer"))
    };
    let (nx, ny) = (count("XRes")?, count("YRes")?);
    let header_end = MAGIC.len() + end;
    let data_start = data_position(header_end);
    let expected = data_length(nx, ny, Number::F32)?;
    let data = bytes.get(data_start..).unwrap_or_default();
    if data.len() != expected {
        return Err(format!("{nx} × {ny} heights are {expected} bytes, but {} follow the header", data.len()));
    }
    if bytes[header_end..data_start].iter().any(|b| *b != 0) {
        return Err("the padding after the header is not NUL".to_owned());
    }
    // A length of the header in µm; `None` without the key.
    let length_um = |key: &str, unit_um: f64| -> Result<Option<f64>, String> {
        let Some(value) = fields.get(key) else { return Ok(None) };
        let number = value.parse::<f64>().ok().filter(|v| v.is_finite() && *v > 0.0);
        number.map(|v| Some(v * unit_um)).ok_or_else(|| format!("{key} is \"{value}\", not a positive number"))
    };
    // A unit of the header in µm; `None` where it is missing or empty.
    let unit_um = |key: &str| fields.get(key).filter(|u| !u.is_empty()).map(|u| micrometres(u)).transpose();
    let pixel_um = match unit_um("XYUnits")? {
        None => None,
        Some(um) => match (length_um("XReal", um)?, length_um("YReal", um)?) {
            (Some(x), Some(y)) => Some((x / nx as f64, y / ny as f64)),
            _ => None,
        },
    };
    let meaning = match unit_um("ZUnits")? {
        Some(um) => Meaning::in_unit(fields["ZUnits"], um),
        None => Meaning::Unknown,
    };
    let values = Array2::from_shape_vec((ny, nx), Number::F32.decode(data)).map_err(|error| error.to_string())?;
    Ok(Raw::new(values, meaning, FirstRow::Top).pixel(pixel_um))
}

/// Encodes a field, with extents and heights in metres.
pub(super) fn encode(field: &HeightField) -> Result<Vec<u8>, String> {
    let ((nx, ny), (lx, ly)) = (field.size(), field.extent_um());
    let mut bytes = MAGIC.to_vec();
    let header = format!(
        "XRes = {nx}\nYRes = {ny}\nXReal = {:e}\nYReal = {:e}\nXYUnits = m\nZUnits = m\n",
        lx * M_PER_UM,
        ly * M_PER_UM
    );
    bytes.extend_from_slice(header.as_bytes());
    bytes.resize(data_position(bytes.len()), 0);
    bytes.extend(field.rows_from_top().flat_map(|h| ((h * M_PER_UM) as f32).to_le_bytes()));
    Ok(bytes)
}
