//! Plan of a grating's tables: their numbers of nodes and wavelengths, and the cost of their build.
//!
//! Light has the wave number k = 2π/λ, and ky along the grooves. Wave numbers along x are in units of 2π/d, where d is
//! the period:
//!
//! - `a`: of the incident wave. That of order m is a + m.
//! - `t = (d/λ)·√(1 − ky²/k²)`: largest of a wave in the air. Order m propagates there if |a + m| ≤ t.
//! - `b`: Bloch phase, `a` up to an integer. All orders of a wave share it, so a solution at the *point* (t, b) holds
//!   for each of them as the incident wave.
//!
//! Lines of whole t − a and t + a divide the plane (t, a) into *cells*. In a cell the same number of orders
//! propagates. The fractional parts `p` of t − a and `q` of t + a are the position in it. Cells that differ by a whole
//! number in `a` have equal points, and count as one: cell `s = ⌊t − a⌋ + ⌊t + a⌋`, with s + 1 orders.
//!
//! Three kinds of node occur:
//!
//! - *Chebyshev nodes* (p, q) of a cell: the points that the solver solves.
//! - *Nodes of the table* (p, q), interpolated from the solved ones. At each, a table has one *entry*, such as an
//!   efficiency, for each pair of an incident and an outgoing *channel*: an order on one side of the relief.
//! - *Mesh nodes*: points on the profile, at which the solver finds the fields.
//!
//! The field between two mesh nodes is summed over the periods, by *lattice sums* for the air and for the medium. At
//! given t and b, those of the air are the same at all wavelengths. Those of a medium of index n depend on
//! `tm² = t² + (n² − 1)(d/λ)²`, and so on the wavelength. An interface also has cells of the medium, where light is
//! totally reflected: there tm takes the place of t.

use super::GratingError;
use super::body::GratingBody;
use super::build::{NODE_COUNTS, TableResolution};
use super::chebyshev::triangle_count;
use super::interface_table::{InterfacePlan, PAIR_BYTES, STORED};
use super::order_solver::OrderSolver;
use super::rigorous_solver::{Meshes, RigorousSolver, sufficient_resolution};
use super::wavelengths::{STEPS_NM, Spacing, table_wavelengths};
use crate::scattering::{ComplexIndex, SpectralIndex};
use crate::table::{Estimate, WAVELENGTH_MAX_NM, WAVELENGTH_MIN_NM};
use sunbeam_rigorous::Profile;

/// Most nodes of a table along either side of a cell. More would reduce the error of linear look-ups, and enlarge the
/// table. A perfect conductor's table, whose efficiencies do not depend on the wavelength, always has this number.
const STORED_MAX: usize = 32;
/// Size in bytes up to which a table has more than [`STORED`], 18, nodes along either side of a cell. A larger table
/// would not fit into a processor's cache.
const BYTES_MAX: f64 = 4e6;
/// Bytes of a stored efficiency.
const ENTRY_BYTES: f64 = 2.0;
/// Accepted RMS of an efficiency's two highest Chebyshev terms over a cell, in a table of [`FULL_CELLS`] cells or more.
/// Larger values leave a larger error, smaller ones need more solved points. Fewer cells have a stricter tolerance, in
/// proportion to their number, since fewer orders share the light.
const TERMS_TOLERANCE: f64 = 6e-3;
/// Number of cells from which [`TERMS_TOLERANCE`] applies unscaled: that of a period of 2.3 µm.
const FULL_CELLS: f64 = 14.0;
/// Accepted RMS error of an efficiency halfway between two wavelengths: a quarter of [`TERMS_TOLERANCE`], so that it
/// adds little. Only with fewer than 3.5 cells, at periods below 0.45 µm, is the scaled tolerance of terms stricter.
const WAVELENGTH_TOLERANCE: f64 = 0.25 * TERMS_TOLERANCE;

// The following constants serve estimates of a build alone. A slower machine takes longer than estimated.

/// Chebyshev nodes along either side of a cell at which most cells of a dielectric are solved. Its efficiencies vary
/// smoothly, without the anomalies of metals, so the fewest, 8, suffice.
const DIELECTRIC_NODES: usize = NODE_COUNTS[0];
/// Chebyshev nodes along either side of a cell at which most cells of metals and perfect conductors are solved: 17.
const METAL_NODES: usize = NODE_COUNTS[2];
/// Step between wavelengths in nm that tables of dielectrics commonly have: 80.
const DIELECTRIC_STEP_NM: f64 = STEPS_NM[0];
/// Step between wavelengths in nm that tables of metals commonly have: 20.
const METAL_STEP_NM: f64 = STEPS_NM[2];
/// Seconds on one core for the lattice sums of the air or of a medium at one point and wavelength, divided by the
/// squared number of mesh nodes. A middle value: measured are 1e-6 in air, 6e-7 in air without propagating
/// orders, and 1.5e-6 in dielectrics.
const LATTICE_SECONDS: f64 = 1e-6;
/// Seconds on one core for the remaining solution at one point and wavelength, divided by the cubed number of mesh
/// nodes: a measured value.
const SOLUTION_SECONDS: f64 = 1.2e-9;

/// Quantities that the size and the cost of a table depend on.
#[derive(Clone, Copy)]
pub(super) struct CostBasis {
    /// Period in µm.
    pub period_um: f64,
    /// Number of sides of the relief on which light arrives and leaves, 1 or 2.
    pub sides: u32,
    /// Points (t, b) solved for each cell, for estimates of reflectors and films.
    pub points_per_cell: f64,
    /// Bytes of the entries of a pair of channels at all nodes of one cell at one wavelength.
    pub pair_bytes: f64,
}

impl CostBasis {
    /// Quantities for a table of efficiencies of a grating with this period on a body.
    pub(super) fn of_efficiencies(period_um: f64, body: GratingBody<'_>) -> Self {
        let nodes = if body.is_dielectric() { DIELECTRIC_NODES } else { METAL_NODES };
        // The points with p > q follow from the others by reciprocity.
        let points_per_cell = triangle_count(nodes) as f64;
        let is_perfect = matches!(body, GratingBody::Reflector(None));
        let pair_bytes = if is_perfect { ENTRY_BYTES * (STORED_MAX as f64).powi(2) } else { PAIR_BYTES };
        Self { period_um, sides: body.sides(), points_per_cell, pair_bytes }
    }
}

/// Meshes (sets of mesh nodes) of a profile on a body, for all wavelengths. Checks the cost of the build first.
///
/// # Errors
/// Profiles and indices that the solver refuses, and a build whose estimate exceeds `build_limit` times the limits of
/// [`crate::table`].
pub(super) fn create_meshes(
    profile: &Profile,
    body: GratingBody<'_>,
    basis: CostBasis,
    build_limit: f64,
) -> Result<Meshes, GratingError> {
    // Declared here, so that `index` can refer to it.
    let dielectric;
    let index = match body {
        GratingBody::Reflector(index) => index,
        GratingBody::Film(eta) | GratingBody::Interface(eta) => {
            dielectric = SpectralIndex::Constant(ComplexIndex { eta, k: 0.0 });
            Some(&dielectric)
        }
    };
    let resolution = sufficient_resolution(profile, index)?;
    let cost = match body {
        GratingBody::Interface(eta) => {
            let mesh_nodes = resolution.nodes as f64;
            // Seconds of one point at one wavelength, with the lattice sums of one side. A point of the air needs those
            // of the medium at each wavelength, and a point of the medium those of the air. The sums of its own side
            // serve all wavelengths, and are left out.
            let seconds = LATTICE_SECONDS * mesh_nodes * mesh_nodes + SOLUTION_SECONDS * mesh_nodes.powi(3);
            InterfacePlan::new(basis.period_um, eta).estimate(seconds, basis.pair_bytes)
        }
        GratingBody::Reflector(_) | GratingBody::Film(_) => estimate(basis, resolution.nodes, body),
    };
    cost.check(build_limit, || "a shorter period, or theory \"scalar\", which takes any".to_owned())?;
    Meshes::new(profile, resolution)
}

/// Spacing of the wavelengths of a table; `None` for a perfect conductor, whose efficiencies at given t and b do not
/// depend on the wavelength.
///
/// # Errors
/// A test point that cannot be solved.
pub(super) fn choose_spacing(
    meshes: &Meshes,
    period_um: f64,
    index: Option<&SpectralIndex>,
) -> Result<Option<Spacing>, GratingError> {
    if index.is_none() {
        return Ok(None);
    }
    Ok(Some(spacing_of(&RigorousSolver::new(meshes, index, &[])?, period_um)?))
}

/// Spacing of a table's wavelengths that meets [`WAVELENGTH_TOLERANCE`], by test solutions of the solver.
///
/// # Errors
/// A test point that cannot be solved.
pub(super) fn spacing_of(solver: &impl OrderSolver, period_um: f64) -> Result<Spacing, GratingError> {
    Spacing::choose(period_um, solver, WAVELENGTH_TOLERANCE)
}

/// Numbers of nodes and wavelengths of a table of efficiencies, and the accepted error of its cells.
pub(super) fn choose_resolution(basis: CostBasis, spacing: Option<Spacing>) -> TableResolution {
    let cells = cell_count(basis.period_um);
    let stored = spacing.map_or(STORED_MAX, |spacing| {
        let wavelengths = (WAVELENGTH_MAX_NM - WAVELENGTH_MIN_NM) / spacing.step_nm;
        // The number of nodes at which the table has about BYTES_MAX.
        let fitting = (BYTES_MAX / ENTRY_BYTES / entries(cells, Some(wavelengths))).sqrt() / f64::from(basis.sides);
        (fitting as usize).clamp(STORED, STORED_MAX)
    });
    TableResolution { stored, spacing, tolerance: TERMS_TOLERANCE * (cells / FULL_CELLS).min(1.0) }
}

/// Cost of the build of a reflector's or film's table on two cores, hence the factor ½. The seconds count all
/// cells at every wavelength. More nodes than the fewest are not counted: tables have them only up to a size, such as
/// [`BYTES_MAX`], far below the limits.
pub(super) fn estimate(basis: CostBasis, mesh_nodes: usize, body: GratingBody<'_>) -> Estimate {
    let cells = cell_count(basis.period_um);
    let step_nm = match body {
        // Solved once for both wavelengths of its table.
        GratingBody::Reflector(None) => None,
        _ if body.is_dielectric() => Some(DIELECTRIC_STEP_NM),
        _ => Some(METAL_STEP_NM),
    };
    let wavelengths = step_nm.map(|step_nm| table_wavelengths(basis.period_um, Some(step_nm)).0.len() as f64);
    let mesh_nodes = mesh_nodes as f64;
    let lattice_seconds = LATTICE_SECONDS * mesh_nodes * mesh_nodes;
    // The lattice sums of a metal are tabulated, and a perfect conductor has none.
    let medium_seconds = if body.is_dielectric() { lattice_seconds } else { 0.0 };
    let wavelength_seconds = medium_seconds + SOLUTION_SECONDS * mesh_nodes.powi(3);
    // The wavelengths share the lattice sums of the air.
    let point_seconds = lattice_seconds + wavelengths.unwrap_or(1.0) * wavelength_seconds;
    Estimate {
        bytes: basis.pair_bytes * entries(cells, wavelengths) * f64::from(basis.sides).powi(2),
        seconds: 0.5 * cells * basis.points_per_cell * point_seconds,
    }
}

/// Number of cells at the shortest wavelength, not rounded. The index `s = ⌊t − a⌋ + ⌊t + a⌋` is at most 2t, and t at
/// most d/λ, so s runs from 0 to 2d/λ.
fn cell_count(period_um: f64) -> f64 {
    2e3 * period_um / WAVELENGTH_MIN_NM + 1.0
}

/// Entries at one node (p, q) of each cell, summed over cells and wavelengths, of a table with channels on one side.
/// With two sides there are four times as many.
///
/// Cell s has s + 1 orders and about (s + 1)² entries, so `cells` cells have about `cells³/3`. The number of cells is
/// proportional to 1/λ, and the mean of (360/λ)³ from 360 to 830 nm is about a third. A perfect conductor, `None`, has
/// two wavelengths, both with all cells.
fn entries(cells: f64, wavelengths: Option<f64>) -> f64 {
    cells.powi(3) / 3.0 * wavelengths.map_or(2.0, |wavelengths| (wavelengths / 3.0).max(1.0))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::grating::GratingSurface;
    use crate::table::Progress;

    #[test]
    fn a_perfect_conductors_table_has_the_estimated_size() {
        let (period_um, conductor) = (0.6, GratingBody::Reflector(None));
        let profile = Profile::sinusoid(period_um, 0.1).unwrap();
        let surface = GratingSurface::of_body(&profile, conductor, 20.0, 1.0, &Progress::none()).unwrap();
        let built = surface.report().bytes as f64;
        // The bytes do not depend on the number of mesh nodes.
        let estimated = estimate(CostBasis::of_efficiencies(period_um, conductor), 64, conductor).bytes;
        // The estimate leaves out the sums of rows, which are a quarter of the entries of so few orders.
        assert!((0.5..2.0).contains(&(estimated / built)), "{estimated} of {built}");
    }
}
