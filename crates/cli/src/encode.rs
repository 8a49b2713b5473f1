//! Encoders of pictures and arrays into memory. Files are written from there, so that a failure leaves no partial file.

use ndarray::{ArrayBase, Data, Dimension};
use ndarray_npy::{WritableElement, WriteNpyExt};
use std::error::Error;
use std::io::Cursor;
use sunbeam::colour::{srgb_bytes, tone_map};

/// Encodes linear sRGB as OpenEXR in 32-bit floats.
///
/// `size` is (width, height). `pixel` returns the pixel with an index; indices run by rows from the top.
///
/// # Errors
/// The encoder's message, for a size that it does not support.
pub fn exr(size: (usize, usize), pixel: impl Fn(usize) -> [f32; 3] + Sync) -> Result<Vec<u8>, Box<dyn Error>> {
    use exr::prelude::{Image, SpecificChannels, Vec2, WritableImage};
    let mut bytes = Cursor::new(Vec::new());
    let channels = SpecificChannels::rgb(|Vec2(x, y): Vec2<usize>| <(f32, f32, f32)>::from(pixel(y * size.0 + x)));
    Image::from_channels(size, channels).write().to_buffered(&mut bytes)?;
    Ok(bytes.into_inner())
}

/// Encodes 8-bit pixels as PNG.
///
/// `size` is (width, height). `pixels` has one byte for each channel of the colour type, by rows from the top. RGB is
/// marked as sRGB.
///
/// # Errors
/// The encoder's message, for a size that it does not support or that does not fit the number of bytes.
pub fn png(size: (usize, usize), colour: png::ColorType, pixels: &[u8]) -> Result<Vec<u8>, Box<dyn Error>> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, u32::try_from(size.0)?, u32::try_from(size.1)?);
    encoder.set_color(colour);
    encoder.set_depth(png::BitDepth::Eight);
    if colour == png::ColorType::Rgb {
        encoder.set_source_srgb(png::SrgbRenderingIntent::Perceptual);
    }
    let mut writer = encoder.write_header()?;
    writer.write_image_data(pixels)?;
    writer.finish()?;
    Ok(bytes)
}

/// Encodes linear sRGB radiance, by rows from the top, as a PNG for the screen.
///
/// `size` is (width, height). The radiance is multiplied by `2^stops`, and highlights are compressed.
///
/// # Errors
/// The errors of [`png()`].
pub fn tone_mapped_png(size: (usize, usize), picture: &[[f32; 3]], stops: f64) -> Result<Vec<u8>, Box<dyn Error>> {
    let shown = |pixel: &[f32; 3]| srgb_bytes(tone_map(pixel.map(f64::from), stops));
    let bytes: Vec<u8> = picture.iter().flat_map(shown).collect();
    png(size, png::ColorType::Rgb, &bytes)
}

/// Encodes an array in NumPy's format `.npy`, with the element type and the shape of `array`.
///
/// # Errors
/// The encoder's message, for a header that it cannot write. Writing to memory itself does not fail.
pub fn npy<A, S, D>(array: &ArrayBase<S, D>) -> Result<Vec<u8>, Box<dyn Error>>
where
    A: WritableElement,
    S: Data<Elem = A>,
    D: Dimension,
{
    let mut bytes = Vec::new();
    array.write_npy(&mut bytes)?;
    Ok(bytes)
}
