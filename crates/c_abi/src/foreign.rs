//! Pointers from C: checks, and safe access to the data behind them.
//!
//! [`Floats`] and [`FloatsOut`] are the structs that callers pass; [`Input`] and [`Output`] are their checked forms.
//! A pointer must not be null and must be aligned, and items of an output must not overlap. The caller answers for the
//! size of an array, which cannot be checked.

use super::status::CallError;
use std::ffi::{CStr, c_char};

/// A strided array of floats to be read, owned by the caller: item `i` begins at `data + i * stride`.
///
/// The stride is in floats and may be negative. With stride 0 all items have the same values.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct Floats {
    /// Beginning of the first item.
    pub data: *const f32,
    /// Distance between the beginnings of consecutive items, in floats.
    pub stride: isize,
}

/// A strided array of floats to be written, owned by the caller: item `i` begins at `data + i * stride`.
///
/// The stride is in floats and may be negative. Items must not overlap.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct FloatsOut {
    /// Beginning of the first item.
    pub data: *mut f32,
    /// Distance between the beginnings of consecutive items, in floats.
    pub stride: isize,
}

/// Checked [`Floats`].
#[derive(Clone, Copy)]
pub(super) struct Input {
    data: *const f32,
    stride: isize,
}

/// Checked [`FloatsOut`], with items of `width` floats.
#[derive(Clone, Copy)]
pub(super) struct Output {
    data: *mut f32,
    stride: isize,
    width: usize,
}

impl Input {
    /// Checks an array of `count` items.
    ///
    /// # Safety
    /// The floats of all `count` items that are passed to [`Input::at`] must be readable until the call ends.
    pub(super) unsafe fn new(argument: &'static str, floats: Floats, count: usize) -> Result<Self, CallError> {
        check_pointer(argument, floats.data, count)?;
        Ok(Self { data: floats.data, stride: floats.stride })
    }

    /// Float `k` of item `i`.
    pub(super) fn at(&self, i: usize, k: usize) -> f32 {
        // SAFETY: by the contract of `new`, item i < count is readable, and lies in the array of the caller.
        unsafe { self.data.offset(i as isize * self.stride).add(k).read() }
    }

    /// The three floats of item `i`.
    pub(super) fn three(&self, i: usize) -> [f64; 3] {
        std::array::from_fn(|k| f64::from(self.at(i, k)))
    }
}

impl Output {
    /// Checks an array of `count` items of `width` floats.
    ///
    /// # Safety
    /// All `count` items must be writable until the call ends, and not be accessed by anyone else.
    pub(super) unsafe fn new(
        argument: &'static str,
        floats: FloatsOut,
        width: usize,
        count: usize,
    ) -> Result<Self, CallError> {
        check_pointer(argument, floats.data, count)?;
        if count > 1 && floats.stride.unsigned_abs() < width {
            return Err(CallError::Overlap { argument, stride: floats.stride, width });
        }
        Ok(Self { data: floats.data, stride: floats.stride, width })
    }

    /// Writes float `k` of item `i`.
    pub(super) fn set(&self, i: usize, k: usize, value: f32) {
        debug_assert!(k < self.width);
        // SAFETY: as for `Input::at`.
        unsafe { self.data.offset(i as isize * self.stride).add(k).write(value) }
    }

    /// Writes zeros to item `i`.
    pub(super) fn clear(&self, i: usize) {
        (0..self.width).for_each(|k| self.set(i, k, 0.0));
    }
}

/// Refuses null and misaligned pointers, except for arrays without items.
fn check_pointer(argument: &'static str, data: *const f32, count: usize) -> Result<(), CallError> {
    if count == 0 {
        return Ok(());
    }
    if data.is_null() {
        return Err(CallError::Null { argument });
    }
    if !data.is_aligned() {
        return Err(CallError::Misaligned { argument });
    }
    Ok(())
}

/// A shared reference from a pointer; null is an error.
///
/// # Safety
/// Unless null, it must point to a `T` that outlives `'a` and is not changed meanwhile.
pub(super) unsafe fn reference<'a, T>(argument: &'static str, pointer: *const T) -> Result<&'a T, CallError> {
    // SAFETY: by the contract above.
    unsafe { pointer.as_ref() }.ok_or(CallError::Null { argument })
}

/// A mutable reference from a pointer to a result; null is an error.
///
/// # Safety
/// Unless null, it must point to a writable `T` that nobody else uses during `'a`.
pub(super) unsafe fn output<'a, T>(argument: &'static str, pointer: *mut T) -> Result<&'a mut T, CallError> {
    // SAFETY: by the contract above.
    unsafe { pointer.as_mut() }.ok_or(CallError::Null { argument })
}

/// A string from a pointer; null and invalid UTF-8 are errors.
///
/// # Safety
/// Unless null, it must point to a string with a terminating NUL that outlives `'a` and is not changed meanwhile.
pub(super) unsafe fn text<'a>(argument: &'static str, pointer: *const c_char) -> Result<&'a str, CallError> {
    if pointer.is_null() {
        return Err(CallError::Null { argument });
    }
    // SAFETY: by the contract above.
    unsafe { CStr::from_ptr(pointer) }.to_str().map_err(|source| CallError::NotText { argument, source })
}
