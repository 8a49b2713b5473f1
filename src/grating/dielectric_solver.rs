//! Amplitudes between the orders on both sides of a relief on a lossless dielectric, for the tables of films and
//! interfaces (symbols: `mod.rs`).
//!
//! The first mesh suffices for most waves. Where a solution violates the power balance, it is repeated with twice the
//! nodes. The violation counts relative to the power that falls on a surface. Waves of given t carry at most the
//! fraction `√(1 − y²) = tλ/d`, the *largest cosine* of incidence, which orders along x have.
//!
//! Above the wavelength d/t, where this cosine exceeds 1, ky is imaginary. Such a solution is the continuation that
//! interpolation between wavelengths needs (`order_solver.rs`). It does not conserve power, so it is not checked.

use super::GratingError;
use super::rigorous_solver::{BALANCE, DOUBLINGS, Meshes};
use sunbeam_rigorous::Scattering;

/// Amplitudes for waves at t in the air and the Bloch phase b, at each wavelength in nm. `eta` is the dielectric's
/// index.
///
/// # Errors
/// A point that cannot be solved accurately enough.
pub(super) fn solve_in_air(
    meshes: &Meshes,
    eta: f64,
    (t, b): (f64, f64),
    wavelengths_nm: &[f64],
) -> Result<Vec<Scattering>, GratingError> {
    // The air's matrices do not depend on the wavelength.
    let air = meshes.after(0)?.air(t, b)?;
    let solve = |&nm: &f64| {
        let largest_cosine = t * nm / (1e3 * meshes.period_um());
        solve_balanced(meshes, (t, b, nm), largest_cosine, |doublings| match doublings {
            0 => Ok(air.scatter(eta, nm)?),
            _ => Ok(meshes.after(doublings)?.air(t, b)?.scatter(eta, nm)?),
        })
    };
    wavelengths_nm.iter().map(solve).collect()
}

/// Amplitudes at t, b and a wavelength in nm, on the first mesh whose power balance holds. `solve_after(doublings)` has
/// those on the mesh after a number of doublings of its nodes.
///
/// # Errors
/// [`GratingError::Unbalanced`] where no mesh suffices.
pub(super) fn solve_balanced(
    meshes: &Meshes,
    (t, b, nm): (f64, f64, f64),
    largest_cosine: f64,
    solve_after: impl Fn(usize) -> Result<Scattering, GratingError>,
) -> Result<Scattering, GratingError> {
    let (mut nodes, mut balance) = (0, f64::INFINITY);
    for doublings in 0..=DOUBLINGS {
        let scattering = solve_after(doublings)?;
        let is_continuation = largest_cosine > 1.0;
        (nodes, balance) = (meshes.after(doublings)?.nodes(), scattering.balance_error() * largest_cosine);
        if is_continuation || balance <= BALANCE {
            return Ok(scattering);
        }
    }
    Err(GratingError::Unbalanced { t, b, wavelength_nm: nm, nodes, balance })
}
