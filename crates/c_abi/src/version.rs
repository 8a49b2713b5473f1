//! The version, of the header and of the library.

use std::ffi::{CStr, c_char};

/// The first number of the version of this header; `sunbeam_version` says that of the library which the program runs with.
pub const SUNBEAM_VERSION_MAJOR: u32 = 0;
/// The second number.
pub const SUNBEAM_VERSION_MINOR: u32 = 1;
/// The third number.
pub const SUNBEAM_VERSION_PATCH: u32 = 0;

/// The version of the library, such as `0.1.0`. Static.
#[unsafe(no_mangle)] // SAFETY: the prefix keeps it from meeting a symbol of others.
pub extern "C" fn sunbeam_version() -> *const c_char {
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
    fn the_numbers_are_those_of_the_package() {
        let numbers = [SUNBEAM_VERSION_MAJOR, SUNBEAM_VERSION_MINOR, SUNBEAM_VERSION_PATCH];
        assert_eq!(numbers.map(|number| number.to_string()).join("."), env!("CARGO_PKG_VERSION"));
    }
}
