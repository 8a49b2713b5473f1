use crate::colour::ColourError;
use crate::height_field::HeightFieldError;
use crate::methods::MethodError;
use crate::table::TableError;

/// Why something was not measured.
#[derive(Debug, thiserror::Error)]
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
    #[cfg(feature = "gpu")]
    #[error(transparent)]
    Gpu(#[from] crate::gpu::GpuError),
}
