//! Orders of a grating by Maxwell's equations, at the coordinates and wavelengths of the tables.

use super::GratingError;
use super::orders::Orders;
use super::polarisation::{Shape, shape};
use crate::scattering::{ComplexIndex, SpectralIndex};
use std::sync::OnceLock;
use sunbeam_rigorous::{Air, Amplitudes, Discretisation, Medium, MetalTable, Profile, Resolution, check_size};

/// Accepted imbalance of power at a node, times the largest cosine of incidence of waves with its `t`. A tenth of the
/// table's error.
const BALANCE: f64 = 1e-3;
/// A metal's table covers ky²/k² from this value, negated, upwards.
const CONTINUED: f64 = 0.35;
/// Multiples of the profile's nodes that are tried while power is not balanced.
const FINER: [usize; 3] = [2, 4, 8];

/// Wavelengths in nm at which the number of nodes is estimated.
const RESOLVED_NM: [f64; 6] = [360.0, 420.0, 500.0, 590.0, 700.0, 830.0];

/// Resolution of a profile above a medium of this index that serves all wavelengths of a table.
///
/// # Errors
/// An index that the solver refuses, and a relief too large for it at one of the wavelengths.
pub(super) fn resolution(profile: &Profile, index: Option<&SpectralIndex>) -> Result<Resolution, GratingError> {
    let mut resolution = Resolution { nodes: 0, oversampling: 1 };
    for nm in RESOLVED_NM {
        let medium = medium(index, nm)?;
        check_size(profile, &medium, nm, 0.0)?;
        let needed = Resolution::new(profile, &medium, nm)?;
        resolution.nodes = resolution.nodes.max(needed.nodes);
        resolution.oversampling = resolution.oversampling.max(needed.oversampling);
    }
    Ok(resolution)
}

/// A profile discretised at its resolution, and more finely on demand.
pub(super) struct Meshes {
    profile: Profile,
    resolution: Resolution,
    first: Discretisation,
    finer: [OnceLock<Discretisation>; FINER.len()],
}

impl Meshes {
    /// Discretises a profile.
    ///
    /// # Errors
    /// More nodes than the solver accepts.
    pub(super) fn new(profile: &Profile, resolution: Resolution) -> Result<Self, GratingError> {
        let first = Discretisation::new(profile, resolution)?;
        Ok(Self { profile: profile.clone(), resolution, first, finer: [const { OnceLock::new() }; FINER.len()] })
    }

    /// The discretisation with a multiple of [`FINER`].
    fn finer(&self, step: usize) -> Result<&Discretisation, GratingError> {
        if let Some(made) = self.finer[step].get() {
            return Ok(made);
        }
        let nodes = FINER[step] * self.resolution.nodes;
        let made = Discretisation::new(&self.profile, Resolution { nodes, ..self.resolution })?;
        Ok(self.finer[step].get_or_init(|| made))
    }
}

/// The solver for a table: a discretised profile, with a metal's response tabulated at every wavelength.
pub(super) struct Solved<'a> {
    meshes: &'a Meshes,
    index: Option<&'a SpectralIndex>,
    tables: Vec<(f64, MetalTable<'a>)>,
}

impl<'a> Solved<'a> {
    /// Prepares a profile in air above a medium of this index, or above a perfect conductor (`None`). A metal's
    /// response is tabulated at the given wavelengths in nm.
    pub(super) fn new(
        meshes: &'a Meshes,
        index: Option<&'a SpectralIndex>,
        wavelengths_nm: &[f64],
    ) -> Result<Self, GratingError> {
        use rayon::prelude::*;
        let tables = wavelengths_nm
            .par_iter()
            .map(|&nm| Ok(MetalTable::new(&meshes.first, &medium(index, nm)?, nm)?.map(|table| (nm, table))))
            .collect::<Result<Vec<_>, GratingError>>()?;
        Ok(Self { meshes, index, tables: tables.into_iter().flatten().collect() })
    }

    fn solve(&self, air: &Air, nm: f64) -> Result<Amplitudes, GratingError> {
        let covered = self.ky_squared(air.t(), nm) > -CONTINUED;
        let table = self.tables.iter().find(|(at, _)| *at == nm && covered);
        Ok(match table {
            Some((_, table)) => air.solve_tabulated(table)?,
            None => air.solve(&medium(self.index, nm)?, nm)?,
        })
    }

    /// Solves with more nodes until power is balanced.
    fn solve_finer(&self, t: f64, b: f64, nm: f64) -> Result<Amplitudes, GratingError> {
        let (mut nodes, mut balance) = (0, f64::INFINITY);
        for step in 0..FINER.len() {
            let mesh = self.meshes.finer(step)?;
            let amplitudes = mesh.air(t, b)?.solve(&medium(self.index, nm)?, nm)?;
            (nodes, balance) = (mesh.nodes(), self.imbalance(&amplitudes, t, nm));
            if balance <= BALANCE {
                return Ok(amplitudes);
            }
        }
        Err(GratingError::Unbalanced { t, b, wavelength_nm: nm, nodes, balance })
    }

    /// `quantity(amplitudes, ky²/k²)` at each wavelength in nm.
    fn each_wavelength<T: Clone>(
        &self,
        t: f64,
        b: f64,
        wavelengths_nm: &[f64],
        quantity: impl Fn(&Amplitudes, f64) -> Vec<T>,
    ) -> Result<Vec<Vec<T>>, GratingError> {
        let air = self.meshes.first.air(t, b)?;
        // A perfect conductor's efficiencies do not depend on the wavelength at given t and b.
        let distinct = if self.index.is_some() { wavelengths_nm } else { &wavelengths_nm[..1] };
        let mut matrices = Vec::with_capacity(wavelengths_nm.len());
        for &nm in distinct {
            let mut amplitudes = self.solve(&air, nm)?;
            let ky_squared = self.ky_squared(t, nm);
            // With imaginary ky there is no power balance.
            if ky_squared >= 0.0 && self.imbalance(&amplitudes, t, nm) > BALANCE {
                amplitudes = self.solve_finer(t, b, nm)?;
            }
            matrices.push(quantity(&amplitudes, ky_squared));
        }
        matrices.resize(wavelengths_nm.len(), matrices.last().cloned().unwrap_or_default());
        Ok(matrices)
    }

    /// Normalised Jones matrices between all orders, arranged as in [`Orders::efficiencies`].
    ///
    /// # Errors
    /// As [`Orders::efficiencies`].
    pub(super) fn shapes(&self, t: f64, b: f64, wavelengths_nm: &[f64]) -> Result<Vec<Vec<Shape>>, GratingError> {
        self.each_wavelength(t, b, wavelengths_nm, |amplitudes, ky_squared| {
            let orders = amplitudes.orders();
            let pairs = orders.iter().flat_map(|&from| orders.iter().map(move |&out| (out, from)));
            pairs.map(|(out, from)| shape(amplitudes.jones(out, from), ky_squared)).collect()
        })
    }

    /// The quantity that [`BALANCE`] bounds.
    fn imbalance(&self, amplitudes: &Amplitudes, t: f64, nm: f64) -> f64 {
        amplitudes.balance_error() * (t / self.periods(nm)).min(1.0)
    }

    /// Period over wavelength, d/λ.
    fn periods(&self, nm: f64) -> f64 {
        1e3 * self.meshes.profile.period_um() / nm
    }

    /// `ky²/k²` of a wave of this `t` at a wavelength in nm.
    fn ky_squared(&self, t: f64, nm: f64) -> f64 {
        let transverse = t / self.periods(nm);
        (1.0 - transverse) * (1.0 + transverse)
    }
}

impl Orders for Solved<'_> {
    fn efficiencies(&self, t: f64, b: f64, wavelengths_nm: &[f64]) -> Result<Vec<Vec<f64>>, GratingError> {
        self.each_wavelength(t, b, wavelengths_nm, |amplitudes, ky_squared| efficiencies(amplitudes, ky_squared >= 0.0))
    }
}

/// The medium below the relief at a wavelength in nm.
pub(super) fn medium(index: Option<&SpectralIndex>, nm: f64) -> Result<Medium, GratingError> {
    let Some(index) = index else { return Ok(Medium::Perfect) };
    let ComplexIndex { eta, k } = index.at(nm);
    Ok(Medium::index(eta, k)?)
}

/// Efficiencies `[incident · orders + outgoing]`. Amplitudes between the two polarisation states are proportional to
/// ky, so their squares are negative for imaginary ky (`!real`).
fn efficiencies(amplitudes: &Amplitudes, real: bool) -> Vec<f64> {
    let sign = if real { 1.0 } else { -1.0 };
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
