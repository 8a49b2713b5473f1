//! The calls of the page; `README.md` documents them.

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
