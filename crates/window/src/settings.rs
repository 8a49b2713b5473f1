//! The settings that users change in the window, and the recipe of the method that follows from them.
//!
//! A *method* evaluates the reflectance of the relief on the GPU (docs/realtime.md). Its tables are built from a
//! recipe, which may take seconds. Factors that do not depend on the relief are the *optics*: refractive index, cover,
//! obliquity and shadowing. They are options of the shader, which changes at once. A *cover* is a flat clear layer over
//! the relief. The model *ensemble* is the mean over all positions of the coherence window on the relief, the model
//! *patch* has one position (docs/model.md#coherence).

use super::sun::Sun;
use std::time::Instant;
use sunbeam::cache::Cache;
use sunbeam::config::{BODY_ETA, ObliquityChoice, SurfaceConfig, Theory};
use sunbeam::methods::{Method, MethodKind, MethodOptions};
use sunbeam::scattering::{ComplexIndex, SpectralIndex, Transmission};
use sunbeam::table::{Model, Progress, Tiling};
use sunbeam_realtime::{GpuError, KERATIN, Optics, Orbit, View};

/// All choices of the user.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Settings {
    /// The surface. [`Settings::index`] replaces its refractive index.
    pub surface: SurfaceConfig,
    /// The method.
    pub kind: MethodKind,
    /// Options of the method.
    pub options: MethodOptions,
    /// The refractive index; `None` is a perfect conductor, which reflects all light.
    pub index: Option<ComplexIndex>,
    /// The view. [`Settings::orbit`] and [`Settings::sun`] replace its camera and light.
    pub view: View,
    /// The camera.
    pub orbit: Orbit,
    /// The sun.
    pub sun: Sun,
    /// Stops by which the picture is brightened: the factor on the radiance is `2^exposure`.
    pub exposure: f64,
    /// Pixels of the picture for each pixel of the window, along each side.
    pub scale: f32,
    /// Storage of tables between runs.
    pub cache: Cache,
}

impl Settings {
    /// The factors of the reflectance besides the relief's: index, cover, obliquity factor and shadowing.
    pub(crate) fn optics(&self) -> Optics {
        let obliquity = self.surface.obliquity.resolved(self.index.map(SpectralIndex::Constant).as_ref());
        Optics { index: self.index, cover: self.surface.cover(), obliquity, shadowing: self.surface.shadowing }
    }

    /// Whether the mesh is a film, which reflects and transmits.
    pub(crate) fn is_film(&self) -> bool {
        self.surface.transmission == Transmission::Film
    }

    /// Makes the mesh a film of the refractive index, or a surface that only reflects. A film's index is clamped to the
    /// accepted range, and its absorption is dropped; a perfect conductor becomes keratin. Cover, theory, obliquity and
    /// shadowing are reset, because a film excludes other values.
    pub(crate) fn set_film(&mut self, is_film: bool) {
        if is_film == self.is_film() {
            return;
        }
        self.surface.transmission = if is_film { Transmission::Film } else { Transmission::None };
        if is_film {
            let eta = self.index.map_or(KERATIN.eta, |index| index.eta.clamp(*BODY_ETA.start(), *BODY_ETA.end()));
            self.index = Some(ComplexIndex { eta, k: 0.0 });
            (self.surface.cover_eta, self.surface.theory) = (None, Theory::Scalar);
            (self.surface.obliquity, self.surface.shadowing) = (ObliquityChoice::default(), false);
        }
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
        // A grating by Maxwell's equations contains its refractive index and conserves energy by itself, so
        // `conserve_energy` stays unset. Scalar tables of ensembles conserve energy on request; then their albedo, and
        // so their recipe, depends on the optics. Recipes of other scalar methods leave out obliquity, shadowing and
        // index, so that a change of these builds nothing. Only the index of a film, below, stays.
        let is_rigorous = self.surface.theory == Theory::Rigorous;
        let conserves = !is_rigorous
            && self.surface.conserve_energy == Some(true)
            && self.kind == MethodKind::Table
            && self.surface.model == Model::Ensemble;
        let mut surface = self.surface.clone();
        surface.conserve_energy = (!is_rigorous).then_some(conserves);
        if !conserves {
            (surface.obliquity, surface.shadowing) = (ObliquityChoice::default(), false);
        }
        let index = self.index.filter(|_| is_rigorous || conserves);
        if self.is_film() {
            // Wavelengths in the film are λ/η, so its tables are those of the relief magnified η times.
            (surface.eta, surface.k) = (self.index.map(|index| index.eta), None);
        }
        // The published methods support only the model patch on a tile that repeats. The rigorous theory refuses these
        // methods when built.
        if self.kind.is_patch_only() && !is_rigorous {
            (surface.model, surface.tiling) = (Model::Patch, Some(Tiling::Periodic));
        }
        Recipe { surface, kind: self.kind, options: self.options.clone(), index, cache: self.cache.clone() }
    }
}

/// All inputs of building a method. The window builds a method again when its recipe changes.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Recipe {
    /// The surface. Obliquity and shadowing have their defaults unless the method conserves energy by a table.
    surface: SurfaceConfig,
    kind: MethodKind,
    options: MethodOptions,
    /// The refractive index of a grating by Maxwell's equations, or of a table that conserves energy. `None` for a
    /// perfect conductor, and for other methods. Of their data only those of a film depend on it, by `surface.eta`.
    index: Option<ComplexIndex>,
    cache: Cache,
}

/// A method and the time of building it.
pub(crate) struct Built {
    /// The method.
    pub method: Box<dyn Method>,
    /// Time of building in seconds.
    pub seconds: f64,
}

impl Recipe {
    /// Builds the method, which may take seconds. The error is a line of text.
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

#[cfg(test)]
mod tests {
    use super::*;
    use sunbeam::height_field::Preset;
    use sunbeam::methods::AnswerKind;

    /// Settings of the method `table` for a sinusoidal relief of aluminium.
    fn table_settings() -> Settings {
        let view = View::default();
        Settings {
            surface: SurfaceConfig {
                preset: Some(Preset::Sinusoidal),
                coherence_length: 10.0,
                ..SurfaceConfig::default()
            },
            kind: MethodKind::Table,
            options: MethodOptions { resolution: 0.5, ..MethodOptions::default() },
            index: Some(ComplexIndex { eta: 0.9, k: 6.7 }),
            view,
            orbit: Orbit::from(&view.camera),
            sun: Sun::from(&view.light),
            exposure: 0.0,
            scale: 1.0,
            cache: Cache::off(),
        }
    }

    /// Among scalar methods, only tables that conserve energy depend on the optics.
    #[test]
    fn tables_conserve_energy_on_request() {
        let with = |conserve_energy, shadowing, kind| {
            let mut settings = Settings { kind, ..table_settings() };
            (settings.surface.conserve_energy, settings.surface.shadowing) = (conserve_energy, shadowing);
            settings.recipe()
        };
        for kind in [MethodKind::Table, MethodKind::Flss] {
            assert!(with(None, true, kind) == with(Some(false), false, kind));
            assert_eq!(with(Some(true), false, kind) != with(None, false, kind), kind == MethodKind::Table);
            assert_eq!(with(Some(true), true, kind) != with(Some(true), false, kind), kind == MethodKind::Table);
        }
        with(Some(true), true, MethodKind::Table).build().unwrap();
    }

    #[test]
    fn a_film_has_the_index_of_the_window_and_no_cover() {
        let mut settings = table_settings();
        (settings.surface.cover_eta, settings.surface.shadowing) = (Some(1.4), true);
        let opaque = settings.recipe();
        settings.set_film(true);
        // The smallest index of a film, instead of a metal's.
        assert_eq!(settings.index, Some(ComplexIndex { eta: *BODY_ETA.start(), k: 0.0 }));
        settings.index = Some(ComplexIndex { eta: 1.5, k: 0.0 });
        let built = settings.recipe().build().unwrap();
        assert_eq!(built.method.answers(), AnswerKind::Film { eta: 1.5 });
        let flss = Settings { kind: MethodKind::Flss, ..settings.clone() }.recipe();
        assert!(flss.build().err().unwrap().contains("the method table knows it"));
        settings.set_film(false);
        assert!(settings.recipe() != opaque && !settings.is_film());
        assert_eq!(settings.recipe().build().unwrap().method.answers(), AnswerKind::Relief);
    }
}
