//! The C ABI. cbindgen writes its header, `include/sunbeam.h`, from the sources of this crate (`make header`).
//!
//! - A surface is an opaque handle, made from a JSON configuration (`handle.rs`).
//! - Batches of directions are strided arrays of floats, [`Floats`] and [`FloatsOut`] (`batch.rs`).
//! - Every fallible export runs its body in `call` (`status.rs`): errors and panics become a [`Status`] and a message
//!   for the calling thread. No panic unwinds into foreign code.
//! - Pointers from C are checked in `foreign.rs`, which also reads and writes the arrays of a batch.
//!
//! Doc comments of exports become comments of the header, so they are written for C programmers. There, the heading
//! `# Safety` reads `Requirements:`.

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
