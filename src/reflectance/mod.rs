//! The reflectance `f_r = R·O·M·S/λ²` of docs/model.md#the-reflectance, its sampling, and the oracle that judges it.
//!
//! Three verbs, the same everywhere: `eval` is `f_r` between two directions; `relief_spectral` and `relief_rgb` are what the
//! relief alone answers, at a wavelength and integrated in colour ([`crate::methods`]). Each says what is in it.
//!
//! [`Surface`] answers from tables; [`Exact`] from the direct double-precision sum. Both divide by what the same
//! [`AlbedoTable`] holds where energy is to be conserved, and both take the same [`Pair`] of directions.

mod albedo;
mod colour_lobe;
mod colour_sampler;
mod exact;
mod fresnel;
mod geometry;
mod integrated;
mod lobe;
mod lobes;
mod map;
mod power_grid;
mod quadrature;
pub mod sampler;
mod small_slope;
mod spectral_lobe;
mod surface;

pub use albedo::{AlbedoLayout, AlbedoReport, AlbedoTable, AlbedoView, ColourAlbedoTable, ColourAlbedoView};
#[cfg(feature = "rigorous")]
pub(crate) use colour_lobe::desaturated;
pub use colour_lobe::{ColourFactors, ColourLobe, ColourSurface, ColourSurfaceReport, Gamut, luminance};
pub use colour_sampler::{ColourSampler, ColourSamplerLayout, ColourSamplerView};
pub use exact::Exact;
pub use fresnel::{ComplexIndex, SpectralIndex, SpectralIndexError, fresnel_of_family, fresnel_unpolarised};
pub use geometry::{DirectionError, LENGTH_TOLERANCE, Obliquity, Pair, Vec3, unit_vector};
pub use integrated::WavelengthWeights;
pub use map::map_direction;
pub use small_slope::{Amplitudes, small_slope_amplitudes};
pub use spectral_lobe::{SpectralLayout, SpectralLobe};
#[cfg(feature = "rigorous")]
pub(crate) use spectral_lobe::{above, mixed};
pub use surface::{Answer, Options, Sample, Surface, SurfaceReport, UNIFORM_SHARE};
