//! The surface that a configuration builds, by either theory, with the interface's factor included in its values.

use crate::cache::Origin;
use crate::grating::{GratingReport, GratingSurface};
use crate::lobe::{Answer, Surface, SurfaceReport};
use crate::scattering::{ComplexIndex, Pair, Vec3};
use serde::Serialize;
use std::sync::Arc;

/// A surface at wavelengths by one of the theories, with the material's reflectance.
///
/// ```
/// use sunbeam::table::Progress;
/// use sunbeam::{Cache, SurfaceConfig};
///
/// let json = r#"{"preset": "sinusoidal", "coherence_length": 20, "conserve_energy": false, "eta": 1.5}"#;
/// let (surface, _) = SurfaceConfig::from_json(json)?.build_by_theory(&Cache::off(), &Progress::none())?;
///
/// let normal = [0.0, 0.0, 1.0];
/// surface.eval(normal, normal, &[450.0, 650.0], |_, f| assert!(f > 0.0));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub enum BuiltSurface {
    /// A phase screen, whose values leave the interface's factor out, and the index of the material for that factor.
    /// `None` reflects everything.
    Scalar(Box<Surface>, Option<ComplexIndex>),
    /// A grating by Maxwell's equations, whose values include the material. This process shares it among its users.
    Rigorous(Arc<(GratingSurface, Origin)>),
}

/// Build time, memory and measured error, by theory. Serialises as the report alone.
#[derive(Serialize)]
#[serde(untagged)]
#[allow(missing_docs, reason = "the reports document the fields")]
pub enum BuiltReport<'a> {
    Scalar(&'a SurfaceReport),
    Rigorous(&'a GratingReport),
}

impl BuiltSurface {
    /// [`BuiltSurface::Scalar`] of an unboxed surface.
    pub(super) fn scalar(surface: Surface, index: Option<ComplexIndex>) -> Self {
        Self::Scalar(Box::new(surface), index)
    }

    /// Build time, memory and measured error.
    pub fn report(&self) -> BuiltReport<'_> {
        match self {
            Self::Scalar(surface, _) => BuiltReport::Scalar(surface.report()),
            Self::Rigorous(built) => BuiltReport::Rigorous(built.0.report()),
        }
    }

    /// The interface's factor between two directions ([`Pair::interface`]); 0 unless both lie above the surface. For
    /// gratings, whose values include the material, it is always 1.
    fn interface(&self, wi: Vec3, wo: Vec3) -> f64 {
        match self {
            Self::Scalar(surface, index) => {
                Pair::new(wi, wo).map_or(0.0, |pair| pair.interface(*index, surface.options().obliquity))
            }
            Self::Rigorous(_) => 1.0,
        }
    }

    /// Calls `each(k, f_r)` for every wavelength in turn. `k` is its position in `wavelengths_nm`; `f_r` is in 1/sr and
    /// leaves out the cosine. `f_r` is 0 unless both directions lie above the surface and the wavelength within the
    /// tables' range.
    pub fn eval(&self, wi: Vec3, wo: Vec3, wavelengths_nm: &[f64], mut each: impl FnMut(usize, f64)) {
        let interface = self.interface(wi, wo);
        for (k, &nm) in wavelengths_nm.iter().enumerate() {
            let f = match self {
                Self::Scalar(surface, _) => surface.eval(wi, wo, nm),
                Self::Rigorous(built) => built.0.eval(wi, wo, nm),
            };
            each(k, interface * f);
        }
    }

    /// [`BuiltSurface::eval`]; also returns the density of [`BuiltSurface::sample_direction`] in 1/sr, the mean over
    /// the wavelengths.
    pub fn eval_pdf(&self, wi: Vec3, wo: Vec3, wavelengths_nm: &[f64], mut each: impl FnMut(usize, f64)) -> f64 {
        let interface = self.interface(wi, wo);
        let mut density = 0.0;
        for (k, &nm) in wavelengths_nm.iter().enumerate() {
            let Answer { f, pdf } = match self {
                Self::Scalar(surface, _) => surface.eval_pdf(wi, wo, nm),
                Self::Rigorous(built) => built.0.eval_pdf(wi, wo, nm),
            };
            density += pdf;
            each(k, interface * f);
        }
        density / wavelengths_nm.len().max(1) as f64
    }

    /// Draws a unit vector for the wavelengths carried from three random numbers in [0, 1). `None` where `wi` or the
    /// drawn direction lies below the horizon, and without a wavelength.
    pub fn sample_direction(&self, wi: Vec3, wavelengths_nm: &[f64], u: [f64; 3]) -> Option<Vec3> {
        match self {
            Self::Scalar(surface, _) => surface.sample_direction(wi, wavelengths_nm, u),
            Self::Rigorous(built) => built.0.sample_direction(wi, wavelengths_nm, u),
        }
    }
}
