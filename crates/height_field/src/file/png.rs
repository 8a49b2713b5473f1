//! PNG: grey of 8 or 16 bits, from the top row on. Black is height 0. White, the *full scale* 255 or 65535, is the
//! largest height.

use super::bytes::DEFLATE_RATIO_MAX;
use super::raw::FirstRow;
use super::units::{PIXELS_PER_METRE_MIN, UM_PER_M};
use super::{Meaning, Parsed, Raw, channel};
use crate::HeightField;
use ndarray::Array2;
use png::{BitDepth, ColorType, PixelDimensions, Unit};
use std::io::Cursor;

/// Keyword of the text chunk with the height of white in µm.
const MAX_HEIGHT: &str = "max_height_um";
/// Keywords of the text chunks with the pixel size along x and y in µm.
const PIXEL_SIZE: [&str; 2] = ["pixel_size_x_um", "pixel_size_y_um"];

/// Reads a picture of grey. The pixel size comes from the text chunks if both exist, otherwise from the resolution.
/// `channel_option` must be `None`, since the format has a single channel.
pub(super) fn parse(bytes: &[u8], channel_option: Option<&str>) -> Parsed {
    channel::refuse(channel_option)?;
    let mut reader = png::Decoder::new(Cursor::new(bytes)).read_info().map_err(|error| error.to_string())?;
    let (full, has_16_bits) = match (reader.info().color_type, reader.info().bit_depth) {
        (ColorType::Grayscale, BitDepth::Eight) => (255.0, false),
        (ColorType::Grayscale, BitDepth::Sixteen) => (65535.0, true),
        (colour, depth) => {
            return Err(format!("it is {colour:?} with {} bits; 8- or 16-bit grey is needed", depth as u8));
        }
    };
    let length = reader.output_buffer_size().ok_or("it is too large")?;
    if length as u64 / DEFLATE_RATIO_MAX > bytes.len() as u64 {
        return Err(format!("its {length} bytes of grey do not fit into {} packed ones", bytes.len()));
    }
    let mut buffer = vec![0; length];
    reader.next_frame(&mut buffer).map_err(|error| error.to_string())?;
    // Text chunks may follow the pixels.
    reader.finish().map_err(|error| error.to_string())?;
    let info = reader.info();
    let values: Vec<f64> = if has_16_bits {
        buffer.chunks_exact(2).map(|pair| f64::from(u16::from_be_bytes([pair[0], pair[1]]))).collect()
    } else {
        buffer.into_iter().map(f64::from).collect()
    };
    let size = (info.height as usize, info.width as usize);
    let values = Array2::from_shape_vec(size, values).map_err(|error| error.to_string())?;
    // Number in a text chunk; `None` without the chunk, an error unless the number is positive.
    let positive_number = |keyword: &str| {
        let chunk = info.uncompressed_latin1_text.iter().find(|chunk| chunk.keyword == keyword);
        chunk
            .map(|chunk| match chunk.text.trim().parse::<f64>() {
                Ok(value) if value.is_finite() && value > 0.0 => Ok(value),
                _ => Err(format!("text chunk {keyword} is \"{}\", not a positive number", chunk.text)),
            })
            .transpose()
    };
    // Resolutions below the limit are those of printers and screens.
    let resolution = info
        .pixel_dims
        .filter(|dims| matches!(dims.unit, Unit::Meter) && dims.xppu.min(dims.yppu) >= PIXELS_PER_METRE_MIN);
    let pixel_um = match (positive_number(PIXEL_SIZE[0])?, positive_number(PIXEL_SIZE[1])?) {
        (Some(dx), Some(dy)) => Some((dx, dy)),
        _ => resolution.map(|dims| (UM_PER_M / f64::from(dims.xppu), UM_PER_M / f64::from(dims.yppu))),
    };
    let meaning = Meaning::FullScale { full, max_height_um: positive_number(MAX_HEIGHT)? };
    Ok(Raw::new(values, meaning, FirstRow::Top).pixel(pixel_um))
}

/// Writes 16-bit grey from the lowest height (black) to the highest (white), with range and pixel size in text chunks.
pub(super) fn encode(field: &HeightField) -> Result<Vec<u8>, String> {
    let (nx, ny) = field.size();
    let width = u32::try_from(nx).map_err(|_| "too wide for a PNG")?;
    let height = u32::try_from(ny).map_err(|_| "too high for a PNG")?;
    let (low, high) = field.range_um();
    // A flat field is black; the height of its white is arbitrary.
    let range_um = if high > low { high - low } else { 1.0 };
    let pixels: Vec<u8> =
        field.rows_from_top().flat_map(|h| (((h - low) / range_um * 65535.0).round() as u16).to_be_bytes()).collect();
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, width, height);
    encoder.set_color(ColorType::Grayscale);
    encoder.set_depth(BitDepth::Sixteen);
    // Pixels per metre, which a PNG stores as whole numbers below 2^31. The text chunks are more exact.
    let per_metre = |step_um: f64| (UM_PER_M / step_um).round().clamp(1.0, f64::from(i32::MAX)) as u32;
    encoder.set_pixel_dims(Some(PixelDimensions {
        xppu: per_metre(field.dx_um()),
        yppu: per_metre(field.dy_um()),
        unit: Unit::Meter,
    }));
    for (keyword, value) in [(MAX_HEIGHT, range_um), (PIXEL_SIZE[0], field.dx_um()), (PIXEL_SIZE[1], field.dy_um())] {
        encoder.add_text_chunk(keyword.to_owned(), value.to_string()).map_err(|error| error.to_string())?;
    }
    let mut writer = encoder.write_header().map_err(|error| error.to_string())?;
    writer.write_image_data(&pixels).map_err(|error| error.to_string())?;
    writer.finish().map_err(|error| error.to_string())?;
    Ok(bytes)
}
