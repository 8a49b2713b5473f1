//! The tables against the direct sum, both through `sunbeam eval`.

use super::service::{directions, eval, reflectance_of};
use serde_json::json;

/// Tolerance of the tables, which is the 99th percentile of their relative error. Single values may err by twice as
/// much.
const TOLERANCE: f64 = 1e-3;

/// Compares the table's f with the direct sum's at `count` pairs of directions.
fn assert_agreement(surface: &[&str], count: usize) {
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
fn tables_of_small_presets_match_the_direct_sum() {
    for preset in ["flat", "blazed", "sinusoidal", "lamellar"] {
        assert_agreement(&["--preset", preset], 300);
        // A short window lights most pairs. Its albedo, which both methods share, would take long to compute.
        assert_agreement(
            &["--preset", preset, "--shadowing", "--conserve-energy", "false", "--coherence-length", "3"],
            300,
        );
    }
    assert_agreement(
        &["--preset", "blazed", "--model", "patch", "--coherence-length", "8", "--obliquity", "unit"],
        300,
    );
}

#[test]
fn tables_of_large_presets_match_the_direct_sum() {
    for preset in ["cd", "elaphe", "xenopeltis"] {
        assert_agreement(&["--preset", preset], 3);
    }
}

#[test]
fn tables_of_measured_scans_match_the_direct_sum() {
    for file in ["afm/elaphe.gsf", "afm/xenopeltis.gsf"] {
        let Some(path) = sunbeam_testing::data(file) else { return };
        assert_agreement(&["--height-field", path.to_str().unwrap()], 40);
        assert_agreement(&["--height-field", path.to_str().unwrap(), "--model", "patch"], 40);
    }
}
