//! Dr.Jit's functions for tracing, declared for C++ in `cpp_shim/jit.h`. Arguments and results are indices of Dr.Jit's
//! variables, without derivatives. A variable is an array; a *lane* is one position in all arrays of a kernel.
//! `backend` is the number of a `JitBackend`, LLVM or CUDA.
//!
//! Each operation borrows its operands, records one operation of Dr.Jit, and returns a new reference to the result.
//! Index 0 stands for no variable: an operation that fails, or has an operand 0, returns 0. The first error message of
//! a thread is kept for [`take_error`]; nothing throws.
//!
//! cxx checks these declarations against the header when it compiles. [`run_loop`] calls back into a [`Loop`]. A panic
//! of its condition or body does not unwind through C++: the loop stores it, and [`Loop::panicked`] returns it after
//! C++ has returned.

use std::any::Any;
use std::panic::{AssertUnwindSafe, catch_unwind};

pub(crate) use ffi::*;

#[allow(unreachable_pub, reason = "cxx declares all functions public")]
#[cxx::bridge(namespace = "sunbeam::jit")]
mod ffi {
    unsafe extern "C++" {
        include!("jit.h");

        // `retain` adds a reference to a variable and returns its index; `release` removes a reference.
        fn retain(index: u32) -> u32;
        fn release(index: u32);

        // Variables with one constant element.
        fn constant_f32(backend: u32, value: f32) -> u32;
        fn constant_f64(backend: u32, value: f64) -> u32;
        fn constant_u32(backend: u32, value: u32) -> u32;
        fn constant_bool(backend: u32, value: bool) -> u32;

        // Arithmetic, element by element; operands and result have the same type. `fma` is `a·b + c`.
        fn add(a: u32, b: u32) -> u32;
        fn sub(a: u32, b: u32) -> u32;
        fn mul(a: u32, b: u32) -> u32;
        fn div(a: u32, b: u32) -> u32;
        fn min(a: u32, b: u32) -> u32;
        fn max(a: u32, b: u32) -> u32;
        fn fma(a: u32, b: u32, c: u32) -> u32;
        fn neg(a: u32) -> u32;
        fn abs(a: u32) -> u32;
        fn sqrt(a: u32) -> u32;
        fn floor(a: u32) -> u32;
        fn ceil(a: u32) -> u32;
        fn exp2(a: u32) -> u32;
        fn log2(a: u32) -> u32;

        // Comparisons with a mask as result, operations on masks and unsigned integers, and selection by a mask.
        // `by`, a number of bits, is a variable, too.
        fn lt(a: u32, b: u32) -> u32;
        fn le(a: u32, b: u32) -> u32;
        fn bit_and(a: u32, b: u32) -> u32;
        fn bit_or(a: u32, b: u32) -> u32;
        fn bit_not(a: u32) -> u32;
        fn shl(a: u32, by: u32) -> u32;
        fn shr(a: u32, by: u32) -> u32;
        fn select(mask: u32, yes: u32, no: u32) -> u32;

        // Conversions of values; `to_u32` rounds towards zero. `f32_from_bits` reinterprets the bits of an integer.
        fn to_f32(a: u32) -> u32;
        fn to_f64(a: u32) -> u32;
        fn to_u32(a: u32) -> u32;
        fn f32_from_bits(a: u32) -> u32;

        /// Reads `W` = `results.len()` elements (1, 2 or 4) of the array `source` from element `W·at` on, zeros where
        /// the mask is false. `at` is a variable of unsigned integers. Writes the index of one variable for each
        /// element to `results`; all are 0 after an error.
        fn gather(source: u32, at: u32, mask: u32, results: &mut [u32]);

        /// Records a loop, or runs it step by step if Dr.Jit's symbolic loops are off. `name` labels it. Returns false
        /// if Dr.Jit failed, a callback panicked, or an earlier error is stored.
        ///
        /// # Safety
        /// `name` ends with a zero and is never freed: kernels keep it.
        unsafe fn run_loop<'a>(backend: u32, name: *const c_char, traced_loop: &mut Loop<'a>) -> bool;

        /// Stores an error message unless one is stored.
        fn keep_error(message: &str);
        /// Returns the stored message and clears it; empty if there is none.
        fn take_error() -> String;
    }

    // The methods are `unsafe` because cxx requires it for functions with lifetimes; calling them has no conditions.
    extern "Rust" {
        type Loop<'a>;
        /// Appends a new reference to each variable of the state.
        unsafe fn read<'a>(self: &Loop<'a>, indices: &mut Vec<u32>);
        /// Replaces the state's variables by the given ones, which the call borrows.
        unsafe fn write<'a>(self: &mut Loop<'a>, indices: &[u32]);
        /// Mask of the lanes that take another step, borrowed from the loop; 0 after a panic or an error.
        unsafe fn condition<'a>(self: &mut Loop<'a>) -> u32;
        /// Computes the next state; false after a panic.
        unsafe fn body<'a>(self: &mut Loop<'a>) -> bool;
    }
}

/// State, condition and body of a loop.
///
/// The state keeps the references to its variables. [`LoopParts::read`] and [`LoopParts::write`] must not panic: Dr.Jit
/// cannot be told of their failure, so the process would end.
pub(crate) trait LoopParts {
    /// Visits the index of each variable of the state, which the visitor borrows.
    fn read(&self, visit: &mut dyn FnMut(u32));
    /// Replaces the variables of the state, in the order of [`LoopParts::read`]. The new ones are borrowed: the state
    /// retains them.
    fn write(&mut self, indices: &[u32]);
    /// Index of the mask of lanes that take another step; the implementor keeps its reference.
    fn condition(&mut self) -> u32;
    /// Computes the next state.
    fn body(&mut self);
}

/// A loop as C++ sees it: forwards the callbacks to [`LoopParts`], and catches panics of condition and body.
pub(crate) struct Loop<'a> {
    parts: &'a mut dyn LoopParts,
    panic: Option<Box<dyn Any + Send>>,
}

impl<'a> Loop<'a> {
    /// A loop for [`run_loop`].
    pub(crate) fn new(parts: &'a mut dyn LoopParts) -> Self {
        Self { parts, panic: None }
    }

    /// Payload of the panic that ended the loop, if there was one.
    pub(crate) fn panicked(self) -> Option<Box<dyn Any + Send>> {
        self.panic
    }

    fn read(&self, indices: &mut Vec<u32>) {
        self.parts.read(&mut |index| indices.push(retain(index)));
    }

    fn write(&mut self, indices: &[u32]) {
        self.parts.write(indices);
    }

    fn condition(&mut self) -> u32 {
        self.caught(0, |parts| parts.condition())
    }

    fn body(&mut self) -> bool {
        self.caught(false, |parts| {
            parts.body();
            true
        })
    }

    /// Result of `call`. If it panics, stores the panic and returns `failed`.
    fn caught<T>(&mut self, failed: T, call: impl FnOnce(&mut dyn LoopParts) -> T) -> T {
        // Unwind safe: after a panic the loop ends and its state is not used again.
        catch_unwind(AssertUnwindSafe(|| call(self.parts))).unwrap_or_else(|payload| {
            self.panic = Some(payload);
            failed
        })
    }
}
