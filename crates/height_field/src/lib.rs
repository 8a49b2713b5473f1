//! Height fields: the relief of one rectangular tile of a surface, in µm.
//!
//! A field comes from a [`Preset`], from a file (`HeightField::read`, with the feature `files`) or from an array:
//!
//! ```
//! use ndarray::Array2;
//! use sunbeam_height_field::{HeightField, Level};
//!
//! // 64 × 32 pixels of 0.1 µm: a ramp of 0.01 µm a pixel under a wave.
//! let heights = Array2::from_shape_fn((32, 64), |(_, ix)| 0.01 * ix as f64 + 0.05 * (0.4 * ix as f64).sin());
//! let field = HeightField::new(heights, 0.1, 0.1)?;
//! let levelled = field.levelled(Level::Plane);
//! assert_eq!(levelled.size(), (64, 32));
//! assert!(levelled.peak_to_valley_um() < 0.2 && field.peak_to_valley_um() > 0.6);
//! # Ok::<(), sunbeam_height_field::HeightFieldError>(())
//! ```
//!
//! Single 2014 is M. Single's thesis, *An Interactive Shader for Natural Diffraction Gratings* (Bern, 2014). The
//! presets of snake skins are modelled on the thesis's scans. The period that the thesis measures lies along x here, so
//! the skin of *Elaphe* is rotated by +90° against the published picture.

mod cd;
mod crop;
mod error;
#[cfg(feature = "files")]
mod file;
mod fill;
mod film;
mod holes;
mod isolated;
mod level;
mod preset;
// Public for benchmarks, which draw directions that are the same on every machine.
#[doc(hidden)]
pub mod random;
mod roughness;
mod skin;
mod synthetic;
mod tile;

pub use error::HeightFieldError;
#[cfg(feature = "files")]
pub use file::{Doubt, FORMATS, FileField, FileScale, Format, Provenance, READABLE, ReadOptions, Source, Understood};
pub use fill::Fill;
pub use level::Level;
pub use preset::Preset;
pub use roughness::Roughness;
pub use skin::{REGION_SIZE_UM, REGION_SPREAD, Regions};
pub use tile::{Seam, Seams, TileReport};

use ndarray::Array2;

/// Longest period, pixel and range of heights in µm that scenes and command lines may give: one millimetre. Reliefs
/// that diffract light visibly are far finer, so a longer length was probably meant in another unit.
pub const MAX_LENGTH_UM: f64 = 1e3;

/// Smallest pixel in µm that [`HeightField::check_size`] accepts: a thousandth of an atom's diameter. A smaller one was
/// probably meant in another unit.
const PIXEL_MIN_UM: f64 = 1e-7;

/// The relief of one rectangular tile. Neither the tile nor its pixels need to be square.
///
/// `heights_um[[iy, ix]]` is the height at `x = ix·dx_um`, `y = iy·dy_um`, the centre of the pixel. The row index grows
/// along +y.
///
/// Invariant: at least one pixel, every height finite, both pixel sizes finite and positive.
#[derive(Clone, Debug, PartialEq)]
pub struct HeightField {
    /// Heights in µm, `[[iy, ix]]`.
    heights_um: Array2<f64>,
    /// Pixel size along x in µm.
    dx_um: f64,
    /// Pixel size along y in µm.
    dy_um: f64,
}

impl HeightField {
    /// Wraps heights in µm with their pixel size in µm.
    ///
    /// # Errors
    /// An empty array, a pixel size that is not finite and positive, or a height that is not finite (with its row and
    /// column).
    pub fn new(heights_um: Array2<f64>, dx_um: f64, dy_um: f64) -> Result<Self, HeightFieldError> {
        if heights_um.is_empty() {
            return Err(HeightFieldError::Empty);
        }
        check_pixel_size(dx_um, dy_um)?;
        if let Some(((row, column), &value)) = heights_um.indexed_iter().find(|(_, h)| !h.is_finite()) {
            return Err(HeightFieldError::NotFinite { row, column, value });
        }
        Ok(Self { heights_um, dx_um, dy_um })
    }

    /// The relief with its pattern `scale` times as wide and its heights multiplied by `depth`; both are positive and
    /// finite.
    pub fn resized(&self, scale: f64, depth: f64) -> Self {
        Self { heights_um: &self.heights_um * depth, dx_um: self.dx_um * scale, dy_um: self.dy_um * scale }
    }

    /// Checks that pixel sizes and the range of heights are plausible. `limit_um` is usually [`MAX_LENGTH_UM`].
    ///
    /// # Errors
    /// [`HeightFieldError::TooLarge`] for a pixel size or a range of heights above `limit_um`;
    /// [`HeightFieldError::TooSmall`] for a pixel below 1e-7 µm.
    pub fn check_size(&self, limit_um: f64) -> Result<(), HeightFieldError> {
        let (low, high) = self.range_um();
        let sizes = [
            ("`pixel_size` along x", self.dx_um),
            ("`pixel_size` along y", self.dy_um),
            ("the range of heights", high - low),
        ];
        if let Some(&(what, value_um)) = sizes.iter().find(|(_, value_um)| *value_um > limit_um) {
            return Err(HeightFieldError::TooLarge { what, value_um, limit_um });
        }
        // Heights may be flat, so only the pixel sizes have a lower bound.
        match sizes[..2].iter().find(|(_, value_um)| *value_um < PIXEL_MIN_UM) {
            Some(&(what, value_um)) => Err(HeightFieldError::TooSmall { what, value_um, limit_um: PIXEL_MIN_UM }),
            None => Ok(()),
        }
    }

    /// Heights in µm, indexed `[[iy, ix]]`.
    pub fn heights_um(&self) -> &Array2<f64> {
        &self.heights_um
    }

    /// Pixel size along x in µm.
    pub fn dx_um(&self) -> f64 {
        self.dx_um
    }

    /// Pixel size along y in µm.
    pub fn dy_um(&self) -> f64 {
        self.dy_um
    }

    /// Number of pixels along x and y.
    pub fn size(&self) -> (usize, usize) {
        let (ny, nx) = self.heights_um.dim();
        (nx, ny)
    }

    /// Extent `(Lx, Ly)` of the tile in µm.
    pub fn extent_um(&self) -> (f64, f64) {
        let (nx, ny) = self.size();
        (nx as f64 * self.dx_um, ny as f64 * self.dy_um)
    }

    /// Lowest and highest height in µm.
    pub fn range_um(&self) -> (f64, f64) {
        self.heights_um.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(lo, hi), &h| (lo.min(h), hi.max(h)))
    }
}

/// Refuses pixel sizes that are not finite and positive.
fn check_pixel_size(dx_um: f64, dy_um: f64) -> Result<(), HeightFieldError> {
    for (axis, value_um) in [("x", dx_um), ("y", dy_um)] {
        if !(value_um.is_finite() && value_um > 0.0) {
            return Err(HeightFieldError::PixelSize { axis, value_um });
        }
    }
    Ok(())
}
