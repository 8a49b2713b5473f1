//! The reflectance `f_r = R·O·M·S/λ²` of model.md §2, its sampling, and the oracle that judges it.
//!
//! [`Surface`] answers from tables; [`Exact`] from the direct double-precision sum. Both scale by the same
//! [`AlbedoScale`] where energy is to be conserved, and both take the same [`Pair`] of directions.

mod albedo_limit;
mod albedo_scale;
mod cell_shares;
mod exact;
mod fresnel;
mod geometry;
mod integrated;
mod lobe;
mod power_bins;
mod proposal;
mod quadrature;
mod shade;
mod surface;

pub use albedo_scale::AlbedoScale;
pub use albedo_scale::AlbedoScaleReport;
pub use cell_shares::CellShares;
pub use exact::Exact;
pub use fresnel::{ComplexIndex, fresnel_unpolarised};
pub use geometry::{DirectionError, LENGTH_TOLERANCE, Obliquity, Pair, Vec3, unit_vector};
pub use integrated::{IntegratedAnswer, WavelengthWeights, sample_wavelength, wavelength_pdf};
pub use proposal::{ANYWHERE_SHARE, FOLD_COS_MAX, Proposal};
pub use shade::Shade;
pub use surface::{Answer, Options, Sample, Surface, SurfacePair, SurfaceReport, UNIFORM_SHARE};
