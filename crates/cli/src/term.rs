//! One term of the Taylor expansion of the phase screen: the magnitudes of the DFT of a power of the heights.
//!
//! `sunbeam height-field --term N` writes them as a picture or an array (docs/model.md#the-two-expansions).

use super::encode;
use super::output::{Output, listed};
use ndarray::Array2;
use serde::Serialize;
use std::error::Error;
use sunbeam::height_field::HeightField;
use sunbeam::transform::{Series, TermTransform};

/// Extensions of the files that can hold a term.
const EXTENSIONS: [&str; 2] = ["png", "npy"];

/// Number of powers of ten between white, the largest magnitude, and black. With fewer, weak orders of real reliefs are
/// black; with more, all orders are bright.
const DECADES: f64 = 5.0;

/// The magnitudes `|DFT((h/H)ⁿ)|` of all orders, in \[0, 1\].
///
/// The heights h count from the middle of their range, H is half the range, and the DFT is a mean over the tile.
#[derive(Serialize)]
pub(crate) struct Term {
    /// The power n, at least 1.
    n: usize,
    /// H in µm.
    half_range_um: f64,
    /// Rows are the orders along y from −⌊ny/2⌋ up, columns the orders along x from −⌊nx/2⌋ up.
    #[serde(skip)]
    magnitudes: Array2<f64>,
}

impl Term {
    /// Transforms the `n`-th power of the heights.
    pub(crate) fn new(field: &HeightField, n: usize) -> Self {
        let transform = TermTransform::<f64>::new(field, Series::Taylor);
        let bins = transform.term(n);
        let (nx, ny) = field.size();
        // Bin of the DFT for an index of the array, along an axis of `count` orders. Index i of the array is the order
        // i − ⌊count/2⌋. The DFT has order 0 in bin 0, and order −j in bin count − j.
        let bin = |index: usize, count: usize| (index + count - count / 2) % count;
        let magnitudes = Array2::from_shape_fn((ny, nx), |(iy, ix)| bins[bin(iy, ny) * nx + bin(ix, nx)].norm());
        Self { n, half_range_um: transform.half_range_um(), magnitudes }
    }

    /// Refuses an output file that cannot hold a term.
    ///
    /// # Errors
    /// An extension other than `.npy` and `.png`.
    pub(crate) fn check_output(file: &Output) -> Result<(), String> {
        if EXTENSIONS.iter().any(|extension| file.ends_in(extension)) {
            return Ok(());
        }
        Err(format!("{}: the name of a term must end in {}", file.path().display(), listed(&EXTENSIONS)))
    }

    /// The contents of an output file, by its extension.
    ///
    /// A `.npy` holds the magnitudes as 64-bit floats, a `.png` their logarithm as greys with +x right and +y up.
    ///
    /// # Errors
    /// The encoder's message.
    pub(crate) fn encoded(&self, file: &Output) -> Result<Vec<u8>, Box<dyn Error>> {
        if file.ends_in("npy") {
            return encode::npy(&self.magnitudes);
        }
        let (height, width) = self.magnitudes.dim();
        encode::png((width, height), png::ColorType::Grayscale, &self.greys())
    }

    /// One grey for each order, by rows from the top.
    fn greys(&self) -> Vec<u8> {
        let largest = self.magnitudes.iter().fold(0.0, |largest: f64, &magnitude| largest.max(magnitude));
        let grey = |&magnitude: &f64| {
            // The logarithm of 0 is −∞, which is black. So is the NaN of a flat relief, 0/0: `max` returns 0 for it.
            let lightness = 1.0 + (magnitude / largest).log10() / DECADES;
            (255.0 * lightness.max(0.0)).round() as u8
        };
        self.magnitudes.rows().into_iter().rev().flat_map(|row| row.iter().map(grey).collect::<Vec<_>>()).collect()
    }
}
