//! `sunbeam-bindgen INPUT.wasm FOLDER`: writes the page's library into a folder, as an ES module in JavaScript and the
//! WebAssembly that it loads.
//!
//! `INPUT.wasm` is `crates/web` compiled for `wasm32-unknown-unknown`. This program replaces the command
//! `wasm-bindgen`, whose version must equal that of the crate `wasm-bindgen` in `crates/web`. The package's Cargo.toml
//! pins `wasm-bindgen-cli-support` to it.

use std::error::Error;
use std::process::ExitCode;
use wasm_bindgen_cli_support::Bindgen;

fn main() -> ExitCode {
    match run() {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("sunbeam-bindgen: {error}");
            ExitCode::FAILURE
        }
    }
}

/// Reads the arguments and writes the library.
fn run() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let (Some(input), Some(folder), None) = (arguments.next(), arguments.next(), arguments.next()) else {
        return Err("two arguments are needed: INPUT.wasm FOLDER".into());
    };
    let mut bindgen = Bindgen::new();
    // For browsers without a bundler. The removed sections name the compiler and the functions, for debuggers.
    bindgen.input_path(input).web(true)?.typescript(false).remove_producers_section(true).remove_name_section(true);
    Ok(bindgen.generate(folder)?)
}
