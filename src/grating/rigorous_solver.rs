//! The solver behind the tables of reflectors: an [`OrderSolver`] that calls `sunbeam-rigorous` (symbols: `mod.rs`).
//! Its meshes also serve the solvers of films and interfaces.
//!
//! Wave numbers are along x, in units of 2π over the period d. Those of all orders differ by whole numbers. At a point
//! (t, b), the Bloch phase b is one of them, and t bounds the magnitude of those that propagate. The ratio ky/k is the
//! component of a wave vector along the grooves over its length. At wavelengths above d/t ky is imaginary. The solution
//! there is the analytic continuation that interpolation between wavelengths needs (`order_solver.rs`); it does not
//! conserve power.
//!
//! A *mesh* is a set of nodes on the profile at which fields are solved. The *power balance* of a solution is the
//! condition that the incident power equals the reflected power and, in a medium that absorbs, the absorbed power.

use super::GratingError;
use super::jones_shape::{JonesShape, jones_shape};
use super::order_solver::{OrderSolver, ShapeSolver};
use crate::scattering::{ComplexIndex, SpectralIndex};
use crate::table::{WAVELENGTH_MAX_NM, WAVELENGTH_MIN_NM};
use rayon::prelude::*;
use std::sync::OnceLock;
use sunbeam_rigorous::{
    Air, Amplitudes, Discretisation, KY_SQUARED_RANGE, Medium, MetalTable, Profile, Resolution, check_size,
};

/// Largest accepted error of the power balance at a solved point: the power missing as a fraction of the incident
/// power, times the largest cosine of incidence at its `t`.
///
/// Chosen as about a tenth of the error of an order in the tables; smaller values need larger meshes. The factor allows
/// a larger fraction where the cosine is small, near grazing incidence along the grooves: such light carries little of
/// the power that falls on a surface.
pub(super) const IMBALANCE_MAX: f64 = 1e-3;
/// Largest number of doublings of the nodes; they are doubled until the power balance holds. The cost of a solution
/// grows as the cube of the number of nodes.
pub(super) const DOUBLINGS: usize = 3;

/// Wavelengths in nm for which the number of nodes is determined. Refractive indices change little within a step, which
/// is about a sixth of the wavelength.
const RESOLVED_NM: [f64; 6] = [WAVELENGTH_MIN_NM, 420.0, 500.0, 590.0, 700.0, WAVELENGTH_MAX_NM];

/// Resolution that suffices for all wavelengths of a table, for a profile above a medium of this index by wavelength,
/// or above a perfect conductor (`None`).
///
/// # Errors
/// An index that the solver refuses, and a relief that is too large for it at one of the wavelengths.
pub(super) fn sufficient_resolution(
    profile: &Profile,
    index: Option<&SpectralIndex>,
) -> Result<Resolution, GratingError> {
    // The smallest values, which every wavelength may raise.
    let mut resolution = Resolution { nodes: 0, oversampling: 1 };
    for nm in RESOLVED_NM {
        let medium = medium_at(index, nm)?;
        // The last argument is ky/k. 0 gives the largest wave numbers across the grooves, and so covers every
        // direction.
        check_size(profile, &medium, nm, 0.0)?;
        let required = Resolution::new(profile, &medium, nm)?;
        resolution.nodes = resolution.nodes.max(required.nodes);
        resolution.oversampling = resolution.oversampling.max(required.oversampling);
    }
    Ok(resolution)
}

/// Discretisations of a profile: one with the nodes of a given resolution, and finer ones, created when first needed.
pub(super) struct Meshes {
    profile: Profile,
    resolution: Resolution,
    first: Discretisation,
    /// Meshes after 1 to [`DOUBLINGS`] doublings of the number of nodes.
    finer: [OnceLock<Discretisation>; DOUBLINGS],
}

impl Meshes {
    /// Period d in µm.
    pub(super) fn period_um(&self) -> f64 {
        self.profile.period_um()
    }

    /// The meshes of a profile, from the resolution that [`sufficient_resolution`] returns.
    ///
    /// # Errors
    /// More nodes than the solver accepts.
    pub(super) fn new(profile: &Profile, resolution: Resolution) -> Result<Self, GratingError> {
        let first = Discretisation::new(profile, resolution)?;
        Ok(Self { profile: profile.clone(), resolution, first, finer: [const { OnceLock::new() }; DOUBLINGS] })
    }

    /// The mesh after a number of doublings of the nodes. Two threads that need it first may both create it.
    ///
    /// # Errors
    /// More nodes than the solver accepts.
    ///
    /// # Panics
    /// For more than [`DOUBLINGS`].
    pub(super) fn after(&self, doublings: usize) -> Result<&Discretisation, GratingError> {
        let Some(slot) = doublings.checked_sub(1).map(|i| &self.finer[i]) else { return Ok(&self.first) };
        if let Some(mesh) = slot.get() {
            return Ok(mesh);
        }
        let nodes = self.resolution.nodes << doublings;
        let mesh = Discretisation::new(&self.profile, Resolution { nodes, ..self.resolution })?;
        Ok(slot.get_or_init(|| mesh))
    }
}

/// The solver of a profile above a medium. Where the medium is a metal, a table replaces the integrals over its side of
/// the profile.
pub(super) struct RigorousSolver<'a> {
    meshes: &'a Meshes,
    /// Index of the medium by wavelength; `None` for a perfect conductor.
    index: Option<&'a SpectralIndex>,
    /// Wavelengths in nm, and the tabulated response of the metal there; empty for other media.
    tables: Vec<(f64, MetalTable<'a>)>,
}

impl<'a> RigorousSolver<'a> {
    /// A profile in air above a medium of this index by wavelength, or above a perfect conductor (`None`). A metal's
    /// response on the first mesh is tabulated at `wavelengths_nm`, over ky² and the Bloch phase. Other wavelengths and
    /// other media are solved without tables.
    ///
    /// # Errors
    /// An index that the solver refuses, and special functions that overflow.
    pub(super) fn new(
        meshes: &'a Meshes,
        index: Option<&'a SpectralIndex>,
        wavelengths_nm: &[f64],
    ) -> Result<Self, GratingError> {
        let tables = wavelengths_nm
            .par_iter()
            .map(|&nm| {
                // `None` if the medium is no metal.
                let table = MetalTable::new(&meshes.first, &medium_at(index, nm)?, nm)?;
                Ok(table.map(|table| (nm, table)))
            })
            .collect::<Result<Vec<_>, GratingError>>()?;
        Ok(Self { meshes, index, tables: tables.into_iter().flatten().collect() })
    }

    /// Amplitudes between all orders on the first mesh, at a wavelength in nm.
    ///
    /// # Errors
    /// An index that the solver refuses, and solutions that are not finite.
    fn solve(&self, air: &Air, nm: f64) -> Result<Amplitudes, GratingError> {
        // Tables of metals reach down to this negative ky²/k². Waves of a larger imaginary ky are solved without.
        let is_covered = self.ky_squared_ratio(air.t(), nm) > KY_SQUARED_RANGE[0];
        let table = self.tables.iter().find(|(table_nm, _)| *table_nm == nm && is_covered);
        Ok(match table {
            Some((_, table)) => air.solve_tabulated(table)?,
            None => air.solve(&medium_at(self.index, nm)?, nm)?,
        })
    }

    /// Amplitudes between all orders at (t, b) and a wavelength in nm, on the first finer mesh whose power balance
    /// holds.
    ///
    /// # Errors
    /// [`GratingError::Unbalanced`] where no mesh suffices.
    fn solve_finer(&self, t: f64, b: f64, nm: f64) -> Result<Amplitudes, GratingError> {
        // Values of the last attempt, for the error.
        let (mut nodes, mut imbalance) = (0, f64::INFINITY);
        for doublings in 1..=DOUBLINGS {
            let mesh = self.meshes.after(doublings)?;
            let amplitudes = mesh.air(t, b)?.solve(&medium_at(self.index, nm)?, nm)?;
            (nodes, imbalance) = (mesh.nodes(), self.imbalance(&amplitudes, t, nm));
            if imbalance <= IMBALANCE_MAX {
                return Ok(amplitudes);
            }
        }
        Err(GratingError::Unbalanced { t, b, wavelength_nm: nm, nodes, balance: imbalance })
    }

    /// Solves the orders at (t, b) at each wavelength in nm, of which there is at least one. Returns
    /// `extract(amplitudes, ky²/k²)` for each.
    ///
    /// # Errors
    /// A point that cannot be solved accurately enough.
    fn at_wavelengths<T: Clone>(
        &self,
        t: f64,
        b: f64,
        wavelengths_nm: &[f64],
        extract: impl Fn(&Amplitudes, f64) -> Vec<T>,
    ) -> Result<Vec<Vec<T>>, GratingError> {
        let air = self.meshes.first.air(t, b)?;
        // At given t and b, a perfect conductor's orders do not depend on the wavelength, so one wavelength is solved:
        // the longest with a real ky, at which `imbalance` is strictest.
        let are_real = wavelengths_nm.iter().copied().filter(|&nm| self.ky_squared_ratio(t, nm) >= 0.0);
        let one_nm = [are_real.reduce(f64::max).unwrap_or(wavelengths_nm[0])];
        let solved_nm = if self.index.is_some() { wavelengths_nm } else { &one_nm };
        let mut extracted = Vec::with_capacity(wavelengths_nm.len());
        for &nm in solved_nm {
            let mut amplitudes = self.solve(&air, nm)?;
            let ky_squared_ratio = self.ky_squared_ratio(t, nm);
            // Power is not conserved in the continuation to imaginary ky, so its balance is not checked.
            if ky_squared_ratio >= 0.0 && self.imbalance(&amplitudes, t, nm) > IMBALANCE_MAX {
                amplitudes = self.solve_finer(t, b, nm)?;
            }
            extracted.push(extract(&amplitudes, ky_squared_ratio));
        }
        // A perfect conductor has the same values at all wavelengths: its orders do not convert Ey to Hy, and so do not
        // depend on ky.
        extracted.resize(wavelengths_nm.len(), extracted.last().cloned().unwrap_or_default());
        Ok(extracted)
    }

    /// Error of the power balance times the largest cosine of incidence at `t`, accepted up to [`IMBALANCE_MAX`].
    fn imbalance(&self, amplitudes: &Amplitudes, t: f64, nm: f64) -> f64 {
        amplitudes.balance_error() * self.largest_cosine(t, nm).min(1.0)
    }

    /// Largest cosine of incidence at `t` and a wavelength in nm, that of light with kx = 0: `tλ/d = √(1 − ky²/k²)`.
    /// Exceeds 1 for imaginary ky.
    fn largest_cosine(&self, t: f64, nm: f64) -> f64 {
        t / (1e3 * self.meshes.profile.period_um() / nm)
    }

    /// `ky²/k² = 1 − (tλ/d)²`; negative where ky is imaginary.
    fn ky_squared_ratio(&self, t: f64, nm: f64) -> f64 {
        let cosine = self.largest_cosine(t, nm);
        (1.0 - cosine) * (1.0 + cosine)
    }
}

impl OrderSolver for RigorousSolver<'_> {
    fn efficiencies(&self, t: f64, b: f64, wavelengths_nm: &[f64]) -> Result<Vec<Vec<f64>>, GratingError> {
        self.at_wavelengths(t, b, wavelengths_nm, |amplitudes, ky_squared_ratio| {
            efficiencies(amplitudes, ky_squared_ratio >= 0.0)
        })
    }
}

impl ShapeSolver for RigorousSolver<'_> {
    fn shapes(&self, t: f64, b: f64, wavelengths_nm: &[f64]) -> Result<Vec<Vec<JonesShape>>, GratingError> {
        self.at_wavelengths(t, b, wavelengths_nm, |amplitudes, ky_squared_ratio| {
            let orders = amplitudes.orders();
            let pairs = orders.iter().flat_map(|&incident| orders.iter().map(move |&outgoing| (outgoing, incident)));
            pairs
                .map(|(outgoing, incident)| jones_shape(amplitudes.jones(outgoing, incident), ky_squared_ratio))
                .collect()
        })
    }
}

/// The medium below the relief at a wavelength in nm: of this index, or a perfect conductor (`None`).
///
/// # Errors
/// An index that the solver refuses.
pub(super) fn medium_at(index: Option<&SpectralIndex>, nm: f64) -> Result<Medium, GratingError> {
    let Some(index) = index else { return Ok(Medium::Perfect) };
    let ComplexIndex { eta, k } = index.at(nm);
    Ok(Medium::index(eta, k)?)
}

/// Unpolarised efficiencies between all orders, `[incident · orders + outgoing]`.
///
/// Amplitudes from Ey to Hy and back are proportional to ky. The continuation of their squared magnitudes
/// to imaginary ky (`is_ky_real` false), where ky² is negative, is therefore negative.
fn efficiencies(amplitudes: &Amplitudes, is_ky_real: bool) -> Vec<f64> {
    let sign = if is_ky_real { 1.0 } else { -1.0 };
    let orders = amplitudes.orders();
    orders
        .iter()
        .flat_map(|&incident| {
            orders.iter().map(move |&outgoing| {
                let [[ee, eh], [he, hh]] = amplitudes.jones(outgoing, incident).map(|row| row.map(|a| a.norm_sqr()));
                0.5 * (ee + hh + sign * (eh + he))
            })
        })
        .collect()
}
