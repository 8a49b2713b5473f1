//! Colour: conversion of spectra to sRGB, tone mapping, and colour differences.
//!
//! - [`cie_xyz`], [`d65`]: the CIE 1931 2° observer and the daylight D65, by wavelength in nm.
//! - [`SpectralToRgb`]: weights from samples of a reflectance on any uniform grid of wavelengths to linear sRGB under
//!   D65. A reflectance of 1 gives the white (1, 1, 1).
//! - [`WavelengthWeights`]: weights to linear sRGB and luminance on a fixed grid, every nm at which surfaces are
//!   tabulated (360 to 830 nm).
//! - [`xyz_to_linear_srgb`], [`linear_srgb_to_xyz`], [`srgb_encode`], [`srgb_bytes`], [`srgb_decode`]: sRGB, linear and
//!   encoded.
//! - [`tone_map`], [`automatic_exposure`]: linear sRGB of any brightness to displayable colours.
//! - [`xyz_to_lab`], [`linear_srgb_to_lab`], [`ciede2000`]: CIELAB and colour differences.
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
