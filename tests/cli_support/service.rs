//! Asking the service that answers JSON lines, and judging its answers.
#![allow(dead_code)] // Each binary uses some of them.
use crate::cli_support::{run, succeeded};
use serde_json::Value;
use std::f64::consts::TAU;
use sunbeam::reflectance::UNIFORM_SHARE;
use sunbeam::table::DENSITY_FLOOR_UM2;

/// The answers of `sunbeam eval` to the lines.
pub fn eval(arguments: &[&str], lines: &[impl AsRef<str>]) -> Vec<Value> {
    let input: String = lines.iter().map(|line| format!("{}\n", line.as_ref())).collect();
    let output = succeeded(run(&[&["eval"], arguments].concat(), input));
    output.lines().map(|line| serde_json::from_str(line).unwrap()).collect()
}

/// The first `count` directions of a fixed sequence that fills the upper hemisphere evenly in cosθ.
pub fn directions(count: usize) -> impl Iterator<Item = [f64; 3]> {
    (0..count).map(|i| {
        // Reciprocal powers of the root of x³ = x + 1.
        let [a, b] = [0.754_877_666_246_692_8, 0.569_840_290_998_053_3].map(|step| (0.5 + step * i as f64).fract());
        let (z, phi) = (a.max(1e-3), TAU * b);
        let r = (1.0 - z * z).sqrt();
        [r * phi.cos(), r * phi.sin(), z]
    })
}

/// The reflectance against which an error of the tables is small or large: that of the mean density `S̄` over κ, or of
/// the density floor, whichever is more, with the obliquity factor `stam` and nothing else.
///
/// `S̄` follows from the density of the sampler, `pdf = (1 − q)·S̄·cosθo/λ² + q/2π` with q the uniform share. Energy
/// scaling and shadowing only lower both reflectances, and `unit` is never more than `stam`: there the comparison is
/// the weaker one.
pub fn surface_of(wi: [f64; 3], wo: [f64; 3], wavelength_nm: f64, pdf: f64) -> f64 {
    let (cos_i, cos_o) = (wi[2], wo[2]);
    let dot: f64 = wi.iter().zip(wo).map(|(a, b)| a * b).sum();
    let w = cos_i + cos_o;
    let obliquity = (1.0 + dot).powi(2) / (cos_i * cos_o * w * w);
    let mean = (pdf - UNIFORM_SHARE / TAU).max(0.0) / ((1.0 - UNIFORM_SHARE) * cos_o);
    let wavelength_um = wavelength_nm * 1e-3;
    let floor = DENSITY_FLOOR_UM2 / (wavelength_um * wavelength_um);
    obliquity * mean.max(floor)
}
