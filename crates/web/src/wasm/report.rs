//! Errors and progress, as JavaScript hears of them.

use crate::WebError;
use std::cell::RefCell;
use sunbeam::table::Progress;
use wasm_bindgen::{JsCast, JsValue};

/// An `Error` with the message, its kind, and the parameter to ask for.
pub fn thrown(error: impl Into<WebError>) -> JsValue {
    let error = error.into();
    let made = js_sys::Error::new(&error.to_string());
    made.set_name("SunbeamError");
    let set = |name: &str, value: &str| {
        // An object that was just made takes properties.
        let _ = js_sys::Reflect::set(&made, &name.into(), &value.into());
    };
    set("kind", error.kind());
    if let Some(parameter) = error.parameter() {
        set("parameter", parameter);
    }
    made.into()
}

thread_local! {
    static LISTENER: RefCell<Option<js_sys::Function>> = const { RefCell::new(None) };
}

/// Clears the listener when the work is done, however it ends.
pub struct Listening;

impl Drop for Listening {
    fn drop(&mut self) {
        LISTENER.with_borrow_mut(Option::take);
    }
}

/// Shares closer to the last told one than this are not told.
const STEP: f64 = 0.005;

/// A progress that calls `listener`, if it is a function, as long as the second value lives. The library's progress may be
/// handed to other threads, which a page has none of: so the function stays in this thread's own place.
pub fn progress(listener: &JsValue) -> (Progress, Listening) {
    let Some(function) = listener.dyn_ref::<js_sys::Function>() else { return (Progress::none(), Listening) };
    LISTENER.with_borrow_mut(|listener| *listener = Some(function.clone()));
    let told = std::sync::Mutex::new(-1.0f64);
    let tell = move |share: f64| {
        {
            let mut told = told.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
            if share < *told + STEP && !(share >= 1.0 && *told < 1.0) {
                return;
            }
            *told = share;
        }
        LISTENER.with_borrow(|listener| {
            if let Some(function) = listener {
                // What a listener throws is its own affair.
                let _ = function.call1(&JsValue::NULL, &share.into());
            }
        });
    };
    (Progress::new(tell), Listening)
}

/// Has a panic tell its message on the console before the module ends, where it would else say "unreachable".
pub fn report_panics() {
    std::panic::set_hook(Box::new(|info| {
        web_sys::console::error_1(&format!("sunbeam: {info}").into());
    }));
}
