//! The library behind the page that shows a relief's colours in a browser.
//!
//! `README.md` of this crate documents the interface to the page. Code that needs a browser (`wasm/`) is compiled for
//! `wasm32` only. Everything else is tested natively: `examples/page_twin.rs` draws the page's pictures with it.
//!
//! - [`Settings`] are the page's controls as JSON.
//! - [`Relief`] reads heights. It makes a method's data for the GPU, a [`Reflectance`] or [`Spectra`] for the
//!   processor, and a picture of the heights.
//! - [`share`] turns settings into a command and into a scene for Mitsuba.

mod catalogue;
mod error;
pub mod image;
mod method_data;
mod reflectance;
mod relief;
mod settings;
#[cfg(test)]
mod settings_tests;
pub mod share;
mod spectra;
#[cfg(target_arch = "wasm32")]
mod wasm;

pub use catalogue::catalogue;
pub use error::WebError;
pub use method_data::MethodData;
pub use reflectance::{Reflectance, direction};
pub use relief::{Facts, Relief, WebEstimate};
pub use settings::{CameraSettings, Keys, MapSettings, Pigment, Settings, SunSettings};
pub use spectra::{SPECTRUM_COUNT, Spectra};
