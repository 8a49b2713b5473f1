//! A grating at wavelengths, from its table of efficiencies.

use super::build::{EfficiencyTable, GratingReport, TableResolution};
use super::efficiencies::EfficiencyView;
use super::error::GratingError;
use super::lobe::{GratingLayout, GratingLobe, groove_t};
use super::orders::Orders;
use super::place::Place;
use super::polarisation::JonesTable;
use super::solved::{Meshes, Solved, resolution};
use super::wavelengths::{Spacing, ever_solved, wavelengths};
use crate::clock::Instant;
use crate::lobe::{self, Answer, Sample};
use crate::numeric::{Numbers, Plain};
use crate::scattering::{SpectralIndex, Vec3};
use crate::table::{CoherenceWindow, Estimate, Progress, WAVELENGTH_MAX_NM, WAVELENGTH_MIN_NM};
use serde::{Deserialize, Serialize};
use sunbeam_rigorous::Profile;

/// Number of random incidences and wavelengths at which a table's error is measured.
const ERROR_SAMPLES: usize = 60;

/// Least and greatest number of nodes along each side of a cell, for a real medium.
const STORED: [u32; 2] = [18, 32];
/// Number of nodes for a perfect conductor, whose table has no wavelengths.
const STORED_PERFECT: u32 = 32;
/// Bytes that a table may use for more than the least number of nodes.
const ROOM: f64 = 4e6;
/// Accepted root mean square of an efficiency's highest Chebyshev terms, for gratings of at least [`TERMS_CELLS`]
/// cells. With fewer cells, fewer orders share the light and the tolerance shrinks in proportion.
const TERMS: f64 = 6e-3;
/// Number of cells from which [`TERMS`] applies unscaled.
const TERMS_CELLS: f64 = 14.0;
/// Accepted root mean square error of an efficiency halfway between two wavelengths.
const BETWEEN_WAVELENGTHS: f64 = 1.6e-3;

/// A grating of the rigorous theory at wavelengths, from a table of efficiencies.
///
/// ```no_run
/// use sunbeam::grating::{GratingSurface, Profile};
/// use sunbeam::table::Progress;
///
/// // A perfectly conducting sinusoid of 1.2 µm, 0.2 µm from valley to peak; solving takes seconds.
/// let profile = Profile::sinusoid(1.2, 0.2)?;
/// let grating = GratingSurface::new(&profile, None, 65.0, 1.0, &Progress::none())?;
/// let zero_order = grating.efficiency(550.0, [0.0, 0.0], 0);
/// assert!((0.0..=1.0).contains(&zero_order));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct GratingSurface {
    layout: GratingLayout,
    words: Vec<u32>,
    report: GratingReport,
}

impl GratingSurface {
    /// Solves and tabulates a profile in air above a medium of this index, or above a perfect conductor (`None`).
    ///
    /// # Errors
    /// A profile or index that the solver refuses, and incidences whose solution does not conserve power. A build that
    /// would take more than `build_limit` times [`LIMIT_BYTES`](crate::table::LIMIT_BYTES) or
    /// [`LIMIT_SECONDS`](crate::table::LIMIT_SECONDS) is refused before it begins.
    pub fn new(
        profile: &Profile,
        index: Option<&SpectralIndex>,
        coherence_length_um: f64,
        build_limit: f64,
        progress: &Progress,
    ) -> Result<Self, GratingError> {
        let period_um = profile.period_um();
        let meshes = meshes(profile, index, build_limit)?;
        let resolution = table_resolution(period_um, spacing(&meshes, period_um, index)?);
        let wavelengths_nm = ever_solved(period_um, resolution.spacing);
        let solved = Solved::new(&meshes, index, &wavelengths_nm)?;
        Self::tabulate(period_um, coherence_length_um, &solved, resolution, progress)
    }

    /// Tabulates the orders of a grating from any source.
    pub(super) fn tabulate(
        period_um: f64,
        coherence_length_um: f64,
        orders: &impl Orders,
        resolution: TableResolution,
        progress: &Progress,
    ) -> Result<Self, GratingError> {
        let start = Instant::now();
        let table = EfficiencyTable::build(period_um, orders, resolution, progress)?;
        let (rms, p99) = table.error(period_um, orders, ERROR_SAMPLES)?;
        let EfficiencyTable { layout, words, solved } = table;
        let report =
            GratingReport { bytes: 4 * words.len(), solved, rms, p99, build_seconds: start.elapsed().as_secs_f64() };
        let sigma_per_um = CoherenceWindow::new(coherence_length_um).order_sigma_per_um();
        Ok(Self { layout: GratingLayout { efficiencies: layout, period_um, sigma_per_um }, words, report })
    }

    /// Size, build time and measured error of the table.
    pub fn report(&self) -> &GratingReport {
        &self.report
    }

    /// Everything of the lobe but the table data.
    pub fn layout(&self) -> &GratingLayout {
        &self.layout
    }

    /// Table data.
    pub fn words(&self) -> &[u32] {
        &self.words
    }

    /// A copy with another coherence length in µm.
    #[must_use]
    pub fn with_coherence_length(self, coherence_length_um: f64) -> Self {
        let layout = GratingLayout {
            sigma_per_um: CoherenceWindow::new(coherence_length_um).order_sigma_per_um(),
            ..self.layout
        };
        Self { layout, ..self }
    }

    /// The lobe over plain numbers, in `f32` or `f64`.
    pub fn lobe<F>(&self) -> GratingLobe<'_, Plain<'_, F>>
    where
        for<'a> Plain<'a, F>: Numbers<Words = &'a [u32]>,
    {
        GratingLobe { layout: &self.layout, words: &self.words }
    }

    /// Unpolarised efficiency of an order, for light from the direction cosines `wi` across and along the grooves. Zero
    /// for an order that does not propagate.
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

    /// `f_r` in 1/sr, the material's reflectance included, the cosine left out. Zero unless both directions lie above
    /// the surface and the wavelength (nm) within 360 to 830. Never negative, never NaN.
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

    /// Samples a direction for at least one wavelength (nm) from three random numbers in [0, 1), with density and
    /// weight. `None` as in [`GratingSurface::sample_direction`]; such samples count as zero.
    pub fn sample(&self, wi: Vec3, wavelengths_nm: &[f64], u: [f64; 3]) -> Option<Sample> {
        lobe::sample(&self.lobe::<f64>(), wi, wavelengths_nm, u)
    }

    /// A direction from three random numbers in [0, 1); `None` where it falls below the horizon, or `wi` lies there.
    /// The first number chooses the uniform part or one of the wavelengths (nm), then the order.
    pub fn sample_direction(&self, wi: Vec3, wavelengths_nm: &[f64], u: [f64; 3]) -> Option<Vec3> {
        lobe::sample_direction(&self.lobe::<f64>(), wi, wavelengths_nm, u)
    }
}

/// Wavelength step of Jones matrices, in steps of efficiencies. Anomalies change the power more than the polarisation.
const JONES_STEPS: f64 = 2.0;
/// Largest wavelength step of Jones matrices in nm.
const JONES_STEP_MAX_NM: f64 = 40.0;

impl JonesTable {
    /// Solves a grating and tabulates the Jones matrices of its orders.
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
        let step_nm = spacing.map(|spacing| (JONES_STEPS * spacing.step_nm).min(JONES_STEP_MAX_NM));
        let (wavelengths_nm, _) = wavelengths(period_um, step_nm);
        Self::build(period_um, &Solved::new(&meshes, index, &wavelengths_nm)?, step_nm, progress)
    }
}

/// Discretises a profile, unless its table would exceed the limits.
fn meshes(profile: &Profile, index: Option<&SpectralIndex>, build_limit: f64) -> Result<Meshes, GratingError> {
    let resolution = resolution(profile, index)?;
    estimate(profile.period_um(), resolution.nodes, index.is_some())
        .check(build_limit, || "a shorter period, or theory \"scalar\", which takes any".to_owned())?;
    Meshes::new(profile, resolution)
}

/// TableResolution of a table.
fn table_resolution(period_um: f64, spacing: Option<Spacing>) -> TableResolution {
    let cells = 2e3 * period_um / WAVELENGTH_MIN_NM + 1.0;
    let stored = spacing.map_or(STORED_PERFECT, |spacing| {
        let wavelengths = (WAVELENGTH_MAX_NM - WAVELENGTH_MIN_NM) / spacing.step_nm;
        let fitting = (0.5 * ROOM / entries(cells, wavelengths)).sqrt();
        (fitting as u32).clamp(STORED[0], STORED[1])
    });
    TableResolution { stored, spacing, tolerance: TERMS * (cells / TERMS_CELLS).min(1.0) }
}

/// Number of efficiencies in a table per pair of nodes. Longer wavelengths have fewer cells: on average a third of the
/// entries.
fn entries(cells: f64, wavelengths: f64) -> f64 {
    cells.powi(3) / 3.0 * (wavelengths / 3.0).max(1.0)
}

/// Wavelengths of a table; `None` for a perfect conductor.
fn spacing(meshes: &Meshes, period_um: f64, index: Option<&SpectralIndex>) -> Result<Option<Spacing>, GratingError> {
    if index.is_none() {
        return Ok(None);
    }
    Ok(Some(Spacing::choose(period_um, &Solved::new(meshes, index, &[])?, BETWEEN_WAVELENGTHS)?))
}

/// Wavelengths of a typical table, for estimates.
const TYPICAL_WAVELENGTHS: f64 = 25.0;
/// Incidences solved in a typical cell, for estimates.
const TYPICAL_INCIDENCES: f64 = 150.0;
/// Seconds on one core for the fields in air of one incidence, per squared node.
const AIR_SECONDS: f64 = 1e-6;
/// Seconds on one core for the solution at one wavelength, per cubed node.
const SOLUTION_SECONDS: f64 = 1.2e-9;

/// Memory and time of a table on two cores, from the number of nodes on the profile.
fn estimate(period_um: f64, nodes: usize, has_wavelengths: bool) -> Estimate {
    let cells = 2e3 * period_um / WAVELENGTH_MIN_NM + 1.0;
    let wavelengths = if has_wavelengths { TYPICAL_WAVELENGTHS } else { 1.0 };
    let nodes = nodes as f64;
    let incidence = AIR_SECONDS * nodes * nodes + wavelengths * SOLUTION_SECONDS * nodes.powi(3);
    let stored = f64::from(if has_wavelengths { STORED[0] } else { STORED_PERFECT }).powi(2);
    Estimate {
        bytes: 2.0 * stored * entries(cells, wavelengths),
        seconds: 0.5 * cells * TYPICAL_INCIDENCES * incidence,
    }
}

#[cfg(test)]
mod tests;
