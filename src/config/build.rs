//! Builds height fields, surfaces and gratings from a configuration.
//!
//! | result | function | shared in this process |
//! | --- | --- | --- |
//! | heights | [`SurfaceConfig::height_field`], [`SurfaceConfig::raw_height_field`] | no |
//! | profile of a grating | [`SurfaceConfig::profile`] | no |
//! | scalar surface at wavelengths, without cover or transmission | [`SurfaceConfig::build`] | no |
//! | scalar surface at wavelengths | [`SurfaceConfig::build_shared`] | yes |
//! | scalar surface in linear sRGB | [`SurfaceConfig::build_shared_colours`] | yes |
//! | grating at wavelengths | [`SurfaceConfig::build_shared_grating`] | yes |
//! | grating in linear sRGB | [`SurfaceConfig::build_shared_grating_colours`] | yes |
//! | Jones matrices of a grating | [`SurfaceConfig::build_shared_jones`] | yes |
//! | surface by the configuration's theory | [`SurfaceConfig::build_by_theory`] | gratings only |
//! | surface of heights from an array | [`SurfaceConfig::build_of`] | gratings only |
//!
//! Every build reads its tables from the [`Cache`] if they are there. The [`Origin`] in the result tells whether they
//! were. Functions with an argument `index` ignore the configuration's `eta` and `k`, except for the body of a surface
//! that transmits; `None` reflects everything.
//!
//! In a medium of index n the wavelength is λ/n. Tables are over λ, the wavelength in air. For a relief within a medium
//! they are therefore built for the relief and the coherence window magnified n times. The medium is a cover
//! ([`Cover`](crate::scattering::Cover)) or, for the scalar theory alone, the transparent body below. The solver of
//! Maxwell's equations takes the relief of a body at its own size. A grating's profile is magnified by the cover alone.
//!
//! Under a cover, indices are relative to the cover's. The functions `…_inside` return magnified lengths and relative
//! indices. Shared surfaces take directions inside the cover. Their callers convert directions and
//! reflectances by [`SurfaceConfig::cover`], as [`BuiltSurface`] does.

use super::{BuiltSurface, ConfigError, Source, SurfaceConfig, Theory};
use crate::cache::{Cache, CacheError, Origin};
use crate::colour_table::ColourTableError;
use crate::grating::{
    GratingBody, GratingColourSurface, GratingError, GratingSurface, JonesTable, Profile, preset_profile, profile_of,
};
use crate::height_field::{
    FileField, FileScale, HeightField, HeightFieldError, Level, MAX_LENGTH_UM, ReadOptions, Regions,
};
use crate::lobe::{ColourSurface, Surface};
use crate::methods::MethodError;
use crate::scattering::{ComplexIndex, Obliquity, Options, SpectralIndex};
use crate::table::{Progress, TableError, Tiling};
use std::sync::Arc;

/// Reason why a surface was not built.
#[derive(Debug, thiserror::Error)]
#[allow(missing_docs, reason = "each message describes its fields")]
pub enum BuildError {
    #[error(transparent)]
    Config(#[from] ConfigError),
    #[error(transparent)]
    HeightField(#[from] HeightFieldError),
    #[error(transparent)]
    Table(#[from] TableError),
    #[error(transparent)]
    Colours(#[from] ColourTableError),
    #[error(transparent)]
    Grating(#[from] GratingError),
    #[error(transparent)]
    Method(#[from] MethodError),
    #[error(transparent)]
    Cache(#[from] CacheError),
}

impl SurfaceConfig {
    /// The height field that the configuration names, levelled.
    ///
    /// # Errors
    /// A configuration that [`SurfaceConfig::validate`] refuses, a file that cannot be read, and heights that
    /// [`HeightField::check_size`] refuses.
    pub fn height_field(&self) -> Result<HeightField, BuildError> {
        Ok(self.raw_height_field()?.field.levelled(self.level()))
    }

    /// The height field that the configuration names, filled and resized by `scale` and `depth` but not levelled, with
    /// the interpretation of its file. Its doubts, implausible properties of the relief, are also logged as warnings.
    ///
    /// # Errors
    /// The errors of [`SurfaceConfig::height_field`].
    pub fn raw_height_field(&self) -> Result<FileField, BuildError> {
        self.raw_height_field_of(None)
    }

    /// [`SurfaceConfig::raw_height_field`] with `contents` in place of the bytes of the file that the configuration
    /// names. `None` reads the file from disk. Presets ignore `contents`.
    ///
    /// # Errors
    /// The errors of [`SurfaceConfig::height_field`].
    pub fn raw_height_field_of(&self, contents: Option<&[u8]>) -> Result<FileField, BuildError> {
        self.validate()?;
        let mut read = match self.source() {
            Source::Preset(preset) => {
                // A valid configuration has both parameters of regions or none.
                let field = match (self.region_size, self.region_spread) {
                    (Some(size_um), Some(spread)) => preset.build_in_regions(Regions::new(size_um, spread)?)?,
                    _ => preset.build(self.period, self.height)?,
                };
                FileField::without_file(field)
            }
            Source::File(path) => {
                let scale = FileScale { pixel_size_um: self.pixel_size, max_height_um: self.max_height };
                let fill = self.fill.unwrap_or_default();
                let options = ReadOptions { scale, channel: self.channel.clone(), fill };
                match contents {
                    Some(bytes) => HeightField::read_bytes(path, bytes, &options)?,
                    None => HeightField::read_with(path, &options)?,
                }
            }
        };
        read.field.check_size(MAX_LENGTH_UM)?;
        read.field = self.resized(read.field);
        if let Source::File(path) = self.source() {
            for doubt in &read.doubts {
                log::warn!("{}: {doubt}", path.display());
            }
        }
        Ok(read)
    }

    /// The height field from which scalar tables are built: magnified by the index of the cover or the body.
    ///
    /// # Errors
    /// The errors of [`SurfaceConfig::height_field`].
    pub fn height_field_inside(&self) -> Result<HeightField, BuildError> {
        Ok(self.inside(self.height_field()?))
    }

    /// A relief magnified by the index of the cover or the body, from which scalar tables are built.
    pub fn inside(&self, field: HeightField) -> HeightField {
        match (self.magnification(), self.body()) {
            // The arguments of `resized` are factors on the pattern's size and on the heights. The relief of a body of
            // index 1, that of air, has no effect, so it is flattened.
            (1.0, Some(_)) => field.resized(1.0, 0.0),
            (1.0, None) => field,
            (factor, _) => field.resized(factor, factor),
        }
    }

    /// Coherence length in µm, magnified like [`SurfaceConfig::height_field_inside`].
    pub fn coherence_length_inside(&self) -> f64 {
        self.coherence_length * self.magnification()
    }

    /// The configuration's index relative to that of the cover; `None` for a surface that reflects everything.
    pub fn index_inside(&self) -> Option<ComplexIndex> {
        self.index().map(|index| index.relative_to(self.eta_above()))
    }

    /// Refractive index of the medium above the relief: the cover, or air.
    fn eta_above(&self) -> f64 {
        self.cover_eta.unwrap_or(1.0)
    }

    /// An index relative to that of the cover.
    fn relative(&self, index: Option<&SpectralIndex>) -> Option<SpectralIndex> {
        index.map(|index| index.relative_to(self.eta_above()))
    }

    /// The relief with `scale` and `depth` applied.
    fn resized(&self, field: HeightField) -> HeightField {
        if self.scale == 1.0 && self.depth == 1.0 { field } else { field.resized(self.scale, self.depth) }
    }

    /// Options of the scalar model with the configuration's index, for the relief inside the cover. Defaults that
    /// depend on source, model and index are resolved.
    pub fn options(&self) -> Options {
        self.options_for(self.index().map(SpectralIndex::Constant).as_ref())
    }

    /// [`SurfaceConfig::options`] with `index` in place of the configuration's; `None` reflects everything.
    pub fn options_for(&self, index: Option<&SpectralIndex>) -> Options {
        let obliquity = match self.body() {
            // No other factor describes transmitted light.
            Some(_) => Obliquity::SmallSlope,
            None => self.obliquity.resolved(index),
        };
        Options {
            coherence_length_um: self.coherence_length_inside(),
            model: self.model,
            tiling: self.tiling(),
            obliquity,
            // Only the small-slope factor reads the index. Elsewhere it is left out, so that surfaces of different
            // indices share their tables.
            index: self.relative(index.filter(|_| obliquity == Obliquity::SmallSlope)),
            conserve_energy: self.conserve_energy(),
            shadowing: self.shadowing,
            // Beyond this sine of the angle with the normal, light inside the cover is totally reflected at its top.
            reach: 1.0 / self.eta_above(),
            sizes: self.sizes,
            body: self.body(),
            tolerance: self.tolerance,
            build_limit: self.build_limit,
        }
    }

    /// The bare surface at wavelengths by scalar theory, whatever `theory` says.
    ///
    /// # Errors
    /// The errors of [`SurfaceConfig::height_field`], [`ConfigError::Contradiction`] for a cover or transmission, and
    /// tables beyond the build limit.
    pub fn build(&self, cache: &Cache) -> Result<(Surface, Origin), BuildError> {
        self.build_watched(cache, &Progress::none())
    }

    /// [`SurfaceConfig::build`] with reports to `progress`.
    ///
    /// # Errors
    /// The errors of [`SurfaceConfig::build`].
    pub fn build_watched(&self, cache: &Cache, progress: &Progress) -> Result<(Surface, Origin), BuildError> {
        self.require_bare("the functions build and build_watched")?;
        Ok(cache.surface(&self.height_field()?, &self.options(), progress)?)
    }

    /// The scalar surface at wavelengths, inside the cover if there is one, with the options of
    /// [`SurfaceConfig::options_for`]. Equal surfaces of this process are shared.
    ///
    /// # Errors
    /// The errors of [`SurfaceConfig::height_field`], and tables beyond the build limit.
    pub fn build_shared(
        &self,
        index: Option<&SpectralIndex>,
        cache: &Cache,
        progress: &Progress,
    ) -> Result<Arc<(Surface, Origin)>, BuildError> {
        Ok(cache.shared_surface(&self.height_field_inside()?, &self.options_for(index), progress)?)
    }

    /// [`SurfaceConfig::build_shared`] in linear sRGB. `index` selects the obliquity factor, as there. The colours
    /// include the interface's factor for the index `fresnel`; `None` leaves the factor to the caller.
    ///
    /// # Errors
    /// The errors of [`SurfaceConfig::build_shared`].
    pub fn build_shared_colours(
        &self,
        index: Option<&SpectralIndex>,
        fresnel: Option<&SpectralIndex>,
        cache: &Cache,
        progress: &Progress,
    ) -> Result<Arc<(ColourSurface, Origin)>, BuildError> {
        // Lobes of transparent bodies apply the factor of their interface themselves.
        let fresnel = self.relative(fresnel.filter(|_| self.body().is_none()));
        let options = self.options_for(index);
        Ok(cache.shared_colours(&self.height_field_inside()?, &options, fresnel.as_ref(), progress)?)
    }

    /// The profile of a grating, from a preset or a file.
    ///
    /// # Errors
    /// The errors of [`SurfaceConfig::height_field`], and a relief that varies along y or has an unsupported profile.
    pub fn profile(&self) -> Result<Profile, BuildError> {
        self.magnified_profile(1.0)
    }

    /// The profile of a grating, magnified by the index of the cover.
    ///
    /// # Errors
    /// The errors of [`SurfaceConfig::profile`].
    pub fn profile_inside(&self) -> Result<Profile, BuildError> {
        self.magnified_profile(self.eta_above())
    }

    /// The profile, magnified by `factor`.
    fn magnified_profile(&self, factor: f64) -> Result<Profile, BuildError> {
        self.validate()?;
        // Presets of gratings have an exact profile. These levels change at most its offset, which has no effect; other
        // levels take the sampled heights. `scale` and `depth` are applied here; `height_field` applies them itself.
        if let (Source::Preset(preset), Level::None | Level::Mean) = (self.source(), self.level()) {
            if let Some((default_period_um, default_height_um)) = preset.defaults_um() {
                let period_um = self.period.unwrap_or(default_period_um) * self.scale * factor;
                let height_um = self.height.unwrap_or(default_height_um) * self.depth * factor;
                if let Some(profile) = preset_profile(preset, Some(period_um), Some(height_um))? {
                    return Ok(profile);
                }
            }
        }
        Ok(profile_of(&self.height_field()?.resized(factor, factor), self.tolerance)?)
    }

    /// The grating at wavelengths by Maxwell's equations, whatever `theory` says. Equal gratings of this process are
    /// shared.
    ///
    /// # Errors
    /// The errors of [`SurfaceConfig::profile`], errors of the solver, and a build beyond the build limit.
    pub fn build_shared_grating(
        &self,
        index: Option<&SpectralIndex>,
        cache: &Cache,
        progress: &Progress,
    ) -> Result<Arc<(GratingSurface, Origin)>, BuildError> {
        let (profile, index) = (self.profile_inside()?, self.relative(index));
        let body = self.grating_body(index.as_ref());
        Ok(cache.shared_grating(&profile, body, self.grating_coherence_um(), self.build_limit, progress)?)
    }

    /// The body that carries a grating's relief: the configuration's transparent body, or else a reflector of `index`,
    /// which is relative to the cover's.
    fn grating_body<'a>(&self, index: Option<&'a SpectralIndex>) -> GratingBody<'a> {
        match self.body() {
            None => GratingBody::Reflector(index),
            // The tables of `Interface` need total reflection, which index 1 does not have. A film serves, since its
            // light leaves into air, too.
            Some(body) if body.is_film || body.eta == 1.0 => GratingBody::Film(body.eta),
            Some(body) => GratingBody::Interface(body.eta),
        }
    }

    /// Coherence length in µm, magnified like [`SurfaceConfig::profile_inside`].
    pub fn grating_coherence_um(&self) -> f64 {
        self.coherence_length * self.eta_above()
    }

    /// [`SurfaceConfig::build_shared_grating`] in linear sRGB.
    ///
    /// # Errors
    /// The errors of [`SurfaceConfig::build_shared_grating`].
    pub fn build_shared_grating_colours(
        &self,
        index: Option<&SpectralIndex>,
        cache: &Cache,
        progress: &Progress,
    ) -> Result<Arc<(GratingColourSurface, Origin)>, BuildError> {
        let (profile, index) = (self.profile_inside()?, self.relative(index));
        let body = self.grating_body(index.as_ref());
        let coherence_um = self.grating_coherence_um();
        Ok(cache.shared_grating_colours(&profile, body, coherence_um, self.build_limit, progress)?)
    }

    /// Jones matrices of the orders of [`SurfaceConfig::build_shared_grating`].
    ///
    /// # Errors
    /// The errors of [`SurfaceConfig::build_shared_grating`].
    pub fn build_shared_jones(
        &self,
        index: Option<&SpectralIndex>,
        cache: &Cache,
        progress: &Progress,
    ) -> Result<Arc<(JonesTable, Origin)>, BuildError> {
        let index = self.relative(index);
        let body = self.grating_body(index.as_ref());
        Ok(cache.shared_jones(&self.profile_inside()?, body, self.build_limit, progress)?)
    }

    /// The surface at wavelengths by the configuration's theory and index.
    ///
    /// # Errors
    /// The errors of [`SurfaceConfig::build_shared`] and [`SurfaceConfig::build_shared_grating`].
    pub fn build_by_theory(&self, cache: &Cache, progress: &Progress) -> Result<(BuiltSurface, Origin), BuildError> {
        match self.theory {
            Theory::Scalar => {
                let (surface, origin) = cache.surface(&self.height_field_inside()?, &self.options(), progress)?;
                Ok((BuiltSurface::scalar(surface, self.index_inside(), self.cover()), origin))
            }
            Theory::Rigorous => self.build_profile(&self.profile_inside()?, cache, progress),
        }
    }

    /// The grating of a profile inside the cover by Maxwell's equations, with the configuration's own index.
    fn build_profile(
        &self,
        profile: &Profile,
        cache: &Cache,
        progress: &Progress,
    ) -> Result<(BuiltSurface, Origin), BuildError> {
        let index = self.index_inside().map(SpectralIndex::Constant);
        let body = self.grating_body(index.as_ref());
        let built = cache.shared_grating(profile, body, self.grating_coherence_um(), self.build_limit, progress)?;
        let origin = built.1.clone();
        Ok((BuiltSurface::rigorous(built, self.cover()), origin))
    }

    /// [`SurfaceConfig::build_by_theory`] with heights from an array instead of a preset or a file.
    ///
    /// `level` and `tiling` have the defaults of a file. `fill` is not applied, since `heights` has no missing points
    /// ([`HeightField::with_holes`] fills them). The rigorous theory takes the heights as one period of a grating.
    ///
    /// # Errors
    /// A configuration with parameters of presets or files, heights that [`HeightField::check_size`] refuses, and the
    /// errors of the build.
    pub fn build_of(&self, heights: &HeightField, cache: &Cache) -> Result<(BuiltSurface, Origin), BuildError> {
        self.validate_for_array()?;
        heights.check_size(MAX_LENGTH_UM)?;
        let field = self.resized(heights.levelled(self.level.unwrap_or(Level::Plane)));
        match self.theory {
            Theory::Scalar => {
                let options = Options { tiling: self.tiling.unwrap_or(Tiling::Aperiodic), ..self.options() };
                let (surface, origin) = cache.surface(&self.inside(field), &options, &Progress::none())?;
                Ok((BuiltSurface::scalar(surface, self.index_inside(), self.cover()), origin))
            }
            Theory::Rigorous => {
                let factor = self.eta_above();
                let profile = profile_of(&field.resized(factor, factor), self.tolerance)?;
                self.build_profile(&profile, cache, &Progress::none())
            }
        }
    }
}
