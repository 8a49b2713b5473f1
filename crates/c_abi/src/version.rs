//! Version of the header and of the library.

use std::ffi::{CStr, c_char};

/// Major version of this header. `sunbeam_version` returns the version of the library at run time.
pub const SUNBEAM_VERSION_MAJOR: u32 = 0;
/// Minor version of this header.
pub const SUNBEAM_VERSION_MINOR: u32 = 1;
/// Patch version of this header.
pub const SUNBEAM_VERSION_PATCH: u32 = 0;

/// Returns the version of the library in use, such as `0.1.0`, as a static string.
#[unsafe(no_mangle)] // SAFETY: no other library has symbols with this prefix.
pub extern "C" fn sunbeam_version() -> *const c_char {
    // The version has no NUL, so the error does not occur.
    const VERSION: &CStr = match CStr::from_bytes_with_nul(concat!(env!("CARGO_PKG_VERSION"), "\0").as_bytes()) {
        Ok(version) => version,
        Err(_) => c"unknown",
    };
    VERSION.as_ptr()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn header_has_the_version_of_the_package() {
        let numbers = [SUNBEAM_VERSION_MAJOR, SUNBEAM_VERSION_MINOR, SUNBEAM_VERSION_PATCH];
        assert_eq!(numbers.map(|number| number.to_string()).join("."), env!("CARGO_PKG_VERSION"));
    }
}
