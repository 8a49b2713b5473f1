//! Diffraction colours of measured nanostructures, as a material.
//!
//! Data flows one way: [`height_field`] → [`transform`] → [`table`], [`colour_table`] → [`reflectance`], [`methods`] → consumers
//! (the command line, the Mitsuba plugin, the C ABI in [`capi`]). Nothing upstream knows a consumer. [`compare`] judges their pictures, [`bench`]
//! what the methods cost and how far off they are; [`cache`] keeps tables on disk.
//!
//! # Conventions (stated once, used everywhere)
//! - Local frame: z is the normal, x the tangent, y the bitangent; `wi` and `wo` point away from the surface.
//! - `u = wi.x + wo.x`, `v = wi.y + wo.y`, `w = cosθi + cosθo`.
//! - Lengths on the surface are in µm, wavelengths in nm at every interface.
//! - Fourier sign is positive: `c_j(κ) = mean over the tile of exp(iκh)·exp(+2πi(jx·x/Lx + jy·y/Ly))`,
//!   with the phase rate `κ = 2πw/λ` in rad/µm. Order `j` leaves at `u = λ·jx/Lx`, `v = λ·jy/Ly`.
//! - Reflectance `f_r` is in 1/sr and does not contain the cosine; a `pdf` is per solid angle.
//! - Bins of a two-dimensional transform are stored `[jy][jx]`, non-negative orders first (FFT order).

pub mod bench;
pub mod cache;
pub mod capi;
pub mod colour;
pub mod colour_table;
pub mod compare;
pub mod config;
#[cfg(feature = "gpu")]
pub mod gpu;
pub mod guard;
pub mod height_field;
pub mod methods;
pub mod numeric;
pub mod reflectance;
pub mod snake;
pub mod table;
pub mod transform;

#[cfg(feature = "mitsuba")]
mod mitsuba;
