//! 8-bit PNG files.

use std::error::Error;
use std::fs::File;
use std::io::BufWriter;
use std::path::Path;

/// Writes rows from the top; `pixels` holds as many bytes as `size` (width, height) and the colour type ask for.
pub fn write(path: &Path, size: (usize, usize), colour: png::ColorType, pixels: &[u8]) -> Result<(), Box<dyn Error>> {
    encode(path, size, colour, pixels).map_err(|error| format!("{}: cannot be written: {error}", path.display()).into())
}

fn encode(
    path: &Path,
    (width, height): (usize, usize),
    colour: png::ColorType,
    pixels: &[u8],
) -> Result<(), Box<dyn Error>> {
    let file = BufWriter::new(File::create(path)?);
    let mut encoder = png::Encoder::new(file, u32::try_from(width)?, u32::try_from(height)?);
    encoder.set_color(colour);
    encoder.set_depth(png::BitDepth::Eight);
    if colour == png::ColorType::Rgb {
        encoder.set_source_srgb(png::SrgbRenderingIntent::Perceptual);
    }
    let mut writer = encoder.write_header()?;
    writer.write_image_data(pixels)?;
    Ok(writer.finish()?)
}
