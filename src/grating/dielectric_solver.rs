//! Amplitudes between the orders on both sides of a relief on a lossless dielectric, for the tables of films and
//! interfaces (symbols: `mod.rs`). Wave numbers are along x, in units of 2π over the period d. Those of all orders
//! differ by whole numbers; b, the *Bloch phase*, is one of them. t bounds the magnitude of those that propagate in
//! air. In cells of the medium, where nothing propagates in air, tm takes the place of t.
//!
//! A *mesh* is a set of nodes on the profile. The first mesh suffices for most waves. Where a solution violates the
//! power balance, it is repeated with twice the nodes.
//!
//! The solver states the violation relative to the power of a wave. Light at a cosine c of incidence carries the
//! fraction c of the power that would fall on the surface at normal incidence. The violation is therefore multiplied by
//! the *largest cosine* of any incidence with the given t, `√(1 − y²) = tλ/d`, where y is the direction cosine along
//! the grooves. In a medium of index n it is `tm·λ/(n·d)`. The bound [`IMBALANCE_MAX`] on the product therefore limits
//! a power, in units of the power at normal incidence.
//!
//! At wavelengths above d/t, where `tλ/d` exceeds 1, ky is imaginary. Such a solution is the analytic continuation that
//! interpolation between wavelengths needs (`order_solver.rs`). It does not conserve power, so it is not checked.

use super::GratingError;
use super::rigorous_solver::{DOUBLINGS, IMBALANCE_MAX, Meshes};
use sunbeam_rigorous::Scattering;

/// Amplitudes for waves with t in the air and the Bloch phase b, at each wavelength in nm. `eta` is the dielectric's
/// refractive index.
///
/// # Errors
/// A point that cannot be solved accurately enough.
pub(super) fn solve_in_air(
    meshes: &Meshes,
    eta: f64,
    (t, b): (f64, f64),
    wavelengths_nm: &[f64],
) -> Result<Vec<Scattering>, GratingError> {
    // The air's matrices at given t and b do not depend on the wavelength. Those of finer meshes are rarely needed.
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

/// Amplitudes at t (in cells of the medium: tm), b and a wavelength in nm, on the first mesh whose power balance holds.
/// `solve_after(doublings)` solves on the mesh after this number of doublings of its nodes. `largest_cosine` is
/// defined at the head of this file.
///
/// # Errors
/// [`GratingError::Unbalanced`] where no mesh suffices, and errors of `solve_after`.
pub(super) fn solve_balanced(
    meshes: &Meshes,
    (t, b, nm): (f64, f64, f64),
    largest_cosine: f64,
    solve_after: impl Fn(usize) -> Result<Scattering, GratingError>,
) -> Result<Scattering, GratingError> {
    // Where `largest_cosine` exceeds 1, ky is imaginary.
    let is_continuation = largest_cosine > 1.0;
    // Values of the last attempt, for the error.
    let (mut nodes, mut balance) = (0, f64::INFINITY);
    for doublings in 0..=DOUBLINGS {
        let scattering = solve_after(doublings)?;
        (nodes, balance) = (meshes.after(doublings)?.nodes(), scattering.balance_error() * largest_cosine);
        if is_continuation || balance <= IMBALANCE_MAX {
            return Ok(scattering);
        }
    }
    Err(GratingError::Unbalanced { t, b, wavelength_nm: nm, nodes, balance })
}
