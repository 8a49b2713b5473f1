//! The C ABI: `include/sunbeam.h`, which cbindgen writes from this room (see its manual for the rules of use).
//!
//! A surface is an opaque handle made from a JSON configuration; batches of directions are read and written through
//! [`Floats`] and [`FloatsOut`]. Every export runs its body in [`call`]: errors and panics become a [`Status`] and a
//! message of the thread, and nothing unwinds into foreign code. All pointers are turned into Rust's terms in [`foreign`].

mod batch;
mod foreign;
mod handle;
mod status;
mod version;

pub use batch::{sunbeam_surface_eval, sunbeam_surface_eval_pdf, sunbeam_surface_pdf, sunbeam_surface_sample};
pub use foreign::{Floats, FloatsOut};
pub use handle::{
    SurfaceHandle, sunbeam_surface_describe, sunbeam_surface_free, sunbeam_surface_from_heights, sunbeam_surface_new,
};
pub use status::{Status, sunbeam_last_error};
pub use version::{SUNBEAM_VERSION_MAJOR, SUNBEAM_VERSION_MINOR, SUNBEAM_VERSION_PATCH, sunbeam_version};

#[cfg(test)]
mod tests;
