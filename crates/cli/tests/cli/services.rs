//! `sunbeam eval` and `sunbeam sample`: answers to JSON lines.

use super::service::{directions, eval};
use super::support::{run, succeeded};
use serde_json::{Value, json};
use std::f64::consts::PI;

/// Relative rounding of values that are computed twice in double precision and printed with 17 digits.
const ROUNDING: f64 = 1e-12;

#[test]
fn a_bad_line_has_an_error_in_its_place() {
    let good = r#"{"wi":[0,0,1],"wo":[0,0.6,0.8],"wavelength":550}"#;
    let bad = [
        ("not json", "not JSON"),
        ("", "empty"),
        (r#"{"wi":[0,0,1],"wavelength":550}"#, "wo"),
        (r#"{"wi":[0,0],"wo":[0,0,1],"wavelength":550}"#, "2 components"),
        (r#"{"wi":[0,0,0],"wo":[0,0,1],"wavelength":550}"#, "zero vector"),
        (r#"{"wi":[0,0,1.01],"wo":[0,0,1],"wavelength":550}"#, "length"),
        (r#"{"wi":[0,0,1e999],"wo":[0,0,1],"wavelength":550}"#, "out of range"),
        (r#"{"wi":[0,0,NaN],"wo":[0,0,1],"wavelength":550}"#, "not JSON"),
        (r#"{"wi":[0,0,1],"wo":[0,0,1],"wavelength":0}"#, "wavelength"),
        (r#"{"wi":[0,0,1],"wo":[0,0,1],"wavelength":359}"#, "[360, 830]"),
        (r#"{"wi":[0,0,1],"wo":[0,0,1],"wavelength":[500,900]}"#, "900"),
        (r#"{"wi":[0,0,1],"wo":[0,0,1],"wavelength":[]}"#, "empty array"),
        (r#"{"wi":[0,0,1],"wo":[0,0,1],"wavelength":"red"}"#, "a number or an array"),
        (r#"{"wi":[0,0,1],"wo":[0,0,1],"wavelength":550,"u":1}"#, "unknown field"),
    ];
    let lines: Vec<&str> = bad.iter().flat_map(|(line, _)| [good, *line]).collect();
    let answers = eval(&["--preset", "sinusoidal"], &lines);
    assert_eq!(answers.len(), lines.len());
    for (pair, (line, reason)) in answers.chunks(2).zip(bad) {
        assert_eq!(pair[0], answers[0]);
        assert!(pair[0]["f"].as_f64().unwrap() >= 0.0);
        assert!(pair[1]["error"].as_str().unwrap_or_else(|| panic!("{line}: {}", pair[1])).contains(reason), "{line}");
    }
    // Bytes that are not UTF-8, and a last line without a line end.
    let output = succeeded(run(&["eval", "--preset", "flat"], b"\xff\xfe\n{\"wi\":[0,0,1]" as &[u8]));
    assert_eq!(output.lines().filter(|line| line.contains("error")).count(), 2, "{output}");
    // The direct sum answers outside the range of the tables, where the sampler has no density.
    let line = r#"{"wi":[0,0,1],"wo":[0,0,1],"wavelength":1000}"#;
    let answer = &eval(&["--preset", "flat", "--method", "exact"], &[line])[0];
    assert!(answer["f"].as_f64().unwrap() > 0.0 && answer["pdf"].is_null(), "{answer}");
    // 0.9998 is of unit length within the tolerance.
    let line = r#"{"wi":[0,0,0.9998],"wo":[0,0,1],"wavelength":550}"#;
    let exact = r#"{"wi":[0,0,1],"wo":[0,0,1],"wavelength":550}"#;
    let answers = eval(&["--preset", "flat"], &[line, exact]);
    assert_eq!(answers[0], answers[1]);
}

#[test]
fn answers_keep_the_order_of_the_lines() {
    // Several buffers of lines; the value at a plane's mirror direction differs with each wavelength.
    let count = 20_000;
    let nm = |i: usize| 400.0 + 300.0 * i as f64 / count as f64;
    let lines: Vec<String> =
        (0..count).map(|i| json!({"wi": [0, 0, 1], "wo": [0, 0, 1], "wavelength": nm(i)}).to_string()).collect();
    let answers = eval(&["--preset", "flat"], &lines);
    assert_eq!(answers.len(), count);
    // The peak of the ensemble's kernel, 4πs²/λ² with s = 16.25 µm.
    for (i, answer) in answers.iter().enumerate() {
        let expected = 4.0 * PI * (16.25 / (nm(i) * 1e-3)).powi(2);
        let found = answer["f"].as_f64().unwrap();
        // Tables are single precision.
        assert!((found / expected - 1.0).abs() < 1e-3, "{i}: {found}, {expected}");
    }
}

#[test]
fn an_array_of_wavelengths_gives_an_array_and_the_mean_density() {
    let line =
        |nm: Value| json!({"wi": [0.6, 0, 0.8], "wo": [-0.5, 0.1, 0.74f64.sqrt()], "wavelength": nm}).to_string();
    let lines = [line(json!(450.0)), line(json!(610.0)), line(json!([450.0, 610.0])), line(json!([450.0]))];
    let answers = eval(&["--preset", "blazed", "--coherence-length", "5", "--conserve-energy", "false"], &lines);
    assert_eq!(answers[2]["f"], json!([answers[0]["f"], answers[1]["f"]]));
    assert_eq!(answers[3]["f"], json!([answers[0]["f"]]));
    let mean = 0.5 * (answers[0]["pdf"].as_f64().unwrap() + answers[1]["pdf"].as_f64().unwrap());
    assert!((answers[2]["pdf"].as_f64().unwrap() / mean - 1.0).abs() < ROUNDING);
}

#[test]
fn the_reflectance_is_reciprocal() {
    let pairs: Vec<_> = directions(200).zip(directions(400).skip(200)).collect();
    let line = |a: &[f64; 3], b: &[f64; 3]| json!({"wi": a, "wo": b, "wavelength": 520}).to_string();
    let forth: Vec<_> = pairs.iter().map(|(a, b)| line(a, b)).collect();
    let back: Vec<_> = pairs.iter().map(|(a, b)| line(b, a)).collect();
    for extra in [
        &["--eta", "0.2", "--k", "3"][..],
        &["--eta", "1.56"],
        &["--obliquity", "small_slope"],
        &["--model", "patch", "--shadowing"],
        &["--method", "exact"],
    ] {
        let arguments = [&["--preset", "blazed", "--coherence-length", "30"], extra].concat();
        for (a, b) in eval(&arguments, &forth).iter().zip(eval(&arguments, &back)) {
            let (a, b) = (a["f"].as_f64().unwrap(), b["f"].as_f64().unwrap());
            assert!((a - b).abs() <= ROUNDING * a.max(b), "{arguments:?}: {a} {b}");
        }
    }
}

#[test]
fn the_fresnel_factor_multiplies_the_value_alone() {
    let line = [r#"{"wi":[0.6,0,0.8],"wo":[-0.6,0,0.8],"wavelength":550}"#];
    let bare = &eval(&["--preset", "flat"], &line)[0];
    let metal = &eval(&["--preset", "flat", "--eta", "0.2", "--k", "3"], &line)[0];
    let index = sunbeam::scattering::ComplexIndex { eta: 0.2, k: 3.0 };
    // At the mirror direction the half vector is the normal.
    let expected = sunbeam::scattering::fresnel_unpolarised(0.8, index) * bare["f"].as_f64().unwrap();
    assert!((metal["f"].as_f64().unwrap() / expected - 1.0).abs() < ROUNDING);
    assert_eq!(metal["pdf"], bare["pdf"]);
}

#[test]
fn samples_match_eval() {
    let arguments = ["--preset", "blazed", "--coherence-length", "8", "--conserve-energy", "false", "--eta", "1.5"];
    let queries: Vec<Value> = directions(300)
        .zip(directions(600).skip(300))
        .enumerate()
        .map(|(i, (wi, r))| {
            let u = [r[0] * 0.499 + 0.5, r[1] * 0.499 + 0.5, r[2] * 0.999];
            json!({"wi": wi, "wavelength": if i % 2 == 0 { json!([450.0, 600.0]) } else { json!(550.0) }, "u": u})
        })
        .collect();
    let input: Vec<String> = queries.iter().map(Value::to_string).collect();
    let output = succeeded(run(&[&["sample"], &arguments[..]].concat(), input.join("\n")));
    let samples: Vec<Value> = output.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    assert_eq!(samples.len(), queries.len());
    let (mut kept, mut back) = (Vec::new(), Vec::new());
    for (query, sample) in queries.iter().zip(&samples) {
        if sample["wo"].is_null() {
            assert_eq!(sample["pdf"], json!(0.0));
            let zero = if query["wavelength"].is_array() { json!([0.0, 0.0]) } else { json!(0.0) };
            assert_eq!(sample["weight"], zero);
        } else {
            back.push(json!({"wi": query["wi"], "wo": sample["wo"], "wavelength": query["wavelength"]}).to_string());
            kept.push(sample);
        }
    }
    assert!(kept.len() > queries.len() / 2 && kept.len() < queries.len(), "{}", kept.len());
    for (sample, answer) in kept.iter().zip(eval(&arguments, &back)) {
        let (pdf, cos) = (sample["pdf"].as_f64().unwrap(), sample["wo"][2].as_f64().unwrap());
        // Normalising wo again moves it by a rounding, which the slope of the kernel amplifies.
        assert!((answer["pdf"].as_f64().unwrap() / pdf - 1.0).abs() < 1e-9, "{sample} {answer}");
        let list = |v: &Value| v.as_array().cloned().unwrap_or_else(|| vec![v.clone()]);
        for (weight, f) in list(&sample["weight"]).iter().zip(list(&answer["f"])) {
            let (weight, expected) = (weight.as_f64().unwrap(), f.as_f64().unwrap() * cos / pdf);
            assert!((weight - expected).abs() <= 1e-9 * expected.max(1e-3), "{sample} {answer}");
        }
    }
    let bad = [
        (json!({"wi": [0, 0, 1], "wavelength": 500, "u": [0.5, 1, 0.5]}), "[0, 1)"),
        (json!({"wi": [0, 0, 1], "wavelength": 300, "u": [0.5, 0.5, 0.5]}), "300"),
        (json!({"wi": [0, 0, 1], "wavelength": 500, "u": [0.5, 0.5]}), "2 components"),
    ];
    for (query, reason) in bad {
        let output = succeeded(run(&["sample", "--preset", "flat"], query.to_string()));
        assert!(output.contains("error") && output.contains(reason), "{output}");
    }
}
