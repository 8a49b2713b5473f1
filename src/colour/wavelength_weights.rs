//! Weights that integrate a spectrum over the wavelengths of a surface's tables, 360 to 830 nm, to a colour.
//!
//! They differ from [`super::SpectralToRgb`] in the grid, which is fixed at every nm, and in a fourth channel,
//! luminance.

use super::{cie_xyz, d65, xyz_to_linear_srgb};
use crate::table::{WAVELENGTH_MAX_NM, WAVELENGTH_MIN_NM};
use std::array;
use std::sync::LazyLock;

/// Weights of a reflectance at each nm, `[red, green, blue, luminance]`: linear sRGB under D65 and the CIE 1931 2°
/// observer. Each of the four sums to 1 over all wavelengths, so a reflectance of 1 is white.
///
/// The type is empty: all its functions read one static table.
///
/// ```
/// use sunbeam::colour::WavelengthWeights;
///
/// let white = WavelengthWeights::per_nm().iter().fold([0.0; 4], |sum, w| std::array::from_fn(|c| sum[c] + w[c]));
/// assert!(white.iter().all(|channel| (channel - 1.0).abs() < 1e-4));
/// ```
pub struct WavelengthWeights;

/// Weights `[nm − WAVELENGTH_MIN_NM][red, green, blue, luminance]`.
static WEIGHTS: LazyLock<Vec<[f32; 4]>> = LazyLock::new(|| {
    let count = (WAVELENGTH_MAX_NM - WAVELENGTH_MIN_NM) as usize + 1;
    let unscaled: Vec<[f64; 4]> = (0..count)
        .map(|i| {
            let nm = WAVELENGTH_MIN_NM + i as f64;
            let xyz = cie_xyz(nm).map(|value| value * d65(nm));
            let [r, g, b] = xyz_to_linear_srgb(xyz);
            [r, g, b, xyz[1]]
        })
        .collect();
    let total: [f64; 4] = array::from_fn(|c| unscaled.iter().map(|w| w[c]).sum());
    unscaled.iter().map(|w| array::from_fn(|c| (w[c] / total[c]) as f32)).collect()
});

impl WavelengthWeights {
    /// Weights at each whole nm from [`WAVELENGTH_MIN_NM`] to [`WAVELENGTH_MAX_NM`].
    pub fn per_nm() -> &'static [[f32; 4]] {
        &WEIGHTS
    }
}
