//! The error type of the page's calls, and its conversions from the errors of the library and the renderer.

use sunbeam::colour_table::ColourTableError;
use sunbeam::config::BuildError;
use sunbeam::height_field::HeightFieldError;
use sunbeam::methods::MethodError;
use sunbeam::table::TableError;
use sunbeam_realtime::GpuError;
use sunbeam_realtime::snake::SnakeError;

/// Reason for which a call failed. Each message is one line of plain text.
#[derive(Debug, thiserror::Error)]
pub enum WebError {
    /// A setting is unknown, is out of range, or contradicts another one.
    #[error("{0}")]
    Settings(String),
    /// A file cannot be read.
    #[error("{0}")]
    File(String),
    /// Neither a file nor the settings give the pixel size or the scale of the heights.
    #[error("{line}")]
    Scale {
        /// The message.
        line: String,
        /// Field of [`Settings::surface`](crate::Settings::surface) that supplies the scale: `pixel_size` or
        /// `max_height`.
        parameter: &'static str,
    },
    /// A file is too large, or the work would take too much memory or time.
    #[error("{0}")]
    Limit(String),
    /// The browser does not offer WebGPU, or no adapter for it.
    #[error("{0}")]
    NoWebGpu(String),
    /// The GPU's device is lost; another one has to be opened.
    #[error("{0}")]
    Lost(String),
    /// The GPU's device refused the work.
    #[error("{0}")]
    Gpu(String),
    /// A fault of the page or of this library: malformed bytes, or a call at the wrong time.
    #[error("{0}")]
    Internal(String),
}

impl WebError {
    /// Name of the variant, by which the page's JavaScript distinguishes errors.
    pub const fn kind(&self) -> &'static str {
        match self {
            Self::Settings(_) => "settings",
            Self::File(_) => "file",
            Self::Scale { .. } => "scale",
            Self::Limit(_) => "limit",
            Self::NoWebGpu(_) => "no-webgpu",
            Self::Lost(_) => "lost",
            Self::Gpu(_) => "gpu",
            Self::Internal(_) => "internal",
        }
    }

    /// Parameter of [`WebError::Scale`]; `None` for the other variants.
    pub const fn parameter(&self) -> Option<&'static str> {
        match self {
            Self::Scale { parameter, .. } => Some(*parameter),
            _ => None,
        }
    }
}

impl From<HeightFieldError> for WebError {
    fn from(error: HeightFieldError) -> Self {
        let line = error.to_string();
        match error {
            HeightFieldError::MissingScale { parameter, .. } => Self::Scale { line, parameter },
            HeightFieldError::UnknownName { .. }
            | HeightFieldError::PresetParameter { .. }
            | HeightFieldError::SkinParameter { .. }
            | HeightFieldError::NotWithin { .. }
            | HeightFieldError::OutOfRange { .. } => Self::Settings(line),
            // The other errors are about a file or its heights.
            _ => Self::File(line),
        }
    }
}

impl From<TableError> for WebError {
    fn from(error: TableError) -> Self {
        let line = error.to_string();
        match error {
            TableError::TooMuch { .. } | TableError::TooLarge { .. } => Self::Limit(line),
            TableError::OutOfRange { .. } => Self::Settings(line),
        }
    }
}

impl From<BuildError> for WebError {
    fn from(error: BuildError) -> Self {
        match error {
            BuildError::HeightField(error) => error.into(),
            BuildError::Table(error) | BuildError::Colours(ColourTableError::Table(error)) => error.into(),
            BuildError::Method(error) => error.into(),
            error => Self::Settings(error.to_string()),
        }
    }
}

impl From<MethodError> for WebError {
    fn from(error: MethodError) -> Self {
        let line = error.to_string();
        match error {
            MethodError::Table(error) => error.into(),
            MethodError::TooManyTerms { .. }
            | MethodError::TaylorRange { .. }
            | MethodError::TooWide { .. }
            | MethodError::TooLarge { .. } => Self::Limit(line),
            _ => Self::Settings(line),
        }
    }
}

impl From<SnakeError> for WebError {
    fn from(error: SnakeError) -> Self {
        Self::Settings(error.to_string())
    }
}

impl From<GpuError> for WebError {
    fn from(error: GpuError) -> Self {
        let line = error.to_string();
        match error {
            GpuError::NoAdapter { .. } | GpuError::NoDevice { .. } => Self::NoWebGpu(line),
            GpuError::Lost { .. } => Self::Lost(line),
            GpuError::TooLarge { .. } | GpuError::TooWide { .. } | GpuError::CutShort { .. } => Self::Limit(line),
            GpuError::Parameter { .. } => Self::Settings(line),
            GpuError::Mesh { .. } => Self::Internal(line),
            _ => Self::Gpu(line),
        }
    }
}
