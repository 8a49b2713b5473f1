//! Who owns the variables that tracing makes.

use super::jit;
use std::cell::RefCell;
use std::marker::PhantomData;

/// Why nothing was traced.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum TraceError {
    #[error("Dr.Jit could not trace the surface: {0}")]
    Jit(String),
    #[error("a surface cannot be traced while another is")]
    Nested,
}

/// Ties a handle to the scope that owns its variable; a lifetime that neither shrinks nor grows, and of one thread.
pub type Brand<'s> = PhantomData<(fn(&'s ()) -> &'s (), *mut ())>;

/// Leave to trace. What is traced meanwhile, the scope releases when it ends.
#[derive(Clone, Copy)]
pub struct Scope<'s>(Brand<'s>);

/// A reference to a variable that outlives the scope.
#[derive(Debug)]
pub struct Owned(u32);

impl Owned {
    /// A reference of its own to a variable.
    pub fn of(_: Scope<'_>, index: u32) -> Self {
        Self(if index == 0 { 0 } else { jit::retain(index) })
    }

    /// The index; the reference is the caller's from now on.
    pub fn into_index(mut self) -> u32 {
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

struct Open {
    backend: u32,
    owned: Vec<u32>,
}

thread_local! {
    // The traits in `sunbeam::numeric` make constants from nothing but a number, so the scope cannot come as an argument.
    static OPEN: RefCell<Option<Open>> = const { RefCell::new(None) };
}

/// Runs `body`, which may trace for a backend (a `JitBackend`). Handles cannot leave it: their type has the scope's
/// lifetime, which `R` cannot name. A panic in `body` goes on when its variables are released.
///
/// # Errors
/// The first message of Dr.Jit, or a call within another.
pub fn trace<R>(backend: u32, body: impl for<'s> FnOnce(Scope<'s>) -> R) -> Result<R, TraceError> {
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
    // What an abandoned scope left.
    jit::take_error();
    let result = body(Scope(PhantomData));
    drop(close);
    let message = jit::take_error();
    if message.is_empty() { Ok(result) } else { Err(TraceError::Jit(message)) }
}

/// The open scope's backend, `None` outside of one.
pub fn backend() -> Option<u32> {
    OPEN.with_borrow(|open| open.as_ref().map(|open| open.backend))
}

/// Gives a variable to the open scope.
pub fn own(index: u32) -> u32 {
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

/// How many variables the open scope owns.
pub fn owned() -> usize {
    OPEN.with_borrow(|open| open.as_ref().map_or(0, |open| open.owned.len()))
}

/// Releases the variables that the open scope took over as these.
pub fn release(range: std::ops::Range<usize>) {
    OPEN.with_borrow_mut(|open| {
        if let Some(open) = open {
            open.owned.drain(range).for_each(jit::release);
        }
    });
}
