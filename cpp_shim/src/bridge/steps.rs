//! Steps of central difference quotients, by which C++ (`lobe.h`) differentiates values of the BSDF with respect to the
//! components of directions. C++ derives the steps of the relief's relative sizes `scale` and `depth` from them.
//!
//! Tables are functions of two variables. One is the scattering vector's tangential part over the wavelength, over
//! which each diffraction order is a Gaussian. The other is the phase rate κ = 2πw/λ in rad per µm of height, with
//! the scattering vector's normal component w = cosθi + cosθo.

use super::ffi;
use super::surface::{Surface, Tables};
use std::f64::consts::TAU;
use sunbeam::table::WAVELENGTH_MIN_NM;

/// Step h of difference quotients, as a fraction of an order's standard deviation and of the distance between knots of
/// the tables. The relative error of a central quotient is about h²/6, or 4e-4. Larger steps increase it; smaller ones
/// amplify rounding in single precision.
const STEP_FRACTION: f64 = 0.05;
/// Largest distance between knots in w from which a step is derived: half of the range of w, from 0 to 2. Tables of
/// gratings, which have no knots in w, take it, too.
const KNOT_STEP_MAX: f64 = 1.0;

impl Surface {
    /// Steps for the tables of this surface, in direction cosines.
    pub(super) fn steps(&self) -> ffi::Steps {
        // At the shortest wavelength, where orders are narrowest and knots densest in direction cosines.
        let shortest_um = WAVELENGTH_MIN_NM * 1e-3;
        // Standard deviation of an order in direction cosines x and y, and distance of the tables' knots in w = λκ/2π.
        let (order_sigma, knot_step) = match &self.tables {
            Tables::Spectral(tables) => {
                let layout = &tables.0.layout().table;
                // `sigma` is in nodes of the table, which are 1/period apart.
                let order_sigma = [0, 1].map(|axis| shortest_um * layout.sigma[axis] / layout.period_um[axis]);
                (order_sigma, shortest_um * layout.kappa_step / TAU)
            }
            Tables::Colours(tables) => {
                let table = tables.0.table();
                // A table of colours has knots in w on each of its rings. The densest ring counts.
                let knots_per_w_max =
                    table.rings().map(|ring| f64::from(ring.knots_per_w)).fold(1.0 / KNOT_STEP_MAX, f64::max);
                ([shortest_um * table.report().order_sigma_per_um; 2], 1.0 / knots_per_w_max)
            }
            Tables::Grating(tables) => ([shortest_um * tables.0.layout().sigma_per_um; 2], KNOT_STEP_MAX),
            Tables::GratingColours(tables) => {
                ([shortest_um * tables.0.grating().layout().sigma_per_um; 2], KNOT_STEP_MAX)
            }
        };
        ffi::Steps {
            tangential: order_sigma.map(|sigma| (STEP_FRACTION * sigma) as f32),
            normal: (STEP_FRACTION * knot_step.min(KNOT_STEP_MAX)) as f32,
        }
    }
}
