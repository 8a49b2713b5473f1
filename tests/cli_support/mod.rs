//! Running the binary and judging what it says.
#![allow(dead_code)] // Each binary uses some of it.

use serde_json::Value;
use std::f64::consts::TAU;
use std::io::Write;
use std::process::{Command, Output, Stdio};
use sunbeam::reflectance::UNIFORM_SHARE;
use sunbeam::table::DENSITY_FLOOR_UM2;

/// Runs the binary with `input` on stdin.
pub fn run(arguments: &[&str], input: impl AsRef<[u8]>) -> Output {
    let mut child = Command::new(env!("CARGO_BIN_EXE_sunbeam"))
        .args(arguments)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let mut stdin = child.stdin.take().unwrap();
    // In a thread, since the answers fill the other pipe; a process that refuses its arguments reads nothing.
    let input = input.as_ref().to_vec();
    let writer = std::thread::spawn(move || drop(stdin.write_all(&input)));
    let output = child.wait_with_output().unwrap();
    writer.join().unwrap();
    output
}

/// The stdout of a run that succeeded, without a number that is not one.
pub fn succeeded(output: Output) -> String {
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(0), "{stderr}");
    assert_eq!(stderr, "");
    let text = String::from_utf8(output.stdout).unwrap();
    assert!(!text.contains("NaN") && !text.contains("inf"), "{text}");
    text
}

/// The line on stderr of a run that was refused with status 2.
pub fn refused(arguments: &[&str]) -> String {
    let output = run(arguments, "");
    let message = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(2), "{arguments:?}: {message}");
    assert!(output.stdout.is_empty(), "{arguments:?}");
    assert_eq!(message.lines().count(), 1, "{arguments:?}: {message}");
    message
}

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
