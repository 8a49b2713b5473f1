//! Conversions for JavaScript: errors, progress reports and messages of panics.

use crate::WebError;
use std::cell::RefCell;
use std::sync::{Mutex, PoisonError};
use sunbeam::table::Progress;
use wasm_bindgen::{JsCast, JsValue};

/// A JavaScript `Error` with the message, the property `kind` ([`WebError::kind`]) and, for [`WebError::Scale`],
/// `parameter`, the name of the missing setting.
pub fn thrown(error: impl Into<WebError>) -> JsValue {
    let error = error.into();
    let made = js_sys::Error::new(&error.to_string());
    made.set_name("SunbeamError");
    let set = |name: &str, value: &str| {
        // Cannot fail: a new object accepts properties.
        let _ = js_sys::Reflect::set(&made, &name.into(), &value.into());
    };
    set("kind", error.kind());
    if let Some(parameter) = error.parameter() {
        set("parameter", parameter);
    }
    made.into()
}

thread_local! {
    /// Listener of the build that is running; `None` between builds.
    static LISTENER: RefCell<Option<js_sys::Function>> = const { RefCell::new(None) };
}

/// Guard whose drop removes the registered listener, if there is one.
pub struct Listening;

impl Drop for Listening {
    fn drop(&mut self) {
        LISTENER.with_borrow_mut(Option::take);
    }
}

/// Smallest increase of the reported fraction. Chosen for about 200 calls of JavaScript a build: a smaller step reports
/// more smoothly; a larger one costs fewer calls.
const STEP: f64 = 0.005;

/// A [`Progress`] that calls `listener`, if it is a function, with the finished fraction from 0 to 1. The calls end
/// when the returned guard is dropped. The listener must not start another build: it is borrowed while it runs.
///
/// A `Progress` may move to other threads, and a JavaScript function may not. Therefore the function stays in a
/// variable of this thread. WebAssembly has no other threads here.
pub fn progress(listener: &JsValue) -> (Progress, Listening) {
    let Some(function) = listener.dyn_ref::<js_sys::Function>() else { return (Progress::none(), Listening) };
    LISTENER.with_borrow_mut(|slot| *slot = Some(function.clone()));
    // Largest fraction reported, in a mutex because a `Progress` is `Sync`; below 0, so that the first report passes.
    let last = Mutex::new(-1.0f64);
    let report = move |fraction: f64| {
        {
            // The lock ends with this block, before the listener runs.
            let mut last = last.lock().unwrap_or_else(PoisonError::into_inner);
            // The end is reported once, even after a small increase.
            let is_first_end = fraction >= 1.0 && *last < 1.0;
            if fraction < *last + STEP && !is_first_end {
                return;
            }
            *last = fraction;
        }
        LISTENER.with_borrow(|slot| {
            if let Some(function) = slot {
                // The build goes on after an error of the listener.
                let _ = function.call1(&JsValue::NULL, &fraction.into());
            }
        });
    };
    (Progress::new(report), Listening)
}

/// Prints messages of panics on the browser's console, which without this hook would only show "unreachable".
pub fn report_panics() {
    std::panic::set_hook(Box::new(|info| {
        web_sys::console::error_1(&format!("sunbeam: {info}").into());
    }));
}
