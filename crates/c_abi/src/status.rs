//! Status codes, and the error message of each thread.

use std::cell::RefCell;
use std::ffi::{CString, c_char};
use sunbeam::config::BuildError;
use sunbeam_guard::{Panic, guard};

/// Result of a call. With any code but `SUNBEAM_STATUS_OK`, `sunbeam_last_error` returns a message.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Status {
    /// Success.
    Ok = 0,
    /// A required pointer is null, or a pointer is misaligned.
    BadPointer = 1,
    /// A number, direction, stride or size is not accepted. If items of a batch are bad, their results are zeros
    /// and all other items have been computed.
    BadValue = 2,
    /// The configuration is not JSON in UTF-8, contradicts itself, or has an unknown name or a value that is refused.
    /// Or an environment variable of the cache has a value that is refused.
    BadConfig = 3,
    /// The file of heights cannot be read, or the heights of a file or an array are refused, for example because
    /// some are missing.
    BadHeightField = 4,
    /// The tables cannot be built, for example because they would be too large.
    BadTables = 5,
    /// The buffer is too small for the text. The required size has been written to `*needed`.
    BufferTooSmall = 6,
    /// A defect of the library, such as a caught panic.
    Internal = 7,
}

/// Error of an export; its `Display` form is the message. `argument` is the name of the C function's argument.
#[derive(Debug, thiserror::Error)]
pub(super) enum CallError {
    /// A required pointer is null.
    #[error("`{argument}` is null")]
    Null { argument: &'static str },
    /// An address is no multiple of its type's alignment.
    #[error("`{argument}` is not aligned to {alignment} bytes")]
    Misaligned { argument: &'static str, alignment: usize },
    /// A string is not UTF-8.
    #[error("`{argument}` is not UTF-8: {source}")]
    NotText { argument: &'static str, source: std::str::Utf8Error },
    /// Items of an output would share floats. `width` is the number of floats of an item.
    #[error("`{argument}` has a stride of {stride} floats, but each item has {width}; items must not overlap")]
    Overlap { argument: &'static str, stride: isize, width: usize },
    /// A number of wavelengths or heights is out of range. `accepted` describes the range.
    #[error("`{argument}` is {found}, but must be {accepted}")]
    Size { argument: &'static str, found: usize, accepted: String },
    /// Items of a batch are bad (`batch.rs`). `first` is the index of the first of them, `reason` its error.
    #[error("{bad} of {count} items are not usable; the first is item {first}: {reason}")]
    Items { bad: usize, count: usize, first: usize, reason: String },
    /// A text does not fit the caller's buffer of `capacity` bytes.
    #[error("the text takes {needed} bytes with its terminating NUL, but `capacity` is {capacity}")]
    BufferTooSmall { needed: usize, capacity: usize },
    /// A surface cannot be built.
    #[error(transparent)]
    Build(#[from] BuildError),
    /// A panic was caught, or an error that only a defect of the library can cause.
    #[error(transparent)]
    Panic(#[from] Panic),
}

impl CallError {
    /// Status code of the error.
    fn status(&self) -> Status {
        match self {
            Self::Null { .. } | Self::Misaligned { .. } => Status::BadPointer,
            Self::Overlap { .. } | Self::Size { .. } | Self::Items { .. } => Status::BadValue,
            // The only string argument is the configuration. `Method` does not occur, since no call builds a method.
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
    /// Message of the last failed call of the thread; empty before the first.
    static MESSAGE: RefCell<CString> = RefCell::default();
}

/// Runs the body of an exported function. Converts an error or a panic into a status, and stores its message for the
/// thread. A success leaves the message as it is.
pub(super) fn call(body: impl FnOnce() -> Result<(), CallError>) -> Status {
    // `guard` turns a panic into `CallError::Panic`.
    let Err(error) = guard(body) else { return Status::Ok };
    let mut text = error.to_string().into_bytes();
    text.retain(|byte| *byte != 0);
    // Messages are one line each, but a panic's text may have several.
    text.iter_mut().filter(|byte| **byte == b'\n').for_each(|byte| *byte = b' ');
    // Without NULs, `CString::new` succeeds.
    let text = CString::new(text).unwrap_or_default();
    // `try_with` fails only while the thread ends. Nobody can read the message then.
    let _ = MESSAGE.try_with(|message| message.replace(text));
    error.status()
}

/// Returns the message of the last failed call of this thread, one line of UTF-8. The string is empty if no call
/// has failed. The pointer is never null.
///
/// The string is valid until the next failing call of this thread, or until the thread ends.
#[unsafe(no_mangle)] // SAFETY: no other library has symbols with this prefix.
pub extern "C" fn sunbeam_last_error() -> *const c_char {
    // The pointer outlives the borrow: the string's memory stays until `call` replaces it.
    MESSAGE.try_with(|message| message.borrow().as_ptr()).unwrap_or(c"".as_ptr())
}
