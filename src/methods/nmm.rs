//! NMM, non-uniform wavelengths (Dhillon et al. 2014): only the wavelengths at which an order leaves in the direction
//! of the query, each with the sum of [`super::Flss`] over a neighbourhood of orders.
//!
//! `q = wi + wo = (u, v, w)` is the scattering vector, (Lx, Ly) the extent of the tile in µm, and S the power spectrum.
//! The wavelengths are `λ = |u|Lx/n` for whole n from `|u|Lx/λmax` to `|u|Lx/λmin`, and likewise for v and Ly. Their
//! density over λ is `|u|Lx/λ²` and `|v|Ly/λ²`: highest in the blue. With `N = |u|Lx + |v|Ly`, the sum over both lists
//! is
//!
//! - *unweighted* (Single 2014): `Σ S/λ² · W(λ)/N`, where W are the colour weights over λ², scaled so that a constant
//!   is white. The factor 1/λ² within each channel shifts hues;
//! - *weighted*: `Σ S/λ² · λ²/N · weight(λ)`. Each list has its own spacing `dλ = λ²/(|u|Lx)`, and the two are averaged
//!   by their densities: a quadrature of `∫ S/λ² weight dλ`.
//!
//! A sample lies at the peak of an order and stands for the mean over the order's cell, so both forms multiply it by
//! the ratio of the mean to the peak ([`line_width`]). A list counts where it can hold an order other than 0: not along
//! an axis of one pixel, nor for `|u|Lx < λmin`. Where no list counts, around (u, v) = (0, 0), the answer is white, as
//! in Single 2014, with the value at 550 nm.

use super::colours::{self, Colours, colour_density};
use super::order_grid::OrderGrid;
use super::orders::{OrderCounts, Orders};
use super::{
    MethodError, MethodOptions, MethodShader, Relief, WAVELENGTH_MAX_UM, WAVELENGTH_MIN_UM, is_query, spectral_range_um,
};
use crate::height_field::HeightField;
use crate::table::Progress;
use crate::wgsl;
use bytemuck::{Pod, Zeroable};
use std::borrow::Cow;
use std::f64::consts::PI;

/// Sources of the shader.
const WGSL: [&str; 4] = [wgsl!("colours.wgsl"), wgsl!("bessel.wgsl"), wgsl!("orders.wgsl"), wgsl!("nmm.wgsl")];

/// Finest relative tolerance of the neighbourhood of a colour. The choice of wavelengths alone makes colours wrong by
/// 0.2 to 0.35 (docs/speed-error.md), so more orders would not help.
const COLOUR_TOLERANCE: f64 = 0.15;

/// Wavelength in µm at which S is evaluated where no list counts and the answer is white. Chosen: mid-spectrum.
pub(super) const WHITE_UM: f32 = 0.55;

/// The uniform struct of nmm.wgsl.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub(super) struct NmmUniform {
    pub grid: OrderGrid,
    /// [`line_width`] along x and y.
    pub line_width: [f32; 2],
    pub _pad: [f32; 2],
}

/// The method `nmm`: wavelengths at whole orders.
pub struct Nmm {
    orders: Orders,
    /// A copy with the smaller neighbourhood of orders that suffices for colours ([`COLOUR_TOLERANCE`]).
    colour_orders: Orders,
    /// Density of the colour weights over the wavelength.
    colours: Colours,
    /// [`line_width`] along x and y.
    line_width: [f32; 2],
}

impl Nmm {
    /// Transforms `field`. It reads `terms`, `neighbourhood`, `series` and `weighted` of the options.
    ///
    /// # Errors
    /// The errors of [`super::build`].
    pub fn new(
        field: &HeightField,
        coherence_length_um: f64,
        tolerance: f64,
        options: &MethodOptions,
        progress: &Progress,
    ) -> Result<Self, MethodError> {
        let orders = Orders::new(field, coherence_length_um, tolerance, options, progress)?;
        let colours = if options.weighted { colours::density()? } else { colours::density_over_square()? };
        let line_width = orders.grid.sharpness.map(|sharpness| line_width(sharpness.into()) as f32);
        let colour_orders = match options.neighbourhood {
            Some(_) => orders.clone(),
            None => orders.narrowed(tolerance.max(COLOUR_TOLERANCE)),
        };
        Ok(Self { orders, colour_orders, colours, line_width })
    }

    /// Numbers of terms and orders that are summed for a colour.
    pub fn counts(&self) -> OrderCounts {
        self.colour_orders.counts()
    }
}

impl Relief for Nmm {
    fn relief_rgb(&self, q: [f32; 3]) -> [f32; 3] {
        if !is_query(q) {
            return [0.0; 3];
        }
        let grid = &self.colour_orders.grid;
        // |u|·Lx and |v|·Ly in µm; the wavelengths of a list are its whole fractions.
        let span = [0, 1].map(|axis| q[axis].abs() * grid.extent_um[axis]);
        let listed = [0, 1].map(|axis| grid.reach[axis] > 0 && span[axis] >= WAVELENGTH_MIN_UM);
        let total: f32 = (0..2).filter(|axis| listed[*axis]).map(|axis| span[axis]).sum();
        if total == 0.0 {
            return [self.colour_orders.density_at(q, WHITE_UM) / (WHITE_UM * WHITE_UM); 3];
        }
        let list = |axis: usize| {
            let first = (span[axis] / WAVELENGTH_MAX_UM).ceil() as u32;
            let last = (span[axis] / WAVELENGTH_MIN_UM).floor() as u32;
            (first..=last).map(move |n| (span[axis] / n as f32, self.line_width[axis]))
        };
        let mut rgb = [0.0; 3];
        self.colour_orders.densities(q, (0..2).filter(|axis| listed[*axis]).flat_map(list), |um, width, density| {
            let (weight, colour) = (density * width, colour_density(&self.colours, um));
            rgb = [0, 1, 2].map(|c| rgb[c] + weight * colour[c]);
        });
        rgb.map(|value| value / total)
    }

    fn relief_spectral(&self, q: [f32; 3], wavelength_nm: f32) -> Option<f32> {
        let wavelength_um = spectral_range_um(wavelength_nm).filter(|_| is_query(q));
        Some(wavelength_um.map_or(0.0, |um| self.orders.density_at(q, um) / (um * um)))
    }

    fn relief_shader(&self) -> MethodShader<'_> {
        let uniform = NmmUniform { grid: self.colour_orders.grid, line_width: self.line_width, _pad: [0.0; 2] };
        MethodShader {
            name: "nmm",
            wgsl: WGSL.to_vec(),
            uniform: bytemuck::bytes_of(&uniform).to_vec(),
            storage: vec![Cow::Borrowed(bytemuck::cast_slice(&self.colours)), Cow::Borrowed(self.orders.bytes())],
        }
    }
}

/// Ratio of the mean over an order's cell to the value at the order, of `Σ_k exp(−2a(p − k)²)` with the sharpness a.
///
/// It is 1 for Gaussians that overlap, and their area for separate ones. It is exact, in the mean over window
/// positions, where all orders have the same power.
fn line_width(sharpness: f64) -> f64 {
    let area = (PI / (2.0 * sharpness)).sqrt();
    let theta = |exponent: f64| 1.0 + 2.0 * (1..=4).map(|k| (-exponent * f64::from(k * k)).exp()).sum::<f64>();
    // The sum, or its Poisson transform where the transform converges faster. Five terms are exact in single precision.
    if sharpness > 1.0 { area / theta(2.0 * sharpness) } else { 1.0 / theta(0.5 * PI * PI / sharpness) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn line_width_is_the_mean_over_the_peak() {
        for sharpness in [1e-3, 0.3, 0.999, 1.001, 1.2337, 5.0, 800.0] {
            let sum = |p: f64| (-200..=200).map(|k| (-2.0 * sharpness * (p - f64::from(k)).powi(2)).exp()).sum::<f64>();
            let steps = 4000;
            let mean = (0..steps).map(|i| sum((f64::from(i) + 0.5) / f64::from(steps))).sum::<f64>() / f64::from(steps);
            let found = line_width(sharpness);
            // Equal steps over a period of a smooth function are exact, the sum is cut at e^{−80}.
            assert!((found * sum(0.0) / mean - 1.0).abs() < 1e-9, "{sharpness}: {found}");
        }
    }
}
