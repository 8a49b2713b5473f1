//! NumPy arrays: floats in µm, or integers whose largest value is full scale.

use super::{Parsed, Raw, Values};
use ndarray::Array2;
use ndarray_npy::{ReadNpyError, ReadNpyExt, ReadableElement};

/// `None` if the file holds another type of element.
fn try_type<T>(bytes: &[u8], convert: fn(T) -> f64) -> Option<Result<Array2<f64>, String>>
where
    T: ReadableElement,
{
    match Array2::<T>::read_npy(bytes) {
        Ok(array) => {
            // Fortran order is laid out anew, so that rows are contiguous for everyone downstream.
            let size = array.dim();
            let convert_all = |array: Array2<T>| array.into_iter().map(convert).collect();
            Some(Array2::from_shape_vec(size, convert_all(array)).map_err(|error| error.to_string()))
        }
        Err(ReadNpyError::WrongDescriptor(_)) => None,
        Err(error) => Some(Err(error.to_string())),
    }
}

pub(super) fn parse(bytes: &[u8]) -> Parsed {
    let raw = |values, meaning| Raw { values, top_down: false, pixel_um: None, meaning };
    let full = |full| Values::FullScale { full, max_height_um: None };
    if let Some(values) = try_type::<f64>(bytes, |v| v).or_else(|| try_type::<f32>(bytes, f64::from)) {
        return Ok(raw(values?, Values::Micrometres));
    }
    if let Some(values) = try_type::<u8>(bytes, f64::from) {
        return Ok(raw(values?, full(f64::from(u8::MAX))));
    }
    if let Some(values) = try_type::<u16>(bytes, f64::from) {
        return Ok(raw(values?, full(f64::from(u16::MAX))));
    }
    Err("its elements are of a type other than float64, float32, uint16, uint8".to_owned())
}
