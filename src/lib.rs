//! Spectral diffraction BSDF of measured nanostructures.
//!
//! A relief with details of about a micrometre (a grating, a compact disc, the skin of a snake) diffracts each
//! wavelength into other directions. From a [`HeightField`] this library computes the spectral BSDF by scalar
//! diffraction theory: the relief changes the phase of light as a thin screen does. The relief's power spectrum is
//! tabulated once, so an evaluation takes a few look-ups. Directions are sampled in proportion to the tabulated power.
//! Gratings can also be computed by Maxwell's equations.
//!
//! ```
//! use sunbeam::{Options, Preset, Surface};
//!
//! // A blazed grating with a period of 2.5 µm. Light interferes over the coherence length: a longer one makes orders
//! // narrower. Without energy conservation the build is quick.
//! let field = Preset::Blazed.build(None, None)?;
//! let options = Options { coherence_length_um: 20.0, conserve_energy: false, ..Options::default() };
//! let surface = Surface::new(&field, &options)?;
//!
//! // Light of 550 nm along the normal. Order n leaves where the sine is n·λ over the period. Order −1 is bright, and
//! // the direction in the middle between orders −1 and −2 is dark.
//! let wi = [0.0, 0.0, 1.0];
//! let wo = |order: f64| {
//!     let sine = order * 0.55 / 2.5;
//!     [sine, 0.0, (1.0 - sine * sine).sqrt()]
//! };
//! assert!(surface.eval(wi, wo(-1.0), 550.0) > 1000.0 * surface.eval(wi, wo(-1.5), 550.0));
//!
//! // An outgoing direction from three random numbers in [0, 1), and its density per solid angle.
//! let sample = surface.sample(wi, &[550.0], [0.3, 0.6, 0.1]).expect("above the horizon");
//! assert!((sample.pdf - surface.pdf(wi, sample.wo, &[550.0])).abs() < 1e-9 * sample.pdf);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! A [`SurfaceConfig`] describes a surface by parameters, with the names and defaults of scene files and the command
//! line:
//!
//! ```
//! # #[cfg(feature = "full")] {
//! use sunbeam::{Cache, SurfaceConfig};
//!
//! let config = SurfaceConfig::from_json(r#"{"preset": "sinusoidal", "period": 2, "conserve_energy": false}"#)?;
//! let (surface, _) = config.build(&Cache::off())?;
//! assert!(surface.report().table.relative_error < 1e-3);
//! # }
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # Modules
//!
//! The root has the items that most programs need. In this table, a module depends only on modules above it:
//!
//! | module | contents |
//! | --- | --- |
//! | [`height_field`] | heights from presets and files |
//! | [`transform`] | Fourier transforms of the phase screen `exp(iκh)` of heights `h` |
//! | [`table`] | the power spectrum `S(f; κ)` over spatial frequencies `f = (u, v)/λ` and phase rates `κ` |
//! | [`colour_table`] | the reflectance in linear sRGB over the scattering vector |
//! | [`scattering`] | factors of a pair of directions: scattering vector, obliquity, Fresnel |
//! | [`sampling`] | sampling of outgoing directions, and its density |
//! | [`energy`] | the albedo (reflected fraction of light), by which the reflectance is divided to conserve energy |
//! | [`lobe`] | the BSDF that renderers evaluate and sample, by scalar theory |
//! | `grating` | the BSDF of a grating by Maxwell's equations (feature `rigorous`) |
//! | [`methods`] | the reflectance as the realtime renderer evaluates it, in Rust and WGSL |
//! | [`config`] | a surface's parameters and defaults |
//!
//! Three modules stand outside this order: [`colour`] (spectra to sRGB), [`numeric`] (number types over which
//! evaluators are generic: plain, SIMD, and those of the Mitsuba plugin), and `cache` (tables on disk; feature
//! `cache`).
//!
//! The command line, the Mitsuba plugin, the C interface and the realtime renderer are separate packages, which depend
//! on this library.
//!
//! # Conventions
//!
//! - Local frame: z is the normal, x the tangent, y the bitangent. `wi` and `wo` have unit length and point away from
//!   the surface, to the light and to the viewer.
//! - The scattering vector `q = wi + wo = (u, v, w)`: `u = wi.x + wo.x`, `v = wi.y + wo.y`, `w = cosθi + cosθo`.
//! - Lengths on the surface are in µm and wavelengths in nm. Only in the equations of this page is λ in µm.
//! - Heights `h` grow along the normal, columns of a height field along +x and rows along +y.
//! - The phase rate is `κ = 2πw/λ` in rad per µm of height: light at the height h gains the phase κh. A tile (one
//!   period of the relief) of `Lx` by `Ly` has the order amplitudes `c_j(κ) = mean over the tile of
//!   exp(iκh)·exp(+2πi(jx·x/Lx + jy·y/Ly))`: the exponent's sign is positive. Order `j = (jx, jy)` leaves at
//!   `u = λ·jx/Lx`, `v = λ·jy/Ly`. Order 0 of a flat tile has the amplitude 1.
//! - Bins of a two-dimensional transform are stored `[jy][jx]`, non-negative orders first (FFT order).
//! - The reflectance `f_r` is in 1/sr and does not contain the cosine; a `pdf` is per solid angle.
//!
//! # Features
//!
//! - `files`: reads height fields from files and writes them.
//! - `cache`: keeps tables on disk.
//! - `rigorous`: computes gratings by Maxwell's equations.
//! - `full` (default): all three. Only then does [`SurfaceConfig`] build the surfaces that it describes.

#[cfg(feature = "cache")]
pub mod cache;
// Clock of build times, also in browsers.
mod clock;
pub mod colour;
pub mod colour_table;
pub mod config;
pub mod energy;
#[cfg(feature = "rigorous")]
pub mod grating;
pub mod lobe;
pub mod methods;
pub mod numeric;
pub mod sampling;
pub mod scattering;
pub mod table;
pub mod transform;

#[doc(inline)]
pub use sunbeam_height_field as height_field;

#[cfg(feature = "cache")]
pub use cache::Cache;
pub use config::SurfaceConfig;
pub use height_field::{HeightField, Preset};
pub use lobe::Surface;
pub use scattering::Options;
pub use table::{Model, Tiling};
