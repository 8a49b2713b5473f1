//! The orders of a relief that varies along x alone, by the scalar theory.
//!
//! Light comes from air, and order m leaves in a medium of index n. The direction wo of the order follows from the
//! grating equation, `wi.x + n·wo.x = m·λ/period` and `wi.y + n·wo.y = 0`, with `wi` towards the light. The power of
//! the order is `|c_m|²`, with its amplitude `c_m` in the Fourier transform of the phase screen exp(iκh): h is the
//! height, and the phase rate κ the phase per height in rad/µm.

use sunbeam::config::{BuildError, SurfaceConfig};
use sunbeam::scattering::Vec3;
use sunbeam::transform::OrderTransform;

/// The phase screen of a relief, and its grating equation at one wavelength.
pub(super) struct Screen {
    transform: OrderTransform,
    /// Number of pixels along x, which is the number of orders in a row of the transform.
    bins: i32,
    /// λ/period, with the vacuum wavelength λ.
    step: f64,
    /// Width of the tile along x.
    pub(super) period_um: f64,
    pub(super) wavelength_um: f64,
}

impl Screen {
    /// The screen of the configuration's relief.
    ///
    /// # Errors
    /// A relief that cannot be read or that varies along y.
    pub(super) fn new(config: &SurfaceConfig, wavelength_nm: f64) -> Result<Self, BuildError> {
        // Only the check of the profile is needed: it refuses reliefs that vary along y.
        config.profile()?;
        let field = config.height_field()?;
        let (period_um, wavelength_um) = (field.extent_um().0, wavelength_nm * 1e-3);
        let transform = OrderTransform::new(&field);
        let bins = transform.size().0 as i32;
        Ok(Self { transform, bins, step: wavelength_um / period_um, period_um, wavelength_um })
    }

    /// The orders m with `|n·wo.x| ≤ n` that the pixels resolve, by ascending number, with the tangential components x
    /// and y of `n·wo`. `index` is n, that of the medium in which the orders leave. Where wi.y is not 0, the outermost
    /// orders may still be evanescent.
    pub(super) fn orders(&self, wi: Vec3, index: f64) -> impl Iterator<Item = (i32, [f64; 2])> {
        let (step, bins) = (self.step, self.bins);
        let (first, last) = (((wi[0] - index) / step).ceil() as i32, ((wi[0] + index) / step).floor() as i32);
        // A row of `bins` pixels, at least one, resolves |m| < bins/2.
        let is_resolved = move |m: &i32| 2 * m.abs() < bins;
        (first..=last).filter(is_resolved).map(move |m| (m, [f64::from(m) * step - wi[0], -wi[1]]))
    }

    /// The number of the order whose scattering vector has this x component, in units of the vacuum wave number 2π/λ.
    pub(super) fn number(&self, tangential_x: f64) -> i32 {
        (tangential_x / self.step).round() as i32
    }

    /// `|c_m|²` at the phase rate `kappa`. The phase rate depends on the order's direction, so each order needs its own
    /// transform.
    pub(super) fn power(&self, m: i32, kappa: f64) -> f64 {
        // The first row of the transform has the orders along x, negative ones in its upper half.
        self.transform.amplitudes(kappa)[m.rem_euclid(self.bins) as usize].norm_sqr()
    }
}
