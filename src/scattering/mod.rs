//! Factors of the reflectance that depend on directions and refractive indices only, and the scattering vector.
//!
//! The reflectance is `R·O·M·S(f; κ)/λ²` (docs/model.md#the-reflectance): Fresnel reflectance R, obliquity factor O,
//! shadowing M, wavelength λ. The relief's power spectrum S depends on the spatial frequency f and the phase rate κ,
//! both of which follow from the scattering vector `wi + wo`.
//!
//! | file | contents |
//! | --- | --- |
//! | `vector.rs` | the scattering vector: frequency f and phase rate κ of a pair of directions |
//! | `geometry.rs` | pairs of directions, the obliquity factor O, shadowing M by V-shaped grooves |
//! | `fresnel.rs`, `index.rs` | Fresnel reflectance R, refractive indices |
//! | `size.rs` | sizes of pattern and heights relative to the relief of the tables |
//! | `cover.rs` | a flat clear layer over the relief |
//! | `small_slope.rs` | the small-slope factor Q, which replaces R·O |
//! | `transparent.rs` | reflection and transmission at a lossless medium, one factor for both |
//! | `body_order.rs` | power of one diffraction order at such a medium, for lists of orders |
//! | `passage.rs` | wave vectors of incident and scattered light, for samplers |
//! | `options.rs` | parameters of the model |
//! | `map.rs` | directions of the pixels of a hemispherical map |
//! | `perturbation.rs` | fields of a shallow relief to first order in its height, for tests |

mod body_order;
mod cover;
mod fresnel;
mod geometry;
mod index;
mod map;
mod options;
mod passage;
#[cfg(test)]
mod perturbation;
mod size;
mod small_slope;
mod transparent;
mod vector;

pub use body_order::BodyOrder;
pub use cover::{Cover, Inside};
pub use fresnel::{fresnel_of_family, fresnel_unpolarised};
pub(crate) use geometry::{COSINE_MIN, angular_factor, direction_above, floored_cosines};
pub use geometry::{DirectionError, LENGTH_TOLERANCE, Obliquity, Pair, Vec3, unit_vector};
pub use index::{ComplexIndex, SpectralIndex, SpectralIndexError};
pub use map::map_direction;
pub use options::Options;
pub(crate) use options::build_table;
pub(crate) use passage::Passage;
pub use size::{RELATIVE_SIZE, Reading, RelativeSize, SizeRange};
pub(crate) use size::{SLAB_PHASE, SLAB_PHASE_OF_RIDGES};
#[cfg(test)]
pub(crate) use small_slope::SINES_MIN;
pub(crate) use small_slope::small_slope;
pub use small_slope::{Amplitudes, small_slope_amplitudes};
pub(crate) use transparent::{BodyWave, TransparentPair};
pub use transparent::{Transmission, TransparentBody};
pub(crate) use vector::{Scattering, TYPICAL_WAVELENGTH_UM};
