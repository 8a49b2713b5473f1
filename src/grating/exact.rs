//! Reference for gratings without tables: every order is solved at the pair of directions itself. It evaluates the
//! formula of `lobe.rs`, `f_r = Σ_m e_m K(f − f_m)/λ²` (symbols: `mod.rs`).
//!
//! e_m is the efficiency of order m, the fraction of the unpolarised incident power. K is the order's Gaussian about
//! the frequency `f_m = (m/d, 0)`, of standard deviation σ in cycles/µm. f is the frequency of the pair of directions.
//! The incident wave has the wave number `a` along x, in units of 2π over the period d. Order m has `a + m`. It
//! propagates in air where `|a + m| < t = (d/λ)·√(1 − ky²/k²)`, and in a medium of index n where
//! `|a + m| < tm = (d/λ)·√(n² − ky²/k²)`. Gaussians are cut off at `GAUSSIAN_REACH` standard deviations.

use super::GratingError;
use super::rigorous_solver::{DOUBLINGS, medium_at};
use crate::numeric::math::GAUSSIAN_REACH;
use crate::scattering::{ComplexIndex, Pair, SpectralIndex, TransparentBody, Vec3};
use crate::table::CoherenceWindow;
use std::f64::consts::TAU;
use sunbeam_rigorous::{CHECK_TOLERANCE, Channel, Discretisation, Profile, Resolution, Side, check_size};

/// The reflectance of a grating by Maxwell's equations without tables. Each evaluation solves the grating once for
/// every order whose Gaussian reaches the pair of directions.
///
/// ```
/// use sunbeam::grating::{ExactGrating, Profile};
///
/// // A perfectly conducting sinusoid of 1 µm; order 1 of 500 nm at normal incidence leaves at a sine of ½.
/// let grating = ExactGrating::new(Profile::sinusoid(1.0, 0.1)?, None, 20.0);
/// let order = [0.5, 0.0, 0.75_f64.sqrt()];
/// assert!(grating.eval([0.0, 0.0, 1.0], order, 500.0)? > 1.0);
/// # Ok::<(), sunbeam::grating::GratingError>(())
/// ```
pub struct ExactGrating {
    profile: Profile,
    /// Index of the medium below the relief by wavelength; `None` for a perfect conductor.
    index: Option<SpectralIndex>,
    /// σ in cycles/µm.
    sigma_per_um: f64,
    /// The body that transmits; `None` for a grating that only reflects.
    body: Option<TransparentBody>,
}

impl ExactGrating {
    /// A profile in air above a medium of this index by wavelength, or above a perfect conductor (`None`), with a
    /// coherence length in µm.
    pub fn new(profile: Profile, index: Option<SpectralIndex>, coherence_length_um: f64) -> Self {
        let sigma_per_um = CoherenceWindow::new(coherence_length_um).order_sigma_per_um();
        Self { profile, index, sigma_per_um, body: None }
    }

    /// A profile on a body that transmits, with a coherence length in µm.
    pub fn of_body(profile: Profile, body: TransparentBody, coherence_length_um: f64) -> Self {
        let index = SpectralIndex::Constant(ComplexIndex { eta: body.eta, k: 0.0 });
        Self { body: Some(body), ..Self::new(profile, Some(index), coherence_length_um) }
    }

    /// `f_r` in 1/sr, like [`GratingSurface::eval`](super::GratingSurface::eval): without the cosine. Zero unless both
    /// directions lie above the surface; a body that transmits has values on either side.
    ///
    /// # Errors
    /// An index or wavelength that the solver refuses, and orders that it cannot solve accurately enough.
    pub fn eval(&self, wi: Vec3, wo: Vec3, wavelength_nm: f64) -> Result<f64, GratingError> {
        if let Some(body) = self.body {
            return self.eval_at_body(body, wi, wo, wavelength_nm);
        }
        let Some(pair) = Pair::new(wi, wo) else { return Ok(0.0) };
        let period_um = self.profile.period_um();
        // d/λ.
        let periods = 1e3 * period_um / wavelength_nm;
        // σ and f.x in units of 1/d, in which order m has the frequency m; f.y in units of σ.
        let sigma = period_um * self.sigma_per_um;
        let (frequency_x, offset_y) = (pair.u * periods, pair.v * periods / sigma);
        if offset_y.abs() >= GAUSSIAN_REACH {
            return Ok(0.0);
        }
        // Cosine along the grooves, −ky/k, common to the incident wave and the order once both directions are moved.
        let y = 0.5 * (wi[1] - wo[1]);
        let t = periods * ((1.0 - y) * (1.0 + y)).sqrt();
        check_size(&self.profile, &medium_at(self.index.as_ref(), wavelength_nm)?, wavelength_nm, y.abs())?;
        let mut sum = 0.0;
        let (first, last) = (frequency_x - GAUSSIAN_REACH * sigma, frequency_x + GAUSSIAN_REACH * sigma);
        for m in first.ceil() as i32..=last.floor() as i32 {
            // Both directions are moved by half of the distance to order m, so that the order leaves exactly. The wave
            // numbers of incident and outgoing wave, a and a + m, then have the sum (wo.x − wi.x)·d/λ.
            let a = 0.5 * ((wo[0] - wi[0]) * periods - f64::from(m));
            if a.abs() < t && (a + f64::from(m)).abs() < t {
                let offset_x = (frequency_x - f64::from(m)) / sigma;
                sum += (-0.5 * offset_x * offset_x).exp() * self.efficiency(t, a, m, wavelength_nm)?;
            }
        }
        // K(f − f_m)/λ² without the Gaussian along x: `periods/sigma` is 1/λσ.
        let scale = (periods / sigma).powi(2) / TAU * (-0.5 * offset_y * offset_y).exp();
        Ok(sum * scale)
    }

    /// [`ExactGrating::eval`] at a body that transmits, for directions on either side: the power per solid angle of
    /// light from wi to wo, over |wo.z|.
    ///
    /// # Errors
    /// The errors of [`ExactGrating::eval`].
    fn eval_at_body(&self, body: TransparentBody, wi: Vec3, wo: Vec3, nm: f64) -> Result<f64, GratingError> {
        // Directions along the horizon and directions that are not finite carry no light.
        if [wi, wo].iter().any(|w| w[2] == 0.0 || w.iter().any(|c| !c.is_finite())) {
            return Ok(0.0);
        }
        let sides = [wi, wo].map(|w| if w[2] > 0.0 { Side::Above } else { Side::Below });
        // Refractive indices of the media of wi and wo. Behind a film light is in air.
        let is_inside = |side: Side| side == Side::Below && !body.is_film;
        let indices = sides.map(|side| if is_inside(side) { body.eta } else { 1.0 });
        // Wave vectors along wi and wo, over the wave number in vacuum.
        let [ki, ko] = [0, 1].map(|i| [wi, wo][i].map(|c| c * indices[i]));
        let period_um = self.profile.period_um();
        let (periods, sigma) = (1e3 * period_um / nm, period_um * self.sigma_per_um);
        let (frequency_x, offset_y) = ((ki[0] + ko[0]) * periods, (ki[1] + ko[1]) * periods / sigma);
        if offset_y.abs() >= GAUSSIAN_REACH {
            return Ok(0.0);
        }
        // −ky/k, as in `eval`.
        let y = 0.5 * (ki[1] - ko[1]);
        // Bounds of |a| and |a + m| for waves that propagate in the media of wi and wo.
        let bounds = indices.map(|index| periods * (index * index - y * y).max(0.0).sqrt());
        let tm = periods * (body.eta * body.eta - y * y).max(0.0).sqrt();
        // |ky|/k exceeds 1 for light in the medium that is totally reflected. The check accepts at most 1, where it
        // counts at least as many propagating waves.
        check_size(&self.profile, &medium_at(self.index.as_ref(), nm)?, nm, y.abs().min(1.0))?;
        let mut sum = 0.0;
        let (first, last) = (frequency_x - GAUSSIAN_REACH * sigma, frequency_x + GAUSSIAN_REACH * sigma);
        for m in first.ceil() as i32..=last.floor() as i32 {
            // Both directions are moved, as in `eval`.
            let a = 0.5 * ((ko[0] - ki[0]) * periods - f64::from(m));
            if a.abs() < bounds[0] && (a + f64::from(m)).abs() < bounds[1] {
                let offset_x = (frequency_x - f64::from(m)) / sigma;
                let [from, to] = [(sides[0], 0), (sides[1], m)].map(|(side, order)| Channel { side, order });
                sum += (-0.5 * offset_x * offset_x).exp() * self.efficiency_at_body(body, tm, a, nm, [to, from])?;
            }
        }
        // As in `eval`, with the factor n² of the outgoing medium (`lobe.rs`).
        let scale = (periods / sigma * indices[1]).powi(2) / TAU * (-0.5 * offset_y * offset_y).exp();
        Ok(sum * scale)
    }

    /// Unpolarised efficiency of light between two channels (orders on a side of the relief), `[to, from]`, for the
    /// incident wave with these `tm` and `a`. At a film, light below has also passed the flat side.
    ///
    /// # Errors
    /// The errors of [`ExactGrating::efficiency`].
    fn efficiency_at_body(
        &self,
        body: TransparentBody,
        tm: f64,
        a: f64,
        nm: f64,
        [to, from]: [Channel; 2],
    ) -> Result<f64, GratingError> {
        self.on_first_balanced(tm, a, nm, |mesh| {
            let scattering = mesh.air_above(tm, a, body.eta, nm)?.scatter(body.eta, nm)?;
            let efficiency =
                if body.is_film { scattering.film_efficiency(to, from) } else { scattering.efficiency(to, from) };
            Ok((efficiency, scattering.balance_error()))
        })
    }

    /// Unpolarised efficiency of order `m` for the incident wave with these `t` and `a`, at a wavelength in nm.
    ///
    /// # Errors
    /// An index or wavelength that the solver refuses, and a power balance that does not hold after [`DOUBLINGS`].
    fn efficiency(&self, t: f64, a: f64, m: i32, nm: f64) -> Result<f64, GratingError> {
        let medium = medium_at(self.index.as_ref(), nm)?;
        self.on_first_balanced(t, a, nm, |mesh| {
            let amplitudes = mesh.air(t, a)?.solve(&medium, nm)?;
            Ok((amplitudes.efficiency(m, 0), amplitudes.balance_error()))
        })
    }

    /// The efficiency on the first mesh (set of nodes on the profile) whose power balance holds to [`CHECK_TOLERANCE`].
    /// `solve` returns the efficiency on a mesh, and the error of the balance. `t` (or tm) and `a` only describe a
    /// failure.
    ///
    /// # Errors
    /// The errors of [`ExactGrating::efficiency`].
    fn on_first_balanced(
        &self,
        t: f64,
        a: f64,
        nm: f64,
        solve: impl Fn(&Discretisation) -> Result<(f64, f64), sunbeam_rigorous::Error>,
    ) -> Result<f64, GratingError> {
        let mut resolution = Resolution::new(&self.profile, &medium_at(self.index.as_ref(), nm)?, nm)?;
        // Values of the last attempt, for the error.
        let (mut nodes, mut balance) = (0, 0.0);
        for _ in 0..=DOUBLINGS {
            let mesh = Discretisation::new(&self.profile, resolution)?;
            let efficiency;
            (efficiency, balance) = solve(&mesh)?;
            nodes = mesh.nodes();
            if balance <= CHECK_TOLERANCE {
                return Ok(efficiency);
            }
            resolution.nodes *= 2;
        }
        // The message's b is the wave number of any order, such as that of the incident wave, order 0.
        Err(GratingError::Unbalanced { t, b: a, wavelength_nm: nm, nodes, balance })
    }
}
