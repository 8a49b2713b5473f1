//! FLSS, full lambda spectral sampling (Dhillon et al. 2014, docs/model.md#sources).
//!
//! `relief_rgb(q) = Σ_i S(f; κ)/λ_i² · weight_i`, in 1/sr, over wavelengths λ_i in equal steps. `weight_i` is the
//! quadrature weight for linear sRGB (colours.rs).
//!
//! `q = wi + wo = (u, v, w)` is the scattering vector, `f = (u, v)/λ_i` the spatial frequency and `κ = 2πw/λ_i` the
//! phase rate. S is the power spectrum in µm² of the phase screen `exp(iκh)` with the heights h, seen through one
//! coherence window (docs/model.md#coherence). It is computed from a neighbourhood of diffraction orders (orders.rs).

use super::colours::{self, Colours};
use super::options::{LAMBDA_STEP_NM, in_range};
use super::order_grid::OrderGrid;
use super::orders::{OrderCounts, Orders};
use super::{MethodError, MethodOptions, MethodShader, Relief, is_query, visible_um};
use crate::height_field::HeightField;
use crate::table::Progress;
use crate::wgsl;
use bytemuck::{Pod, Zeroable};
use std::borrow::Cow;

/// Sources of the shader, in the order of their concatenation.
const WGSL: [&str; 4] = [wgsl!("colours.wgsl"), wgsl!("bessel.wgsl"), wgsl!("orders.wgsl"), wgsl!("flss.wgsl")];

/// The uniform struct of flss.wgsl.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub(super) struct FlssUniform {
    /// Lattice of the tile's diffraction orders.
    pub grid: OrderGrid,
    /// Number of wavelengths.
    pub wavelengths: u32,
    /// The size of a uniform struct is a multiple of 16 bytes.
    pub _pad0: u32,
    pub _pad1: u32,
    pub _pad2: u32,
}

/// The method `flss`: wavelengths in equal steps from 380 to 780 nm.
pub struct Flss {
    /// The tile's orders, with the neighbourhood that the tolerance requires.
    orders: Orders,
    /// Colour weights and wavelengths in µm to sum over, `[r, g, b, λ]`.
    colours: Colours,
}

impl Flss {
    /// Computes the diffraction orders of `field` for a coherence length in µm, four standard deviations of the window,
    /// and a `tolerance`, a relative error. The options `lambda_step_nm`, `terms`, `neighbourhood` and `series` apply.
    ///
    /// # Errors
    /// [`MethodError`]: arguments beyond their ranges, a relief that is too deep, or too many bytes.
    pub fn new(
        field: &HeightField,
        coherence_length_um: f64,
        tolerance: f64,
        options: &MethodOptions,
        progress: &Progress,
    ) -> Result<Self, MethodError> {
        let orders = Orders::new(field, coherence_length_um, tolerance, options, progress)?;
        Ok(Self { orders, colours: colours::quadrature(options.lambda_step_nm)? })
    }

    /// The method with another step between wavelengths in nm; the orders are shared.
    ///
    /// # Errors
    /// [`MethodError::OutOfRange`] for a step out of [`LAMBDA_STEP_NM`].
    pub fn with_lambda_step(&self, lambda_step_nm: f64) -> Result<Self, MethodError> {
        in_range("lambda_step_nm", lambda_step_nm, &LAMBDA_STEP_NM, "0.1 to 100 nm")?;
        Ok(Self { orders: self.orders.clone(), colours: colours::quadrature(lambda_step_nm)? })
    }

    /// Numbers of terms and orders that are summed.
    pub fn counts(&self) -> OrderCounts {
        self.orders.counts()
    }
}

impl Relief for Flss {
    fn relief_rgb(&self, q: [f32; 3]) -> [f32; 3] {
        let mut rgb = [0.0; 3];
        // Zero for a `q` that is not the sum of two directions above the surface.
        if is_query(q) {
            let wavelengths_um = self.colours.iter().map(|&[r, g, b, um]| (um, [r, g, b]));
            self.orders.densities(q, wavelengths_um, |um, weight, density_um2| {
                let value = density_um2 / (um * um);
                rgb = [0, 1, 2].map(|c| rgb[c] + value * weight[c]);
            });
        }
        rgb
    }

    fn relief_spectral(&self, q: [f32; 3], wavelength_nm: f32) -> Option<f32> {
        let wavelength_um = visible_um(wavelength_nm).filter(|_| is_query(q));
        Some(wavelength_um.map_or(0.0, |um| self.orders.density_at(q, um) / (um * um)))
    }

    fn relief_shader(&self) -> MethodShader<'_> {
        let uniform = FlssUniform {
            grid: self.orders.grid,
            wavelengths: self.colours.len() as u32,
            _pad0: 0,
            _pad1: 0,
            _pad2: 0,
        };
        MethodShader {
            name: "flss",
            wgsl: WGSL.to_vec(),
            uniform: bytemuck::bytes_of(&uniform).to_vec(),
            storage: vec![Cow::Borrowed(bytemuck::cast_slice(&self.colours)), Cow::Borrowed(self.orders.bytes())],
        }
    }
}
