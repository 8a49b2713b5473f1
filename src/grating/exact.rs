//! Judge of the grating tables: orders solved for each query.

use super::GratingError;
use super::lobe::REACH;
use super::solved::medium;
use crate::scattering::{Pair, SpectralIndex, Vec3};
use crate::table::CoherenceWindow;
use std::f64::consts::TAU;
use sunbeam_rigorous::{Discretisation, Profile, Resolution, check_size};

/// Accepted imbalance of power: a tenth of the tables' error per order.
const BALANCE: f64 = 5e-4;
/// Largest number of doublings of the nodes while power is not balanced.
const DOUBLINGS: usize = 3;

/// The reflectance of a grating by Maxwell's equations, without tables.
pub struct ExactGrating {
    profile: Profile,
    index: Option<SpectralIndex>,
    sigma_per_um: f64,
}

impl ExactGrating {
    /// A profile in air above a medium of this index, or above a perfect conductor (`None`).
    pub fn new(profile: Profile, index: Option<SpectralIndex>, coherence_length_um: f64) -> Self {
        Self { profile, index, sigma_per_um: CoherenceWindow::new(coherence_length_um).order_sigma_per_um() }
    }

    /// `f_r` in 1/sr, as [`GratingSurface::eval`](super::GratingSurface::eval): zero unless both directions lie above
    /// the surface.
    ///
    /// # Errors
    /// An index or wavelength that the solver refuses, and orders that it cannot solve well enough.
    pub fn eval(&self, wi: Vec3, wo: Vec3, wavelength_nm: f64) -> Result<f64, GratingError> {
        let Some(pair) = Pair::new(wi, wo) else { return Ok(0.0) };
        let period_um = self.profile.period_um();
        let periods = 1e3 * period_um / wavelength_nm;
        // In units of 1/d: an order's standard deviation, and the frequency asked for.
        let deviation = period_um * self.sigma_per_um;
        let (frequency_x, offset_y) = (pair.u * periods, pair.v * periods / deviation);
        if offset_y.abs() >= REACH {
            return Ok(0.0);
        }
        let y = 0.5 * (wi[1] - wo[1]);
        let t = periods * ((1.0 - y) * (1.0 + y)).sqrt();
        check_size(&self.profile, &medium(self.index.as_ref(), wavelength_nm)?, wavelength_nm, y.abs())?;
        let mut sum = 0.0;
        let (first, last) = (frequency_x - REACH * deviation, frequency_x + REACH * deviation);
        for m in first.ceil() as i32..=last.floor() as i32 {
            // Both directions moved by half of the difference to the order, as in `lobe.rs`.
            let a = 0.5 * ((wo[0] - wi[0]) * periods - f64::from(m));
            if a.abs() < t && (a + f64::from(m)).abs() < t {
                let offset_x = (frequency_x - f64::from(m)) / deviation;
                sum += (-0.5 * offset_x * offset_x).exp() * self.efficiency(t, a, m, wavelength_nm)?;
            }
        }
        let density = (periods / deviation).powi(2) / TAU * (-0.5 * offset_y * offset_y).exp();
        Ok(sum * density)
    }

    /// Unpolarised efficiency of an order of the wave with this `t` and `a`.
    fn efficiency(&self, t: f64, a: f64, order: i32, nm: f64) -> Result<f64, GratingError> {
        let medium = medium(self.index.as_ref(), nm)?;
        let mut resolution = Resolution::new(&self.profile, &medium, nm)?;
        let (mut nodes, mut balance) = (0, 0.0);
        for _ in 0..=DOUBLINGS {
            let mesh = Discretisation::new(&self.profile, resolution)?;
            let amplitudes = mesh.air(t, a)?.solve(&medium, nm)?;
            (nodes, balance) = (mesh.nodes(), amplitudes.balance_error());
            if balance <= BALANCE {
                return Ok(amplitudes.efficiency(order, 0));
            }
            resolution.nodes *= 2;
        }
        Err(GratingError::Unbalanced { t, b: a, wavelength_nm: nm, nodes, balance })
    }
}
