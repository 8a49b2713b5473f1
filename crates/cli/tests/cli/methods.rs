//! The published methods, their options, and the arguments that they refuse.

use super::service::{directions, eval};
use super::support::{refused, run, succeeded};
use serde_json::{Value, json};

/// The arguments of a map in the colours of GPU Gems.
const GEMS_MAP: [&str; 7] = ["brdf-map", "-o", "a.exr", "--method", "stam", "--stam-form", "gems"];

#[test]
fn arguments_that_contradict_the_method_are_refused() {
    let cases: &[(&[&str], &[&str])] = &[
        (&["eval", "--method", "flss", "--model", "ensemble"], &["flss", "--model must be patch"]),
        (&["eval", "--method", "pq", "--conserve-energy", "true"], &["pq", "--conserve-energy must be false"]),
        (&["eval", "--method", "nmm", "--tiling", "aperiodic"], &["nmm", "--tiling must be periodic"]),
        (&["eval", "--terms", "9"], &["--terms", "--method table", "accepts no option"]),
        (&["eval", "--method", "flss", "--lambda-step", "5"], &["--lambda-step", "flss", "--terms, --neighbourhood"]),
        (&["brdf-map", "--method", "stam", "--repeats", "3", "-o", "a.exr"], &["--repeats", "stam", "--period-um"]),
        (&["brdf-map", "--method", "nmm", "--lambda-step", "5", "-o", "a.exr"], &["--lambda-step", "--weighted"]),
        (&["eval", "--method", "flss", "--terms", "257"], &["\"terms\"", "257", "1 to 256"]),
        (&["eval", "--method", "flss", "--terms", "-1"], &["--terms", "-1", "invalid"]),
        (&["eval", "--method", "flss", "--neighbourhood", "-1"], &["--neighbourhood", "-1", "invalid"]),
        (&["eval", "--method", "pq", "--repeats", "-1,2"], &["--repeats", "-1", "whole number"]),
        (&["eval", "--method", "flss", "--series", "fourier"], &["fourier", "chebyshev, taylor"]),
        (&["eval", "--method", "pq", "--repeats", "2.5"], &["2.5", "whole number"]),
        (&["eval", "--method", "stam", "--preset", "flat"], &["no period", "period_um"]),
        (&["eval", "--method", "stam", "--stam-form", "gems"], &["gems", "by wavelength", "spacing"]),
        (&["evaluate", "--method", "stam", "--stam-form", "gems"], &["gems", "by wavelength"]),
        (&["brdf-map", "--method", "stam", "--stam-form", "cg", "-o", "a.exr"], &["cg", "spacing, gems"]),
        (&["brdf-map", "--method", "flss", "--stam-form", "gems", "-o", "a.exr"], &["--stam-form", "flss", "--terms"]),
        (
            &["brdf-map", "--method", "stam", "--gems-sharpness", "9", "-o", "a.exr"],
            &["--gems-sharpness", "--stam-form"],
        ),
        (&[&GEMS_MAP[..], &["--gems-sharpness", "-1"]].concat(), &["\"gems_sharpness\"", "-1", "0 to 10000"]),
        (&[&GEMS_MAP[..], &["--gems-highlight", "1,2"]].concat(), &["1,2", "three numbers"]),
        (&[&GEMS_MAP[..], &["--gems-highlight", "1,2,-3"]].concat(), &["\"gems_highlight\"", "-3", "0 to 100"]),
        (&[&GEMS_MAP[..], &["--obliquity", "unit"]].concat(), &["--obliquity", "--stam-form gems"]),
        (&[&GEMS_MAP[..], &["--shadowing"]].concat(), &["--shadowing", "--stam-form gems"]),
        (&[&GEMS_MAP[..], &["--eta", "1.5"]].concat(), &["--eta", "--stam-form gems"]),
        (&[&GEMS_MAP[..], &["--k", "3"]].concat(), &["--k", "--stam-form gems"]),
        (&["eval", "--method", "colour-table"], &["colour-table", "by wavelength", "table"]),
        (
            &["brdf-map", "--method", "colour-table", "--model", "patch", "--conserve-energy", "true", "-o", "a.exr"],
            &["must be false"],
        ),
        (&["brdf-map", "--method", "colour-table", "--table-resolution", "9", "-o", "a.exr"], &["9", "0.25 to 4"]),
        (
            &["brdf-map", "--method", "colour-table", "--table-resolution", "2", "--theory", "rigorous", "-o", "a.exr"],
            &["--table-resolution", "--theory rigorous"],
        ),
        (&["evaluate", "--theta-i", "90"], &["\"theta-i\"", "90"]),
        (&["evaluate", "--angles=-40,-50"], &["--angles", "-55,-40"]),
        (&["evaluate", "--preset", "flat"], &["no period", "\"angles\""]),
        (&["evaluate", "--wavelength-step", "0"], &["\"wavelength-step\"", "0.1 to 20"]),
        (
            &["evaluate", "--preset", "blazed", "--period", "0.2", "--theta-i", "0"],
            &["no visible first order", "0.2", "\"angles\""],
        ),
        (
            &["evaluate", "--preset", "blazed", "--angles=-80,-70", "--angle-step", "0.1"],
            &["-75°", "order zero", "\"angles\""],
        ),
        (
            &["evaluate", "--preset", "lamellar", "--theory", "rigorous", "--eta", "1.5", "--cover-eta", "1.5"],
            &["\"eta\"", "1.5", "nothing is reflected", "--theory scalar"],
        ),
    ];
    for (arguments, mentioned) in cases {
        let message = refused(arguments);
        assert!(mentioned.iter().all(|part| message.contains(part)), "{arguments:?}: {message}");
    }
    // Only the tables have the rigorous theory.
    for method in ["flss", "nmm", "pq", "stam"] {
        for command in ["render", "brdf-map", "eval"] {
            let output: &[&str] = if command == "eval" { &[] } else { &["-o", "a.exr"] };
            let message = refused(&[&[command, "--method", method, "--theory", "rigorous"], output].concat());
            let said = format!("--method {method} assumes a phase screen: --theory must be scalar");
            assert!(message.contains(&said), "{command}: {message}");
        }
    }
}

#[test]
fn flss_and_nmm_match_the_direct_sum_of_a_patch() {
    let pairs: Vec<_> = directions(40).zip(directions(80).skip(40)).collect();
    let lines: Vec<String> =
        pairs.iter().map(|(wi, wo)| json!({"wi": wi, "wo": wo, "wavelength": [380, 550, 780]}).to_string()).collect();
    // A short window over a short tile lights most pairs.
    let surface =
        ["--preset", "sinusoidal", "--period", "1.3", "--coherence-length", "2.5", "--eta", "0.2", "--k", "3"];
    let patch = [&surface[..], &["--model", "patch", "--conserve-energy", "false"]].concat();
    let exact = eval(&[&patch[..], &["--method", "exact"]].concat(), &lines);
    let largest =
        |answers: &[Value], c: usize| answers.iter().map(|answer| answer["f"][c].as_f64().unwrap()).fold(0.0, f64::max);
    for method in ["flss", "nmm"] {
        let found = eval(&[&surface[..], &["--method", method]].concat(), &lines);
        for (found, direct) in found.iter().zip(&exact) {
            assert_eq!(found["pdf"], direct["pdf"], "one sampler serves both");
            for c in 0..3 {
                let (f, truth) = (found["f"][c].as_f64().unwrap(), direct["f"][c].as_f64().unwrap());
                // Amplitudes of far orders are cut at a tenth of the tolerance, 1e-3; such orders may be brighter.
                let brightest = largest(&exact, c);
                let allowed = 1e-3 * (truth * brightest).sqrt() + 1e-6 * brightest;
                assert!((f - truth).abs() < allowed, "{method}: {f} {truth} {brightest}");
            }
        }
    }
    for arguments in [&["--method", "pq", "--repeats", "2,3"][..], &["--method", "stam", "--period-um", "1.3"]] {
        let found = eval(&[&surface[..], arguments].concat(), &lines);
        assert!((0..3).all(|c| largest(&found, c) > 0.0), "{arguments:?}");
    }
    let line = r#"{"wi":[0,0,1],"wo":[0,0,1],"wavelength":[550,800]}"#;
    let answer = &eval(&["--preset", "flat", "--method", "flss"], &[line])[0];
    assert!(answer["error"].as_str().unwrap().contains("[380, 780]"), "{answer}");
}

#[test]
fn published_methods_find_the_spacing_of_the_blazed_grating() {
    let folder = tempfile::tempdir().unwrap();
    let plot = folder.path().join("blazed.svg");
    let sources = ["--preset", "blazed", "--theta-i", "75", "--angles=-55,-40", "--wavelength-step", "5"];
    for method in ["flss", "nmm", "pq", "exact"] {
        let arguments = ["evaluate", "--method", method, "--model", "patch", "--plot", plot.to_str().unwrap()];
        let found: Value = serde_json::from_str(&succeeded(run(&[&arguments[..], &sources].concat(), ""))).unwrap();
        // Single 2014 found 2499.997 nm with a variance of 0.377 nm². A step of 0.01° is 0.2 nm² at 50°, and the
        // Gaussian over λ² has its peak some thousandths of a degree beside the order.
        assert!((found["mean_nm"].as_f64().unwrap() - 2500.0).abs() < 1.0, "{method}: {found}");
        assert!(found["variance_nm2"].as_f64().unwrap() < 0.5, "{method}: {found}");
        assert_eq!(found["peaks_deg"].as_array().unwrap().len(), 80);
        let drawing = std::fs::read_to_string(&plot).unwrap();
        assert!(drawing.contains("<svg") && drawing.contains("grating equation"), "{method}");
    }
}

/// The index scales the reflectance of all angles, down to zero where it is that of the medium above the relief. The
/// response of the relief does not depend on it.
#[test]
fn the_spacing_does_not_depend_on_the_index() {
    let arguments = ["evaluate", "--preset", "blazed", "--wavelength-step", "20", "--angle-step", "0.05"];
    let evaluated = |index: &[&str]| {
        let unscaled = ["--conserve-energy", "false", "--obliquity", "stam"];
        let text = succeeded(run(&[&arguments[..], &unscaled, index].concat(), ""));
        serde_json::from_str::<Value>(&text).unwrap()
    };
    let cover = ["--cover-eta", "1.5"];
    for (with, without) in [
        (vec!["--eta", "1"], vec![]),
        (vec!["--eta", "1", "--method", "flss"], vec!["--method", "flss"]),
        ([&["--eta", "1.5"], &cover[..]].concat(), cover.to_vec()),
    ] {
        let (found, expected) = (evaluated(&with), evaluated(&without));
        assert!((found["mean_nm"].as_f64().unwrap() - 2500.0).abs() < 2.0, "{with:?}: {found}");
        assert_eq!(found["peaks_deg"], expected["peaks_deg"], "{with:?}");
    }
}

#[test]
fn a_range_far_below_a_step_is_one_angle() {
    let angles = "--angles=-45,-44.9999999999999";
    let arguments = |method| ["evaluate", "--preset", "blazed", "--wavelength-step", "20", angles, "--method", method];
    for method in ["table", "exact", "pq"] {
        let found: Value = serde_json::from_str(&succeeded(run(&arguments(method), ""))).unwrap();
        assert_eq!(found["peaks_deg"], json!(vec![-45.0; 20]), "{method}");
    }
    // Methods of a narrow window, and of separate orders, have no light at this angle at most wavelengths.
    for method in ["flss", "nmm", "stam"] {
        let message = refused(&arguments(method));
        assert!(message.contains("\"angles\" needs a wider range"), "{method}: {message}");
    }
}
