//! Lobes: the diffracted light's reflectance `f_r` between two directions, its sampling density, and samples.
//!
//! `f_r = R·O·M·S/λ²` (docs/model.md#the-reflectance) is in 1/sr and leaves out the cosine. Four lobes implement
//! [`Lobe`]:
//!
//! | lobe | surface that builds it | carries |
//! | --- | --- | --- |
//! | [`SpectralLobe`] | [`Surface`] | wavelengths in nm |
//! | [`ColourLobe`] | [`ColourSurface`] | linear sRGB |
//! | `GratingLobe` (src/grating/) | `GratingSurface` | wavelengths in nm |
//! | `GratingColourLobe` (src/grating/) | `GratingColourSurface` | linear sRGB |
//!
//! Each is written once for all families of numbers ([`crate::numeric`]). [`Exact`] judges them by the direct
//! double-precision sum.

mod by_value;
mod colour;
mod exact;
mod mixture;
mod per_wavelength;
mod spectral;
mod surface;

pub use by_value::{Answer, Sample};
pub(crate) use by_value::{eval, eval_pdf, pdf, sample, sample_direction};
#[cfg(feature = "rigorous")]
pub(crate) use colour::desaturated;
pub use colour::{ColourFactors, ColourLobe, ColourSurface, ColourSurfaceReport, Gamut, luminance};
pub use exact::Exact;
pub use mixture::UNIFORM_FRACTION;
pub(crate) use mixture::{are_above, mixture_density, sample_mixture};
pub(crate) use per_wavelength::PerWavelength;
pub use spectral::{SpectralLayout, SpectralLobe};
pub use surface::{Surface, SurfaceReport};

use crate::numeric::Numbers;

/// Value, density and samples of one lobe, over the numbers `N`.
///
/// `C` is what a query carries: `[N::Real; L]` for `L` wavelengths in nm, or [`LinearSrgb`]. Directions are unit
/// vectors in the relief's frame and point away from the surface. Where one of them lies below the surface, or the mask
/// is false, answers are zero.
pub trait Lobe<N: Numbers, C> {
    /// Reflectance in 1/sr: `[N::Real; L]` at the wavelengths, or the three channels of linear sRGB.
    type Value;

    /// `f_r` in 1/sr between two directions, without the cosine. Lobes at wavelengths of scalar theory also leave out
    /// the interface's factor ([`Pair::interface`](crate::scattering::Pair::interface)).
    fn eval(&self, wi: [N::Real; 3], wo: [N::Real; 3], carried: C, active: N::Mask) -> Self::Value;

    /// Density of [`Lobe::sample`] per solid angle, in 1/sr: the mean over the wavelengths carried.
    fn pdf(&self, wi: [N::Real; 3], wo: [N::Real; 3], carried: C, active: N::Mask) -> N::Real;

    /// [`Lobe::eval`] and [`Lobe::pdf`], which share their look-ups.
    fn eval_pdf(&self, wi: [N::Real; 3], wo: [N::Real; 3], carried: C, active: N::Mask) -> (Self::Value, N::Real);

    /// A direction `wo` from three random numbers in [0, 1). The first chooses between the uniform part and the
    /// wavelengths, then, for gratings, the order. The zero vector where the draw falls below the horizon.
    fn sample(&self, wi: [N::Real; 3], carried: C, u: [N::Real; 3], active: N::Mask) -> [N::Real; 3];
}

/// Marks queries that carry colours in linear sRGB instead of wavelengths.
#[derive(Clone, Copy, Debug)]
pub struct LinearSrgb;
