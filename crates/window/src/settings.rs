use super::sun::Sun;
use std::time::Instant;
use sunbeam::config::{ObliquityChoice, SurfaceConfig};
use sunbeam::methods::{Method, MethodKind, MethodOptions, build};
use sunbeam::reflectance::{ComplexIndex, SpectralIndex};
use sunbeam::table::{Model, Tiling};
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
        // Optics are the shader's: changing them builds nothing.
        let mut surface = SurfaceConfig {
            obliquity: ObliquityChoice::default(),
            shadowing: false,
            conserve_energy: Some(false),
            ..self.surface.clone()
        };
        if self.kind.is_patch_only() {
            (surface.model, surface.tiling) = (Model::Patch, Some(Tiling::Periodic));
        }
        Recipe { surface, kind: self.kind, options: self.options.clone() }
    }
}

/// What a method is built from.
#[derive(Clone, Debug, PartialEq)]
pub struct Recipe {
    surface: SurfaceConfig,
    kind: MethodKind,
    options: MethodOptions,
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
        let field = self.surface.height_field().map_err(|error| error.to_string())?;
        let options = self.surface.options();
        let method = build(self.kind, &field, &options, &self.options).map_err(|error| error.to_string())?;
        Ok(Built { method, seconds: start.elapsed().as_secs_f64() })
    }

    /// The method's name.
    pub fn name(&self) -> &'static str {
        self.kind.name()
    }
}
