//! [`OrderSolver`] by `sunbeam-rigorous` (symbols: `mod.rs`).

use super::GratingError;
use super::jones_shape::{JonesShape, jones_shape};
use super::order_solver::OrderSolver;
use crate::scattering::{ComplexIndex, SpectralIndex};
use crate::table::{WAVELENGTH_MAX_NM, WAVELENGTH_MIN_NM};
use rayon::prelude::*;
use std::sync::OnceLock;
use sunbeam_rigorous::{
    Air, Amplitudes, Discretisation, KY_SQUARED_RANGE, Medium, MetalTable, Profile, Resolution, check_size,
};

/// Largest error of the power balance at a solved point, relative to the incident power, times the largest cosine of
/// incidence at its `t`: light along the grooves is a small fraction of what falls on the surface. Chosen: a tenth of
/// the error of an order that tables have.
pub(super) const BALANCE: f64 = 1e-3;
/// Doublings of the number of nodes until the power balance holds.
pub(super) const DOUBLINGS: usize = 3;

/// Wavelengths in nm for which the number of nodes is determined. Chosen: steps of about a sixth, within which indices
/// change little.
const RESOLVED_NM: [f64; 6] = [WAVELENGTH_MIN_NM, 420.0, 500.0, 590.0, 700.0, WAVELENGTH_MAX_NM];

/// Resolution of a profile above a medium of this index that suffices for all wavelengths of a table.
///
/// # Errors
/// An index that the solver refuses, and a relief that is too large for it at one of the wavelengths.
pub(super) fn resolution(profile: &Profile, index: Option<&SpectralIndex>) -> Result<Resolution, GratingError> {
    let mut resolution = Resolution { nodes: 0, oversampling: 1 };
    for nm in RESOLVED_NM {
        let medium = medium(index, nm)?;
        check_size(profile, &medium, nm, 0.0)?;
        let required = Resolution::new(profile, &medium, nm)?;
        resolution.nodes = resolution.nodes.max(required.nodes);
        resolution.oversampling = resolution.oversampling.max(required.oversampling);
    }
    Ok(resolution)
}

/// A profile with nodes at its resolution, and with finer ones made when first needed.
pub(super) struct Meshes {
    profile: Profile,
    resolution: Resolution,
    first: Discretisation,
    finer: [OnceLock<Discretisation>; DOUBLINGS],
}

impl Meshes {
    /// Discretises a profile at a resolution, that of [`resolution`].
    ///
    /// # Errors
    /// More nodes than the solver accepts.
    pub(super) fn new(profile: &Profile, resolution: Resolution) -> Result<Self, GratingError> {
        let first = Discretisation::new(profile, resolution)?;
        Ok(Self { profile: profile.clone(), resolution, first, finer: [const { OnceLock::new() }; DOUBLINGS] })
    }

    /// The mesh after `doublings` ≥ 1 doublings of the number of nodes.
    fn finer(&self, doublings: usize) -> Result<&Discretisation, GratingError> {
        let slot = &self.finer[doublings - 1];
        if let Some(mesh) = slot.get() {
            return Ok(mesh);
        }
        let nodes = self.resolution.nodes << doublings;
        let mesh = Discretisation::new(&self.profile, Resolution { nodes, ..self.resolution })?;
        Ok(slot.get_or_init(|| mesh))
    }
}

/// A profile above a medium, with the medium's tabulated response where it is a metal.
pub(super) struct Solved<'a> {
    meshes: &'a Meshes,
    index: Option<&'a SpectralIndex>,
    /// Responses by wavelength in nm.
    tables: Vec<(f64, MetalTable<'a>)>,
}

impl<'a> Solved<'a> {
    /// A profile in air above a medium of this index, `None` for a perfect conductor. A metal's response is tabulated
    /// at `wavelengths_nm`; other wavelengths are solved without tables.
    pub(super) fn new(
        meshes: &'a Meshes,
        index: Option<&'a SpectralIndex>,
        wavelengths_nm: &[f64],
    ) -> Result<Self, GratingError> {
        let tables = wavelengths_nm
            .par_iter()
            .map(|&nm| Ok(MetalTable::new(&meshes.first, &medium(index, nm)?, nm)?.map(|table| (nm, table))))
            .collect::<Result<Vec<_>, GratingError>>()?;
        Ok(Self { meshes, index, tables: tables.into_iter().flatten().collect() })
    }

    /// Amplitudes of all orders on the first mesh.
    fn solve(&self, air: &Air, nm: f64) -> Result<Amplitudes, GratingError> {
        let is_covered = self.ky_squared_ratio(air.t(), nm) > KY_SQUARED_RANGE[0];
        let table = self.tables.iter().find(|(table_nm, _)| *table_nm == nm && is_covered);
        Ok(match table {
            Some((_, table)) => air.solve_tabulated(table)?,
            None => air.solve(&medium(self.index, nm)?, nm)?,
        })
    }

    /// Amplitudes on the first finer mesh whose power balance holds.
    fn solve_finer(&self, t: f64, b: f64, nm: f64) -> Result<Amplitudes, GratingError> {
        let (mut nodes, mut balance) = (0, f64::INFINITY);
        for doublings in 1..=DOUBLINGS {
            let mesh = self.meshes.finer(doublings)?;
            let amplitudes = mesh.air(t, b)?.solve(&medium(self.index, nm)?, nm)?;
            (nodes, balance) = (mesh.nodes(), self.imbalance(&amplitudes, t, nm));
            if balance <= BALANCE {
                return Ok(amplitudes);
            }
        }
        Err(GratingError::Unbalanced { t, b, wavelength_nm: nm, nodes, balance })
    }

    /// `extract(amplitudes, ky²/k²)` at each wavelength in nm, for the orders at (t, b).
    fn at_wavelengths<T: Clone>(
        &self,
        t: f64,
        b: f64,
        wavelengths_nm: &[f64],
        extract: impl Fn(&Amplitudes, f64) -> Vec<T>,
    ) -> Result<Vec<Vec<T>>, GratingError> {
        let air = self.meshes.first.air(t, b)?;
        // At given t and b, a perfect conductor's orders do not depend on the wavelength.
        let distinct = if self.index.is_some() { wavelengths_nm } else { &wavelengths_nm[..1] };
        let mut matrices = Vec::with_capacity(wavelengths_nm.len());
        for &nm in distinct {
            let mut amplitudes = self.solve(&air, nm)?;
            let ky_squared_ratio = self.ky_squared_ratio(t, nm);
            // Power is not conserved in the continuation to imaginary ky.
            if ky_squared_ratio >= 0.0 && self.imbalance(&amplitudes, t, nm) > BALANCE {
                amplitudes = self.solve_finer(t, b, nm)?;
            }
            matrices.push(extract(&amplitudes, ky_squared_ratio));
        }
        matrices.resize(wavelengths_nm.len(), matrices.last().cloned().unwrap_or_default());
        Ok(matrices)
    }

    /// Shapes of the orders' Jones matrices, arranged as [`OrderSolver::efficiencies`].
    ///
    /// # Errors
    /// A point that cannot be solved accurately enough.
    pub(super) fn shapes(&self, t: f64, b: f64, wavelengths_nm: &[f64]) -> Result<Vec<Vec<JonesShape>>, GratingError> {
        self.at_wavelengths(t, b, wavelengths_nm, |amplitudes, ky_squared_ratio| {
            let orders = amplitudes.orders();
            let pairs = orders.iter().flat_map(|&incident| orders.iter().map(move |&outgoing| (outgoing, incident)));
            pairs
                .map(|(outgoing, incident)| jones_shape(amplitudes.jones(outgoing, incident), ky_squared_ratio))
                .collect()
        })
    }

    /// Error of the power balance times the largest cosine of incidence: the quantity that [`BALANCE`] bounds.
    fn imbalance(&self, amplitudes: &Amplitudes, t: f64, nm: f64) -> f64 {
        amplitudes.balance_error() * (t / self.periods(nm)).min(1.0)
    }

    /// `d/λ`.
    fn periods(&self, nm: f64) -> f64 {
        1e3 * self.meshes.profile.period_um() / nm
    }

    /// `ky²/k² = 1 − (tλ/d)²`.
    fn ky_squared_ratio(&self, t: f64, nm: f64) -> f64 {
        let cosine = t / self.periods(nm);
        (1.0 - cosine) * (1.0 + cosine)
    }
}

impl OrderSolver for Solved<'_> {
    fn efficiencies(&self, t: f64, b: f64, wavelengths_nm: &[f64]) -> Result<Vec<Vec<f64>>, GratingError> {
        self.at_wavelengths(t, b, wavelengths_nm, |amplitudes, ky_squared_ratio| {
            efficiencies(amplitudes, ky_squared_ratio >= 0.0)
        })
    }
}

/// The medium below the relief at a wavelength in nm.
pub(super) fn medium(index: Option<&SpectralIndex>, nm: f64) -> Result<Medium, GratingError> {
    let Some(index) = index else { return Ok(Medium::Perfect) };
    let ComplexIndex { eta, k } = index.at(nm);
    Ok(Medium::index(eta, k)?)
}

/// Unpolarised efficiencies of all pairs of orders, `[incident · orders + outgoing]`. Amplitudes between the two states
/// are proportional to ky, so for imaginary ky (`is_real` false) their squares count negative.
fn efficiencies(amplitudes: &Amplitudes, is_real: bool) -> Vec<f64> {
    let sign = if is_real { 1.0 } else { -1.0 };
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
