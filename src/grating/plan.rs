//! Plan of a grating's tables: how many nodes and wavelengths they have, and what the build takes (symbols: `mod.rs`).

use super::GratingError;
use super::build::TableResolution;
use super::solved::{Meshes, Solved, resolution};
use super::wavelengths::Spacing;
use crate::scattering::SpectralIndex;
use crate::table::{Estimate, WAVELENGTH_MAX_NM, WAVELENGTH_MIN_NM};
use sunbeam_rigorous::Profile;

/// Least and most nodes of a table along either side of a cell. A perfect conductor's table, which has no wavelengths,
/// takes the most.
const STORED: [u32; 2] = [18, 32];
/// Bytes that a table may take for more than the least number of nodes. Chosen: what fits into a processor's cache.
const BYTES_MAX: f64 = 4e6;
/// Accepted RMS of an efficiency's highest Chebyshev terms, in a table of [`FULL_CELLS`] cells or more. With fewer
/// cells fewer orders share the light, and the tolerance falls in proportion.
const TERMS_TOLERANCE: f64 = 6e-3;
/// Number of cells from which [`TERMS_TOLERANCE`] applies unscaled: that of a period of 2.3 µm.
const FULL_CELLS: f64 = 14.0;
/// Accepted RMS error of an efficiency halfway between two wavelengths. Chosen: about a quarter of [`TERMS_TOLERANCE`].
const WAVELENGTH_TOLERANCE: f64 = 1.6e-3;

/// Wavelengths of a metal's table, for estimates: those of steps of 20 nm.
const ESTIMATED_WAVELENGTHS: f64 = 25.0;
/// Solved points of a cell, for estimates: about those of 17 nodes a side (153).
const ESTIMATED_POINTS: f64 = 150.0;
/// Seconds on one core for the fields in air at one point, per squared node of the profile. Measured.
const AIR_SECONDS: f64 = 1e-6;
/// Seconds on one core for the solution at one point and wavelength, per cubed node of the profile. Measured.
const SOLUTION_SECONDS: f64 = 1.2e-9;

/// Meshes of a profile for all wavelengths.
///
/// # Errors
/// Profiles and indices that the solver refuses, and a table beyond `build_limit`.
pub(super) fn meshes(
    profile: &Profile,
    index: Option<&SpectralIndex>,
    build_limit: f64,
) -> Result<Meshes, GratingError> {
    let resolution = resolution(profile, index)?;
    estimate(profile.period_um(), resolution.nodes, index.is_some())
        .check(build_limit, || "a shorter period, or theory \"scalar\", which takes any".to_owned())?;
    Meshes::new(profile, resolution)
}

/// Spacing of the wavelengths of a table; `None` for a perfect conductor, which depends on none.
///
/// # Errors
/// A test point that cannot be solved.
pub(super) fn spacing(
    meshes: &Meshes,
    period_um: f64,
    index: Option<&SpectralIndex>,
) -> Result<Option<Spacing>, GratingError> {
    if index.is_none() {
        return Ok(None);
    }
    Ok(Some(Spacing::choose(period_um, &Solved::new(meshes, index, &[])?, WAVELENGTH_TOLERANCE)?))
}

/// Numbers of nodes and wavelengths of a table of efficiencies.
pub(super) fn table_resolution(period_um: f64, spacing: Option<Spacing>) -> TableResolution {
    let cells = cells(period_um);
    let stored = spacing.map_or(STORED[1], |spacing| {
        let wavelengths = (WAVELENGTH_MAX_NM - WAVELENGTH_MIN_NM) / spacing.step_nm;
        let fitting = (0.5 * BYTES_MAX / entries(cells, wavelengths)).sqrt();
        (fitting as u32).clamp(STORED[0], STORED[1])
    });
    TableResolution { stored, spacing, tolerance: TERMS_TOLERANCE * (cells / FULL_CELLS).min(1.0) }
}

/// Cost of a table's build on two cores, with `nodes` nodes on the profile.
fn estimate(period_um: f64, nodes: usize, has_wavelengths: bool) -> Estimate {
    let cells = cells(period_um);
    let wavelengths = if has_wavelengths { ESTIMATED_WAVELENGTHS } else { 1.0 };
    let nodes = nodes as f64;
    let point_seconds = AIR_SECONDS * nodes * nodes + wavelengths * SOLUTION_SECONDS * nodes.powi(3);
    let stored = f64::from(STORED[usize::from(!has_wavelengths)]).powi(2);
    Estimate {
        bytes: 2.0 * stored * entries(cells, wavelengths),
        seconds: 0.5 * cells * ESTIMATED_POINTS * point_seconds,
    }
}

/// Number of cells at the shortest wavelength, not rounded.
fn cells(period_um: f64) -> f64 {
    2e3 * period_um / WAVELENGTH_MIN_NM + 1.0
}

/// Entries of a table for each pair of nodes (p, q). Longer wavelengths have fewer cells, in the mean a third of the
/// entries of the shortest.
fn entries(cells: f64, wavelengths: f64) -> f64 {
    cells.powi(3) / 3.0 * (wavelengths / 3.0).max(1.0)
}
