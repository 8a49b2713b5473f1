//! Queries of `sunbeam eval`, and the scale of its errors.
#![allow(dead_code, reason = "each test binary uses a part")]

use crate::common::cache;
use crate::support::{run, succeeded};
use serde_json::Value;
use std::f64::consts::TAU;
use sunbeam::config::SurfaceConfig;
use sunbeam::lobe::Surface;
use sunbeam::table::DENSITY_FLOOR_UM2;

/// The answers of `sunbeam eval` to the lines.
pub(crate) fn eval(arguments: &[&str], lines: &[impl AsRef<str>]) -> Vec<Value> {
    let input: String = lines.iter().map(|line| format!("{}\n", line.as_ref())).collect();
    let output = succeeded(run(&[&["eval"], arguments].concat(), input));
    output.lines().map(|line| serde_json::from_str(line).unwrap()).collect()
}

/// The first `count` directions of a low-discrepancy sequence, uniform in solid angle over the upper hemisphere.
pub(crate) fn directions(count: usize) -> impl Iterator<Item = [f64; 3]> {
    (0..count).map(|i| {
        // The steps of the sequence R₂: reciprocal powers of the root of x³ = x + 1.
        let [a, b] = [0.754_877_666_246_692_8, 0.569_840_290_998_053_3].map(|step| (0.5 + step * i as f64).fract());
        let (z, phi) = (a.max(1e-3), TAU * b);
        let r = (1.0 - z * z).sqrt();
        [r * phi.cos(), r * phi.sin(), z]
    })
}

/// The library's surface for arguments: pairs of `--key value`, or `--key` alone for true.
pub(crate) fn surface(arguments: &[&str]) -> Surface {
    let mut config = serde_json::Map::new();
    let mut rest = arguments.iter().peekable();
    while let Some(key) = rest.next() {
        let key = key.trim_start_matches('-').replace('-', "_");
        let key = if key == "height_field" { "filename".into() } else { key };
        let value = rest
            .next_if(|next| !next.starts_with("--"))
            .map_or(Value::Bool(true), |value| serde_json::from_str(value).unwrap_or_else(|_| Value::from(*value)));
        config.insert(key, value);
    }
    SurfaceConfig::from_json(&Value::Object(config).to_string()).unwrap().build(&cache()).unwrap().0
}

/// The reflectance that errors of the tables are relative to.
///
/// It is the larger of the mean density over κ and the density floor, times the obliquity factor `stam`. Energy
/// conservation and shadowing lower both reflectances, and the factor `unit` is at most `stam`, so for them the check
/// is weaker.
pub(crate) fn reflectance_of(mean_density: f64, wi: [f64; 3], wo: [f64; 3], wavelength_nm: f64) -> f64 {
    let dot: f64 = wi.iter().zip(wo).map(|(a, b)| a * b).sum();
    let w = wi[2] + wo[2];
    let obliquity = (1.0 + dot).powi(2) / (wi[2] * wo[2] * w * w);
    let wavelength_um = wavelength_nm * 1e-3;
    obliquity * mean_density.max(DENSITY_FLOOR_UM2) / (wavelength_um * wavelength_um)
}
