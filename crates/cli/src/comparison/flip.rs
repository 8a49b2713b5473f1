//! The perceptual metric FLIP for low-dynamic-range pictures. The crate `nv_flip` wraps the code of its authors.
//!
//! P. Andersson, J. Nilsson, T. Akenine-Möller, M. Oskarsson, K. Åström, M. D. Fairchild, *FLIP: A Difference Evaluator
//! for Alternating Images*, Proc. ACM Comput. Graph. Interact. Tech. 3(2), 2020. The input is 8-bit sRGB. The viewing
//! distance is the default of the authors: 67 pixels per degree, as on a monitor of 3840 pixels and 0.7 m width that is
//! seen from 0.7 m.

use super::DisplayPair;
use nv_flip::{DEFAULT_PIXELS_PER_DEGREE, FlipImageFloat, FlipImageRgb8, magma_lut};

/// FLIP's error of each pixel, in [0, 1], by rows from the top.
pub(super) fn error_map(shown: &DisplayPair) -> Vec<f32> {
    let (width, height) = size_in_32_bits(shown.size());
    let [a, b] = shown.bytes().map(|bytes| FlipImageRgb8::with_data(width, height, &bytes));
    nv_flip::flip(a, b, DEFAULT_PIXELS_PER_DEGREE).to_vec()
}

/// The map `errors` in the colours "magma", dark for 0 and bright for 1, as 8-bit sRGB by rows from the top. `size` is
/// its width and height.
pub(super) fn coloured(size: (usize, usize), errors: &[f32]) -> Vec<u8> {
    let (width, height) = size_in_32_bits(size);
    FlipImageFloat::with_data(width, height, errors).apply_color_lut(&magma_lut()).to_vec()
}

/// Width and height in 32 bits. They fit, since a [`super::Picture`] has at most 2^28 pixels.
fn size_in_32_bits((width, height): (usize, usize)) -> (u32, u32) {
    (width as u32, height as u32)
}
