//! Colour: spectra to sRGB, tone mapping, and colour differences.
//!
//! - [`cie_xyz`] and [`d65`]: the CIE 1931 2° observer and the daylight D65, by wavelength in nm.
//! - [`SpectralToRgb`]: weights that turn samples of a reflectance-like function over wavelength,
//!   seen in D65, into linear sRGB; a function that is 1 everywhere is exactly the white (1, 1, 1).
//! - [`xyz_to_linear_srgb`], [`linear_srgb_to_xyz`], [`srgb_encode`], [`srgb_bytes`], [`srgb_decode`].
//! - [`tone_map`]: radiance to displayable colours.
//! - [`automatic_exposure`]: the exposure of a picture.
//! - [`xyz_to_lab`], [`linear_srgb_to_lab`] and [`ciede2000`].
//!
//! XYZ is relative throughout: the D65 white has Y = 1.

mod cie;
mod difference;
mod exposure;
mod observer;
mod srgb;
mod tone;
mod wavelength_weights;
mod weights;

pub use difference::{ciede2000, linear_srgb_to_lab, xyz_to_lab};
pub use exposure::automatic_exposure;
pub use observer::{OBSERVER_RANGE_NM, cie_xyz, d65};
pub use srgb::{linear_srgb_to_xyz, srgb_bytes, srgb_decode, srgb_encode, xyz_to_linear_srgb};
pub use tone::tone_map;
pub use wavelength_weights::WavelengthWeights;
pub use weights::{ColourError, SpectralToRgb};
