//! Gwyddion simple field (`.gsf`): a text header `key = value`, NUL padding to a multiple of four bytes, and 32-bit
//! little-endian floats, from the top row on.

use super::raw::FirstRow;
use super::units::micrometres;
use super::{Meaning, Parsed, Raw, channel, encoding};
use crate::HeightField;
use ndarray::Array2;
use std::collections::HashMap;

/// First line of a file.
const MAGIC: &[u8] = b"Gwyddion Simple Field 1.0\n";

/// Reads a field; without `ZUnits` or `XYUnits` the heights' unit or the pixel size is unknown.
pub(super) fn parse(bytes: &[u8], wanted: Option<&str>) -> Parsed {
    channel::refuse(wanted)?;
    let body = bytes.strip_prefix(MAGIC).ok_or("it does not begin with \"Gwyddion Simple Field 1.0\"")?;
    let end = body.iter().position(|b| *b == 0).ok_or("the header does not end with a NUL byte")?;
    let header = encoding::label(&body[..end]);
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
    let text = MAGIC.len() + end;
    // One to four NUL bytes, up to a multiple of four.
    let start = (text / 4 + 1) * 4;
    let length = nx.checked_mul(ny).and_then(|n| n.checked_mul(4)).ok_or("XRes × YRes is too large")?;
    let data = bytes.get(start..).unwrap_or_default();
    if data.len() != length {
        return Err(format!("{nx} × {ny} heights are {length} bytes, but {} follow the header", data.len()));
    }
    if bytes[text..start].iter().any(|b| *b != 0) {
        return Err("the padding after the header is not NUL".to_owned());
    }
    let length_um = |key: &str, unit: f64| -> Result<Option<f64>, String> {
        let Some(value) = fields.get(key) else { return Ok(None) };
        let number = value.parse::<f64>().ok().filter(|v| v.is_finite() && *v > 0.0);
        number.map(|v| Some(v * unit)).ok_or_else(|| format!("{key} is \"{value}\", not a positive number"))
    };
    let unit = |key: &str| fields.get(key).filter(|u| !u.is_empty()).map(|u| micrometres(u)).transpose();
    let pixel_um = match unit("XYUnits")? {
        None => None,
        Some(unit) => match (length_um("XReal", unit)?, length_um("YReal", unit)?) {
            (Some(x), Some(y)) => Some((x / nx as f64, y / ny as f64)),
            _ => None,
        },
    };
    let meaning = match unit("ZUnits")? {
        Some(um) => Meaning::in_unit(fields["ZUnits"], um),
        None => Meaning::Unknown,
    };
    let values: Vec<f64> =
        data.chunks_exact(4).map(|b| f64::from(f32::from_le_bytes([b[0], b[1], b[2], b[3]]))).collect();
    let values = Array2::from_shape_vec((ny, nx), values).map_err(|error| error.to_string())?;
    Ok(Raw::new(values, meaning, FirstRow::Top).pixel(pixel_um))
}

/// Writes lengths and heights in metres.
pub(super) fn encode(field: &HeightField) -> Result<Vec<u8>, String> {
    let ((nx, ny), (lx, ly)) = (field.size(), field.extent_um());
    let mut bytes = MAGIC.to_vec();
    let header = format!(
        "XRes = {nx}\nYRes = {ny}\nXReal = {:e}\nYReal = {:e}\nXYUnits = m\nZUnits = m\n",
        lx * 1e-6,
        ly * 1e-6
    );
    bytes.extend_from_slice(header.as_bytes());
    bytes.resize((bytes.len() / 4 + 1) * 4, 0);
    bytes.extend(field.rows_from_top().flat_map(|h| ((h * 1e-6) as f32).to_le_bytes()));
    Ok(bytes)
}
