//! NMM (Dhillon et al. 2014): S is evaluated only at the wavelengths at which an order of light from wi leaves along
//! wo. Sources are listed in docs/model.md#sources.
//!
//! `q = wi + wo = (u, v, w)` is the scattering vector, (Lx, Ly) the extent of the tile in µm, and S the power spectrum
//! in µm², computed from the orders nearest to q (`orders.rs`). The *spans* are |u|Lx and |v|Ly in µm, and N is their
//! sum.
//!
//! The *list* of wavelengths along x is `λ = |u|Lx/n` for whole n from `|u|Lx/λmax` to `|u|Lx/λmin`, at 780 and 380
//! nm. The list along y is `λ = |v|Ly/n`. The lists have the densities `|u|Lx/λ²` and `|v|Ly/λ²` over λ. The colour is
//! a sum over both lists, with the colour weights `weight(λ)` per µm (colours.rs):
//!
//! - *weighted*: `Σ S·weight(λ)/N`. This is a quadrature of `∫ S/λ²·weight(λ) dλ`: the steps of a list are
//!   `dλ = λ²/(|u|Lx)`, and both lists are averaged by their densities.
//! - *unweighted* (Single 2014): `Σ S·W(λ)/N` with `W = weight(λ)/λ²`, scaled to an integral of 1 in each channel. A
//!   constant `S/λ²` is white, but the factor 1/λ² within each channel shifts hues.
//!
//! A wavelength of a list is at the peak of an order. It represents the order's *cell*, the frequencies nearer to this
//! order than to any other. Both forms therefore multiply S by the ratio of its mean over the cell to its peak
//! ([`mean_over_peak`]).
//!
//! A list is left out, and its span left out of N, along an axis of one pixel, which has order 0 alone. So is a list
//! whose span, the wavelength of order 1, is below λmin. Both lists are left out around (u, v) = (0, 0). There the
//! answer is white with the value at 550 nm, as in Single 2014.

use super::colours::{self, Colours, colour_density};
use super::order_grid::OrderGrid;
use super::orders::{OrderCounts, Orders};
use super::{
    MethodError, MethodOptions, MethodShader, Relief, WAVELENGTH_MAX_UM, WAVELENGTH_MIN_UM, is_query, visible_um,
};
use crate::height_field::HeightField;
use crate::scattering::TYPICAL_WAVELENGTH_UM;
use crate::table::Progress;
use crate::wgsl;
use bytemuck::{Pod, Zeroable};
use std::borrow::Cow;
use std::f64::consts::PI;

/// Sources of the shader.
const WGSL: [&str; 4] = [wgsl!("colours.wgsl"), wgsl!("bessel.wgsl"), wgsl!("orders.wgsl"), wgsl!("nmm.wgsl")];

/// Lower bound of the relative tolerance from which the neighbourhood of colours follows. The selection of wavelengths
/// alone gives colours a relative error of 0.2 to 0.3 (docs/speed-error.md), so more orders would not help.
const COLOUR_TOLERANCE_MIN: f64 = 0.15;

/// Wavelength in µm at which S is evaluated where both lists are left out and the answer is white.
pub(super) const WHITE_UM: f32 = TYPICAL_WAVELENGTH_UM as f32;

/// The uniform struct of nmm.wgsl.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub(super) struct NmmUniform {
    /// Lattice of the tile's diffraction orders.
    pub grid: OrderGrid,
    /// [`mean_over_peak`] along x and y.
    pub mean_over_peak: [f32; 2],
    /// The size of a uniform struct is a multiple of 16 bytes.
    pub _pad: [f32; 2],
}

/// The method `nmm`: wavelengths at whole orders.
pub struct Nmm {
    /// Orders for values at one wavelength, with the neighbourhood that the tolerance requires.
    orders: Orders,
    /// Orders for colours: those of `orders`, with the neighbourhood of the options, or else with the smaller one that
    /// a tolerance of at least [`COLOUR_TOLERANCE_MIN`] requires.
    colour_orders: Orders,
    /// Density of the colour weights over the wavelength: `weight`, or `W` in the unweighted form.
    colours: Colours,
    /// [`mean_over_peak`] along x and y.
    mean_over_peak: [f32; 2],
}

impl Nmm {
    /// Computes the diffraction orders of `field` for a coherence length in µm, four standard deviations of the window,
    /// and a `tolerance`, a relative error. The options `terms`, `neighbourhood`, `series` and `weighted` apply.
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
        let mean_over_peak = orders.grid.sharpness.map(|sharpness| mean_over_peak(sharpness.into()) as f32);
        let colour_orders = match options.neighbourhood {
            Some(_) => orders.clone(),
            None => orders.narrowed(tolerance.max(COLOUR_TOLERANCE_MIN)),
        };
        Ok(Self { orders, colour_orders, colours, mean_over_peak })
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
        let span_um = [0, 1].map(|axis| q[axis].abs() * grid.extent_um[axis]);
        // Whether an axis has a list: orders other than 0 are stored, and the span reaches the first of them.
        let listed = [0, 1].map(|axis| grid.reach[axis] > 0 && span_um[axis] >= WAVELENGTH_MIN_UM);
        let axes = || (0..2).filter(move |&axis| listed[axis]);
        // N, the sum of the spans of the lists.
        let total_um: f32 = axes().map(|axis| span_um[axis]).sum();
        if total_um == 0.0 {
            return [self.colour_orders.density_at(q, WHITE_UM) / (WHITE_UM * WHITE_UM); 3];
        }
        // Wavelengths in µm of the list along an axis, each with the ratio of mean to peak. There is at least one,
        // since λmax is more than twice λmin.
        let list = |axis: usize| {
            let first = (span_um[axis] / WAVELENGTH_MAX_UM).ceil() as u32;
            let last = (span_um[axis] / WAVELENGTH_MIN_UM).floor() as u32;
            (first..=last).map(move |n| (span_um[axis] / n as f32, self.mean_over_peak[axis]))
        };
        let mut rgb = [0.0; 3];
        self.colour_orders.densities(q, axes().flat_map(list), |um, ratio, density| {
            let (weight, colour) = (density * ratio, colour_density(&self.colours, um));
            rgb = [0, 1, 2].map(|c| rgb[c] + weight * colour[c]);
        });
        rgb.map(|value| value / total_um)
    }

    fn relief_spectral(&self, q: [f32; 3], wavelength_nm: f32) -> Option<f32> {
        let wavelength_um = visible_um(wavelength_nm).filter(|_| is_query(q));
        Some(wavelength_um.map_or(0.0, |um| self.orders.density_at(q, um) / (um * um)))
    }

    fn relief_shader(&self) -> MethodShader<'_> {
        let uniform = NmmUniform { grid: self.colour_orders.grid, mean_over_peak: self.mean_over_peak, _pad: [0.0; 2] };
        MethodShader {
            name: "nmm",
            wgsl: WGSL.to_vec(),
            uniform: bytemuck::bytes_of(&uniform).to_vec(),
            storage: vec![
                Cow::Borrowed(bytemuck::cast_slice(&self.colours)),
                Cow::Borrowed(self.colour_orders.bytes()),
            ],
        }
    }
}

/// Ratio of the mean of `g(p) = Σ_k exp(−2a(p − k)²)` over an order's cell to g(0), with the sharpness a of
/// [`OrderGrid`] and p in orders.
///
/// g is the power at p, averaged over the positions of the window, if all orders have equal power. The ratio is 1 where
/// the Gaussians overlap, and the area of one Gaussian where they are separate.
fn mean_over_peak(sharpness: f64) -> f64 {
    // The mean of g: the integral of one Gaussian.
    let area = (PI / (2.0 * sharpness)).sqrt();
    // θ(x) = Σ_k exp(−x k²).
    let theta = |x: f64| 1.0 + 2.0 * (1..=4).map(|k| (-x * f64::from(k * k)).exp()).sum::<f64>();
    // g(0) is θ(2a), and by Poisson's formula area·θ(π²/2a). The form that converges faster is used, in which five
    // terms are exact in single precision.
    if sharpness > 1.0 { area / theta(2.0 * sharpness) } else { 1.0 / theta(0.5 * PI * PI / sharpness) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn mean_over_peak_matches_direct_sums() {
        // Both forms meet at 1. At 1.2337, which is π²/8, the coherence length is the extent of the tile.
        for sharpness in [1e-3, 0.3, 0.999, 1.001, 1.2337, 5.0, 800.0] {
            let sum = |p: f64| (-200..=200).map(|k| (-2.0 * sharpness * (p - f64::from(k)).powi(2)).exp()).sum::<f64>();
            let steps = 4000;
            let mean = (0..steps).map(|i| sum((f64::from(i) + 0.5) / f64::from(steps))).sum::<f64>() / f64::from(steps);
            let found = mean_over_peak(sharpness);
            // Equal steps over a period of a smooth function are exact. For the smallest sharpness the sum over k ends
            // at e^{−80}.
            assert!((found * sum(0.0) / mean - 1.0).abs() < 1e-9, "{sharpness}: {found}");
        }
    }
}
