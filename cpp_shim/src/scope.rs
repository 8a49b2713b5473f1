//! Ownership of the variables that tracing creates.
//!
//! Dr.Jit counts references to variables and identifies a variable by a `u32` index; 0 is no variable. Evaluators copy
//! indices freely, so single handles own nothing. A [`Scope`] owns one reference to each variable created while it is
//! open and releases all of them at its end; [`Owned`] is a reference that outlives it. A thread has at most one open
//! scope.

use super::jit;
use std::cell::RefCell;
use std::marker::PhantomData;

/// Reason that tracing failed.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub(crate) enum TraceError {
    #[error("Dr.Jit could not trace the surface: {0}")]
    Jit(String),
    #[error("a surface cannot be traced while another is")]
    Nested,
}

/// Ties a handle to the scope that owns its variable: an invariant lifetime, on one thread.
pub(crate) type Brand<'s> = PhantomData<(fn(&'s ()) -> &'s (), *mut ())>;

/// An open scope. It owns all variables created while it is open, and releases them when it ends.
#[derive(Clone, Copy)]
pub(crate) struct Scope<'s>(Brand<'s>);

/// A reference to a variable that survives the scope.
#[derive(Debug)]
pub(crate) struct Owned(u32);

impl Owned {
    /// A new reference to a variable.
    pub(crate) fn of(_: Scope<'_>, index: u32) -> Self {
        Self(if index == 0 { 0 } else { jit::retain(index) })
    }

    /// Passes the reference on to the caller.
    pub(crate) fn into_index(mut self) -> u32 {
        std::mem::take(&mut self.0)
    }
}

impl Drop for Owned {
    fn drop(&mut self) {
        if self.0 != 0 {
            jit::release(self.0);
        }
    }
}

/// Data of the thread's open scope.
struct Open {
    /// A `JitBackend`: LLVM or CUDA.
    backend: u32,
    /// Indices of the variables whose references the scope owns, in the order of their creation.
    owned: Vec<u32>,
}

thread_local! {
    // Thread-local, since `sunbeam::numeric::Real::lit` makes constants without a scope argument.
    static OPEN: RefCell<Option<Open>> = const { RefCell::new(None) };
}

/// Runs `body` in a scope for a backend (a `JitBackend`). Handles cannot leave the scope, because `R` cannot name its
/// lifetime. A panic in `body` continues after the variables are released.
///
/// # Errors
/// Dr.Jit's first error message, or a call inside another scope.
pub(crate) fn trace<R>(backend: u32, body: impl for<'s> FnOnce(Scope<'s>) -> R) -> Result<R, TraceError> {
    struct Close;
    impl Drop for Close {
        fn drop(&mut self) {
            if let Some(open) = OPEN.take() {
                open.owned.into_iter().for_each(jit::release);
            }
        }
    }
    OPEN.with_borrow_mut(|open| match open {
        Some(_) => Err(TraceError::Nested),
        None => {
            *open = Some(Open { backend, owned: Vec::with_capacity(1024) });
            Ok(())
        }
    })?;
    let close = Close;
    // Clears an error that an abandoned scope left.
    jit::take_error();
    let result = body(Scope(PhantomData));
    drop(close);
    let message = jit::take_error();
    if message.is_empty() { Ok(result) } else { Err(TraceError::Jit(message)) }
}

/// The open scope's backend, `None` outside of one.
pub(crate) fn backend() -> Option<u32> {
    OPEN.with_borrow(|open| open.as_ref().map(|open| open.backend))
}

/// Passes a variable to the open scope; without one, releases it and returns 0.
pub(crate) fn own(index: u32) -> u32 {
    if index == 0 {
        return 0;
    }
    OPEN.with_borrow_mut(|open| match open {
        Some(open) => {
            open.owned.push(index);
            index
        }
        None => {
            jit::release(index);
            0
        }
    })
}

/// Number of variables that the open scope owns.
pub(crate) fn owned() -> usize {
    OPEN.with_borrow(|open| open.as_ref().map_or(0, |open| open.owned.len()))
}

/// Releases the variables at these positions in the scope's list.
pub(crate) fn release(range: std::ops::Range<usize>) {
    OPEN.with_borrow_mut(|open| {
        if let Some(open) = open {
            open.owned.drain(range).for_each(jit::release);
        }
    });
}
