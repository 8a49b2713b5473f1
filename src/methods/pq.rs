//! PQ (Dhillon et al. 2014): the tile repeats P times along x and Q times along y, and ends there. Sources are listed
//! in docs/model.md#sources.
//!
//! The colour is `rgb = Σ_i S(q, λ_i)/λ_i² · weight_i` over wavelengths in equal steps (colours.rs), with the power
//! spectrum in µm²
//!
//! `S = Lx·Ly·P·Q · |c_j|² · D_P(d_x)² · D_Q(d_y)²`.
//!
//! (Lx, Ly) is the extent of the tile and λ the wavelength, in µm. j is the order nearest to `p = (u·Lx, v·Ly)/λ`, the
//! position of the scattering vector `q = wi + wo = (u, v, w)` among the orders. c_j is its amplitude, and
//! `d = (d_x, d_y) = p − j` (symbols: orders.rs). The interference kernel is `D_P(d) = sin(πPd)/(P·sin(πd))`. For
//! |d| ≤ ½, `∫D_P² dd = 1/P`, so `∫∫ S/λ² du dv` is `Σ|c_j|² = 1`.
//!
//! S jumps halfway between two orders and oscillates between them, which limits the accuracy of the method. Single 2014
//! also takes the nearest order alone.
//!
//! P and Q default to `2√π·s/L`, rounded and at least 1, with s the standard deviation of the coherence window and L
//! the extent of the tile. The peak `Lx·Ly·P·Q` then equals the peak `4πs²` of the Gaussian window, but for rounding.

use super::colours::{self, Colours};
use super::options::{LAMBDA_STEP_NM, in_range};
use super::order_grid::OrderGrid;
use super::orders::{OrderCounts, Orders};
use super::{MethodError, MethodOptions, MethodShader, REPEATS_MAX, Relief, Repeats, is_query, visible_um};
use crate::height_field::HeightField;
use crate::table::Progress;
use crate::wgsl;
use bytemuck::{Pod, Zeroable};
use std::borrow::Cow;
use std::f32::consts::PI;

/// Sources of the shader.
const WGSL: [&str; 4] = [wgsl!("colours.wgsl"), wgsl!("bessel.wgsl"), wgsl!("orders.wgsl"), wgsl!("pq.wgsl")];

/// Value of `πPd` below which D_P is computed by its Taylor series, to avoid 0/0. Chosen: the first term left out is
/// under 1e-9 there.
pub(super) const SERIES_ARGUMENT_MAX: f32 = 0.01;

/// The uniform struct of pq.wgsl.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub(super) struct PqUniform {
    /// Lattice of the tile's diffraction orders.
    pub grid: OrderGrid,
    /// P and Q, whole numbers.
    pub repeats: [f32; 2],
    /// Number of entries of the buffer `colours`.
    pub wavelengths: u32,
    pub _pad: u32,
}

/// The method `pq`: a finite number of tiles.
pub struct Pq {
    /// The tile's orders, with the peak `Lx·Ly·P·Q` and a neighbourhood of one order.
    orders: Orders,
    /// P and Q, whole numbers.
    repeats: [f32; 2],
    /// Wavelengths and colour weights to sum over (quadrature nodes).
    colours: Colours,
}

impl Pq {
    /// Computes the diffraction orders of `field`. The coherence length in µm, four standard deviations of the window,
    /// sets the default repeats. `tolerance` is a relative error. The options `lambda_step_nm`, `terms`, `series` and
    /// `repeats` apply.
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
        // The method sums the nearest order alone.
        let options = MethodOptions { neighbourhood: Some(1), ..options.clone() };
        let mut orders = Orders::new(field, coherence_length_um, tolerance, &options, progress)?;
        let (lx, ly) = field.extent_um();
        // 2√π·s/L, with s a quarter of the coherence length.
        let default_repeats = |extent_um: f64| {
            let repeats = 0.5 * std::f64::consts::PI.sqrt() * coherence_length_um / extent_um;
            repeats.round().clamp(1.0, REPEATS_MAX.into()) as u32
        };
        let repeats = options.repeats.map_or([default_repeats(lx), default_repeats(ly)], Repeats::xy);
        orders.grid.peak_um2 = (lx * ly * f64::from(repeats[0]) * f64::from(repeats[1])) as f32;
        Ok(Self { orders, repeats: repeats.map(|n| n as f32), colours: colours::quadrature(options.lambda_step_nm)? })
    }

    /// The method with another step between wavelengths in nm; the orders are shared.
    ///
    /// # Errors
    /// [`MethodError::OutOfRange`] for a step out of [`LAMBDA_STEP_NM`].
    pub fn with_lambda_step(&self, lambda_step_nm: f64) -> Result<Self, MethodError> {
        in_range("lambda_step_nm", lambda_step_nm, &LAMBDA_STEP_NM, "0.1 to 100 nm")?;
        Ok(Self { orders: self.orders.clone(), repeats: self.repeats, colours: colours::quadrature(lambda_step_nm)? })
    }

    /// Numbers of terms and orders that are summed.
    pub fn counts(&self) -> OrderCounts {
        self.orders.counts()
    }

    /// Repeats of the tile along x and y.
    pub fn repeats(&self) -> [u32; 2] {
        self.repeats.map(|n| n as u32)
    }

    /// Computes S in µm² at several wavelengths. Each wavelength in µm comes with a value of the caller, such as its
    /// colour weights. `receive` is called with wavelength, value and S. Wavelengths whose nearest order is not stored
    /// are left out; S is 0 there.
    fn densities<T>(
        &self,
        q: [f32; 3],
        wavelengths_um: impl Iterator<Item = (f32, T)>,
        mut receive: impl FnMut(f32, T, f32),
    ) {
        let with_orders = wavelengths_um.filter_map(|(um, value)| {
            let (order, distance) = Orders::nearest(self.orders.position(q, um));
            self.orders.holds(order).then_some((um, (order, distance, value)))
        });
        self.orders.grid.at_wavelengths(q[2], with_orders, |um, (order, distance, value), term_weights| {
            let c = self.orders.amplitude(order, term_weights);
            let kernel = repeat_kernel(self.repeats[0], distance[0]) * repeat_kernel(self.repeats[1], distance[1]);
            receive(um, value, self.orders.grid.peak_um2 * (c[0] * c[0] + c[1] * c[1]) * kernel * kernel);
        });
    }
}

impl Relief for Pq {
    fn relief_rgb(&self, q: [f32; 3]) -> [f32; 3] {
        let mut rgb = [0.0; 3];
        // 0 unless q can be the sum of two unit vectors above the surface.
        if is_query(q) {
            let wavelengths_um = self.colours.iter().map(|&[r, g, b, um]| (um, [r, g, b]));
            self.densities(q, wavelengths_um, |um, colour, density| {
                let value = density / (um * um);
                rgb = [0, 1, 2].map(|c| rgb[c] + value * colour[c]);
            });
        }
        rgb
    }

    fn relief_spectral(&self, q: [f32; 3], wavelength_nm: f32) -> Option<f32> {
        let wavelength_um = visible_um(wavelength_nm).filter(|_| is_query(q));
        // Stays 0 where `is_query` is false, outside the visible range, and where the nearest order is not stored.
        let mut found = 0.0;
        let wavelengths_um = wavelength_um.into_iter().map(|um| (um, ()));
        self.densities(q, wavelengths_um, |um, (), density| found = density / (um * um));
        Some(found)
    }

    fn relief_shader(&self) -> MethodShader<'_> {
        let uniform = PqUniform {
            grid: self.orders.grid,
            repeats: self.repeats,
            wavelengths: self.colours.len() as u32,
            _pad: 0,
        };
        MethodShader {
            name: "pq",
            wgsl: WGSL.to_vec(),
            uniform: bytemuck::bytes_of(&uniform).to_vec(),
            storage: vec![Cow::Borrowed(bytemuck::cast_slice(&self.colours)), Cow::Borrowed(self.orders.bytes())],
        }
    }
}

/// Interference kernel `D_P(d) = sin(πPd)/(P·sin(πd))` of P `repeats` at the `distance` d from the nearest order, in
/// orders, |d| ≤ ½. It is 1 at d = 0.
fn repeat_kernel(repeats: f32, distance: f32) -> f32 {
    let x = PI * distance;
    if repeats * x.abs() < SERIES_ARGUMENT_MAX {
        return 1.0 - (repeats * repeats - 1.0) * x * x / 6.0;
    }
    (repeats * x).sin() / (repeats * x.sin())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn kernel_is_one_at_its_order_and_its_square_integrates_to_one_over_p() {
        for repeats in [1.0, 2.0, 7.0, 64.0, 10_000.0f32] {
            assert_eq!(repeat_kernel(repeats, 0.0), 1.0);
            // On either side of the switch to the series.
            let switch = SERIES_ARGUMENT_MAX / (PI * repeats);
            let step = repeat_kernel(repeats, 0.999 * switch) - repeat_kernel(repeats, 1.001 * switch);
            // Rounding of a sine, and the slope of the kernel there.
            assert!(step.abs() < 1e-6, "{repeats}: {step}");
            // The square is a cosine polynomial of degree P − 1, which the sum over more equal steps integrates
            // exactly.
            let steps = 3 * repeats as u32 + 1;
            let square = |i: u32| f64::from(repeat_kernel(repeats, i as f32 / steps as f32 - 0.5)).powi(2);
            let integral = (0..steps).map(square).sum::<f64>() / f64::from(steps);
            // Distances are single-precision numbers, multiplied by up to 10⁴.
            assert!((integral * f64::from(repeats) - 1.0).abs() < 1e-3, "{repeats}: {integral}");
        }
    }
}
