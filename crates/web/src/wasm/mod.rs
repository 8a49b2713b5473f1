//! The functions and classes that the module exports to the page's JavaScript. `README.md` of this crate documents
//! them.
//!
//! - `quick.rs`: calls without long computations, for every thread.
//! - `maker.rs`: builds of tables and scenes, for workers that may block.
//! - `artist.rs`: drawing with WebGPU, for one worker.
//! - `report.rs`: errors and progress for JavaScript.

mod artist;
mod maker;
mod quick;
mod report;

use wasm_bindgen::prelude::wasm_bindgen;

/// Sets the panic hook; the browser calls this function when it loads the module.
#[wasm_bindgen(start)]
pub fn start() {
    report::report_panics();
}
