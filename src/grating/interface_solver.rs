//! The solver behind the tables of interfaces: the orders on both sides of the relief in one cell (symbols: `mod.rs`;
//! cells: [`InterfaceCells`](super::InterfaceCells)).

use super::GratingError;
use super::cell_position::{middle_order, wave_at};
use super::dielectric_solver::{solve_balanced, solve_in_air};
use super::rigorous_solver::Meshes;
use sunbeam_rigorous::{Channel, Scattering};

/// Smallest t of a solved point. At t = 0 the lattice sum of the air has no limit; efficiencies hardly change below.
const T_MIN: f64 = 1e-4;
/// Ratio of the longest wavelength solved at a tm to that at which light begins to propagate in the air. Close to 1 the
/// solver needs many nodes, since the field in the air hardly decays.
const BELOW_CRITICAL: f64 = 0.99;

/// The solver of a profile on an interface.
pub(super) struct InterfaceSolver<'a> {
    pub(super) meshes: &'a Meshes,
    /// Index of the medium.
    pub(super) eta: f64,
}

/// A cell of a table of an interface.
#[derive(Clone, Copy, Debug)]
pub(super) struct InterfaceCell {
    /// Whether it is a cell of the air; otherwise one of the medium.
    pub in_air: bool,
    /// Index s: −1 or above in the air, 0 or above in the medium.
    pub index: i32,
    /// Orders in the medium beyond those of the cell, on either side of them.
    pub extra: u32,
}

impl InterfaceCell {
    /// Numbers of channels above and below.
    pub(super) fn side_counts(self) -> [usize; 2] {
        let orders = (self.index + 1) as usize;
        [if self.in_air { orders } else { 0 }, orders + 2 * self.extra as usize]
    }

    /// Number of channels.
    pub(super) fn channels(self) -> usize {
        self.side_counts().iter().sum()
    }

    /// The side and order of a channel at the points of [`InterfaceCell::wave`].
    pub(super) fn channel(self, number: usize) -> Channel {
        let [above, _] = self.side_counts();
        let middle = middle_order(self.index);
        match number.checked_sub(above) {
            None => Channel::above(number as i32 - middle),
            Some(number) => Channel::below(number as i32 - middle - self.extra as i32),
        }
    }

    /// The channel opposite to a channel, to which reversal of the light exchanges it.
    pub(super) fn opposite(self, number: usize) -> usize {
        let [above, below] = self.side_counts();
        if number < above { above - 1 - number } else { above + (above + below - 1 - number) }
    }

    /// t, or tm in the medium, and Bloch phase b at the fractional parts p and q.
    pub(super) fn wave(self, fractions: [f64; 2]) -> (f64, f64) {
        let (t, b) = wave_at(self.index, fractions);
        // Efficiencies are functions of ky², which is the same at −t.
        (t.abs(), b)
    }
}

impl InterfaceSolver<'_> {
    /// Amplitudes at the wave (t, b) of the air or the wave (tm, b) of the medium, at each wavelength in nm. In the
    /// medium, wavelengths at which light would propagate in the air are replaced by the longest at which it does not.
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
        let period_nm = 1e3 * self.meshes.period_um();
        let critical_nm = (self.eta * self.eta - 1.0).sqrt() * period_nm / t;
        let first = self.meshes.after(0)?;
        let below_first = first.below(t, b)?;
        let solve = |&nm: &f64| {
            let nm = nm.min(BELOW_CRITICAL * critical_nm);
            // The largest cosine of incidence in the medium.
            let largest_cosine = t * nm / (self.eta * period_nm);
            solve_balanced(self.meshes, (t, b, nm), largest_cosine, |doublings| {
                let mesh = self.meshes.after(doublings)?;
                let air = mesh.air_above(t, b, self.eta, nm)?;
                Ok(match doublings {
                    0 => air.scatter_with(&below_first, self.eta, nm)?,
                    _ => air.scatter_with(&mesh.below(t, b)?, self.eta, nm)?,
                })
            })
        };
        wavelengths_nm.iter().map(solve).collect()
    }
}

/// Whether an order propagates on a side of a solution.
pub(super) fn propagates(scattering: &Scattering, channel: Channel) -> bool {
    let Channel { side, order } = channel;
    scattering.orders(side).contains(&order)
}
