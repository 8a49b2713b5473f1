//! Pairs of directions and the factors that depend on them alone: scattering vector, obliquity, Fresnel, small slope.

mod fresnel;
mod geometry;
mod map;
mod options;
mod small_slope;

pub use fresnel::{ComplexIndex, SpectralIndex, SpectralIndexError, fresnel_of_family, fresnel_unpolarised};
pub(crate) use geometry::{COSINE_MIN, direction_above, obliquity, shadowing};
pub use geometry::{DirectionError, LENGTH_TOLERANCE, Obliquity, Pair, Vec3, unit_vector};
pub use map::map_direction;
pub use options::Options;
pub(crate) use options::build_table;
pub(crate) use small_slope::small_slope;
pub use small_slope::{Amplitudes, small_slope_amplitudes};
