//! Reads, levels and describes a relief, and builds the methods and evaluators that draw it.
//!
//! A *cover* is a flat clear layer over the relief, a *film* a sheet that reflects and transmits. Wavelengths in them
//! are shorter by the refractive index, so their methods are built from a magnified relief.

use crate::error::WebError;
use crate::method_data::MethodData;
use crate::reflectance::Reflectance;
use crate::settings::Settings;
use crate::spectra::Spectra;
use serde::Serialize;
use sunbeam::height_field::{HeightField, Provenance, Roughness};
use sunbeam::methods::{self, Method, MethodKind};
use sunbeam::table::{BuildDemand, Progress, Purpose, Tiling};
use sunbeam::transform::{Periods, periods};

/// Largest estimated memory of a build in bytes. WebAssembly has at most 4 GB, and phones give a page less. With a
/// larger limit phones would end the page during some builds; a smaller one refuses builds that most machines can do.
const LIMIT_BYTES: f64 = 1.5e9;
/// Largest number of points of a height field: 4096², the size of the largest usual scans.
const POINTS_MAX: usize = 4096 * 4096;
/// Largest file in bytes, 512 MiB. A scan of 4096² in double precision has 134e6 bytes, and text is a few times longer.
/// The page's memory holds a file twice, so a larger limit would not leave enough of it.
pub(crate) const FILE_BYTES_MAX: usize = 512 << 20;

/// A levelled height field, with the reader's findings about its file.
pub struct Relief {
    /// The levelled heights.
    field: HeightField,
    /// Channel of the file that was read ([`Facts::channel`]).
    channel: Option<String>,
    /// Number of points of the file without a height, which the reader filled.
    filled: usize,
    /// Sources of the file's properties ([`Facts::provenance`]).
    provenance: Option<Provenance>,
    /// Warnings of the reader about implausible data.
    doubts: Vec<String>,
}

/// Facts about a relief, serialised as JSON with the field names of `sunbeam height-field`.
#[derive(Debug, Serialize)]
pub struct Facts {
    /// Pixels along x and y.
    pub pixels: [usize; 2],
    /// Size of a pixel along x and y in µm.
    pub pixel_um: [f64; 2],
    /// Size of the relief along x and y in µm.
    pub extent_um: [f64; 2],
    /// Lowest and highest height in µm.
    pub range_um: [f64; 2],
    /// Difference of highest and lowest height in µm.
    pub peak_to_valley_um: f64,
    /// Root mean square of the heights about their mean, in µm.
    pub rms_um: f64,
    /// Root mean square of the slopes (tangents) along x and y.
    pub rms_slope: [f64; 2],
    /// Roughness parameters.
    pub roughness: Roughness,
    /// The strongest periods along x and y.
    pub periods: Periods,
    /// The channel that was read; `None` for formats with a single channel and for presets.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub channel: Option<String>,
    /// Number of points of the file without a height, which were filled; `None` if there are none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub filled_points: Option<usize>,
    /// Sources of the file's pixel size, unit, orientation, channel and missing points; `None` for presets.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub provenance: Option<Provenance>,
    /// Warnings about implausible data, such as properties that no real relief has.
    pub doubts: Vec<String>,
}

impl Relief {
    /// Reads and levels the relief of the settings: a preset, or the file whose contents are `file`.
    ///
    /// # Errors
    /// - [`WebError::File`] for a missing or unreadable file, [`WebError::Scale`] for one without a scale.
    /// - [`WebError::Limit`] for a file or a relief that is too large.
    /// - [`WebError::Settings`] for parameters out of range.
    pub fn new(settings: &Settings, file: Option<&[u8]>) -> Result<Self, WebError> {
        let config = settings.config();
        match (&config.filename, file) {
            (Some(name), None) => {
                return Err(WebError::File(format!("{}: the file is not here; drop it on the page", name.display())));
            }
            (Some(name), Some(bytes)) if bytes.len() > FILE_BYTES_MAX => {
                let [size_mb, most_mb] = [bytes.len(), FILE_BYTES_MAX].map(|bytes| bytes as f64 / 1e6);
                let name = name.display();
                return Err(WebError::Limit(format!("{name}: {size_mb:.0} MB, more than the {most_mb:.0} MB read")));
            }
            _ => {}
        }
        let read = config.raw_height_field_of(file)?;
        let (nx, ny) = read.field.size();
        if nx * ny > POINTS_MAX {
            return Err(WebError::Limit(format!("the relief has {nx} × {ny} points, more than the {POINTS_MAX} read")));
        }
        Ok(Self {
            field: read.field.levelled(config.level()),
            channel: read.channel,
            filled: read.filled,
            provenance: read.provenance,
            doubts: read.doubts.iter().map(ToString::to_string).collect(),
        })
    }

    /// The levelled heights.
    pub fn field(&self) -> &HeightField {
        &self.field
    }

    /// The relief that methods are built from: magnified along x, y and z by the refractive index of the cover or film.
    fn inside(&self, settings: &Settings) -> HeightField {
        settings.surface.inside(self.field.clone())
    }

    /// Size, heights, roughness and periods of the relief, with the reader's findings. `settings` says whether the tile
    /// repeats, which the periods depend on.
    pub fn facts(&self, settings: &Settings) -> Facts {
        let field = &self.field;
        let ((nx, ny), (lx, ly), (low, high)) = (field.size(), field.extent_um(), field.range_um());
        let (slope_x, slope_y) = field.rms_slope();
        Facts {
            pixels: [nx, ny],
            pixel_um: [field.dx_um(), field.dy_um()],
            extent_um: [lx, ly],
            range_um: [low, high],
            peak_to_valley_um: field.peak_to_valley_um(),
            rms_um: field.rms_um(),
            rms_slope: [slope_x, slope_y],
            roughness: field.roughness(),
            periods: periods(field, settings.surface.tiling() == Tiling::Periodic),
            channel: self.channel.clone(),
            filled_points: (self.filled > 0).then_some(self.filled),
            provenance: self.provenance.clone(),
            doubts: self.doubts.clone(),
        }
    }

    /// Refuses the tables of the method `table`, or of its spectra, if they would take too much memory or time. The
    /// published methods need no tables and check their own limits while they are built.
    ///
    /// # Errors
    /// [`WebError::Limit`], [`WebError::Settings`] for a `build_limit` out of range.
    fn check_tables(&self, settings: &Settings) -> Result<(), WebError> {
        if settings.method != MethodKind::Table {
            return Ok(());
        }
        let options = settings.library_options();
        // A table of albedos is built only with energy conservation. `energy` is the factor on the build time of this
        // table: 1 for a relief of fixed size, since the page has no textures of `scale` and `depth`.
        let purpose = if options.conserve_energy { Purpose::Surface { energy: 1.0 } } else { Purpose::Table };
        let tables = BuildDemand { purpose, ..options.demand(&self.inside(settings)) };
        // The setting `build_limit` of the surface comes first, then the page's limit.
        tables.check(settings.surface.build_limit)?;
        let bytes = tables.estimate().bytes;
        if bytes > LIMIT_BYTES {
            return Err(WebError::Limit(format!(
                "it would take about {:.1} GB of memory, more than the {:.1} GB that a page may take; use a shorter \
                 coherence length, a looser tolerance or a part of the scan",
                bytes / 1e9,
                LIMIT_BYTES / 1e9
            )));
        }
        Ok(())
    }

    /// Builds the realtime method of the settings for this relief.
    ///
    /// # Errors
    /// [`WebError::Limit`] for a build that needs too much memory or time, [`WebError::Settings`] for options that do
    /// not fit the relief.
    pub fn method(&self, settings: &Settings, progress: &Progress) -> Result<Box<dyn Method>, WebError> {
        self.check_tables(settings)?;
        let (field, options) = (self.inside(settings), settings.library_options());
        let method = methods::build_watched(settings.method, &field, &options, &settings.options, progress)?;
        progress.report(1.0);
        Ok(method)
    }

    /// Builds the method and serialises it for the worker that draws ([`MethodData`]).
    ///
    /// # Errors
    /// The errors of [`Relief::method`].
    pub fn method_data(&self, settings: &Settings, progress: &Progress) -> Result<Vec<u8>, WebError> {
        MethodData::to_bytes(&*self.method(settings, progress)?)
    }

    /// Builds the evaluator of colours on the CPU.
    ///
    /// # Errors
    /// The errors of [`Relief::method`].
    pub fn reflectance(&self, settings: &Settings, progress: &Progress) -> Result<Reflectance, WebError> {
        Ok(Reflectance::new(self.method(settings, progress)?, settings))
    }

    /// Builds the evaluator of spectra on the CPU.
    ///
    /// # Errors
    /// The errors of [`Relief::method`].
    pub fn spectra(&self, settings: &Settings, progress: &Progress) -> Result<Spectra, WebError> {
        self.check_tables(settings)?;
        Spectra::new(&self.inside(settings), settings, progress)
    }
}
