//! Errors of the benchmarks.

use sunbeam::colour::ColourError;
use sunbeam::height_field::HeightFieldError;
use sunbeam::methods::MethodError;
use sunbeam::table::TableError;

/// The reason why a benchmark could not run.
#[derive(Debug, thiserror::Error)]
#[allow(missing_docs, reason = "each message says what its fields are")]
pub enum BenchError {
    /// A method could not be built. `candidate` names it with its parameters.
    #[error("{candidate}: {source}")]
    Method { candidate: String, source: MethodError },
    /// Tables of a surface could not be built.
    #[error(transparent)]
    Table(#[from] TableError),
    /// A step between wavelengths is out of range.
    #[error(transparent)]
    Colour(#[from] ColourError),
    /// The heights of a benchmark's relief were refused.
    #[error(transparent)]
    HeightField(#[from] HeightFieldError),
    /// The reference spectra (truth.rs) deviate too much from the direct double-precision sum: by `found`, with at most
    /// `limit` accepted. Both numbers are relative.
    #[error("the reference spectra deviate from the direct sum by {found:e}, more than {limit:e}")]
    Oracle { found: f64, limit: f64 },
    /// The GPU refused a shader or its data.
    #[error(transparent)]
    Gpu(#[from] sunbeam_realtime::GpuError),
}
