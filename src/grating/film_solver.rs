//! The solver behind the tables of films: the orders on both sides of the relief that leave the film (symbols:
//! `mod.rs`). Behind the flat side of a film light is in air again, so both sides have the same orders.

use super::GratingError;
use super::order_solver::OrderSolver;
use super::rigorous_solver::{BALANCE, DOUBLINGS, Meshes};
use sunbeam_rigorous::{Air, Channel, Scattering, Side};

/// The solver of a profile on a film.
pub(super) struct FilmSolver<'a> {
    pub(super) meshes: &'a Meshes,
    /// Index of the film.
    pub(super) eta: f64,
}

impl FilmSolver<'_> {
    /// Amplitudes at t and b, on the first mesh whose power balance holds. `air` is that of the first mesh.
    ///
    /// # Errors
    /// [`GratingError::Unbalanced`] where no mesh suffices.
    fn solve(&self, t: f64, b: f64, nm: f64, air: &Air<'_>) -> Result<Scattering, GratingError> {
        // Largest cosine of incidence; above 1, ky is imaginary.
        let cosine = t / (1e3 * self.meshes.period_um() / nm);
        let (mut nodes, mut balance) = (0, f64::INFINITY);
        for doublings in 0..=DOUBLINGS {
            let mesh = self.meshes.after(doublings)?;
            let scattering = match doublings {
                0 => air.scatter(self.eta, nm)?,
                _ => mesh.air(t, b)?.scatter(self.eta, nm)?,
            };
            (nodes, balance) = (mesh.nodes(), scattering.balance_error() * cosine.min(1.0));
            // Power is not conserved in the continuation to imaginary ky.
            if cosine > 1.0 || balance <= BALANCE {
                return Ok(scattering);
            }
        }
        Err(GratingError::Unbalanced { t, b, wavelength_nm: nm, nodes, balance })
    }
}

impl OrderSolver for FilmSolver<'_> {
    fn efficiencies(&self, t: f64, b: f64, wavelengths_nm: &[f64]) -> Result<Vec<Vec<f64>>, GratingError> {
        let air = self.meshes.after(0)?.air(t, b)?;
        let at_wavelength = |&nm: &f64| {
            let scattering = self.solve(t, b, nm, &air)?;
            let channels = || {
                let on = |side: Side| air.orders().iter().map(move |&order| Channel { side, order });
                on(Side::Above).chain(on(Side::Below))
            };
            let pairs = channels().flat_map(|from| channels().map(move |out| (out, from)));
            Ok(pairs.map(|(out, from)| scattering.film_efficiency(out, from)).collect())
        };
        wavelengths_nm.iter().map(at_wavelength).collect()
    }

    fn sides(&self) -> usize {
        2
    }
}
