//! OpenEXR: one channel of floats, heights in µm, with the pixel size in attributes.

use super::raw::FirstRow;
use super::{Meaning, Parsed, Raw, channel};
use crate::HeightField;
use exr::prelude::*;
use ndarray::Array2;
use std::io::Cursor;
// The prelude of exr has another `Result`.
use std::result::Result;

/// Attributes with the pixel size along x and y, in µm.
const PIXEL_SIZE: [&str; 2] = ["pixelSizeX_um", "pixelSizeY_um"];

/// Largest number of points of all channels for each byte of the file. It bounds the memory for a damaged file. No
/// compression of OpenEXR reaches this ratio for a relief; a smaller bound might refuse flat reliefs.
const POINTS_PER_BYTE_MAX: usize = 2048;

/// Refuses a size that the file cannot hold, before memory is allocated for it.
fn check_size(bytes: &[u8]) -> Result<(), String> {
    let meta = exr::meta::MetaData::read_from_buffered(Cursor::new(bytes), false).map_err(|error| error.to_string())?;
    for header in &meta.headers {
        let (Vec2(width, height), channels) = (header.layer_size, header.channels.list.len());
        // `parse` decodes all channels before it refuses a file with more than one.
        let points = width.checked_mul(height).and_then(|points| points.checked_mul(channels));
        if points.is_none_or(|points| points / POINTS_PER_BYTE_MAX > bytes.len()) {
            return Err(format!("{width} × {height} × {channels} points do not fit into {} bytes", bytes.len()));
        }
    }
    Ok(())
}

/// Reads the single channel of floats. The file may have its pixel size as attributes of the layer or of the image.
/// `channel_option` must be `None`, since the format has a single channel.
pub(super) fn parse(bytes: &[u8], channel_option: Option<&str>) -> Parsed {
    channel::refuse(channel_option)?;
    check_size(bytes)?;
    let image = read()
        .no_deep_data()
        .largest_resolution_level()
        .all_channels()
        .first_valid_layer()
        .all_attributes()
        // Without this call the decoder starts its own pool of threads. The encoder below would do so, too.
        .non_parallel()
        .from_buffered(Cursor::new(bytes))
        .map_err(|error| error.to_string())?;
    let layer = &image.layer_data;
    let [heights] = layer.channel_data.list.as_slice() else {
        return Err(format!("it has {} channels; heights are a single one", layer.channel_data.list.len()));
    };
    if matches!(heights.sample_data, FlatSamples::U32(_)) {
        return Err("the channel holds integers; heights are floats in µm".to_owned());
    }
    let size = (layer.size.height(), layer.size.width());
    let values: Vec<f64> = heights.sample_data.values_as_f32().map(f64::from).collect();
    let values = Array2::from_shape_vec(size, values).map_err(|error| error.to_string())?;
    // A number from an attribute of the layer, or else of the whole image.
    let attribute = |name: &str| {
        let value = layer.attributes.other.get(name.as_bytes()).or_else(|| image.attributes.other.get(name.as_bytes()));
        match value {
            Some(AttributeValue::F64(value)) => Ok(Some(*value)),
            // The shortest decimal of the 32-bit float: 0.1 rather than 0.10000000149.
            Some(AttributeValue::F32(value)) => Ok(value.to_string().parse().ok()),
            Some(_) => Err(format!("attribute {name} is not a floating-point number")),
            None => Ok(None),
        }
    };
    let pixel_um = match (attribute(PIXEL_SIZE[0])?, attribute(PIXEL_SIZE[1])?) {
        (Some(dx), Some(dy)) => Some((dx, dy)),
        (None, None) => None,
        _ => return Err(format!("it has only one of the attributes {} and {}", PIXEL_SIZE[0], PIXEL_SIZE[1])),
    };
    Ok(Raw::new(values, Meaning::micrometres(), FirstRow::Top).pixel(pixel_um))
}

/// Writes heights in µm as 32-bit floats, with the pixel size in attributes.
pub(super) fn encode(field: &HeightField) -> Result<Vec<u8>, String> {
    let (nx, ny) = field.size();
    let samples: Vec<f32> = field.rows_from_top().map(|h| h as f32).collect();
    let heights = AnyChannel::new("height", FlatSamples::F32(samples));
    let mut attributes = LayerAttributes::default();
    for (name, value) in PIXEL_SIZE.into_iter().zip([field.dx_um(), field.dy_um()]) {
        attributes.other.insert(Text::from(name), AttributeValue::F64(value));
    }
    let channels = AnyChannels::sort(std::iter::once(heights).collect());
    let layer = Layer::new((nx, ny), attributes, Encoding::FAST_LOSSLESS, channels);
    let mut bytes = Vec::new();
    Image::from_layer(layer)
        .write()
        .non_parallel()
        .to_buffered(Cursor::new(&mut bytes))
        .map_err(|error| error.to_string())?;
    Ok(bytes)
}
