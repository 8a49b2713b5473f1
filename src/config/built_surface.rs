//! The surface that a configuration builds, by either theory: a phase screen, or a grating by Maxwell's equations.
//! Values of the surface include the interface's factor: the Fresnel reflectance, or the small-slope factor
//! ([`Pair::interface`]).

use crate::cache::Origin;
use crate::grating::{GratingReport, GratingSurface};
use crate::lobe::{Answer, Surface, SurfaceReport};
use crate::scattering::{ComplexIndex, Cover, Inside, Pair, Vec3};
use serde::Serialize;
use std::sync::Arc;

/// A surface by one of the theories, evaluated at wavelengths in nm, with the material's reflectance.
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
pub struct BuiltSurface {
    tables: Tables,
    /// The cover, a flat clear layer over the relief. Tables take directions inside the cover. `None` for a bare
    /// surface, such as every surface that transmits.
    cover: Option<Cover>,
}

/// Tables of a surface by one of the theories.
enum Tables {
    /// A phase screen, and the refractive index of the material relative to the cover's; `None` reflects everything.
    /// Values of the tables leave out the interface's factor, for which the index is needed. Only values of a body that
    /// transmits include it.
    Scalar(Box<Surface>, Option<ComplexIndex>),
    /// A grating by Maxwell's equations, whose values include the material's reflectance, and whether its tables came
    /// from the cache. Other surfaces of this process may share them.
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
    /// The surface of a phase screen. `index` is the material's, relative to the cover's; bodies that transmit ignore
    /// it.
    pub(super) fn scalar(surface: Surface, index: Option<ComplexIndex>, cover: Option<Cover>) -> Self {
        Self { tables: Tables::Scalar(Box::new(surface), index), cover }
    }

    /// The surface of a grating by Maxwell's equations.
    pub(super) fn rigorous(grating: Arc<(GratingSurface, Origin)>, cover: Option<Cover>) -> Self {
        Self { tables: Tables::Rigorous(grating), cover }
    }

    /// Build time, memory and measured error.
    pub fn report(&self) -> BuiltReport<'_> {
        match &self.tables {
            Tables::Scalar(surface, _) => BuiltReport::Scalar(surface.report()),
            Tables::Rigorous(built) => BuiltReport::Rigorous(built.0.report()),
        }
    }

    /// The interface's factor between two directions inside the cover ([`Pair::interface`]). For gratings and bodies
    /// that transmit, whose values include the material, it is always 1.
    fn interface(&self, wi: Vec3, wo: Vec3) -> f64 {
        match &self.tables {
            Tables::Scalar(surface, index) if surface.options().body.is_none() => {
                // A pair exists, since callers return before where `inside` finds a direction below the surface.
                Pair::new(wi, wo).map_or(0.0, |pair| pair.interface(*index, surface.options().obliquity))
            }
            Tables::Scalar(..) | Tables::Rigorous(_) => 1.0,
        }
    }

    /// Whether the surface transmits light, so that directions below it count.
    pub fn transmits(&self) -> bool {
        match &self.tables {
            Tables::Scalar(surface, _) => surface.options().body.is_some(),
            Tables::Rigorous(built) => built.0.transmits(),
        }
    }

    /// The pair of directions by which the tables are read, inside the cover if there is one. [`Inside`] also has the
    /// factors from inside to outside: `factor` on the BSDF, `density` on the density of samples. `None` where the
    /// surface scatters nothing.
    fn inside(&self, wi: Vec3, wo: Vec3) -> Option<Inside> {
        if self.transmits() { Some(Inside::bare(wi, wo)) } else { Inside::new(self.cover, wi, wo) }
    }

    /// Calls `each(k, f)` for every wavelength in turn. `k` is the wavelength's index in `wavelengths_nm`; `f` is
    /// the BSDF in 1/sr, without the cosine, of light that arrives from `wi` and leaves along `wo`. `f` is 0 unless the
    /// wavelength lies within the tables' range and, on a surface that only reflects, both directions above it.
    pub fn eval(&self, wi: Vec3, wo: Vec3, wavelengths_nm: &[f64], mut each: impl FnMut(usize, f64)) {
        let Some(Inside { wi, wo, factor, .. }) = self.inside(wi, wo) else {
            (0..wavelengths_nm.len()).for_each(|k| each(k, 0.0));
            return;
        };
        let factor = factor * self.interface(wi, wo);
        for (k, &nm) in wavelengths_nm.iter().enumerate() {
            let f = match &self.tables {
                Tables::Scalar(surface, _) => surface.eval(wi, wo, nm),
                Tables::Rigorous(built) => built.0.eval(wi, wo, nm),
            };
            each(k, factor * f);
        }
    }

    /// [`BuiltSurface::eval`]; also returns the density of [`BuiltSurface::sample_direction`] in 1/sr, the mean over
    /// the wavelengths.
    pub fn eval_pdf(&self, wi: Vec3, wo: Vec3, wavelengths_nm: &[f64], mut each: impl FnMut(usize, f64)) -> f64 {
        let Some(Inside { wi, wo, factor, density }) = self.inside(wi, wo) else {
            (0..wavelengths_nm.len()).for_each(|k| each(k, 0.0));
            return 0.0;
        };
        let factor = factor * self.interface(wi, wo);
        let mut sum = 0.0;
        for (k, &nm) in wavelengths_nm.iter().enumerate() {
            let Answer { f, pdf } = match &self.tables {
                Tables::Scalar(surface, _) => surface.eval_pdf(wi, wo, nm),
                Tables::Rigorous(built) => built.0.eval_pdf(wi, wo, nm),
            };
            sum += pdf;
            each(k, factor * f);
        }
        density * sum / wavelengths_nm.len().max(1) as f64
    }

    /// Draws an outgoing direction, a unit vector, from three random numbers in [0, 1). Its density is that of
    /// [`BuiltSurface::eval_pdf`] for the same wavelengths.
    ///
    /// `None` without a wavelength, where the cover reflects the drawn direction totally, and on a surface that only
    /// reflects, where `wi` or the drawn direction lies below the horizon.
    pub fn sample_direction(&self, wi: Vec3, wavelengths_nm: &[f64], u: [f64; 3]) -> Option<Vec3> {
        // Only the incident direction is needed. The outgoing one may be any above the surface, such as the normal.
        let wi = self.inside(wi, [0.0, 0.0, 1.0])?.wi;
        let wo = match &self.tables {
            Tables::Scalar(surface, _) => surface.sample_direction(wi, wavelengths_nm, u),
            Tables::Rigorous(built) => built.0.sample_direction(wi, wavelengths_nm, u),
        }?;
        self.cover.map_or(Some(wo), |cover| cover.outside(wo))
    }
}
