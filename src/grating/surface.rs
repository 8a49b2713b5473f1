//! A grating's reflectance at wavelengths, from its table of efficiencies: the fractions of the incident power in each
//! order (symbols: `mod.rs`). This file builds the table and owns it; `lobe.rs` evaluates it.

use super::GratingError;
use super::body::GratingBody;
use super::build::{EfficiencyTable, GratingReport, TableResolution};
use super::efficiencies::EfficiencyView;
use super::film_solver::FilmSolver;
use super::interface_solver::InterfaceSolver;
use super::interface_table::{build_efficiencies, efficiency_error};
use super::lobe::{GratingLayout, GratingLobe};
use super::order_solver::OrderSolver;
use super::plan::{CostBasis, choose_resolution, choose_spacing, create_meshes, spacing_of};
use super::rigorous_solver::RigorousSolver;
use super::wavelengths::all_solved;
use crate::clock::Instant;
use crate::lobe::{self, Answer, Sample};
use crate::numeric::{Numbers, Plain};
use crate::scattering::{SpectralIndex, Vec3};
use crate::table::{CoherenceWindow, Progress};
use serde::{Deserialize, Serialize};
use sunbeam_rigorous::{Profile, Side};

/// Number of random incidences and wavelengths at which a table's error is measured. More points give a more accurate
/// error and a longer build. Tables of interfaces get four times as many points: few incidences hold most of their
/// error, so an estimate from few points would vary by chance.
const ERROR_POINTS: usize = 60;

/// The surface of a grating by Maxwell's equations, with a table of its orders' efficiencies.
///
/// ```
/// use sunbeam::grating::{GratingSurface, Profile};
/// use sunbeam::table::Progress;
///
/// // A perfectly conducting sinusoid of period 0.6 µm and height 0.1 µm.
/// let profile = Profile::sinusoid(0.6, 0.1)?;
/// let (coherence_length_um, build_limit) = (20.0, 1.0);
/// let grating = GratingSurface::new(&profile, None, coherence_length_um, build_limit, &Progress::none())?;
///
/// // All light is reflected: at normal incidence and 500 nm into orders −1, 0 and 1.
/// let total: f64 = (-1..=1).map(|order| grating.efficiency(500.0, [0.0, 0.0], order)).sum();
/// assert!((total - 1.0).abs() < 0.01);
/// # Ok::<(), sunbeam::grating::GratingError>(())
/// ```
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct GratingSurface {
    layout: GratingLayout,
    /// Table data of the efficiencies.
    words: Vec<u32>,
    report: GratingReport,
}

impl GratingSurface {
    /// Solves and tabulates the orders of a profile in air, above a medium of this index by wavelength, or above a
    /// perfect conductor (`None`). `coherence_length_um` is four standard deviations of the coherence window: longer
    /// ones make orders narrower. `build_limit` is at least 1; larger values allow more memory and time.
    ///
    /// # Errors
    /// A profile or index that the solver refuses, points that it cannot solve accurately enough, and a build that
    /// would take more than `build_limit` times [`LIMIT_BYTES`](crate::table::LIMIT_BYTES) or
    /// [`LIMIT_SECONDS`](crate::table::LIMIT_SECONDS); the limit is checked before anything is solved.
    pub fn new(
        profile: &Profile,
        index: Option<&SpectralIndex>,
        coherence_length_um: f64,
        build_limit: f64,
        progress: &Progress,
    ) -> Result<Self, GratingError> {
        Self::of_body(profile, GratingBody::Reflector(index), coherence_length_um, build_limit, progress)
    }

    /// Solves and tabulates the orders of a profile on a body, on both sides where the body transmits. The other
    /// arguments are those of [`GratingSurface::new`].
    ///
    /// # Errors
    /// The errors of [`GratingSurface::new`].
    pub fn of_body(
        profile: &Profile,
        body: GratingBody<'_>,
        coherence_length_um: f64,
        build_limit: f64,
        progress: &Progress,
    ) -> Result<Self, GratingError> {
        let start = Instant::now();
        let period_um = profile.period_um();
        let basis = CostBasis::of_efficiencies(period_um, body);
        // Sets of nodes on the profile at which fields are solved.
        let meshes = create_meshes(profile, body, basis, build_limit)?;
        match body {
            GratingBody::Reflector(index) => {
                let table_resolution = choose_resolution(basis, choose_spacing(&meshes, period_um, index)?);
                let wavelengths_nm = all_solved(period_um, table_resolution.spacing);
                let solver = RigorousSolver::new(&meshes, index, &wavelengths_nm)?;
                Self::tabulate(period_um, coherence_length_um, &solver, table_resolution, progress, start)
            }
            GratingBody::Film(eta) => {
                let solver = FilmSolver { meshes: &meshes, eta };
                let table_resolution = choose_resolution(basis, Some(spacing_of(&solver, period_um)?));
                Self::tabulate(period_um, coherence_length_um, &solver, table_resolution, progress, start)
            }
            GratingBody::Interface(eta) => {
                let solver = InterfaceSolver { meshes: &meshes, eta };
                let table = build_efficiencies(period_um, &solver, progress)?;
                let error = efficiency_error(&table, period_um, &solver, 4 * ERROR_POINTS)?;
                Ok(Self::of_table(period_um, coherence_length_um, table, error, start))
            }
        }
    }

    /// Whether the grating is the relief of a body that transmits light.
    pub fn transmits(&self) -> bool {
        self.layout.efficiencies.transmits()
    }

    /// Tabulates the orders of a solver, and measures the table's error. The build began at `start`.
    ///
    /// # Errors
    /// The solver's errors.
    pub(super) fn tabulate(
        period_um: f64,
        coherence_length_um: f64,
        solver: &impl OrderSolver,
        table_resolution: TableResolution,
        progress: &Progress,
        start: Instant,
    ) -> Result<Self, GratingError> {
        let table = EfficiencyTable::build(period_um, solver, table_resolution, progress)?;
        let error = table.error(period_um, solver, ERROR_POINTS)?;
        Ok(Self::of_table(period_um, coherence_length_um, table, error, start))
    }

    /// The surface of a table whose build began at `start`, with the RMS and the 99th percentile of its error.
    fn of_table(
        period_um: f64,
        coherence_length_um: f64,
        table: EfficiencyTable,
        (rms, p99): (f64, f64),
        start: Instant,
    ) -> Self {
        let EfficiencyTable { layout, words, solved } = table;
        let report =
            GratingReport { bytes: 4 * words.len(), solved, rms, p99, build_seconds: start.elapsed().as_secs_f64() };
        let sigma_per_um = CoherenceWindow::new(coherence_length_um).order_sigma_per_um();
        Self { layout: GratingLayout { efficiencies: layout, period_um, sigma_per_um }, words, report }
    }

    /// Size, cost and measured error of the table.
    pub fn report(&self) -> &GratingReport {
        &self.report
    }

    /// Layout of the table, period and order width.
    pub fn layout(&self) -> &GratingLayout {
        &self.layout
    }

    /// Table data of the efficiencies, arranged as [`EfficiencyLayout`](super::EfficiencyLayout) describes.
    pub fn words(&self) -> &[u32] {
        &self.words
    }

    /// The grating with another coherence length in µm, four standard deviations of the window. The table is kept,
    /// since efficiencies do not depend on it.
    #[must_use]
    pub fn with_coherence_length(self, coherence_length_um: f64) -> Self {
        let sigma_per_um = CoherenceWindow::new(coherence_length_um).order_sigma_per_um();
        let layout = GratingLayout { sigma_per_um, ..self.layout };
        Self { layout, ..self }
    }

    /// The lobe over plain numbers, in `f32` or `f64`.
    pub fn lobe<F>(&self) -> GratingLobe<'_, Plain<'_, F>>
    where
        for<'a> Plain<'a, F>: Numbers<Words = &'a [u32]>,
    {
        GratingLobe { layout: &self.layout, words: &self.words }
    }

    /// Unpolarised efficiency of a reflected order for light from above, from the direction with the cosines `wi`
    /// across and along the grooves; in [0, 1]. Zero for an order that does not propagate.
    pub fn efficiency(&self, wavelength_nm: f64, wi: [f64; 2], order: i32) -> f64 {
        self.efficiency_between(wavelength_nm, wi, order, [Side::Above; 2])
    }

    /// [`GratingSurface::efficiency`] for light that arrives at the first of the `sides` of a body that transmits and
    /// leaves on the second. Below an interface, `wi` is a direction in the medium. For a grating that only reflects it
    /// is zero unless both sides are above.
    pub fn efficiency_between(&self, wavelength_nm: f64, wi: [f64; 2], order: i32, sides: [Side; 2]) -> f64 {
        let [arrives_below, leaves_below] = sides.map(|side| side == Side::Below);
        let layout = self.layout.efficiencies;
        // The light's tangential wave vector over the wave number in vacuum is (−x, −y), since `wi` points against the
        // light. `periods` is d/λ.
        let [x, y] = wi.map(|cosine| if arrives_below { cosine * layout.eta_below() } else { cosine });
        let periods = 1e3 * self.layout.period_um / wavelength_nm;
        let view = EfficiencyView::<Plain<f64>> { layout, words: &self.words };
        // Evaluators read a table only in the lanes of a SIMD vector where this mask is true. A plain number has one.
        let active = true;
        let channels = view.channels(&view.bounds(periods, -y), -x * periods, active);
        let (incident, incident_propagates) = channels.of_order(0.0, arrives_below);
        let (outgoing, outgoing_propagates) = channels.of_order(f64::from(order), leaves_below);
        if !(incident_propagates && outgoing_propagates) {
            return 0.0;
        }
        view.entry(&view.row(&channels, incident, wavelength_nm, active), outgoing, active)
    }

    /// `f_r` in 1/sr: the material's reflectance is included, the cosine is not. Zero outside of 360 to 830 nm. Never
    /// negative, never NaN. For a grating that only reflects, zero unless both directions lie above the surface. At a
    /// body that transmits, directions may also lie below it: in the medium of an interface, or in air behind a film.
    /// `f_r` is then the fraction of the power from `wi` that leaves along `wo`, per solid angle and per |wo.z|.
    pub fn eval(&self, wi: Vec3, wo: Vec3, wavelength_nm: f64) -> f64 {
        lobe::eval(&self.lobe::<f64>(), wi, wo, wavelength_nm)
    }

    /// [`GratingSurface::eval`] and the density of [`GratingSurface::sample`] for this wavelength (nm), in 1/sr.
    pub fn eval_pdf(&self, wi: Vec3, wo: Vec3, wavelength_nm: f64) -> Answer {
        lobe::eval_pdf(&self.lobe::<f64>(), wi, wo, wavelength_nm)
    }

    /// Density in 1/sr of a direction sampled for several wavelengths (nm): the mean of their densities.
    pub fn pdf(&self, wi: Vec3, wo: Vec3, wavelengths_nm: &[f64]) -> f64 {
        lobe::pdf(&self.lobe::<f64>(), wi, wo, wavelengths_nm)
    }

    /// Samples a direction for one or several wavelengths (nm) from three random numbers in [0, 1), with its density
    /// and weight. `None` where [`GratingSurface::sample_direction`] gives none; such a sample counts in means, with
    /// the weight 0.
    pub fn sample(&self, wi: Vec3, wavelengths_nm: &[f64], u: [f64; 3]) -> Option<Sample> {
        lobe::sample(&self.lobe::<f64>(), wi, wavelengths_nm, u)
    }

    /// A direction from three random numbers in [0, 1). `None` where the direction lies beyond the horizon, and, unless
    /// the body transmits, where `wi` lies below the surface. The first number selects the sampler's uniform part or
    /// one of the wavelengths (nm), then the order.
    pub fn sample_direction(&self, wi: Vec3, wavelengths_nm: &[f64], u: [f64; 3]) -> Option<Vec3> {
        lobe::sample_direction(&self.lobe::<f64>(), wi, wavelengths_nm, u)
    }
}

#[cfg(test)]
pub(super) mod tests;
