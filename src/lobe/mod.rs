//! Lobes: the reflectance `f_r = R·O·M·S/λ²` of docs/model.md#the-reflectance between two directions, its density and samples.
//!
//! [`Surface`] answers at wavelengths and [`ColourSurface`] in linear sRGB, both from tables; [`Exact`] judges them by the direct
//! double-precision sum. Gratings solved by Maxwell's equations have lobes of their own in `src/grating/`.
//!
//! Three verbs, everywhere in one meaning: `eval` is `f_r` between two directions; `relief_spectral` and `relief_rgb` are the
//! relief's own answer, at a wavelength and integrated to a colour ([`crate::methods`]).

mod colour;
mod exact;
mod integrated;
mod mixture;
mod spectral;
mod surface;

#[cfg(feature = "rigorous")]
pub(crate) use colour::desaturated;
pub use colour::{ColourFactors, ColourLobe, ColourSurface, ColourSurfaceReport, Gamut, luminance};
pub use exact::Exact;
pub use integrated::WavelengthWeights;
pub use mixture::UNIFORM_SHARE;
#[cfg(feature = "rigorous")]
pub(crate) use mixture::{above, mixed};
pub use spectral::{SpectralLayout, SpectralLobe};
pub use surface::{Answer, Sample, Surface, SurfaceReport};
