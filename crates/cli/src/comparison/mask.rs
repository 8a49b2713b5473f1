//! A mask of the pixels to compare, from an OpenEXR or PNG file.

use super::CompareError;
use super::picture::{PIXELS_MAX, exr_channels};
use std::ffi::OsStr;
use std::io::Cursor;
use std::path::Path;

/// Upper bound on the compression ratio of a PNG: that of Deflate is at most 1032, and the rest is a margin. It bounds
/// the memory for a damaged PNG, whose header may state any size.
const DEFLATE_RATIO_MAX: usize = 1040;

/// The pixels that are compared.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Mask {
    /// Width and height in pixels.
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

    /// Reads a mask from a picture. Pixels with a channel above 0 are compared; alpha does not count.
    ///
    /// # Errors
    /// A file that is not a readable `.exr` or `.png`.
    pub(crate) fn read(path: impl AsRef<Path>) -> Result<Self, CompareError> {
        let path = path.as_ref();
        let extension = path.extension().and_then(OsStr::to_str).unwrap_or_default().to_ascii_lowercase();
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
        // `exr_channels` refuses sizes whose product would overflow.
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
        let file = std::fs::read(path).map_err(|error| unreadable(error.to_string()))?;
        let mut decoder = png::Decoder::new(Cursor::new(&file));
        // Palettes become colours, and samples of less than 8 bits become bytes.
        decoder.set_transformations(png::Transformations::EXPAND);
        let header = decoder.read_header_info().map_err(|error| unreadable(error.to_string()))?;
        let (width, height) = header.size();
        // A damaged header may state any size, so it is checked before memory is allocated.
        if u64::from(width) * u64::from(height) > PIXELS_MAX as u64 {
            return Err(unreadable(format!("it has {width} x {height} pixels; at most 2^28 can be compared")));
        }
        // Bytes of all samples as Deflate returns them: before the expansion, with the filter byte of each row.
        let (unpacked, packed) = (header.raw_bytes(), file.len());
        if unpacked / DEFLATE_RATIO_MAX > packed {
            return Err(unreadable(format!("its {unpacked} bytes of samples do not fit into {packed} packed ones")));
        }
        let mut reader = decoder.read_info().map_err(|error| unreadable(error.to_string()))?;
        let length = reader.output_buffer_size().ok_or_else(|| unreadable("it is too large".to_owned()))?;
        let mut bytes = vec![0; length];
        let info = reader.next_frame(&mut bytes).map_err(|error| unreadable(error.to_string()))?;
        // Samples of a pixel, and how many of them are colours; alpha comes last. The expansion leaves no indexed
        // colours, but the `match` needs their case.
        let (samples, colours) = match info.color_type {
            png::ColorType::Grayscale | png::ColorType::Indexed => (1, 1),
            png::ColorType::GrayscaleAlpha => (2, 1),
            png::ColorType::Rgb => (3, 3),
            png::ColorType::Rgba => (4, 3),
        };
        let sample_bytes = if info.bit_depth == png::BitDepth::Sixteen { 2 } else { 1 };
        let pixels = bytes[..info.buffer_size()].chunks_exact(samples * sample_bytes);
        let inside = pixels.map(|pixel| pixel[..colours * sample_bytes].iter().any(|byte| *byte > 0)).collect();
        Self::new((info.width as usize, info.height as usize), inside)
    }

    /// Width and height in pixels.
    pub(crate) fn size(&self) -> (usize, usize) {
        self.size
    }

    /// Whether the pixel with this index is compared. Indices run by rows from the top; those beyond the last pixel are
    /// not compared.
    pub(crate) fn contains(&self, index: usize) -> bool {
        self.inside.get(index).copied().unwrap_or(false)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs::File;

    #[test]
    fn a_size_beyond_memory_or_the_file_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("mask.png");
        for (side, reason) in [
            (200_000, "200000 x 200000 pixels; at most 2^28"),
            // Each row has a byte for its filter.
            (10_000, "400010000 bytes of samples do not fit into"),
        ] {
            let mut encoder = png::Encoder::new(File::create(&path).unwrap(), side, side);
            encoder.set_color(png::ColorType::Rgba);
            drop(encoder.write_header().unwrap());
            let message = Mask::read(&path).unwrap_err().to_string();
            assert!(message.contains("mask.png") && message.contains(reason), "{message}");
        }
    }

    #[test]
    fn the_smallest_value_of_16_bits_counts() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("mask.png");
        let mut encoder = png::Encoder::new(File::create(&path).unwrap(), 2, 1);
        encoder.set_color(png::ColorType::Grayscale);
        encoder.set_depth(png::BitDepth::Sixteen);
        let mut writer = encoder.write_header().unwrap();
        writer.write_image_data(&[0, 0, 0, 1]).unwrap();
        writer.finish().unwrap();
        let mask = Mask::read(&path).unwrap();
        assert_eq!((mask.size(), mask.contains(0), mask.contains(1)), ((2, 1), false, true));
    }
}
