//! Tests of the library against independent results, in one program.

// Helpers outside of `#[test]` functions unwrap and print as tests do.
#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "tests panic on errors and print measurements")]

mod chi_square;
mod common;

mod colour_lobe;
mod colour_table;
mod covers;
mod energy;
mod hard_cases;
mod maxwell;
mod methods;
mod sampling;
mod snake_spectra;
mod stam_gems;
mod tables;
mod transforms;
mod transmission;
mod transmission_rigorous;
