//! Encodes reliefs, BRDF maps and rendered pictures: RGBA bytes for a canvas, OpenEXR and PNG files.
//!
//! A BRDF map has `f_r` in 1/sr over the hemisphere of outgoing directions, as a disc in a square of `side`² pixels
//! ([`map_direction`]). Colours are linear sRGB. All pictures have their pixels row by row, from the top.

use crate::error::WebError;
use exr::prelude::{Encoding, Image, Layer, LayerAttributes, SpecificChannels, WritableImage};
use std::io::Cursor;
use sunbeam::colour::{automatic_exposure, srgb_bytes, tone_map};
use sunbeam::height_field::HeightField;
use sunbeam::scattering::map_direction;

/// A grey picture of a relief with its scale.
pub struct ReliefPicture {
    /// Width and height in pixels.
    pub size: (usize, usize),
    /// Size of a pixel of the picture in µm.
    pub um_per_pixel: f64,
    /// Length of the scale bar in µm: 1, 2 or 5 times a power of ten, between 2/15 and 1/3 of the width.
    pub bar_um: f64,
    /// RGBA bytes, rows from the top.
    pub rgba: Vec<u8>,
}

/// A grey picture of the relief in true proportions, of at most `side_max` pixels along each side. The lowest height is
/// black and the highest white. +x is right and +y up.
pub fn relief_picture(field: &HeightField, side_max: usize) -> ReliefPicture {
    let (lx, ly) = field.extent_um();
    let (nx, ny) = field.size();
    let long_um = lx.max(ly);
    // At most four pixels of the picture for each pixel of the relief, along each side. They repeat its height, and
    // more repeats would show nothing new.
    let side = side_max.max(1).min(4 * nx.max(ny));
    let um_per_pixel = long_um / side as f64;
    let pixels = |length_um: f64| ((length_um / um_per_pixel).round() as usize).clamp(1, side);
    let size = (pixels(lx), pixels(ly));
    let (low, high) = field.range_um();
    // Grey levels per µm. A flat relief is black.
    let scale = if high > low { 255.0 / (high - low) } else { 0.0 };
    let mut rgba = Vec::with_capacity(4 * size.0 * size.1);
    for row in 0..size.1 {
        // Rows of the relief grow along +y, rows of the picture downwards.
        let iy = ny - 1 - row * ny / size.1;
        for column in 0..size.0 {
            let height = field.heights_um()[[iy, column * nx / size.0]];
            let grey = ((height - low) * scale).round() as u8;
            rgba.extend([grey, grey, grey, 255]);
        }
    }
    ReliefPicture { size, um_per_pixel, bar_um: round_length(lx / 3.0), rgba }
}

/// The largest number of the form 1, 2 or 5 times a power of ten up to `most` > 0.
fn round_length(most: f64) -> f64 {
    // In exact arithmetic `decade` is at most `most`. Where a rounded logarithm makes it larger, it is the result.
    let decade = 10f64.powf(most.log10().floor());
    [5.0, 2.0, 1.0].into_iter().map(|digit| digit * decade).find(|length| *length <= most).unwrap_or(decade)
}

/// A BRDF map of `side`² pixels as RGBA bytes in sRGB, transparent outside the disc. `exposure` is a linear factor;
/// `None` selects a factor at which few of the disc's pixels clip ([`automatic_exposure`]).
///
/// # Errors
/// [`WebError::Internal`] for another number of pixels than `side²`.
pub fn map_picture(rgb: &[[f32; 3]], side: usize, exposure: Option<f64>) -> Result<Vec<u8>, WebError> {
    check_square(rgb, side)?;
    let is_inside = |i: usize| map_direction(i % side, i / side, side).is_some();
    let inside = (0..rgb.len()).filter(|&i| is_inside(i)).map(|i| rgb[i].map(f64::from));
    let factor = exposure.unwrap_or_else(|| automatic_exposure(inside));
    let pixel = |(i, colour): (usize, &[f32; 3])| {
        let [r, g, b] = srgb_bytes(colour.map(|value| f64::from(value) * factor));
        [r, g, b, if is_inside(i) { 255 } else { 0 }]
    };
    Ok(rgb.iter().enumerate().flat_map(pixel).collect())
}

/// A BRDF map as an OpenEXR file like those of `sunbeam brdf-map`: linear sRGB in 32-bit floats.
///
/// # Errors
/// [`WebError::Internal`] for another number of pixels than `side²`.
pub fn map_exr(rgb: &[[f32; 3]], side: usize) -> Result<Vec<u8>, WebError> {
    check_square(rgb, side)?;
    let pixel =
        |position: exr::math::Vec2<usize>| -> (f32, f32, f32) { rgb[position.y() * side + position.x()].into() };
    let layer =
        Layer::new((side, side), LayerAttributes::named(""), Encoding::FAST_LOSSLESS, SpecificChannels::rgb(pixel));
    let mut file = Cursor::new(Vec::new());
    // Browsers run the library in one thread.
    let written = Image::from_layer(layer).write().non_parallel().to_buffered(&mut file);
    written.map_err(|error| WebError::Internal(error.to_string()))?;
    Ok(file.into_inner())
}

/// A rendered picture as a PNG file like those of `sunbeam render --png`: brightened by `stops`, tone-mapped, 8-bit
/// sRGB.
///
/// # Errors
/// [`WebError::Internal`] for another number of pixels than `width · height`.
pub fn picture_png(rgb: &[[f32; 3]], (width, height): (u32, u32), stops: f64) -> Result<Vec<u8>, WebError> {
    let pixels: Vec<u8> = rgb.iter().flat_map(|pixel| tone_mapped_bytes(*pixel, stops)).collect();
    let mut file = Vec::new();
    let mut encoder = png::Encoder::new(&mut file, width, height);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.set_source_srgb(png::SrgbRenderingIntent::Perceptual);
    let refused = |error: png::EncodingError| WebError::Internal(error.to_string());
    let mut writer = encoder.write_header().map_err(refused)?;
    writer.write_image_data(&pixels).map_err(refused)?;
    writer.finish().map_err(refused)?;
    Ok(file)
}

/// sRGB bytes of a colour of a rendered picture (linear sRGB), brightened by `stops` and tone-mapped.
pub fn tone_mapped_bytes(rgb: [f32; 3], stops: f64) -> [u8; 3] {
    srgb_bytes(tone_map(rgb.map(f64::from), stops))
}

/// Returns an error unless `rgb` has `side²` > 0 colours.
fn check_square(rgb: &[[f32; 3]], side: usize) -> Result<(), WebError> {
    if side > 0 && side.checked_mul(side) == Some(rgb.len()) {
        return Ok(());
    }
    Err(WebError::Internal(format!("{} colours are not a map of {side} × {side}", rgb.len())))
}

#[cfg(test)]
mod tests {
    use super::*;
    use exr::prelude::{ReadChannels, ReadLayers};
    use sunbeam::height_field::Preset;

    #[test]
    fn pictures_of_reliefs_keep_proportions_and_have_round_bars() {
        let field = Preset::Cd.build(None, None).unwrap();
        let picture = relief_picture(&field, 200);
        let (lx, ly) = field.extent_um();
        assert_eq!(picture.rgba.len(), 4 * picture.size.0 * picture.size.1);
        // Each side is rounded to a whole pixel.
        let proportion = picture.size.0 as f64 / picture.size.1 as f64;
        assert!((proportion / (lx / ly) - 1.0).abs() < 0.02);
        assert!(picture.bar_um >= lx * 2.0 / 15.0 && picture.bar_um <= lx / 3.0);
        for (most, length) in [(1.0, 1.0), (4.99, 2.0), (0.07, 0.05), (33.0, 20.0)] {
            assert!((round_length(most) - length).abs() < 1e-12);
        }
    }

    #[test]
    fn a_written_map_is_read_back() {
        let map: Vec<[f32; 3]> = (0..16).map(|i| [i as f32, -0.5, 1e3]).collect();
        let file = map_exr(&map, 4).unwrap();
        let read = exr::prelude::read().no_deep_data().largest_resolution_level().all_channels();
        let read = read.first_valid_layer().all_attributes().from_buffered(Cursor::new(file)).unwrap();
        for (name, c) in [("R", 0), ("G", 1), ("B", 2)] {
            let channels = &read.layer_data.channel_data.list;
            let channel = channels.iter().find(|channel| channel.name.to_string() == name).unwrap();
            let expected: Vec<f32> = map.iter().map(|rgb| rgb[c]).collect();
            assert_eq!(channel.sample_data.values_as_f32().collect::<Vec<f32>>(), expected);
        }
        let shown = map_picture(&map, 4, None).unwrap();
        // Alphas of pixel 0, a corner outside the disc, and of pixel 5, in row 1 and column 1.
        assert_eq!((shown.len(), shown[3], shown[4 * 5 + 3]), (16 * 4, 0, 255));
        assert!(map_exr(&map, 5).is_err() && map_picture(&map, 0, None).is_err());
    }
}
