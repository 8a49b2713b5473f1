//! Lobes: the diffracted light's reflectance `f_r` between two directions, its sampling density, and samples.
//!
//! `f_r` is in 1/sr and leaves out the cosine (docs/model.md#the-reflectance). Where energy is conserved it is divided
//! by albedos (`src/energy`). Six lobes implement [`Lobe`]:
//!
//! | lobe | surface that builds it | spectral content | body below the relief |
//! | --- | --- | --- | --- |
//! | [`SpectralLobe`] | [`Surface`] | wavelengths in nm | reflects |
//! | [`ColourLobe`] | [`ColourSurface`] | linear sRGB | reflects |
//! | [`TransmissiveLobe`] | [`Surface`] | wavelengths in nm | transmits too |
//! | [`TransmissiveColourLobe`] | [`ColourSurface`] | linear sRGB | transmits too |
//! | `GratingLobe` (src/grating/) | `GratingSurface` | wavelengths in nm | either |
//! | `GratingColourLobe` (src/grating/) | `GratingColourSurface` | linear sRGB | either |
//!
//! Scalar theory has the first four lobes; the last two are of gratings by Maxwell's equations.
//!
//! Each lobe is written once for a family of numbers `N` ([`crate::numeric`]): an `N::Real` is one number, a SIMD
//! vector, or a traced variable of the Mitsuba plugin. A lobe implements `PerWavelength` or `InColour`, which give it
//! the trait [`Lobe`]. [`Exact`] is the reference for the lobes at wavelengths of scalar theory: the direct sum in
//! double precision.

mod band_ratio;
mod by_value;
mod colour_lobe;
mod colour_surface;
mod exact;
mod in_colour;
mod mixture;
mod per_wavelength;
mod spectral;
mod surface;
mod transmissive;

pub use band_ratio::BandRatio;
pub use by_value::{Answer, Sample};
pub(crate) use by_value::{eval, eval_pdf, pdf, sample, sample_direction};
pub use colour_lobe::{ColourFactors, ColourLobe};
pub use colour_surface::{ColourSurface, ColourSurfaceReport};
pub use exact::Exact;
pub(crate) use in_colour::InColour;
pub use in_colour::{Gamut, luminance};
pub use mixture::UNIFORM_FRACTION;
pub(crate) use mixture::{Sides, are_above, mixture_density, sample_mixture};
pub(crate) use per_wavelength::PerWavelength;
pub use spectral::{SpectralLayout, SpectralLobe};
pub use surface::{Surface, SurfaceReport};
pub(crate) use transmissive::colour_at_body;
pub use transmissive::{TransmissiveColourLobe, TransmissiveLobe};

use crate::numeric::Numbers;

/// Value, density and samples of one lobe, over the numbers `N`.
///
/// `C` is the spectral content that a ray carries: `[N::Real; L]`, `L` wavelengths in nm, or the marker [`LinearSrgb`].
/// Wavelengths must lie within the tables' range. Directions are unit vectors in the relief's frame, whose z axis is
/// the normal, and point away from the surface. Results are zero where the mask `active` is false, and where a
/// direction lies below the surface of a lobe that only reflects.
///
/// ```
/// use sunbeam::lobe::Lobe;
/// use sunbeam::{Options, Preset, Surface};
///
/// let field = Preset::Blazed.build(None, None)?;
/// let options = Options { coherence_length_um: 20.0, conserve_energy: false, ..Options::default() };
/// let surface = Surface::new(&field, &options)?;
///
/// // Two wavelengths at once, in single precision.
/// let lobe = surface.lobe::<f32>();
/// let (wi, nm) = ([0.0, 0.0, 1.0], [450.0, 650.0]);
/// let wo = lobe.sample(wi, nm, [0.5, 0.3, 0.6], true);
/// let ([blue, red], pdf) = lobe.eval_pdf(wi, wo, nm, true);
/// assert!(blue >= 0.0 && red >= 0.0 && pdf > 0.0);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub trait Lobe<N: Numbers, C: Copy> {
    /// Reflectance in 1/sr: `[N::Real; L]` at the wavelengths, or the three channels of linear sRGB.
    type Value;

    /// `f_r` in 1/sr between two directions, without the cosine. [`SpectralLobe`], and [`ColourLobe`] without a
    /// refractive index, also leave out the interface's factor: the Fresnel reflectance or the small-slope factor.
    /// Callers multiply by it ([`Pair::interface`](crate::scattering::Pair::interface)).
    fn eval(&self, wi: [N::Real; 3], wo: [N::Real; 3], carried: C, active: N::Mask) -> Self::Value;

    /// Density of [`Lobe::sample`] over solid angle, in 1/sr; with wavelengths, the mean over them.
    fn pdf(&self, wi: [N::Real; 3], wo: [N::Real; 3], carried: C, active: N::Mask) -> N::Real;

    /// [`Lobe::eval`] and [`Lobe::pdf`]. Lobes at wavelengths compute both in one loop.
    #[inline(always)]
    fn eval_pdf(&self, wi: [N::Real; 3], wo: [N::Real; 3], carried: C, active: N::Mask) -> (Self::Value, N::Real) {
        (self.eval(wi, wo, carried, active), self.pdf(wi, wo, carried, active))
    }

    /// A direction `wo` from three random numbers in [0, 1); the zero vector where the drawn wave vector has no
    /// direction, because its part along the surface is longer than the wave vector of light.
    ///
    /// The first number makes the discrete choices: the side of a transparent body, a uniform direction or one of the
    /// lobe's own, a wavelength, and the order of a grating by Maxwell's equations. The others yield the direction.
    fn sample(&self, wi: [N::Real; 3], carried: C, u: [N::Real; 3], active: N::Mask) -> [N::Real; 3];
}

/// Spectral content of a ray in linear sRGB, instead of wavelengths. It has no data: all three channels are computed.
#[derive(Clone, Copy, Debug)]
pub struct LinearSrgb;
