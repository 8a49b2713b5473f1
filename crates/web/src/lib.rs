//! The page that shows a relief's colours in a browser: what it asks of the library, and the settings that say what is seen.
//!
//! `README.md` beside this crate is the page's manual. What needs a browser is compiled for `wasm32` alone; everything
//! else is the same natively, where it is tested, and where `examples/page_twin.rs` draws what the page draws.
//!
//! - [`Settings`] are the page's controls as JSON.
//! - [`Relief`] reads heights and makes a method's data, a [`Reflectance`] or [`Spectra`] of the processor, or a picture of the heights.
//! - [`share`] says the same to the command line and to Mitsuba.

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
