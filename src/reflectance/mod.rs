//! The reflectance `f_r = R·O·M·S/λ²` of model.md §2, its sampling, and the oracle that judges it.
//!
//! [`Surface`] answers from tables; [`Exact`] from the direct double-precision sum. Both divide by what the same
//! [`AlbedoTable`] holds where energy is to be conserved, and both take the same [`Pair`] of directions.

mod albedo;
mod cell_shares;
mod colour_lobe;
mod colour_sampler;
mod exact;
mod fresnel;
mod geometry;
mod integrated;
mod lobe;
mod lobes;
mod proposal;
mod quadrature;
pub mod sampler;
mod surface;

pub use albedo::{AlbedoLayout, AlbedoReport, AlbedoTable, AlbedoView, ColourAlbedoTable, ColourAlbedoView};
pub use cell_shares::CellShares;
pub use colour_lobe::{ColourFactors, ColourLobe, ColourSurface, ColourSurfaceReport, luminance};
pub use colour_sampler::{ColourSampler, ColourSamplerLayout, ColourSamplerView};
pub use exact::Exact;
pub use fresnel::{ComplexIndex, SpectralIndex, SpectralIndexError, fresnel_of_family, fresnel_unpolarised};
pub use geometry::{DirectionError, LENGTH_TOLERANCE, Obliquity, Pair, Vec3, unit_vector};
pub use integrated::{IntegratedAnswer, WavelengthWeights, sample_wavelength, wavelength_pdf};
pub use proposal::{ANYWHERE_SHARE, FOLD_COS_MAX, Proposal};
pub use surface::{Answer, Options, Sample, Surface, SurfacePair, SurfaceReport, UNIFORM_SHARE, estimate_table_bytes};
