//! Dr.Jit's functions for tracing (`cpp_shim/jit.h`). Arguments and results are indices of variables.
//!
//! Each function records one operation and returns a new reference to its result, or 0 after an error. The first error
//! message is kept for [`take_error`]; nothing throws.
//!
//! cxx checks these declarations against the header when it compiles. Loops call back into [`Steps`]; a panic there
//! does not enter C++, but waits in [`Loop::panicked`] until C++ has returned.

use std::any::Any;
use std::panic::{AssertUnwindSafe, catch_unwind};

pub(crate) use ffi::*;

#[allow(unreachable_pub, reason = "cxx declares all functions public")]
#[cxx::bridge(namespace = "sunbeam::jit")]
mod ffi {
    unsafe extern "C++" {
        include!("jit.h");

        // References: a new one to a variable, and the end of one.
        fn retain(index: u32) -> u32;
        fn release(index: u32);

        // Constants.
        fn constant_f32(backend: u32, value: f32) -> u32;
        fn constant_f64(backend: u32, value: f64) -> u32;
        fn constant_u32(backend: u32, value: u32) -> u32;
        fn constant_bool(backend: u32, value: bool) -> u32;

        // Arithmetic, element by element; the type is that of the operands.
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

        // Comparisons, which give masks, and operations on masks and unsigned integers.
        fn lt(a: u32, b: u32) -> u32;
        fn le(a: u32, b: u32) -> u32;
        fn bit_and(a: u32, b: u32) -> u32;
        fn bit_or(a: u32, b: u32) -> u32;
        fn bit_not(a: u32) -> u32;
        fn shl(a: u32, by: u32) -> u32;
        fn shr(a: u32, by: u32) -> u32;
        fn select(mask: u32, yes: u32, no: u32) -> u32;

        // Conversions.
        fn to_f32(a: u32) -> u32;
        fn to_f64(a: u32) -> u32;
        fn to_u32(a: u32) -> u32;
        fn f32_from_bits(a: u32) -> u32;

        /// Reads `indices.len()` consecutive `u32` of the array `source` from position `at × indices.len()` on, where
        /// the mask is set, and writes the indices of the resulting variables.
        fn gather(source: u32, at: u32, mask: u32, indices: &mut [u32]);

        /// # Safety
        /// `name` ends with a zero and is never freed: kernels keep it.
        unsafe fn run_loop<'a>(backend: u32, name: *const c_char, steps: &mut Loop<'a>) -> bool;

        /// Stores an error message unless there is one already.
        fn keep_error(message: &str);
        /// Returns the stored message and clears it; empty if there is none.
        fn take_error() -> String;
    }

    extern "Rust" {
        type Loop<'a>;
        /// Appends a new reference to each variable of the state.
        unsafe fn read<'a>(self: &Loop<'a>, indices: &mut Vec<u32>);
        /// Replaces the state's variables by borrowed ones.
        unsafe fn write<'a>(self: &mut Loop<'a>, indices: &[u32]);
        /// The borrowed mask of lanes that take another step; 0 on failure.
        unsafe fn condition<'a>(self: &mut Loop<'a>) -> u32;
        /// Takes a step; false on failure.
        unsafe fn body<'a>(self: &mut Loop<'a>) -> bool;
    }
}

/// State of a loop and its operations.
pub(crate) trait Steps {
    /// Visits the index of each variable of the state.
    fn read(&self, visit: &mut dyn FnMut(u32));
    /// Replaces the variables of the state.
    fn write(&mut self, indices: &[u32]);
    /// Index of the mask of lanes that take another step.
    fn condition(&mut self) -> u32;
    /// Takes one step.
    fn step(&mut self);
}

/// A loop that C++ records with callbacks to [`Steps`].
pub(crate) struct Loop<'a> {
    steps: &'a mut dyn Steps,
    panic: Option<Box<dyn Any + Send>>,
}

impl<'a> Loop<'a> {
    /// A loop over `steps`, for [`run_loop`].
    pub(crate) fn new(steps: &'a mut dyn Steps) -> Self {
        Self { steps, panic: None }
    }

    /// The payload of a panic that ended the loop.
    pub(crate) fn panicked(self) -> Option<Box<dyn Any + Send>> {
        self.panic
    }

    fn read(&self, indices: &mut Vec<u32>) {
        self.steps.read(&mut |index| indices.push(retain(index)));
    }

    fn write(&mut self, indices: &[u32]) {
        self.steps.write(indices);
    }

    fn condition(&mut self) -> u32 {
        self.caught(0, |steps| steps.condition())
    }

    fn body(&mut self) -> bool {
        self.caught(false, |steps| {
            steps.step();
            true
        })
    }

    /// The result of `call`, or `failed` where it panics; the panic is stored.
    fn caught<T>(&mut self, failed: T, call: impl FnOnce(&mut dyn Steps) -> T) -> T {
        // After a panic the loop ends and the state is not used again, so it may be inconsistent.
        catch_unwind(AssertUnwindSafe(|| call(self.steps))).unwrap_or_else(|payload| {
            self.panic = Some(payload);
            failed
        })
    }
}
