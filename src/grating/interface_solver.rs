//! Solver behind the tables of interfaces, and the channels of their cells (symbols: `mod.rs`).
//!
//! Wave numbers are along x, in units of 2π over the period d. `a` is that of the incident wave; those of all orders
//! differ from it by whole numbers, and b, the *Bloch phase*, is any one of them. t and tm bound the magnitude of those
//! that propagate in the air and in the medium.
//!
//! A table has cells of the air, over t and a, and cells of the medium, over tm and a. In cells of the medium light is
//! totally reflected and nothing propagates in the air ([`InterfaceCells`](super::InterfaceCells)). A *channel* is an
//! order on one side of the relief. Channels of a cell are numbered from 0: those above, then those below, each by
//! ascending order.

use super::GratingError;
use super::cell_position::{middle_order, wave_at};
use super::dielectric_solver::{solve_balanced, solve_in_air};
use super::rigorous_solver::Meshes;
use sunbeam_rigorous::{Channel, Scattering};

/// Smallest t of a solved point in a cell of the air. At t = 0 the solver's lattice sum has no limit. Efficiencies
/// hardly vary below this bound; a larger bound would change them.
const T_MIN: f64 = 1e-4;
/// Longest wavelength solved at a given tm, in units of the *critical* wavelength, above which light propagates in the
/// air. With values closer to 1 the solver needs more nodes, since the field in the air hardly decays. With smaller
/// values, more wavelengths are replaced by this one.
const BELOW_CRITICAL: f64 = 0.99;

/// The solver of a profile on an interface.
pub(super) struct InterfaceSolver<'a> {
    /// Sets of nodes on the profile; finer sets serve where a solution violates the power balance.
    pub(super) meshes: &'a Meshes,
    /// Refractive index n of the medium.
    pub(super) eta: f64,
}

/// A cell of a table of an interface.
#[derive(Clone, Copy, Debug)]
pub(super) struct InterfaceCell {
    /// Whether it is a cell of the air; otherwise one of the medium.
    pub in_air: bool,
    /// Index s, the number of orders that propagate in all of the cell minus one: −1 or above in the air, 0 or above in
    /// the medium.
    pub index: i32,
    /// Number of orders in the medium beyond these `index + 1`, at each end of their range.
    pub extra: u32,
}

impl InterfaceCell {
    /// Numbers of channels above and below the relief.
    pub(super) fn side_counts(self) -> [usize; 2] {
        let orders = (self.index + 1) as usize;
        [if self.in_air { orders } else { 0 }, orders + 2 * self.extra as usize]
    }

    /// Number of channels.
    pub(super) fn channels(self) -> usize {
        self.side_counts().iter().sum()
    }

    /// Side and order m of the channel with this number, at the waves that [`InterfaceCell::wave`] returns.
    pub(super) fn channel(self, number: usize) -> Channel {
        let [above, _] = self.side_counts();
        let middle = middle_order(self.index);
        match number.checked_sub(above) {
            None => Channel::above(number as i32 - middle),
            Some(place_below) => Channel::below(place_below as i32 - middle - self.extra as i32),
        }
    }

    /// Number of the channel that takes this channel's place on the reversed path: on the same side, counted from the
    /// other end.
    pub(super) fn opposite(self, number: usize) -> usize {
        let [above, below] = self.side_counts();
        if number < above { above - 1 - number } else { above + (below - 1 - (number - above)) }
    }

    /// t, or tm in a cell of the medium, and Bloch phase b at the fractional parts p of `t − a` and q of `t + a`.
    pub(super) fn wave(self, fractions: [f64; 2]) -> (f64, f64) {
        let (t, b) = wave_at(self.index, fractions);
        // In cell −1, t is negative where p + q < 1. Efficiencies are functions of ky², which is the same at −t.
        (t.abs(), b)
    }
}

impl InterfaceSolver<'_> {
    /// Amplitudes at each wavelength in nm, at the Bloch phase b and `t`, which is tm unless `in_air`. At a given tm,
    /// light propagates in the air at long wavelengths, outside the cells of the medium. These wavelengths are replaced
    /// by [`BELOW_CRITICAL`] times the critical one.
    ///
    /// # Errors
    /// A point that cannot be solved accurately enough.
    pub(super) fn solve(
        &self,
        in_air: bool,
        (t, b): (f64, f64),
        wavelengths_nm: &[f64],
    ) -> Result<Vec<Scattering>, GratingError> {
        if in_air {
            return solve_in_air(self.meshes, self.eta, (t.max(T_MIN), b), wavelengths_nm);
        }
        let tm = t;
        let period_nm = 1e3 * self.meshes.period_um();
        // tm = (d/λ)·√(n² − ky²/k²) at ky = k.
        let critical_nm = (self.eta * self.eta - 1.0).sqrt() * period_nm / tm;
        // The medium's matrices at given tm and b do not depend on the wavelength. The mesh after 0 doublings of its
        // nodes nearly always suffices.
        let below_first = self.meshes.after(0)?.below(tm, b)?;
        let solve = |&nm: &f64| {
            let nm = nm.min(BELOW_CRITICAL * critical_nm);
            // Cosine of incidence in the medium with kx = 0, √(1 − ky²/(nk)²): the weight of the balance error.
            let largest_cosine = tm * nm / (self.eta * period_nm);
            solve_balanced(self.meshes, (tm, b, nm), largest_cosine, |doublings| {
                let mesh = self.meshes.after(doublings)?;
                let air = mesh.air_above(tm, b, self.eta, nm)?;
                Ok(match doublings {
                    0 => air.scatter_with(&below_first, self.eta, nm)?,
                    _ => air.scatter_with(&mesh.below(tm, b)?, self.eta, nm)?,
                })
            })
        };
        wavelengths_nm.iter().map(solve).collect()
    }
}

/// Whether a channel propagates at the wave of a solution.
pub(super) fn propagates(scattering: &Scattering, channel: Channel) -> bool {
    let Channel { side, order } = channel;
    scattering.orders(side).contains(&order)
}
