//! Checks of pointers from C, and access to the arrays behind them.
//!
//! [`Floats`] and [`FloatsOut`] are the structs that callers pass; [`Input`] and [`Output`] are their checked forms.
//! Null pointers, misaligned pointers, and outputs with overlapping items are errors. The size of an array and the
//! lifetime of a pointer cannot be checked: the caller guarantees them.

use super::status::CallError;
use std::ffi::{CStr, c_char};

/// A strided array of floats to be read, owned by the caller: item `i` begins at `data + i * stride`.
///
/// The stride is in floats and may be negative. With stride 0 all items have the same values.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct Floats {
    /// Beginning of the first item. It may be null if there are no items.
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
    /// Beginning of the first item. It may be null if there are no items.
    pub data: *mut f32,
    /// Distance between the beginnings of consecutive items, in floats.
    pub stride: isize,
}

/// Checked [`Floats`]: `count` items of `width` floats.
#[derive(Clone, Copy)]
pub(super) struct Input {
    data: *const f32,
    stride: isize,
    width: usize,
    count: usize,
}

/// Checked [`FloatsOut`]: `count` items of `width` floats.
#[derive(Clone, Copy)]
pub(super) struct Output {
    data: *mut f32,
    stride: isize,
    width: usize,
    count: usize,
}

impl Input {
    /// Checks the pointer to an array of `count` items of `width` floats; `argument` is its name in messages.
    ///
    /// # Safety
    /// All floats of all items must be readable as long as the result is used.
    pub(super) unsafe fn new(
        argument: &'static str,
        floats: Floats,
        width: usize,
        count: usize,
    ) -> Result<Self, CallError> {
        check_array(argument, floats.data, count)?;
        Ok(Self { data: floats.data, stride: floats.stride, width, count })
    }

    /// Float `k` of item `i`. Panics if there is none.
    pub(super) fn at(&self, i: usize, k: usize) -> f32 {
        assert!(i < self.count && k < self.width, "float {k} of item {i} is outside the array");
        // SAFETY: the array has this float (checked above), and the contract of `new` makes it readable.
        unsafe { self.data.offset(i as isize * self.stride).add(k).read() }
    }

    /// The first three floats of item `i`. Panics if the item has fewer.
    pub(super) fn three(&self, i: usize) -> [f64; 3] {
        std::array::from_fn(|k| f64::from(self.at(i, k)))
    }
}

impl Output {
    /// Checks the pointer to an array of `count` items of `width` floats, and that no two items overlap; `argument` is
    /// its name in messages.
    ///
    /// # Safety
    /// All floats of all items must be writable, and nothing else may access them, as long as the result is used.
    pub(super) unsafe fn new(
        argument: &'static str,
        floats: FloatsOut,
        width: usize,
        count: usize,
    ) -> Result<Self, CallError> {
        check_array(argument, floats.data, count)?;
        if count > 1 && floats.stride.unsigned_abs() < width {
            return Err(CallError::Overlap { argument, stride: floats.stride, width });
        }
        Ok(Self { data: floats.data, stride: floats.stride, width, count })
    }

    /// Writes float `k` of item `i`. Panics if there is none.
    pub(super) fn set(&self, i: usize, k: usize, value: f32) {
        assert!(i < self.count && k < self.width, "float {k} of item {i} is outside the array");
        // SAFETY: the array has this float (checked above), and the contract of `new` makes it writable.
        unsafe { self.data.offset(i as isize * self.stride).add(k).write(value) }
    }

    /// Writes zeros to item `i`.
    pub(super) fn clear(&self, i: usize) {
        (0..self.width).for_each(|k| self.set(i, k, 0.0));
    }
}

/// Refuses null and misaligned arrays. An array without items may be null.
fn check_array(argument: &'static str, data: *const f32, count: usize) -> Result<(), CallError> {
    if count == 0 { Ok(()) } else { check_pointer(argument, data) }
}

/// Refuses null and misaligned pointers.
fn check_pointer<T>(argument: &'static str, pointer: *const T) -> Result<(), CallError> {
    if pointer.is_null() {
        return Err(CallError::Null { argument });
    }
    if !pointer.is_aligned() {
        return Err(CallError::Misaligned { argument, alignment: align_of::<T>() });
    }
    Ok(())
}

/// A shared reference from a pointer; a null or misaligned pointer is an error.
///
/// # Safety
/// A pointer that passes these checks must point to a `T` that exists and does not change during `'a`.
pub(super) unsafe fn reference<'a, T>(argument: &'static str, pointer: *const T) -> Result<&'a T, CallError> {
    check_pointer(argument, pointer)?;
    // SAFETY: the pointer is aligned and not null; the contract above guarantees the rest.
    Ok(unsafe { &*pointer })
}

/// A mutable reference from a pointer to a result; a null or misaligned pointer is an error.
///
/// # Safety
/// A pointer that passes these checks must point to a writable `T` that exists during `'a`. Nothing else may access the
/// `T` during `'a`.
pub(super) unsafe fn reference_mut<'a, T>(argument: &'static str, pointer: *mut T) -> Result<&'a mut T, CallError> {
    check_pointer(argument, pointer)?;
    // SAFETY: the pointer is aligned and not null; the contract above guarantees the rest.
    Ok(unsafe { &mut *pointer })
}

/// A string from a pointer; a null pointer and invalid UTF-8 are errors.
///
/// # Safety
/// Unless null, `pointer` must point to a string with a terminating NUL that exists and does not change during `'a`.
pub(super) unsafe fn utf8<'a>(argument: &'static str, pointer: *const c_char) -> Result<&'a str, CallError> {
    check_pointer(argument, pointer)?;
    // SAFETY: the pointer is not null; the contract above guarantees the rest.
    unsafe { CStr::from_ptr(pointer) }.to_str().map_err(|source| CallError::NotText { argument, source })
}
