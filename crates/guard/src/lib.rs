//! Conversion of panics into errors at the boundary to C and C++.
//!
//! Every function that foreign code calls runs its body in [`guard`], since unwinding into foreign code aborts the
//! process or is undefined.
//!
//! ```
//! use sunbeam_guard::{Panic, guard};
//!
//! let result: Result<u32, Panic> = guard(|| panic!("index out of range"));
//! assert_eq!(result, Err(Panic("index out of range".into())));
//! ```

use std::any::Any;
use std::panic::{AssertUnwindSafe, catch_unwind};

/// A caught panic, with its message.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("internal error of sunbeam, please report it: {0}")]
pub struct Panic(pub String);

/// Runs `body`, and converts a panic into an `Err`.
///
/// The assertion of unwind safety is sound if a panic leaves no shared state half changed. `body` must therefore only
/// read shared state, or replace it as a whole.
///
/// # Errors
/// The errors of `body`, and a [`Panic`].
pub fn guard<T, E: From<Panic>>(body: impl FnOnce() -> Result<T, E>) -> Result<T, E> {
    catch_unwind(AssertUnwindSafe(body)).unwrap_or_else(|payload| Err(Panic(message(payload.as_ref())).into()))
}

/// Message of a panic's payload.
fn message(payload: &(dyn Any + Send)) -> String {
    let text = payload.downcast_ref::<&str>().copied();
    text.or_else(|| payload.downcast_ref::<String>().map(String::as_str))
        .unwrap_or("a panic without a message")
        .to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn results_pass_through_and_panics_become_errors() {
        assert_eq!(guard(|| Ok::<_, Panic>(3)), Ok(3));
        assert_eq!(guard(|| Err::<(), _>(Panic("own".into()))), Err(Panic("own".into())));
        assert_eq!(guard(|| -> Result<(), Panic> { panic!("literal") }), Err(Panic("literal".into())));
        assert_eq!(guard(|| -> Result<(), Panic> { panic!("number {}", 3) }), Err(Panic("number 3".into())));
        assert!(guard(|| -> Result<(), Panic> { std::panic::panic_any(3) }).is_err());
    }
}
