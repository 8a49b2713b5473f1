//! A grating that answers from its table.

use super::build::{EfficiencyTable, Fineness, GratingReport, Orders};
use super::efficiencies::EfficiencyView;
use super::lobe::{GratingLayout, GratingLobe, groove_t};
use super::place::Place;
use super::polarisation::JonesTable;
use super::solved::{Meshes, Solved, resolution};
use super::wavelengths::{Spacing, ever_solved, wavelengths};
use crate::clock::Instant;
use crate::lobe::{self, Answer, Sample};
use crate::numeric::{Numbers, Plain};
use crate::scattering::{SpectralIndex, Vec3};
use crate::table::{
    CoherenceWindow, Estimate, FREQUENCY_MAX_PER_UM, Progress, TableError, WAVELENGTH_MAX_NM, WAVELENGTH_MIN_NM,
};
use serde::{Deserialize, Serialize};
use sunbeam_rigorous::Profile;

/// Places and wavelengths between the nodes at which a table is held against what it was made of.
const HELD_BACK: usize = 60;

/// The fewest and the most nodes of a table along either side of a cell, of a real medium; and those of a perfect conductor, whose
/// table has no wavelengths.
const STORED: [u32; 2] = [18, 32];
const STORED_PERFECT: u32 = 32;
/// Bytes that a table may have for more than the fewest nodes.
const ROOM: f64 = 4e6;
/// Root mean square of an efficiency's highest terms that may be left out, with [`TERMS_CELLS`] or more cells. With fewer, fewer
/// orders share the light.
const TERMS: f64 = 6e-3;
const TERMS_CELLS: f64 = 14.0;
/// Root mean square error of an efficiency halfway between two wavelengths.
const BETWEEN_WAVELENGTHS: f64 = 1.6e-3;

/// A diffracting grating that answers from a table of efficiencies.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct GratingSurface {
    layout: GratingLayout,
    words: Vec<u32>,
    report: GratingReport,
}

impl GratingSurface {
    /// Solves a grating and tabulates its orders: of a profile in air above a medium of this index by wavelength, or above a
    /// perfect conductor.
    ///
    /// # Errors
    /// A profile or index that the solver refuses, places that it cannot solve well enough, and a build that would take more
    /// than `build_limit` times [`LIMIT_BYTES`](crate::table::LIMIT_BYTES) or
    /// [`LIMIT_SECONDS`](crate::table::LIMIT_SECONDS), which is told at once.
    pub fn new(
        profile: &Profile,
        index: Option<&SpectralIndex>,
        coherence_length_um: f64,
        build_limit: f64,
        progress: &Progress,
    ) -> Result<Self, GratingError> {
        let period_um = profile.period_um();
        let meshes = meshes(profile, index, build_limit)?;
        let fineness = fineness(period_um, spacing(&meshes, period_um, index)?);
        let wavelengths_nm = ever_solved(period_um, fineness.spacing);
        let solved = Solved::new(&meshes, index, &wavelengths_nm)?;
        Self::tabulate(period_um, coherence_length_um, &solved, fineness, progress)
    }

    /// Tabulates orders of a grating.
    pub(super) fn tabulate(
        period_um: f64,
        coherence_length_um: f64,
        orders: &impl Orders,
        fineness: Fineness,
        progress: &Progress,
    ) -> Result<Self, GratingError> {
        let start = Instant::now();
        let table = EfficiencyTable::build(period_um, orders, fineness, progress)?;
        let (rms, p99) = table.error(period_um, orders, HELD_BACK)?;
        let EfficiencyTable { layout, words, solved } = table;
        let report =
            GratingReport { bytes: 4 * words.len(), solved, rms, p99, build_seconds: start.elapsed().as_secs_f64() };
        let sigma_per_um = sigma_per_um(coherence_length_um);
        Ok(Self { layout: GratingLayout { efficiencies: layout, period_um, sigma_per_um }, words, report })
    }

    /// What building took and gave.
    pub fn report(&self) -> &GratingReport {
        &self.report
    }

    /// Everything about the lobe but the words of its table.
    pub fn layout(&self) -> &GratingLayout {
        &self.layout
    }

    /// The words of the table.
    pub fn words(&self) -> &[u32] {
        &self.words
    }

    /// The same grating with another coherence length in µm, four standard deviations of the window.
    #[must_use]
    pub fn with_coherence_length(self, coherence_length_um: f64) -> Self {
        let layout = GratingLayout { sigma_per_um: sigma_per_um(coherence_length_um), ..self.layout };
        Self { layout, ..self }
    }

    /// The lobe by value, in `f32` or `f64`.
    pub fn lobe<F>(&self) -> GratingLobe<'_, Plain<'_, F>>
    where
        for<'a> Plain<'a, F>: Numbers<Words = &'a [u32]>,
    {
        GratingLobe { layout: &self.layout, words: &self.words }
    }

    /// Unpolarised efficiency of an order for light from a direction with these cosines across and along the grooves; zero for an
    /// order that does not propagate.
    pub fn efficiency(&self, wavelength_nm: f64, wi: [f64; 2], order: i32) -> f64 {
        let periods = 1e3 * self.layout.period_um / wavelength_nm;
        let t = groove_t::<Plain<f64>>(periods, wi[1]);
        let place = Place::<Plain<f64>>::new(t, -wi[0] * periods);
        let (at, there) = place.outgoing(f64::from(order));
        if !(there && place.propagates) {
            return 0.0;
        }
        let view = EfficiencyView::<Plain<f64>> { layout: self.layout.efficiencies, words: &self.words };
        view.entry(&view.row(&place, wavelength_nm, true), at, true)
    }

    /// `f_r` in 1/sr, the material's reflectance included, the cosine left out. Zero unless both directions lie above the surface
    /// and the wavelength (nm) within 360 to 830. Never negative, never NaN.
    pub fn eval(&self, wi: Vec3, wo: Vec3, wavelength_nm: f64) -> f64 {
        lobe::eval(&self.lobe::<f64>(), wi, wo, wavelength_nm)
    }

    /// [`GratingSurface::eval`] and the density of [`GratingSurface::sample`], in 1/sr.
    pub fn eval_pdf(&self, wi: Vec3, wo: Vec3, wavelength_nm: f64) -> Answer {
        lobe::eval_pdf(&self.lobe::<f64>(), wi, wo, wavelength_nm)
    }

    /// Density in 1/sr of a direction sampled for several wavelengths (nm): the mean of their densities.
    pub fn pdf(&self, wi: Vec3, wo: Vec3, wavelengths_nm: &[f64]) -> f64 {
        lobe::pdf(&self.lobe::<f64>(), wi, wo, wavelengths_nm)
    }

    /// Samples a direction for at least one wavelength (nm) from three random numbers in [0, 1), with density and weight. `None`
    /// as in [`GratingSurface::sample_direction`]; such samples count as zero.
    pub fn sample(&self, wi: Vec3, wavelengths_nm: &[f64], u: [f64; 3]) -> Option<Sample> {
        lobe::sample(&self.lobe::<f64>(), wi, wavelengths_nm, u)
    }

    /// A direction from three random numbers in [0, 1); `None` where it falls below the horizon, or `wi` lies there. The first
    /// number chooses the uniform part or one of the wavelengths (nm), then the order.
    pub fn sample_direction(&self, wi: Vec3, wavelengths_nm: &[f64], u: [f64; 3]) -> Option<Vec3> {
        lobe::sample_direction(&self.lobe::<f64>(), wi, wavelengths_nm, u)
    }
}

/// How many times as far apart as those of efficiencies the wavelengths of polarisation may lie, and how far in nm: an anomaly is in the
/// power above all.
const STEPS: f64 = 2.0;
const STEP_MAX_NM: f64 = 40.0;

impl JonesTable {
    /// Solves a grating and tabulates how its orders polarise.
    ///
    /// # Errors
    /// As [`GratingSurface::new`].
    pub fn new(
        profile: &Profile,
        index: Option<&SpectralIndex>,
        build_limit: f64,
        progress: &Progress,
    ) -> Result<Self, GratingError> {
        let period_um = profile.period_um();
        let meshes = meshes(profile, index, build_limit)?;
        let spacing = spacing(&meshes, period_um, index)?;
        let step_nm = spacing.map(|spacing| (STEPS * spacing.step_nm).min(STEP_MAX_NM));
        let (wavelengths_nm, _) = wavelengths(period_um, step_nm);
        Self::build(period_um, &Solved::new(&meshes, index, &wavelengths_nm)?, step_nm, progress)
    }
}

/// The nodes on a profile, if a table does not take more than the limit allows.
fn meshes(profile: &Profile, index: Option<&SpectralIndex>, build_limit: f64) -> Result<Meshes, GratingError> {
    let resolution = resolution(profile, index)?;
    estimate(profile.period_um(), resolution.nodes, index.is_some())
        .check(build_limit, || "a shorter period, or theory \"scalar\", which takes any".to_owned())?;
    Meshes::new(profile, resolution)
}

/// How finely the nodes of a table lie.
fn fineness(period_um: f64, spacing: Option<Spacing>) -> Fineness {
    let cells = FREQUENCY_MAX_PER_UM * period_um + 1.0;
    let stored = spacing.map_or(STORED_PERFECT, |spacing| {
        let wavelengths = (WAVELENGTH_MAX_NM - WAVELENGTH_MIN_NM) / spacing.step_nm;
        let fitting = (0.5 * ROOM / entries(cells, wavelengths)).sqrt();
        (fitting as u32).clamp(STORED[0], STORED[1])
    });
    Fineness { stored, spacing, tolerance: TERMS * (cells / TERMS_CELLS).min(1.0) }
}

/// Efficiencies of a table at each pair of nodes. Longer wavelengths have fewer cells, a third of the entries in the mean.
fn entries(cells: f64, wavelengths: f64) -> f64 {
    cells.powi(3) / 3.0 * (wavelengths / 3.0).max(1.0)
}

/// The wavelengths of a table; `None` for a perfect conductor, which knows none.
fn spacing(meshes: &Meshes, period_um: f64, index: Option<&SpectralIndex>) -> Result<Option<Spacing>, GratingError> {
    if index.is_none() {
        return Ok(None);
    }
    Ok(Some(Spacing::choose(period_um, &Solved::new(meshes, index, &[])?, BETWEEN_WAVELENGTHS)?))
}

/// Wavelengths of a table in an estimate, and places that are solved of a cell.
const ESTIMATED: [f64; 2] = [25.0, 150.0];
/// Seconds on one core of a place's air and of a wavelength's solution, for one node, to the second and third power.
const AIR_SECONDS: f64 = 1e-6;
const SOLUTION_SECONDS: f64 = 1.2e-9;

/// What a table takes, on two cores, with so many nodes on the profile.
fn estimate(period_um: f64, nodes: usize, has_wavelengths: bool) -> Estimate {
    let cells = FREQUENCY_MAX_PER_UM * period_um + 1.0;
    let wavelengths = if has_wavelengths { ESTIMATED[0] } else { 1.0 };
    let nodes = nodes as f64;
    let place = AIR_SECONDS * nodes * nodes + wavelengths * SOLUTION_SECONDS * nodes.powi(3);
    let stored = f64::from(if has_wavelengths { STORED[0] } else { STORED_PERFECT }).powi(2);
    Estimate { bytes: 2.0 * stored * entries(cells, wavelengths), seconds: 0.5 * cells * ESTIMATED[1] * place }
}

/// Standard deviation of an order in cycles/µm.
pub(super) fn sigma_per_um(coherence_length_um: f64) -> f64 {
    CoherenceWindow::from_length_um(coherence_length_um).order_sigma_per_um()
}

/// Why a grating was not tabulated.
#[derive(Debug, PartialEq, thiserror::Error)]
#[allow(missing_docs)] // Each message says what its fields are.
pub enum GratingError {
    #[error(
        "the relief varies along y by {found_um:.2e} µm, but that of a grating must vary along x alone, to within \
         {accepted_um:.2e} µm; theory \"scalar\" takes any"
    )]
    NotAlongX { found_um: f64, accepted_um: f64 },
    #[error(transparent)]
    Solver(sunbeam_rigorous::Error),
    #[error("{0}; theory \"scalar\" takes any")]
    Size(sunbeam_rigorous::Error),
    #[error(
        "with {nodes} nodes the power at t = {t}, b = {b} and {wavelength_nm} nm is off by {balance:.1e}, more than a table of \
         efficiencies may be; theory \"scalar\" takes any relief"
    )]
    Unbalanced { t: f64, b: f64, wavelength_nm: f64, nodes: usize, balance: f64 },
    #[error(transparent)]
    Limit(#[from] TableError),
}

impl From<sunbeam_rigorous::Error> for GratingError {
    fn from(error: sunbeam_rigorous::Error) -> Self {
        use sunbeam_rigorous::Error::{TooLarge, TooManyWaves};
        if matches!(error, TooLarge { .. } | TooManyWaves { .. }) { Self::Size(error) } else { Self::Solver(error) }
    }
}

#[cfg(test)]
mod tests;
