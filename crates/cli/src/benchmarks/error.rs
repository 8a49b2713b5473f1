//! Errors of the benchmarks. Candidates are defined in methods/candidate.rs, reference spectra in truth.rs.

use sunbeam::colour::ColourError;
use sunbeam::height_field::HeightFieldError;
use sunbeam::methods::MethodError;
use sunbeam::table::TableError;

/// The reason why a benchmark could not run.
#[derive(Debug, thiserror::Error)]
#[allow(missing_docs, reason = "each message says what its fields are")]
pub enum BenchError {
    /// A method could not be built.
    #[error("{candidate}: {source}")]
    Method { candidate: String, source: MethodError },
    /// Tables could not be built.
    #[error(transparent)]
    Table(#[from] TableError),
    /// A step between wavelengths is out of range.
    #[error(transparent)]
    Colour(#[from] ColourError),
    /// A relief of a benchmark is not a height field.
    #[error(transparent)]
    HeightField(#[from] HeightFieldError),
    /// The reference spectra deviate from the direct sum.
    #[error("the reference spectra deviate from the direct sum by {found:e}, more than {limit:e}")]
    Oracle { found: f64, limit: f64 },
    /// The GPU refused a shader or its data.
    #[error(transparent)]
    Gpu(#[from] sunbeam_realtime::GpuError),
}
