//! How different two pictures are, in radiance and to the eye.
//!
//! Pictures are linear sRGB. The first of a pair is the reference: relative errors divide by it, and the automatic
//! exposure is its own.
//! - [`Picture`] and [`Mask`]: what is compared, and where.
//! - [`compare`]: every figure at once, and the pictures that they belong to as a [`Comparison`].
//!
//! ```
//! use sunbeam_cli::comparison::{Picture, compare};
//! let grey = |value: f32| Picture::new((8, 4), vec![[value; 3]; 32]).unwrap();
//! let found = compare(&grey(0.5), &grey(0.25), None, Some(0.0)).unwrap();
//! assert_eq!(found.figures.rmse, 0.25);
//! assert!(compare(&grey(0.5), &grey(0.5), None, None).unwrap().figures.psnr_db.is_none());
//! ```

mod display;
mod error;
mod figures;
mod flip;
mod mask;
mod picture;

pub use display::DisplayPair;
pub use error::CompareError;
pub use figures::{DeltaE, Figures, Flip, RELATIVE_EPSILON};
pub use mask::Mask;
pub use picture::Picture;

/// What [`compare`] found.
pub struct Comparison {
    /// The numbers.
    pub figures: Figures,
    /// The exposure in stops that the pictures were shown with.
    pub exposure_stops: f64,
    /// Pixels that were compared.
    pub pixels: usize,
    /// The pictures as shown.
    pub shown: DisplayPair,
    /// FLIP's error in [0, 1] for every pixel, row by row from the top; 0 where nothing was compared.
    pub flip_map: Vec<f32>,
}

/// Compares `b` with the reference `a` where the mask lets it.
///
/// `exposure_stops` brightens both by `2^stops` before they are shown; without it, 1 % of the reference's pixels clip.
/// The perceptual figures see the shown pictures: exposed, clipped to [0, 1] and, but for ΔE, encoded as sRGB.
///
/// # Errors
/// Sizes that differ between the pictures or the mask, a mask that leaves nothing, an exposure that is not finite.
pub fn compare(
    a: &Picture,
    b: &Picture,
    mask: Option<&Mask>,
    exposure_stops: Option<f64>,
) -> Result<Comparison, CompareError> {
    same_size(a.size(), b.size(), "second picture")?;
    if let Some(mask) = mask {
        same_size(a.size(), mask.size(), "mask")?;
    }
    let chosen: Vec<usize> = (0..a.pixels().len()).filter(|&i| mask.is_none_or(|mask| mask.contains(i))).collect();
    if chosen.is_empty() {
        return Err(CompareError::NothingLeft);
    }
    let exposure_stops = match exposure_stops {
        Some(stops) if !stops.is_finite() || stops.abs() > MAX_STOPS => return Err(CompareError::Exposure { stops }),
        Some(stops) => stops,
        None => sunbeam::colour::automatic_exposure(chosen.iter().map(|&i| a.pixels()[i].map(f64::from))).log2(),
    };
    let shown = DisplayPair::new(a, b, mask, exposure_stops);
    let flip_map = flip::map(&shown);
    let figures = Figures::new(a, b, &chosen, &shown, &flip_map);
    Ok(Comparison { figures, exposure_stops, pixels: chosen.len(), shown, flip_map })
}

/// Exposures beyond this leave nothing between black and white.
const MAX_STOPS: f64 = 100.0;

fn same_size(expected: (usize, usize), found: (usize, usize), what: &'static str) -> Result<(), CompareError> {
    if expected == found { Ok(()) } else { Err(CompareError::Size { what, expected, found }) }
}
