use sunbeam::colour::ColourError;
use sunbeam::height_field::HeightFieldError;
use sunbeam::methods::MethodError;
use sunbeam::table::TableError;

/// Why something was not measured.
#[derive(Debug, thiserror::Error)]
#[allow(missing_docs)] // Each message says what its fields are.
pub enum BenchError {
    /// A method that the surface ought to have was not made.
    #[error("{candidate}: {source}")]
    Method { candidate: String, source: MethodError },
    #[error(transparent)]
    Table(#[from] TableError),
    #[error(transparent)]
    Colour(#[from] ColourError),
    #[error(transparent)]
    HeightField(#[from] HeightFieldError),
    /// The oracle over spectra is off from the direct sum.
    #[error("the oracle is off by {found:e} from the direct sum, more than {limit:e}")]
    Oracle { found: f64, limit: f64 },
    #[error(transparent)]
    Gpu(#[from] sunbeam_realtime::GpuError),
}
