//! `sunbeam bench --quick`: the report's contents, and errors against the reference. Times are not checked.

use super::support::{refused, run};
use serde_json::Value;
use std::path::Path;

fn bench(arguments: &[&str]) -> Value {
    let output = run(&[&["bench", "--quick"], arguments].concat(), "");
    let progress = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(0), "{progress}");
    assert!(!progress.is_empty(), "progress goes to stderr");
    let text = String::from_utf8(output.stdout).unwrap();
    assert!(!text.contains("NaN") && !text.contains("inf"), "{text}");
    if text.is_empty() { Value::Null } else { serde_json::from_str(&text).unwrap() }
}

fn entries(report: &Value) -> &[Value] {
    report["surfaces"][0]["entries"].as_array().unwrap()
}

#[test]
fn methods_are_timed_and_compared_with_the_reference() {
    let folder = tempfile::tempdir().unwrap();
    let plot = folder.path().join("front.svg");
    let report = bench(&["--preset", "blazed", "--plot", plot.to_str().unwrap()]);
    assert_eq!(report["surfaces"].as_array().unwrap().len(), 1);
    // The rounding of sums of 1024 terms of modulus 1.
    assert!(report["surfaces"][0]["oracle"]["largest"].as_f64().unwrap() < 1e-10);
    for method in ["flss", "nmm", "pq", "stam", "colour-table", "spectral-table"] {
        let of_method: Vec<_> = entries(&report).iter().filter(|entry| entry["method"] == method).collect();
        assert_eq!(of_method.iter().filter(|entry| entry["is_default"] == true).count(), 1, "{method}");
        for entry in &of_method {
            let number = |name: &str| entry[name].as_f64().unwrap();
            assert!(number("bytes") > 0.0 && number("build_seconds") >= 0.0, "{entry}");
            assert!(entry["cpu"]["microseconds"].as_f64().unwrap() > 0.0, "{entry}");
            assert_eq!(entry["errors"]["spectral_rmse"].is_null(), method == "colour-table", "{entry}");
            let has_shader = method != "spectral-table" && report["adapter"].is_object();
            assert_eq!(entry["gpu"].is_object(), has_shader, "{entry}");
        }
    }
    // A report without an adapter has the reason.
    assert!(report["adapter"].is_object() != report["no_adapter"].is_string());
    let spectral = |method: &str| {
        let entry = entries(&report).iter().find(|e| e["method"] == method && e["is_default"] == true);
        entry.unwrap()["errors"]["spectral_rmse"].as_f64().unwrap()
    };
    // Errors are relative to the bright orders: the tolerance is 1e-3, the rounding of single precision 1e-6.
    assert!(spectral("flss") < 1e-3 && spectral("spectral-table") < 1e-3);
    // Negative control: a method with a single spacing deviates.
    assert!(spectral("stam") > 0.5);
    let drawing = std::fs::read_to_string(&plot).unwrap();
    assert!(drawing.contains("<svg") && drawing.contains("colour-table") && drawing.contains("blazed"));
}

#[test]
fn a_file_is_measured_without_the_gpu() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let (field, json) = (path("bumps.npy"), path("bench.json"));
    let heights = ndarray::Array2::from_shape_fn((12, 16), |(iy, ix)| 0.1 * ((ix + 2 * iy) as f64).sin());
    ndarray_npy::write_npy(&field, &heights).unwrap();
    let arguments = ["--height-field", &field, "--pixel-size", "0.2", "--cpu-only", "--json", &json];
    assert!(bench(&arguments).is_null(), "the report is in a file");
    let report: Value = serde_json::from_str(&std::fs::read_to_string(Path::new(&json)).unwrap()).unwrap();
    assert_eq!(report["surfaces"][0]["name"], "bumps");
    assert_eq!(report["no_adapter"], "left out");
    assert!(entries(&report).iter().all(|entry| entry["gpu"].is_null()));
}

#[test]
fn stability_is_reported() {
    let report = bench(&["--what", "stability"]);
    assert_eq!(report["deep_relief"].as_array().unwrap().last().unwrap()["kappa_h"], 200.0);
    assert_eq!(report["grazing"].as_array().unwrap().len(), 3);
    assert_eq!(report["questions"]["asked"], 20_000);
    assert_eq!(report["questions"]["not_finite"], 0);
}

#[test]
fn sampler_statistics_are_reported() {
    let report = bench(&["--what", "sampler", "--preset", "sinusoidal"]);
    assert_eq!((&report["samples"], &report["surfaces"][0]["name"]), (&Value::from(1000), &Value::from("sinusoidal")));
    let rows = report["surfaces"][0]["rows"].as_array().unwrap();
    assert_eq!(rows.len(), 7 * 3 * 3);
    for row in rows {
        let number = |name: &str| row[name].as_f64().unwrap();
        // A thousand samples; sampler.rs checks tighter limits with more.
        assert!(number("mean") > 0.0 && number("relative_std") < 1.0 && number("lost") < 0.5, "{row}");
        assert!(number("p999_to_mean") <= number("max_to_mean"), "{row}");
    }
}

#[test]
fn arguments_without_effect_are_refused() {
    for (arguments, mentioned) in [
        (&["bench", "--quick", "--model", "patch"][..], "--model"),
        (&["bench", "--quick", "--tiling", "aperiodic"], "--tiling"),
        (&["bench", "--quick", "--theory", "rigorous", "--preset", "blazed"], "--theory"),
        (&["bench", "--quick", "--cover-eta", "1.5"], "--cover-eta"),
        (&["bench", "--what", "stability", "--preset", "flat"], "stability"),
        (&["bench", "--what", "stability", "--eta", "1.5"], "stability"),
        (&["bench", "--what", "stability", "--cpu-only"], "--cpu-only"),
        (&["bench", "--what", "sampler", "--cpu-only"], "--cpu-only"),
        (&["bench", "--what", "sampler", "--theory", "rigorous", "--preset", "blazed"], "must be scalar"),
        (&["bench", "--what", "sampler", "--plot", "a.svg"], "sampler"),
        (&["bench", "--what", "everything"], "methods, stability, sampler"),
    ] {
        let message = refused(arguments);
        assert!(message.contains(mentioned), "{arguments:?}: {message}");
    }
}
