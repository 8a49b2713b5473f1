//! Functions and classes that are exported to the page's JavaScript. `README.md` of this crate documents them.
//!
//! The page and each of its Web Workers load the library on their own.
//!
//! - `quick.rs`: calls without long computations, for the page and all workers.
//! - `maker.rs`: builds of methods and scenes, for workers that may block.
//! - `artist.rs`: drawing with WebGPU, for one worker.
//! - `screen.rs`: the canvas that shows the artist's pictures.
//! - `report.rs`: errors and progress for JavaScript.

#![allow(unreachable_pub, reason = "wasm_bindgen exports public items only")]

mod artist;
mod maker;
mod quick;
mod report;
mod screen;

use wasm_bindgen::prelude::wasm_bindgen;

/// Sets the panic hook. The generated JavaScript calls this function after it has loaded the library.
#[wasm_bindgen(start)]
pub fn start() {
    report::report_panics();
}
