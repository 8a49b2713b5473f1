//! Two pictures as shown on a screen, exposed and clipped to [0, 1], and a sheet with both and the map of their
//! differences.

use super::{Mask, Picture};
use sunbeam::colour::srgb_bytes;

/// Both pictures exposed and clipped to [0, 1]; black outside the mask.
pub(crate) struct DisplayPair {
    /// Width and height in pixels.
    size: (usize, usize),
    /// Pixels of both pictures in linear sRGB, by rows from the top.
    linear: [Vec<[f64; 3]>; 2],
}

impl DisplayPair {
    /// The pictures multiplied by `2^exposure_stops`, clipped, and black where `mask` is false. All have the same size.
    pub(super) fn new(a: &Picture, b: &Picture, mask: Option<&Mask>, exposure_stops: f64) -> Self {
        let exposure = exposure_stops.exp2();
        let shown = |picture: &Picture| {
            let pixel = |(i, rgb): (usize, &[f32; 3])| {
                let factor = if mask.is_none_or(|mask| mask.contains(i)) { exposure } else { 0.0 };
                rgb.map(|value| (f64::from(value) * factor).clamp(0.0, 1.0))
            };
            picture.pixels().iter().enumerate().map(pixel).collect()
        };
        Self { size: a.size(), linear: [shown(a), shown(b)] }
    }

    /// Width and height in pixels.
    pub(crate) fn size(&self) -> (usize, usize) {
        self.size
    }

    /// The pixels of both pictures in linear sRGB, in [0, 1], by rows from the top.
    pub(crate) fn linear(&self) -> [&[[f64; 3]]; 2] {
        self.linear.each_ref().map(Vec::as_slice)
    }

    /// The bytes of both pictures in 8-bit sRGB: three for each pixel, by rows from the top.
    pub(crate) fn bytes(&self) -> [Vec<u8>; 2] {
        self.linear.each_ref().map(|pixels| pixels.iter().flat_map(|rgb| srgb_bytes(*rgb)).collect())
    }

    /// The sheet's width and height in pixels, and its bytes in 8-bit sRGB. It shows three pictures side by side: the
    /// first, the second, and the map of their differences by FLIP.
    ///
    /// `flip_map` has a value in [0, 1] for each pixel. It is shown in the colours of FLIP's authors, from black (0) to
    /// pale yellow (1).
    pub(crate) fn sheet(&self, flip_map: &[f32]) -> ((usize, usize), Vec<u8>) {
        let (width, height) = self.size;
        let [a, b] = self.bytes();
        let map = super::flip::coloured(self.size, flip_map);
        let row = |bytes: &[u8], y: usize| bytes[3 * width * y..3 * width * (y + 1)].to_vec();
        let sheet = (0..height).flat_map(|y| [row(&a, y), row(&b, y), row(&map, y)].concat()).collect();
        ((3 * width, height), sheet)
    }
}
