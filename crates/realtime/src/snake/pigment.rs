//! The pigment of the snake as a texture: diffuse reflectances chosen by eye.

use std::{fs::File, io::BufWriter, path::Path};

use super::{
    SnakeError, SnakeOptions,
    mesh::Surface,
    scales::{Spot, smooth},
};
use rayon::prelude::*;
use sunbeam::colour::srgb_bytes;

/// Default size of a pigment texture in pixels along and around the body; the skin is twice as long as wide.
pub const PIGMENT_SIZE: (usize, usize) = (2048, 1024);

/// Linear reflectance of the back.
const BACK: [f64; 3] = [0.022, 0.017, 0.014];
/// Linear reflectance of the rim of a scale.
const RIM: [f64; 3] = [0.050, 0.041, 0.034];
/// Linear reflectance of the flanks towards the belly.
const FLANK: [f64; 3] = [0.080, 0.068, 0.057];

/// An 8-bit sRGB image of the skin's pigment, aligned with the mesh's texture coordinates.
#[derive(Debug, Clone, PartialEq)]
pub struct PigmentTexture {
    /// Pixels along the body (u, left to right).
    pub width: usize,
    /// Pixels around the body (v).
    pub height: usize,
    /// `[r, g, b]`, sRGB-encoded, rows from v = 0 on.
    pub pixels: Vec<[u8; 3]>,
}

/// The diffuse pigment of the snake that these options describe: blackish brown (linear reflectance
/// about 0.02 to 0.09), paler at the rims of the scales and down the flanks.
///
/// The top row of the image is v = 0: Mitsuba 3 puts it there, and so does a texture uploaded row by row to a GPU.
///
/// # Errors
/// The errors of [`super::SnakeMesh::build`], and [`SnakeError::Count`] unless each side has 1 to 16 384 pixels.
pub fn pigment_texture(options: &SnakeOptions, width: usize, height: usize) -> Result<PigmentTexture, SnakeError> {
    options.check()?;
    for (field, found) in [("width", width), ("height", height)] {
        if !(1..=16_384).contains(&found) {
            return Err(SnakeError::Count { field, found, least: 1, most: 16_384 });
        }
    }
    let surface = Surface::new(options);
    let mut pixels = vec![[0; 3]; width * height];
    pixels.par_chunks_mut(width).enumerate().for_each(|(row, pixels)| {
        let v = (row as f64 + 0.5) / height as f64;
        for (column, pixel) in pixels.iter_mut().enumerate() {
            let u = (column as f64 + 0.5) / width as f64;
            *pixel = srgb_bytes(reflectance(&surface.scales.at(u, v), v));
        }
    });
    Ok(PigmentTexture { width, height, pixels })
}

/// Linear reflectance of a point of a scale at `v` around the body; all numbers are chosen by eye.
fn reflectance(spot: &Spot, v: f64) -> [f64; 3] {
    // 0 inside the scale to 1 at its edge, which is paler on the half towards the tip.
    let rim = smooth(((spot.edge - 0.72) / 0.28).clamp(0.0, 1.0)) * if spot.along > 0.0 { 1.0 } else { 0.5 };
    // 0 on the back to 1 at the rims of the sheet.
    let flank = smooth((((v - 0.5).abs() - 0.30) / 0.20).clamp(0.0, 1.0));
    // Darker along the keel, the axis of the scale.
    let keel = 1.0 - 0.25 * (-(spot.across / 0.15).powi(2)).exp();
    let shade = keel * (1.0 + 0.25 * spot.shade);
    std::array::from_fn(|c| {
        let base = BACK[c] + flank * (FLANK[c] - BACK[c]);
        shade * (base + rim * (RIM[c].max(base) - base))
    })
}

impl PigmentTexture {
    /// Writes the image as an 8-bit RGB PNG that is marked as sRGB.
    ///
    /// # Errors
    /// [`SnakeError::Write`] when the file cannot be made, [`SnakeError::Png`] when encoding fails.
    pub fn write_png(&self, path: impl AsRef<Path>) -> Result<(), SnakeError> {
        let path = path.as_ref();
        let file = File::create(path).map_err(|source| SnakeError::Write { path: path.to_owned(), source })?;
        let refused = |source| SnakeError::Png { path: path.to_owned(), source };
        // Both sides are at most 16 384.
        let mut encoder = png::Encoder::new(BufWriter::new(file), self.width as u32, self.height as u32);
        encoder.set_color(png::ColorType::Rgb);
        encoder.set_depth(png::BitDepth::Eight);
        encoder.set_source_srgb(png::SrgbRenderingIntent::Perceptual);
        let mut writer = encoder.write_header().map_err(refused)?;
        writer.write_image_data(self.pixels.as_flattened()).map_err(refused)?;
        writer.finish().map_err(refused)
    }
}
