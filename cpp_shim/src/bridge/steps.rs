//! Steps of difference quotients, by which C++ differentiates values with respect to the components of directions.

use super::ffi;
use super::surface::{Surface, Tables};
use std::f64::consts::TAU;
use sunbeam::table::WAVELENGTH_MIN_NM;

/// Step h of difference quotients, as a fraction of an order's standard deviation and of the distance between knots of
/// the tables. The relative error of a quotient is about h²/6, or 4e-4. Larger steps increase it; smaller ones amplify
/// rounding in single precision.
const STEP_FRACTION: f64 = 0.05;

impl Surface {
    /// Steps for the tables of this surface, in direction cosines.
    pub(super) fn steps(&self) -> ffi::Steps {
        // At the shortest wavelength, where orders are narrowest and knots densest in direction cosines.
        let shortest_um = WAVELENGTH_MIN_NM * 1e-3;
        // Standard deviation of an order in direction cosines x and y, and distance of the tables' knots in the sum of
        // cosines w = cosθi + cosθo = λκ/2π, with the phase rate κ. Tables of gratings have no knots in w; their
        // distance is then 1, the largest that is used.
        let (order_sigma, knot_step) = match &self.tables {
            Tables::Spectral(tables) => {
                let layout = &tables.0.layout().table;
                let order_sigma = [0, 1].map(|axis| shortest_um * layout.sigma[axis] / layout.period_um[axis]);
                (order_sigma, shortest_um * layout.kappa_step / TAU)
            }
            Tables::Colours(tables) => {
                let table = tables.0.table();
                let knots_per_w_max = table.rings().map(|ring| f64::from(ring.knots_per_w)).fold(1.0, f64::max);
                ([shortest_um * table.report().order_sigma_per_um; 2], 1.0 / knots_per_w_max)
            }
            Tables::Grating(tables) => ([shortest_um * tables.0.layout().sigma_per_um; 2], 1.0),
            Tables::GratingColours(tables) => ([shortest_um * tables.0.grating().layout().sigma_per_um; 2], 1.0),
        };
        ffi::Steps {
            tangential: order_sigma.map(|sigma| (STEP_FRACTION * sigma) as f32),
            normal: (STEP_FRACTION * knot_step.min(1.0)) as f32,
        }
    }
}
