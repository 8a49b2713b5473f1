//! A relief: reads, levels and describes it, and makes the data that it is drawn with.

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

/// Most bytes of memory of a build: a page has 4 GB, and less on phones.
const LIMIT_BYTES: f64 = 1.5e9;
/// Factor on estimated times: a page has one thread, and WebAssembly is slower than native code.
const SLOWER: f64 = 3.0;
/// Most points of a height field.
const POINTS_MAX: usize = 4096 * 4096;
/// Largest file in bytes: it has to fit into a page's memory twice. A scan of 4096² in double precision has 134e6.
pub(crate) const FILE_BYTES_MAX: usize = 512 << 20;

/// A levelled height field, with facts from its file.
pub struct Relief {
    field: HeightField,
    channel: Option<String>,
    filled: usize,
    provenance: Option<Provenance>,
    doubts: Vec<String>,
}

/// Facts about a relief; the fields are those of `sunbeam height-field`.
#[derive(Debug, Serialize)]
pub struct Facts {
    /// Pixels along x and y.
    pub pixels: [usize; 2],
    /// Size of a pixel in µm.
    pub pixel_um: [f64; 2],
    /// Size of the relief in µm.
    pub extent_um: [f64; 2],
    /// Lowest and highest height in µm.
    pub range_um: [f64; 2],
    /// Difference of highest and lowest height in µm.
    pub peak_to_valley_um: f64,
    /// Root mean square of the heights about their mean, in µm.
    pub rms_um: f64,
    /// Root mean square of the slopes along x and y.
    pub rms_slope: [f64; 2],
    /// Figures of roughness.
    pub roughness: Roughness,
    /// The strongest periods along x and y.
    pub periods: Periods,
    /// The channel that was read, of a file that can hold several.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub channel: Option<String>,
    /// Points of the file without a height, which were filled.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub filled_points: Option<usize>,
    /// Origin of the file's size, unit, orientation, channel and holes.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub provenance: Option<Provenance>,
    /// Properties that no relief has.
    pub doubts: Vec<String>,
}

/// Estimated memory and time of making the method's data.
#[derive(Debug, Serialize)]
pub struct WebEstimate {
    /// Peak memory in bytes.
    pub bytes: f64,
    /// Time in seconds, within a factor of three.
    pub seconds: f64,
    /// Reason for a refusal.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub too_much: Option<String>,
}

impl Relief {
    /// Reads and levels the relief that the settings name; `file` holds the bytes of a file.
    ///
    /// # Errors
    /// [`WebError::File`], [`WebError::Scale`], [`WebError::Limit`], [`WebError::Settings`].
    pub fn new(settings: &Settings, file: Option<&[u8]>) -> Result<Self, WebError> {
        let config = settings.config();
        match (&config.filename, file) {
            (Some(name), None) => {
                return Err(WebError::File(format!("{}: the file is not here; drop it on the page", name.display())));
            }
            (Some(name), Some(bytes)) if bytes.len() > FILE_BYTES_MAX => {
                let (mb, most) = (bytes.len() >> 20, FILE_BYTES_MAX >> 20);
                return Err(WebError::Limit(format!("{}: {mb} MB, more than the {most} MB read", name.display())));
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

    /// The heights.
    pub fn field(&self) -> &HeightField {
        &self.field
    }

    /// Facts about the relief.
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

    /// Estimated memory and time of making the method's data.
    pub fn estimate(&self, settings: &Settings) -> WebEstimate {
        let demand = self.demand(settings);
        let estimate = demand.estimate();
        let (bytes, seconds) = (estimate.bytes, SLOWER * estimate.seconds);
        let too_large = bytes.is_nan() || bytes > LIMIT_BYTES;
        let refused = demand.check(settings.surface.build_limit).err().map(|error| error.to_string());
        let too_much = refused.or_else(|| {
            too_large.then(|| {
                format!(
                    "it would take about {:.1} GB of memory, more than the {:.1} GB that a page may take; use a \
                     shorter coherence length, a looser tolerance or a part of the scan",
                    bytes / 1e9,
                    LIMIT_BYTES / 1e9
                )
            })
        });
        WebEstimate { bytes, seconds, too_much }
    }

    fn demand(&self, settings: &Settings) -> BuildDemand {
        let model = settings.model();
        let purpose = match settings.method {
            MethodKind::Table if model.conserve_energy => Purpose::Surface { energy: true },
            _ => Purpose::Table,
        };
        BuildDemand { purpose, ..model.demand(&self.field) }
    }

    /// Builds the method.
    ///
    /// # Errors
    /// [`WebError::Limit`], [`WebError::Settings`].
    pub fn method(&self, settings: &Settings, progress: &Progress) -> Result<Box<dyn Method>, WebError> {
        if settings.method == MethodKind::Table
            && let Some(line) = self.estimate(settings).too_much
        {
            return Err(WebError::Limit(line));
        }
        let method =
            methods::build_watched(settings.method, &self.field, &settings.model(), &settings.options, progress)?;
        progress.report(1.0);
        Ok(method)
    }

    /// The method's data for another worker.
    ///
    /// # Errors
    /// The errors of [`Relief::method`].
    pub fn method_data(&self, settings: &Settings, progress: &Progress) -> Result<Vec<u8>, WebError> {
        MethodData::to_bytes(&*self.method(settings, progress)?)
    }

    /// The reflectance on the processor.
    ///
    /// # Errors
    /// The errors of [`Relief::method`].
    pub fn reflectance(&self, settings: &Settings, progress: &Progress) -> Result<Reflectance, WebError> {
        Ok(Reflectance::new(self.method(settings, progress)?, settings))
    }

    /// The data of spectra, on the processor.
    ///
    /// # Errors
    /// The errors of [`Relief::method`].
    pub fn spectra(&self, settings: &Settings, progress: &Progress) -> Result<Spectra, WebError> {
        if let Some(line) = self.estimate(settings).too_much {
            return Err(WebError::Limit(line));
        }
        Spectra::new(&self.field, settings, progress)
    }
}
