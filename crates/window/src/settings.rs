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
pub struct Settings {
    pub surface: SurfaceConfig,
    pub kind: MethodKind,
    pub options: MethodOptions,
    /// The refractive index; `None` reflects everything.
    pub index: Option<ComplexIndex>,
    /// All but camera and light, which [`Settings::orbit`] and [`Settings::sun`] stand for.
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
    pub fn optics(&self) -> Optics {
        let obliquity = self.surface.obliquity.resolved(self.index.map(SpectralIndex::Constant).as_ref());
        Optics { index: self.index, obliquity, shadowing: self.surface.shadowing }
    }

    /// What the renderer draws.
    ///
    /// # Errors
    /// As [`Sun::light`].
    pub fn view(&self) -> Result<View, GpuError> {
        Ok(View { camera: self.orbit.camera(), light: self.sun.light()?, ..self.view })
    }

    /// What the method has to be built from.
    pub fn recipe(&self) -> Recipe {
        // Optics are the shader's: changing them builds nothing. A grating by Maxwell's equations has its own, and keeps energy.
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

/// What a method is built from.
#[derive(Clone, Debug, PartialEq)]
pub struct Recipe {
    surface: SurfaceConfig,
    kind: MethodKind,
    options: MethodOptions,
    /// Where it is part of what is built.
    index: Option<ComplexIndex>,
    cache: Cache,
}

/// A method and the seconds it took.
pub struct Built {
    pub method: Box<dyn Method>,
    pub seconds: f64,
}

impl Recipe {
    /// Makes the method, which may take long.
    pub fn build(&self) -> Result<Built, String> {
        let start = Instant::now();
        let index = self.index.map(SpectralIndex::Constant);
        let built = self.surface.build_method(self.kind, &self.options, index.as_ref(), &self.cache, &Progress::none());
        let method = built.map_err(|error| error.to_string())?;
        Ok(Built { method, seconds: start.elapsed().as_secs_f64() })
    }

    /// The method's name.
    pub fn name(&self) -> &'static str {
        self.kind.name()
    }
}
