//! The library behind the page that shows a relief's colours in a browser.
//!
//! `README.md` of this crate documents the interface to the page. Code that needs a browser (`wasm/`) is compiled for
//! `wasm32` only. All other code is tested natively: `examples/page_twin.rs` draws the page's pictures with it.
//!
//! - [`Settings`] are the page's controls as JSON.
//! - [`Relief`] reads heights. It builds a realtime method as bytes for the GPU ([`MethodData`]), or evaluators for the
//!   CPU: [`Reflectance`] for colours and [`Spectra`] for spectra.
//! - [`mod@image`] encodes reliefs, BRDF maps and rendered pictures.
//! - [`share`] exports settings as a command and as a scene for Mitsuba.
//! - [`catalogue()`] lists the choices of the page's controls.

mod catalogue;
mod error;
pub mod image;
mod method_data;
mod reflectance;
mod relief;
mod settings;
pub mod share;
mod spectra;
#[cfg(target_arch = "wasm32")]
mod wasm;

pub use catalogue::catalogue;
pub use error::WebError;
pub use method_data::MethodData;
pub use reflectance::{Reflectance, direction};
pub use relief::{Facts, Relief};
pub use settings::{CameraSettings, Keys, MapSettings, Pigment, Settings, SunSettings};
pub use spectra::{SPECTRUM_COUNT, Spectra};
