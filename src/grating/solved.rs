//! A grating's orders by Maxwell's equations, as a table asks for them.

use super::GratingError;
use super::build::Orders;
use super::polarisation::{Shape, shape};
use crate::scattering::{ComplexIndex, SpectralIndex};
use std::sync::OnceLock;
use sunbeam_rigorous::{Air, Amplitudes, Discretisation, Medium, MetalTable, Profile, Resolution, check_size};

/// What power may be off at a node, times the largest cosine of incidence that waves of its `t` have: along the grooves a
/// share of the light is a small share of what falls on the surface. A tenth of what an order of a table may be off.
const BALANCE: f64 = 1e-3;
/// Largest share of ky² over k², below zero, that a metal's table covers.
const CONTINUED: f64 = 0.35;
/// Times as many nodes as at first that are tried where they do not do.
const FINER: [usize; 3] = [2, 4, 8];

/// Wavelengths in nm at which it is asked how many nodes a medium takes.
const RESOLVED_NM: [f64; 6] = [360.0, 420.0, 500.0, 590.0, 700.0, 830.0];

/// How finely a profile above a medium of this index is resolved for all wavelengths of a table.
///
/// # Errors
/// An index that the solver refuses, and a relief that is too large for it at one of these wavelengths.
pub(super) fn resolution(profile: &Profile, index: Option<&SpectralIndex>) -> Result<Resolution, GratingError> {
    let mut resolution = Resolution { nodes: 0, oversampling: 1 };
    for nm in RESOLVED_NM {
        let medium = medium(index, nm)?;
        check_size(profile, &medium, nm, 0.0)?;
        let asked = Resolution::new(profile, &medium, nm)?;
        resolution.nodes = resolution.nodes.max(asked.nodes);
        resolution.oversampling = resolution.oversampling.max(asked.oversampling);
    }
    Ok(resolution)
}

/// A profile with its nodes, and with more of them once they are needed.
pub(super) struct Meshes {
    profile: Profile,
    resolution: Resolution,
    first: Discretisation,
    finer: [OnceLock<Discretisation>; FINER.len()],
}

impl Meshes {
    /// Places the nodes of [`resolution`].
    ///
    /// # Errors
    /// More nodes than the solver serves.
    pub fn new(profile: &Profile, resolution: Resolution) -> Result<Self, GratingError> {
        let first = Discretisation::new(profile, resolution)?;
        Ok(Self { profile: profile.clone(), resolution, first, finer: [const { OnceLock::new() }; FINER.len()] })
    }

    /// The nodes of a step of [`FINER`].
    fn finer(&self, step: usize) -> Result<&Discretisation, GratingError> {
        if let Some(made) = self.finer[step].get() {
            return Ok(made);
        }
        let nodes = FINER[step] * self.resolution.nodes;
        let made = Discretisation::new(&self.profile, Resolution { nodes, ..self.resolution })?;
        Ok(self.finer[step].get_or_init(|| made))
    }
}

/// A profile with its nodes, and a metal's response at every wavelength of a table.
pub(super) struct Solved<'a> {
    meshes: &'a Meshes,
    index: Option<&'a SpectralIndex>,
    tables: Vec<(f64, MetalTable<'a>)>,
}

impl<'a> Solved<'a> {
    /// Of a profile in air, above a medium of this index by wavelength, or above a perfect conductor; with tables of the
    /// medium's response at these wavelengths in nm where it is a metal.
    pub fn new(
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
        let covered = self.ky_squared_share(air.t(), nm) > -CONTINUED;
        let table = self.tables.iter().find(|(at, _)| *at == nm && covered);
        Ok(match table {
            Some((_, table)) => air.solve_tabulated(table)?,
            None => air.solve(&medium(self.index, nm)?, nm)?,
        })
    }

    /// With more nodes, until power is kept.
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

    /// What `of` makes of the orders at a place at each wavelength in nm and of the share `ky²/k²` there.
    fn each_wavelength<T: Clone>(
        &self,
        t: f64,
        b: f64,
        wavelengths_nm: &[f64],
        of: impl Fn(&Amplitudes, f64) -> Vec<T>,
    ) -> Result<Vec<Vec<T>>, GratingError> {
        let air = self.meshes.first.air(t, b)?;
        // A perfect conductor knows no wavelength at given t and b.
        let distinct = if self.index.is_some() { wavelengths_nm } else { &wavelengths_nm[..1] };
        let mut matrices = Vec::with_capacity(wavelengths_nm.len());
        for &nm in distinct {
            let mut amplitudes = self.solve(&air, nm)?;
            let share = self.ky_squared_share(t, nm);
            // Where ky is imaginary no power is known that should be kept.
            if share >= 0.0 && self.imbalance(&amplitudes, t, nm) > BALANCE {
                amplitudes = self.solve_finer(t, b, nm)?;
            }
            matrices.push(of(&amplitudes, share));
        }
        matrices.resize(wavelengths_nm.len(), matrices.last().cloned().unwrap_or_default());
        Ok(matrices)
    }

    /// The shapes of the orders' Jones matrices, as [`Orders::efficiencies`] has their efficiencies.
    ///
    /// # Errors
    /// A place that cannot be solved well enough.
    pub fn shapes(&self, t: f64, b: f64, wavelengths_nm: &[f64]) -> Result<Vec<Vec<Shape>>, GratingError> {
        self.each_wavelength(t, b, wavelengths_nm, |amplitudes, share| {
            let orders = amplitudes.orders();
            let pairs = orders.iter().flat_map(|&from| orders.iter().map(move |&out| (out, from)));
            pairs.map(|(out, from)| shape(amplitudes.jones(out, from), share)).collect()
        })
    }

    /// What [`BALANCE`] bounds.
    fn imbalance(&self, amplitudes: &Amplitudes, t: f64, nm: f64) -> f64 {
        amplitudes.balance_error() * (t / self.periods(nm)).min(1.0)
    }

    fn periods(&self, nm: f64) -> f64 {
        1e3 * self.meshes.profile.period_um() / nm
    }

    /// `ky²/k²` of a wave of this `t` at a wavelength in nm.
    fn ky_squared_share(&self, t: f64, nm: f64) -> f64 {
        let share = t / self.periods(nm);
        (1.0 - share) * (1.0 + share)
    }
}

impl Orders for Solved<'_> {
    fn efficiencies(&self, t: f64, b: f64, wavelengths_nm: &[f64]) -> Result<Vec<Vec<f64>>, GratingError> {
        self.each_wavelength(t, b, wavelengths_nm, |amplitudes, share| efficiencies(amplitudes, share >= 0.0))
    }
}

/// What lies below the relief at a wavelength in nm.
pub(super) fn medium(index: Option<&SpectralIndex>, nm: f64) -> Result<Medium, GratingError> {
    let Some(index) = index else { return Ok(Medium::Perfect) };
    let ComplexIndex { eta, k } = index.at(nm);
    Ok(Medium::index(eta, k)?)
}

/// `[incident · orders + outgoing]`. Amplitudes between the two states go with ky, so where ky is imaginary (`!real`) their
/// squares go on as negative numbers.
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
