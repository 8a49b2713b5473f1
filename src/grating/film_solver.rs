//! The solver behind the tables of films (symbols: `mod.rs`). It solves at points (t, b). The wave numbers of all
//! orders along x differ by whole numbers in units of 2π over the period. b, the *Bloch phase*, is one of them, and t
//! bounds the magnitude of those that propagate in air.
//!
//! A film is a relief on a dielectric whose lower side is flat and has air below it. Light passes the flat side once;
//! reflections between both sides are left out, so the film's thickness does not matter. With air on either side, both
//! have the same orders. An order on one side is a *channel*.

use super::GratingError;
use super::dielectric_solver::solve_in_air;
use super::jones_shape::{JonesShape, jones_shape};
use super::order_solver::{OrderSolver, ShapeSolver};
use super::rigorous_solver::Meshes;
use sunbeam_rigorous::{Channel, Scattering, Side};

/// The solver of a profile on a film.
pub(super) struct FilmSolver<'a> {
    /// Sets of nodes on the profile; finer sets serve where a solution violates the power balance.
    pub(super) meshes: &'a Meshes,
    /// Refractive index of the film.
    pub(super) eta: f64,
}

impl FilmSolver<'_> {
    /// `extract(amplitudes, outgoing channel, incident channel)` for all pairs of channels, at each wavelength in nm:
    /// `[wavelength][incident · channels + outgoing]`. Channels are the orders above the film, then those below it.
    ///
    /// # Errors
    /// A point that cannot be solved accurately enough.
    fn at_wavelengths<T>(
        &self,
        t: f64,
        b: f64,
        wavelengths_nm: &[f64],
        extract: impl Fn(&Scattering, Channel, Channel) -> T,
    ) -> Result<Vec<Vec<T>>, GratingError> {
        let over_channels = |scattering: Scattering| {
            // Orders of `Side::Below` are those inside the film. Some are reflected totally at its flat side, so
            // channels below have the orders in air instead.
            let orders_in_air = scattering.orders(Side::Above);
            let channels = || {
                let on = |side: Side| orders_in_air.iter().map(move |&order| Channel { side, order });
                on(Side::Above).chain(on(Side::Below))
            };
            let pairs = channels().flat_map(|from| channels().map(move |out| (out, from)));
            pairs.map(|(out, from)| extract(&scattering, out, from)).collect()
        };
        let solutions = solve_in_air(self.meshes, self.eta, (t, b), wavelengths_nm)?;
        Ok(solutions.into_iter().map(over_channels).collect())
    }
}

impl OrderSolver for FilmSolver<'_> {
    fn efficiencies(&self, t: f64, b: f64, wavelengths_nm: &[f64]) -> Result<Vec<Vec<f64>>, GratingError> {
        self.at_wavelengths(t, b, wavelengths_nm, Scattering::film_efficiency)
    }

    fn sides(&self) -> usize {
        2
    }
}

impl ShapeSolver for FilmSolver<'_> {
    fn shapes(&self, t: f64, b: f64, wavelengths_nm: &[f64]) -> Result<Vec<Vec<JonesShape>>, GratingError> {
        self.at_wavelengths(t, b, wavelengths_nm, |scattering, out, from| {
            jones_shape(scattering.film_jones(out, from), scattering.ky_squared_ratio())
        })
    }
}
