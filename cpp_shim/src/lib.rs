//! The Rust side of the Mitsuba plugin; the C++ side lies beside this folder.
//!
//! A *variant* is a compilation of Mitsuba for one kind of numbers. [`bridge`] has the functions that C++ calls. Scalar
//! variants call them with plain numbers, ray by ray. In `llvm_*` and `cuda_*` variants a call records the same
//! evaluators as operations on variables of Dr.Jit, Mitsuba's compiler; this is *tracing* ([`traced`], through the
//! functions of [`jit`], within a [`scope`]). Neither exceptions nor panics cross the boundary: cxx turns an `Err` into
//! an exception, and what Dr.Jit throws is caught in `cpp_shim/jit.cpp`. Only [`init_plugin`] is meant for others to
//! call.

mod bridge;
mod describe;
mod jit;
#[cfg(test)]
mod jit_tests;
mod log;
mod scope;
mod traced;

// The plugin also exports the C interface, which the Python package (python/) calls with NumPy arrays.
use sunbeam_c as _;

use std::ffi::{c_char, c_void};

// SAFETY: `cpp_shim/diffraction.cpp` defines this function with exactly this signature on the x86-64 System V ABI,
// where a `std::string_view` by value is `{length, pointer}` in two integer registers.
unsafe extern "C-unwind" {
    fn sunbeam_register_variants(name_len: usize, name: *const c_char, register: *const c_void);
}

/// The symbol that Mitsuba looks up in a plugin: `void init_plugin(std::string_view, PluginRegisterFn)`.
///
/// It is here and not in C++ because Cargo exports only Rust symbols from a `cdylib`. C++ exceptions pass through.
///
/// # Safety
/// Only for Mitsuba's plugin manager, with arguments as in `mitsuba/core/object.h`.
#[unsafe(no_mangle)] // SAFETY: no other symbol of this name exists in a plugin; Mitsuba prescribes it.
pub unsafe extern "C-unwind" fn init_plugin(name_len: usize, name: *const c_char, register: *const c_void) {
    // SAFETY: the arguments are handed on as they came; the callee has the signature that Mitsuba calls.
    unsafe { sunbeam_register_variants(name_len, name, register) }
}
