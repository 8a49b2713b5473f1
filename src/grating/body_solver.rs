//! The solver behind the tables of bodies that transmit: both sides of the relief (symbols: `mod.rs`).

use super::GratingError;
use super::lobe::cell_index;
use super::order_solver::OrderSolver;
use super::rigorous_solver::{BALANCE, DOUBLINGS, Meshes};
use crate::scattering::TransparentBody;
use sunbeam_rigorous::{Air, Channel, Discretisation, Scattering, Side};

/// The solver of a profile on a body that transmits. The orders of a film are those of air, which leave it on either side;
/// those of an interface are the medium's.
pub(super) struct BodySolver<'a> {
    pub(super) meshes: &'a Meshes,
    pub(super) body: TransparentBody,
}

impl BodySolver<'_> {
    /// The air at t and b, at a wavelength in nm.
    ///
    /// # Errors
    /// Special functions that overflow.
    fn air<'m>(&self, mesh: &'m Discretisation, t: f64, b: f64, nm: f64) -> Result<Air<'m>, GratingError> {
        Ok(if self.body.is_film { mesh.air(t, b)? } else { mesh.air_above(t, b, self.body.eta, nm)? })
    }

    /// Amplitudes at t and b, on the first mesh whose power balance holds. `first` is the air of the first mesh, where it
    /// is known.
    ///
    /// # Errors
    /// [`GratingError::Unbalanced`] where no mesh suffices.
    fn solve(&self, t: f64, b: f64, nm: f64, first: Option<&Air<'_>>) -> Result<Scattering, GratingError> {
        let cosine = t / (1e3 * self.meshes.period_um() * self.cell_index() / nm);
        let (mut nodes, mut balance) = (0, f64::INFINITY);
        for doublings in 0..=DOUBLINGS {
            let mesh = self.meshes.after(doublings)?;
            let scattering = match first.filter(|_| doublings == 0) {
                Some(air) => air.scatter(self.body.eta, nm)?,
                None => self.air(mesh, t, b, nm)?.scatter(self.body.eta, nm)?,
            };
            (nodes, balance) = (mesh.nodes(), scattering.balance_error() * cosine.min(1.0));
            // Power is not conserved in the continuation to imaginary ky.
            if cosine > 1.0 || balance <= BALANCE {
                return Ok(scattering);
            }
        }
        Err(GratingError::Unbalanced { t, b, wavelength_nm: nm, nodes, balance })
    }

    /// Unpolarised efficiency of light from one channel to another, `[to, from]`, at tm of the medium and the Bloch phase b.
    ///
    /// # Errors
    /// Those of [`BodySolver::solve`].
    pub(super) fn efficiency(
        &self,
        tm: f64,
        b: f64,
        nm: f64,
        [to, from]: [Channel; 2],
    ) -> Result<f64, GratingError> {
        let interface = Self { body: TransparentBody { is_film: false, ..self.body }, ..*self };
        let scattering = interface.solve(tm, b, nm, None)?;
        Ok(self.passed(&scattering, to, from))
    }

    /// Unpolarised efficiencies between all channels, `[incident · channels + outgoing]`.
    fn efficiencies_of(&self, scattering: &Scattering) -> Vec<f64> {
        let orders = scattering.orders(if self.body.is_film { Side::Above } else { Side::Below });
        let channels = || {
            let on = |side: Side| orders.iter().map(move |&order| Channel { side, order });
            on(Side::Above).chain(on(Side::Below))
        };
        channels().flat_map(|from| channels().map(move |out| self.passed(scattering, out, from))).collect()
    }

    /// Unpolarised efficiency of light from one channel to another, behind the flat side of a film.
    fn passed(&self, scattering: &Scattering, out: Channel, from: Channel) -> f64 {
        if self.body.is_film { scattering.film_efficiency(out, from) } else { scattering.efficiency(out, from) }
    }
}

impl OrderSolver for BodySolver<'_> {
    fn efficiencies(&self, t: f64, b: f64, wavelengths_nm: &[f64]) -> Result<Vec<Vec<f64>>, GratingError> {
        // The air of an interface depends on the wavelength.
        let shared = if self.body.is_film { Some(self.meshes.after(0)?.air(t, b)?) } else { None };
        wavelengths_nm
            .iter()
            .map(|&nm| Ok(self.efficiencies_of(&self.solve(t, b, nm, shared.as_ref())?)))
            .collect()
    }

    fn sides(&self) -> usize {
        2
    }

    fn cell_index(&self) -> f64 {
        cell_index(Some(self.body))
    }
}
