//! Two pictures as they are shown, and the sheet that shows them.

use super::{Mask, Picture};
use sunbeam::colour::srgb_bytes;

/// Both pictures exposed and clipped to [0, 1], black where nothing is compared.
pub struct DisplayPair {
    size: (usize, usize),
    linear: [Vec<[f64; 3]>; 2],
}

impl DisplayPair {
    pub(super) fn new(a: &Picture, b: &Picture, mask: Option<&Mask>, exposure_stops: f64) -> Self {
        let factor = exposure_stops.exp2();
        let shown = |picture: &Picture| {
            let pixel = |(i, rgb): (usize, &[f32; 3])| {
                let factor = if mask.is_none_or(|mask| mask.contains(i)) { factor } else { 0.0 };
                rgb.map(|value| (f64::from(value) * factor).clamp(0.0, 1.0))
            };
            picture.pixels().iter().enumerate().map(pixel).collect()
        };
        Self { size: a.size(), linear: [shown(a), shown(b)] }
    }

    /// Width and height.
    pub fn size(&self) -> (usize, usize) {
        self.size
    }

    /// The pixels of both pictures, linear and in [0, 1].
    pub fn linear(&self) -> [&[[f64; 3]]; 2] {
        self.linear.each_ref().map(Vec::as_slice)
    }

    /// The pixels of both pictures in 8-bit sRGB.
    pub fn bytes(&self) -> [Vec<u8>; 2] {
        self.linear.each_ref().map(|pixels| pixels.iter().flat_map(|rgb| srgb_bytes(*rgb)).collect())
    }

    /// Three pictures side by side in 8-bit sRGB: the first, the second, and `map` in the colours that FLIP uses
    /// (black 0, pale yellow 1). Returns the size of the sheet and its bytes.
    pub fn sheet(&self, map: &[f32]) -> ((usize, usize), Vec<u8>) {
        let (width, height) = self.size;
        let [a, b] = self.bytes();
        let map = super::flip::coloured(self.size, map);
        let rows = |bytes: &[u8], y: usize| bytes[3 * width * y..3 * width * (y + 1)].to_vec();
        let sheet = (0..height).flat_map(|y| [rows(&a, y), rows(&b, y), rows(&map, y)].concat()).collect();
        ((3 * width, height), sheet)
    }
}
