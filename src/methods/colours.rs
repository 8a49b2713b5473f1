//! Linear-sRGB weights of wavelengths, as quadrature nodes or as a density over the wavelength. The shaders read them
//! through colours.wgsl.
//!
//! - Nodes (flss.rs, pq.rs): `rgb = Σ_i spectrum(λ_i)·weight_i`; the weights are pure numbers.
//! - A density per µm of wavelength (nmm.rs, stam.rs): `rgb = ∫ spectrum(λ)·density(λ) dλ`. The method selects the
//!   wavelengths.
//!
//! The weights are those of the CIE 1931 observer under the illuminant D65; a spectrum of 1 is white, (1, 1, 1).

use super::{WAVELENGTH_MAX_UM, WAVELENGTH_MIN_UM};
use crate::colour::{ColourError, SpectralToRgb};

/// Step between entries of a density in nm: the step of the CIE observer's table, which shorter steps would only
/// interpolate.
const DENSITY_STEP_NM: f64 = 1.0;
/// Factor from the weight of a step of [`DENSITY_STEP_NM`] to a density per µm.
const PER_UM: f64 = 1e3 / DENSITY_STEP_NM;

/// Linear-sRGB weights, or values of a density per µm, with their wavelengths in µm, ascending: entries `[r, g, b, λ]`.
pub(super) type Colours = Vec<[f32; 4]>;

/// Quadrature nodes over 380 to 780 nm in steps of `step_nm`. Their weights sum to (1, 1, 1).
///
/// # Errors
/// A step that [`SpectralToRgb::visible`] refuses.
pub(super) fn quadrature(step_nm: f64) -> Result<Colours, ColourError> {
    let to_rgb = SpectralToRgb::visible(step_nm)?;
    Ok(entries(&to_rgb, |_| [1.0; 3]))
}

/// The weights per µm of wavelength, on a uniform grid over 380 to 780 nm. Each channel is scaled to an integral of 1.
///
/// # Errors
/// Never in practice: [`SpectralToRgb::visible`] accepts the step of 1 nm.
pub(super) fn density() -> Result<Colours, ColourError> {
    let to_rgb = SpectralToRgb::visible(DENSITY_STEP_NM)?;
    Ok(entries(&to_rgb, |_| [PER_UM; 3]))
}

/// [`density`] divided by λ². Each channel is scaled again to an integral of 1.
///
/// NMM sums a power spectrum S, times these weights, over wavelengths whose density over λ is proportional to `1/λ²`.
/// An S proportional to λ² then gives white, as it should: its reflectance `S/λ²` is the same at all wavelengths.
///
/// # Errors
/// Never in practice: [`SpectralToRgb::visible`] accepts the step of 1 nm.
pub(super) fn density_over_square() -> Result<Colours, ColourError> {
    let to_rgb = SpectralToRgb::visible(DENSITY_STEP_NM)?;
    // λ² in µm².
    let square = |nm: f64| (1e-3 * nm).powi(2);
    // Integral of each channel before scaling, the colour of the spectrum 1/λ².
    let integrals = to_rgb.rgb_of(|nm| 1.0 / square(nm));
    Ok(entries(&to_rgb, |nm| integrals.map(|integral| PER_UM / (square(nm) * integral))))
}

/// Entries with the weights of `to_rgb`, each channel multiplied by its `factor` at the wavelength in nm.
fn entries(to_rgb: &SpectralToRgb, factor: impl Fn(f64) -> [f64; 3]) -> Colours {
    to_rgb
        .wavelengths_nm()
        .zip(to_rgb.weights())
        .map(|(nm, weight)| {
            let factors = factor(nm);
            let [r, g, b] = std::array::from_fn(|c| (weight[c] * factors[c]) as f32);
            [r, g, b, (nm * 1e-3) as f32]
        })
        .collect()
}

/// `colours`, a [`density`] or [`density_over_square`], at a wavelength in µm: linear between its entries and constant
/// beyond them.
pub(super) fn colour_density(colours: &[[f32; 4]], wavelength_um: f32) -> [f32; 3] {
    let intervals = colours.len() - 1;
    let position = (wavelength_um - WAVELENGTH_MIN_UM) / (WAVELENGTH_MAX_UM - WAVELENGTH_MIN_UM) * intervals as f32;
    let below = (position.max(0.0) as usize).min(intervals - 1);
    let fraction = (position - below as f32).clamp(0.0, 1.0);
    std::array::from_fn(|c| colours[below][c] * (1.0 - fraction) + colours[below + 1][c] * fraction)
}
