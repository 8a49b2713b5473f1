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

/// Amplitudes at the point (t, b) and the wavelength in nm of `at`, on the first mesh whose power balance holds. `air`
/// is that of the first mesh, and `air_after` computes it after a number of doublings of the nodes. `cosine` is the
/// largest cosine of incidence.
///
/// # Errors
/// [`GratingError::Unbalanced`] where no mesh suffices.
pub(super) fn solve_balanced<'a>(
    meshes: &'a Meshes,
    eta: f64,
    at: (f64, f64, f64),
    cosine: f64,
    air: &Air<'a>,
    air_after: impl Fn(usize) -> Result<Air<'a>, GratingError>,
) -> Result<Scattering, GratingError> {
    let (t, b, nm) = at;
    let (mut nodes, mut balance) = (0, f64::INFINITY);
    for doublings in 0..=DOUBLINGS {
        let scattering = match doublings {
            0 => air.scatter(eta, nm)?,
            _ => air_after(doublings)?.scatter(eta, nm)?,
        };
        (nodes, balance) = (meshes.after(doublings)?.nodes(), scattering.balance_error() * cosine.min(1.0));
        // Power is not conserved in the continuation to imaginary ky.
        if cosine > 1.0 || balance <= BALANCE {
            return Ok(scattering);
        }
    }
    Err(GratingError::Unbalanced { t, b, wavelength_nm: nm, nodes, balance })
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
        let air_after = |doublings: usize| Ok(self.meshes.after(doublings)?.air(t, b)?);
        let air = air_after(0)?;
        let at_wavelength = |&nm: &f64| {
            let cosine = self.largest_cosine(t, nm);
            let scattering = solve_balanced(self.meshes, self.eta, (t, b, nm), cosine, &air, air_after)?;
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
