//! A picture in linear sRGB, read from an OpenEXR file. A *sample* is the number of one channel at one pixel.

use super::CompareError;
use exr::meta::MetaData;
use exr::prelude::{FlatSamples, ReadChannels, ReadLayers, Vec2, read};
use std::io::Cursor;
use std::path::Path;

/// Largest number of pixels. FLIP indexes three channels of one byte each with 32 bits: 3 · 2^28 fits.
pub(super) const PIXELS_MAX: usize = 1 << 28;
/// Largest number of samples for each byte of an OpenEXR file. It bounds the memory for a damaged file, whose header
/// may state any size. Chosen: four times the 516 samples of 16 bits in a byte of DEFLATE at its largest ratio, 1032.
/// Only a picture of a single colour in DWA compression exceeds it; it is refused.
const SAMPLES_PER_BYTE_MAX: usize = 2048;
/// Names of the channels in an OpenEXR file.
const CHANNELS: [char; 3] = ['R', 'G', 'B'];

/// A picture in linear sRGB. Channels are finite; those of out-of-gamut colours may be negative.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Picture {
    /// Width and height in pixels.
    size: (usize, usize),
    /// Pixels by rows from the top.
    pixels: Vec<[f32; 3]>,
}

impl Picture {
    /// A picture of `size` (width, height), its pixels by rows from the top.
    ///
    /// # Errors
    /// A number of pixels that differs from the size, is 0 or above [`PIXELS_MAX`]; a channel that is NaN or infinite.
    pub(crate) fn new(size: (usize, usize), pixels: Vec<[f32; 3]>) -> Result<Self, CompareError> {
        if !(1..=PIXELS_MAX).contains(&pixels.len()) || size.0.checked_mul(size.1) != Some(pixels.len()) {
            return Err(CompareError::Shape { size, found: pixels.len() });
        }
        for (i, rgb) in pixels.iter().enumerate() {
            if let Some(c) = rgb.iter().position(|value| !value.is_finite()) {
                let (column, row) = (i % size.0, i / size.0);
                return Err(CompareError::NotFinite { column, row, channel: CHANNELS[c], value: rgb[c] });
            }
        }
        Ok(Self { size, pixels })
    }

    /// Reads the channels R, G and B of an OpenEXR file and ignores the others, such as alpha.
    ///
    /// # Errors
    /// A file that cannot be read, a missing channel, and the errors of [`Picture::new`].
    pub(crate) fn read_exr(path: impl AsRef<Path>) -> Result<Self, CompareError> {
        let path = path.as_ref();
        let (size, channels) = exr_channels(path)?;
        let channel = |wanted: char| {
            let found = channels.iter().find(|(name, _)| name.chars().eq([wanted]));
            found.map(|(_, values)| values).ok_or_else(|| {
                let present = channels.iter().map(|(name, _)| name.as_str()).collect::<Vec<_>>().join(", ");
                let reason = format!("there is no channel {wanted}, only {present}; R, G and B are needed");
                CompareError::File { path: path.to_owned(), reason }
            })
        };
        let [r, g, b] = [channel('R')?, channel('G')?, channel('B')?];
        let pixels = r.iter().zip(g).zip(b).map(|((r, g), b)| [*r, *g, *b]).collect();
        Self::new(size, pixels).map_err(|error| error.in_file(path))
    }

    /// Width and height in pixels.
    pub(crate) fn size(&self) -> (usize, usize) {
        self.size
    }

    /// The pixels by rows from the top.
    pub(crate) fn pixels(&self) -> &[[f32; 3]] {
        &self.pixels
    }
}

/// Channels by name, each with its values by rows from the top.
type Channels = Vec<(String, Vec<f32>)>;

/// The size (width, height) and the channels of an OpenEXR file's first layer, at its full resolution.
///
/// # Errors
/// A file that cannot be read as OpenEXR, whose samples are deep, or whose size exceeds what it can hold.
pub(super) fn exr_channels(path: &Path) -> Result<((usize, usize), Channels), CompareError> {
    let unreadable = |reason: String| CompareError::File {
        path: path.to_owned(),
        reason: format!("cannot be read as OpenEXR: {reason}"),
    };
    let bytes = std::fs::read(path).map_err(|error| unreadable(error.to_string()))?;
    check_size(&bytes).map_err(unreadable)?;
    let image = read()
        .no_deep_data()
        .largest_resolution_level()
        .all_channels()
        .first_valid_layer()
        .all_attributes()
        .from_buffered(Cursor::new(&bytes))
        .map_err(|error| unreadable(error.to_string()))?;
    let layer = image.layer_data;
    let values = |samples: &FlatSamples| samples.values_as_f32().collect::<Vec<_>>();
    let channels =
        layer.channel_data.list.iter().map(|channel| (channel.name.to_string(), values(&channel.sample_data)));
    Ok(((layer.size.width(), layer.size.height()), channels.collect()))
}

/// Refuses a size that the file cannot hold or that exceeds [`PIXELS_MAX`], before memory is allocated for it.
fn check_size(bytes: &[u8]) -> Result<(), String> {
    let pedantic = false;
    let meta = MetaData::read_from_buffered(Cursor::new(bytes), pedantic).map_err(|error| error.to_string())?;
    for header in &meta.headers {
        let Vec2(width, height) = header.layer_size;
        // Even for a file without channels, a mask (mask.rs) allocates one flag for each pixel.
        let channels = header.channels.list.len().max(1);
        let most = PIXELS_MAX.saturating_mul(channels).min(SAMPLES_PER_BYTE_MAX.saturating_mul(bytes.len()));
        let samples = width.checked_mul(height).and_then(|pixels| pixels.checked_mul(channels));
        if samples.is_none_or(|samples| samples > most) {
            let file = bytes.len();
            return Err(format!(
                "it has {width} x {height} x {channels} samples; of {file} bytes at most {most} are read"
            ));
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::encode;

    #[test]
    fn sizes_beyond_the_file_are_refused() {
        let mut bytes = encode::exr((2, 2), |_| [0.5; 3]).unwrap();
        let window = b"dataWindow\0box2i\0";
        // The attribute's length, first column and first row come before the last column and row.
        let last = bytes.windows(window.len()).position(|found| found == window).unwrap() + window.len() + 12;
        bytes[last..last + 8].copy_from_slice(&[99_999_i32.to_le_bytes(); 2].concat());
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("huge.exr");
        std::fs::write(&path, &bytes).unwrap();
        let message = Picture::read_exr(&path).unwrap_err().to_string();
        let limit = format!("100000 x 100000 x 3 samples; of {} bytes at most", bytes.len());
        assert!(message.contains("huge.exr") && message.contains(&limit) && !message.contains('\n'), "{message}");
    }

    #[test]
    fn sizes_that_differ_from_the_number_of_pixels_are_refused() {
        for (size, count) in [((2, 2), 3), ((0, 0), 0), ((usize::MAX, 2), 2)] {
            let error = Picture::new(size, vec![[0.0; 3]; count]).unwrap_err();
            assert!(matches!(error, CompareError::Shape { found, .. } if found == count), "{error}");
        }
    }

    #[test]
    fn a_nan_is_named_with_its_pixel_and_channel() {
        let mut pixels = vec![[0.0; 3]; 6];
        pixels[5][1] = f32::NAN;
        let message = Picture::new((3, 2), pixels).unwrap_err().to_string();
        assert!(message.contains("column 2, row 1") && message.contains("G = NaN"), "{message}");
    }
}
