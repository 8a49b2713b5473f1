//! Differences between two pictures, in radiance and as shown on a screen.
//!
//! Pictures are linear sRGB. The first of a pair is the reference: relative errors divide by it, and the automatic
//! exposure is derived from it.
//!
//! - [`Picture`] and [`Mask`]: the pictures, and the pixels that are compared.
//! - [`compare`]: the pictures as shown, and all [`Figures`], which measure their differences.

mod display;
mod error;
mod figures;
mod flip;
mod mask;
mod picture;

pub(crate) use display::DisplayPair;
pub(crate) use error::CompareError;
pub(crate) use figures::Figures;
pub(crate) use mask::Mask;
pub(crate) use picture::Picture;

/// Largest absolute value of an exposure in stops. Factors of 2^±100 already make any usual picture white or black.
const STOPS_MAX: f64 = 100.0;

/// The result of [`compare`].
pub(crate) struct Comparison {
    /// The figures of `sunbeam compare`.
    pub(crate) figures: Figures,
    /// Exposure of the pictures as shown, in stops: the binary logarithm of the factor on the radiance.
    pub(crate) exposure_stops: f64,
    /// Number of compared pixels.
    pub(crate) pixels: usize,
    /// The pictures as shown.
    pub(crate) shown: DisplayPair,
    /// FLIP's error of every pixel in [0, 1], by rows from the top; 0 outside the mask.
    pub(crate) flip_map: Vec<f32>,
}

/// Compares `b` with the reference `a` inside the mask; without a mask everywhere.
///
/// The pictures as shown are multiplied by `2^exposure_stops` and clipped to [0, 1]. By default the exposure clips 1 %
/// of the reference's compared pixels that are not black. FLIP and PSNR use the sRGB encoding, CIEDE2000 uses CIELAB of
/// the linear values.
///
/// # Errors
/// Sizes that differ between the pictures or the mask, a mask without pixels, an exposure out of range.
pub(crate) fn compare(
    a: &Picture,
    b: &Picture,
    mask: Option<&Mask>,
    exposure_stops: Option<f64>,
) -> Result<Comparison, CompareError> {
    check_size("second picture", a.size(), b.size())?;
    if let Some(mask) = mask {
        check_size("mask", a.size(), mask.size())?;
    }
    let chosen: Vec<usize> = (0..a.pixels().len()).filter(|&i| mask.is_none_or(|mask| mask.contains(i))).collect();
    if chosen.is_empty() {
        return Err(CompareError::NothingLeft);
    }
    let exposure_stops = match exposure_stops {
        Some(stops) if !stops.is_finite() || stops.abs() > STOPS_MAX => return Err(CompareError::Exposure { stops }),
        Some(stops) => stops,
        None => sunbeam::colour::automatic_exposure(chosen.iter().map(|&i| a.pixels()[i].map(f64::from))).log2(),
    };
    let shown = DisplayPair::new(a, b, mask, exposure_stops);
    let flip_map = flip::error_map(&shown);
    let figures = Figures::new(a, b, &chosen, &shown, &flip_map);
    Ok(Comparison { figures, exposure_stops, pixels: chosen.len(), shown, flip_map })
}

/// Refuses a picture or mask, named by `what`, whose width and height are not the expected ones.
fn check_size(what: &'static str, expected: (usize, usize), found: (usize, usize)) -> Result<(), CompareError> {
    if expected == found { Ok(()) } else { Err(CompareError::Size { what, expected, found }) }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn grey(value: f32) -> Picture {
        Picture::new((8, 4), vec![[value; 3]; 32]).unwrap()
    }

    #[test]
    fn constant_pictures_differ_by_their_difference() {
        assert_eq!(compare(&grey(0.5), &grey(0.25), None, Some(0.0)).unwrap().figures.rmse, 0.25);
    }

    #[test]
    fn equal_pictures_have_no_psnr() {
        assert!(compare(&grey(0.5), &grey(0.5), None, None).unwrap().figures.psnr_db.is_none());
    }
}
