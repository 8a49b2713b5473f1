//! The realtime method that a configuration describes, by either theory.
//!
//! A method ([`Method`]) is an algorithm of the realtime renderer. Its *answer* is the colour, or the value at a
//! wavelength, for a pair of directions.

use super::{BuildError, SurfaceConfig, Theory};
use crate::cache::{Cache, Origin};
use crate::grating::GratingColourSurface;
use crate::methods::{self, AnswerKind, Method, MethodError, MethodKind, MethodOptions, MethodShader};
use crate::scattering::SpectralIndex;
use crate::table::Progress;
use std::sync::Arc;

/// The method of a grating that several users in this process may share. The [`Origin`] of its tables comes with them
/// from the cache and is not used.
struct SharedGrating(Arc<(GratingColourSurface, Origin)>);

impl Method for SharedGrating {
    fn answer_rgb(&self, wi: [f32; 3], wo: [f32; 3]) -> [f32; 3] {
        self.0.0.answer_rgb(wi, wo)
    }

    fn answer_spectral(&self, wi: [f32; 3], wo: [f32; 3], wavelength_nm: f32) -> Option<f32> {
        self.0.0.answer_spectral(wi, wo, wavelength_nm)
    }

    fn answers(&self) -> AnswerKind {
        self.0.0.answers()
    }

    fn shader(&self) -> MethodShader<'_> {
        self.0.0.shader()
    }
}

impl SurfaceConfig {
    /// A realtime method by the configuration's theory. The scalar theory has all kinds of methods, and builds them
    /// without the cache. The rigorous theory has [`MethodKind::Table`] only, whose tables come from `cache`.
    ///
    /// `index` replaces the configuration's index of the material; `None` reflects everything. A film keeps the
    /// configuration's own index. Under a cover, the method takes directions inside the cover, to which the caller
    /// refracts directions outside.
    ///
    /// Answers of the rigorous theory include the material's reflectance. For the scalar theory, [`Method::answers`]
    /// tells whether they do, or leave this factor to the caller ([`AnswerKind::Relief`]).
    ///
    /// # Errors
    /// A kind that the theory does not have, transmission with the rigorous theory, and the errors of
    /// [`methods::build`] and [`SurfaceConfig::build_shared_grating_colours`].
    pub fn build_method(
        &self,
        kind: MethodKind,
        options: &MethodOptions,
        index: Option<&SpectralIndex>,
        cache: &Cache,
        progress: &Progress,
    ) -> Result<Box<dyn Method>, BuildError> {
        match (self.theory, kind) {
            (Theory::Scalar, _) => {
                // Methods take λ in air. Inside a cover or film of index n it is λ/n, so the relief is magnified by n.
                let (field, surface_options) = (self.height_field_inside()?, self.options_for(index));
                Ok(methods::build_watched(kind, &field, &surface_options, options, progress)?)
            }
            (Theory::Rigorous, MethodKind::Table) => {
                // The shader of gratings reads tables of one side only.
                self.refuse_transmission("realtime methods of the rigorous theory")?;
                Ok(Box::new(SharedGrating(self.build_shared_grating_colours(index, cache, progress)?)))
            }
            (Theory::Rigorous, _) => {
                let (method, found, accepted) = (kind.name(), Theory::Rigorous.name(), Theory::Scalar.name());
                Err(MethodError::Unsupported { method, parameter: "theory", found, accepted }.into())
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lobe::{LinearSrgb, Lobe};
    use crate::scattering::ComplexIndex;

    #[test]
    fn only_the_table_supports_the_rigorous_theory() {
        let json = r#"{"preset":"flat","theory":"rigorous","eta":1.0,"k":6.9}"#;
        let config = SurfaceConfig::from_json(json).unwrap();
        let build = |config: &SurfaceConfig, kind, index: Option<&SpectralIndex>| {
            config.build_method(kind, &MethodOptions::default(), index, &Cache::off(), &Progress::none())
        };
        // All methods but the table.
        for kind in MethodKind::ALL.into_iter().filter(|kind| kind.is_patch_only()) {
            let refused = build(&config, kind, None).err().unwrap().to_string();
            assert_eq!(refused, format!("the method {kind} does not know theory = rigorous, only scalar"));
        }
        let film = r#"{"preset":"blazed","theory":"rigorous","transmission":"film","eta":1.5}"#;
        let refused = build(&SurfaceConfig::from_json(film).unwrap(), MethodKind::Table, None).err().unwrap();
        assert!(refused.to_string().contains("transmission"), "{refused}");
        // The method returns the colours of the surface, with the material's reflectance. Beside the mirror direction
        // they are large.
        let aluminium = SpectralIndex::Constant(ComplexIndex { eta: 1.0, k: 6.9 });
        let (wi, wo) = ([0.3, 0.0, 0.91f32.sqrt()], [-0.3, 0.002, (0.91f32 - 4e-6).sqrt()]);
        let method = build(&config, MethodKind::Table, Some(&aluminium)).unwrap();
        assert_eq!(method.answers(), AnswerKind::Reflectance);
        assert_eq!(method.answer_spectral(wi, wo, 550.0), None);
        let colours = config.build_shared_grating_colours(Some(&aluminium), &Cache::off(), &Progress::none()).unwrap();
        assert_eq!(method.answer_rgb(wi, wo), colours.0.lobe::<f32>().eval(wi, wo, LinearSrgb, true));
        assert!(method.answer_rgb(wi, wo)[1] > 1.0);
        let scalar = SurfaceConfig { theory: Theory::Scalar, ..config };
        assert_eq!(build(&scalar, MethodKind::Table, None).unwrap().answers(), AnswerKind::Relief);
    }
}
