//! Files of what the realtime renderer draws.

use super::scene_args::Size;
use std::error::Error;
use std::path::Path;
use sunbeam::colour::{srgb_bytes, tone_map};

/// Writes linear sRGB radiance as 32-bit floats (.exr).
pub fn write_exr(path: &Path, Size(width, height): Size, picture: &[[f32; 3]]) -> Result<(), Box<dyn Error>> {
    let (width, height) = (width as usize, height as usize);
    exr::prelude::write_rgb_file(path, width, height, |x, y| picture[y * width + x].into())
        .map_err(|error| format!("{}: cannot be written: {error}", path.display()).into())
}

/// Writes the picture for the screen: brightened by so many stops, highlights compressed, sRGB (.png).
pub fn write_png(
    path: &Path,
    Size(width, height): Size,
    picture: &[[f32; 3]],
    exposure: f64,
) -> Result<(), Box<dyn Error>> {
    let shown = |pixel: &[f32; 3]| srgb_bytes(tone_map(pixel.map(f64::from), exposure));
    let bytes: Vec<u8> = picture.iter().flat_map(shown).collect();
    super::png::write(path, (width as usize, height as usize), png::ColorType::Rgb, &bytes)
}
