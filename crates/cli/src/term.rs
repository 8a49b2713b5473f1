//! One term of the Taylor expansion as a picture or an array: how large the DFT of a power of the heights is.

use super::encode;
use super::output::{Output, listed};
use ndarray::Array2;
use serde::Serialize;
use std::error::Error;
use sunbeam::height_field::HeightField;
use sunbeam::transform::{Series, TermTransform};

/// Extensions of the files that a term is written to.
const EXTENSIONS: [&str; 2] = ["png", "npy"];

/// A picture is black where a bin is this many powers of ten below the largest.
const DECADES: f64 = 5.0;

/// `|DFT((h/H)ⁿ)|`, with the heights h about the middle of their range, and H half of it: means over the tile, in \[0, 1\].
#[derive(Serialize)]
pub struct Term {
    n: usize,
    half_range_um: f64,
    /// Orders −⌊ny/2⌋ and up in rows, −⌊nx/2⌋ and up in columns.
    #[serde(skip)]
    magnitudes: Array2<f64>,
}

impl Term {
    /// Transforms the `n`-th power of the heights.
    pub fn new(field: &HeightField, n: usize) -> Self {
        let transform = TermTransform::<f64>::new(field, Series::Taylor);
        let bins = transform.term(n);
        let (nx, ny) = field.size();
        // Bins have order 0 first; the order 0 of the array is at ⌊n/2⌋.
        let bin = |place: usize, n: usize| (place + n - n / 2) % n;
        let magnitudes = Array2::from_shape_fn((ny, nx), |(iy, ix)| bins[bin(iy, ny) * nx + bin(ix, nx)].norm());
        Self { n, half_range_um: transform.half_range_um(), magnitudes }
    }

    /// Refuses a file that holds heights and no term.
    ///
    /// # Errors
    /// An extension other than `.npy` and `.png`.
    pub fn check_output(file: &Output) -> Result<(), String> {
        if EXTENSIONS.iter().any(|extension| file.ends_in(extension)) {
            return Ok(());
        }
        Err(format!("{}: the name of a term must end in {}", file.path().display(), listed(&EXTENSIONS)))
    }

    /// The contents of a file: the magnitudes as 64-bit floats (.npy), or their logarithm as a grey picture with +x right and +y
    /// up.
    pub fn encoded(&self, file: &Output) -> Result<Vec<u8>, Box<dyn Error>> {
        if file.ends_in("npy") {
            return encode::npy(&self.magnitudes);
        }
        let (height, width) = self.magnitudes.dim();
        encode::png((width, height), png::ColorType::Grayscale, &self.greys())
    }

    /// Rows from the top; white is the largest magnitude.
    fn greys(&self) -> Vec<u8> {
        let largest = self.magnitudes.iter().fold(0.0, |a: f64, &b| a.max(b));
        let grey = |&magnitude: &f64| {
            // The logarithm of 0 is −∞, which is black.
            let share = 1.0 + (magnitude / largest).log10() / DECADES;
            (255.0 * share.max(0.0)).round() as u8
        };
        self.magnitudes.rows().into_iter().rev().flat_map(|row| row.iter().map(grey).collect::<Vec<_>>()).collect()
    }
}
