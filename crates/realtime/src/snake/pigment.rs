//! The pigment of the snake as a texture of diffuse reflectances. All reflectances, widths and weights are chosen by
//! eye.
//!
//! The skin is an open sheet: the texture coordinate u runs along the body, and v across it, from the edge of one flank
//! (0) over the back (0.5) to the edge of the other (1).

use std::{fs::File, io::BufWriter, path::Path};

use super::{SnakeError, SnakeOptions, mesh::Surface, scales::Spot};
use rayon::prelude::*;
use sunbeam::colour::srgb_bytes;

/// Default size of a pigment texture in pixels along and across the body. The default skin is twice as long as wide,
/// so texels are square on it.
pub const PIGMENT_SIZE: (usize, usize) = (2048, 1024);
/// Largest accepted size of a side in pixels. It bounds the memory of a texture to 768 MiB.
const SIDE_MAX: usize = 16_384;

/// Linear sRGB reflectance of the back, blackish brown.
pub(crate) const BACK_REFLECTANCE: [f64; 3] = [0.022, 0.017, 0.014];
/// Linear sRGB reflectance of the rim of a scale.
const RIM_REFLECTANCE: [f64; 3] = [0.050, 0.041, 0.034];
/// Linear sRGB reflectance of the body's flanks, at the edges of the sheet.
const FLANK_REFLECTANCE: [f64; 3] = [0.080, 0.068, 0.057];

/// An 8-bit sRGB image of the skin's pigment, aligned with the mesh's texture coordinates.
#[derive(Debug, Clone, PartialEq)]
pub struct PigmentTexture {
    /// Pixels along the body (u, left to right).
    pub width: usize,
    /// Pixels across the body (v).
    pub height: usize,
    /// Encoded sRGB `[r, g, b]`, row by row from v = 0 on.
    pub pixels: Vec<[u8; 3]>,
}

/// The diffuse pigment of the snake that these options describe: blackish brown, paler at the rims of the scales and
/// down the flanks. The linear reflectances lie between 0.007 and 0.1.
///
/// The top row of the image is v = 0: Mitsuba 3 puts it there, and so does a texture uploaded row by row to a GPU.
///
/// # Errors
/// The errors of [`super::SnakeMesh::build`], and [`SnakeError::Count`] unless each side has 1 to 16 384 pixels.
pub fn pigment_texture(options: &SnakeOptions, width: usize, height: usize) -> Result<PigmentTexture, SnakeError> {
    options.check()?;
    for (field, found) in [("width", width), ("height", height)] {
        if !(1..=SIDE_MAX).contains(&found) {
            return Err(SnakeError::Count { field, found, least: 1, most: SIDE_MAX });
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

/// Linear sRGB reflectance of a point of a scale, at the texture coordinate `v`.
fn reflectance(spot: &Spot, v: f64) -> [f64; 3] {
    // Weight of the rim's colour. It grows with `edge`, from 0 below 0.72 to its maximum at the scale's edge, where
    // `edge` is 1. The maximum is halved on the half of the scale towards the root (`along` ≤ 0).
    let rim_weight_max = if spot.along > 0.0 { 1.0 } else { 0.5 };
    let rim = smoothstep(spot.edge, 0.72, 0.28) * rim_weight_max;
    // Weight of the flank's colour: 0 on the back, 1 at the edges of the sheet.
    let flank = smoothstep((v - 0.5).abs(), 0.30, 0.20);
    // The keel, the ridge along the scale's axis, is darker by a quarter on the axis, and by 1/e of that at |across| =
    // 0.15. `across` is ±1 at the scale's sides.
    let keel = 1.0 - 0.25 * (-(spot.across / 0.15).powi(2)).exp();
    // The random lightness of the scale, −1 to 1, changes its reflectance by up to a quarter.
    let shade = keel * (1.0 + 0.25 * spot.shade);
    std::array::from_fn(|c| {
        let skin = BACK_REFLECTANCE[c] + flank * (FLANK_REFLECTANCE[c] - BACK_REFLECTANCE[c]);
        // The rim is never darker than the skin inside the scale.
        shade * (skin + rim * (RIM_REFLECTANCE[c].max(skin) - skin))
    })
}

/// Smooth step from 0 at `start` to 1 at `start + width`.
fn smoothstep(x: f64, start: f64, width: f64) -> f64 {
    let t = ((x - start) / width).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

impl PigmentTexture {
    /// Writes the image as an 8-bit RGB PNG that is marked as sRGB.
    ///
    /// # Errors
    /// [`SnakeError::Write`] when the file cannot be created, [`SnakeError::Png`] when encoding or writing fails.
    pub fn write_png(&self, path: impl AsRef<Path>) -> Result<(), SnakeError> {
        let path = path.as_ref();
        let file = File::create(path).map_err(|source| SnakeError::Write { path: path.to_owned(), source })?;
        let refused = |source| SnakeError::Png { path: path.to_owned(), source };
        // The sides of a texture of `pigment_texture` are at most `SIDE_MAX`, so they fit in 32 bits.
        let mut encoder = png::Encoder::new(BufWriter::new(file), self.width as u32, self.height as u32);
        encoder.set_color(png::ColorType::Rgb);
        encoder.set_depth(png::BitDepth::Eight);
        encoder.set_source_srgb(png::SrgbRenderingIntent::Perceptual);
        let mut writer = encoder.write_header().map_err(refused)?;
        writer.write_image_data(self.pixels.as_flattened()).map_err(refused)?;
        writer.finish().map_err(refused)
    }
}
