//! The C ABI. cbindgen writes its header, `include/sunbeam.h`, from the sources of this crate (`make header`).
//!
//! - A surface is an opaque handle, made from a JSON configuration (`handle.rs`).
//! - Batches of directions are strided arrays of floats, [`Floats`] and [`FloatsOut`] (`batch.rs`).
//! - Every export runs its body in `call` (`status.rs`): errors and panics become a [`Status`] and a message of the
//!   thread, and nothing unwinds into foreign code.
//! - All pointers from C are checked and dereferenced in `foreign.rs`.
//!
//! Comments of exports are part of the header: they are written for C programmers, in at most 110 columns.

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
