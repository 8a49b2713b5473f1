//! What a call ends with, and the message of the thread that made it.

use std::cell::RefCell;
use std::ffi::{CString, c_char};
use sunbeam::config::BuildError;
use sunbeam_guard::{Panic, guard};

/// What a call ended with. Anything but `SUNBEAM_STATUS_OK` comes with a message from `sunbeam_last_error`.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Status {
    /// It worked.
    Ok = 0,
    /// A pointer is null that must not be, or does not point to a whole float.
    BadPointer = 1,
    /// A number, direction, stride or size is outside of what is accepted. Where it is one of a batch, the other items
    /// were answered all the same, and the bad ones with zeros.
    BadValue = 2,
    /// The configuration is not JSON, has an unknown name, or a value out of range; or an environment variable has.
    BadConfig = 3,
    /// A height field cannot be read, or is not usable.
    BadHeightField = 4,
    /// The tables cannot be built: they would be too large.
    BadTables = 5,
    /// The buffer is too small for the text; the size that it needs was written.
    BufferTooSmall = 6,
    /// A defect of the library itself.
    Internal = 7,
}

/// Why a call failed.
#[derive(Debug, thiserror::Error)]
pub(super) enum CallError {
    #[error("`{argument}` is null")]
    Null { argument: &'static str },
    #[error("`{argument}` is not aligned to 4 bytes, as an array of float is")]
    Misaligned { argument: &'static str },
    #[error("`{argument}` is not UTF-8: {source}")]
    NotText { argument: &'static str, source: std::str::Utf8Error },
    #[error("`{argument}` has a stride of {stride} floats, but each item has {width}; items must not overlap")]
    Overlap { argument: &'static str, stride: isize, width: usize },
    #[error("`{argument}` is {found}, but must be {accepted}")]
    Size { argument: &'static str, found: usize, accepted: &'static str },
    #[error("{bad} of {count} items are not usable; the first is item {first}: {reason}")]
    Items { bad: usize, count: usize, first: usize, reason: String },
    #[error("the text takes {needed} bytes with its end, but `capacity` is {capacity}")]
    BufferTooSmall { needed: usize, capacity: usize },
    #[error(transparent)]
    Build(#[from] BuildError),
    #[error(transparent)]
    Panic(#[from] Panic),
}

impl CallError {
    fn status(&self) -> Status {
        match self {
            Self::Null { .. } | Self::Misaligned { .. } => Status::BadPointer,
            Self::Overlap { .. } | Self::Size { .. } | Self::Items { .. } => Status::BadValue,
            Self::NotText { .. }
            | Self::Build(BuildError::Config(_) | BuildError::Cache(_) | BuildError::Method(_)) => Status::BadConfig,
            Self::Build(BuildError::HeightField(_)) => Status::BadHeightField,
            Self::Build(BuildError::Table(_) | BuildError::Colours(_) | BuildError::Grating(_)) => Status::BadTables,
            Self::BufferTooSmall { .. } => Status::BufferTooSmall,
            Self::Panic(_) => Status::Internal,
        }
    }
}

thread_local! {
    static MESSAGE: RefCell<CString> = RefCell::default();
}

/// Runs the body of an export: the one place where errors and panics become a status.
pub(super) fn call(body: impl FnOnce() -> Result<(), CallError>) -> Status {
    let Err(error) = guard(body) else { return Status::Ok };
    let mut text = error.to_string().into_bytes();
    text.retain(|byte| *byte != 0);
    // No byte of it is zero now, so there is always a message.
    let text = CString::new(text).unwrap_or_default();
    // Not while the thread ends, when its storage is gone and nobody can ask any more.
    let _ = MESSAGE.try_with(|message| message.replace(text));
    error.status()
}

/// What went wrong in the last call of this thread that failed, in one line of UTF-8; empty where none did.
///
/// Valid until the next call of this thread that fails. Never null.
#[unsafe(no_mangle)] // SAFETY: the prefix keeps it from meeting a symbol of others.
pub extern "C" fn sunbeam_last_error() -> *const c_char {
    MESSAGE.try_with(|message| message.borrow().as_ptr()).unwrap_or(c"".as_ptr())
}
