//! Plan of a grating's tables: their numbers of nodes and wavelengths, and the cost of their build (symbols: `mod.rs`).
//!
//! A table has nodes (p, q) over each of its *cells*, the regions of incident waves at which the same orders propagate.
//! The solver solves *points* (t, b) of a cell: all waves of one Bloch phase b and one bound t of wave numbers along x.

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

/// Most nodes of a table along either side of a cell; more would enlarge the table. A perfect conductor's table, whose
/// efficiencies do not depend on the wavelength, has this number.
const STORED_MAX: usize = 32;
/// Size in bytes up to which a table has more than [`STORED`] nodes along either side of a cell. A larger table would
/// not fit into a processor's cache.
const BYTES_MAX: f64 = 4e6;
/// Bytes of a stored efficiency.
const ENTRY_BYTES: f64 = 2.0;
/// Accepted RMS of an efficiency's highest Chebyshev terms, in a table of [`FULL_CELLS`] cells or more. Larger values
/// leave a larger error, smaller ones need more solved points. Fewer cells have a stricter tolerance, in proportion to
/// their number, since fewer orders share the light.
const TERMS_TOLERANCE: f64 = 6e-3;
/// Number of cells from which [`TERMS_TOLERANCE`] applies unscaled: that of a period of 2.3 µm.
const FULL_CELLS: f64 = 14.0;
/// Accepted RMS error of an efficiency halfway between two wavelengths: a quarter of [`TERMS_TOLERANCE`], so that it
/// adds little.
const WAVELENGTH_TOLERANCE: f64 = 0.25 * TERMS_TOLERANCE;

// The following times serve estimates of a build alone. A slower machine takes longer than estimated.

/// Seconds on one core for the lattice sums of a medium at one point and wavelength, over the squared number of nodes
/// on the profile. Measured: 1e-6 for air, 6e-7 where no order propagates in it, and 1.5e-6 for dielectrics.
const LATTICE_SECONDS: f64 = 1e-6;
/// Seconds on one core for the solution at one point and wavelength, over the cubed number of nodes on the profile;
/// measured.
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
    /// Bytes of the values that the table has for a pair of channels in one cell at one wavelength, for estimates of
    /// interfaces.
    pub pair_bytes: f64,
}

impl CostBasis {
    /// Quantities of a table of efficiencies of a grating with this period on a body.
    pub(super) fn of_efficiencies(period_um: f64, body: GratingBody<'_>) -> Self {
        // Number of nodes along a side at which most cells are solved: 8 or 17. Efficiencies of dielectrics vary
        // smoothly, without the anomalies of metals, so the fewest suffice.
        let nodes = if body.is_dielectric() { NODE_COUNTS[0] } else { NODE_COUNTS[2] };
        let points_per_cell = triangle_count(nodes) as f64;
        Self { period_um, sides: body.sides(), points_per_cell, pair_bytes: PAIR_BYTES }
    }
}

/// Meshes of a profile on a body (sets of nodes at which fields are solved), for all wavelengths. Checks the cost of
/// the build first.
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
            let nodes = resolution.nodes as f64;
            // Each wavelength has lattice sums of the medium in cells of the air, and those of the air in cells of the
            // medium.
            let seconds = LATTICE_SECONDS * nodes * nodes + SOLUTION_SECONDS * nodes.powi(3);
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

/// Spacing of the wavelengths of a solver's table, which meets [`WAVELENGTH_TOLERANCE`].
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
        // The number of entries is proportional to the squares of the nodes along a side and of the number of sides.
        let fitting = (BYTES_MAX / ENTRY_BYTES / entries(cells, wavelengths)).sqrt() / f64::from(basis.sides);
        (fitting as usize).clamp(STORED, STORED_MAX)
    });
    TableResolution { stored, spacing, tolerance: TERMS_TOLERANCE * (cells / FULL_CELLS).min(1.0) }
}

/// Cost of the build of a reflector's or film's table on two cores, hence the factor ½. `nodes` is the number of nodes
/// on the profile. Steps between wavelengths are those that films (80 nm) and metals (20 nm) commonly have.
fn estimate(basis: CostBasis, nodes: usize, body: GratingBody<'_>) -> Estimate {
    let cells = cell_count(basis.period_um);
    let is_perfect = matches!(body, GratingBody::Reflector(None));
    // A metal's lattice sums are tabulated.
    let (step_nm, lattice) = if body.is_dielectric() { (STEPS_NM[0], LATTICE_SECONDS) } else { (STEPS_NM[2], 0.0) };
    let (wavelengths_nm, _) = table_wavelengths(basis.period_um, Some(step_nm));
    let (wavelengths, nodes_per_side) =
        if is_perfect { (1.0, STORED_MAX) } else { (wavelengths_nm.len() as f64, STORED) };
    let nodes = nodes as f64;
    let solution_seconds = lattice * nodes * nodes + SOLUTION_SECONDS * nodes.powi(3);
    let point_seconds = LATTICE_SECONDS * nodes * nodes + wavelengths * solution_seconds;
    let table_nodes = (nodes_per_side as f64).powi(2);
    Estimate {
        bytes: ENTRY_BYTES * table_nodes * entries(cells, wavelengths) * f64::from(basis.sides).powi(2),
        seconds: 0.5 * cells * basis.points_per_cell * point_seconds,
    }
}

/// Number of cells at the shortest wavelength, not rounded: indices s are at most `2t ≤ 2d/λ`.
fn cell_count(period_um: f64) -> f64 {
    2e3 * period_um / WAVELENGTH_MIN_NM + 1.0
}

/// Entries of one side of a table for each node (p, q), summed over cells and wavelengths. Cell s has about (s + 1)² of
/// them, and `cells` cells have `cells³/3`. Longer wavelengths have fewer cells, and on average a third of the entries
/// of the shortest. A perfect conductor counts as one wavelength with all cells.
fn entries(cells: f64, wavelengths: f64) -> f64 {
    cells.powi(3) / 3.0 * (wavelengths / 3.0).max(1.0)
}
