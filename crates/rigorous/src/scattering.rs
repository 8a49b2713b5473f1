//! Amplitudes between all orders on both sides of a relief in a lossless dielectric.
//!
//! `lib.rs` has the equations. x is across the grooves, y along them, z up. Fields vary along y as e^{i·ky·y}.
//!
//! | symbol | meaning |
//! | --- | --- |
//! | d, k | period in µm, and wave number in vacuum in rad/µm |
//! | n | index of the lower medium, real |
//! | κ² = k² − ky², κm² = n²k² − ky² | squared wave number in the xz plane, in the air and in the medium |
//! | t = κd/2π, tm = κm·d/2π | bounds of \|b + m\| for orders m that propagate in the air and in the medium |
//! | b | Bloch phase in turns: a field changes by the factor e^{2πib} from one period to the next |
//! | αm = 2π(b + m)/d | wave number of order m along x |
//! | βm | wave number of order m along z: √(κ² − αm²) in the air, √(κm² − αm²) in the medium |
//! | u, ∂νu | field Ey or Hy on the curve, and its derivative along the normal, which points into the air |
//! | S, K | single and double layer potential in the air |
//! | W | response of the medium: the matrix from u to ∂νu |
//!
//! A *flux* is the derivative of a field along the normal, times the speed |dr/dτ| of the curve (`air.rs`).
//! Amplitudes are analytic functions of ky². At ky² < 0, which no direction of light has, their values are the
//! *continuation* ([`Air::solve`]).
//!
//! In the lower medium an incident wave of order m varies as e^{iαm·x + iβm·z}, an outgoing one as e^{iαm·x − iβm·z}.
//!
//! The power of a wave is βm/κ² in the air, for Ey and for Hy of amplitude 1. In the medium it is n²·βm/κm² for Ey and
//! βm/κm² for Hy.
//!
//! *Ey* and *Hy* also name the polarisation states of a wave: state 0, *Ey*, has no Hy; state 1, *Hy*, has no Ey.

use crate::air::{Air, Continuity, join_columns};
use crate::error::positive;
use crate::flat_side::{multiply, passage};
use crate::linear::{Matrix, from_fn, product};
use crate::metal::response;
use crate::waves::{Waves, away_from_cutoffs};
use crate::{Discretisation, Error, Jones};
use num_complex::Complex64;
use std::f64::consts::TAU;

/// Side of the relief.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Side {
    /// In the air.
    Above,
    /// In the medium.
    Below,
}

/// An order on one side of the relief.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Channel {
    /// The side.
    pub side: Side,
    /// Index m of the order.
    pub order: i32,
}

impl Channel {
    /// Order `order` in the air.
    pub fn above(order: i32) -> Self {
        Self { side: Side::Above, order }
    }

    /// Order `order` in the medium.
    pub fn below(order: i32) -> Self {
        Self { side: Side::Below, order }
    }
}

/// Amplitudes between all propagating orders on both sides of one grating, at one (t, b) and wavelength.
///
/// Polarisation states are those of [`Amplitudes`](crate::Amplitudes). The squared magnitude of an amplitude is a
/// fraction of the incident power. Light *incident in* order m has the wave numbers of this order, with the opposite
/// sign along z.
///
/// ```
/// use sunbeam_rigorous::{Channel, Discretisation, Profile, Resolution};
///
/// let profile = Profile::sinusoid(1.1, 0.1)?;
/// let mesh = Discretisation::new(&profile, Resolution { nodes: 64, oversampling: 1 })?;
/// let scattering = mesh.air(1.5, 0.2)?.scatter(1.5, 550.0)?;
/// // All light is reflected or transmitted.
/// assert!(scattering.balance_error() < 1e-3);
/// assert!(scattering.efficiency(Channel::below(0), Channel::above(0)) > 0.5);
/// # Ok::<(), sunbeam_rigorous::Error>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Scattering {
    /// Index n of the medium.
    eta: f64,
    /// Wave number k in vacuum, in rad/µm.
    wave_number: f64,
    /// ky/k; imaginary in the continuation, and above 1 where κ² is negative.
    ky_over_k: Complex64,
    /// Propagating orders in the air.
    above: Waves,
    /// Propagating orders in the medium.
    below: Waves,
    /// Jones matrices `[state out][state in]` at index `out · count + in`. `out` and `in` are positions in
    /// [`Scattering::channels`], which has `count` channels.
    jones: Vec<Jones>,
}

/// A lossless dielectric below a profile at one (tm, b), for any index and wavelength with this `tm = κm·d/2π`: its
/// response and its waves at the nodes of the profile.
///
/// ```
/// use sunbeam_rigorous::{Channel, Discretisation, Profile, Resolution};
///
/// let profile = Profile::sinusoid(1.1, 0.1)?;
/// let mesh = Discretisation::new(&profile, Resolution { nodes: 64, oversampling: 1 })?;
/// // At this tm, light of either wavelength is totally reflected from below.
/// let (tm, b, eta) = (1.5, 0.2, 1.5);
/// let below = mesh.below(tm, b)?;
/// for wavelength_nm in [450.0, 550.0] {
///     let scattering = mesh.air_above(tm, b, eta, wavelength_nm)?.scatter_with(&below, eta, wavelength_nm)?;
///     assert!(scattering.balance_error() < 1e-3);
/// }
/// # Ok::<(), sunbeam_rigorous::Error>(())
/// ```
pub struct Below {
    /// Propagating orders in the medium.
    waves: Waves,
    /// W times the speed, from field to flux.
    response: Matrix,
    /// Incident wave of each order at the nodes: node × order.
    incident: Matrix,
    /// Derivative of the incident waves along the normal, times the speed: node × order.
    incident_flux: Matrix,
    /// Amplitude of each order radiated by the field: order × node.
    from_field: Matrix,
    /// Amplitude of each order radiated by the flux: order × node.
    from_flux: Matrix,
}

impl Below {
    /// Computes response and waves for tm and the Bloch phase b, away from cut-offs.
    ///
    /// # Errors
    /// Special functions that overflow.
    pub(crate) fn new(mesh: &Discretisation, tm: f64, b: f64) -> Result<Self, Error> {
        let tm = away_from_cutoffs(tm, b);
        let kappa_m = tm * TAU / mesh.profile().period_um();
        Self::at(mesh, kappa_m.powi(2), tm, b)
    }

    /// Computes response and waves at κm² in (rad/µm)². tm is κm·d/2π, or zero where κm² is not positive.
    fn at(mesh: &Discretisation, kappa_m_squared: f64, tm: f64, b: f64) -> Result<Self, Error> {
        let (period, nodes) = (mesh.profile().period_um(), &mesh.coarse);
        let response = response(mesh, kappa_m_squared.into(), b)?;
        let waves = Waves::propagating(period, tm, b);
        let (alpha, beta) = (&waves.alpha, &waves.beta);
        let (node_count, count, step) = (nodes.len(), alpha.len(), nodes.step());
        let upwards = |i: usize, m: usize| Complex64::cis(alpha[m] * nodes.x[i] + beta[m] * nodes.z[i]);
        // The derivative of the phase along the normal, times the speed. `sign` is that of the wave vector along z.
        let slope = |i: usize, m: usize, sign: f64| {
            let [nx, nz] = nodes.normal[i];
            (alpha[m] * nx + sign * beta[m] * nz) * nodes.speed[i]
        };
        // Below the relief, order m of the Green's function G of a source at (x, z) has the amplitude
        // i/(2dβm)·e^{−iαm·x + iβm·z}. `green` is this amplitude, divided by i and multiplied by the quadrature step.
        // By Green's formula the field below is ∫ (∂νu·G − u·∂νG) ds, and ∂ν gives the factor −i(αm·nx − βm·nz).
        let green = |m: usize, i: usize| {
            Complex64::cis(-alpha[m] * nodes.x[i] + beta[m] * nodes.z[i]) * (step / (2.0 * period * beta[m]))
        };
        Ok(Self {
            response,
            incident: from_fn(node_count, count, upwards),
            incident_flux: from_fn(node_count, count, |i, m| Complex64::I * upwards(i, m) * slope(i, m, 1.0)),
            from_field: from_fn(count, node_count, |m, i| -green(m, i) * slope(i, m, -1.0)),
            from_flux: from_fn(count, node_count, |m, i| Complex64::I * green(m, i)),
            waves,
        })
    }
}

impl Air<'_> {
    /// Amplitudes between all orders on both sides, above a lossless dielectric of index `eta` at a wavelength (nm).
    ///
    /// Where ky is imaginary, the amplitudes are the continuation that [`Air::solve`] describes.
    ///
    /// # Errors
    /// An index or wavelength that is not finite and positive, special functions that overflow, and solutions that are
    /// not finite.
    pub fn scatter(&self, eta: f64, wavelength_nm: f64) -> Result<Scattering, Error> {
        let k = TAU * 1e3 / positive("wavelength in nm", wavelength_nm)?;
        // κm² = n²k² − ky².
        let kappa_m_squared = (positive("eta", eta)? * k).powi(2) - self.ky_squared(k);
        let below = if kappa_m_squared > 0.0 {
            let tm = kappa_m_squared.sqrt() * self.mesh().profile().period_um() / TAU;
            Below::new(self.mesh(), tm, self.b())?
        } else {
            // An index below 1: waves that run steeply enough along the grooves do not enter the medium.
            Below::at(self.mesh(), kappa_m_squared, 0.0, self.b())?
        };
        self.scatter_with(&below, eta, wavelength_nm)
    }

    /// [`Air::scatter`] with the medium `below`. It must come from the same discretisation, at this Bloch phase and the
    /// tm that belongs to `eta` and the wavelength; this is not checked.
    ///
    /// # Errors
    /// An index or wavelength that is not finite and positive, and solutions that are not finite.
    pub fn scatter_with(&self, below: &Below, eta: f64, wavelength_nm: f64) -> Result<Scattering, Error> {
        let k = TAU * 1e3 / positive("wavelength in nm", wavelength_nm)?;
        let continuity = self.continuity(Complex64::from(positive("eta", eta)?), k);
        // Flux ∂νu₀ − W u₀ that light from below adds to the response, where u₀ is the incident field (`lib.rs`).
        let added = &below.incident_flux - &product(&below.response, &below.incident);
        let from_below = product(self.single(), &added);
        // The field in the air satisfies (½ − K)u + S·flux = incident, and its flux contains weight · added, with the
        // weight of the state (`Continuity`). This known part moves to the right-hand side. Columns are the waves from
        // above, then those from below.
        let right = continuity.weights.map(|weight| join_columns(self.incident(), &(&from_below * -weight)));
        let fields = self.fields(&continuity, &below.response, right.each_ref())?;
        let fluxes_below = self.fluxes_below(&below.response, &fields, &added);
        let fluxes = self.fluxes(&continuity, &fields, &fluxes_below);
        let out_above = self.radiated(&fields, &fluxes);
        let out_below =
            [0, 1].map(|i| product(&below.from_field, &fields[i]) + product(&below.from_flux, &fluxes_below[i]));
        let jones = jones_matrices(self.waves(), &below.waves, &continuity, [&out_above, &out_below]);
        let ky_over_k = Complex64::from(self.ky_squared(k)).sqrt() / k;
        let (above, below) = (self.waves().clone(), below.waves.clone());
        Ok(Scattering { eta, wave_number: k, ky_over_k, above, below, jones })
    }

    /// Fluxes of Ey and Hy in the lower medium. Columns are those of [`Air::fields`]: all incident waves in the state
    /// Ey, then all in the state Hy, and in each state those from above, then those from below.
    ///
    /// `added`, node × wave from below, is the flux that light from below adds to the response. It adds to the flux of
    /// the wave's own state only.
    fn fluxes_below(&self, response: &Matrix, fields: &[Matrix; 2], added: &Matrix) -> [Matrix; 2] {
        let above = self.waves().orders.len();
        let count = above + added.ncols();
        [0, 1].map(|state| {
            let mut flux = product(response, &fields[state]);
            for column in 0..added.ncols() {
                let mut into = flux.column_mut(state * count + above + column);
                into += &added.column(column);
            }
            flux
        })
    }
}

impl Scattering {
    /// All channels: the propagating orders above, then those below, each ascending.
    pub fn channels(&self) -> impl Iterator<Item = Channel> + '_ {
        let above = self.above.orders.iter().map(|&order| Channel::above(order));
        above.chain(self.below.orders.iter().map(|&order| Channel::below(order)))
    }

    /// Indices of the propagating orders on a side, ascending.
    pub fn orders(&self, side: Side) -> &[i32] {
        &self.waves(side).orders
    }

    /// Wave numbers αm of the orders on a side along x, in rad/µm.
    pub fn alpha_per_um(&self, side: Side) -> &[f64] {
        &self.waves(side).alpha
    }

    /// Wave numbers βm of the orders on a side along z, in rad/µm; positive.
    pub fn beta_per_um(&self, side: Side) -> &[f64] {
        &self.waves(side).beta
    }

    /// ky²/k², common to all orders; negative in the continuation.
    pub fn ky_squared_ratio(&self) -> f64 {
        (self.ky_over_k * self.ky_over_k).re
    }

    /// Jones matrix from one channel to another; zero where either does not propagate.
    pub fn jones(&self, out: Channel, from: Channel) -> Jones {
        match (self.position(out), self.position(from)) {
            (Some(out), Some(from)) => self.jones[out * self.count() + from],
            _ => [[Complex64::ZERO; 2]; 2],
        }
    }

    /// [`Scattering::jones`] of a film: channels below lie in the air under its flat lower side. Light passes that side
    /// once; the matrix is zero where the side reflects an order totally.
    pub fn film_jones(&self, out: Channel, from: Channel) -> Jones {
        let mut jones = self.jones(out, from);
        if from.side == Side::Below {
            // Rows of `passage` are states in the air. Light from the air into the medium needs the transpose.
            jones = multiply(&jones, &transposed(self.passage(from.order, false)));
        }
        if out.side == Side::Below {
            jones = multiply(&self.passage(out.order, true), &jones);
        }
        jones
    }

    /// Fraction of unpolarised light incident in one channel that leaves in another; zero where either does not
    /// propagate. Where ky is imaginary, it is the analytic continuation of this fraction in ky².
    pub fn efficiency(&self, out: Channel, from: Channel) -> f64 {
        self.unpolarised_power(self.jones(out, from))
    }

    /// [`Scattering::efficiency`] of a film, from [`Scattering::film_jones`].
    pub fn film_efficiency(&self, out: Channel, from: Channel) -> f64 {
        self.unpolarised_power(self.film_jones(out, from))
    }

    /// Mean over both states of incident light of the power in a Jones matrix.
    ///
    /// Elements between Ey and Hy are odd in ky, so their squared magnitudes have the factor ky². In the continuation
    /// it is negative.
    fn unpolarised_power(&self, jones: Jones) -> f64 {
        let sign = if self.ky_over_k.im == 0.0 { 1.0 } else { -1.0 };
        let [[ee, eh], [he, hh]] = jones.map(|row| row.map(|element| element.norm_sqr()));
        0.5 * (ee + hh + sign * (eh + he))
    }

    /// Jones matrix of the flat side of a film for an order, `[state in the air][state in the medium]`. Zero where that
    /// side reflects the order totally, and where the order does not propagate in the medium.
    ///
    /// αm and ky are equal on both sides of a boundary, so βm in the air below the film equals βm above the relief.
    fn passage(&self, order: i32, is_downwards: bool) -> Jones {
        let position_on = |side: Side| self.orders(side).iter().position(|&m| m == order);
        let (Some(above), Some(below)) = (position_on(Side::Above), position_on(Side::Below)) else {
            return [[Complex64::ZERO; 2]; 2];
        };
        let relative = |wave_number: f64| wave_number / self.wave_number;
        let normals = [relative(self.above.beta[above]), relative(self.below.beta[below])];
        passage(self.eta, relative(self.below.alpha[below]), self.ky_over_k, normals, is_downwards)
    }

    /// Violation of the power balance: the largest |reflected + transmitted − 1| over all incident channels and states.
    ///
    /// Meaningless where ky is imaginary ([`Air::solve`]): squared magnitudes of the continuation are not powers.
    pub fn balance_error(&self) -> f64 {
        let count = self.count();
        let mut worst = 0.0_f64;
        for from in 0..count {
            for state in [0, 1] {
                let sum: f64 =
                    (0..count).flat_map(|out| self.jones[out * count + from].map(|row| row[state].norm_sqr())).sum();
                worst = worst.max((sum - 1.0).abs());
            }
        }
        worst
    }

    /// Violation of reciprocity: the largest magnitude of the difference between an amplitude and that of the reversed
    /// path. `reversed` are the amplitudes of the same grating and wavelength at t and −b.
    pub fn reciprocity_error(&self, reversed: &Self) -> f64 {
        let mut worst = 0.0_f64;
        // At −b, order −m has the opposite wave number along x.
        let opposite = |channel: Channel| Channel { order: -channel.order, ..channel };
        for out in self.channels() {
            for from in self.channels() {
                let (forward, backward) = (self.jones(out, from), reversed.jones(opposite(from), opposite(out)));
                for i in [0, 1] {
                    for j in [0, 1] {
                        worst = worst.max((forward[i][j] - backward[j][i]).norm());
                    }
                }
            }
        }
        worst
    }

    /// Propagating orders on a side.
    fn waves(&self, side: Side) -> &Waves {
        match side {
            Side::Above => &self.above,
            Side::Below => &self.below,
        }
    }

    /// Number of channels.
    fn count(&self) -> usize {
        self.above.orders.len() + self.below.orders.len()
    }

    /// Position of a channel in [`Scattering::channels`]; `None` where it does not propagate.
    fn position(&self, channel: Channel) -> Option<usize> {
        let on_side = self.orders(channel.side).iter().position(|&m| m == channel.order)?;
        Some(if channel.side == Side::Above { on_side } else { self.above.orders.len() + on_side })
    }
}

/// The Jones matrix with exchanged states.
fn transposed(jones: Jones) -> Jones {
    [0, 1].map(|i| [0, 1].map(|j| jones[j][i]))
}

/// Jones matrices of [`Scattering`], from the amplitudes `out` of Ey and Hy on either side, `[side][component]`: order
/// × incident wave.
fn jones_matrices(above: &Waves, below: &Waves, continuity: &Continuity, out: [&[Matrix; 2]; 2]) -> Vec<Jones> {
    let (n_above, count) = (above.orders.len(), above.orders.len() + below.orders.len());
    // Power of a wave of amplitude 1, times κ²: βm in the air; in the medium βm·n²κ²/κm² for Ey and βm·κ²/κm² for Hy.
    // `continuity.weights` has the factors n²κ²/κm² and κ²/κm². Where κ² is negative, so are they, but no order
    // propagates in the air: all channels are in the medium, and their ratios of powers are those of the magnitudes.
    let power = |position: usize, state: usize| match position.checked_sub(n_above) {
        None => above.beta[position],
        Some(position) => below.beta[position] * continuity.weights[state].norm(),
    };
    (0..count * count)
        .map(|i| {
            let (to, from) = (i / count, i % count);
            let (side, row) = if to < n_above { (0, to) } else { (1, to - n_above) };
            [0, 1].map(|state_out| {
                [0, 1].map(|state_in| {
                    let amplitude = out[side][state_out][(row, state_in * count + from)];
                    amplitude * (power(to, state_out) / power(from, state_in)).sqrt()
                })
            })
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Medium, Profile, Resolution};

    #[test]
    fn light_that_cannot_enter_the_medium_is_solved_as_from_above_alone() {
        let profile = Profile::sinusoid(1.1, 0.1).unwrap();
        let mesh = Discretisation::new(&profile, Resolution { nodes: 64, oversampling: 1 }).unwrap();
        // With t = 1.2 and d = 2λ, ky = 0.8 k exceeds n·k.
        let (air, eta, nm) = (mesh.air(1.2, 0.3).unwrap(), 0.5, 550.0);
        let scattering = air.scatter(eta, nm).unwrap();
        let amplitudes = air.solve(&Medium::index(eta, 0.0).unwrap(), nm).unwrap();
        assert!(scattering.orders(Side::Below).is_empty());
        for m in [-1, 0] {
            let found = scattering.efficiency(Channel::above(m), Channel::above(0));
            let expected = amplitudes.efficiency(m, 0);
            // Rounding.
            assert!(expected > 0.0 && (found - expected).abs() < 1e-12, "{m}: {found} {expected}");
        }
    }
}
