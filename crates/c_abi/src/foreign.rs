//! Pointers from C, checked and read: the unsafe half of the room.

use super::status::CallError;
use std::ffi::{CStr, c_char};

/// Floats that the caller owns, to be read: item `i` begins at `data + i * stride`.
///
/// The stride is counted in floats, may be negative, and 0 gives every item the same values.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct Floats {
    /// Where the first item begins.
    pub data: *const f32,
    /// Floats from the beginning of an item to that of the next.
    pub stride: isize,
}

/// Floats that the caller owns, to be written: item `i` begins at `data + i * stride`.
///
/// The stride is counted in floats and may be negative; items must not overlap.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct FloatsOut {
    /// Where the first item begins.
    pub data: *mut f32,
    /// Floats from the beginning of an item to that of the next.
    pub stride: isize,
}

/// [`Floats`] that were checked.
#[derive(Clone, Copy)]
pub(super) struct Input {
    data: *const f32,
    stride: isize,
}

/// [`FloatsOut`] that were checked.
#[derive(Clone, Copy)]
pub(super) struct Output {
    data: *mut f32,
    stride: isize,
    width: usize,
}

impl Input {
    /// # Safety
    /// For every item up to `count`, `width` floats must be readable from its beginning until the call ends.
    pub unsafe fn new(argument: &'static str, floats: Floats, count: usize) -> Result<Self, CallError> {
        check_pointer(argument, floats.data, count)?;
        Ok(Self { data: floats.data, stride: floats.stride })
    }

    /// Float `k` of item `i`.
    pub fn at(&self, i: usize, k: usize) -> f32 {
        // SAFETY: the caller of `new` vouched for every item below its count, and its offset is within one object of theirs.
        unsafe { self.data.offset(i as isize * self.stride).add(k).read() }
    }

    /// Item `i`, of three floats.
    pub fn three(&self, i: usize) -> [f64; 3] {
        std::array::from_fn(|k| f64::from(self.at(i, k)))
    }
}

impl Output {
    /// # Safety
    /// For every item up to `count`, `width` floats must be writable from its beginning until the call ends, by nobody else.
    pub unsafe fn new(
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
    pub fn set(&self, i: usize, k: usize, value: f32) {
        debug_assert!(k < self.width);
        // SAFETY: as for `Input::at`.
        unsafe { self.data.offset(i as isize * self.stride).add(k).write(value) }
    }

    /// Writes zeros to item `i`.
    pub fn clear(&self, i: usize) {
        (0..self.width).for_each(|k| self.set(i, k, 0.0));
    }
}

/// An array of nothing may be null.
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

/// A reference from a pointer that must not be null.
///
/// # Safety
/// Unless null, it must point to a `T` that outlives `'a` and is not changed meanwhile.
pub(super) unsafe fn reference<'a, T>(argument: &'static str, pointer: *const T) -> Result<&'a T, CallError> {
    // SAFETY: by the contract above.
    unsafe { pointer.as_ref() }.ok_or(CallError::Null { argument })
}

/// Where a result goes: the same for a place to be written.
///
/// # Safety
/// Unless null, it must point to a writable `T` that nobody else uses during `'a`.
pub(super) unsafe fn place<'a, T>(argument: &'static str, pointer: *mut T) -> Result<&'a mut T, CallError> {
    // SAFETY: by the contract above.
    unsafe { pointer.as_mut() }.ok_or(CallError::Null { argument })
}

/// A string of UTF-8.
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
