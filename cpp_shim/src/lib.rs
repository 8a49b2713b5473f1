//! The Rust side of the Mitsuba plugin; the C++ side is in the parent folder, `cpp_shim/`.
//!
//! - A *variant* is a compilation of Mitsuba for one type of numbers and one representation of spectra.
//! - [`bridge`] has the functions that C++ calls. Scalar variants call them with plain numbers, ray by ray.
//!   [`describe`] has the text that Mitsuba shows for a BSDF, [`log`](self::log) the messages for its log.
//! - *Tracing* serves the variants `llvm_*` and `cuda_*`: a call runs the same evaluators once over variables of
//!   Dr.Jit, Mitsuba's compiler, which records their operations for its kernel. [`traced`] has these numbers, [`jit`]
//!   the functions of Dr.Jit, and [`scope`] the ownership of variables.
//! - Panics do not reach C++, and C++ exceptions do not reach Rust. cxx turns an `Err` into an exception, and `jit.cpp`
//!   catches those of Dr.Jit. Only [`init_plugin`] lets C++ exceptions pass.

mod bridge;
mod describe;
mod jit;
#[cfg(test)]
mod jit_tests;
mod log;
mod scope;
mod traced;

// Links the C interface into the plugin. The Python package (python/) calls it with NumPy arrays.
use sunbeam_c as _;

use std::ffi::{c_char, c_void};

// SAFETY: `cpp_shim/diffraction.cpp` defines this function with exactly this signature on the x86-64 System V ABI,
// where a `std::string_view` of libstdc++ by value is `{length, pointer}` in two integer registers, and a function
// pointer (`register`) is a pointer.
unsafe extern "C-unwind" {
    fn sunbeam_register_variants(name_len: usize, name: *const c_char, register: *const c_void);
}

/// Entry point of the plugin, which Mitsuba looks up by name: `void init_plugin(std::string_view, PluginRegisterFn)`.
///
/// The function is in Rust because Cargo exports only Rust symbols from a `cdylib`. C++ exceptions pass through.
///
/// # Safety
/// Only for Mitsuba's plugin manager, with arguments as in `mitsuba/core/object.h`.
#[unsafe(no_mangle)] // SAFETY: no other symbol of this name exists in a plugin; Mitsuba prescribes it.
pub unsafe extern "C-unwind" fn init_plugin(name_len: usize, name: *const c_char, register: *const c_void) {
    // SAFETY: the arguments are passed on unchanged to a function with the signature that Mitsuba calls.
    unsafe { sunbeam_register_variants(name_len, name, register) }
}
