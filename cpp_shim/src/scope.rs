//! Ownership of the variables that tracing creates.
//!
//! Dr.Jit counts references to variables and identifies a variable by a `u32` index; 0 stands for no variable. A
//! *handle* is an index with the lifetime of its scope (`traced.rs`). Evaluators copy handles freely, so a handle owns
//! nothing. A [`Scope`] owns one reference to each variable created while it is open, and releases all of them at its
//! end. [`Owned`] is a reference that outlives the scope. A thread has at most one open scope.

use super::jit;
use std::cell::RefCell;
use std::marker::PhantomData;

/// Reason for which tracing failed.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub(crate) enum TraceError {
    /// First error message of Dr.Jit.
    #[error("Dr.Jit could not trace the surface: {0}")]
    Jit(String),
    /// The thread has an open scope.
    #[error("a surface cannot be traced while another is")]
    Nested,
}

/// Marker that ties a handle to the scope that owns its variable. The function type makes the lifetime `'s` invariant,
/// so handles of two scopes cannot mix. The pointer type is not `Send`, which keeps handles on their thread.
pub(crate) type Brand<'s> = PhantomData<(fn(&'s ()) -> &'s (), *mut ())>;

/// Proof that a scope is open on this thread, which [`trace`] passes to its body. The scope's data are in [`OPEN`].
#[derive(Clone, Copy)]
pub(crate) struct Scope<'s>(Brand<'s>);

/// A reference to a variable that outlives the scope. Its index is 0 after an error.
#[derive(Debug)]
pub(crate) struct Owned(u32);

impl Owned {
    /// Adds a reference to the variable `index`.
    pub(crate) fn of(_: Scope<'_>, index: u32) -> Self {
        Self(if index == 0 { 0 } else { jit::retain(index) })
    }

    /// Transfers the reference to the caller, as the variable's index.
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

/// Data of an open scope.
struct Open {
    /// Number of a Dr.Jit `JitBackend`: LLVM or CUDA.
    backend: u32,
    /// Indices of the variables whose references the scope owns, in the order of their creation.
    owned: Vec<u32>,
}

thread_local! {
    /// The thread's open scope. Thread-local, because `sunbeam::numeric::Real::lit` makes constants without a scope
    /// argument.
    static OPEN: RefCell<Option<Open>> = const { RefCell::new(None) };
}

/// Runs `body` in a new scope for a backend (number of a `JitBackend`) and releases its variables. Handles cannot leave
/// the scope, because `R` cannot name its lifetime. A panic in `body` continues after the variables are released.
///
/// # Errors
/// Dr.Jit's first error message, or a call inside another scope.
pub(crate) fn trace<R>(backend: u32, body: impl for<'s> FnOnce(Scope<'s>) -> R) -> Result<R, TraceError> {
    /// Closes the scope when it is dropped.
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
            *open = Some(Open { backend, owned: Vec::new() });
            Ok(())
        }
    })?;
    let close = Close;
    // Clears an error of a scope that a panic ended.
    jit::take_error();
    let result = body(Scope(PhantomData));
    drop(close);
    let message = jit::take_error();
    if message.is_empty() { Ok(result) } else { Err(TraceError::Jit(message)) }
}

/// Backend of the open scope; `None` outside a scope.
pub(crate) fn backend() -> Option<u32> {
    OPEN.with_borrow(|open| open.as_ref().map(|open| open.backend))
}

/// Transfers a reference to the open scope and returns its index. Outside a scope, releases the reference and returns
/// 0. Returns 0 for index 0.
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

/// Number of variables that the open scope owns; 0 outside a scope.
pub(crate) fn owned_count() -> usize {
    OPEN.with_borrow(|open| open.as_ref().map_or(0, |open| open.owned.len()))
}

/// Releases some of the open scope's variables: those at the positions `range`, below [`owned_count`], in the order of
/// their creation.
pub(crate) fn release(range: std::ops::Range<usize>) {
    OPEN.with_borrow_mut(|open| {
        if let Some(open) = open {
            open.owned.drain(range).for_each(jit::release);
        }
    });
}
