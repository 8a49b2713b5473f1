//! NumPy arrays (`.npy`), from the bottom row on: floats in µm, or unsigned integers. The largest integer of the type
//! is full scale, which stands for the largest height.

use super::raw::FirstRow;
use super::{Meaning, Parsed, Raw, channel};
use crate::HeightField;
use ndarray::Array2;
use ndarray_npy::{ReadNpyError, ReadNpyExt, ReadableElement, WriteNpyExt};

/// Matrix of elements of type T, which `convert` makes 64-bit floats. `None` if the file holds another type; an error
/// if the array is damaged or does not have two dimensions.
fn try_type<T>(bytes: &[u8], convert: fn(T) -> f64) -> Option<Result<Array2<f64>, String>>
where
    T: ReadableElement,
{
    match Array2::<T>::read_npy(bytes) {
        Ok(array) => {
            let size = array.dim();
            // The iteration is row by row, even if the file is in Fortran order.
            let values: Vec<f64> = array.into_iter().map(convert).collect();
            Some(Array2::from_shape_vec(size, values).map_err(|error| error.to_string()))
        }
        Err(ReadNpyError::WrongDescriptor(_)) => None,
        Err(ReadNpyError::WrongNdim(_, found)) => {
            Some(Err(format!("its array has {found} dimensions; heights have two, rows and columns")))
        }
        Err(error) => Some(Err(error.to_string())),
    }
}

/// Refuses a file without NumPy's magic bytes, and a shape with more elements than the file has bytes, before memory is
/// allocated for them. An element has at least one byte.
///
/// Layout (NumPy's NEP 1): six bytes of magic, two of version, the header's length (u16 in version 1, u32 in later
/// versions), and the header. The header is a Python dictionary whose `'shape'` is a tuple.
fn check_header(bytes: &[u8]) -> Result<(), String> {
    if !bytes.starts_with(b"\x93NUMPY") {
        return Err("it does not begin with NumPy's magic bytes".to_owned());
    }
    let stored = bytes.get(8..12).ok_or("it has no header")?;
    // Byte 6 is the major version. The header follows its length.
    let (start, length) = if bytes[6] == 1 {
        (10, usize::from(u16::from_le_bytes([stored[0], stored[1]])))
    } else {
        let length = u32::from_le_bytes([stored[0], stored[1], stored[2], stored[3]]);
        (12, usize::try_from(length).unwrap_or(usize::MAX))
    };
    let header = bytes.get(start..).and_then(|rest| rest.get(..length)).ok_or("its header ends early")?;
    let header = String::from_utf8_lossy(header);
    // Every shape is checked, since a damaged header may repeat the key.
    for (at, _) in header.match_indices("shape") {
        // The text between the brackets after the key, such as `3, 4`.
        let shape = header[at..].split(['(', ')']).nth(1).unwrap_or_default();
        let counts = shape.split(',').map(str::trim).filter(|count| !count.is_empty());
        let elements = counts
            // Python 2 wrote long integers with an L.
            .map(|count| count.trim_end_matches('L').parse::<usize>())
            .try_fold(1_usize, |product, count| product.checked_mul(count.ok()?));
        if elements.is_none_or(|elements| elements > bytes.len()) {
            return Err(format!("its shape ({shape}) does not fit into {} bytes", bytes.len()));
        }
    }
    Ok(())
}

/// Reads a matrix: floats are heights in µm, unsigned integers are fractions of full scale.
/// `channel_option` must be `None`, since the format has a single channel.
pub(super) fn parse(bytes: &[u8], channel_option: Option<&str>) -> Parsed {
    channel::refuse(channel_option)?;
    check_header(bytes)?;
    let raw = |values, meaning| Raw::new(values, meaning, FirstRow::Bottom);
    let fraction_of = |full| Meaning::FullScale { full, max_height_um: None };
    if let Some(values) = try_type::<f64>(bytes, |v| v).or_else(|| try_type::<f32>(bytes, f64::from)) {
        return Ok(raw(values?, Meaning::micrometres()));
    }
    if let Some(values) = try_type::<u8>(bytes, f64::from) {
        return Ok(raw(values?, fraction_of(f64::from(u8::MAX))));
    }
    if let Some(values) = try_type::<u16>(bytes, f64::from) {
        return Ok(raw(values?, fraction_of(f64::from(u16::MAX))));
    }
    Err("its elements are of a type other than float64, float32, uint16, uint8".to_owned())
}

/// Writes heights in µm as 64-bit floats.
pub(super) fn encode(field: &HeightField) -> Result<Vec<u8>, String> {
    let mut bytes = Vec::new();
    field.heights_um().write_npy(&mut bytes).map_err(|error| error.to_string())?;
    Ok(bytes)
}

#[cfg(test)]
mod tests {
    #[test]
    fn other_files_are_not_called_damaged() {
        assert!(super::check_header(b"1 2 3\n4 5 6\n").unwrap_err().contains("magic"));
    }
}
