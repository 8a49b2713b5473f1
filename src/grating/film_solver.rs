//! The solver behind the tables of films: the orders on both sides of the relief that leave the film (symbols:
//! `mod.rs`). Behind the flat side of a film light is in air again, so both sides have the same orders.

use super::GratingError;
use super::jones_shape::{JonesShape, jones_shape};
use super::order_solver::{OrderSolver, ShapeSolver};
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
        let cosine = self.largest_cosine(t, nm);
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

impl FilmSolver<'_> {
    /// `extract(solution, outgoing channel, incident channel, cosine)` for all pairs of channels in the air, at each
    /// wavelength in nm: `[wavelength][incident · channels + outgoing]`. `cosine` is the largest cosine of incidence.
    ///
    /// # Errors
    /// A point that cannot be solved accurately enough.
    fn at_wavelengths<T>(
        &self,
        t: f64,
        b: f64,
        wavelengths_nm: &[f64],
        extract: impl Fn(&Scattering, Channel, Channel, f64) -> T,
    ) -> Result<Vec<Vec<T>>, GratingError> {
        let air = self.meshes.after(0)?.air(t, b)?;
        let at_wavelength = |&nm: &f64| {
            let cosine = self.largest_cosine(t, nm);
            let scattering = self.solve(t, b, nm, &air)?;
            let channels = || {
                let on = |side: Side| air.orders().iter().map(move |&order| Channel { side, order });
                on(Side::Above).chain(on(Side::Below))
            };
            let pairs = channels().flat_map(|from| channels().map(move |out| (out, from)));
            Ok(pairs.map(|(out, from)| extract(&scattering, out, from, cosine)).collect())
        };
        wavelengths_nm.iter().map(at_wavelength).collect()
    }

    /// Largest cosine of incidence at `t` and a wavelength in nm; above 1, ky is imaginary.
    fn largest_cosine(&self, t: f64, nm: f64) -> f64 {
        t / (1e3 * self.meshes.period_um() / nm)
    }
}

impl OrderSolver for FilmSolver<'_> {
    fn efficiencies(&self, t: f64, b: f64, wavelengths_nm: &[f64]) -> Result<Vec<Vec<f64>>, GratingError> {
        self.at_wavelengths(t, b, wavelengths_nm, |scattering, out, from, _| scattering.film_efficiency(out, from))
    }

    fn sides(&self) -> usize {
        2
    }
}

impl ShapeSolver for FilmSolver<'_> {
    fn shapes(&self, t: f64, b: f64, wavelengths_nm: &[f64]) -> Result<Vec<Vec<JonesShape>>, GratingError> {
        self.at_wavelengths(t, b, wavelengths_nm, |scattering, out, from, cosine| {
            jones_shape(scattering.film_jones(out, from), (1.0 - cosine) * (1.0 + cosine))
        })
    }
}
