use super::{ConfigError, Source, SurfaceConfig};
use crate::height_field::{FileField, FileScale, HeightField, HeightFieldError, ReadOptions};
use crate::reflectance::{Options, Surface};
use crate::table::TableError;

/// Why a configuration did not become a surface.
#[derive(Debug, thiserror::Error)]
pub enum BuildError {
    #[error(transparent)]
    Config(#[from] ConfigError),
    #[error(transparent)]
    HeightField(#[from] HeightFieldError),
    #[error(transparent)]
    Table(#[from] TableError),
}

impl SurfaceConfig {
    /// The height field that the configuration names, levelled.
    ///
    /// # Errors
    /// A configuration that [`SurfaceConfig::validate`] refuses, or a file that cannot be read.
    pub fn height_field(&self) -> Result<HeightField, BuildError> {
        Ok(self.raw_height_field()?.field.levelled(self.level()))
    }

    /// The height field that the configuration names as it is, filled but not levelled, and what was filled.
    ///
    /// # Errors
    /// As [`SurfaceConfig::height_field`].
    pub fn raw_height_field(&self) -> Result<FileField, BuildError> {
        self.validate()?;
        Ok(match self.source() {
            Source::Preset(preset) => {
                FileField { field: preset.build(self.period, self.height)?, channel: None, filled: 0 }
            }
            Source::File(path) => {
                let scale = FileScale { pixel_size_um: self.pixel_size, max_height_um: self.max_height };
                let fill = self.fill.unwrap_or_default();
                HeightField::read_with(path, &ReadOptions { scale, channel: self.channel.clone(), fill })?
            }
        })
    }

    /// The model's options, with the defaults that depend on source and model filled in.
    pub fn options(&self) -> Options {
        Options {
            coherence_length_um: self.coherence_length,
            model: self.model,
            tiling: self.tiling(),
            obliquity: self.obliquity,
            conserve_energy: self.conserve_energy(),
            shadowing: self.shadowing,
            tolerance: self.tolerance,
        }
    }

    /// Reads the heights and builds the tables.
    ///
    /// # Errors
    /// As [`SurfaceConfig::height_field`], or tables that would be too large.
    pub fn build(&self) -> Result<Surface, BuildError> {
        Ok(Surface::new(&self.height_field()?, &self.options())?)
    }
}
