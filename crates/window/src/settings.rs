use super::sun::Sun;
use std::time::Instant;
use sunbeam::cache::Cache;
use sunbeam::config::{ObliquityChoice, SurfaceConfig, Theory};
use sunbeam::methods::{Method, MethodKind, MethodOptions};
use sunbeam::scattering::{ComplexIndex, SpectralIndex};
use sunbeam::table::{Model, Progress, Tiling};
use sunbeam_realtime::{GpuError, Optics, Orbit, View};

/// Everything that users choose.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Settings {
    pub surface: SurfaceConfig,
    pub kind: MethodKind,
    pub options: MethodOptions,
    /// The refractive index; `None` reflects everything.
    pub index: Option<ComplexIndex>,
    /// The view, whose camera and light are those of [`Settings::orbit`] and [`Settings::sun`].
    pub view: View,
    pub orbit: Orbit,
    pub sun: Sun,
    /// Stops by which the picture is brightened.
    pub exposure: f64,
    /// Pixels of the picture for each pixel of the window, along each side.
    pub scale: f32,
    /// Where tables are kept.
    pub cache: Cache,
}

impl Settings {
    /// The optics around the relief.
    pub(crate) fn optics(&self) -> Optics {
        let obliquity = self.surface.obliquity.resolved(self.index.map(SpectralIndex::Constant).as_ref());
        Optics { index: self.index, obliquity, shadowing: self.surface.shadowing }
    }

    /// The view for the renderer.
    ///
    /// # Errors
    /// The errors of [`Sun::light`].
    pub(crate) fn view(&self) -> Result<View, GpuError> {
        Ok(View { camera: self.orbit.camera(), light: self.sun.light()?, ..self.view })
    }

    /// The recipe of the method.
    pub(crate) fn recipe(&self) -> Recipe {
        // The shader has the optics, so a change of them builds nothing. A grating by Maxwell's equations contains its
        // optics and conserves energy.
        let rigorous = self.surface.theory == Theory::Rigorous;
        let mut surface = SurfaceConfig {
            obliquity: ObliquityChoice::default(),
            shadowing: false,
            conserve_energy: (!rigorous).then_some(false),
            ..self.surface.clone()
        };
        let index = self.index.filter(|_| rigorous);
        if self.kind.is_patch_only() && !rigorous {
            (surface.model, surface.tiling) = (Model::Patch, Some(Tiling::Periodic));
        }
        Recipe { surface, kind: self.kind, options: self.options.clone(), index, cache: self.cache.clone() }
    }
}

/// Everything that a method is built from.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Recipe {
    surface: SurfaceConfig,
    kind: MethodKind,
    options: MethodOptions,
    /// The refractive index, where the method contains it.
    index: Option<ComplexIndex>,
    cache: Cache,
}

/// A method and the seconds it took.
pub(crate) struct Built {
    pub method: Box<dyn Method>,
    pub seconds: f64,
}

impl Recipe {
    /// Builds the method, which may take seconds.
    pub(crate) fn build(&self) -> Result<Built, String> {
        let start = Instant::now();
        let index = self.index.map(SpectralIndex::Constant);
        let built = self.surface.build_method(self.kind, &self.options, index.as_ref(), &self.cache, &Progress::none());
        let method = built.map_err(|error| error.to_string())?;
        Ok(Built { method, seconds: start.elapsed().as_secs_f64() })
    }

    /// The method's name.
    pub(crate) fn name(&self) -> &'static str {
        self.kind.name()
    }
}
