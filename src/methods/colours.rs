//! The colours of wavelengths as the methods need them: a list to sum over, or a density to ask anywhere.

use super::{WAVELENGTH_MAX_UM, WAVELENGTH_MIN_UM};
use crate::colour::{ColourError, SpectralToRgb};

/// Steps of a density, in nm.
const DENSITY_STEP_NM: f64 = 1.0;

/// Linear-sRGB weights with their wavelength in µm in the last place, as the shaders read them.
pub(super) type Colours = Vec<[f32; 4]>;

/// Samples over 380 to 780 nm in steps of `step_nm`; their weights sum to (1, 1, 1).
pub(super) fn samples(step_nm: f64) -> Result<Colours, ColourError> {
    let spectrum = SpectralToRgb::visible(step_nm)?;
    Ok(entries(&spectrum, |_| [1.0; 3]))
}

/// Weights per µm on an even grid over 380 to 780 nm; their integral is (1, 1, 1).
pub(super) fn density() -> Result<Colours, ColourError> {
    let spectrum = SpectralToRgb::visible(DENSITY_STEP_NM)?;
    Ok(entries(&spectrum, |_| [1e3 / DENSITY_STEP_NM; 3]))
}

/// Weights per µm over λ², scaled per channel so that their integral is (1, 1, 1), in 1/µm³: what makes white of a
/// constant from wavelengths that lie as thick as `1/λ²`.
pub(super) fn density_over_square() -> Result<Colours, ColourError> {
    let spectrum = SpectralToRgb::visible(DENSITY_STEP_NM)?;
    let square = |nm: f64| (1e-3 * nm).powi(2);
    let total = spectrum.rgb_of(|nm| 1.0 / square(nm));
    Ok(entries(&spectrum, |nm| total.map(|total| 1e3 / DENSITY_STEP_NM / (square(nm) * total))))
}

fn entries(spectrum: &SpectralToRgb, factor: impl Fn(f64) -> [f64; 3]) -> Colours {
    spectrum
        .wavelengths_nm()
        .zip(spectrum.weights())
        .map(|(nm, weight)| {
            let factor = factor(nm);
            let [r, g, b] = std::array::from_fn(|c| (weight[c] * factor[c]) as f32);
            [r, g, b, (nm * 1e-3) as f32]
        })
        .collect()
}

/// A density of [`density`] or [`density_over_square`], between its entries linear.
pub(super) fn colour_density(colours: &[[f32; 4]], wavelength_um: f32) -> [f32; 3] {
    let intervals = colours.len() - 1;
    let place = (wavelength_um - WAVELENGTH_MIN_UM) / (WAVELENGTH_MAX_UM - WAVELENGTH_MIN_UM) * intervals as f32;
    let below = (place.max(0.0) as usize).min(intervals - 1);
    let share = (place - below as f32).clamp(0.0, 1.0);
    std::array::from_fn(|c| colours[below][c] * (1.0 - share) + colours[below + 1][c] * share)
}
