//! All orders on both sides of a lossless dielectric for one direction of light, solved and checked in one call.
//!
//! x is across the grooves, y along them, z up; d is the period. k is the wave number in vacuum, ky that along y. The
//! squared wave numbers in the xz plane are κ² = k² − ky² in the air and κm² = eta²·k² − ky² in the medium. The Bloch
//! phase b is in turns: fields change by the factor e^{2πib} from one period to the next. Lengths are in µm, wave
//! numbers in rad/µm.

use crate::error::positive;
use crate::orders::{COSINE_MIN, check_length, flipped, on_sufficient_nodes};
use crate::{Air, Channel, Error, Medium, Order, Profile, Resolution, Scattering, Side, check_size};
use std::f64::consts::TAU;

/// All propagating orders on both sides for light from one direction.
#[derive(Clone, Debug, PartialEq)]
pub struct BothSides {
    /// Orders in the air, by ascending index.
    pub above: Vec<Order>,
    /// Orders in the medium, by ascending index. Their directions are unit vectors within the medium, with negative z.
    pub below: Vec<Order>,
    /// Nodes on one period with which the checks passed.
    pub nodes: usize,
    /// [`Scattering::balance_error`] of the solution.
    pub balance_error: f64,
    /// [`Scattering::reciprocity_error`] of the solution.
    pub reciprocity_error: f64,
}

/// All propagating orders on both sides of a dielectric of index `eta`, for light of a wavelength (nm) from `wi`.
///
/// `wi` is a unit vector away from the relief, towards the light. Where its z is negative, light comes from below, and
/// `wi` is a direction within the medium. Order m satisfies `k·n·direction.x = −k·n'·wi.x + 2πm/period`. Here k is the
/// wave number in vacuum, n the refractive index of the order's medium, and n' that of the incident light's medium.
/// Balance and reciprocity are checked as by [`solve_orders`](crate::solve_orders).
///
/// ```
/// use sunbeam_rigorous::{Profile, solve_both_sides};
///
/// let profile = Profile::lamellar(1.2, 0.5, 0.5)?;
/// let solved = solve_both_sides(&profile, 1.5, 550.0, [0.0, 0.0, 1.0])?;
/// let sum: f64 = solved.above.iter().chain(&solved.below).map(|order| order.te()).sum();
/// assert!((sum - 1.0).abs() < 1e-3);
/// # Ok::<(), sunbeam_rigorous::Error>(())
/// ```
///
/// # Errors
/// An index below 1, and the errors of [`solve_orders`](crate::solve_orders), except that light is refused only at the
/// horizon, not below it.
pub fn solve_both_sides(profile: &Profile, eta: f64, wavelength_nm: f64, wi: [f64; 3]) -> Result<BothSides, Error> {
    let k = TAU * 1e3 / positive("wavelength in nm", wavelength_nm)?;
    check_length(wi)?;
    if wi[2].abs() < COSINE_MIN {
        let quantity = "magnitude of z of wi";
        return Err(Error::OutOfRange { quantity, found: wi[2].abs(), accepted: "1e-7 to 1, off the horizon" });
    }
    if !(eta.is_finite() && eta >= 1.0) {
        return Err(Error::OutOfRange { quantity: "eta", found: eta, accepted: "finite and at least 1" });
    }
    let medium = Medium::index(eta, 0.0)?;
    let side = if wi[2] > 0.0 { Side::Above } else { Side::Below };
    // Refractive index n' of the medium of the incident light.
    let eta_in = if side == Side::Above { 1.0 } else { eta };
    let period = profile.period_um();
    // Order 0 has the wave number 2πb/d = −k·n'·wi.x along x.
    let b = -wi[0] * eta_in * k * period / TAU;
    // Squared wave number in the xz plane, in the incident light's medium: κ² above, κm² below. Computed from x and z,
    // it keeps its digits for light along the grooves.
    let incident_squared = (eta_in * k).powi(2) * (wi[0] * wi[0] + wi[2] * wi[2]);
    // κ² = κm² − (eta² − 1)k², negative for some light that is totally reflected.
    let kappa_squared =
        if side == Side::Above { incident_squared } else { incident_squared - (eta * eta - 1.0) * k * k };
    // The last argument, |ky|/k, may exceed 1, where κ² is negative. `check_size` takes at most 1. Smaller values make
    // the check stricter, so the bound is safe.
    check_size(profile, &medium, wavelength_nm, (wi[1] * eta_in).abs().min(1.0))?;
    let resolution = Resolution::new(profile, &medium, wavelength_nm)?;
    let (forward, nodes, [balance_error, reciprocity_error]) = on_sufficient_nodes(profile, resolution, |mesh| {
        let solve = |phase: f64| Air::at_kappa_squared(mesh, kappa_squared, phase)?.scatter(eta, wavelength_nm);
        // Reversed paths have the Bloch phase −b.
        let (forward, reversed) = (solve(b)?, solve(-b)?);
        let errors = [forward.balance_error(), forward.reciprocity_error(&reversed)];
        Ok((forward, errors))
    })?;
    let incident = Channel { side, order: 0 };
    // All orders have the incident light's ky = −k·eta_in·wi.y, so in a medium of index `n` their directions have the y
    // component ky/(k·n).
    let orders = |side: Side, n: f64| orders_on(&forward, side, incident, n * k, -wi[1] * eta_in / n);
    let (above, below) = (orders(Side::Above, 1.0), orders(Side::Below, eta));
    Ok(BothSides { above, below, nodes, balance_error, reciprocity_error })
}

/// Lists the orders on one side, for light in the channel `incident`. `wave_number` is that of the side's medium
/// (rad/µm), `y` the y component of all directions there. Jones matrices of `scattering` are those for ky ≥ 0.
fn orders_on(scattering: &Scattering, side: Side, incident: Channel, wave_number: f64, y: f64) -> Vec<Order> {
    let waves = scattering.alpha_per_um(side).iter().zip(scattering.beta_per_um(side));
    let orders = scattering.orders(side).iter().zip(waves);
    orders
        .map(|(&index, (alpha, beta))| {
            // `y` has the sign of ky, but `flipped` takes the y of a direction towards the light, which has the other.
            let jones = flipped(scattering.jones(Channel { side, order: index }, incident), -y);
            let z = if side == Side::Above { beta / wave_number } else { -beta / wave_number };
            Order { index, direction: [alpha / wave_number, y, z], jones }
        })
        .collect()
}
