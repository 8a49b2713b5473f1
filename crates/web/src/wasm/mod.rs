//! What the page calls; `README.md` is the manual of all of it.

mod artist;
mod maker;
mod quick;
mod report;

use wasm_bindgen::prelude::wasm_bindgen;

/// Called when the module is loaded.
#[wasm_bindgen(start)]
pub fn start() {
    report::report_panics();
}
