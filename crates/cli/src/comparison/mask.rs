//! The choice of the pixels that are compared, from an OpenEXR or PNG file.

use super::CompareError;
use super::picture::exr_channels;
use std::fs::File;
use std::io::BufReader;
use std::path::Path;

/// A choice of pixels.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Mask {
    size: (usize, usize),
    /// Whether each pixel is compared, by rows from the top.
    inside: Vec<bool>,
}

impl Mask {
    /// A mask of `size` (width, height) by rows from the top; `true` pixels are compared.
    ///
    /// # Errors
    /// A number of pixels that differs from the size.
    pub(crate) fn new(size: (usize, usize), inside: Vec<bool>) -> Result<Self, CompareError> {
        if size.0.checked_mul(size.1) != Some(inside.len()) {
            return Err(CompareError::Shape { size, found: inside.len() });
        }
        Ok(Self { size, inside })
    }

    /// Reads a mask from a picture: pixels with a channel above 0 are compared; alpha does not count.
    ///
    /// # Errors
    /// A file that is not a readable `.exr` or `.png`.
    pub(crate) fn read(path: impl AsRef<Path>) -> Result<Self, CompareError> {
        let path = path.as_ref();
        let extension = path.extension().and_then(|e| e.to_str()).unwrap_or_default().to_ascii_lowercase();
        match extension.as_str() {
            "exr" => Self::read_exr(path),
            "png" => Self::read_png(path),
            _ => {
                let reason = format!("extension {extension:?} is not supported; a mask is .exr or .png");
                Err(CompareError::File { path: path.to_owned(), reason })
            }
        }
    }

    /// Reads an OpenEXR file of any channels; the channel `A` is ignored.
    fn read_exr(path: &Path) -> Result<Self, CompareError> {
        let (size, channels) = exr_channels(path)?;
        let mut inside = vec![false; size.0 * size.1];
        for (_, values) in channels.iter().filter(|(name, _)| name != "A") {
            for (inside, value) in inside.iter_mut().zip(values) {
                *inside |= *value > 0.0;
            }
        }
        Self::new(size, inside)
    }

    /// Reads a PNG file of any colour type and depth; alpha is ignored.
    fn read_png(path: &Path) -> Result<Self, CompareError> {
        let unreadable = |reason: String| CompareError::File {
            path: path.to_owned(),
            reason: format!("cannot be read as PNG: {reason}"),
        };
        let file = File::open(path).map_err(|error| unreadable(error.to_string()))?;
        let mut decoder = png::Decoder::new(BufReader::new(file));
        decoder.set_transformations(png::Transformations::normalize_to_color8());
        let mut reader = decoder.read_info().map_err(|error| unreadable(error.to_string()))?;
        let length = reader.output_buffer_size().ok_or_else(|| unreadable("it is too large".to_owned()))?;
        let mut bytes = vec![0; length];
        let info = reader.next_frame(&mut bytes).map_err(|error| unreadable(error.to_string()))?;
        let (samples, colours) = match info.color_type {
            png::ColorType::Grayscale | png::ColorType::Indexed => (1, 1),
            png::ColorType::GrayscaleAlpha => (2, 1),
            png::ColorType::Rgb => (3, 3),
            png::ColorType::Rgba => (4, 3),
        };
        let inside = bytes[..info.buffer_size()].chunks_exact(samples).map(|p| p[..colours].iter().any(|v| *v > 0));
        Self::new((info.width as usize, info.height as usize), inside.collect())
    }

    /// Width and height.
    pub(crate) fn size(&self) -> (usize, usize) {
        self.size
    }

    /// Whether the pixel of an index is compared; indices run by rows from the top.
    pub(crate) fn contains(&self, index: usize) -> bool {
        self.inside.get(index).copied().unwrap_or(false)
    }
}
