//! Profiles of grating presets, and of height fields that vary along x alone.

use super::GratingError;
use crate::height_field::{HeightField, Preset};
use ndarray::Axis;
use sunbeam_rigorous::Profile;

/// Exact profile of a grating preset; `None` for presets that are no gratings. A period or height (µm) that is `None`
/// has the preset's default.
///
/// # Errors
/// A period or height that the solver refuses.
pub fn preset_profile(
    preset: Preset,
    period_um: Option<f64>,
    height_um: Option<f64>,
) -> Result<Option<Profile>, GratingError> {
    let Some((period, height)) = preset.defaults_um() else { return Ok(None) };
    let (period, height) = (period_um.unwrap_or(period), height_um.unwrap_or(height));
    Ok(match preset {
        Preset::Blazed => Some(Profile::blazed(period, height)?),
        Preset::Sinusoidal => Some(Profile::sinusoid(period, height)?),
        // The ridge takes half of the period.
        Preset::Lamellar => Some(Profile::lamellar(period, height, 0.5)?),
        _ => None,
    })
}

/// Profile of a height field that varies along x alone: the mean over y of each column of pixels. The field's extent
/// along x is one period.
///
/// # Errors
/// [`GratingError::NotAlongX`] where the heights of a column differ by more than `tolerance` times the relief's height
/// (peak to valley). Profiles that the solver refuses.
pub fn profile_of(field: &HeightField, tolerance: f64) -> Result<Profile, GratingError> {
    let heights = field.heights_um();
    let (lowest, highest) = field.range_um();
    let accepted_um = tolerance * (highest - lowest);
    let spread = |column: ndarray::ArrayView1<f64>| {
        let (low, high) = column.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), &h| (low.min(h), high.max(h)));
        high - low
    };
    let found_um = heights.axis_iter(Axis(1)).map(spread).fold(0.0, f64::max);
    if found_um > accepted_um {
        return Err(GratingError::NotAlongX { found_um, accepted_um });
    }
    let rows = heights.nrows() as f64;
    let means: Vec<f64> = heights.axis_iter(Axis(1)).map(|column| column.sum() / rows).collect();
    let period_um = field.extent_um().0;
    // The solver requires at least 8 samples, but a plane, of height 0, may have any number of pixels.
    if highest == lowest {
        return Ok(Profile::flat(period_um)?);
    }
    Ok(Profile::samples(period_um, &means)?)
}

#[cfg(test)]
mod tests {
    use super::*;
    use ndarray::Array2;

    #[test]
    fn files_and_presets_of_gratings_have_the_same_profiles() {
        for preset in [Preset::Blazed, Preset::Sinusoidal, Preset::Lamellar] {
            let exact = preset_profile(preset, Some(1.5), Some(0.2)).unwrap().unwrap();
            let read = profile_of(&preset.build(Some(1.5), Some(0.2)).unwrap(), 1e-3).unwrap();
            assert_eq!((exact.period_um(), exact.has_corners()), (read.period_um(), read.has_corners()));
            // Heights are sampled at the centres of 1024 pixels, so an extremum may be missed by half a pixel.
            assert!((exact.height_um() - read.height_um()).abs() < 2e-3 * 0.2, "{preset}: {}", read.height_um());
            assert!((exact.arc_um() - read.arc_um()).abs() < 2e-3 * 1.5, "{preset}: {}", read.arc_um());
        }
        assert_eq!(profile_of(&Preset::Flat.build(None, None).unwrap(), 1e-3).unwrap().height_um(), 0.0);
    }

    #[test]
    fn reliefs_that_vary_along_y_are_refused_with_the_variation() {
        // The pits of the compact disc are 0.12 µm deep.
        let message = profile_of(&Preset::Cd.build(None, None).unwrap(), 1e-3).unwrap_err().to_string();
        assert!(message.contains("along y by 1.20e-1 µm") && message.contains("scalar"), "{message}");
        let noisy = Array2::from_shape_fn((4, 16), |(y, x)| (x as f64 * 0.4).sin() + 1e-4 * y as f64);
        let field = HeightField::new(noisy, 0.1, 0.1).unwrap();
        assert!(profile_of(&field, 1e-5).is_err() && profile_of(&field, 1e-3).is_ok());
    }
}
