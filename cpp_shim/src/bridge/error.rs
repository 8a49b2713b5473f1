//! The error of a call from C++, whose message names the parameter or the cause.

use super::super::scope::TraceError;
use sunbeam::config::BuildError;
use sunbeam::scattering::SpectralIndexError;
use sunbeam_guard::Panic;

/// Reason that a call from C++ failed.
#[derive(Debug, thiserror::Error)]
pub(super) enum PluginError {
    /// Parameters that the configuration refuses, or a failed build.
    #[error(transparent)]
    Build(#[from] BuildError),
    /// Another version of Mitsuba than that of the build.
    #[error(
        "the diffraction plugin was compiled for Mitsuba {compiled}, but is being loaded into {running}; their memory \
         layouts differ, so it would render garbage. Install mitsuba=={compiled}, or rebuild with `make plugin`"
    )]
    Version { compiled: String, running: String },
    /// An index that is out of range or whose wavelengths do not rise.
    #[error("parameters \"eta\" and \"k\": {0}")]
    Index(#[from] SpectralIndexError),
    /// A value of a parameter that needs the index at each wavelength, which is not known. The parameter's value
    /// `other` does not need it.
    #[error(
        "parameter {parameter:?} is {value:?}, which needs \"eta\" and \"k\" as numbers or spectra, not as textures or \
         colours, and not changed later; {other:?} does not"
    )]
    UnknownIndex { parameter: &'static str, value: &'static str, other: &'static str },
    /// Textures of sizes with a theory whose tables hold one size.
    #[error("parameters \"scale\" and \"depth\" are textures, which theory \"rigorous\" does not take; give numbers")]
    RigorousSizes,
    /// Values of a texture of sizes beyond the accepted range.
    #[error("parameter {parameter:?} has values from {low} to {high} in its texture; they must lie in (0, 1]")]
    TextureSize { parameter: &'static str, low: f32, high: f32 },
    /// A call for Mueller matrices of a surface without Jones matrices.
    #[error("the surface has no Jones matrices: it is not rigorous, or was built for an unpolarised variant")]
    NoMatrix,
    /// An error of Dr.Jit while it records a kernel.
    #[error(transparent)]
    Trace(#[from] TraceError),
    /// A caught panic, a defect of the library.
    #[error(transparent)]
    Panic(#[from] Panic),
}
