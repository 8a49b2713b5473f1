//! The tables against the direct sum, both through `sunbeam eval`.

use super::service::{directions, eval, reflectance_of};
use serde_json::json;

/// Relative error asked of the tables; what they report is its 99th percentile, so twice it is allowed here.
const TOLERANCE: f64 = 1e-3;

fn agree(surface: &[&str], count: usize) {
    let wavelengths = [380.0, 460.0, 550.0, 680.0, 780.0];
    let pairs: Vec<_> = directions(count).zip(directions(2 * count).skip(count)).collect();
    let lines: Vec<String> = pairs
        .iter()
        .enumerate()
        .map(|(i, (wi, wo))| json!({"wi": wi, "wo": wo, "wavelength": wavelengths[i % 5]}).to_string())
        .collect();
    let tolerance = TOLERANCE.to_string();
    let arguments = [surface, &["--tolerance", &tolerance]].concat();
    let built = crate::service::surface(&arguments);
    let table = eval(&[&arguments[..], &["--method", "table"]].concat(), &lines);
    let exact = eval(&[&arguments[..], &["--method", "exact"]].concat(), &lines);
    let mut lit = 0;
    for (i, ((wi, wo), (t, e))) in pairs.iter().zip(table.iter().zip(&exact)).enumerate() {
        assert_eq!(t["pdf"], e["pdf"], "one sampler serves both");
        let (f_table, f_exact) = (t["f"].as_f64().unwrap(), e["f"].as_f64().unwrap());
        let (_, mean) = crate::common::table_density(&built, *wi, *wo, wavelengths[i % 5]);
        let scale = reflectance_of(mean, *wi, *wo, wavelengths[i % 5]);
        let allowed = 2.0 * TOLERANCE * f_exact.max(scale);
        assert!((f_table - f_exact).abs() <= allowed, "{surface:?} {}: {f_table} {f_exact} {scale}", lines[i]);
        lit += usize::from(f_exact > scale);
    }
    println!("{surface:?}: {lit} of {count} pairs brighter than the scale of errors");
}

#[test]
fn small_presets() {
    for preset in ["flat", "blazed", "sinusoidal", "lamellar"] {
        agree(&["--preset", preset], 300);
        // A short window lights most pairs; the scaling, which both methods share, is slow to find for it.
        agree(&["--preset", preset, "--shadowing", "--conserve-energy", "false", "--coherence-length", "3"], 300);
    }
    agree(&["--preset", "blazed", "--model", "patch", "--coherence-length", "8", "--obliquity", "unit"], 300);
}

#[test]
fn large_presets() {
    for preset in ["cd", "elaphe", "xenopeltis"] {
        agree(&["--preset", preset], 3);
    }
}

#[test]
fn measured_scans() {
    let folder = std::env::var_os("SUNBEAM_DATA").map_or_else(
        || std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data/afm"),
        std::path::PathBuf::from,
    );
    for name in ["elaphe.gsf", "xenopeltis.gsf"] {
        let path = folder.join(name);
        if !path.exists() {
            eprintln!("SKIPPED: {} is absent; set SUNBEAM_DATA to the folder of the scans", path.display());
            continue;
        }
        agree(&["--height-field", path.to_str().unwrap()], 40);
        agree(&["--height-field", path.to_str().unwrap(), "--model", "patch"], 40);
    }
}
